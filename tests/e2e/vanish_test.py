"""Clients that vanish leave nothing behind: streams end with their connections, sessions and uploads after their idle time."""

import re
import signal
import subprocess
import time
import unittest
import urllib.request

import programs

LEVELS = ("lpdeform_sessions", "lpdeform_streams", "lpdeform_uploads", "lpdeform_memory_bytes")


class Vanish(unittest.TestCase):
    def setUp(self):
        self.server = programs.RunningServer("--admin-address", "127.0.0.1:0", "--session-idle", "3", "--upload-idle", "1")
        self.addCleanup(self.server.stop)

    def levels(self):
        with urllib.request.urlopen(self.server.admin + "/metrics", timeout=60) as answer:
            found = dict(re.findall(r"^(\w+) (\S+)$", answer.read().decode(), re.MULTILINE))
        return {name: float(found[name]) for name in (*LEVELS, "process_open_fds", "lpdeform_updates_total")}

    def until(self, is_so):
        end = time.monotonic() + programs.PATIENCE
        while not is_so(levels := self.levels()):
            self.assertLess(time.monotonic(), end, levels)
            time.sleep(0.05)  # the server tells nobody of levels
        return levels

    def load(self):
        """A client with five sessions, in the middle of its work."""
        client = subprocess.Popen([programs.cli(), "load", "--server", self.server.address, "--sessions", "5", "--vertices",
                                   "400,100", "--rate", "20", "--seconds", "600", "--slow-readers", "5"],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(client.wait)
        self.addCleanup(client.kill)
        return client

    def test_a_client_that_is_killed_leaves_nothing(self):
        before = self.levels()
        client = self.load()
        at_work = self.until(lambda now: now["lpdeform_sessions"] >= 2 and now["lpdeform_updates_total"] > 20)
        self.assertGreater(at_work["lpdeform_memory_bytes"], 0)
        client.send_signal(signal.SIGKILL)
        after = self.until(lambda now: not any(now[name] for name in LEVELS))
        self.assertLessEqual(after["process_open_fds"], before["process_open_fds"] + 1)

    def test_one_that_is_killed_while_it_opens_leaves_nothing(self):
        for wait in (0.05, 0.3, 0.8):
            client = self.load()
            time.sleep(wait)  # wherever that is
            client.send_signal(signal.SIGKILL)
            client.wait()
        self.until(lambda now: not any(now[name] for name in LEVELS))


if __name__ == "__main__":
    programs.main()
