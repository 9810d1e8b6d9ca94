"""A result as a table for notebooks, and as a picture."""

from __future__ import annotations

import html
import importlib
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lpdeform.errors import Code, make

Copied = npt.NDArray[Any]


class Solved(Protocol):
    """What a picture needs of a SolveResult."""

    @property
    def positions(self) -> Copied: ...
    @property
    def distortion(self) -> Copied: ...
    @property
    def p(self) -> float | Copied | None: ...
    @property
    def energy(self) -> float: ...
    @property
    def stop_reason(self) -> str: ...
    @property
    def iterations(self) -> int: ...
    @property
    def method(self) -> str: ...
    @property
    def optimality_gap(self) -> float | None: ...
    @property
    def setup_seconds(self) -> float: ...
    @property
    def solve_seconds(self) -> float: ...
    @property
    def searched(self) -> str: ...


def table_of(result: Solved) -> str:
    """HTML."""
    gap = "not asked for" if result.optimality_gap is None else f"{result.optimality_gap:.2g} for its rotations"
    p = "computed from the shape by the server" if result.p is None else _range_of(np.atleast_1d(np.asarray(result.p, float)))
    rows = {
        "vertices": str(len(result.positions)),
        "p": p,
        "energy": f"{result.energy:.6g}",
        "stopped": f"{result.stop_reason}, after {result.iterations} iterations of {result.method}",
        "gap": gap,
        "distortion": _range_of(result.distortion),
        "time": f"{result.solve_seconds:.3g} s, with {result.setup_seconds:.3g} s of set-up",
        "searched": result.searched,
    }
    cells = "".join(f"<tr><th>{name}</th><td>{html.escape(text)}</td></tr>" for name, text in rows.items())
    return f"<table>{cells}</table>"


def _range_of(values: Any) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def plot(result: Solved, faces: Copied | None, backend: str | None, show: bool) -> Any:
    if faces is None:
        raise make(Code.INVALID_ARGUMENT, "The result does not know its faces: give them.", "ARGUMENT_MISSING", "faces")
    if backend is not None and backend not in _plots:
        text = f"There is no backend {backend!r}: there are {', '.join(_plots)}."
        raise make(Code.INVALID_ARGUMENT, text, "NAME_UNKNOWN", "backend", ", ".join(_plots))
    for name in _plots if backend is None else (backend,):
        if find_spec(name) is not None:
            return _plots[name](result, np.asarray(faces), show)
    text = "A picture needs PyVista or Matplotlib: pip install pyvista, or pip install matplotlib"
    raise make(Code.UNIMPLEMENTED, text, "NO_PLOTTER", "plot", "pyvista or matplotlib")


def _highest(result: Solved) -> float:
    """The 95th percentile, as the project's other pictures have it."""
    return max(float(np.percentile(result.distortion, 95)), 1e-12)


def _by_pyvista(result: Solved, faces: Copied, show: bool) -> Any:
    pyvista: Any = importlib.import_module("pyvista")
    counted = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    plotter = pyvista.Plotter(off_screen=not show)
    plotter.add_mesh(
        pyvista.PolyData(np.asarray(result.positions), counted),
        scalars=np.asarray(result.distortion),
        cmap="turbo",
        clim=(0, _highest(result)),
        smooth_shading=True,
        scalar_bar_args={"title": "distortion"},
    )
    if show:
        plotter.show()
    return plotter


def _by_matplotlib(result: Solved, faces: Copied, show: bool) -> Any:
    pyplot: Any = importlib.import_module("matplotlib.pyplot")
    figure = pyplot.figure()
    axes = figure.add_subplot(projection="3d")
    x, y, z = np.asarray(result.positions).T
    surface = axes.plot_trisurf(x, y, z, triangles=faces, cmap="turbo", linewidth=0)
    surface.set_array(np.asarray(result.distortion)[faces].mean(axis=1))
    surface.set_clim(0, _highest(result))
    axes.set_aspect("equal")
    figure.colorbar(surface, ax=axes, label="distortion")
    if show:
        pyplot.show()
    return figure


_plots = {"pyvista": _by_pyvista, "matplotlib": _by_matplotlib}
