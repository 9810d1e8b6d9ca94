"""Calls that must come after every earlier update, and during which no update is sent."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from lpdeform._ledger import Ledger
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, make, session_closed


class Changing(Protocol):
    """What this needs of a session."""

    changed: threading.Condition
    ledger: Ledger
    is_closing: bool
    is_solving: bool


@contextmanager
def alone(link: Changing, timeout: float, stop: Stop) -> Iterator[None]:
    """Waits until nothing is under way, and lets nothing begin meanwhile.

    Raises Timeout SOLVE_UNDER_WAY after `timeout` seconds, SESSION_CLOSED, and CANCELLED.
    """
    deadline = time.monotonic() + timeout
    with link.changed:
        is_quiet = link.changed.wait_for(
            lambda: link.is_closing or stop.is_set or (not link.is_solving and not link.ledger.has_in_flight),
            deadline - time.monotonic(),
        )
        if link.is_closing:
            raise session_closed()
        if stop.is_set:
            raise make(Code.CANCELLED, "The call was ended.")
        if not is_quiet:
            text = "Another solve, or an update that has no answer yet, is under way."
            raise make(Code.DEADLINE_EXCEEDED, text, "SOLVE_UNDER_WAY")
        link.is_solving = True
    try:
        yield
    except LpdeformError:
        if link.is_closing:
            raise session_closed() from None
        raise
    finally:
        with link.changed:
            link.is_solving = False
            link.changed.notify_all()
