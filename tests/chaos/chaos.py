"""Drives the real server through faults on a schedule that a seed determines, records what happens, and judges it.

    python chaos.py [--runs N] [--seed S] [--seconds T] [--keep FOLDER] [--mode sqlite|redis]

Runs seeds S, S+1, ...; each run has its own server (or two behind Envoy with a store in Redis), sessions, writers, a slow reader,
and a reader of the client library. A run that fails leaves its history in FOLDER and says how to repeat it. To judge a history only:

    python chaos.py --check HISTORY.jsonl
"""

from __future__ import annotations

import argparse
import pathlib
import random
import shutil
import sys
import tempfile
import time
import traceback

import grpc
import numpy as np

import lpdeform
from lpdeform.v1 import service_pb2

from clients import Onlooker, SlowReader, Writer
from history import History, check
from machines import PATIENCE, World
from wire import ENDS, FACES, PLACES, PROBES, Book, Wire


def wait_until_empty(world: World) -> dict[str, float]:
    end = time.monotonic() + PATIENCE
    while True:
        level = world.level()
        if not (level["sessions"] or level["streams"] or level["counted"]) or time.monotonic() > end:
            return level
        time.sleep(0.05)


def open_patiently(port: int) -> lpdeform.Session:
    """A server refuses new sessions until its store has taken something again: up to 2 s after the store is back."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return lpdeform.open(PLACES, FACES, address=f"127.0.0.1:{port}")
        except lpdeform.errors.Unavailable:
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


def reference(book: Book, port: int, xs: set[float]) -> None:
    """The results for these handles in a session that no fault befell."""
    with open_patiently(port) as session:
        session.set_handle("base", ENDS["base"])
        session.set_handle("tip", ENDS["tip"])
        for x in sorted(xs):
            frame = session.move("tip", translation=[0, 0, x])
            book.note("reference", x=x, probe=np.asarray(frame.positions)[PROBES].astype(float).tolist())


def results_to_check(history: History, writers: list[Writer]) -> set[float]:
    """Of the first final frame of each epoch of a session, and of its last one: where they should have the tip."""
    xs, seen = set(), set()
    of = {writer.name: writer.xs for writer in writers}
    frames = [frame for frame in history.of("frame") if frame["is_final"] and frame["input_seq"] in of[frame["session"]]]
    for frame in frames:
        if (frame["session"], frame["epoch"]) not in seen:
            seen.add((frame["session"], frame["epoch"]))
            xs.add(of[frame["session"]][frame["input_seq"]])
    return xs | {of[frame["session"]][frame["input_seq"]] for frame in frames[-1:]}


def run(book: Book, seed: int, seconds: float, mode: str | None) -> None:
    chance = random.Random(seed)
    mode = mode or chance.choice(("sqlite", "redis"))
    book.note("run", seed=seed, mode=mode, seconds=seconds)
    book.note("diagonal", length=float(np.linalg.norm(PLACES.max(0) - PLACES.min(0))))
    folder = tempfile.mkdtemp(prefix="lpdeform-chaos-")
    world = None
    try:
        world = World(mode, folder)
        port = world.proxy.port
        reference(book, port, {0.0})  # so that the first use is over before memory is measured
        book.note("memory", when="before", **wait_until_empty(world))
        writers = [Writer(book, port, f"{seed}.{k}") for k in range(chance.randint(1, 3))]
        for writer in writers:
            writer.make()
        onlookers = [SlowReader(book, port, writers[0], f"{seed}.slow"), Onlooker(book, port, writers[0].name, writers[0].seed)]
        for one in (*writers, *onlookers):
            one.thread.start()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(chance.uniform(0.1, 0.7))
            what = chance.choice(world.faults())
            book.note("fault", what=what)
            world.strike(what, chance)
        # Readers first: a session stays with the server where it is used, and after a fault its users may be at two.
        for one in (*onlookers, *writers):
            one.finish()
        reference(book, port, results_to_check(book.history, writers))
        for writer in writers:
            with Wire(port, writer.seed) as wire:
                wire.patiently("DeleteSession", service_pb2.DeleteSessionRequest(session=writer.name))
        book.note("memory", when="after", **wait_until_empty(world))
    finally:
        if world:
            world.close()
        shutil.rmtree(folder, ignore_errors=True)


def report(seed: int, history: History, took: float) -> bool:
    violations = check(history)
    kept = sum(event["kept"] for event in history.of("answered"))
    faults = [event["what"] for event in history.of("fault")]
    print(f"seed {seed} ({history.of('run')[0]['mode']}): {len(history.of('sent'))} updates sent, {kept} kept, "
          f"{len(history.of('frame'))} frames on {len(history.of('opened'))} streams, faults: {' '.join(faults)}; "
          f"{len(violations)} violations, {took:.1f} s", flush=True)
    for violation in violations[:10]:
        print(f"  {violation}", flush=True)
    return not violations


def attempt(options, seed: int) -> History:
    """The run's history. Where a call failed that must not, once the faults are over, the history ends there."""
    book = Book()
    try:
        run(book, seed, options.seconds, options.mode)
    except (grpc.RpcError, lpdeform.LpdeformError, OSError):
        book.note("broken", text=traceback.format_exc())
    return book.history


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=2.0, help="of faults in each run")
    parser.add_argument("--mode", choices=("sqlite", "redis"), help="the store; the seed decides where it is left out")
    parser.add_argument("--keep", help="where histories of failed runs go (default: build/chaos)")
    parser.add_argument("--check", help="judges this history and runs nothing")
    options = parser.parse_args()
    if options.check:
        return 0 if report(0, History.load(options.check), 0) else 1
    failed, totals = [], {"fault": 0, "sent": 0, "kept": 0}
    for seed in range(options.seed, options.seed + options.runs):
        begin = time.monotonic()
        history = attempt(options, seed)
        totals["fault"] += len(history.of("fault"))
        totals["sent"] += len(history.of("sent"))
        totals["kept"] += sum(event["kept"] for event in history.of("answered"))
        if report(seed, history, time.monotonic() - begin):
            continue
        failed.append(seed)
        folder = pathlib.Path(options.keep or pathlib.Path(__file__).resolve().parents[2] / "build/chaos")
        folder.mkdir(parents=True, exist_ok=True)
        history.save(str(folder / f"seed-{seed}.jsonl"))
        print(f"  again: tests/chaos/run --seed {seed}; its history: {folder}/seed-{seed}.jsonl", flush=True)
    print(f"{options.runs} runs, {totals['fault']} faults, {totals['sent']} updates sent, {totals['kept']} acknowledged as kept, "
          f"{len(failed)} runs broke an invariant{': ' + ' '.join(map(str, failed)) if failed else ''}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
