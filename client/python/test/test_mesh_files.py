"""Mesh files that are read, deformed and written: what is beside the mesh comes back to the bit."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import lpdeform
from conftest import PATIENCE, ROOT, Place

Document = dict[str, Any]
ROWS = 10
"""Squares along the strip."""


class Made:
    """A GLB under construction, with one buffer."""

    def __init__(self) -> None:
        self.buffer = b""
        self.views: list[Document] = []
        self.accessors: list[Document] = []

    def add(self, values: npt.ArrayLike, dtype: str, bounds: bool = False) -> int:
        array = np.asarray(values, dtype)
        self.buffer += bytes(-len(self.buffer) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes})
        self.buffer += array.tobytes()
        component = {"<f4": 5126, "<u2": 5123, "<u1": 5121}[dtype]
        kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(array), "type": kind}
        if bounds:
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def strip_document() -> tuple[Document, bytes]:
    """A strip along x whose squares share no vertices, with all that a primitive can have. A second node draws it, turned."""
    made = Made()
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    points = np.concatenate([square + [k, 0, 0] for k in range(ROWS)])
    count = len(points)
    corners = np.concatenate([np.array([0, 1, 2, 0, 2, 3]) + 4 * k for k in range(ROWS)])
    attributes = {
        "POSITION": made.add(points, "<f4", bounds=True),
        "NORMAL": made.add(np.tile([0, 0, 1], (count, 1)), "<f4"),
        "TEXCOORD_0": made.add(points[:, :2] / ROWS, "<f4"),
        "JOINTS_0": made.add(np.zeros((count, 4)), "<u1"),
        "WEIGHTS_0": made.add(np.tile([1, 0, 0, 0], (count, 1)), "<f4"),
        "_OWN": made.add(np.arange(count), "<f4"),
    }
    plain = {name: attributes[name] for name in ("POSITION", "NORMAL", "TEXCOORD_0")}
    primitive = {
        "indices": made.add(corners, "<u2"),
        "material": 0,
        "targets": [{"POSITION": made.add(np.full((count, 3), 0.125), "<f4", bounds=True)}],
    }
    document = {
        "asset": {"version": "2.0", "generator": "a test"},
        "extensionsUsed": ["ACME_secret", "KHR_materials_unlit"],
        "extensions": {"ACME_secret": {"keep": [1, 2.5, "me"]}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0, "name": "strip", "extras": {"note": 7}},
            {"mesh": 1, "name": "skinned", "skin": 0},
            {"name": "joint"},
        ],
        "skins": [{"joints": [2]}],
        "meshes": [
            {"name": "sheet", "primitives": [{**primitive, "attributes": plain}]},
            {"name": "skin", "primitives": [{**primitive, "attributes": attributes}]},
        ],
        "materials": [{"name": "paper", "extensions": {"KHR_materials_unlit": {}}}],
        "accessors": made.accessors,
        "bufferViews": made.views,
        "buffers": [{"byteLength": len(made.buffer)}],
    }
    return document, made.buffer


def glb(document: Document, buffer: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    buffer += bytes(-len(buffer) % 4)
    words = [len(text), 0x4E4F534A], [len(buffer), 0x004E4942], [0x46546C67, 2, 28 + len(text) + len(buffer)]
    first, second, head = (np.array(one, "<u4").tobytes() for one in words)
    return head + first + text + second + buffer


def parts_of(data: bytes) -> tuple[Document, bytes]:
    size = int(np.frombuffer(data, "<u4", 1, 12)[0])
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def without_bounds(document: Document) -> Document:
    found: Document = json.loads(json.dumps(document))
    for accessor in found["accessors"]:
        accessor.pop("min", None)
        accessor.pop("max", None)
    return found


def assert_valid(*paths: Path) -> None:
    """The Khronos validator has nothing against them."""
    program = """
      const { validateBytes } = require("gltf-validator");
      (async () => {
        for (const path of process.argv.slice(1)) {
          const { issues } = await validateBytes(new Uint8Array(require("fs").readFileSync(path)), { maxIssues: 100 });
          for (const one of issues.messages) if (one.severity <= 1) console.log(path, JSON.stringify(one));
        }
      })();
    """
    node = ROOT / "build/web-tools/bin/node"
    said = subprocess.run(
        [node, "-e", program, *paths], cwd=ROOT / "client/web", capture_output=True, text=True, check=True, timeout=PATIENCE
    )
    assert said.stdout == ""


@pytest.fixture
def strip(tmp_path: Path) -> Path:
    path = tmp_path / "strip.glb"
    path.write_bytes(glb(*strip_document()))
    return path


def test_the_file_of_these_tests_is_valid(strip: Path) -> None:
    assert_valid(strip)


def test_a_glb_is_read_where_its_scene_has_it(strip: Path) -> None:
    mesh = lpdeform.read_mesh(strip)
    assert mesh.vertices.shape == (2 * 4 * ROWS, 3) and mesh.vertices.dtype == np.float64
    assert mesh.faces.shape == (2 * 2 * ROWS, 3) and mesh.faces.dtype == np.uint32
    assert mesh.splits_vertices
    assert [part.node for part in mesh.parts] == ["strip", "skinned"]
    assert mesh.parts[1] == lpdeform.MeshPart("skinned", "skin", 4 * ROWS, 4 * ROWS)
    assert sorted(mesh.groups) == ["paper", "sheet", "skin", "skinned", "strip"]
    assert np.array_equal(mesh.groups["sheet"], np.arange(4 * ROWS))
    assert repr(mesh) == "<MeshFile of 80 vertices and 40 faces>"
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1


def test_its_arrays_outlive_it(strip: Path) -> None:
    vertices, groups = lpdeform.read_mesh(strip).vertices, lpdeform.read_mesh(strip).groups
    lpdeform.read_mesh(strip)
    assert vertices[4 * ROWS - 1].tolist() == [ROWS - 1, 1, 0]
    assert groups["sheet"][-1] == 4 * ROWS - 1


def test_at_rest_a_glb_comes_back_to_the_bit(strip: Path, tmp_path: Path) -> None:
    mesh = lpdeform.read_mesh(strip)
    mesh.write(tmp_path / "again.glb", mesh.vertices)
    assert (tmp_path / "again.glb").read_bytes() == strip.read_bytes()


def ends(v: npt.NDArray[Any]) -> dict[str, Any]:
    lifted = lpdeform.RigidMotion(translation=(0, 0, 3))
    return {"base": v[:, 0] == 0, "tip": (v[:, 0] == ROWS, lifted)}


def test_a_glb_is_welded_deformed_and_written_with_all_else_to_the_bit(place: Place, strip: Path, tmp_path: Path) -> None:
    mesh = lpdeform.read_mesh(strip)
    result = lpdeform.deform(mesh, handles=ends(mesh.vertices), p=1.5, address=place.address)
    copies = result.positions[mesh.vertices[:, 0] == 3]
    assert len(np.unique(copies.round(12), axis=0)) == 2  # each once, although eight vertices lie there
    bent = tmp_path / "bent.glb"
    mesh.write(bent, result.positions)
    assert_valid(bent)
    assert np.abs(lpdeform.read_mesh(bent).vertices - result.positions).max() < 1e-6
    (before, old), (after, new) = parts_of(strip.read_bytes()), parts_of(bent.read_bytes())
    # Both meshes share accessors, and each gets positions and normals of its own. What was there before stays in its place.
    kept = len(before["accessors"])
    for mesh_of in (0, 1):
        was, now = (one["meshes"][mesh_of]["primitives"][0] for one in (before, after))
        assert {**was, "attributes": 0} == {**now, "attributes": 0}
        assert {name for name in was["attributes"] if was["attributes"][name] != now["attributes"][name]} <= {"POSITION", "NORMAL"}
    assert without_bounds(after)["accessors"][2:kept] == without_bounds(before)["accessors"][2:]
    assert {**after, "accessors": 0, "bufferViews": 0, "buffers": 0, "meshes": 0} == {
        **before, "accessors": 0, "bufferViews": 0, "buffers": 0, "meshes": 0}
    for accessor in before["accessors"][2:]:
        view = before["bufferViews"][accessor["bufferView"]]
        begin, end = view["byteOffset"], view["byteOffset"] + view["byteLength"]
        assert old[begin:end] == new[begin:end]


def test_a_session_welds_a_glb_unless_it_is_told_otherwise(place: Place, strip: Path, tmp_path: Path) -> None:
    mesh = lpdeform.read_mesh(strip)
    with lpdeform.open(mesh, address=place.address, handles=ends(mesh.vertices)) as session:
        frame = session.settle(PATIENCE)
        assert session.mesh_report.welded_vertices > 0
        mesh.write(tmp_path / "bent.gltf", frame.positions, adds_normals=True)
    assert_valid(tmp_path / "bent.gltf")
    with pytest.warns(lpdeform.SplitMeshWarning):
        lpdeform.open(mesh, weld=False, address=place.address, free_components="stay").close()


def test_an_obj_keeps_its_other_lines(tmp_path: Path) -> None:
    text = b"# own\r\nmtllib cloth.mtl\r\nv 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nvt 0 0\r\ng sheet\r\nusemtl red\r\nf 1/1 2/1 3/1 4/1\r\n"
    (tmp_path / "sheet.obj").write_bytes(text)
    mesh = lpdeform.read_mesh(str(tmp_path / "sheet.obj"))
    assert not mesh.splits_vertices and not mesh.groups and not mesh.parts and not mesh.notices
    moved = mesh.vertices.copy()
    moved[0, 2] = 7
    mesh.write(tmp_path / "bent.obj", moved)
    assert (tmp_path / "bent.obj").read_bytes() == text.replace(b"v 0 0 0", b"v 0 0 7")


def test_a_mesh_without_a_file_is_written_and_read_again(tmp_path: Path) -> None:
    vertices, faces = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]), np.array([[0, 1, 2]])
    for ending in ("glb", "gltf", "off", "obj", "ply"):
        path = tmp_path / f"one.{ending}"
        lpdeform.write_mesh(path, vertices, faces)
        again = lpdeform.read_mesh(path)
        assert np.array_equal(again.vertices, vertices) and np.array_equal(again.faces, faces)
    assert_valid(tmp_path / "one.glb", tmp_path / "one.gltf")


def damaged(change: Callable[[Document], object]) -> bytes:
    document, buffer = strip_document()
    change(document)
    return glb(document, buffer)


@pytest.mark.parametrize(
    ("data", "reason", "element"),
    [
        (glb(*strip_document())[:-9], "MESH_SYNTAX", "the GLB file"),
        (damaged(lambda d: d["accessors"][0].update(count=4000)), "MESH_SYNTAX", "accessor 0"),
        (damaged(lambda d: d["bufferViews"][0].update(byteOffset=1 << 60)), "MESH_SYNTAX", "bufferView 0"),
        (damaged(lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(POSITION=99)), "MESH_SYNTAX", "primitive 0 of mesh 0"),
        (damaged(lambda d: d["nodes"][0].update(children=[0])), "MESH_SYNTAX", "the nodes"),
        (damaged(lambda d: d.update(extensionsRequired=["ACME_secret"])), "MESH_UNSUPPORTED", 'the extension "ACME_secret"'),
        (
            damaged(lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"])),
            "MESH_UNSUPPORTED",
            'the extension "KHR_draco_mesh_compression"',
        ),
        (
            damaged(lambda d: d["bufferViews"][0].update(extensions={"EXT_meshopt_compression": {}})),
            "MESH_UNSUPPORTED",
            "bufferView 0",
        ),
        (
            damaged(
                lambda d: d["accessors"][0].update(
                    sparse={"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 99}}
                )
            ),
            "MESH_SYNTAX",
            "accessor 0",
        ),
    ],
    ids=["cut off", "too many", "offset", "no accessor", "circle", "extension", "unused compression", "compressed", "sparse"],
)
def test_a_broken_file_is_refused_by_its_part(tmp_path: Path, data: bytes, reason: str, element: str) -> None:
    path = tmp_path / "broken.glb"
    path.write_bytes(data)
    with pytest.raises(lpdeform.InvalidInput) as refused:
        lpdeform.read_mesh(path)
    assert refused.value.reason == reason
    assert element in refused.value.element


def test_names_keep_a_zero(tmp_path: Path) -> None:
    document, buffer = strip_document()
    document["nodes"][0]["name"], document["nodes"][1]["name"] = "a\0b", "a\0c"
    path = tmp_path / "zero.glb"
    path.write_bytes(glb(document, buffer))
    mesh = lpdeform.read_mesh(path)
    assert {"a\0b", "a\0c"} < set(mesh.groups)
    assert [part.node for part in mesh.parts] == ["a\0b", "a\0c"]


@pytest.mark.parametrize("uri", ["%ff.bin", "../" + 100 * "\u00fc"], ids=["no UTF-8", "long"])
def test_a_refusal_is_text_whatever_the_file_says(tmp_path: Path, uri: str) -> None:
    document, buffer = strip_document()
    document["buffers"] = [{"byteLength": len(buffer), "uri": uri}]
    path = tmp_path / "named.gltf"
    path.write_text(json.dumps(document))
    with pytest.raises(lpdeform.InvalidInput) as refused:
        lpdeform.read_mesh(path)
    assert refused.value.reason == "MESH_SYNTAX" and refused.value.element == "buffer 0"


@pytest.mark.parametrize("name", ["mesh.fbx", "mesh", "mesh.glb.zip", "mesh.stl2"])
def test_other_formats_are_refused_by_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(lpdeform.InvalidInput, match=r"ends in none of \.glb, \.gltf, \.off, \.obj, \.ply, \.stl"):
        lpdeform.read_mesh(tmp_path / name)


def test_wrong_calls_are_refused_and_write_nothing(strip: Path, tmp_path: Path) -> None:
    mesh = lpdeform.read_mesh(strip)
    out = tmp_path / "out.glb"
    wrong: list[tuple[str, Callable[[], object]]] = [
        ("MESH_FILE_NOT_FOUND", lambda: lpdeform.read_mesh(tmp_path / "none.glb")),
        ("MESH_FORMAT_UNKNOWN", lambda: lpdeform.read_mesh(tmp_path / ".glb")),
        ("ARRAY_TYPE", lambda: lpdeform.read_mesh(7)),  # type: ignore[arg-type]
        ("NAME_ENCODING", lambda: lpdeform.read_mesh("a\0.glb")),
        ("NAME_ENCODING", lambda: lpdeform.read_mesh("\ud800.glb")),
        ("POSITIONS_SIZE", lambda: mesh.write(out, mesh.vertices[1:])),
        ("ARRAY_TYPE", lambda: mesh.write(out, mesh.vertices, weld="much")),  # type: ignore[arg-type]
        ("WELD_TOLERANCE", lambda: mesh.write(out, mesh.vertices, weld=0.5)),
        ("MESH_UNSUPPORTED", lambda: mesh.write(out, mesh.vertices * 1e300)),
        *(
            ("MESH_NOT_FINITE", lambda ending=ending: mesh.write(tmp_path / f"out.{ending}", mesh.vertices * np.nan))
            for ending in ("glb", "gltf", "obj", "off", "ply")
        ),
        ("MESH_FORMAT_UNKNOWN", lambda: mesh.write(tmp_path / "out.stl", mesh.vertices)),
        ("FILE_NOT_WRITTEN", lambda: mesh.write(tmp_path / "no" / "out.glb", mesh.vertices)),
        ("MESH_INDEX_OUT_OF_RANGE", lambda: lpdeform.write_mesh(out, [[0, 0, 0]], [[0, 0, 1]])),
        ("MESH_INDEX_OUT_OF_RANGE", lambda: lpdeform.write_mesh(tmp_path / "out.obj", [[0, 0, 0]], [[0, 0, 1]])),
        ("MESH_EMPTY", lambda: lpdeform.write_mesh(out, np.zeros((0, 3)), np.zeros((0, 3), int))),
        ("MESH_NOT_FINITE", lambda: lpdeform.write_mesh(out, [[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])),
    ]
    for reason, call in wrong:
        with pytest.raises(lpdeform.LpdeformError) as refused:
            call()
        assert refused.value.reason == reason
    assert sorted(path.name for path in tmp_path.iterdir()) == ["strip.glb"]


def test_a_file_for_stl_says_what_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(lpdeform.InvalidInput) as refused:
        lpdeform.write_mesh(tmp_path / "out.stl", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert "use one of .glb, .gltf, .off, .obj, .ply" in str(refused.value)
    assert refused.value.limit == "one of .glb, .gltf, .off, .obj, .ply"


def test_without_the_compiled_module_the_call_says_so() -> None:
    program = """
        import sys
        sys.modules["lpdeform._core"] = None
        import lpdeform
        try:
            lpdeform.read_mesh("a.glb")
        except lpdeform.LpdeformError as error:
            print(error.reason)
    """
    said = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True, timeout=PATIENCE
    )
    assert said.stdout == "NO_SOLVER\n"
