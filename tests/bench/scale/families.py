"""Runs families_bench over four families of shapes; see families."""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess

FAMILIES = ("creature", "scan", "tree", "sheet")


def runs_of(program: str, family: str, options: argparse.Namespace) -> dict[tuple[float, int], dict]:
    command = [program, family, str(options.vertices), options.p, str(options.poses), str(options.threads),
               str(options.seconds)] + ([str(options.effort)] if options.effort is not None else [])
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return {(run["p"], run["pose"]): run for run in map(json.loads, lines)}


def lowest(run: dict) -> float:
    return min(energy for _, energy in run["trace"])


def seconds_to(run: dict, enough: float) -> float:
    return next((seconds for seconds, energy in run["trace"] if energy <= enough), math.inf)


def shown(seconds: float) -> str:
    return "-" if math.isinf(seconds) else f"{seconds:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", required=True)
    parser.add_argument("--vertices", type=int, default=100_000)
    parser.add_argument("--poses", type=int, default=10)
    parser.add_argument("--p", default="1,1.5,2,6")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--effort", type=int, help="SolveSettings::effort; the default one if not given")
    parser.add_argument("--beside")
    options = parser.parse_args()
    programs = {"this": options.program} | ({"beside": options.beside} if options.beside else {})
    print("| shape | p | build | to 5 %, median (worst) | to 1 % | energy above the lowest, median (worst) | set-up |\n|:--|--:|:--|--:|--:|--:|--:|")
    for family in FAMILIES:
        found = {name: runs_of(program, family, options) for name, program in programs.items()}
        for p in map(float, options.p.split(",")):
            poses = [pose for q, pose in found["this"] if q == p]
            best = {pose: min(lowest(runs[p, pose]) for runs in found.values()) for pose in poses}
            for name, runs in found.items():
                cells = [family, f"{p:g}", name]
                for share in (1.05, 1.01):
                    times = [seconds_to(runs[p, pose], share * best[pose]) for pose in poses]
                    cells.append(f"{shown(statistics.median(times))} ({shown(max(times))})")
                above = [100 * (lowest(runs[p, pose]) / best[pose] - 1) for pose in poses]
                cells.append(f"{statistics.median(above):.1f} % ({max(above):.1f} %)")
                cells.append(f"{statistics.median(runs[p, pose]['set_up'] for pose in poses):.2f}")
                print("| " + " | ".join(cells) + " |", flush=True)
    print(f"\nSeconds, {options.vertices:,} vertices, {options.threads} threads, {options.poses} poses, at most {options.seconds:g} s each. "
          "A dash: more than half of the poses (or the worst) did not get there, because they ended in another minimum or in time.")


if __name__ == "__main__":
    main()
