"""Envoy's metrics for Prometheus (deploy/web --stats): dashboard, alerts and the operator's pages use only metrics that exist."""

import contextlib
import glob
import http.client
import os
import re
import socket
import time

import metrics_test
import programs
from envoy_test import Envoy

PAGES = glob.glob(os.path.join(os.path.dirname(__file__), "..", "..", "deploy", "operating", "*.md"))
METRIC = re.compile(r"\b(envoy_[a-z0-9_]+)\s*(\{[^}]*\})?")


def free_port():
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as free:
        return free.getsockname()[1]


def start(server):
    """Until the port of Envoy's own page is one that nobody else has taken; then until Envoy takes connections, which is after it has
    said where."""
    for _ in range(20):
        with contextlib.suppress(AssertionError):
            envoy = Envoy("--server", server, "--stats", "127.0.0.1:0", "--admin-port", str(free_port()), "--health", "127.0.0.1:0")
            break
    else:
        raise AssertionError("Envoy does not start")
    host, port = envoy.metrics.removeprefix("http://").split(":")
    end = time.monotonic() + programs.PATIENCE
    while time.monotonic() < end:
        with contextlib.suppress(ConnectionRefusedError):
            socket.create_connection((host, int(port)), programs.PATIENCE).close()
            return envoy
        time.sleep(0.02)
    raise AssertionError("Envoy takes no connections")


class EnvoyMetrics(programs.OnShapes):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.envoy = start(cls.server.address)

    @classmethod
    def tearDownClass(cls):
        cls.envoy.stop()
        super().tearDownClass()

    def ask(self, path, method="GET", **headers):
        """Status and text; the path as it is."""
        connection = http.client.HTTPConnection(self.envoy.metrics.removeprefix("http://"), timeout=programs.PATIENCE)
        with contextlib.closing(connection):
            connection.request(method, path, headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()

    def scraped(self):
        status, text = self.ask("/stats/prometheus")
        self.assertEqual(status, 200)
        return metrics_test.samples(text)

    def until(self, holds):
        end = time.monotonic() + programs.PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)

    def healthy(self):
        return [value for labels, value in self.scraped()["envoy_cluster_membership_healthy"]
                if labels["envoy_cluster_name"] == "lpdeform"]

    def test_a_foreign_host_is_answered_nothing(self):
        for host, status in (("localhost", 200), ("127.0.0.1:8082", 200), ("[::1]:1", 200), ("evil.example", 404), ("127.0.0.1.evil.example:80", 404)):
            self.assertEqual(self.ask("/stats/prometheus", Host=host)[0], status, host)

    def test_they_are_all_that_the_port_answers(self):
        for path in ("/", "/stats", "/config_dump", "/quitquitquit", "//quitquitquit", "/stats/prometheus/", "/stats/prometheus/../config_dump",
                     "/stats/prometheus%2f..%2f..%2fconfig_dump", "/Stats/prometheus", "/server_info", "/logging?level=trace"):
            for method in ("GET", "POST"):
                self.assertEqual(self.ask(path, method)[0], 404, (method, path))
        self.assertEqual(self.ask("/stats/prometheus", "POST")[0], 404)
        self.assertEqual(self.ask("/stats/prometheus")[0], 200)

    def test_every_metric_and_label_of_dashboard_and_alerts_is_among_them(self):
        scraped = self.scraped()
        asked = metrics_test.of_job("lpdeform-web")
        self.assertGreater(len(asked), 15)
        for expression in asked:
            self.assertTrue(METRIC.search(expression) or re.search(r"\bup\{", expression), expression)
            self.assertEqual(metrics_test.unknown_in(expression, scraped, METRIC), [], expression)
            for metric, equal in metrics_test.selectors_in(expression):
                equal.pop("job", None)
                if metric != "up":
                    self.assertTrue([1 for labels, _ in scraped[metric] if equal.items() <= labels.items()], expression)

    def test_the_check_above_finds_wrong_names_and_labels(self):
        scraped = self.scraped()
        self.assertEqual(metrics_test.unknown_in("envoy_cluster_members > 0", scraped, METRIC), ["envoy_cluster_members"])
        self.assertEqual(metrics_test.unknown_in('envoy_server_live{zone="a"}', scraped, METRIC), ["envoy_server_live{zone}"])

    def test_every_metric_of_the_operators_pages_is_among_them(self):
        named = {name for page in PAGES for name in re.findall(r"`(envoy_[a-z0-9_]+)`", programs.read_text(page))}
        self.assertGreater(len(named), 8)
        self.assertEqual(named - set(self.scraped()), set())

    def test_a_server_that_goes_shows(self):
        server = programs.RunningServer()
        envoy, self.envoy = self.envoy, start(server.address)
        self.addCleanup(setattr, self, "envoy", envoy)
        self.addCleanup(self.envoy.stop)
        self.until(lambda: self.healthy() == [1])
        server.process.kill()
        server.stop()
        self.until(lambda: self.healthy() == [0])


if __name__ == "__main__":
    programs.main()
