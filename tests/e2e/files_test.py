"""What the programs read and write: meshes in and out, info, fields and groups, resizing."""

import json
import math
import os
import random
import struct
import subprocess

import programs
from programs import OnShapes, main, read_bytes, read_off, read_off_faces, read_ply, read_text, run


def normal(points, face):
    """Of a triangle, as long as twice its area."""
    a, b, c = (points[v] for v in face)
    u, v = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def dot(u, v):
    return sum(a * b for a, b in zip(u, v))


def noisy_ball(rows, noise):
    """A ball of radius 1 with poles on the z axis, as the text of an OFF file; `noise` is the standard deviation of the radii."""
    around, pick = 2 * rows, random.Random(11)
    points, faces = [], []
    for row in range(rows + 1):
        for k in range(around if 0 < row < rows else 1):
            down, turn, radius = math.pi * row / rows, 2 * math.pi * k / around, pick.gauss(1, noise)
            points.append((radius * math.sin(down) * math.cos(turn), radius * math.sin(down) * math.sin(turn),
                           radius * math.cos(down)))

    def at(row, k):
        return 0 if row == 0 else len(points) - 1 if row == rows else 1 + (row - 1) * around + k % around

    for row in range(rows):
        for k in range(around):
            if row > 0:
                faces.append((at(row, k), at(row + 1, k), at(row, k + 1)))
            if row + 1 < rows:
                faces.append((at(row, k + 1), at(row + 1, k), at(row + 1, k + 1)))
    lines = [f"{x!r} {y!r} {z!r}" for x, y, z in points] + ["3 {} {} {}".format(*face) for face in faces]
    return "\n".join(["OFF", f"{len(points)} {len(faces)} 0", *lines]) + "\n"


class Files(OnShapes):

    def test_all_outputs_are_written_at_once(self):
        outputs = [self.at(f"all.{ending}") for ending in ("ply", "obj", "off", "png")]
        self.deform(*(word for output in outputs for word in ("--out", output)))
        off = read_off(outputs[2])
        self.assertEqual([(v["x"], v["y"], v["z"]) for v in read_ply(outputs[0])], off)
        obj = [tuple(map(float, line.split()[1:4])) for line in read_text(outputs[1]).splitlines() if line.startswith("v ")]
        self.assertEqual(obj, off)
        self.assertEqual(read_bytes(outputs[3])[:8], b"\x89PNG\r\n\x1a\n")

    def test_obj_output_keeps_what_an_obj_input_has_beside_coordinates(self):
        source = self.write("square.obj", "mtllib square.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.25 0.75\n"
                                          "usemtl red\ng face\nf 1/1 2/1 3/1 4/1\n")
        handles = self.write("square.json", '{"handles": [{"name": "all", "vertices": [0, 2], "translate": [0, 0, 1]}]}')
        out = self.at("square_out.obj")
        self.assertEqual(run("deform", source, "--handles", handles, "--out", out).returncode, 0)
        kept, given = ([line for line in read_text(path).splitlines() if not line.startswith("v ")] for path in (out, source))
        self.assertEqual(kept, given)

    def split_bar(self):
        """The bar with a vertex and a normal for each corner of each face, and its handles."""
        points = read_off(self.at("bar.off"))
        lines = [line.split() for line in read_text(self.at("bar.off")).splitlines()]
        faces = [tuple(map(int, words[1:])) for words in lines if len(words) == 4 and words[0] == "3"]
        text, copies = [], {}
        for face in faces:
            a, b, c = (points[v] for v in face)
            u, w = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
            normal = (u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0])
            text.append("vn {} {} {}".format(*normal))
            for v in face:
                copies.setdefault(v, []).append(sum(map(len, copies.values())))
                text.append("v {} {} {}".format(*points[v]))
            text.append("f -3//-1 -2//-1 -1//-1")
        handles = json.loads(read_text(self.at("bar.json")))
        for handle in handles["handles"]:
            handle["vertices"] = [copy for v in handle["vertices"] for copy in copies[v]]
        return self.write("split.obj", "\n".join(text) + "\n"), self.write("split.json", json.dumps(handles)), copies

    def test_a_split_obj_comes_out_in_one_piece_and_ready_to_draw(self):
        mesh, handles, copies = self.split_bar()
        out, report = self.at("posed.obj"), self.at("posed.json")
        apart = run("deform", mesh, "--handles", handles, "--out", out)
        self.assertEqual(apart.returncode, 2, "each face is a component of its own")
        self.assertIn("comes apart where it is split", apart.stderr)
        self.assertIn("--weld", apart.stderr)
        done = run("deform", mesh, "--handles", handles, "--weld", "--normals", "--out", out, "--report", report)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(json.loads(read_text(report))["mesh"]["welded_vertices"], 0)
        self.deform("--out", self.at("whole.off"))
        whole = read_off(self.at("whole.off"))
        lines = read_text(out).splitlines()
        posed = [line for line in lines if line.startswith("v ")]
        for v, same in copies.items():
            self.assertEqual(len({posed[copy] for copy in same}), 1)
            for axis, word in enumerate(posed[same[0]].split()[1:]):
                self.assertAlmostEqual(float(word), whole[v][axis], delta=0.02)
        normals = [tuple(map(float, line.split()[1:])) for line in lines if line.startswith("vn ")]
        self.assertEqual(len(normals), len(posed))
        for normal in normals:
            self.assertAlmostEqual(math.hypot(*normal), 1, delta=1e-6)

    def split_glb(self, name):
        """The bar as a GLB with a vertex for each corner of each face, drawn at twice its size."""
        points, faces = read_off(self.at("bar.off")), read_off_faces(self.at("bar.off"))
        corners = [points[v] for face in faces for v in face]
        data = b"".join(struct.pack("<3f", *(x / 2 for x in corner)) for corner in corners)
        bounds = [[pick(corner[k] / 2 for corner in corners) for k in range(3)] for pick in (min, max)]
        text = json.dumps({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [2, 2, 2], "name": "bar"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}], "extras": {"kept": [1, "two"]}}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3", "min": bounds[0],
                           "max": bounds[1]}],
            "bufferViews": [{"buffer": 0, "byteLength": len(data)}], "buffers": [{"byteLength": len(data)}]}).encode()
        text += b" " * (-len(text) % 4)
        with open(self.at(name), "wb") as file:
            file.write(b"glTF" + struct.pack("<2I", 2, 28 + len(text) + len(data)) + struct.pack("<I", len(text)) + b"JSON" + text)
            file.write(struct.pack("<I", len(data)) + b"BIN\0" + data)
        copies = {v: [k for k, corner in enumerate(v for face in faces for v in face) if corner == v] for v in range(len(points))}
        return self.at(name), copies

    def test_a_glb_is_welded_and_comes_back_with_all_that_it_had(self):
        source, copies = self.split_glb("split.glb")
        handles = json.loads(read_text(self.at("bar.json")))
        for handle in handles["handles"]:
            handle["vertices"] = [copies[v][0] for v in handle["vertices"]]
        handles = self.write("glb.json", json.dumps(handles))
        out, positions = self.at("posed.glb"), self.at("posed.off")
        done = run("deform", source, "--handles", handles, "--out", out, "--out", positions)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.deform("--out", self.at("whole.off"))
        whole, posed = read_off(self.at("whole.off")), read_off(positions)
        for v, same in copies.items():
            self.assertEqual(len({posed[copy] for copy in same}), 1)
            for axis in range(3):
                self.assertAlmostEqual(posed[same[0]][axis], whole[v][axis], delta=0.02)
        before, after = (json.loads(read_bytes(path)[20:].split(b"BIN\0")[0][:-4]) for path in (source, out))
        for file in (before, after):
            del file["accessors"][0]["min"], file["accessors"][0]["max"]
        self.assertEqual(before, after)
        again = run("info", out)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn('node "bar"', again.stdout)
        apart = run("deform", source, "--handles", handles, "--no-weld", "--out", out)
        self.assertEqual(apart.returncode, 2, "each face is a component of its own")

    def test_a_glb_that_breaks_off_is_refused(self):
        source, _ = self.split_glb("whole.glb")
        with open(self.at("cut.glb"), "wb") as file:
            file.write(read_bytes(source)[:1000])
        self.assertIn("GLB", self.refused(2, "info", self.at("cut.glb")))

    def test_normals_that_no_output_holds_are_refused(self):
        out = self.at("no_normals.off")
        refusal = self.refused(2, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--normals", "--out", out)
        self.assertIn(".obj or .ply", refusal)
        self.assertFalse(os.path.exists(out))

    def test_info_prints_the_object_that_the_report_calls_mesh(self):
        info = run("info", self.at("creature.off"), "--json")
        self.assertEqual(info.returncode, 0)
        self.assertEqual(json.loads(info.stdout), self.deform("--max-iterations", 1, shape="creature")["mesh"])

    def test_info_for_people_names_counts(self):
        info = run("info", self.at("bar.off"))
        self.assertEqual(info.returncode, 0)
        self.assertRegex(info.stdout, r"(?m)^vertices +370$")
        self.assertRegex(info.stdout, r"(?m)^non manifold edges +0$")

    def test_info_shows_the_report_of_a_mesh_that_cannot_be_deformed_and_says_why(self):
        bad = self.write("flat.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n")
        info = run("info", bad, "--json")
        self.assertEqual(info.returncode, 2)
        self.assertEqual(json.loads(info.stdout)["zero_area_faces"], 1)
        self.assertIn("All 1 faces have zero area", info.stderr)

    def test_fields_are_read_and_summed_up(self):
        ends = self.write("p.txt", "".join(f"{1 + (k % 2)}\n" for k in range(370)))
        stiff = self.write("s.txt", "2\n" * 370)
        report = self.deform("--p-field", ends, "--stiffness-field", stiff, "--length-unit", 0.5)
        self.assertEqual(report["p"], {"min": 1, "mean": 1.5, "max": 2})
        doubled, plain = self.deform("--p", 2, "--stiffness-field", stiff), self.deform("--p", 2)
        self.assertAlmostEqual(doubled["energy"] / plain["energy"], 2, delta=1e-3)  # twice the tolerance's worth

    def test_p_from_the_geometry_is_the_same_through_a_server_and_may_be_painted_over(self):
        made = run("shape", "neck", "--out", self.at("neck.off"), "--handles", self.at("neck.json"))
        self.assertEqual(made.returncode, 0, made.stderr)
        alone = self.deform("--p", "auto:0.5", shape="neck")
        self.assertEqual(alone["p"], {"automatic": 0.5})
        served = self.deform("--p", "auto:0.5", "--server", self.server.address, shape="neck")
        self.assertEqual(served["energy"], alone["energy"])
        handles = json.loads(read_text(self.at("bar.json")))
        handles["groups"] = [{"name": "low", "vertices": [0, 1, 2], "p": 1, "stiffness": 7}]
        painted = self.write("painted.json", json.dumps(handles))
        out = self.at("painted_report.json")
        done = run("deform", self.at("bar.off"), "--handles", painted, "--p", "auto:0.5", "--p-group", "low=3", "--report", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(read_text(out))
        self.assertEqual(report["p"]["max"], 3)
        self.assertEqual(report["p"]["min"], 2)  # of the geometry: a bar has no joints
        self.assertIn("No joints were found", done.stderr)

    def test_noise_is_no_joint(self):
        noise = random.Random(1)
        points = [[x + noise.uniform(-0.1, 0.1) for x in point] for point in read_off(self.at("bar.off"))]  # 5 % of half a side
        faces = read_off_faces(self.at("bar.off"))
        lines = ["OFF", f"{len(points)} {len(faces)} 0", *(" ".join(map(str, x)) for x in points),
                 *(" ".join(map(str, (3, *face))) for face in faces)]
        mesh = self.write("noisy.off", "\n".join(lines) + "\n")

        def deformed(p):
            done = run("deform", mesh, "--handles", self.at("bar.json"), "--p", p, "--out", self.at("noisy_out.off"))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("No joints were found" in done.stderr, p == "auto")
            return read_off(self.at("noisy_out.off"))

        automatic, one, two = deformed("auto"), deformed("1"), deformed("2")
        self.assertLess(max(map(math.dist, automatic, two)), 0.1 * max(map(math.dist, one, two)))

    def test_obj_groups_are_painted_and_an_unknown_one_is_named(self):
        lines = [f"v {x} {y} {z}" for x, y, z in read_off(self.at("bar.off"))]
        words = [line.split() for line in read_text(self.at("bar.off")).splitlines()]
        faces = [line[1:] for line in words if len(line) == 4 and line[0] == "3"]
        lines += ["g front"] + ["f " + " ".join(str(int(v) + 1) for v in face) for face in faces[:10]]
        lines += ["g rest"] + ["f " + " ".join(str(int(v) + 1) for v in face) for face in faces[10:]]
        obj = self.write("grouped.obj", "\n".join(lines) + "\n")
        report_path = self.at("grouped_report.json")
        done = run("deform", obj, "--handles", self.at("bar.json"), "--p-group", "front=1.5", "--stiffness-group",
                   "rest=2", "--report", report_path)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(read_text(report_path))
        self.assertEqual((report["p"]["min"], report["p"]["max"]), (1.5, 2))
        refusal = self.refused(2, "deform", obj, "--handles", self.at("bar.json"), "--p-group", "back=1")
        self.assertIn("front, rest", refusal)

    def test_resize_makes_a_shape_shorter_without_folds(self):
        block, out = self.at("block.off"), self.at("shorter.off")
        self.assertEqual(run("shape", "block", "--out", block).returncode, 0)
        for factor in (0.9, 0.6):
            done = run("resize", block, out, "--scale", f"{factor},1,1")
            self.assertEqual(done.returncode, 0, done.stderr)
            rest, positions, faces = read_off(block), read_off(out), read_off_faces(block)
            scaled = [(factor * x, y, z) for x, y, z in rest]
            folded = [f for f, face in enumerate(faces) if dot(normal(scaled, face), normal(positions, face)) <= 0]
            self.assertEqual(folded, [], factor)

    def test_resize_meets_the_scaled_extent_through_a_server_and_alone(self):
        for options in ([], ["--server", self.server.address]):
            out = self.at("resized.off")
            done = run("resize", self.at("bar.off"), out, "--scale", "1,1.5,3", "--origin", "0,0,0", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.count("converged"), 2)  # 1 is shared; y and z differ from it
            positions = read_off(out)
            for axis, extent in enumerate((4, 6, 63)):
                self.assertAlmostEqual(min(position[axis] for position in positions), 0, 9)
                self.assertAlmostEqual(max(position[axis] for position in positions), extent, 9)
        self.assertIn("0.01 to 100", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "1,1,0"))
        self.assertIn("2000 times", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "0.05,1,100"))
        self.assertIn("origin", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "1,1,2", "--origin",
                                             "nan,0,0"))
        self.assertIn("axis", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "1,1,2",
                                           "--x-axis", "0,1,0"))

    def test_resize_gives_the_extent_that_is_asked_for_along_every_axis(self):
        for shape, scale in (("sphere", (0.5, 1, 1)), ("sphere", (0.01, 1, 1)), ("pierced_block", (2, 1, 1)),
                             ("pierced_block", (1, 2, 3)), ("creature", (1, 2, 3)), ("arm", (0.5, 1, 1.5))):
            rest, out = self.at(f"{shape}.off"), self.at("resized.off")
            self.assertEqual(run("shape", shape, "--out", rest).returncode, 0)
            done = run("resize", rest, out, "--scale", ",".join(map(str, scale)))
            self.assertEqual(done.returncode, 0, done.stderr)
            before, after = read_off(rest), read_off(out)
            for axis, factor in enumerate(scale):
                low, high = (end(position[axis] for position in before) for end in (min, max))
                middle, half = (low + high) / 2, factor * (high - low) / 2
                for end, wanted in ((min, middle - half), (max, middle + half)):
                    self.assertAlmostEqual(end(position[axis] for position in after), wanted, delta=1e-9 * (high - low),
                                           msg=f"{shape} by {scale}, axis {axis}")

    def test_a_round_shape_is_scaled_plainly_however_it_is_sampled(self):
        for rows, noise, scale in ((8, 0, (2, 1, 1)), (16, 0, (2, 3, 1)), (16, 0, (0.5, 1, 1)), (16, 0.002, (2, 1, 1)),
                                   (16, 0.01, (2, 3, 1)), (17, 0.01, (1, 1, 2))):
            rest, out = self.write("ball.off", noisy_ball(rows, noise)), self.at("resized.off")
            done = run("resize", rest, out, "--scale", ",".join(map(str, scale)))
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            before, after = read_off(rest), read_off(out)
            middle = [(min(axis) + max(axis)) / 2 for axis in zip(*before)]
            plain = [[m + s * (x - m) for x, m, s in zip(point, middle, scale)] for point in before]
            self.assertLess(max(map(math.dist, plain, after)), 0.03, f"{rows} rows, noise {noise}, by {scale}")

    def test_a_split_mesh_is_resized_in_one_piece(self):
        mesh, _, copies = self.split_bar()
        out = self.at("long.obj")
        done = run("resize", mesh, out, "--scale", "1,1,2", "--weld")
        self.assertEqual(done.returncode, 0, done.stderr)
        posed = [line for line in read_text(out).splitlines() if line.startswith("v ")]
        self.assertEqual({len({posed[copy] for copy in same}) for same in copies.values()}, {1})
        self.assertEqual(run("resize", self.at("bar.off"), self.at("long.off"), "--scale", "1,1,2").returncode, 0)
        whole = read_off(self.at("long.off"))
        for v, same in copies.items():
            for axis, word in enumerate(posed[same[0]].split()[1:]):
                self.assertAlmostEqual(float(word), whole[v][axis], delta=0.02)
        self.assertIn("--weld", run("resize", "--help").stdout)

    def test_a_weld_takes_a_tolerance(self):
        mesh, _, copies = self.split_bar()
        lines = read_text(mesh).splitlines()
        corners = [k for k, line in enumerate(lines) if line.startswith("v ")]
        for k in corners[::2]:  # copies are apart by rather more than rounding
            x, y, z = map(float, lines[k].split()[1:])
            lines[k] = f"v {x + 1e-5} {y} {z}"
        mesh, out = self.write("apart.obj", "\n".join(lines) + "\n"), self.at("apart_long.obj")
        resize = ("resize", mesh, out, "--scale", "1,1,2")
        for weld in (("--weld", "1e-4"), ("--weld=1e-4",)):
            done = run(*resize, *weld)
            self.assertEqual(done.returncode, 0, done.stderr)
            posed = [line for line in read_text(out).splitlines() if line.startswith("v ")]
            self.assertEqual({len({posed[copy] for copy in same}) for same in copies.values()}, {1})
        self.assertNotEqual(run("resize", "--weld", mesh, out, "--scale", "1,1,2").returncode, 2, "MESH is no tolerance")
        for tolerance in ("0.0011", "-1e-9", "nan"):
            refused = run(*resize, f"--weld={tolerance}")
            self.assertEqual(refused.returncode, 2)
            self.assertIn("0.001", refused.stderr)

    def test_an_output_is_whole_or_what_was_there_stays(self):
        mesh, handles, _ = self.split_bar()  # with normals, which are written by another way than without
        out, report = self.write("hero.obj", "what was there\n"), self.write("hero.json", "this, too\n")
        os.chmod(out, 0o660)
        deform = ("deform", mesh, "--handles", handles, "--weld", "--out", out, "--report", report)
        limited = subprocess.run(["bash", "-c", 'ulimit -f 2; exec "$@"', "-", programs.cli(), *deform], capture_output=True, text=True,
                                 timeout=programs.PATIENCE)
        self.assertEqual(limited.returncode, 2, limited.stderr)
        self.assertIn("File too large", limited.stderr)
        self.assertEqual(read_text(out), "what was there\n")
        self.assertEqual(read_text(report), "this, too\n")
        self.assertEqual([name for name in os.listdir(os.path.dirname(out)) if "partial" in name], [])
        link = self.at("latest.obj")
        os.symlink(out, link)
        done = run("deform", mesh, "--handles", handles, "--weld", "--out", link, "--report", "/dev/stdout")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(os.path.islink(link))
        self.assertIn("\nf ", read_text(out), "the file behind the link")
        self.assertEqual(os.stat(out).st_mode & 0o777, 0o660)
        self.assertIn('"stop_reason"', done.stdout)

    def test_a_file_is_named_once(self):
        bar, handles = self.at("bar.off"), self.at("bar.json")
        same = self.at("same.obj")
        for arguments in (("deform", bar, "--handles", handles, "--out", same, "--report", same),
                          ("deform", bar, "--handles", handles, "--out", same, "--out", os.path.join(os.path.dirname(same), ".", "same.obj")),
                          ("deform", bar, "--handles", handles, "--report", handles), ("deform", bar, "--handles", handles, "--report", bar),
                          ("shape", "bar", "--out", same, "--handles", same)):
            refused = run(*arguments)
            self.assertEqual(refused.returncode, 2, arguments)
            self.assertIn("it would be overwritten", refused.stderr)
        self.assertFalse(os.path.exists(same))
        own = self.write("own.off", read_text(bar))
        self.assertEqual(run("deform", own, "--handles", handles, "--out", own).returncode, 0, "in its own place is meant")

    def test_what_cannot_be_printed_is_an_error(self):
        for arguments in (("info", self.at("bar.off"), "--json"), ("--help",), ("deform", self.at("bar.off"), "--handles", self.at("bar.json"))):
            with open("/dev/full", "w") as full:
                done = subprocess.run([programs.cli(), *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=programs.PATIENCE)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn("No space left on device", done.stderr)

    def test_errors_of_a_mesh_name_its_file_and_what_is_wrong(self):
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        for text, why in (("f 0 1 2\n", "Line 4: face 1 names vertex 0"), ("f 1 2 5\n", 'Line 4: face 1 has the corner "5"; there are 3 vertices.'),
                          ("f 1 2 -9\n", 'Line 4: face 1 has the corner "-9"; 3 vertices come before it.'),
                          ("v 0 nan 0\n", "Line 4: vertex 4 has a NaN or infinite coordinate.")):
            mesh = self.write("wrong.obj", corners + text)
            refused = run("info", mesh)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("wrong.obj", refused.stderr)
            self.assertIn(why, refused.stderr)
        refused = run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--initial", mesh)
        self.assertIn("wrong.obj", refused.stderr)
        os.mkfifo(self.at("pipe.obj"))
        self.assertIn("pipe", run("info", self.at("pipe.obj")).stderr)
        self.assertIn("(see lpdeform deform --help)", run("deform", "--what").stderr)

    def test_info_says_that_a_mesh_is_split(self):
        mesh, _, copies = self.split_bar()
        told = run("info", mesh, "--json")
        self.assertEqual(json.loads(told.stdout)["split_border_vertices"], sum(map(len, copies.values())))
        self.assertIn("comes apart where it is split", told.stderr)
        self.assertNotIn("split", run("info", self.at("bar.off")).stderr)


if __name__ == "__main__":
    main()
