"""The table of limits in server/flags.md agrees with the server's flags."""

import os
import re
import subprocess
import unittest
import urllib.request

import programs

ROOT = os.path.join(os.path.dirname(__file__), "..", "..")
FLAG = re.compile(r"^ +--([a-z-]+) \S.*?(?:=| \[)([^\s\]]+)\]? +\(Env:(\w+)\) *$", re.MULTILINE)  # =DEFAULT, from CLI11 2.4 on [DEFAULT]
ROW = re.compile(r"^\| `--([a-z-]+)` \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
UNITS = {"KiB": 2**10, "MiB": 2**20, "GiB": 2**30, "s": 1, "": 1, "%": 0.01}
NO_REASON = "-"
OTHER_LIMITS = {"connection-idle", "session-idle", "upload-idle", "heartbeat", "grace"}


def is_limit(flag):
    return flag.startswith("max-") or flag in OTHER_LIMITS


def value_of(text):
    number, unit = re.fullmatch(r"([\d,.]+) ?(\w*|%)", text).groups()
    return float(number.replace(",", "")) * UNITS[unit]


class Limits(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        said = subprocess.run([programs.server(), "--help"], capture_output=True, text=True, timeout=programs.PATIENCE).stdout
        cls.flags = {name: (default, variable) for name, default, variable in FLAG.findall(said) if is_limit(name)}
        cls.rows = {flag: (default, what, refusal) for flag, default, what, refusal in
                    ROW.findall(programs.read_text(os.path.join(ROOT, "server", "flags.md")))}

    def test_every_limit_is_a_flag_and_every_such_flag_is_in_the_table(self):
        self.assertGreater(len(self.flags), 15)
        self.assertEqual(set(self.rows), set(self.flags))

    def test_the_defaults_are_those_of_the_flags(self):
        for flag, (default, _, _) in self.rows.items():
            self.assertEqual(value_of(default), value_of(self.flags[flag][0]), flag)

    def test_every_flag_has_the_variable_of_its_name(self):
        for flag, (_, variable) in self.flags.items():
            self.assertEqual(variable, "LPDEFORM_" + flag.upper().replace("-", "_"))

    def test_every_refusal_is_one_of_the_contract(self):
        known = programs.read_text(os.path.join(ROOT, "proto", "errors.md"))
        refusals = [refusal for _, _, refusal in self.rows.values() if refusal != NO_REASON]
        self.assertGreater(len(refusals), 8)
        for refusal in refusals:
            reason, code = re.fullmatch(r"`([A-Z_]+)` ([A-Z_]+)", refusal).groups()
            self.assertIn(f"| `{reason}` | {code} |", known)

    def test_values_out_of_range_are_refused_by_name(self):
        for flag in ("max-sessions", "max-connections", "max-streams-per-session", "max-handles", "max-uploads",
                     "max-calls-waiting", "max-calls-per-connection", "max-vertices"):
            for value in ("0", "200000000"):
                done = subprocess.run([programs.server(), "--address", "127.0.0.1:0", f"--{flag}", value],
                                      capture_output=True, text=True, timeout=programs.PATIENCE)
                self.assertEqual(done.returncode, 1, flag)
                self.assertIn(f"lpdeform-server: --{flag} must be 1 to", done.stderr)

    def memory_limit(self, *arguments):
        server = programs.RunningServer("--admin-address", "127.0.0.1:0", *arguments)
        self.addCleanup(server.stop)
        with urllib.request.urlopen(server.admin + "/metrics", timeout=programs.PATIENCE) as answer:
            return float(re.search(r"^lpdeform_memory_limit_bytes (\S+)$", answer.read().decode(), re.MULTILINE).group(1))

    def test_memory_may_be_a_share_of_what_there_is(self):
        unsaid = self.memory_limit()
        self.assertAlmostEqual(self.memory_limit("--max-bytes", "25%") / unsaid, 1 / 3, places=6)
        self.assertAlmostEqual(self.memory_limit("--max-bytes", "75%") / unsaid, 1, places=6)

    def test_values_that_are_no_limits_are_refused_by_name(self):
        for flag, value, why in (("max-bytes", "-1", "must be a size below 16 EiB"), ("max-bytes", "0.5%", "must be 1% to 100%"),
                                 ("max-bytes", "101%", "must be 1% to 100%"), ("max-bytes", "x%", "must be 1% to 100%"),
                                 ("max-bytes-per-caller", "-1", "must be a size below 16 EiB"),
                                 ("max-bytes-per-caller", "0.5%", "must be 1% to 100%"),
                                 ("max-bytes", "99999999999999999999GiB", "must be a size below 16 EiB"),
                                 ("max-bytes-per-caller", "101%", "must be 1% to 100%"),
                                 ("max-bytes-per-caller", "%", "must be 1% to 100%"),
                                 ("max-uploads-per-caller", "-1", "lpdeform-server: --max-uploads-per-caller must be 0 to 10^6"),
                                 ("max-streams-per-caller", "-1", "lpdeform-server: --max-streams-per-caller must be 0 to 10^6"),
                                 ("max-sessions-per-caller", "-1", "lpdeform-server: --max-sessions-per-caller must be 0 to 10^6"),
                                 ("max-upload-bytes", "-4KiB", "must be a size below 16 EiB"),
                                 ("session-idle", "1e300", "must be 0.001 to 1e+09 seconds"),
                                 ("session-idle", "nan", "must be 0.001 to 1e+09 seconds"),
                                 ("heartbeat", "0", "must be 0.001 to 1e+09 seconds"),
                                 ("grace", "-1", "must be 0 to 1e+09 seconds"), ("connection-idle", "0.5", "1"),
                                 ("max-frame-rate", "-1", ""), ("max-upload-bytes", "0", "lpdeform-server: --max-upload-bytes must be more than 0"),
                                 ("token-issuer", "us", "lpdeform-server: --token-issuer must be given with --token-keys"),
                                 ("token-audience", "us", "lpdeform-server: --token-audience must be given with --token-keys"),
                                 ("max-store-bytes", "1GiB", "--max-store-bytes is for --store sqlite:DIR")):
            done = subprocess.run([programs.server(), "--address", "127.0.0.1:0", f"--{flag}={value}"],
                                  capture_output=True, text=True, timeout=programs.PATIENCE)
            self.assertEqual(done.returncode, 1, flag)
            self.assertTrue(done.stderr.startswith("lpdeform-server: "), done.stderr)
            not_taken = f"Could not convert: --{flag} = {value}"  # CLI11 2.4, of what is below 0 where that cannot be
            self.assertTrue(why in done.stderr or (value == "-1" and not_taken in done.stderr), done.stderr)
            self.assertIn(flag.split("-")[0], done.stderr)


if __name__ == "__main__":
    programs.main()
