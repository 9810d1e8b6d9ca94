"""The check that a wheel names the licence of each of its files."""

import importlib.util
import pathlib
import zipfile

import pytest

NATIVE = pathlib.Path(__file__).parents[1] / "native"
TEXTS = ["lpdeform", "nanobind", "robin-map", "eigen3", "nlohmann-json3", "absl", "hwy", "meshoptimizer", "tbb"]
FILES = [
    "lpdeform/",  # auditwheel gives folders entries of their own
    "lpdeform/session.py",
    "lpdeform/_core.abi3.so",
    "lpdeform/py.typed",
    "lpdeform/v1/frame_pb2.py",
    "lpdeform.libs/",
    "lpdeform.libs/libabsl_base-3d8a3ce5.so.20220623.0.0",
    "lpdeform.libs/libtbb-4d79fbbd.so.12.8",
    "lpdeform-0.1.0.dist-info/RECORD",
]


def faults(wheel: pathlib.Path) -> list[str]:
    spec = importlib.util.spec_from_file_location("check_licences", NATIVE / "check_licences.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.faults(str(wheel))


@pytest.fixture
def wheel(tmp_path: pathlib.Path) -> pathlib.Path:
    return tmp_path / "lpdeform.whl"


def write(wheel: pathlib.Path, files: list[str], texts: list[str]) -> None:
    with zipfile.ZipFile(wheel, "w") as out:
        for name in files:
            out.writestr(name, "")
        out.write(NATIVE / "licences.txt", "lpdeform/licences/README.txt")
        for name in texts:
            out.writestr(f"lpdeform/licences/{name}.txt", 600 * "x")


def test_a_repaired_wheel_with_all_texts_passes(wheel: pathlib.Path) -> None:
    write(wheel, FILES, TEXTS)
    assert faults(wheel) == []


def test_a_library_without_a_licence_is_named(wheel: pathlib.Path) -> None:
    write(wheel, [*FILES, "lpdeform.libs/libstray-1.so.2"], TEXTS)
    assert [fault.rpartition(": ")[2] for fault in faults(wheel)] == [
        "no licence is named for lpdeform.libs/libstray-1.so.2"
    ]


def test_a_text_that_is_missing_is_named(wheel: pathlib.Path) -> None:
    write(wheel, FILES, [name for name in TEXTS if name != "tbb"])
    assert [fault.rpartition(": ")[2] for fault in faults(wheel)] == ["the text tbb.txt is missing"]
