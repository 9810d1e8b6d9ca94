"""The programs as users run them: programs_test.py SERVER CLI [unittest arguments]."""

import json
import math
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import xml.etree.ElementTree

SERVER, CLI = None, None
PATIENCE = 280  # seconds that anything may take; never reached where all is well


class RunningServer:
    """lpdeform-server on a free port of this machine."""

    def __init__(self):
        self.process = subprocess.Popen([SERVER, "--address", "127.0.0.1:0"], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)
        watchdog = threading.Timer(PATIENCE, self.process.kill)
        watchdog.start()
        self.log = []
        self.address = None
        for line in self.process.stdout:
            self.log.append(line)
            found = re.search(r"127\.0\.0\.1:([1-9]\d*)", line)
            if found:
                self.address = found.group(0)
                break
        watchdog.cancel()
        if self.address is None:
            raise AssertionError("the server did not say where it listens:\n" + "".join(self.log))
        self.reader = threading.Thread(target=self.log.extend, args=(self.process.stdout,))
        self.reader.start()

    def stop(self):
        """The exit status after SIGTERM."""
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(PATIENCE)
        self.reader.join()
        self.process.stdout.close()
        return status


def run(*arguments):
    return subprocess.run([CLI, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)


def read_text(path):
    with open(path) as file:
        return file.read()


def read_bytes(path):
    with open(path, "rb") as file:
        return file.read()


def read_off(path):
    lines = [line for line in read_text(path).splitlines() if not line.startswith("#")]
    numbers = " ".join(lines).split()[1:]
    count = int(numbers[0])
    return [tuple(map(float, numbers[3 + 3 * k:6 + 3 * k])) for k in range(count)]


def read_ply(path):
    """Vertices as dicts of their properties."""
    header, body = read_bytes(path).split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    assert lines[0] == "ply" and lines[1] == "format binary_little_endian 1.0", lines[:2]
    count, names, layout, inside = 0, [], "<", False
    for line in lines[2:]:
        words = line.split()
        if words[0] == "element":
            inside = words[1] == "vertex"
            count = int(words[2]) if inside else count
        elif words[0] == "property" and inside:
            layout += {"double": "d", "uchar": "B"}[words[1]]
            names.append(words[2])
    step = struct.calcsize(layout)
    return [dict(zip(names, struct.unpack_from(layout, body, k * step))) for k in range(count)]


class Deform(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.server = RunningServer()
        for name in ("bar", "creature"):
            made = run("shape", name, "--out", cls.at(f"{name}.off"), "--handles", cls.at(f"{name}.json"))
            assert made.returncode == 0, made.stderr

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()
        cls.folder.cleanup()

    @classmethod
    def at(cls, name):
        return os.path.join(cls.folder.name, name)

    def write(self, name, text):
        with open(self.at(name), "w") as file:
            file.write(text)
        return self.at(name)

    def deform(self, *options, shape="bar", status=0):
        """The report of deforming a shape."""
        report = self.at("report.json")
        done = run("deform", self.at(f"{shape}.off"), "--handles", self.at(f"{shape}.json"), "--report", report, *options)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertEqual(done.stderr, "")
        return json.loads(read_text(report))

    def refused(self, status, *arguments):
        """The one line on stderr."""
        done = run(*arguments)
        self.assertEqual(done.returncode, status, done.stderr)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("lpdeform: "), lines[0])
        return lines[0]

    def test_every_p_through_the_server_gives_a_sound_report_and_coloured_ply(self):
        for p in (1, 1.5, 2, 6):
            with self.subTest(p=p):
                ply = self.at("out.ply")
                report = self.deform("--p", p, "--server", self.server.address, "--out", ply)
                self.assertEqual(report["stop_reason"], "converged")
                self.assertEqual(report["p"], p)
                self.assertEqual(report["mesh"]["vertices"], 370)
                self.assertLess(report["energy"], report["initial_energy"])
                self.assertGreaterEqual(report["threads"], 1)
                self.assertIsInstance(report["iterations"], int)
                self.assertLessEqual(abs(report["optimality_gap"]), 1e-3)
                self.assert_trace_is_sound(report)
                self.assert_ply_agrees(read_ply(ply), report, p)

    def assert_trace_is_sound(self, report):
        trace = report["trace"]
        self.assertEqual([record["iteration"] for record in trace], sorted(record["iteration"] for record in trace))
        self.assertEqual([record["seconds"] for record in trace], sorted(record["seconds"] for record in trace))
        self.assertEqual(min(record["energy"] for record in trace), report["energy"])
        self.assertEqual(trace[0]["energy"], report["initial_energy"])

    def assert_ply_agrees(self, vertices, report, p):
        self.assertEqual(len(vertices), 370)
        # E_i travels as float32, so to about 1e-7 of itself and p times that in its power.
        energy = sum(vertex["distortion"] ** p for vertex in vertices)
        self.assertLess(abs(energy - report["energy"]), 1e-6 * p * report["energy"])
        statistics = report["distortion"]
        self.assertEqual(max(vertex["distortion"] for vertex in vertices), statistics["max"])
        self.assertEqual(sum(statistics["histogram"]["counts"]), 370)
        self.assertEqual(len(statistics["histogram"]["edges"]), len(statistics["histogram"]["counts"]) + 1)
        worst = max(vertices, key=lambda vertex: vertex["distortion"])
        best = min(vertices, key=lambda vertex: vertex["distortion"])
        self.assertGreater(worst["red"], worst["blue"])
        self.assertGreater(best["blue"], best["red"])
        self.assert_handles_are_met(vertices)

    def assert_handles_are_met(self, vertices):
        rest = read_off(self.at("bar.off"))
        end, _, middle = json.loads(read_text(self.at("bar.json")))["handles"]
        for vertex in end["vertices"]:
            self.assert_close(vertices[vertex], rest[vertex])
        cx, cy, _ = middle["rotate"]["center"]
        for vertex in middle["vertices"]:
            x, y, z = rest[vertex]
            self.assert_close(vertices[vertex], (cx - (y - cy), cy + (x - cx), z))  # a quarter turn about z

    def assert_close(self, vertex, point):
        self.assertLess(math.dist((vertex["x"], vertex["y"], vertex["z"]), point), 1e-12 * 21)

    def test_the_command_alone_and_through_a_server_agree_to_the_last_bit(self):
        energies = {self.deform("--p", 1.5)["energy"], self.deform("--p", 1.5, "--server", self.server.address)["energy"]}
        self.assertEqual(len(energies), 1, energies)

    def test_any_number_of_threads_gives_the_same_bits_and_is_reported(self):
        reports = [self.deform("--threads", threads, shape="creature") for threads in (1, 2)]
        self.assertEqual([report["threads"] for report in reports], [1, 2])
        self.assertEqual(reports[0]["energy"], reports[1]["energy"])

    def test_smaller_p_concentrates_distortion(self):
        shares = [self.deform("--p", p)["distortion"]["top_5_percent_share"] for p in (1, 1.5, 2, 6)]
        self.assertEqual(shares, sorted(shares, reverse=True))

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
        bad = self.write("nan.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n")
        info = run("info", bad, "--json")
        self.assertEqual(info.returncode, 2)
        self.assertEqual(json.loads(info.stdout)["not_finite"], 1)
        self.assertIn("vertex 1", info.stderr.lower())

    def test_a_limit_that_the_caller_set_is_success(self):
        report = self.deform("--p", 1, "--max-iterations", 2)
        self.assertEqual((report["stop_reason"], report["iterations"]), ("iteration_limit", 2))
        report = self.deform("--p", 1, "--time-limit", 1e-6)
        self.assertEqual(report["stop_reason"], "time_limit")

    def test_a_solve_that_stalls_short_of_its_tolerance_is_status_1_and_still_reported(self):
        # Gradient descent has no step left that lowers the energy in double precision long before 1e-14.
        report = self.deform("--p", 2, "--method", "line_search", "--tolerance", 1e-14, status=1)
        self.assertEqual(report["stop_reason"], "stalled")
        self.assertAlmostEqual(report["energy"] / self.deform("--p", 2)["energy"], 1, delta=1e-4)

    def test_fields_are_read_and_summed_up(self):
        ends = self.write("p.txt", "".join(f"{1 + (k % 2)}\n" for k in range(370)))
        stiff = self.write("s.txt", "2\n" * 370)
        report = self.deform("--p-field", ends, "--stiffness-field", stiff, "--length-unit", 0.5)
        self.assertEqual(report["p"], {"min": 1, "mean": 1.5, "max": 2})
        doubled, plain = self.deform("--p", 2, "--stiffness-field", stiff), self.deform("--p", 2)
        self.assertAlmostEqual(doubled["energy"] / plain["energy"], 2, delta=1e-3)  # twice the tolerance's worth

    def test_p_from_the_geometry_is_the_same_through_a_server_and_may_be_painted_over(self):
        alone = self.deform("--p", "auto:0.5")
        self.assertEqual(alone["p"], {"automatic": 0.5})
        served = self.deform("--p", "auto:0.5", "--server", self.server.address)
        self.assertEqual(served["energy"], alone["energy"])
        handles = json.loads(read_text(self.at("bar.json")))
        handles["groups"] = [{"name": "low", "vertices": [0, 1, 2], "p": 1, "stiffness": 7}]
        painted = self.write("painted.json", json.dumps(handles))
        out = self.at("painted_report.json")
        done = run("deform", self.at("bar.off"), "--handles", painted, "--p", "auto:0.5", "--p-group", "low=3", "--report", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(read_text(out))
        self.assertEqual(report["p"]["max"], 3)
        self.assertLess(report["p"]["min"], 1.6)  # of the geometry

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

    def test_resize_meets_the_scaled_extent_through_a_server_and_alone(self):
        for options in ([], ["--server", self.server.address]):
            out = self.at("resized.off")
            done = run("resize", self.at("bar.off"), out, "--scale", "1,1.5,3", "--origin", "0,0,0", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.count("converged"), 2)  # 1.5 is shared; x and z differ from it
            positions = read_off(out)
            for axis, extent, places in ((0, 4, 1), (1, 6, 1), (2, 63, 3)):  # the last solve holds the ends of z alone
                self.assertAlmostEqual(min(position[axis] for position in positions), 0, places)
                self.assertAlmostEqual(max(position[axis] for position in positions), extent, places)
        self.assertIn("0.01 to 100", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "1,1,0"))
        self.assertIn("axis", self.refused(2, "resize", self.at("bar.off"), self.at("x.off"), "--scale", "1,1,2",
                                           "--x-axis", "0,1,0"))

    def test_starting_from_a_result_leaves_little_to_do(self):
        result = self.at("result.off")
        first = self.deform("--p", 2, "--out", result)
        again = self.deform("--p", 2, "--initial", result)
        self.assertLess(again["iterations"], first["iterations"])
        self.assertAlmostEqual(again["initial_energy"] / first["energy"], 1, delta=1e-9)
        rest = self.deform("--p", 2, "--initial", "rest", "--max-iterations", 1)
        self.assertNotEqual(rest["initial_energy"], first["initial_energy"])

    def test_each_method_reports_itself(self):
        for method, p in (("quasi_newton", 1.5), ("line_search", 2), ("local_global", 2), ("conic", 1)):
            with self.subTest(method=method):
                few = ["--max-iterations", 2] if method == "conic" else []  # its steps are long
                self.assertEqual(self.deform("--method", method, "--p", p, *few)["method"], method)

    def test_a_component_without_a_handle_is_an_error_that_can_be_allowed(self):
        two = self.write("two.off", "OFF\n6 2 0\n0 0 0\n1 0 0\n0 1 0\n5 0 0\n6 0 0\n5 1 0\n3 0 1 2\n3 3 4 5\n")
        one = self.write("one.json", '{"handles": [{"name": "a", "vertices": [0, 1, 2], "translate": [0, 0, 1]}]}')
        self.assertIn("component", self.refused(2, "deform", two, "--handles", one).lower())
        heights = {}
        for choice in ("stay", "follow"):
            out = self.at("two_out.off")
            done = run("deform", two, "--handles", one, "--free-components", choice, "--out", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            heights[choice] = read_off(out)[4][2]
        self.assertAlmostEqual(heights["stay"], 0)
        self.assertAlmostEqual(heights["follow"], 1)

    def test_bad_input_is_one_line_that_names_it(self):
        bar, handles = self.at("bar.off"), self.at("bar.json")
        unknown = self.write("unknown.json", '{"handles": [{"name": "tip", "vertices": [1], "weight": 2}]}')
        short = self.write("short.txt", "1\n2\n")
        low = self.write("low.txt", "0.5\n" + "2\n" * 369)
        cases = [
            (["deform", "/nowhere.off", "--handles", handles], "/nowhere.off"),
            (["deform", bar, "--handles", "/nowhere.json"], "/nowhere.json"),
            (["deform", bar], "--handles"),
            (["deform", bar, "--handles", handles, "--p", "0.5"], "0.5"),
            (["deform", bar, "--handles", handles, "--p-field", short], "2 numbers for 370"),
            (["deform", bar, "--handles", handles, "--p-field", low], "0.5"),
            (["deform", bar, "--handles", handles, "--method", "newton"], "newton"),
            (["deform", bar, "--handles", handles, "--method", "conic", "--p", "2"], "conic"),
            (["deform", bar, "--handles", handles, "--out", self.at("x.stl")], "x.stl"),
            (["deform", bar, "--handles", handles, "--out", "/nowhere/x.ply"], "/nowhere"),
            (["deform", bar, "--handles", handles, "--initial", self.at("creature.off")], "370"),
            (["deform", bar, "--handles", handles, "--threads", "2", "--server", "x:1"], "--threads"),
            (["deform", bar, "--handles", unknown], '"weight"'),
            (["info", "/nowhere.off"], "/nowhere.off"),
            (["shape", "cube", "--out", self.at("cube.off")], "cube"),
            (["undo"], "undo"),
            ([], "subcommand"),
        ]
        for arguments, named in cases:
            with self.subTest(arguments=arguments):
                self.assertIn(named, self.refused(2, *arguments))

    def test_bad_input_that_only_the_server_sees_is_still_bad_input(self):
        low = self.write("low.txt", "0.5\n" + "2\n" * 369)
        line = self.refused(2, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--p-field", low,
                            "--server", self.server.address)
        self.assertIn("0.5", line)

    def test_a_server_that_is_not_there_is_status_3(self):
        line = self.refused(3, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server",
                            "unix:" + self.at("no_socket"))
        self.assertIn("no_socket", line)

    def test_ctrl_c_ends_it_and_leaves_nothing(self):
        pipe = self.at("handles.fifo")
        os.mkfifo(pipe)
        temporary = self.at("tmp")
        os.mkdir(temporary)
        process = subprocess.Popen([CLI, "deform", self.at("bar.off"), "--handles", pipe],
                                   env={**os.environ, "TMPDIR": temporary}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with open(pipe, "w") as handles:  # opens when the program reads its handles
            process.send_signal(signal.SIGINT)
            handles.write(read_text(self.at("bar.json")))
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(os.listdir(temporary), [])

    def test_help_explains_every_option(self):
        text = run("deform", "--help").stdout
        for option in ("--handles", "--p ", "--p-field", "--stiffness-field", "--length-unit", "--method", "--weights",
                       "--initial", "--free-components", "--max-iterations", "--tolerance", "--time-limit", "--threads",
                       "--weld", "--normals", "--out", "--report", "--server", "--p-group", "--stiffness-group", "Exit status"):
            self.assertIn(option, text)
        self.assertRegex(run("--version").stdout, r"^lpdeform \d+\.\d+\.\d+\n$")


class Reproduce(unittest.TestCase):
    """On shapes of a quarter of the size, for which not every claim must hold."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = os.path.join(cls.temporary.name, "made", "page")
        mesh, handles = (os.path.join(cls.temporary.name, name) for name in ("my bar.off", "bar.json"))
        assert run("shape", "bar", "--out", mesh, "--handles", handles).returncode == 0
        cls.done = run("reproduce", "--out", cls.folder, "--size", 0.25, "--threads", 1, "--mesh", mesh, "--handles", handles)
        assert cls.done.returncode == 0, cls.done.stderr
        cls.page = xml.etree.ElementTree.parse(os.path.join(cls.folder, "index.html")).getroot()
        cls.verdicts = json.loads(read_text(os.path.join(cls.folder, "reproduce.json")))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def elements(self, name, within=None):
        return list((self.page if within is None else within).iter("{http://www.w3.org/1999/xhtml}" + name))

    def sections(self):
        return {section.get("id"): section for section in self.elements("section")}

    def test_every_figure_of_the_paper_and_the_other_mesh_is_there(self):
        wanted = ["table_1", *(f"figure_{k}" for k in range(1, 10)), "appendix", "mesh_my_bar"]
        self.assertEqual([figure["id"] for figure in self.verdicts["figures"]], wanted)
        self.assertEqual(list(self.sections()), wanted)

    def test_every_figure_has_claims_numbers_and_verdicts_and_the_page_says_the_same(self):
        for figure in self.verdicts["figures"]:
            text = "".join(self.sections()[figure["id"]].itertext())
            self.assertGreaterEqual(len(figure["claims"]), 1)
            for claim in figure["claims"]:
                self.assertIn(claim["text"], text)
                self.assertIn(claim["measured"], text)
                self.assertIn("holds here" if claim["holds"] else "does not hold here", text)
                self.assertTrue(claim["numbers"])
                self.assertTrue(all(math.isfinite(number) for number in claim["numbers"].values()), claim)
        self.assertEqual(self.verdicts["claims_that_hold"],
                         sum(claim["holds"] for figure in self.verdicts["figures"] for claim in figure["claims"]))

    def test_verdicts_follow_from_their_numbers(self):
        claims = {figure["id"]: figure["claims"] for figure in self.verdicts["figures"]}
        for figure in ("figure_3", "figure_4"):
            shares = list(claims[figure][0]["numbers"].values())
            self.assertEqual(len(shares), 4)
            self.assertEqual(claims[figure][0]["holds"], all(a > b for a, b in zip(shares, shares[1:])))
        for figure in ("figure_5", "figure_7"):
            one, two = claims[figure][0]["numbers"].values()
            self.assertGreaterEqual(min(one, two), 1)
            self.assertEqual(claims[figure][0]["holds"], one < two)
        one, two = claims["figure_6"][0]["numbers"].values()
        self.assertEqual(claims["figure_6"][0]["holds"], one < two)

    def test_all_pictures_are_there_and_nothing_else_and_none_comes_from_elsewhere(self):
        shown = [picture.get("src") for picture in self.elements("img")]
        self.assertEqual(sorted(set(shown) | {"index.html", "reproduce.json"}), sorted(os.listdir(self.folder)))
        for name in shown:
            self.assertEqual(read_bytes(os.path.join(self.folder, name))[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.elements("script") + self.elements("link"), [])
        for link in self.elements("a"):
            self.assertTrue(link.get("href").startswith("#") or link.get("href") == "reproduce.json", link.get("href"))

    def test_table_1_has_a_row_here_and_a_row_of_the_paper(self):
        rows = [[cell.text for cell in row] for row in self.elements("tr", self.sections()["table_1"])]
        self.assertEqual([row[0] for row in rows[1:]],
                         ["sheet, here", "Sheet, paper", "bar, here", "Bar, paper", "block, here", "Block, paper",
                          "creature, here", "Dinopet, paper", "arm, here", "Rocker arm, paper", "my_bar, here"])
        self.assertEqual({len(row) for row in rows}, {11})

    def test_plots_stand_inside_the_page(self):
        plots = [section for section in ("figure_1", "figure_2")
                 for _ in self.sections()[section].iter("{http://www.w3.org/2000/svg}svg")]
        self.assertEqual(plots, ["figure_1"] * 3 + ["figure_2"] * 2)

    def test_its_own_folder_is_written_again(self):
        before = sorted(os.listdir(self.folder))
        done = run("reproduce", "--out", self.folder, "--size", 0.25, "--threads", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), before)
        self.assertNotIn("my_bar", read_text(os.path.join(self.folder, "index.html")))

    def test_a_folder_of_others_is_refused_and_left_as_it_is(self):
        taken = os.path.join(self.temporary.name, "taken")
        os.mkdir(taken)
        with open(os.path.join(taken, "index.html"), "w") as file:
            file.write("mine")
        done = run("reproduce", "--out", taken, "--size", 0.25)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("--force", done.stderr)
        self.assertEqual(os.listdir(taken), ["index.html"])
        self.assertEqual(read_text(os.path.join(taken, "index.html")), "mine")

    def test_bad_input_is_one_line_that_names_it(self):
        out = os.path.join(self.temporary.name, "bad")
        mesh = os.path.join(self.temporary.name, "my bar.off")
        for arguments, named in [([], "--out"), (["--out", out, "--size", "0"], "0.25"), (["--out", out, "--mesh", mesh], "--handles"),
                                 (["--out", out, "--mesh", "/nowhere.off", "--handles", mesh], "/nowhere.off"),
                                 (["--out", out, "--mesh", mesh, "--handles", "/nowhere.json"], "/nowhere.json"),
                                 (["--out", "/proc/nowhere"], "/proc/nowhere"), (["--out", mesh], "my bar.off")]:
            with self.subTest(arguments=arguments):
                done = run("reproduce", *arguments)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(named, done.stderr)
        self.assertFalse(os.path.exists(out))

    def test_handles_that_the_papers_methods_do_not_know_are_refused(self):
        mesh, soft, out = (os.path.join(self.temporary.name, name) for name in ("my bar.off", "soft.json", "soft"))
        with open(soft, "w") as file:
            file.write('{"handles": [{"name": "tip", "vertices": [1], "soft": 1}]}')
        done = run("reproduce", "--out", out, "--mesh", mesh, "--handles", soft)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn('handle "tip"', done.stderr)
        self.assertFalse(os.path.exists(out))

    def test_ctrl_c_ends_it_and_writes_nothing(self):
        out, pipe = (os.path.join(self.temporary.name, name) for name in ("stopped", "bar.fifo"))
        os.mkfifo(pipe)
        process = subprocess.Popen([CLI, "reproduce", "--out", out, "--mesh", os.path.join(self.temporary.name, "my bar.off"),
                                    "--handles", pipe], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with open(pipe, "w") as handles:  # opens when the program reads its handles
            process.send_signal(signal.SIGINT)
            handles.write(read_text(os.path.join(self.temporary.name, "bar.json")))
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(os.listdir(out) if os.path.exists(out) else [], [])


class Server(unittest.TestCase):

    def test_sigterm_ends_it_with_status_0(self):
        server = RunningServer()
        self.assertEqual(server.stop(), 0, "".join(server.log))


if __name__ == "__main__":
    SERVER, CLI = sys.argv[1:3]
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
