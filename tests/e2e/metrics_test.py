"""The admin port of lpdeform-server. The dashboard and the alerts of deploy/monitoring use only metrics that it has;
envoy_metrics_test.py checks those of Envoy."""

import json
import os
import re
import signal
import socket
import subprocess
import time
import unittest
import urllib.error
import urllib.request

import promql_parser
import yaml

import programs

MONITORING = os.path.join(os.path.dirname(__file__), "..", "..", "deploy", "monitoring")
ERRORS = os.path.join(os.path.dirname(__file__), "..", "..", "proto", "errors.md")
METRIC = re.compile(r"\b((?:lpdeform|grpc_server|process)_[a-z0-9_]+)\s*(\{[^}]*\})?")
ADDED_BY_PROMETHEUS = {"instance", "job"}


def get(url, method="GET"):
    """Status, content type and text."""
    try:
        with urllib.request.urlopen(urllib.request.Request(url, method=method), timeout=60) as answer:
            return answer.status, answer.headers["Content-Type"], answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.headers["Content-Type"], error.read().decode()


def samples(text):
    """{name: [(labels, value)]} of Prometheus's text format."""
    found = {}
    for line in text.splitlines():
        if not line or line.startswith("#"):
            continue
        name, labels, value = re.fullmatch(r"([a-z0-9_]+)(?:\{(.*)\})? (\S+)(?: \d+)?", line).groups()
        pairs = dict(re.findall(r'([a-z_]+)="([^"]*)"', labels or ""))
        found.setdefault(name, []).append((pairs, float(value)))
    return found


def unknown_in(expression, scraped, names=METRIC):
    """What the expression asks for and the scrape does not have: names of metrics, "name{label}" where the label is missing."""
    wrong = []
    used = names.findall(expression)
    grouped = [label.strip() for group in re.findall(r"\bby\s*\(([^)]*)\)", expression) for label in group.split(",")]
    for name, selector in used:
        if name not in scraped:
            wrong.append(name)
            continue
        has = {label for labels, _ in scraped[name] for label in labels} | ADDED_BY_PROMETHEUS
        asked = re.findall(r"([a-z_]+)\s*(?:=~|!~|!=|=)", selector or "") + grouped
        wrong += [f"{name}{{{label}}}" for label in asked if label not in has]
    return wrong


def selectors_in(expression):
    """(metric, {label: what it must equal}) of each place where a PromQL expression asks for one. Raises where it is none."""
    found = []

    def walk(part):
        if isinstance(part, promql_parser.VectorSelector):
            found.append((part.name, {one.name: one.value for one in part.matchers.matchers if one.op == promql_parser.MatchOp.Equal}))
        for name in ("lhs", "rhs", "expr", "vector_selector"):
            if hasattr(part, name):
                walk(getattr(part, name))
        for argument in getattr(part, "args", []):
            walk(argument)

    walk(promql_parser.parse(expression))
    return found


def dashboard():
    return json.loads(programs.read_text(os.path.join(MONITORING, "dashboard.json")))


def alerts():
    return [rule for group in yaml.safe_load(programs.read_text(os.path.join(MONITORING, "alerts.yaml")))["groups"]
            for rule in group["rules"]]


def expressions():
    """What dashboard and alerts ask Prometheus."""
    found = [target["expr"].replace("$__rate_interval", "5m") for panel in dashboard()["panels"] for target in panel["targets"]]
    return found + [rule["expr"] for rule in alerts()]


def of_job(job):
    """Those of them about this job alone."""
    return [one for one in expressions() if {equal.get("job") for _, equal in selectors_in(one)} == {job}]


class Metrics(programs.OnShapes):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server.stop()
        cls.server = programs.RunningServer("--admin-address", "127.0.0.1:0", "--max-vertices", str(cls.vertices("bar")))
        bar = cls.at("bar.off")
        done = programs.run("deform", bar, "--handles", cls.at("bar.json"), "--server", cls.server.address)
        assert done.returncode == 0, done.stderr
        refused = programs.run("deform", cls.at("creature.off"), "--handles", cls.at("creature.json"),
                               "--server", cls.server.address)
        assert refused.returncode == 2, refused.stderr
        end = time.monotonic() + programs.PATIENCE
        while True:
            status, kind, cls.text = get(cls.server.admin + "/metrics")
            assert status == 200 and kind == "text/plain; version=0.0.4", (status, kind)
            cls.scraped = samples(cls.text)
            if cls.unended() == 0:
                break
            assert time.monotonic() < end, cls.text

    @classmethod
    def unended(cls):
        """Calls that clients have the answer of, and the server has not put away yet."""
        started, ended = ("grpc_server_call_started_total", "grpc_server_call_duration_seconds_count")
        return sum(value for _, value in cls.scraped[started]) - sum(value for _, value in cls.scraped.get(ended, []))

    @classmethod
    def vertices(cls, shape):
        return int(programs.read_text(cls.at(f"{shape}.off")).split()[1])

    def value(self, name, **labels):
        return sum(value for has, value in self.scraped[name] if labels.items() <= has.items())

    def test_slow_peers_keep_nobody_from_the_pages(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0")
        self.addCleanup(server.stop)
        host, port = server.admin.removeprefix("http://").split(":")
        tricklers = [socket.create_connection((host, int(port))) for _ in range(64)]
        for trickler in tricklers:
            self.addCleanup(trickler.close)
            trickler.sendall(b"GET /livez HTTP/1.1\r\n")
            trickler.setblocking(False)
        for page in ("/livez", "/healthz", "/metrics"):
            for trickler in tricklers:
                trickler.send(b"x")
            self.assertEqual(get(server.admin + page)[0], 200)
        for trickler in tricklers:
            with self.assertRaises(BlockingIOError):  # it is still there, and has not been answered
                trickler.recv(1)

    def test_every_metric_of_the_dashboard_and_the_alerts_is_in_a_scrape(self):
        asked = of_job("lpdeform")
        self.assertGreater(len(asked), 60)
        self.assertEqual(len(asked) + len(of_job("lpdeform-web")), len(expressions()))
        for expression in asked:
            self.assertTrue(METRIC.search(expression) or re.search(r"\bup\{", expression), expression)
            self.assertEqual(unknown_in(expression, self.scraped), [], expression)

    def test_the_check_above_finds_wrong_names_and_labels(self):
        self.assertEqual(unknown_in('rate(lpdeform_update_total{instance="a"}[5m])', self.scraped), ["lpdeform_update_total"])
        self.assertEqual(unknown_in('sum by (mesh) (lpdeform_sessions)', self.scraped), ["lpdeform_sessions{mesh}"])
        self.assertEqual(unknown_in('lpdeform_sessions{mesh="a"}', self.scraped), ["lpdeform_sessions{mesh}"])

    def test_alerts_and_dashboard_are_promql_and_ask_for_our_servers_alone(self):
        for expression in expressions():
            selectors = selectors_in(expression)
            self.assertTrue(selectors, expression)
            for metric, equal in selectors:
                self.assertIn(equal.get("job"), ("lpdeform", "lpdeform-web"), f"{metric} in {expression}")

    def test_the_check_above_finds_what_is_no_promql_and_what_others_have_too(self):
        for wrong in ("sum(up", "rate(up) > 0", "up >", "histogram_quantile(0.9)"):
            with self.assertRaises(ValueError, msg=wrong):
                selectors_in(wrong)
        self.assertEqual(selectors_in('process_open_fds / process_max_fds{job="lpdeform"} > 0.8'),
                         [("process_open_fds", {}), ("process_max_fds", {"job": "lpdeform"})])

    def test_every_metric_is_on_the_dashboard(self):
        shown = json.dumps(dashboard())
        families = set(re.findall(r"^# TYPE (\S+)", self.text, re.MULTILINE))
        self.assertGreater(len(families), 20)
        self.assertEqual([name for name in families if name not in shown], [])

    def test_alerts_name_reasons_that_exist_and_say_what_to_do(self):
        known = programs.read_text(ERRORS)
        for rule in alerts():
            self.assertIn(rule["labels"]["severity"], ("page", "ticket"))
            self.assertTrue(rule["annotations"]["summary"] and rule["annotations"]["action"])
            for reason in re.findall(r"\b[A-Z]+_[A-Z_]+\b", rule["expr"]):
                self.assertIn(f"`{reason}`", known)

    def test_counts_what_happened(self):
        solve = "lpdeform.v1.DeformService/Solve"
        self.assertEqual(self.value("grpc_server_call_started_total", grpc_method=solve), 1)
        self.assertEqual(self.value("grpc_server_call_duration_seconds_count", grpc_method=solve, grpc_status="OK"), 1)
        self.assertEqual(self.value("lpdeform_rejections_total", reason="MESH_TOO_LARGE"), 1)
        self.assertEqual(self.value("lpdeform_solve_seconds_count"), 1)
        self.assertEqual(self.value("lpdeform_sessions_created_total"), 1)
        self.assertEqual(self.value("lpdeform_sessions_ended_total", reason="deleted"), 1)
        self.assertEqual(self.value("lpdeform_sessions"), 0)
        self.assertEqual(self.value("lpdeform_streams"), 0)
        frame = "grpc_server_call_sent_total_compressed_message_size_bytes_sum"
        self.assertGreater(self.value(frame, grpc_method=solve, grpc_status="OK"), 16 * self.vertices("bar"))
        self.assertGreater(self.value("process_open_fds"), 3)
        self.assertLess(self.value("process_open_fds"), self.value("process_max_fds"))

    def test_no_label_has_a_session_in_it(self):
        values = {value for has in self.scraped.values() for labels, _ in has for name, value in labels.items() if name != "le"}
        self.assertIn("MESH_TOO_LARGE", values)
        self.assertEqual([value for value in values if re.search(r"[0-9a-f]{8}", value)], [])


class Health(programs.OnShapes):
    def test_answers_reading_of_its_pages_alone(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0")
        self.addCleanup(server.stop)
        for page in ("/healthz", "/livez"):
            status, kind, text = get(server.admin + page)
            self.assertEqual((status, kind), (200, "application/json"))
            found = json.loads(text)
            self.assertEqual(found["status"], "serving")
            self.assertEqual(set(found["checks"]), {"takes_connections", "takes_calls", "runs_sessions"})
            self.assertTrue(all(found["checks"].values()))
        self.assertEqual(get(server.admin + "/healthz", "POST")[0], 404)
        self.assertEqual(get(server.admin + "/healthz", "HEAD")[2], "")
        for page in ("/", "/etc/passwd", "/metrics/x", "/../metrics.cc"):
            self.assertEqual(get(server.admin + page)[0], 404, page)

    def test_a_server_that_drains_is_alive_and_not_ready(self):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0", "--grace", "200")
        # Nobody has so much patience: it runs until it is stopped.
        solve = subprocess.Popen([programs.cli(), "deform", self.at("bar.off"), "--handles", self.at("bar.json"), "--p", "1",
                                  "--method", "line_search", "--tolerance", "1e-14", "--max-iterations", "2000000000",
                                  "--server", server.address], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        started = 'grpc_server_call_started_total{grpc_method="lpdeform.v1.DeformService/Solve"} 1'
        self.wait_for(lambda: started in get(server.admin + "/metrics")[2])
        server.process.send_signal(signal.SIGTERM)
        self.wait_for(lambda: get(server.admin + "/healthz")[0] == 503)
        self.assertEqual(json.loads(get(server.admin + "/healthz")[2])["status"], "draining")
        self.assertEqual(get(server.admin + "/livez")[0], 200)
        self.assertEqual(samples(get(server.admin + "/metrics")[2])["lpdeform_draining"], [({}, 1)])
        solve.kill()
        solve.wait(programs.PATIENCE)
        self.assertEqual(server.stop(), 0)

    def wait_for(self, condition):
        end = time.monotonic() + programs.PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), end)

    def test_an_address_that_is_taken_or_wrong_is_said(self):
        first = programs.RunningServer("--admin-address", "127.0.0.1:0")
        self.addCleanup(first.stop)
        for address in (first.admin.removeprefix("http://"), "nowhere.invalid:1", "127.0.0.1:99999", "words"):
            done = subprocess.run([programs.server(), "--address", "127.0.0.1:0", "--admin-address", address],
                                  capture_output=True, text=True, timeout=programs.PATIENCE)
            self.assertEqual(done.returncode, 1, address)
            self.assertIn(f"lpdeform-server: The admin port cannot be opened. The server cannot listen on {address}", done.stderr)


if __name__ == "__main__":
    programs.main()
