"""Runs `lpdeform deform --certify` on tasks with known energies; see run."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

MOST = 1.005  # of the known E^(1/p)
LARGEST_GAP = 1e-4


def report_of(program, mesh, handles, p, seconds):
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        subprocess.run([program, "deform", mesh, "--handles", handles, "--p", p, "--time-limit", str(seconds),
                        "--certify", "--report", report], check=True, stdout=subprocess.DEVNULL)
        return json.loads(report.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--p", default="1,1.5,2,6")
    parser.add_argument("--seconds", type=float, default=120, help="of a solve, at most")
    parser.add_argument("--tasks", help="names; all that references.json has")
    options = parser.parse_args()
    known = json.loads((options.folder / "references.json").read_text())["energy"]
    good = True
    print(f"{'task':<22}{'p':>5}{'E^(1/p) / known':>17}{'gap':>10}{'iterations':>12}{'seconds':>9}  ended")
    for name in options.tasks.split(",") if options.tasks else known:
        handles = options.folder / f"{name}.json"
        mesh = options.folder.parent.parent / json.loads(handles.read_text())["mesh"]
        for p in options.p.split(","):
            if p not in known[name]:
                continue
            report = report_of(options.program, mesh, handles, p, options.seconds)
            ratio = (report["energy"] / known[name][p]) ** (1 / float(p))
            gap = report["optimality_gap"]
            is_good = ratio <= MOST and gap is not None and gap <= LARGEST_GAP
            good &= is_good
            print(f"{name:<22}{p:>5}{ratio:>17.6f}{gap:>10.1e}{report['iterations']:>12}{report['solve_seconds']:>9.2f}"
                  f"  {report['stop_reason']}{'' if is_good else '  <- over the limit'}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
