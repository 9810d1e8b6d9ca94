"""Writes the inputs that fuzzing begins with: seeds.py PROTOC OUT. Meshes in every format, schedules of calls around a small strip,
and the frames that tests/golden has recorded."""

import base64
import json
import pathlib
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROTOC, OUT = sys.argv[1], pathlib.Path(sys.argv[2])

VERTICES = [(x, y, z) for x in range(6) for y in range(2) for z in (0.1 * x * y,)]
FACES = [face for k in range(0, 10, 2) for face in ((k, k + 2, k + 1), (k + 1, k + 2, k + 3))]


def write(target, name, data):
    folder = OUT / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)


def meshes():
    """The first byte is the format: OFF, OBJ, PLY, STL."""
    lines = ["OFF", f"{len(VERTICES)} {len(FACES)} 0"]
    lines += [" ".join(map(str, vertex)) for vertex in VERTICES] + ["3 " + " ".join(map(str, face)) for face in FACES]
    write("mesh", "off", b"\0" + "\n".join(lines).encode())
    write("mesh", "coff", b"\0COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 0 1 0 1\n0 1 0 0 0 1 1\n3 0 1 2\n")
    lines = ["# a strip", "o strip", "g left"] + ["v " + " ".join(map(str, vertex)) for vertex in VERTICES] + ["vt 0 0", "vn 0 0 1"]
    lines += ["f " + " ".join(f"{k + 1}/1/1" for k in face) for face in FACES] + ["f -1 -2 -3 -4"]
    write("mesh", "obj", b"\1" + "\n".join(lines).encode())
    header = (f"element vertex {len(VERTICES)}\nproperty double x\nproperty double y\nproperty double z\n"
              f"element face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n").encode()
    for order, sign in (("little", "<"), ("big", ">")):
        body = b"".join(struct.pack(sign + "3d", *vertex) for vertex in VERTICES)
        body += b"".join(struct.pack(sign + "B3i", 3, *face) for face in FACES)
        write("mesh", f"ply_{order}", b"\2ply\nformat binary_" + order.encode() + b"_endian 1.0\n" + header + body)
    lines = [" ".join(map(str, vertex)) for vertex in VERTICES] + ["3 " + " ".join(map(str, face)) for face in FACES]
    write("mesh", "ply_ascii", b"\2ply\nformat ascii 1.0\ncomment x\n" + header + "\n".join(lines).encode())
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *(value for k in face for value in VERTICES[k]), 0) for face in FACES)
    write("mesh", "stl", b"\3" + bytes(80) + struct.pack("<I", len(FACES)) + body)
    facets = "".join("facet normal 0 0 1\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in (VERTICES[k] for k in face)) +
                     "endloop\nendfacet\n" for face in FACES)
    write("mesh", "stl_ascii", b"\3solid strip\n" + facets.encode() + b"endsolid strip\n")


def gltfs():
    """The first byte says how it is written. A strip under a turned and a mirrored node, with indices; normals that are not floats; a
    sparse accessor without a bufferView; no indices at all."""
    positions = b"".join(struct.pack("<3f", *vertex) for vertex in VERTICES)
    indices = b"".join(struct.pack("<3H", *face) for face in FACES)
    normals = b"".join(struct.pack("<4b", 0, 0, 127, 0) for _ in VERTICES)
    buffer = positions + indices + normals
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(positions)},
             {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
             {"buffer": 0, "byteOffset": len(positions) + len(indices), "byteLength": len(normals), "byteStride": 4}]
    bounds = {"min": [0, 0, 0], "max": [5, 1, 0.5]}
    places = {"bufferView": 0, "componentType": 5126, "count": len(VERTICES), "type": "VEC3", **bounds}
    accessors = [places, {"bufferView": 1, "componentType": 5123, "count": 3 * len(FACES), "type": "SCALAR"},
                 {"bufferView": 2, "componentType": 5120, "normalized": True, "count": len(VERTICES), "type": "VEC3"}]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "materials": [{"name": "skin"}],
        "nodes": [{"mesh": 0, "name": "strip", "rotation": [0, 0, 0.6, 0.8], "children": [2]}, {"mesh": 0, "scale": [-1, 1, 2]}, {}],
        "meshes": [{"name": "strip", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 2}, "indices": 1, "material": 0}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(buffer)}]}

    def glb(root, binary):
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        binary += bytes(-len(binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def inside(root):
        uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
        return json.dumps({**root, "buffers": [{"byteLength": len(buffer), "uri": uri}]}).encode()

    write("gltf", "glb", b"\0" + glb(document, buffer))
    write("gltf", "gltf", b"\7" + inside(document))
    sparse = {"componentType": 5126, "count": len(VERTICES), "type": "VEC3", **bounds, "sparse": {
        "count": 2, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}}
    write("gltf", "sparse", b"\2" + inside({**document, "accessors": [sparse, *accessors[1:]]}))
    without = {**document, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (4, 5, 6)]}]}
    write("gltf", "modes", b"\4" + glb(without, buffer))


def answers():
    """The first byte is the size of the pieces."""
    def block(kind, content):
        return struct.pack(">BI", kind, len(content)) + content

    good = block(0, b"\x08\x01") + block(0, b"") + block(0x80, b"grpc-status: 0\r\n")
    write("answer", "good", b"\1" + good)
    write("answer", "error", b"\3" + block(0x80, b"Grpc-Status:5\r\ngrpc-message:no%20session\r\ngrpc-status-details-bin:CAUSAmhp\r\n"))
    write("answer", "compressed", b"\xff" + block(1, b"x"))
    write("answer", "large", b"\x10" + struct.pack(">BI", 0, 5 << 20))


def quoted(data):
    return '"' + "".join(f"\\{byte:03o}" for byte in data) + '"'


def encode(text):
    command = [PROTOC, f"--proto_path={ROOT}", f"--proto_path={ROOT / 'proto'}", "--encode=lpdeform.fuzz.Schedule", "tests/fuzz/schedule.proto"]
    return subprocess.run(command, input=text.encode(), check=True, capture_output=True, cwd=ROOT).stdout


def integers(*values):
    return quoted(struct.pack(f"<{len(values)}I", *values))


def schedules():
    data = b"".join(struct.pack("<3d", *vertex) for vertex in VERTICES) + b"".join(struct.pack("<3I", *face) for face in FACES)
    size = f"vertex_count: {len(VERTICES)} face_count: {len(FACES)} scalar: SCALAR_FLOAT64"
    handles = (f'handles {{ name: "a" set {{ vertices {{ inline: {integers(0, 1)} }} motion {{ fixed {{}} }} }} }} '
               f'handles {{ name: "b" set {{ vertices {{ inline: {integers(10, 11)} }} motion {{ rigid {{ axis {{ y: 1 }} '
               f'angle_radians: 0.8 translation {{ z: 1 }} }} }} }} }}')
    create = f"calls {{ create_session {{ mesh {{ {size} data {{ inline: {quoted(data)} }} }} {handles} }} }}"
    solve = "calls { solve { certify: true trace: true } }"
    stream = "calls { open_stream { options { credit: 2 encoding: %s with_normals: %s } } }"
    update = "calls { update_handles { update { input_seq: %d %s } } }"
    move = 'handles { name: "b" move { rigid { axis { x: 1 } angle_radians: 1 } } }'
    kinds = [f'points {{ faces {{ inline: {integers(3)} }} scalar: SCALAR_FLOAT64 barycentric {{ inline: {quoted(struct.pack("<3d", .2, .3, .5))} }} }}',
             f'vertices {{ inline: {integers(5)} }} soft {{ weight: 2 }}', f'vertices {{ inline: {integers(5)} }} orientation {{}}',
             f'vertices {{ inline: {integers(5)} }} axis_lock {{ axis {{ x: 1 }} }}',
             f'vertices {{ inline: {integers(5)} }} plane_lock {{ normal {{ z: 1 }} }}',
             f'vertices {{ inline: {integers(5)} }} footprint_radius: 2']
    write("calls", "solve", encode(create + solve))
    for p in (1, 1.5, 6):
        settings = f"settings {{ p {{ uniform: {p} }} stiffness {{ automatic {{ strength: 1 }} }} }}"
        write("calls", f"p_{p}", encode(create + update % (1, settings) + solve))
    for k, kind in enumerate(kinds):
        handle = f'handles {{ name: "c" set {{ {kind} motion {{ fixed {{}} }} }} }}'
        write("calls", f"kind_{k}", encode(create + update % (1, handle) + solve + update % (2, 'handles { name: "c" remove {} }')))
    for encoding in ("ENCODING_RAW", "ENCODING_QUANTIZED", "ENCODING_COMPRESSED"):
        live = create + stream % (encoding, "true") + update % (1, move) + stream % (encoding, "false") + update % (2, "resize { scale { x: 2 y: 1 z: 1 } }")
        write("calls", encoding.lower(), encode(live + "calls { get_session {} } calls { ack_frames { frame_seq: 1 } }"))
    region = f"settings {{ region {{ vertices {{ inline: {integers(4, 5, 6, 7, 8, 9, 10, 11)} }} }} solver {{ method: METHOD_LINE_SEARCH max_iterations: 9 }} }}"
    write("calls", "region", encode(create + update % (3, region) + solve + "calls { acquire_writer {} } calls { delete_session {} } calls { list_sessions { page_size: 2 } }"))
    for method in ("LOCAL_GLOBAL", "CONIC", "MULTIRESOLUTION"):
        write("calls", method.lower(), encode(create + update % (1, f"settings {{ solver {{ method: METHOD_{method} }} p {{ uniform: {1 if method == 'CONIC' else 2} }} }}") + solve))
    half = len(data) // 2
    uploads = (f"calls {{ create_upload {{ size_bytes: {len(data)} }} }} calls {{ upload_part {{ data: {quoted(data[:half])} }} }} "
               f"calls {{ upload_part {{ offset: {half} data: {quoted(data[half:])} }} }} calls {{ create_session {{ mesh {{ {size} data {{ upload: \"u\" }} }} "
               f"weld {{ position {{}} }} }} }} calls {{ delete_upload {{}} }}")
    write("calls", "upload", encode(uploads))
    others = (stream % ("ENCODING_RAW", "true") + update % (1, move) + solve + "calls { get_session {} } calls { snapshot {} } "
              "calls { undo_update {} } calls { take_better {} } calls { acquire_writer {} } calls { list_sessions {} } calls { delete_session {} }")
    write("calls", "second_caller", encode(create + others.replace("calls {", "calls { caller: 1") + solve))


def frames():
    """Each message of a stream, with two bytes of its length before it."""
    for k, stream in enumerate(json.loads((ROOT / "tests/golden/frames.json").read_text())["streams"]):
        parts = [base64.b64decode(response) for response in stream["responses"]]
        write("frame", f"stream_{k}", b"".join(struct.pack("<H", len(part)) + part for part in parts))


meshes()
gltfs()
answers()
schedules()
frames()
