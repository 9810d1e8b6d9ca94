"""Ends calls from other threads."""

from __future__ import annotations

import threading
from typing import Any, Protocol


class Ended(Protocol):
    def cancel(self) -> Any: ...


class Stop:
    """Ends the calls that were made with it, from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._calls: set[Ended] = set()
        self._came = threading.Event()
        self.is_set: bool = False

    def set(self) -> None:
        with self._lock:
            self.is_set = True
            calls = list(self._calls)
        self._came.set()
        for call in calls:
            call.cancel()

    def add(self, call: Ended) -> None:
        with self._lock:
            self._calls.add(call)
            is_set = self.is_set
        if is_set:
            call.cancel()

    def remove(self, call: Ended) -> None:
        with self._lock:
            self._calls.discard(call)

    def wait(self, seconds: float) -> bool:
        """Waits; returns True as soon as it is set, False after that time."""
        return self._came.wait(seconds)
