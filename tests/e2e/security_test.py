"""TLS, mutual TLS, bearer tokens and file descriptors as an operator sets them up, with files made by openssl."""

import base64
import json
import os
import socket
import subprocess
import time
import urllib.error
import urllib.request

import programs

FOREVER = 4102444800  # the year 2100


def openssl(*arguments, **options):
    done = subprocess.run(["openssl", *arguments], capture_output=True, timeout=programs.PATIENCE, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def base64url(data):
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


class OnFiles(programs.OnShapes):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name in ("authority", "stranger"):
            openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", f"/CN={name}",
                    "-addext", "keyUsage=critical,keyCertSign,cRLSign", "-days", "2", "-keyout", cls.at(f"{name}.key"),
                    "-out", cls.at(f"{name}.pem"))
        for name, authority in (("server", "authority"), ("alice", "authority"), ("mallory", "stranger")):
            cls.certify(name, authority)

    @classmethod
    def certify(cls, name, authority):
        openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", f"/CN={name}",
                "-keyout", cls.at(f"{name}.key"), "-out", cls.at(f"{name}.csr"))
        with open(cls.at("extensions"), "w") as file:
            file.write(f"subjectAltName=DNS:{name},IP:127.0.0.1\nauthorityKeyIdentifier=keyid\n")
        openssl("x509", "-req", "-in", cls.at(f"{name}.csr"), "-CA", cls.at(f"{authority}.pem"), "-CAkey",
                cls.at(f"{authority}.key"), "-CAcreateserial", "-days", "2", "-extfile", cls.at("extensions"),
                "-out", cls.at(f"{name}.pem"))

    def serve(self, *arguments):
        server = programs.RunningServer(*arguments)
        self.addCleanup(server.stop)
        return server

    def ask(self, server, *arguments):
        return programs.run("deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server", server.address, *arguments)

    def start_fails(self, *arguments):
        done = subprocess.run([programs.server(), "--address", "127.0.0.1:0", *arguments], capture_output=True, text=True,
                              timeout=programs.PATIENCE)
        self.assertEqual(done.returncode, 1, done.stderr)
        return done.stderr.splitlines()[-1]


class Tls(OnFiles):
    def test_serves_whom_its_certificate_convinces(self):
        server = self.serve("--tls-cert", self.at("server.pem"), "--tls-key", self.at("server.key"),
                            "--admin-address", "127.0.0.1:0")
        done = self.ask(server, "--tls-ca", self.at("authority.pem"))
        self.assertEqual(done.returncode, 0, done.stderr)
        for flags in ([], ["--tls"], ["--tls-ca", self.at("stranger.pem")]):
            self.assertEqual(self.ask(server, *flags).returncode, 3, flags)
        healthy = subprocess.run([programs.server(), "--healthcheck", server.admin], timeout=programs.PATIENCE)
        self.assertEqual(healthy.returncode, 0)

    def test_mutual_tls_lets_in_only_whom_the_authority_knows(self):
        server = self.serve("--tls-cert", self.at("server.pem"), "--tls-key", self.at("server.key"),
                            "--tls-client-ca", self.at("authority.pem"))
        trust = ("--tls-ca", self.at("authority.pem"))
        known = self.ask(server, *trust, "--tls-cert", self.at("alice.pem"), "--tls-key", self.at("alice.key"))
        self.assertEqual(known.returncode, 0, known.stderr)
        self.assertEqual(self.ask(server, *trust).returncode, 3)
        stranger = self.ask(server, *trust, "--tls-cert", self.at("mallory.pem"), "--tls-key", self.at("mallory.key"))
        self.assertEqual(stranger.returncode, 3)

    def replace(self, name, text):
        self.write("next.pem", text)
        os.replace(self.at("next.pem"), self.at(name))

    def test_a_certificate_is_renewed_and_a_damaged_one_leaves_the_old_in_force(self):
        for end in ("pem", "key"):
            self.replace(f"shown.{end}", programs.read_text(self.at(f"server.{end}")))
        server = self.serve("--tls-cert", self.at("shown.pem"), "--tls-key", self.at("shown.key"))
        trust = ("--tls-ca", self.at("authority.pem"))
        chain = programs.read_text(self.at("server.pem"))
        stranger = programs.read_text(self.at("mallory.pem"))
        for damaged in (chain.replace("MII", "MI!", 1), chain[:len(chain) // 2], chain + chain[:200], "", stranger):
            self.replace("shown.pem", damaged)
            server.waits_for("certificate_not_read")
            done = self.ask(server, *trust)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.replace("shown.pem", chain)
            server.waits_for("certificate_read_again")
        # One that is good: of another key, in two steps, and then in force for whoever comes.
        self.replace("shown.pem", stranger)
        self.replace("shown.key", programs.read_text(self.at("mallory.key")))
        end = time.monotonic() + programs.PATIENCE
        while self.ask(server, *trust).returncode == 0:
            self.assertLess(time.monotonic(), end)
        done = self.ask(server, "--tls-ca", self.at("stranger.pem"))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_files_that_cannot_be_used_are_named(self):
        cert, key, missing = self.at("server.pem"), self.at("server.key"), self.at("missing.pem")
        self.assertIn("both a certificate chain and its private key", self.start_fails("--tls-cert", cert))
        self.assertIn(missing, self.start_fails("--tls-cert", missing, "--tls-key", key))
        self.assertIn(self.at("alice.key"), self.start_fails("--tls-cert", cert, "--tls-key", self.at("alice.key")))
        self.assertIn(key, self.start_fails("--tls-cert", cert, "--tls-key", key, "--tls-client-ca", key))
        self.assertIn("missing", self.refused(2, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server",
                                              "127.0.0.1:1", "--tls-ca", missing))


class Tokens(OnFiles):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name in ("first", "second"):
            openssl("genpkey", "-algorithm", "RSA", "-pkeyopt", "rsa_keygen_bits:2048", "-out", cls.at(f"{name}.private"))
            openssl("pkey", "-in", cls.at(f"{name}.private"), "-pubout", "-out", cls.at(f"{name}.public"))

    def token(self, key, **claims):
        """A file with one, signed by openssl."""
        head = base64url(json.dumps({"alg": "RS256", "typ": "JWT"}).encode())
        body = base64url(json.dumps(claims).encode())
        signature = openssl("dgst", "-sha256", "-sign", self.at(f"{key}.private"), input=f"{head}.{body}".encode())
        return self.write(f"{key}.token", f"{head}.{body}.{base64url(signature)}\n")

    def use_keys(self, *names):
        self.write("keys.next", "".join(programs.read_text(self.at(f"{name}.public")) for name in names))
        os.replace(self.at("keys.next"), self.at("keys.pem"))
        return self.at("keys.pem")

    def test_keys_are_rotated_without_a_restart(self):
        server = self.serve("--token-keys", self.use_keys("first"))
        first, second = (self.token(key, sub="alice", exp=FOREVER) for key in ("first", "second"))
        done = self.ask(server, "--token-file", first)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.ask(server, "--token-file", second).returncode, 3)
        self.use_keys("second")
        end = time.monotonic() + programs.PATIENCE
        while self.ask(server, "--token-file", second).returncode != 0:
            self.assertLess(time.monotonic(), end)
        self.assertEqual(self.ask(server, "--token-file", first).returncode, 3)

    def test_without_a_good_token_nothing_is_done(self):
        server = self.serve("--token-keys", self.use_keys("first"), "--token-audience", "lpdeform")
        self.assertIn('header "authorization: Bearer <token>"', self.ask(server).stderr)
        late = self.token("first", sub="alice", aud="lpdeform", exp=1000000000)
        self.assertIn("has expired", self.ask(server, "--token-file", late).stderr)
        other = self.token("first", sub="alice", aud="elsewhere", exp=FOREVER)
        self.assertIn("not one that this server takes", self.ask(server, "--token-file", other).stderr)
        self.assertNotIn(programs.read_text(other).strip()[:40], "".join(server.log))
        look = self.token("first", sub="alice", aud="lpdeform", exp=FOREVER, lpdeform_role="viewer")
        self.assertIn("bearer token is read-only", self.ask(server, "--token-file", look).stderr)

    def test_files_that_cannot_be_used_are_named(self):
        self.assertIn("no PEM block", self.start_fails("--token-keys", self.write("empty.pem", "")))
        self.assertIn("/no/such", self.start_fails("--token-keys", "/no/such"))
        for text in ("", "two words\n"):
            self.assertIn("does not hold a token", self.refused(
                2, "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--server", "127.0.0.1:1",
                "--token-file", self.write("bad.token", text)))


class Exposure(OnFiles):
    def test_without_authentication_it_serves_this_machine_alone_and_says_so(self):
        server = self.serve()
        end = time.monotonic() + programs.PATIENCE
        while not any('"no_authentication"' in line for line in list(server.log)):
            self.assertLess(time.monotonic(), end)
        done = subprocess.run([programs.server(), "--address", "0.0.0.0:0"], capture_output=True, text=True,
                              timeout=programs.PATIENCE)
        self.assertEqual(done.returncode, 1)
        self.assertIn("for this machine alone, not on 0.0.0.0:0; give --token-keys", done.stderr)

    def test_a_container_may_be_open_where_that_is_said(self):
        process = subprocess.Popen([programs.server(), "--address", "0.0.0.0:0", "--allow-anonymous"], text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait, programs.PATIENCE)
        self.addCleanup(process.terminate)
        said = ""
        while '"no_authentication"' not in said:
            line = process.stdout.readline()
            self.assertNotEqual(line, "")
            said += line
        self.assertIn("Anyone who reaches the address may call", said)


def status_of(url):
    """The status of the answer and the one in it."""
    try:
        with urllib.request.urlopen(url, timeout=programs.PATIENCE) as answer:
            return answer.status, json.load(answer)["status"]
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)["status"]


class Descriptors(OnFiles):
    """gRPC's own listener would never take a connection again (CVE-2023-4785)."""

    def open_many(self, server, count):
        host, port = server.address.split(":")
        sockets = []
        for _ in range(count):
            sockets.append(socket.create_connection((host, int(port)), timeout=programs.PATIENCE))
        return sockets

    def healthy(self, server):
        return subprocess.run([programs.server(), "--healthcheck", server.address], timeout=programs.PATIENCE).returncode == 0

    def serves_again_after(self, server, sockets):
        for one in sockets:
            one.close()
        end = time.monotonic() + programs.PATIENCE
        while not self.healthy(server):
            self.assertLess(time.monotonic(), end)
        self.assertEqual(self.ask(server).returncode, 0)

    def test_after_its_connections_were_used_up_it_takes_them_again(self):
        server = self.serve("--max-connections", "10")
        for _ in range(3):
            sockets = self.open_many(server, 40)
            self.assertFalse(self.healthy(server))
            self.serves_again_after(server, sockets)

    def test_after_descriptors_ran_out_it_takes_connections_again(self):
        # As much as the shell allows: too few for 400 connections.
        wrapper = self.write("few", f'#!/bin/sh\nulimit -n 160\nexec {programs.server()} "$@"\n')
        os.chmod(wrapper, 0o755)
        server = programs.RunningServer("--admin-address", "127.0.0.1:0", program=wrapper)
        self.addCleanup(server.stop)
        for _ in range(3):
            sockets = self.open_many(server, 400)
            self.assertFalse(self.healthy(server))
            self.assertEqual(status_of(server.admin + "/livez"), (200, "full"))  # nobody is to start it again
            self.assertEqual(status_of(server.admin + "/healthz"), (503, "full"))
            self.serves_again_after(server, sockets)


if __name__ == "__main__":
    programs.main()
