"""The imports of each source file from this project, as paths from the root: includes of C++, imports of Python and TypeScript.

Every import counts, also inside a function, under TYPE_CHECKING, or for types only. Generated and external files are left out. So
is __init__.py if an import names only another module of its package, because Python loads it with every module.
"""

from __future__ import annotations

import ast
import pathlib
import posixpath
import re
from collections.abc import Iterator

TOPS = ("core", "server", "client")
ELSEWHERE = {"node_modules", "dist", "gen", "build", "unreal"}
PYTHON_ROOTS = ("client/python/src", "client/blender")
TYPESCRIPT_PACKAGES = {"lpdeform-client": "client/web/client/src/index.ts"}
INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)
IMPORT = re.compile(r'\b(?:from|import)\s*\(?\s*"([^"]+)"')


def imports_of(root: pathlib.Path) -> dict[str, list[str]]:
    found = {".cc": cpp, ".h": cpp, ".py": python, ".ts": typescript}
    files = {str(path.relative_to(root)): path for top in TOPS for path in (root / top).rglob("*")
             if path.suffix in found and not ELSEWHERE & set(path.relative_to(root).parts)}
    return {name: sorted({other for other in found[path.suffix](name, path.read_text(), set(files)) if other != name})
            for name, path in sorted(files.items())}


def cpp(name: str, text: str, names: set[str]) -> Iterator[str]:
    for include in INCLUDE.findall(text):
        for path in (include, posixpath.join(posixpath.dirname(name), include)):
            if path in names:
                yield path
                break


def python(name: str, text: str, names: set[str]) -> Iterator[str]:
    here = posixpath.dirname(name)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            wanted = [(root, alias.name, "") for root in (here, *PYTHON_ROOTS) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            roots = [posixpath.normpath(posixpath.join(here, *[".."] * (node.level - 1)))] if node.level else [here, *PYTHON_ROOTS]
            wanted = [(root, node.module or "", alias.name) for root in roots for alias in node.names]
        else:
            continue
        for root, module, member in wanted:
            base = posixpath.join(root, *module.split("."))
            paths = [posixpath.join(base, f"{member}.py")] if member else []
            yield from [path for path in [*paths, f"{base.rstrip('/')}.py", posixpath.join(base, "__init__.py")] if path in names][:1]


def typescript(name: str, text: str, names: set[str]) -> Iterator[str]:
    for wanted in IMPORT.findall(text):
        path = posixpath.normpath(posixpath.join(posixpath.dirname(name), re.sub(r"\.js$", ".ts", wanted)))
        path = TYPESCRIPT_PACKAGES.get(wanted, path)
        if path in names:
            yield path
