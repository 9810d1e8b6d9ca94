"""FBX, COLLADA and 3MF files that lpdeform-convert makes GLB of, and what it says of files that it cannot read:
convert_test.py LPDEFORM_CONVERT LPDEFORM."""

from __future__ import annotations

import json
import math
import random
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

ROWS, COLUMNS = 8, 12
POINTS = [
    (math.cos(2 * math.pi * k / COLUMNS), math.sin(2 * math.pi * k / COLUMNS), float(row))
    for row in range(ROWS + 1)
    for k in range(COLUMNS)
]
"""A tube along z, of radius 1 and height 8."""
TRIANGLES = [
    triangle
    for row in range(ROWS)
    for k in range(COLUMNS)
    for a, b in [(row * COLUMNS + k, row * COLUMNS + (k + 1) % COLUMNS)]
    for triangle in [(a, b, b + COLUMNS), (a, b + COLUMNS, a + COLUMNS)]
]


def flat(rows: list[tuple[float, ...]]) -> list[float]:
    return [number for row in rows for number in row]


def dae() -> bytes:
    """With z up, 5 above the ground, and a texture that is not there."""
    places, corners = " ".join(map(str, flat(POINTS))), " ".join(map(str, flat(TRIANGLES)))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_images><image id="image"><init_from>http://textures.example/a.png</init_from></image></library_images>
  <library_effects><effect id="red-fx"><profile_COMMON>
    <newparam sid="surface"><surface type="2D"><init_from>image</init_from></surface></newparam>
    <newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
    <technique sid="standard"><lambert><diffuse><texture texture="sampler" texcoord="UV"/></diffuse></lambert></technique>
  </profile_COMMON></effect></library_effects>
  <library_materials><material id="red" name="red"><instance_effect url="#red-fx"/></material></library_materials>
  <library_geometries><geometry id="tube" name="tube"><mesh>
    <source id="places"><float_array id="numbers" count="{3 * len(POINTS)}">{places}</float_array>
      <technique_common><accessor source="#numbers" count="{len(POINTS)}" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="vertices"><input semantic="POSITION" source="#places"/></vertices>
    <triangles count="{len(TRIANGLES)}" material="red"><input semantic="VERTEX" source="#vertices" offset="0"/>
      <p>{corners}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene"><node id="node" name="pipe">
    <translate>0 0 5</translate>
    <instance_geometry url="#tube"><bind_material><technique_common>
      <instance_material symbol="red" target="#red"/>
    </technique_common></bind_material></instance_geometry>
  </node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>""".encode()


class Id(NamedTuple):
    """Of an object in FBX."""

    number: int


def fbx() -> bytes:
    """FBX 7.4, binary, with y up, 5 above the ground."""
    places = flat([(x, z, -y) for x, y, z in POINTS])
    corners = [corner for a, b, c in TRIANGLES for corner in (a, b, -c - 1)]

    def value(one: Any) -> bytes:
        if isinstance(one, bytes):
            return b"S" + struct.pack("<I", len(one)) + one
        if isinstance(one, list):
            kind, code = ("d", b"d") if isinstance(one[0], float) else ("i", b"i")
            data = struct.pack(f"<{len(one)}{kind}", *one)
            return code + struct.pack("<III", len(one), 0, len(data)) + data
        if isinstance(one, float):
            return b"D" + struct.pack("<d", one)
        return b"L" + struct.pack("<q", one.number) if isinstance(one, Id) else b"I" + struct.pack("<i", one)

    def block(at: int, name: bytes, properties: tuple[object, ...], inside: tuple[Any, ...]) -> bytes:
        values = b"".join(map(value, properties))
        head = 13 + len(name)
        body = b""
        for child in inside:
            body += block(at + head + len(values) + len(body), *child)
        if inside:
            body += bytes(13)
        end = at + head + len(values) + len(body)
        return struct.pack("<IIIB", end, len(properties), len(values), len(name)) + name + values + body

    def property70(*values: object) -> tuple[bytes, tuple[object, ...], tuple[object, ...]]:
        return (b"P", values, ())

    settings = (
        property70(b"UpAxis", b"int", b"Integer", b"", 1),
        property70(b"UpAxisSign", b"int", b"Integer", b"", 1),
        property70(b"UnitScaleFactor", b"double", b"Number", b"", 1.0),
    )
    place = (property70(b"Lcl Translation", b"Lcl Translation", b"", b"A", 0.0, 5.0, 0.0),)
    tops = (
        (b"FBXHeaderExtension", (), ((b"FBXHeaderVersion", (1003,), ()), (b"FBXVersion", (7400,), ()))),
        (b"GlobalSettings", (), ((b"Version", (1000,), ()), (b"Properties70", (), settings))),
        (
            b"Objects",
            (),
            (
                (
                    b"Geometry",
                    (Id(1), b"tube\x00\x01Geometry", b"Mesh"),
                    ((b"Vertices", (places,), ()), (b"PolygonVertexIndex", (corners,), ()), (b"GeometryVersion", (124,), ())),
                ),
                (b"Model", (Id(2), b"pipe\x00\x01Model", b"Mesh"), ((b"Version", (232,), ()), (b"Properties70", (), place))),
            ),
        ),
        (b"Connections", (), ((b"C", (b"OO", Id(2), Id(0)), ()), (b"C", (b"OO", Id(1), Id(2)), ()))),
    )
    data = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", 7400)
    for top in tops:
        data += block(len(data), *top)
    return data + bytes(13 + 160)


def threemf() -> bytes:
    """With z up, 5 above the ground."""
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z + 5}"/>' for x, y, z in POINTS)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in TRIANGLES)
    model = (
        '<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1" type="model" name="pipe"><mesh>'
        f"<vertices>{vertices}</vertices><triangles>{triangles}</triangles>"
        '</mesh></object></resources><build><item objectid="1"/></build></model>'
    )
    relations = (
        '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    with tempfile.TemporaryFile() as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as parts:
            parts.writestr("_rels/.rels", relations)
            parts.writestr("3D/3dmodel.model", model)
        file.seek(0)
        return file.read()


FILES = {"tube.dae": dae(), "tube.fbx": fbx(), "tube.3mf": threemf()}


class Convert(unittest.TestCase):
    program = ""
    command_line = ""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def convert(self, name: str, data: bytes | None, out: str = "out.glb") -> subprocess.CompletedProcess[str]:
        if data is not None:
            (self.folder / name).write_bytes(data)
        return subprocess.run([self.program, name, out], cwd=self.folder, capture_output=True, text=True, timeout=300)

    def refusal(self, name: str, data: bytes | None, out: str = "out.glb") -> str:
        said = self.convert(name, data, out)
        self.assertEqual(said.returncode, 2, said)
        self.assertEqual(said.stderr.count("\n"), 1, said.stderr)
        self.assertFalse((self.folder / out).exists())
        return said.stderr

    def test_each_format_becomes_a_glb_that_stands_upright_where_it_stood(self) -> None:
        for name, data in FILES.items():
            with self.subTest(name):
                said = self.convert(name, data)
                self.assertEqual(said.returncode, 0, said.stderr)
                shown = subprocess.run(
                    [self.command_line, "deform", "out.glb", "--handles", self.handles(), "--out", "bent.off"],
                    cwd=self.folder, capture_output=True, text=True, timeout=300)
                self.assertEqual(shown.returncode, 0, shown.stderr)
                lines = (self.folder / "bent.off").read_text().splitlines()
                count, faces, _ = map(int, lines[1].split())
                self.assertEqual((count, faces), (len(POINTS), len(TRIANGLES)))
                points = [tuple(map(float, line.split())) for line in lines[2 : 2 + count]]
                for axis, low, high in ((0, -1, 1), (1, 5, 13), (2, -1, 1)):
                    self.assertAlmostEqual(min(point[axis] for point in points), low, 5)
                    self.assertAlmostEqual(max(point[axis] for point in points), high, 5)

    def handles(self) -> str:
        """All vertices stay: the file is shown as it is."""
        info = subprocess.run([self.command_line, "info", "out.glb", "--json"], cwd=self.folder, capture_output=True, text=True, check=True)
        vertices = list(range(json.loads(info.stdout)["vertices"]))
        (self.folder / "all.json").write_text(json.dumps({"handles": [{"name": "all", "vertices": vertices}]}))
        return "all.json"

    def test_names_come_along_and_textures_do_not(self) -> None:
        self.convert("tube.dae", FILES["tube.dae"])
        glb = (self.folder / "out.glb").read_bytes()
        document = json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])
        self.assertEqual([material["name"] for material in document["materials"]], ["red"])
        self.assertNotIn(b"textures.example", glb)
        self.assertNotIn("images", document)

    def test_what_cannot_be_read_is_refused_in_one_line_and_nothing_is_written(self) -> None:
        self.assertIn("There is no file none.fbx", self.refusal("none.fbx", None))
        self.assertIn("ends in none of .fbx, .dae and .3mf", self.refusal("a.blend", b""))
        self.assertIn("does not end in .glb", self.refusal("tube.dae", FILES["tube.dae"], "out.obj"))
        for name in FILES:
            for data in (b"", b"PK\x03\x04", b"<COLLADA>", bytes(1000)):
                self.assertIn(f"{name} cannot be read: ", self.refusal(name, data))

    def test_a_refusal_is_plain_text_whatever_the_file_says(self) -> None:
        for text in ("a&#10;b", "a&#27;[31mb", "a&#155;31mb", "a&#127;b"):
            data = FILES["tube.dae"].replace(b'source="#places"', f'source="#{text}"'.encode())
            said = self.refusal("tube.dae", data)
            self.assertIn("a", said)
            self.assertTrue(said[:-1].isprintable(), said)
            self.assertRegex(said, r"[^. ]\.\n$")

    def test_damaged_files_are_read_or_refused_in_one_line(self) -> None:
        chance = random.Random(7)
        for name, data in FILES.items():
            for _ in range(12):
                changed = bytearray(data)
                for _ in range(chance.randrange(1, 5)):
                    changed[chance.randrange(len(changed))] = chance.randrange(256)
                if chance.random() < 0.3:
                    del changed[chance.randrange(len(changed)) :]
                said = self.convert(name, bytes(changed))
                self.assertIn(said.returncode, (0, 2), said)
                self.assertEqual((said.stdout + said.stderr).count("\n"), 1, said)


if __name__ == "__main__":
    Convert.command_line = sys.argv.pop()
    Convert.program = sys.argv.pop()
    unittest.main()
