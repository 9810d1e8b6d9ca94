"""What a solve is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lpdeform._numbers import Copied, numbers
from lpdeform.errors import Code, LpdeformError, invalid, make
from lpdeform.types import SolveProgress


@dataclass(frozen=True, eq=False)
class SolveOptions:
    certify: bool = False
    trace: bool = False
    with_normals: bool = False
    initial_positions: Copied | None = None
    on_progress: Callable[[SolveProgress], None] | None = None
    timeout: float | None = None


def solve_took_too_long(timeout: float | None) -> LpdeformError:
    text = f"The solve took longer than {timeout} seconds."
    return make(Code.DEADLINE_EXCEEDED, text, "SOLVE_TIME_PASSED", "timeout", f"{timeout} s")


def checked_positions(values: npt.ArrayLike | None, vertex_count: int) -> Copied | None:
    """Checked here, so that only the update can be what the server finds invalid."""
    if values is None:
        return None
    positions = numbers(values, "initial positions", 3)
    if len(positions) != vertex_count:
        text = f"There are {len(positions)} initial positions for {vertex_count} vertices."
        raise invalid(text, "POSITIONS_SIZE", "", f"positions = {vertex_count}")
    bad = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if bad.size:
        text = f"The initial position of vertex {bad[0]} is not finite."
        raise invalid(text, "POSITIONS_NOT_FINITE", f"vertex {bad[0]}")
    return positions
