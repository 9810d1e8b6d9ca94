"""Runs every example in the package and its README as it stands."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from pathlib import Path

import pytest

import lpdeform
from conftest import Server

README = Path(__file__).resolve().parent.parent / "README.md"
MODULES = [one.name for one in pkgutil.iter_modules(lpdeform.__path__) if one.name != "v1"]


@pytest.fixture(autouse=True)
def address(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LPDEFORM_ADDRESS", server.address)


@pytest.mark.parametrize("module", MODULES)
def test_examples_of_the_package_hold(module: str) -> None:
    assert doctest.testmod(importlib.import_module(f"lpdeform.{module}")).failed == 0


def test_examples_of_the_readme_hold() -> None:
    outcome = doctest.testfile(str(README), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert outcome.attempted > 10
    assert outcome.failed == 0
