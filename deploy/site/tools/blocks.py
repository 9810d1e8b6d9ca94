#!/usr/bin/env python3
"""Runs every code block of the pages, in the order of the page, each page in a folder of its own.

    blocks.py WORK PAGE...    runs them; what the blocks of PAGE write stays in WORK/PAGE/
    blocks.py --self-test     each rule below catches a page that breaks it

A fence's language says what is done with it:
    sh                run by bash; the blocks of a page share a folder and a shell
    python            run by one interpreter for the page
    ts                type-checked, and run by Node
    text              compared with what the block before it printed; ... stands for anything
    {code-block} LANGUAGE, with a caption    written to the file that the caption names; a later sh block must use it
    {code-cell}       run while the site is built; the page must be a notebook, so that an error stops the build
Any other fence, and an indented block, is an error: nothing on a page goes without a test. In the pages, localhost:50051 is a
server and localhost:8080 a proxy for browsers; both are started here, on free ports."""

import contextlib
import dataclasses
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
BUILD = ROOT / "build" / "release"
PYTHON = ROOT / "build" / "python" / "bin" / "python"
WEB = ROOT / "client" / "web"
NODE = ROOT / "build" / "web-tools" / "bin" / "node"
MARK = "\x1eend of block\x1e"
PATIENCE = 280  # seconds that the blocks of one kind on a page may take; never reached where all is well

# Runs the files that it is given in one namespace, and marks where each ends.
RUN_PYTHON = f"""
import sys
space = {{"__name__": "__main__"}}
for name in sys.argv[1:]:
    exec(compile(open(name).read(), name, "exec"), space)
    print({MARK!r}, end="", flush=True)
"""


class WrongPage(Exception):
    pass


@dataclasses.dataclass
class Block:
    line: int
    language: str
    text: str
    file: str = ""     # its caption
    printed: str = ""  # by it, once it was run
    is_done: bool = False


def blocks_of(text):
    """The code blocks of a page. Fences of other directives, such as figures, are left out."""
    found, lines, at = [], text.splitlines(), 0
    while at < len(lines):
        opening = re.match(r"( *)(`{3,}|~{3,})(.*)$", lines[at])
        if not opening:
            refuse_other_code(lines, at)
            at += 1
            continue
        indent, fence, info = opening.groups()
        end = next((k for k in range(at + 1, len(lines)) if re.match(rf" *{re.escape(fence)}[`~]* *$", lines[k])), None)
        if end is None:
            raise WrongPage(f"line {at + 1}: the fence does not end")
        body = [line[len(indent):] for line in lines[at + 1:end]]
        found += one_block(at + 1, info.strip(), body)
        at = end + 1
    return found


def refuse_other_code(lines, at):
    if re.match(r"(    |\t)", lines[at]) and (at == 0 or not lines[at - 1].strip()) and not is_in_list(lines, at):
        raise WrongPage(f"line {at + 1}: an indented block is not run; use a fence with a language")
    if re.match(r"\s*<(pre|code)\b", lines[at]):
        raise WrongPage(f"line {at + 1}: code as HTML is not run; use a fence with a language")


def is_in_list(lines, at):
    """Whether an indented line goes on with an item of a list."""
    for line in reversed(lines[:at]):
        if re.match(r" *([-*]|\d+\.) ", line):
            return True
        if line.strip() and not line.startswith(" "):
            return False
    return False


def one_block(line, info, body):
    directive = re.match(r"\{([\w-]+)\} *(\S*)", info)
    if not directive:
        return [Block(line, info, "\n".join(body) + "\n")]
    if directive[1] not in ("code-block", "code-cell"):
        if directive[1] in ("code", "sourcecode", "literalinclude", "parsed-literal", "doctest"):
            raise WrongPage(f"line {line}: {directive[1]} is not run")
        if directive[1] == "eval-rst" and not all(re.match(r"\.\. auto|   :|$", one) for one in body):
            raise WrongPage(f"line {line}: eval-rst may only name what autodoc is to document")
        if any(re.match(r" *(```|~~~|:::|    )", one) for one in body):
            raise WrongPage(f"line {line}: code within {directive[1]} is not run")
        return []
    options, caption = 0, ""
    while options < len(body) and (option := re.match(r":([\w-]+): *(.*)", body[options])):
        caption = option[2] if option[1] == "caption" else caption
        options += 1
    text = "\n".join(body[options:]).lstrip("\n") + "\n"
    if directive[1] == "code-cell":
        return [Block(line, "code-cell", text)]
    if not caption:
        raise WrongPage(f"line {line}: a code-block needs a caption, the name of the file that it becomes")
    return [Block(line, directive[2], text, caption)]


def is_as_expected(expected, printed):
    """Whether it is what a text block says, whose ... stands for anything."""
    pattern = r".*?".join(re.escape(part) for part in expected.strip().split("..."))
    return re.fullmatch(pattern, printed.strip(), re.DOTALL) is not None


class Page:
    def __init__(self, text, folder, environment, addresses):
        for shown, real in addresses.items():
            text = text.replace(shown, real)
        self.text, self.folder, self.environment = text, folder, environment
        self.blocks = blocks_of(text)
        folder.mkdir(parents=True, exist_ok=True)

    def run(self):
        """The number of blocks."""
        known = {"sh", "python", "ts", "text", "code-cell"}
        for block in self.blocks:
            if block.language not in known and not block.file:
                raise WrongPage(f"line {block.line}: nothing runs a block of '{block.language}'")
        self.write_files()
        self.run_shell(self.unnamed("sh"))
        self.run_python(self.unnamed("python"))
        for block in self.unnamed("ts"):
            self.run_typescript(block)
        self.leave_cells()
        self.compare()
        for block in self.blocks:
            if not block.is_done:
                raise WrongPage(f"line {block.line}: the block of '{block.language}' was not run")
        return len(self.blocks)

    def unnamed(self, language):
        return [block for block in self.blocks if block.language == language and not block.file]

    def write_files(self):
        for at, block in enumerate(self.blocks):
            if not block.file:
                continue
            (self.folder / block.file).write_text(block.text)
            later = "".join(other.text for other in self.blocks[at + 1:] if other.language in ("sh", "cmake"))
            if block.file not in later and not (block.file == "CMakeLists.txt" and "cmake -S . " in later):
                raise WrongPage(f"line {block.line}: no later block uses {block.file}")
            block.is_done = True

    def call(self, command, blocks):
        """Runs a command that marks the end of each block, and notes what each has printed."""
        done = subprocess.run(command, cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=PATIENCE)
        printed = done.stdout.split(MARK)
        for block, text in zip(blocks, printed[:-1]):
            block.printed, block.is_done = text, True
        if done.returncode != 0 or len(printed) != len(blocks) + 1:
            failed = blocks[min(len(printed), len(blocks)) - 1]
            raise WrongPage(f"line {failed.line}: the block of '{failed.language}' ended with {done.returncode}:\n"
                            f"{printed[-1]}{done.stderr}")

    def run_shell(self, blocks):
        if blocks:
            script = "".join(f"{block.text}\nprintf '%s' $'{MARK}'\n" for block in blocks)
            self.call(["bash", "-euo", "pipefail", "-c", script], blocks)

    def run_python(self, blocks):
        names = []
        for block in blocks:
            names.append(self.folder / f"line_{block.line}.py")
            names[-1].write_text("\n" * block.line + block.text)
        if blocks:
            self.call([PYTHON, "-c", RUN_PYTHON, *names], blocks)

    def run_typescript(self, block):
        file = self.folder / f"line_{block.line}.mts"
        file.write_text(block.text + f"\nprocess.stdout.write({MARK!r});\n")
        if not (self.folder / "node_modules").exists():
            (self.folder / "node_modules").symlink_to(WEB / "node_modules")
        compiler = WEB / "node_modules" / "typescript" / "bin" / "tsc"
        options = "--noEmit --strict --target es2022 --module nodenext --skipLibCheck --types node".split()
        checked = subprocess.run([NODE, compiler, *options, file], cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE)
        if checked.returncode != 0:
            raise WrongPage(f"line {block.line}: {checked.stdout}{checked.stderr}")
        self.call([NODE, file], [block])

    def leave_cells(self):
        is_notebook = re.match(r"---\n.*?^file_format: mystnb$.*?^kernelspec:$.*?^---$", self.text, re.DOTALL | re.MULTILINE)
        for block in self.blocks:
            if block.language == "code-cell":
                if not is_notebook:
                    raise WrongPage(f"line {block.line}: a code-cell runs only on a page that says it is a notebook")
                block.is_done = True

    def compare(self):
        for at, block in enumerate(self.blocks):
            if block.language != "text" or block.file:
                continue
            before = next((other for other in reversed(self.blocks[:at]) if other.language != "text"), None)
            if before is None or before.language == "code-cell" or before.file:
                raise WrongPage(f"line {block.line}: no block before this text prints")
            if not is_as_expected(block.text, before.printed):
                raise WrongPage(f"line {block.line}: this was to be printed:\n{block.text}but this was:\n{before.printed}")
            block.is_done = True


@contextlib.contextmanager
def services(texts):
    """A server, and Envoy where a page needs it; gives the addresses that stand for those of the pages."""
    sys.path.insert(0, str(ROOT / "tests" / "e2e"))
    import programs
    programs.SERVER, programs.CLI = str(BUILD / "bin" / "lpdeform-server"), str(BUILD / "bin" / "lpdeform")
    server = programs.RunningServer("--log-level", "error")
    addresses = {"localhost:50051": server.address}
    envoy = None
    try:
        if any("localhost:8080" in text for text in texts):
            from envoy_test import Envoy
            envoy = Envoy("--server", server.address)
            addresses["localhost:8080"] = envoy.address
        yield addresses
    finally:
        if envoy:
            envoy.stop()
        server.stop()


def environment_of(addresses):
    own = dict(os.environ)
    own["PATH"] = os.pathsep.join([str(BUILD / "bin"), str(NODE.parent), own["PATH"], str(PYTHON.parent)])
    own["PYTHONPATH"] = str(ROOT / "build" / "docs-tools")
    own["MPLBACKEND"] = "agg"
    own["CMAKE_PREFIX_PATH"] = str(BUILD.parent / "docs" / "installed")
    if shutil.which("ccache"):  # a page that has not changed is not compiled again
        own["CMAKE_CXX_COMPILER_LAUNCHER"] = "ccache"
    return own


def run_pages(work, names):
    texts = {name: pathlib.Path(name).read_text() for name in names}
    count, problems = 0, []
    with services(texts.values()) as addresses:
        for name, text in texts.items():
            try:
                folder = work / pathlib.Path(name).stem
                count += Page(text, folder, environment_of(addresses), addresses).run()
            except (WrongPage, subprocess.TimeoutExpired) as problem:
                problems.append(f"{name}: {problem}")
    if count == 0:
        problems.append("no block was found")
    return count, problems


GOOD = """# A page

```sh
echo one two
```

```text
one ...
```

```python
one = 1
```

```python
print(one)
```

```text
1
```

```ts
const one: number = 1;
console.log(one);
```

```text
1
```

```{code-block} python
:caption: two.py
print(2)
```

```sh
python two.py
```

```{figure} picture.png
A picture.
```

- item

    its second paragraph
"""
WRONG = {
    "a shell block that fails": "```sh\nfalse\n```\n",
    "a shell block that ends the shell early": "```sh\nexit 0\n```\n\n```sh\nfalse\n```\n",
    "a Python block that fails": "```python\nassert False\n```\n",
    "a Python block that ends Python early": "```python\nimport os\nos._exit(0)\n```\n",
    "a TypeScript block of wrong types": "```ts\nconst one: number = \"two\";\n```\n",
    "a TypeScript block that fails": "```ts\nthrow new Error();\n```\n",
    "an output that differs": "```sh\necho one\n```\n\n```text\ntwo\n```\n",
    "an output of nothing": "```text\ntwo\n```\n",
    "a language that nothing runs": "```rust\nfn main() {}\n```\n",
    "a fence without a language": "```\nsomething\n```\n",
    "an indented block": "Text:\n\n    something\n",
    "code as HTML": "<pre>something</pre>\n",
    "code within a note": "````{note}\n```sh\nfalse\n```\n````\n",
    "a file that nothing uses": "```{code-block} cpp\n:caption: main.cc\nint main() {}\n```\n\n```sh\ntrue\n```\n",
    "a code-block without a file": "```{code-block} cpp\nint main() {}\n```\n",
    "a cell outside of a notebook": "```{code-cell} ipython3\nprint(1)\n```\n",
    "a fence that does not end": "```sh\ntrue\n",
}


def self_test():
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        for at, (what, text) in enumerate({"": GOOD, **WRONG}.items()):
            try:
                Page(text, work / str(at), environment_of({"localhost:50051": "localhost:1"}), {}).run()
                missed += [f"{what} is not caught"] if what else []
            except WrongPage as problem:
                missed += [] if what else [f"what is right is called wrong: {problem}"]
    return missed


def main(arguments):
    if arguments == ["--self-test"]:
        problems = self_test()
    elif len(arguments) > 1:
        count, problems = run_pages(pathlib.Path(arguments[0]).resolve(), arguments[1:])
        print(f"{count} blocks were run")
    else:
        sys.exit(__doc__)
    for problem in problems:
        print("blocks:", problem, file=sys.stderr)
    sys.exit(bool(problems))


if __name__ == "__main__":
    main(sys.argv[1:])
