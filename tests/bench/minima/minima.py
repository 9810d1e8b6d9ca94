"""Runs minima_bench over sixty problems and compares with the lowest energies known; see run."""

from __future__ import annotations

import argparse
import json
import pathlib
import statistics
import subprocess
import sys

LOWEST = pathlib.Path(__file__).with_name("lowest.json")
NEAR, FAR = 1.01, 1.05  # of the lowest energy known
LEAST_NEAR, MOST_FAR = 57, 0  # of the sixty, with auto and the default effort
WAYS = (("auto", "default"), ("auto", "0"), ("auto", "4"), ("quasi_newton", "0"), ("multiresolution", "0"))


def runs_of(program: str, method: str, effort: str, seconds: float) -> dict[str, dict]:
    lines = subprocess.run([program, method, effort, str(seconds)], check=True, capture_output=True, text=True).stdout
    return {run["problem"]: run for run in map(json.loads, lines.splitlines())}


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", required=True)
    parser.add_argument("--seconds", type=float, default=60, help="of a solve, at most")
    parser.add_argument("--ways", help="METHOD:EFFORT,...")
    parser.add_argument("--keep", action="store_true", help="lower the energies in lowest.json")
    parser.add_argument("--all", action="store_true", help="a line for each problem")
    options = parser.parse_args()
    ways = [tuple(way.split(":")) for way in options.ways.split(",")] if options.ways else WAYS
    found = {way: runs_of(options.program, *way, options.seconds) for way in ways}
    known = json.loads(LOWEST.read_text()) if LOWEST.exists() else {}
    lowest = dict(known)
    for runs in found.values():
        for name, run in runs.items():
            lowest[name] = min([lowest.get(name, run["energy"]), run["energy"], *run["minima"]])
    print("| method | effort | within 1 % of the lowest | over 5 % | worst | processor time |\n|:--|--:|--:|--:|--:|--:|")
    is_good = True
    base = found.get(("auto", "0"), next(iter(found.values())))
    for (method, effort), runs in found.items():
        above = {name: run["energy"] / lowest[name] for name, run in runs.items()}
        near = sum(ratio <= NEAR for ratio in above.values())
        far = sum(ratio > FAR for ratio in above.values())
        if not above:
            print(f"| {method} | {effort} | takes none | | | |")
            continue
        worst = max(above, key=above.__getitem__)
        took = sum(run["seconds"] for run in runs.values()) / sum(base[name]["seconds"] for name in runs)
        print(f"| {method} | {effort} | {near} of {len(runs)} | {far} | {100 * (above[worst] - 1):.1f} % ({worst}) | {took:.1f} |")
        if (method, effort) == ("auto", "default"):
            is_good = near >= LEAST_NEAR and far <= MOST_FAR
    if options.all:
        print("\n| problem | vertices | lowest energy | " + " | ".join(f"{m} {e}" for m, e in found) + " |\n|:--|--:|--:|"
              + "--:|" * len(found))
        for name, energy in lowest.items():
            shares = [f"{100 * (runs[name]['energy'] / energy - 1):.2f} %" if name in runs else "" for runs in found.values()]
            print(f"| {name} | {next(iter(found.values()))[name]['vertices']} | {energy:.6g} | " + " | ".join(shares) + " |")
    median = statistics.median(len(run["minima"]) for run in found[ways[0]].values())
    print(f"\n{ways[0][0]}, effort {ways[0][1]}: {median:g} minima seen in the median. Processor time: relative to auto 0.")
    if options.keep:
        LOWEST.write_text(json.dumps({name: float(f"{energy:.10g}") for name, energy in lowest.items()}, indent=1) + "\n")
    lowered = [name for name in lowest if name in known and lowest[name] < known[name] * (1 - 1e-6)]
    if lowered:
        print("Lower than in lowest.json: " + ", ".join(lowered) + ("." if options.keep else "; --keep writes them down."))
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
