"""lpdeform deform and lpdeform-server as users run them: solves, refusals and ends."""

import json
import math
import os
import re
import signal
import subprocess
import unittest

from programs import OnShapes, PATIENCE, RunningServer, cli, main, read_off, read_ply, read_text, run


class Deform(OnShapes):

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
        run("shape", "creature", "--detail", 2, "--out", self.at("large.off"), "--handles", self.at("large.json"))
        reports = [self.deform("--threads", threads, "--max-iterations", 20, shape="large") for threads in (1, 2)]
        self.assertEqual([report["threads"] for report in reports], [1, 2])
        self.assertEqual(reports[0]["energy"], reports[1]["energy"])

    def test_smaller_p_concentrates_distortion(self):
        shares = [self.deform("--p", p)["distortion"]["top_5_percent_share"] for p in (1, 1.5, 2, 6)]
        self.assertEqual(shares, sorted(shares, reverse=True))

    def test_a_limit_that_the_caller_set_is_success(self):
        report = self.deform("--p", 1, "--max-iterations", 2)
        self.assertEqual((report["stop_reason"], report["iterations"]), ("iteration_limit", 2))
        report = self.deform("--p", 1, "--time-limit", 1e-6)
        self.assertEqual(report["stop_reason"], "time_limit")

    def second_line(self, *options, shape="bar"):
        """What `deform` prints of the search."""
        done = run("deform", self.at(f"{shape}.off"), "--handles", self.at(f"{shape}.json"), *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = done.stdout.splitlines()
        return lines[1] if len(lines) > 1 else None

    def test_an_effort_looks_for_lower_minima_and_the_report_says_from_how_many_starts(self):
        first = self.deform("--p", 1.5, "--effort", 0)
        self.assertEqual((first["effort"], first["further_starts"], first["search_iterations"]), (0, 0, 0))
        self.assertEqual(first["minima"], [first["energy"]])
        for effort, starts in ((None, 12), (2, 24)):
            report = self.deform("--p", 1.5, *(("--effort", effort) if effort else ()))
            self.assertEqual((report["effort"], report["further_starts"]), (effort or 1, starts))
            self.assertEqual(report["minima"][0], first["energy"])
            self.assertEqual(report["energy"], min(report["minima"]))
            self.assertLessEqual(len(report["minima"]), 1 + starts)
            self.assertEqual(report["iterations"] - report["search_iterations"], first["iterations"])
            ascending = sorted(report["minima"])
            different = 1 + sum(after > 1.001 * before for before, after in zip(ascending, ascending[1:]))
            self.assertEqual(report["different_energies"], different)

    def test_the_second_line_says_what_was_searched_and_no_more(self):
        report = self.deform("--p", 1.5)
        first = report["iterations"] - report["search_iterations"]
        converged = len(report["minima"]) - 1
        self.assertTrue(self.second_line("--p", 1.5).startswith(
            f"looked for lower minima from 12 further starts, of which {converged} ended in a minimum; "
            f"minima of {report['different_energies']} energ"))
        self.assertEqual(self.second_line("--p", 1.5, "--effort", 0, "--certify"), "no other minima were looked for (effort 0)")
        self.assertIsNone(self.second_line("--p", 1.5, "--effort", 0))
        # The bar is large enough and has distortion: only the limit has kept it from a search.
        self.assertEqual(self.second_line("--p", 1.5, "--max-iterations", first), "no other minima were looked for (effort 1)")
        self.assertEqual(self.second_line("--p", 1.5, "--max-iterations", first + 1),
                         "the search for lower minima ended before its first start did")
        self.assertEqual(self.second_line("--p", 1.5, "--max-iterations", 1),
                         "the solve ended before a first minimum, and no other was looked for")

    def test_meshes_of_fewer_than_100_vertices_are_not_searched(self):
        self.write("tiny.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        self.write("tiny.json", '{"handles": [{"name": "a", "vertices": [0, 1]}, '
                                '{"name": "b", "vertices": [3], "translate": [0, 0, 2]}]}')
        self.assertEqual(self.second_line("--p", 1.5, "--effort", 4, shape="tiny"), "no other minima were looked for (effort 4)")

    def test_an_effort_over_1000_is_refused(self):
        self.assertIn("--effort", self.refused(2, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--effort", 1001))

    def test_a_solve_that_stalls_short_of_its_tolerance_is_status_1_and_still_reported(self):
        # Gradient descent has no step left that lowers the energy in double precision long before 1e-14.
        report = self.deform("--p", 2, "--method", "line_search", "--tolerance", 1e-14, status=1)
        self.assertEqual(report["stop_reason"], "stalled")
        self.assertAlmostEqual(report["energy"] / self.deform("--p", 2)["energy"], 1, delta=1e-4)

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
        process = subprocess.Popen([cli(), "deform", self.at("bar.off"), "--handles", pipe],
                                   env={**os.environ, "TMPDIR": temporary}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with open(pipe, "w") as handles:  # opens when the program reads its handles
            process.send_signal(signal.SIGINT)
            handles.write(read_text(self.at("bar.json")))
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(os.listdir(temporary), [])

    def test_certify_prints_the_gap_without_a_report(self):
        plain = run("deform", self.at("bar.off"), "--handles", self.at("bar.json"))
        self.assertNotIn("gap", plain.stdout)
        done = run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--certify")
        self.assertEqual(done.returncode, 0, done.stderr)
        gap = float(re.search(r"; gap ([0-9.e+-]+)$", done.stdout.splitlines()[0]).group(1))
        self.assertLess(gap, 1e-4)

    def test_help_explains_every_option(self):
        text = run("deform", "--help").stdout
        for option in ("--handles", "--p ", "--p-field", "--stiffness-field", "--length-unit", "--method", "--weights",
                       "--initial", "--free-components", "--max-iterations", "--tolerance", "--time-limit", "--threads", "--effort",
                       "--weld", "--normals", "--out", "--certify", "--report", "--server", "--p-group", "--stiffness-group", "Exit status"):
            self.assertIn(option, text)
        self.assertRegex(run("--version").stdout, r"^lpdeform \d+\.\d+\.\d+\n$")


class Server(unittest.TestCase):

    def test_sigterm_ends_it_with_status_0(self):
        server = RunningServer()
        self.assertEqual(server.stop(), 0, "".join(server.log))


if __name__ == "__main__":
    main()
