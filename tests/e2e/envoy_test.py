"""Envoy as deploy/web starts it: TLS with clients and servers, and which clients it admits under load."""

import contextlib
import json
import os
import socket
import ssl
import subprocess
import tempfile
import time
import urllib.parse
import urllib.request

import programs
from security_test import OnFiles

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
PYTHON = os.path.join(ROOT, "build", "python", "bin", "python")

# Opens a session, then moves once for each line that it is told, and says so.
SESSION_OF_PYTHON = """
import sys, lpdeform
address, *files = sys.argv[1:]
tls = lpdeform.Tls(*(open(file).read() for file in files)) if files else False
triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
with lpdeform.open(triangle, [[0, 1, 2]], address=address, tls=tls) as session:
    session.set_handle("still", [0])
    session.set_handle("moved", [1])
    print("open", flush=True)
    for _ in sys.stdin:
        print(session.move("moved", translation=(0, 0, 1)).positions[1][2], flush=True)
"""

# Calls once for each line that it is told, by one channel, and says so.
CALLS_OF_PYTHON = """
import sys, grpc
call = grpc.insecure_channel(sys.argv[1]).unary_unary("/lpdeform.v1.DeformService/ListSessions")
print("open", flush=True)
for _ in sys.stdin:
    call(b"", timeout=60)
    print("answered", flush=True)
"""


class Envoy:
    """deploy/web on a free port. `admin`: the URL of its own page. `root`: of a clone with another deploy/."""

    def __init__(self, *arguments, root=ROOT):
        self.folder = tempfile.TemporaryDirectory()
        self.log = os.path.join(self.folder.name, "log")
        admin = os.path.join(self.folder.name, "admin")
        self.process = subprocess.Popen([os.path.join(root, "deploy", "web"), "--web", "127.0.0.1:0", "--admin-file", admin, "--files",
                                         "none", "--access-log", self.log, *arguments])
        end = time.monotonic() + programs.PATIENCE
        while not (os.path.exists(admin) and programs.read_text(admin)):
            assert self.process.poll() is None and time.monotonic() < end, "Envoy does not start"
            time.sleep(0.02)
        self.admin = f"http://{programs.read_text(admin)}"
        while len(where := self.page("listeners").get("listener_statuses", [])) < 1 + sum(option in arguments for option in ("--health", "--stats")):
            assert self.process.poll() is None and time.monotonic() < end, "Envoy does not listen"
            time.sleep(0.02)
        ports = {one["name"]: one["local_address"]["socket_address"]["port_value"] for one in where}
        self.port = ports["web"]
        self.address = f"127.0.0.1:{self.port}"
        self.health = f"http://127.0.0.1:{ports.get('health')}/healthz"
        self.metrics = f"http://127.0.0.1:{ports.get('stats')}"

    def page(self, name):
        with urllib.request.urlopen(f"{self.admin}/{name}?format=json", timeout=programs.PATIENCE) as answer:
            return json.load(answer)

    def stats(self):
        return {one["name"]: one["value"] for one in self.page("stats")["stats"] if "value" in one}

    def end(self):
        self.process.terminate()
        self.process.wait()

    def stop(self):
        self.end()
        self.folder.cleanup()


class ThroughEnvoy(OnFiles):
    def setUp(self):
        # Files that a test puts others in place of.
        for name in ("web.pem", "web.key"):
            self.put(name, self.at(name.replace("web", "server")))

    def put(self, name, source):
        """As an operator renews a file: in one step."""
        with open(self.at("next"), "wb") as file:
            file.write(programs.read_bytes(source))
        os.replace(self.at("next"), self.at(name))

    def start(self, *arguments):
        envoy = Envoy(*arguments)
        self.addCleanup(envoy.stop)
        return envoy

    def tls_to_clients(self):
        return ("--tls-cert", self.at("web.pem"), "--tls-key", self.at("web.key"), "--tls-client-ca", self.at("authority.pem"))

    def as_caller(self, name):
        return ("--tls-ca", self.at("authority.pem"), "--tls-cert", self.at(f"{name}.pem"), "--tls-key", self.at(f"{name}.key"))

    def until_served(self, envoy, *arguments):
        end = time.monotonic() + programs.PATIENCE
        while (done := self.ask(envoy, *arguments)).returncode != 0:
            self.assertLess(time.monotonic(), end, done.stderr)
            time.sleep(0.05)

    def shown(self, envoy, protocol="h2"):
        """The certificate that a client is shown, who speaks `protocol`."""
        context = ssl.create_default_context(cafile=self.at("authority.pem"))
        context.load_cert_chain(self.at("alice.pem"), self.at("alice.key"))
        context.set_alpn_protocols([protocol])
        with context.wrap_socket(socket.create_connection(("127.0.0.1", envoy.port), programs.PATIENCE),
                                 server_hostname="127.0.0.1") as connection:
            self.assertEqual(connection.selected_alpn_protocol(), protocol)
            return ssl.DER_cert_to_PEM_cert(connection.getpeercert(binary_form=True)).split()

    def until(self, holds):
        end = time.monotonic() + programs.PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def python(self, program, envoy, *files):
        client = subprocess.Popen([PYTHON, "-c", program, envoy.address, *map(self.at, files)], stdin=subprocess.PIPE,
                                  stdout=subprocess.PIPE, text=True)
        self.addCleanup(client.stdout.close)
        self.addCleanup(client.wait, programs.PATIENCE)
        self.addCleanup(client.stdin.close)
        self.assertEqual(client.stdout.readline(), "open\n")
        return client

    def next_of(self, client):
        client.stdin.write("\n")
        client.stdin.flush()
        return client.stdout.readline().strip()


class Tls(ThroughEnvoy):
    def test_lets_in_whom_the_authority_knows_and_reaches_a_server_that_asks_as_much_of_envoy(self):
        server = self.serve("--tls-cert", self.at("server.pem"), "--tls-key", self.at("server.key"), "--tls-client-ca",
                            self.at("authority.pem"))
        envoy = self.start("--server", server.address, *self.tls_to_clients(), "--server-ca", self.at("authority.pem"),
                           "--server-cert", self.at("alice.pem"), "--server-key", self.at("alice.key"))
        self.until_served(envoy, *self.as_caller("alice"))
        self.assertEqual(self.ask(envoy, "--tls-ca", self.at("authority.pem")).returncode, 3)  # shows no certificate
        self.assertEqual(self.ask(envoy, *self.as_caller("mallory")).returncode, 3)
        self.assertEqual(self.ask(envoy).returncode, 3)  # in plain text
        session = self.python(SESSION_OF_PYTHON, envoy, "authority.pem", "alice.pem", "alice.key")
        self.assertEqual(self.next_of(session), "1.0")
        for protocol in ("h2", "http/1.1"):
            self.shown(envoy, protocol)

    def test_certificates_are_renewed_while_sessions_go_on_and_the_old_one_holds_where_the_new_is_none(self):
        envoy = self.start("--server", self.serve().address, *self.tls_to_clients())
        self.until_served(envoy, *self.as_caller("alice"))
        session = self.python(SESSION_OF_PYTHON, envoy, "authority.pem", "alice.pem", "alice.key")
        old = programs.read_text(self.at("server.pem")).split()
        self.assertEqual(self.shown(envoy), old)

        failures = self.failures(envoy)
        self.put("web.pem", self.write("damaged", "-----BEGIN CERTIFICATE-----\nno\n-----END CERTIFICATE-----\n"))
        self.until(lambda: self.failures(envoy) > failures)
        self.assertEqual(self.shown(envoy), old)

        self.certify("renewed", "authority")
        self.put("web.key", self.at("renewed.key"))
        self.put("web.pem", self.at("renewed.pem"))
        renewed = programs.read_text(self.at("renewed.pem")).split()
        self.until(lambda: self.shown(envoy) == renewed)
        self.assertEqual(self.next_of(session), "1.0")
        self.until_served(envoy, *self.as_caller("alice"))

    def failures(self, envoy):
        return envoy.stats()["sds.tls-cert.key_rotation_failed"]

    def test_a_server_that_the_authority_or_its_name_does_not_vouch_for_is_not_called(self):
        server = self.serve("--tls-cert", self.at("server.pem"), "--tls-key", self.at("server.key"))
        for flags, why in ((("--server-ca", self.at("stranger.pem")), "fail_verify_error"),
                           (("--server-ca", self.at("authority.pem"), "--server-name", "elsewhere"), "fail_verify_san")):
            envoy = self.start("--server", server.address, *flags)
            self.until(lambda: envoy.stats()[f"cluster.lpdeform.ssl.{why}"] > 0)
            done = self.ask(envoy)
            self.assertEqual(done.returncode, 3)
            self.assertIn("no healthy upstream", done.stderr)
        named = self.start("--server", server.address, "--server-ca", self.at("authority.pem"), "--server-name", "server")
        self.until_served(named)


class Connections(ThroughEnvoy):
    def open_many(self, envoy, count):
        """HTTP/2 without a call."""
        opened = []
        for _ in range(count):
            opened.append(socket.create_connection(("127.0.0.1", envoy.port), programs.PATIENCE))
            self.addCleanup(opened[-1].close)
            opened[-1].sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0")
        return opened

    def is_well(self, envoy):
        with urllib.request.urlopen(envoy.health, timeout=programs.PATIENCE) as answer:
            return answer.status == 200

    def test_where_they_are_used_up_those_who_are_in_stay_in_and_health_is_answered(self):
        envoy = self.start("--server", self.serve().address, "--max-connections", "4", "--health", "127.0.0.1:0",
                           "--connection-idle", "300")
        self.until_served(envoy)
        session = self.python(SESSION_OF_PYTHON, envoy)
        self.open_many(envoy, 8)
        self.until(lambda: envoy.stats()["http.web.downstream_cx_active"] == 4)
        for _ in range(3):  # none of which makes a place
            self.assertTrue(self.is_well(envoy))
            self.assertEqual(self.ask(envoy).returncode, 3)
        self.assertEqual(self.next_of(session), "1.0")
        envoy.end()
        calls = [json.loads(line) for line in programs.read_text(envoy.log).splitlines()]
        self.assertTrue(calls)
        for call in calls:
            self.assertRegex(call["client"], r"^127\.0\.0\.1:\d+$")

    def test_whoever_trickles_headers_at_the_port_for_probes_keeps_nobody_else_from_it(self):
        envoy = self.start("--server", self.serve().address, "--health", "127.0.0.1:0")
        self.until_served(envoy)  # it listens a little later than it tells its ports
        place = urllib.parse.urlsplit(envoy.health)
        tricklers = [socket.create_connection((place.hostname, place.port), programs.PATIENCE) for _ in range(200)]
        for one in tricklers:
            self.addCleanup(one.close)
        for letter in "GET /":
            for one in tricklers:
                with contextlib.suppress(OSError):  # it has had its time
                    one.sendall(letter.encode())
            self.assertTrue(self.is_well(envoy))
            time.sleep(0.3)

    def test_those_without_a_call_are_closed_and_clients_come_back_by_themselves(self):
        envoy = self.start("--server", self.serve().address, "--connection-idle", "1")
        self.until_served(envoy)
        session, calls = self.python(SESSION_OF_PYTHON, envoy), self.python(CALLS_OF_PYTHON, envoy)
        self.assertEqual(self.next_of(calls), "answered")
        for one in self.open_many(envoy, 8):
            while one.recv(65536):
                pass
        self.until(lambda: envoy.stats()["http.web.downstream_cx_active"] == 1)  # the session's, which has a stream
        self.assertEqual(self.next_of(calls), "answered")
        self.assertEqual(self.next_of(session), "1.0")


class Refused(ThroughEnvoy):
    def refuses(self, *arguments):
        done = subprocess.run([os.path.join(ROOT, "deploy", "web"), "--files", "none", *arguments], capture_output=True, text=True,
                              timeout=programs.PATIENCE)
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr

    def test_files_that_cannot_be_used_are_named(self):
        cert, key, missing = self.at("server.pem"), self.at("server.key"), self.at("missing.pem")
        self.assertIn("both a certificate chain and its private key: --tls-cert", self.refuses("--tls-cert", cert))
        self.assertIn("--server-key", self.refuses("--server-ca", cert, "--server-key", key))
        self.assertIn(missing, self.refuses("--tls-cert", missing, "--tls-key", key))
        self.assertIn(f"{cert} has no PEM block 'PRIVATE KEY'", self.refuses("--tls-cert", cert, "--tls-key", cert))
        self.assertIn("is not the key of", self.refuses("--tls-cert", cert, "--tls-key", self.at("alice.key")))
        self.assertIn("--tls-client-ca needs --tls-cert", self.refuses("--tls-client-ca", cert))
        self.assertIn("need --server-ca", self.refuses("--server-name", "server"))
        for option in ("--health", "--stats"):
            self.assertIn(f"{option} takes HOST:PORT", self.refuses(option, "8081"))
        self.assertIn("--stats needs an --admin-port other than 0", self.refuses("--stats", "127.0.0.1:0", "--admin-port", "0"))
        for option in ("--max-connections", "--connection-idle"):
            self.assertIn(f"{option} takes 1 to 999999", self.refuses(option, "0"))
        self.assertIn("--server-name takes", self.refuses("--server-ca", cert, "--server-name", "a b"))


if __name__ == "__main__":
    programs.main()
