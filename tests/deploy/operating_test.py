"""The operator's pages, deploy/operating.md and those of deploy/operating/: every alert leads to a section of them, every section
says what to check in which order, and everything that they name exists in the server. `operating_test.py PROGRAM [TEST...]` with
lpdeform-server's path."""

import pathlib
import re
import subprocess
import sys
import unittest
import urllib.request

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["deploy/operating.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "deploy/operating").glob("*.md"))]
SERVER = sys.argv.pop(1)


def slug(heading):
    """As GitHub makes a link's target of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def sections(pages):
    """{page#target: what stands under that heading}, of {page: text}."""
    found = {}
    for page, text in pages.items():
        parts = re.split(r"(?m)^#+ (.+)$", text)
        found |= {f"{page}#{slug(heading)}": body for heading, body in zip(parts[1::2], parts[2::2])}
    return found


def alerts():
    groups = yaml.safe_load((ROOT / "deploy/monitoring/alerts.yaml").read_text())["groups"]
    return [rule for group in groups for rule in group["rules"]]


def misplaced(rules, pages):
    """Alerts that lead to no section, or to one that does not name them; names of alerts on the pages that are none."""
    found = sections(pages)
    wrong = [rule["alert"] for rule in rules if f"`{rule['alert']}`" not in found.get(rule["annotations"].get("runbook"), "")]
    named = set(re.findall(r"`(Lpdeform\w+)`", "\n".join(pages.values())))
    return wrong + sorted(named - {rule["alert"] for rule in rules})


def steps(body):
    """What a section says is to be looked at, in order: the items of its list, with the lines that go on."""
    return re.findall(r"(?m)^\d+\. ((?:.|\n(?= ))+)", body)


def is_place_to_look(step):
    """A line of the log, a metric, a command, or a section that says more."""
    return re.search(r"[Ll]og `\w+`|`[a-z]+ ?[^`]*`|\]\([\w.]*#|it says", step) is not None


SOURCES = "\n".join(path.read_text() for path in sorted((ROOT / "server").rglob("*.cc")))
# Of file_watch.cc, by the name of what is watched.
WATCHED = {f"{name}_{end}" for name in re.findall(r'files_of\("(\w+)"', SOURCES) for end in ("not_read", "read_again")}


def events(*levels):
    """Of the log's lines, as the sources have them."""
    return set(re.findall(rf'(?:\.|->|&Log::)(?:{"|".join(levels)})\)?\(\s*"(\w+)"', SOURCES))


class Pages(unittest.TestCase):
    pages = {page: (ROOT / page).read_text() for page in PAGES}
    text = "\n".join(pages.values())
    found = sections(pages)

    def test_every_alert_leads_to_a_section_that_names_it(self):
        self.assertGreater(len(alerts()), 30)
        self.assertEqual(misplaced(alerts(), self.pages), [])

    def test_the_check_above_finds_alerts_and_sections_that_are_not_there(self):
        rule = {"alert": "LpdeformDown", "annotations": {"runbook": "server.md#a-server-is-gone"}}
        text = "## A server is gone\n\nAlert `LpdeformDown`.\n"
        self.assertEqual(misplaced([rule], {"server.md": text}), [])
        self.assertEqual(misplaced([rule], {"envoy.md": text}), ["LpdeformDown"])
        self.assertEqual(misplaced([rule], {"server.md": text.replace("gone", "lost")}), ["LpdeformDown"])
        self.assertEqual(misplaced([rule], {"server.md": text, "envoy.md": "`LpdeformUp`"}), ["LpdeformUp"])
        rule = {"alert": "LpdeformUp", "annotations": {}}
        self.assertEqual(misplaced([rule], {"server.md": text}), ["LpdeformUp", "LpdeformDown"])

    def test_every_section_of_an_alert_says_what_to_look_at_in_which_order(self):
        for target in {rule["annotations"]["runbook"] for rule in alerts()}:
            with self.subTest(section=target):
                self.assertGreaterEqual(len(steps(self.found[target])), 2)
                for step in steps(self.found[target])[:2]:
                    self.assertTrue(is_place_to_look(step), step)

    def test_links_lead_to_sections(self):
        for page, text in self.pages.items():
            for path, target in re.findall(r"\]\(([^)#]*)#([^)]*)\)", text):
                other = str((ROOT / page).parent.joinpath(path).resolve().relative_to(ROOT)) if path else page
                self.assertIn(f"{other}#{target}", self.found | sections({other: (ROOT / other).read_text()}))

    def test_events_of_the_log_that_it_names_are_written_by_the_server(self):
        written = set(re.findall(r'"(\w+)"', SOURCES)) | WATCHED
        named = set(re.findall(r"[Ll]og\s+`(\w+)`", self.text))
        self.assertGreater(len(named), 20)
        self.assertEqual(named - written, set())

    def test_whatever_the_server_warns_of_is_on_it(self):
        warned = events("warning", "error") | {name for name in WATCHED if name.endswith("not_read")}
        self.assertIn("store_failing", warned)
        self.assertEqual({event for event in warned if not re.search(rf"[Ll]og\s+`{event}`", self.text)}, set())

    def test_its_table_of_how_streams_end_is_the_servers(self):
        names = re.findall(r'return "(\w+)";', (ROOT / "server/runtime/stream_ends.cc").read_text())
        table = re.findall(r"(?m)^\| `(\w+)` \|", self.found["deploy/operating/streams.md#frames-stop"])
        self.assertGreater(len(names), 8)
        self.assertEqual(sorted(table), sorted(names))

    def test_reasons_of_refusals_that_it_names_exist(self):
        known = (ROOT / "proto/errors.md").read_text()
        for reason in re.findall(r"`([A-Z]+_[A-Z_]+)`", self.text):
            self.assertIn(f"`{reason}`", known)


class Metrics(unittest.TestCase):
    def test_metrics_that_it_names_are_shown_by_a_server(self):
        with subprocess.Popen([SERVER, "--address", "127.0.0.1:0", "--admin-address", "127.0.0.1:0", "--log-level", "off"],
                              stdout=subprocess.PIPE, text=True) as server:
            server.stdout.readline()
            admin = re.search(r"http://\S+", server.stdout.readline()).group(0)
            with urllib.request.urlopen(f"{admin}/metrics", timeout=60) as answer:
                shown = set(re.findall(r"(?m)^# TYPE (\w+)", answer.read().decode()))
            server.terminate()
        # What was never counted is not shown yet: calls and refusals.
        shown |= set(re.findall(r'"((?:lpdeform|grpc_server)_\w+)"', (ROOT / "server/runtime/metrics.cc").read_text()))
        named = set(re.findall(r"`((?:lpdeform|process|grpc_server)_[a-z_]+)`", Pages.text))
        self.assertGreater(len(named), 25)
        self.assertEqual(named - shown, set())


if __name__ == "__main__":
    unittest.main(verbosity=2)
