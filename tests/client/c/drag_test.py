"""The example loop in C runs 600 frames at 60 per second while its server is killed and restarted: drag_test.py SERVER DRAG.

The loop must see the server go and come back, never wait for it, and end with the requested shape.
"""

import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

PATIENCE = 120  # seconds; never reached where all is well
SERVER, DRAG = None, None


def start_server(socket):
    server = subprocess.Popen([SERVER, "--address", f"unix:{socket}"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert "socket" in server.stdout.readline()  # it listens
    return server


class Drag(unittest.TestCase):
    def test_goes_on_through_a_restart_of_the_server(self):
        with tempfile.TemporaryDirectory() as folder:
            socket = f"{folder}/socket"
            server = start_server(socket)
            drag = subprocess.Popen([DRAG, f"unix:{socket}", "40", "600"], stdout=subprocess.PIPE, text=True)
            watchdog = threading.Timer(PATIENCE, drag.kill)
            watchdog.start()
            lines = []
            for line in drag.stdout:
                lines.append(line)
                if re.match(r"frame \d+: live", line) and len(lines) < 4:
                    server.send_signal(signal.SIGKILL)
                    server.wait(PATIENCE)
                if re.match(r"frame \d+: reconnecting", line) and server.poll() is not None:
                    server.stdout.close()
                    server = start_server(socket)
            status = drag.wait(PATIENCE)
            watchdog.cancel()
            drag.stdout.close()
            server.kill()
            server.wait(PATIENCE)
            server.stdout.close()
            said = "".join(lines)
            print(said)
            self.assertEqual(status, 0, said)
            states = re.findall(r"^frame \d+: (\w+)", said, re.M)
            self.assertEqual([state for state in states if state != "connecting"], ["live", "reconnecting", "live"], said)
            # 60 frames a second: nothing made the loop wait for a server that was away for some of them.
            self.assertLess(float(re.search(r"^frames: 600, p50 ([\d.]+) ms", said, re.M).group(1)), 20, said)
            # Nor any call of it, in 99 of 100 frames: a call that waits for the server waits for the time that it is away.
            calls = dict(re.findall(r"^(moves|polls.*): \d+, p50 [\d.]+ ms, p99 ([\d.]+) ms", said, re.M))
            self.assertEqual(list(calls), ["moves", "polls with a frame", "polls without"], said)
            for name, p99 in calls.items():
                self.assertLess(float(p99), 100, f"{name}: {said}")
            drawn = int(re.search(r"polls with a frame: (\d+)", said).group(1))
            self.assertGreater(drawn, 100, said)
            # pose(0) of the example: the edge is lifted by 0.7 and moved by 0.3, from z = -2.
            self.assertIn("the edge is at 0.0000 0.7000 -1.7000", said)


if __name__ == "__main__":
    SERVER, DRAG = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1], verbosity=2)
