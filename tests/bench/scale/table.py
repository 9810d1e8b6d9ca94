"""Runs scale_bench over sizes, p and threads; see run."""

import argparse
import json
import math
import pathlib
import subprocess

P = (1, 1.5, 2, 6)
THREADS = (1, 2)
LARGE = 500_000  # vertices, from which on two threads alone are measured
COLUMNS = (("set-up", "setup"), ("iteration", "iteration"), ("to 5 %", "to_5_percent"), ("to 1 %", "to_1_percent"),
           ("to 0.1 %", "to_01_percent"), ("handle change", "handle_change"))
COLOURS = {1: "#c0392b", 1.5: "#d68910", 2: "#2471a3", 6: "#1e8449"}


def measure(program, mesh, threads, seconds, known=()):
    """`known` are runs of the same solves, to the last bit, by other threads or for longer: what they found where they ended."""
    ended = {row["p"]: row["energy"] for row in known if row["stop"] != "time_limit"}
    energies = [ended.get(p, 0) for p in P]
    command = [program, "solve", mesh, ",".join(map(str, P)), threads, seconds] + (
        [",".join(f"{energy:.17g}" for energy in energies)] if known else [])
    lines = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout
    return [json.loads(line) for line in lines.splitlines()]


def shown(seconds):
    """Three digits, in the unit that suits."""
    if seconds is None:
        return "-"
    value, unit = (seconds, "s") if seconds >= 1 else (1e3 * seconds, "ms")
    return f"{value:.3g} {unit}" if value < 1000 else f"{value:.0f} {unit}"


def about(vertices, size):
    return 0.8 < vertices / size < 1.25


def growth(rows, key):
    """The exponent a of time ~ vertices^a by least squares over the sizes from 10,000 on; None with less than two."""
    points = [(math.log(row["vertices"]), math.log(row[key])) for row in rows if row[key] and row["vertices"] > 5000]
    if len(points) < 2:
        return None
    mean_x, mean_y = (sum(column) / len(points) for column in zip(*points))
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / sum((x - mean_x) ** 2 for x, _ in points)


def table(rows, limit, large_limit):
    lines = ["| vertices | p | threads | " + " | ".join(name for name, _ in COLUMNS) + " | bytes a vertex |",
             "|--:|--:|--:|" + "--:|" * (len(COLUMNS) + 1)]
    for row in rows:
        cells = [f"{row['vertices']:,}", f"{row['p']:g}", str(row["threads"])]
        cells += [shown(row[key]) for _, key in COLUMNS] + [f"{row['bytes_per_vertex']:.0f}"]
        lines.append("| " + " | ".join(cells) + " |")
    for threads in THREADS:
        for p in P:
            some = [row for row in rows if row["p"] == p and row["threads"] == threads]
            cells = ["growth", f"{p:g}", str(threads)]
            exponents = [growth(some, key) for _, key in COLUMNS]
            cells += ["-" if exponent is None else f"n^{exponent:.2f}" for exponent in exponents] + [""]
            lines.append("| " + " | ".join(cells) + " |")
    lines.append("")
    lines.append(f"A dash: the target was not reached within {limit:g} s ({large_limit:g} s from 500,000 vertices on), or no "
                 "solve ended, so the final value is unknown. Growth: fitted from 10,000 vertices on.")
    return "\n".join(lines)


def picture(rows, path):
    """Seconds to 1 % against vertices, two threads, both axes logarithmic."""
    width, height, left, bottom = 640, 400, 70, 50
    some = [row for row in rows if row["threads"] == max(THREADS)]
    sizes = [row["vertices"] for row in some]
    values = [row[key] for row in some for key in ("to_1_percent", "setup") if row[key]]
    low_x, high_x = math.floor(math.log10(min(sizes))), math.ceil(math.log10(max(sizes)))
    low_y, high_y = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))

    def at(vertices, seconds):
        x = left + (math.log10(vertices) - low_x) / (high_x - low_x) * (width - left - 110)
        y = height - bottom - (math.log10(seconds) - low_y) / (high_y - low_y) * (height - bottom - 20)
        return x, y

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
             f'font-size="13"><rect width="{width}" height="{height}" fill="white"/>']
    for k in range(low_x, high_x + 1):
        x, y = at(10 ** k, 10 ** low_y)
        parts.append(f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x:.1f}" y2="20" stroke="#ddd"/>'
                     f'<text x="{x:.1f}" y="{y + 18:.1f}" text-anchor="middle">{10 ** k:,}</text>')
    for k in range(low_y, high_y + 1):
        x, y = at(10 ** low_x, 10 ** k)
        parts.append(f'<line x1="{left}" y1="{y:.1f}" x2="{width - 110}" y2="{y:.1f}" stroke="#ddd"/>'
                     f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end">{10.0 ** k:g} s</text>')
    lines = [(f"p = {p:g}", COLOURS[p], "none", [(row["vertices"], row["to_1_percent"]) for row in some if row["p"] == p])
             for p in P]
    lines.append(("set-up", "#555", "5 4", [(row["vertices"], row["setup"]) for row in some if row["p"] == 2]))
    for k, (name, colour, dashes, points) in enumerate(lines):
        places = [at(*point) for point in points if point[1]]
        path_text = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{path_text}" fill="none" stroke="{colour}" stroke-width="2" '
                     f'stroke-dasharray="{dashes}"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in places]
        parts.append(f'<text x="{width - 100}" y="{40 + 20 * k}" fill="{colour}">{name}</text>')
    parts.append(f'<text x="{(width - 110 + left) / 2}" y="{height - 8}" text-anchor="middle">vertices</text>')
    parts.append("</svg>")
    path.write_text("\n".join(parts) + "\n")


def of_two_threads(rows):
    """How many times as long an iteration of one thread takes as one of two, where both were measured."""
    lines = ["| vertices | " + " | ".join(f"p = {p:g}" for p in P) + " |", "|--:|" + "--:|" * len(P)]
    by_size = {}
    for row in rows:
        by_size.setdefault(row["vertices"], {})[row["p"], row["threads"]] = row["iteration"]
    for vertices, seconds in by_size.items():
        ratios = [seconds[p, 1] / seconds[p, 2] if (p, 1) in seconds and (p, 2) in seconds else None for p in P]
        if any(ratios):
            lines.append(f"| {vertices:,} | " + " | ".join(f"{ratio:.2f}" if ratio else "" for ratio in ratios) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--sizes", default="1000,10000,40000,100000,1000000", help="vertices, about")
    parser.add_argument("--seconds", type=float, default=60, help="of a solve, at most")
    parser.add_argument("--large-seconds", type=float, default=120, help="the same from 500,000 vertices on")
    parser.add_argument("--longer", type=pathlib.Path, help="lines of JSON that scale_bench wrote of longer solves of these meshes")
    parser.add_argument("--picture", type=pathlib.Path, help="where to draw the times to 1 %% and of set-up, as .svg")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    longer = [json.loads(line) for line in options.longer.read_text().splitlines()] if options.longer else []
    rows = []
    for size in map(int, options.sizes.split(",")):
        mesh = options.work / f"creature_{size}.ply"
        if not mesh.exists():
            subprocess.run([str(options.program), "make", str(mesh), str(size)], check=True)
        large = size >= LARGE
        several = measure(options.program, mesh, max(THREADS), options.large_seconds if large else options.seconds,
                          [row for row in longer if about(row["vertices"], size)])
        rows += ([] if large else measure(options.program, mesh, 1, options.seconds, several)) + several
        (options.work / "results.json").write_text(json.dumps(rows, indent=1))
    text = table(rows, options.seconds, options.large_seconds)
    print(text)
    print(f"\nIterations: one thread's time over two threads'\n\n{of_two_threads(rows)}")
    if options.picture:
        picture(rows, options.picture)


if __name__ == "__main__":
    main()
