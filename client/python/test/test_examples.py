"""Runs every program and every notebook of the folder examples."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
PROGRAMS = sorted(path.name for path in EXAMPLES.glob("*.py") if path.name != "shapes.py")
NOTEBOOKS = sorted(path.name for path in EXAMPLES.glob("*.ipynb"))
PATIENCE = 240.0


def run(program: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "MPLBACKEND": "Agg", "PYTHONWARNINGS": "error"}
    return subprocess.run(
        [sys.executable, "-c", program], cwd=EXAMPLES, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_runs_and_says_something(name: str) -> None:
    done = run((EXAMPLES / name).read_text())
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_draws(name: str) -> None:
    cells = [cell for cell in json.loads((EXAMPLES / name).read_text())["cells"] if cell["cell_type"] == "code"]
    code = "\n\n".join("".join(cell["source"]) for cell in cells)
    done = run(code + "\n\nimport matplotlib.pyplot as drawn\nprint(len(drawn.get_fignums()))\n")
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[-1]) >= 2


def test_there_are_a_dozen_and_the_readme_lists_them() -> None:
    readme = (EXAMPLES / "README.md").read_text()
    assert len(PROGRAMS) + len(NOTEBOOKS) == 12
    assert len(NOTEBOOKS) == 3
    for name in [*PROGRAMS, *NOTEBOOKS]:
        assert f"[{name}]({name})" in readme
