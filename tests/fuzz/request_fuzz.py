"""Requests of strangers through the real Envoy, beside two callers with a token who must not notice.

    request_fuzz.py SERVER [--minutes M] [--cases N] [--seed S] [--only NUMBER ... | --unguarded]

SERVER: lpdeform-server. Cases are sent in batches, several at a time; after each batch the two callers are asked. A violation is
- a stream of theirs that ended, a call of theirs that failed, or frames that came much later than in quiet times between;
- a connection between Envoy and the server that the server ended while calls were on it, or a server that Envoy left out: what
  spares the two callers only because their connections are others;
- an end of the server or of Envoy.
The batch is then sent again one by one, the case that does it made as small as it stays one, and printed; the seed makes it again.
What happens once is not counted, because streams also end when the server gets no core for a second. A case counts if it does it
twice, a batch if it does it again, and late frames if a second round has them.
"""

from __future__ import annotations

import argparse
import base64
import concurrent.futures
import contextlib
import json
import os
import pathlib
import re
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/e2e"))

import programs
import request_cases
import request_http2 as http2
from envoy_test import Envoy
from request_victims import PATIENCE, Native, Page

BATCH, AT_ONCE = 100, 8
ANSWER_WITHIN = 0.5  # seconds that a case waits for an answer, which some never get
# A stream also ends if the server gets no core for a second. So a batch counts only if it breaks something again. This many batches
# that did it once count as a fault.
MOST_ONCE = 3
ENDED_BY_SERVER = "cluster.lpdeform.upstream_cx_destroy_remote_with_active_rq"
LEFT_OUT = "cluster.lpdeform.outlier_detection.ejections_enforced_total"


def send(port, token, case):
    """Sends it whole and reads until it is answered, refused or not answered in time. `token`: of those cases that have one."""
    way, _ = case
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
        connection.sendall(request_cases.bytes_of(case, token))
        connection.settimeout(ANSWER_WITHIN)
        end, seen = time.monotonic() + ANSWER_WITHIN, b""
        while time.monotonic() < end and (data := connection.recv(65536)):
            seen += data
            if way == "h1" and seen.startswith(b"HTTP/1.1") and (b"\r\n0\r\n" in seen or b"content-length: 0" in seen):
                return
            if way == "h2" and ends_within(seen):
                return


def ends_within(data):
    """Whether some stream ends in these frames, or the connection does."""
    while len(data) >= 9:
        size, kind, flags = int.from_bytes(data[:3], "big"), data[3], data[4]
        if kind in (http2.RST_STREAM, http2.GOAWAY) or (kind in (http2.DATA, http2.HEADERS) and flags & http2.END_STREAM):
            return True
        data = data[9 + size:]
    return False


def token_files(folder, *subjects):
    """A key pair; the public key's file and tokens of these callers."""
    def openssl(*arguments, **options):
        return subprocess.run(["openssl", *arguments], check=True, capture_output=True, **options).stdout

    def part(what):
        return base64.urlsafe_b64encode(what).rstrip(b"=")

    key, public = f"{folder}/key.pem", f"{folder}/public.pem"
    openssl("genrsa", "-out", key, "2048")
    openssl("rsa", "-in", key, "-pubout", "-out", public)
    tokens = []
    for subject in subjects:
        claims = {"sub": subject, "exp": 4102444800}
        signed = part(json.dumps({"alg": "RS256", "typ": "JWT"}).encode()) + b"." + part(json.dumps(claims).encode())
        tokens.append((signed + b"." + part(openssl("dgst", "-sha256", "-sign", key, input=signed))).decode())
    return public, tokens


def wait_until_reached(envoy):
    """Until Envoy has found its server well."""
    end = time.monotonic() + PATIENCE
    while not envoy.stats().get("cluster.lpdeform.membership_healthy"):
        assert time.monotonic() < end, "Envoy does not reach the server"
        time.sleep(0.02)


def without_guards(folder):
    """A root whose Envoy passes on what a server ends connections for."""
    shutil.copytree(ROOT / "deploy", f"{folder}/deploy")
    os.symlink(ROOT / "build", f"{folder}/build")
    template = pathlib.Path(folder, "deploy/envoy.yaml.in")
    lines = [line for line in template.read_text().splitlines() if "max_request_headers_kb" not in line]
    template.write_text("\n".join(line.replace('suffix: "-bin"', 'suffix: "-none"') for line in lines) + "\n")
    return folder


class World:
    """`are_guarded`: false for Envoy as it was, to see that this program finds what its configuration keeps out."""

    def __init__(self, server, are_guarded=True):
        self.folder = tempfile.TemporaryDirectory(prefix="lpdeform-requests-")
        public, (token, self.token) = token_files(self.folder.name, "victim", "somebody else")
        self.server = programs.RunningServer("--token-keys", public, "--log-level", "warning", "--heartbeat", "1", program=server)
        self.envoy = Envoy("--server", self.server.address, root=ROOT if are_guarded else without_guards(self.folder.name))
        wait_until_reached(self.envoy)
        self.native = Native(self.envoy.port, token)
        self.page = Page(self.envoy.port, token, self.native.session)
        self.seen = self.counts()
        for one in (self.native, self.page):
            assert one.has_frame.wait(PATIENCE), one.cuts
            one.taken()

    def send(self, case):
        send(self.envoy.port, self.token, case)

    def counts(self):
        stats = self.envoy.stats()
        return {name: stats.get(name, 0) for name in (ENDED_BY_SERVER, LEFT_OUT)}

    def look(self):
        """What went wrong since it was asked last, and the gaps between frames."""
        gaps, wrong = [], []
        for one in (self.native, self.page):
            its_gaps, cuts = one.taken()
            gaps += its_gaps
            wrong += cuts
        for name, process in (("the server", self.server.process), ("Envoy", self.envoy.process)):
            if process.poll() is not None:
                raise SystemExit(f"{name} has ended with status {process.poll()}; {wrong}")
        now = self.counts()
        wrong += [f"{name} +{now[name] - self.seen[name]}" for name in now if now[name] != self.seen[name]]
        self.seen = now
        return gaps, wrong

    def watch(self):
        """What went wrong since it was asked last, after a moment in which that can show."""
        for one in (self.native, self.page):
            one.has_frame.clear()
            one.has_frame.wait(2)
        return self.look()[1]

    def settle(self):
        """Waits until nothing goes wrong any more."""
        end = time.monotonic() + PATIENCE
        while wrong := self.watch():
            assert time.monotonic() < end, wrong

    def close(self):
        for one in (self.native, self.page):
            one.stop()
        self.envoy.stop()
        self.server.stop()
        self.folder.cleanup()


def breaks(world, case):
    """What this case alone does both times that it is sent."""
    world.send(case)
    if not world.watch():
        return []
    world.settle()
    world.send(case)
    return world.watch()


def smallest(world, case):
    """By leaving out what can be left out, as long as it stays one."""
    is_smaller = True
    while is_smaller:
        is_smaller = False
        for less in request_cases.smaller(case):
            if breaks(world, less):
                case, is_smaller = less, True
                break
    return case


def in_short(what):
    """Text for people: what comes many times in a row is counted."""
    return re.sub(r"(.)\1{15,}", lambda run: f"{run[1]}<{len(run[0])} times>", re.sub(r"\s+", " ", str(what)))


def is_found(world, pool, seed, numbers, wrong):
    """Whether these cases break something again; prints which of them it was, and the smallest that is left of it."""
    print(f"seed {seed}, cases {numbers[0]} to {numbers[-1]}: {len(wrong)} violations, {in_short(wrong[0])}", flush=True)
    world.settle()
    for number in numbers:
        case = request_cases.make(seed, number)
        if why := breaks(world, case):
            print(f"  case {number} alone: {in_short(why[0])}\n  again: tests/fuzz/requests --seed {seed} --only {number}\n  smallest: "
                  f"{in_short(smallest(world, case))}", flush=True)
            world.settle()
            return True
    list(pool.map(world.send, [request_cases.make(seed, number) for number in numbers]))
    again = world.watch()
    world.settle()
    print(f"  none of them does it alone, {'but all together again' if again else 'nor all together again'}", flush=True)
    return bool(again)


class Pace:
    """Gaps between frames in quiet times and beside cases, which take turns, so that both have the same machine."""

    def __init__(self):
        self.quiet, self.beside = [], []

    def judged(self):
        """What is wrong with them. Where a connection is cut, or a server left out, frames stop for half a second to three."""
        quiet, beside = (statistics.quantiles(gaps, n=100) for gaps in (self.quiet, self.beside))
        text = (f"seconds between frames, quiet: p50 {quiet[49]:.3f} p99 {quiet[98]:.3f} longest {max(self.quiet):.3f}; "
                f"beside cases: p50 {beside[49]:.3f} p99 {beside[98]:.3f} longest {max(self.beside):.3f}")
        print(text, flush=True)
        is_late = beside[98] > 3 * quiet[98] + 0.2 or max(self.beside) > 3 * max(self.quiet) + 1
        return ["frames came late"] if is_late else []


def find_one(world, options):
    end, number = time.monotonic() + 60 * options.minutes, 0
    while time.monotonic() < end:
        wrong = breaks(world, request_cases.make(options.seed, number))
        if wrong:
            print(f"case {number}: {in_short(wrong[0])}", flush=True)
            return 0
        number += 1
    print(f"{number} cases, and none was found", flush=True)
    return 1


def fuzz(world, options):
    found, late = fuzz_once(world, options)
    if late and not found:
        found, late = fuzz_once(world, options)
    return 1 if found or late else 0


def fuzz_once(world, options):
    """How many batches broke something, and whether frames came late."""
    begin, number, found, once, pace = time.monotonic(), 0, 0, 0, Pace()
    end = begin + 60 * options.minutes

    def judge(numbers, wrong):
        nonlocal end, found, once
        judging = time.monotonic()
        if is_found(world, pool, options.seed, numbers, wrong):
            found += 1
        else:
            once += 1
        end += time.monotonic() - judging

    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        while time.monotonic() < end and (not options.cases or number < options.cases) and found < options.most and once < MOST_ONCE:
            numbers = range(number, number + BATCH)
            cases = [request_cases.make(options.seed, one) for one in numbers]
            world.look()
            list(pool.map(world.send, cases))
            gaps, wrong = world.look()
            pace.beside += gaps
            number += BATCH
            if wrong:
                judge(numbers, wrong)
            if number % (50 * BATCH) == 0:
                print(f"{number} cases, {time.monotonic() - begin:.0f} s", flush=True)
            time.sleep(0.5)  # quiet, for comparison
            gaps, wrong = world.look()
            pace.quiet += gaps
            if wrong:
                judge(numbers, wrong)
    late = pace.judged()
    print(f"seed {options.seed}: {number} cases in {time.monotonic() - begin:.0f} s, {len(pace.beside) + len(pace.quiet)} frames, {found} batches broke "
          f"something again, {once} once{', ' + late[0] if late else ''}", flush=True)
    return found + (once >= MOST_ONCE), bool(late)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("server")
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--cases", type=int, default=0, help="ends after so many, too")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=5, help="ends after so many batches that broke something")
    parser.add_argument("--only", type=int, nargs="+", help="these cases of the seed alone, printed")
    parser.add_argument("--unguarded", action="store_true", help="by an Envoy that lets such requests through: status 0 once one is found")
    options = parser.parse_args()
    world = World(options.server, not options.unguarded)
    try:
        if options.unguarded:
            return find_one(world, options)
        if not options.only:
            return fuzz(world, options)
        status = 0
        for number in options.only:
            case = request_cases.make(options.seed, number)
            why = breaks(world, case)
            status |= bool(why)
            print(f"case {number}: {in_short(case)}\n  {in_short(why) if why else 'nobody noticed'}", flush=True)
        return status
    finally:
        world.close()


if __name__ == "__main__":
    sys.exit(main())
