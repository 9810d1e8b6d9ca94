"""lpdeform load against a real server: its counts add up, and it reports errors."""

import json
import re
import signal
import threading
import time
import urllib.request

import programs


class Load(programs.OnShapes):
    def load(self, *options, status=0, server=None):
        report = self.at("load.json")
        done = programs.run("load", "--server", (server or self.server).address, "--report", report, *options)
        self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return json.loads(programs.read_text(report)), done.stdout

    def expect_whole(self, report, updates):
        every = report["all"]
        self.assertEqual(every["updates"], {"due": updates, "answered": updates, "unanswered": 0})
        latency = every["input_to_frame_ms"]
        self.assertEqual(latency["count"], updates)
        ordered = [latency[name] for name in ("p50", "p90", "p95", "p99", "p99.9", "max")]
        self.assertEqual(ordered, sorted(ordered))
        self.assertGreater(ordered[0], 0)
        self.assertEqual(sum(count for _, count in every["input_to_frame_histogram_us"]), updates)
        self.assertEqual(every["errors"], {})

    def test_every_update_that_was_due_is_counted_and_answered(self):
        report, said = self.load("--sessions", 4, "--vertices", "100,400", "--rate", 10, "--seconds", 2)
        self.expect_whole(report, 80)
        self.assertEqual(report["all"]["setup_ms"]["count"], 4)
        self.assertEqual(set(report["by_vertices"]), {"100", "400"})
        for tally in report["by_vertices"].values():
            self.assertEqual(tally["updates"]["due"], 40)
        # Positions and distortion as float32.
        frames = {name: tally["frames"]["received"] for name, tally in report["by_vertices"].items()}
        self.assertEqual(report["all"]["payload_bytes"], sum(16 * int(name) * count for name, count in frames.items()))
        shares = report["frames_per_session"]
        self.assertEqual(4 * shares["mean"], report["all"]["frames"]["received"])
        self.assertTrue(0 < shares["least"] <= shares["mean"] <= shares["most"], shares)
        self.assertIn("400 vertices", said)
        self.assertIn("input to frame p50", said)

    def test_sessions_outlive_reconnects_and_slow_readers_cost_nothing(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0")
        self.addCleanup(server.stop)
        report, _ = self.load("--sessions", 2, "--vertices", 100, "--rate", 20, "--seconds", 3, "--reconnect", 1,
                              "--slow-readers", 2, "--slow-pause", 0.5, server=server)
        self.expect_whole(report, 120)
        reconnects = report["all"]["reconnects"]
        self.assertGreaterEqual(reconnects, 2)
        # Of each session its maker, its driver and its slow reader.
        self.assertGreaterEqual(self.metric(server, "lpdeform_connections_total"), 6 + reconnects)

    def test_leaves_no_session_behind(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0")
        self.addCleanup(server.stop)
        self.load("--sessions", 3, "--vertices", 50, "--rate", 5, "--seconds", 1, server=server)
        end = time.monotonic() + programs.PATIENCE
        while min(self.logged(server, event) for event in ("session_created", "session_ended")) < 3:
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)
        self.assertEqual(self.logged(server, "session_created"), 3)

    def test_a_server_that_stops_leaves_updates_unanswered(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0")
        try:
            threading.Thread(target=self.kill_under_load, args=(server,)).start()
            report, _ = self.load("--sessions", 1, "--vertices", 50, "--rate", 20, "--seconds", 4, status=1, server=server)
            self.assertGreater(report["all"]["updates"]["unanswered"], 0)
            self.assertEqual(report["all"]["updates"]["due"], 80)
        finally:
            server.process.wait(programs.PATIENCE)
            server.reader.join()
            server.process.stdout.close()

    @staticmethod
    def logged(server, event):
        return sum(f'"event":"{event}"' in line for line in list(server.log))

    @staticmethod
    def metric(server, name):
        with urllib.request.urlopen(server.admin + "/metrics", timeout=60) as answer:
            return float(re.search(rf"^{name} (\S+)$", answer.read().decode(), re.MULTILINE).group(1))

    def kill_under_load(self, server):
        end = time.monotonic() + programs.PATIENCE
        taken = 0
        while taken < 10 and time.monotonic() < end:
            taken = self.metric(server, "lpdeform_updates_total")
        server.process.send_signal(signal.SIGKILL)

    def test_bad_input_is_refused(self):
        self.assertEqual(self.refused(3, "load", "--server", "127.0.0.1:1", "--seconds", 1)[:9], "lpdeform:")
        self.assertIn("folder", self.refused(2, "load", "--server", self.server.address, "--report", "/no/such/folder/x.json"))
        for wrong in (["--sessions", 0], ["--rate", 0], ["--rate", "fast"], ["--vertices", 3], ["--vertices", "100,x"],
                      ["--seconds", 0], ["--p", 0.5], ["--slow-readers", -1], ["--reconnect", 0]):
            done = programs.run("load", "--server", self.server.address, *wrong)
            self.assertEqual(done.returncode, 2, wrong)
            self.assertIn(wrong[0], done.stderr)
        self.assertEqual(programs.run("load").returncode, 2)


if __name__ == "__main__":
    programs.main()
