"""lpdeform-server --store: a disk that accepts nothing more in the middle of drags, and folders that the server cannot use."""

import os
import re
import resource
import subprocess
import time
import unittest
import urllib.request

import programs


class Store(programs.OnShapes):
    def setUp(self):
        self.store = self.at(f"store of {self.id()}")

    def begin(self, *arguments):
        server = programs.RunningServer("--store", f"sqlite:{self.store}", "--admin-address", "127.0.0.1:0", *arguments)
        self.addCleanup(server.stop)
        return server

    @staticmethod
    def metric(server, name):
        with urllib.request.urlopen(server.admin + "/metrics", timeout=60) as answer:
            return float(re.search(rf"^{name} (\S+)$", answer.read().decode(), re.MULTILINE).group(1))

    def wait_for(self, server, name, holds):
        end = time.monotonic() + programs.PATIENCE
        while not holds(self.metric(server, name)):
            self.assertLess(time.monotonic(), end, name)

    def refused_start(self, store):
        """What the program says, in one line."""
        done = subprocess.run([programs.server(), "--address", "127.0.0.1:0", "--store", store, "--log-level", "off"],
                              capture_output=True, text=True, timeout=programs.PATIENCE)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        return done.stderr

    def test_a_disk_that_is_full_stops_no_drag_and_takes_all_when_there_is_room(self):
        server = self.begin()
        load = subprocess.Popen([programs.cli(), "load", "--server", server.address, "--sessions", "3", "--rate", "30",
                                 "--seconds", "3", "--vertices", "500"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                text=True)
        self.wait_for(server, "lpdeform_input_to_kept_seconds_count", lambda value: value > 30)
        no_limit = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        before = resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
        self.assertEqual(before, no_limit)
        self.wait_for(server, "lpdeform_store_failing", lambda value: value == 1)
        said = load.communicate(timeout=programs.PATIENCE)[0]
        self.assertEqual(load.returncode, 0, said)  # every update was answered by a frame
        self.assertGreater(self.metric(server, "lpdeform_updates_not_kept_total"), 0)
        refused = programs.run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server", server.address)
        self.assertEqual(refused.returncode, 3, refused.stderr)
        self.assertIn("store of sessions fails", refused.stderr)
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, no_limit)
        self.wait_for(server, "lpdeform_store_failing", lambda value: value == 0)
        done = programs.run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server", server.address)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_folder_that_it_cannot_use_is_named_and_left_as_it_is(self):
        self.assertIn("'sqlite'", self.refused_start("sqlite"))
        self.assertIn("bar.off", self.refused_start("sqlite:" + self.at("bar.off") + "/store"))
        self.begin()
        self.assertIn(self.store, self.refused_start(f"sqlite:{self.store}"))
        damaged = self.at("damaged")
        os.makedirs(damaged)
        database = os.path.join(damaged, "sessions.db")
        with open(database, "w") as file:
            file.write("no database " * 1000)
        self.assertIn(database, self.refused_start(f"sqlite:{damaged}"))
        self.assertEqual(programs.read_text(database), "no database " * 1000)

    def test_redis_that_is_not_there_is_named(self):
        self.assertIn("127.0.0.1:1", self.refused_start("redis://127.0.0.1:1"))

    def test_a_password_in_the_address_is_refused_and_not_repeated(self):
        for address in ("redis://user:secret@127.0.0.1:6379", "rediss://:secret@127.0.0.1:6379", "redis://secret@127.0.0.1"):
            refusal = self.refused_start(address)
            self.assertIn("--store-password-file", refusal)
            self.assertNotIn("secret", refusal)
        done = subprocess.run([programs.server(), "--store", "none", "--store-password-file", "here"], capture_output=True, text=True,
                              timeout=programs.PATIENCE)
        self.assertEqual(done.returncode, 1)
        self.assertIn("--store redis://HOST:PORT", done.stderr)


if __name__ == "__main__":
    programs.main()
