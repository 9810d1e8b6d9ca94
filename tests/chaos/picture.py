"""Columns of samples as curves, one above the other, in an SVG file."""

from __future__ import annotations

WIDTH, HEIGHT, LEFT, TOP = 720, 110, 90, 28
COLOURS = ("#1f6fb4", "#d1651b", "#2e8b57", "#7a4fa3")


def curve(samples, along: str, column: str, row: int) -> str:
    xs, ys = [one[along] for one in samples], [one[column] for one in samples]
    most = max(max(ys), 1) * 1.15
    base = TOP + (row + 1) * HEIGHT - 20
    span = max(xs[-1], 1e-9)
    points = " ".join(f"{LEFT + x / span * (WIDTH - LEFT - 20):.1f},{base - y / most * (HEIGHT - 40):.1f}" for x, y in zip(xs, ys))
    return (f'<line x1="{LEFT}" y1="{base}" x2="{WIDTH - 20}" y2="{base}" stroke="#888"/>'
            f'<polyline points="{points}" fill="none" stroke="{COLOURS[row % len(COLOURS)]}" stroke-width="1.5"/>'
            f'<text x="{LEFT - 8}" y="{base - HEIGHT + 52}" text-anchor="end">{max(ys):.0f}</text>'
            f'<text x="{LEFT - 8}" y="{base}" text-anchor="end">0</text>'
            f'<text x="{LEFT}" y="{base - HEIGHT + 36}">{column}</text>')


def draw(path: str, along: str, samples, columns) -> None:
    """Each column from 0, against the column `along`."""
    height = TOP + len(columns) * HEIGHT + 24
    curves = "".join(curve(samples, along, column, row) for row, column in enumerate(columns))
    last = samples[-1][along]
    with open(path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
                   f'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>{curves}'
                   f'<text x="{WIDTH - 20}" y="{height - 14}" text-anchor="end">{last:.0f} {along}</text></svg>\n')
