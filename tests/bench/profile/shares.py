"""Samples scale_bench with perf and adds up what belongs together; see run."""

import argparse
import pathlib
import re
import subprocess

# The first that matches a function's name counts.
PARTS = (
    ("reading the mesh", r"(^|::)read_|parse|strto|from_chars|MeshReport|weld"),
    ("rest shape, weights", r"RestShape|cotangent|weights_of|CellBlocks"),
    ("coarse level", r"CoarseLevel|coarsen|CornerTable|Multiresolution"),
    ("ordering, analysis", r"^amd_|_amd|cholmod_(l_)?(analy|super_symbolic|etree|post|rowcol|transpose|ptranspose|aat)|"
                           r"find_updates|find_entries|cut_branches|analyse_supernodes"),
    ("factorisation", r"SubtractUpdate|Substitute|SingleCholesky|SolvingTriangle|Metric::f|cholmod_|dgemm|dsyrk|dtrsm|dpotr|"
                      r"_kernel_|copy_super|copy_simpl|add_supernode|d(sy|ge|tr|po)[a-z]*_"),
    ("back-substitution", r"SingleFactor|Metric|solve_triangle|add_below|add_from_below"),
    ("rotation fit, energy", r"EvaluateBlocks|evaluate_blocks|fit_rotation|CellPass::(evaluate|sum)|RotationFit|Objective"),
    ("gradient, weights c", r"GradientOfBlocks|gradient|CellPass|LpNorm|__ieee754_(pow|exp|log)|pow@|exp@|log@|restrict_to_free"),
    ("L-BFGS, search", r"Sweep|LbfgsMemory|QuasiNewton|go_along|pair_"),
    ("thread pool", r"tbb|Workers"),
    ("memory", r"mem(set|cpy|move)|malloc|free|clear_page|page_fault|asm_exc"),
)


def part_of(symbol):
    return next((name for name, pattern in PARTS if re.search(pattern, symbol)), "other")


def shares(command, data):
    subprocess.run(["perf", "record", "-q", "-o", str(data), "--", *map(str, command)], check=True,
                   stdout=subprocess.DEVNULL)
    report = subprocess.run(
        ["perf", "report", "-i", str(data), "--stdio", "--no-children", "-F", "overhead,symbol", "--percent-limit", "0"],
        check=True, capture_output=True, text=True).stdout
    result, others = {}, []
    for line in report.splitlines():
        found = re.match(r"\s*([\d.]+)%\s+\[.\]\s+(.*)", line)
        if not found:
            continue
        share, symbol = float(found[1]), found[2]
        part = part_of(symbol)
        result[part] = result.get(part, 0) + share
        if part == "other" and share > 0.5:
            others.append(f"{share:.1f} % {symbol.strip()[:70]}")
    return result, others


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maker", type=pathlib.Path, required=True)
    parser.add_argument("--program", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--vertices", type=int, default=40000)
    parser.add_argument("--p", default="1,2,6")
    parser.add_argument("--seconds", type=float, default=20)
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    mesh = options.work / f"creature_{options.vertices}.ply"
    if not mesh.exists():
        subprocess.run([options.maker, "make", mesh, str(options.vertices)], check=True)
    columns = {}
    for p in options.p.split(","):
        columns[p], others = shares([options.program or options.maker, "solve", mesh, p, 1, options.seconds],
                                    options.work / "perf.data")
        for other in others:
            print(f"not counted, p = {p}: {other}")
    print("| part | " + " | ".join(f"p = {p}" for p in columns) + " |")
    print("|:--|" + "--:|" * len(columns))
    for part in [name for name, _ in PARTS] + ["other"]:
        print(f"| {part} | " + " | ".join(f"{column.get(part, 0):.0f} %" for column in columns.values()) + " |")


if __name__ == "__main__":
    main()
