"""How a solve tells of its progress."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from lpdeform.errors import invalid
from lpdeform.types import SolveProgress

Told = Callable[[SolveProgress], None]


@contextmanager
def told_by(progress: bool | Told | None) -> Iterator[Told | None]:
    """The function to call with each progress. True: a bar, in notebooks as well; without tqdm, nothing is shown."""
    given: object = progress  # of callers without a type checker
    if given is not None and not isinstance(given, bool) and not callable(given):
        text = f"progress is of type {type(given).__name__}."
        raise invalid(text, "ARRAY_TYPE", "progress", "True, False, None or a function")
    if not progress:
        yield None
    elif callable(progress):
        yield progress
    else:
        try:
            tqdm = importlib.import_module("tqdm.auto")
        except ImportError:
            yield None
            return
        with tqdm.tqdm(desc="lpdeform", unit=" iterations", delay=0.3) as bar:

            def show(newest: SolveProgress) -> None:
                bar.set_postfix(energy=f"{newest.energy:.6g}", refresh=False)
                bar.update(newest.iteration - bar.n)

            yield show
