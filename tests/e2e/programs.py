"""Shared by tests of the programs: running them, reading their output, and simple shapes.

Each test file is run as: FILE SERVER CLI [unittest arguments].
"""

import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

SERVER, CLI = None, None  # set by main()
PATIENCE = 280  # seconds that anything may take; never reached where all is well


class RunningServer:
    """lpdeform-server on a free port of this machine. `admin`: the URL of its admin port, where it was asked for."""

    def __init__(self, *arguments, program=None):
        self.process = subprocess.Popen([program or SERVER, "--address", "127.0.0.1:0", *arguments], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)
        self.log, self.seen = [], 0
        watchdog = threading.Timer(PATIENCE, self.process.kill)
        watchdog.start()
        try:
            self.address = self.find(r"127\.0\.0\.1:[1-9]\d*")
            self.admin = self.find(r"http://127\.0\.0\.1:\d+") if "--admin-address" in arguments else None
        except AssertionError:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            raise
        finally:
            watchdog.cancel()
        self.reader = threading.Thread(target=self.log.extend, args=(self.process.stdout,))
        self.reader.start()

    def find(self, pattern):
        """What the pattern finds first in the lines that come from now on."""
        for line in self.process.stdout:
            self.log.append(line)
            found = re.search(pattern, line)
            if found:
                return found.group(0)
        raise AssertionError(f"the server did not say {pattern}:\n" + "".join(self.log))

    def waits_for(self, event):
        """Returns with the next line of the log that has this event, after those that were returned before."""
        end = time.monotonic() + PATIENCE
        while True:
            for at in range(self.seen, len(self.log)):
                if f'"event":"{event}"' in self.log[at]:
                    self.seen = at + 1
                    return self.log[at]
            assert time.monotonic() < end, f"no {event} in:\n" + "".join(self.log)
            time.sleep(0.02)

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


def read_off_faces(path):
    """The three vertices of each."""
    words = [line.split() for line in read_text(path).splitlines()]
    return [tuple(map(int, line[1:])) for line in words if len(line) == 4 and line[0] == "3"]


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


class OnShapes(unittest.TestCase):
    """A folder with the bar and the creature, their handles, and a server."""

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


def cli():
    """The path of lpdeform."""
    return CLI


def server():
    """The path of lpdeform-server."""
    return SERVER


def main():
    """Runs the tests of the file that calls it."""
    global SERVER, CLI
    SERVER, CLI = sys.argv[1:3]
    unittest.main(module="__main__", argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
