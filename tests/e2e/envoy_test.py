"""TLS through Envoy as deploy/web starts it: browsers and native clients to Envoy, Envoy to a server."""

import json
import os
import socket
import ssl
import subprocess
import tempfile
import time
import urllib.request

import programs
from security_test import OnFiles

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
PYTHON = os.path.join(ROOT, "build", "python", "bin", "python")

# Opens a session, then moves once for each line that it is told, and says so.
SESSION_OF_PYTHON = """
import sys, lpdeform
address, *files = sys.argv[1:]
roots, chain, key = (open(file).read() for file in files)
tls = lpdeform.Tls(root_certificates=roots, certificate_chain=chain, private_key=key)
triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
with lpdeform.open(triangle, [[0, 1, 2]], address=address, tls=tls) as session:
    session.set_handle("still", [0])
    session.set_handle("moved", [1])
    print("open", flush=True)
    for _ in sys.stdin:
        print(session.move("moved", translation=(0, 0, 1)).positions[1][2], flush=True)
"""


class Envoy:
    """deploy/web on a free port. `admin`: the URL of its own page."""

    def __init__(self, *arguments):
        self.folder = tempfile.TemporaryDirectory()
        admin = os.path.join(self.folder.name, "admin")
        self.process = subprocess.Popen([os.path.join(ROOT, "deploy", "web"), "--admin-file", admin, "--web", "127.0.0.1:0", "--files",
                                         "none", "--access-log", os.path.join(self.folder.name, "log"), *arguments])
        end = time.monotonic() + programs.PATIENCE
        while not (os.path.exists(admin) and programs.read_text(admin)):
            assert self.process.poll() is None and time.monotonic() < end, "Envoy does not start"
            time.sleep(0.02)
        self.admin = f"http://{programs.read_text(admin)}"
        while not (web := [one for one in self.page("listeners")["listener_statuses"] if one["name"] == "web"]):
            assert self.process.poll() is None and time.monotonic() < end, "Envoy does not listen"
            time.sleep(0.02)
        where = web[0]["local_address"]["socket_address"]
        self.port = where["port_value"]
        self.address = f"{where['address']}:{self.port}"

    def page(self, name):
        with urllib.request.urlopen(f"{self.admin}/{name}?format=json", timeout=programs.PATIENCE) as answer:
            return json.load(answer)

    def stop(self):
        self.process.terminate()
        self.process.wait()
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

    def python_session(self, envoy):
        client = subprocess.Popen([PYTHON, "-c", SESSION_OF_PYTHON, envoy.address, self.at("authority.pem"), self.at("alice.pem"),
                                   self.at("alice.key")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.addCleanup(client.stdout.close)
        self.addCleanup(client.wait, programs.PATIENCE)
        self.addCleanup(client.stdin.close)
        self.assertEqual(client.stdout.readline(), "open\n")
        return client

    def moves(self, client):
        client.stdin.write("\n")
        client.stdin.flush()
        return client.stdout.readline() == "1.0\n"


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
        self.assertTrue(self.moves(self.python_session(envoy)))
        for protocol in ("h2", "http/1.1"):
            self.shown(envoy, protocol)

    def test_certificates_are_renewed_while_sessions_go_on_and_the_old_one_holds_where_the_new_is_none(self):
        envoy = self.start("--server", self.serve().address, *self.tls_to_clients())
        self.until_served(envoy, *self.as_caller("alice"))
        session = self.python_session(envoy)
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
        self.assertTrue(self.moves(session))
        self.until_served(envoy, *self.as_caller("alice"))

    def failures(self, envoy):
        stats = self.page_of(envoy)
        return stats["sds.tls-cert.key_rotation_failed"]

    def page_of(self, envoy):
        return {one["name"]: one["value"] for one in envoy.page("stats")["stats"] if "value" in one}

    def until(self, holds):
        end = time.monotonic() + programs.PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def test_a_server_that_the_authority_or_its_name_does_not_vouch_for_is_not_called(self):
        server = self.serve("--tls-cert", self.at("server.pem"), "--tls-key", self.at("server.key"))
        for flags, why in ((("--server-ca", self.at("stranger.pem")), "fail_verify_error"),
                           (("--server-ca", self.at("authority.pem"), "--server-name", "elsewhere"), "fail_verify_san")):
            envoy = self.start("--server", server.address, *flags)
            self.until(lambda: self.page_of(envoy)[f"cluster.lpdeform.ssl.{why}"] > 0)
            done = self.ask(envoy)
            self.assertEqual(done.returncode, 3)
            self.assertIn("no healthy upstream", done.stderr)
        named = self.start("--server", server.address, "--server-ca", self.at("authority.pem"), "--server-name", "server")
        self.until_served(named)


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
        self.assertIn("--server-name takes", self.refuses("--server-ca", cert, "--server-name", "a b"))


if __name__ == "__main__":
    programs.main()
