"""Hostile requests, one by one, through Envoy while a token holder's streams are open; and names that only other sites have.

Run as: FILE SERVER CLI [unittest arguments], by the Python that has the client (build/python). Many more: tests/fuzz/requests.
"""

import http.client
import os
import sys
import unittest
import urllib.error
import urllib.request

import programs
from envoy_test import Envoy

sys.path.insert(0, os.path.realpath(os.path.join(os.path.dirname(__file__), "..", "fuzz")))

import request_cases as cases
import request_fuzz
import request_http2 as http2

LIST = b"/lpdeform.v1.DeformService/ListSessions"


def over_http2(path=LIST, more=(), trailers=None, kind=b"application/grpc"):
    """A call without a message's content, as a case of the fuzzer."""
    pairs = [[b":method", b"POST"], [b":scheme", b"http"], [b":path", path], [b":authority", b"localhost"], [b"content-type", kind],
             [b"te", b"trailers"], *map(list, more)]
    body = ["frame", http2.DATA, 0 if trailers else http2.END_STREAM, 1, bytes(5)]
    end = [["headers", 1, http2.END_STREAM, list(map(list, trailers))]] if trailers else []
    return ["h2", [["headers", 1, 0, pairs], body, *end]]


class Strangers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.world = request_fuzz.World(programs.server())

    @classmethod
    def tearDownClass(cls):
        cls.world.close()

    def nobody_notices(self, *cases_of_theirs):
        for case in cases_of_theirs:
            with self.subTest(request_fuzz.in_short(case)):
                self.assertEqual(request_fuzz.breaks(self.world, case), [])

    def test_binary_headers_that_are_no_base64(self):
        self.nobody_notices(*(over_http2(more=[(name, value)]) for name in cases.BINARY for value in (b"A", b"!!!!", b"AA,A")))

    def test_binary_headers_after_the_message(self):
        self.nobody_notices(*(over_http2(trailers=[(name, b"A")]) for name in (b"a-bin", b"grpc-trace-bin")))
        self.nobody_notices(over_http2(trailers=[(b"x-large", b"x" * 20_000)]))

    def test_headers_and_paths_of_any_size(self):
        for size in (7_000, 9_000, 20_000, 31_000, 34_000, 70_000):
            self.nobody_notices(over_http2(more=[(b"x-large", b"x" * size)]), over_http2(path=LIST + b"x" * size))
        self.nobody_notices(over_http2(more=[(b"x-%d" % k, b"") for k in range(95)] + [(b"x-large", b"x" * 29_000)]))

    def test_a_token_of_eight_kibibytes_is_read(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.world.envoy.port, timeout=programs.PATIENCE)
        connection.request("POST", LIST.decode(), bytes(5), {"content-type": "application/grpc-web+proto",
                                                            "authorization": "Bearer " + "x" * 8192})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        self.assertEqual(answer.headers["grpc-status"], "16", body)  # UNAUTHENTICATED, by the server
        self.assertIn("token", answer.headers["grpc-message"])


class OtherNames(programs.OnShapes):
    """DNS rebinding: a page of another site that gives its own name the address 127.0.0.1."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.admin = programs.RunningServer("--admin-address", "127.0.0.1:0")
        cls.envoy = Envoy("--server", cls.server.address)
        request_fuzz.wait_until_reached(cls.envoy)

    @classmethod
    def tearDownClass(cls):
        cls.envoy.stop()
        cls.admin.stop()
        super().tearDownClass()

    def call(self, envoy, host):
        """The status of a call through Envoy, and its text."""
        connection = http.client.HTTPConnection("127.0.0.1", envoy.port, timeout=programs.PATIENCE)
        connection.request("POST", LIST.decode(), bytes(5), {"content-type": "application/grpc-web+proto", "host": host})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return (answer.status, answer.headers.get("grpc-status", "0" if b"grpc-status:0" in body else None),
                answer.headers.get("grpc-message", body.decode("latin-1")))

    def is_refused(self, envoy, host):
        status, code, text = self.call(envoy, host)
        self.assertEqual((status, code), (200, "7"), text)  # PERMISSION_DENIED
        self.assertIn("must be called localhost, 127.0.0.1 or [::1]", urllib.request.unquote(text))

    def test_a_server_without_authentication_answers_by_names_of_its_own_machine_alone(self):
        for host in ("localhost", "127.0.0.1:8080", "[::1]:8080", "LOCALHOST:1"):
            self.assertEqual(self.call(self.envoy, host)[:2], (200, "0"), host)
        for host in ("evil.example", "evil.example:8080", "localhost.evil.example", "192.168.1.5:8080"):
            self.is_refused(self.envoy, host)

    def test_its_own_port_does_as_much(self):
        import grpc
        for authority, code in (("localhost:1", None), ("evil.example:50051", grpc.StatusCode.PERMISSION_DENIED)):
            with grpc.insecure_channel(self.server.address, [("grpc.default_authority", authority)]) as channel:
                call = channel.unary_unary(LIST.decode())
                try:
                    call(b"", timeout=programs.PATIENCE)
                    self.assertIsNone(code, authority)
                except grpc.RpcError as error:
                    self.assertEqual(error.code(), code, error)

    def test_so_does_the_admin_port(self):
        for host, status in (("localhost:9464", 200), ("127.0.0.1", 200), ("evil.example:9464", 403)):
            request = urllib.request.Request(self.admin.admin + "/metrics", headers={"Host": host})
            try:
                with urllib.request.urlopen(request, timeout=programs.PATIENCE) as answer:
                    self.assertEqual(answer.status, status, host)
            except urllib.error.HTTPError as error:
                with error:
                    self.assertEqual(error.code, status, host)

    def started(self, server, *arguments):
        envoy = Envoy("--server", server.address, *arguments)
        self.addCleanup(envoy.stop)
        request_fuzz.wait_until_reached(envoy)
        return envoy

    def test_who_lets_others_in_may_be_called_as_they_like(self):
        for arguments in (("--web", "0.0.0.0:0"), ("--host", "*")):
            self.assertEqual(self.call(self.started(self.server, *arguments), "deform.example:8080")[:2], (200, "0"))
        everybody = programs.RunningServer("--allow-anonymous")
        self.addCleanup(everybody.stop)
        self.assertEqual(self.call(self.started(everybody), "deform.example")[:2], (200, "0"))

    def test_envoy_answers_by_the_names_that_it_is_given(self):
        envoy = self.started(self.server, "--web", "0.0.0.0:0", "--host", "deform.example", "--host", "127.0.0.1")
        self.assertEqual(self.call(envoy, "deform.example:443")[:2], (200, "0"))
        self.assertEqual(self.call(envoy, "127.0.0.1:8080")[:2], (200, "0"))
        status, _, text = self.call(envoy, "evil.example")
        self.assertNotEqual((status, text), (200, ""))
        self.assertIn("No site of this name is here", urllib.request.unquote(text))

    def test_envoys_own_page_is_there_to_look_at_alone(self):
        for path in ("/quitquitquit", "/drain_listeners", "/healthcheck/fail"):
            with self.assertRaises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(urllib.request.Request(self.envoy.admin + path, method="POST"), timeout=programs.PATIENCE)
            self.assertEqual(refused.exception.code, 403)
            refused.exception.close()
        self.assertEqual(self.call(self.envoy, "localhost")[:2], (200, "0"))

    def test_pages_of_named_origins_call_as_before(self):
        envoy = self.started(self.server, "--origin", "https://pages.example")
        headers = {"content-type": "application/grpc-web+proto", "origin": "https://pages.example"}
        request = urllib.request.Request(f"http://{envoy.address}{LIST.decode()}", bytes(5), headers)
        with urllib.request.urlopen(request, timeout=programs.PATIENCE) as answer:
            self.assertEqual(answer.headers["access-control-allow-origin"], "https://pages.example")
            self.assertIn(b"grpc-status:0", answer.read())


if __name__ == "__main__":
    programs.main()
