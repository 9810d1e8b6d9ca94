"""The newest frame that was not taken, the server's errors, and the callers who wait for either."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from lpdeform.errors import LpdeformError, again
from lpdeform.frames import Frame

_most_problems = 64


class Taken(NamedTuple):
    """A frame, and the stream that it came on and that must acknowledge it."""

    frame: Frame
    stream: int


class FrameBox:
    """Drops frames of an older epoch or update than an earlier frame. May be used by any thread."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._newest: Taken | None = None
        self.last_final: Frame | None = None
        """The frame that take() returned last, if it is final."""
        self.takes: int = 0
        """How often take() returned or raised something."""
        self._epoch = 0
        self._input_seq = 0
        self._problems: deque[LpdeformError] = deque(maxlen=_most_problems)
        self._end: LpdeformError | None = None
        self._listeners: set[Callable[[], None]] = set()

    def put(self, frame: Frame, stream: int) -> bool:
        """Returns False if the frame is dropped."""
        with self._changed:
            if frame.epoch < self._epoch or frame.input_seq < self._input_seq:
                return False
            self._epoch, self._input_seq = frame.epoch, frame.input_seq
            if self._newest is not None:
                frame.skipped_inputs += self._newest.frame.skipped_inputs
            self._newest = Taken(frame, stream)
            self._wake()
            return True

    def put_problem(self, problem: LpdeformError) -> None:
        with self._changed:
            self._problems.append(problem)
            self._wake()

    def begin_epoch(self, epoch: int) -> None:
        """Drops frames of earlier epochs."""
        with self._changed:
            if epoch > self._epoch:
                self._epoch, self._newest = epoch, None

    def begin_session(self) -> None:
        """Epochs start again, because the session is a new one."""
        with self._changed:
            self._epoch, self._newest = 0, None

    def finish(self, end: LpdeformError) -> None:
        """Nothing more comes, for this reason."""
        with self._changed:
            self._end = self._end or end
            self._wake()

    def resume(self) -> None:
        """Reverses finish(). Forgets the last frame taken, because another writer may have changed the session since."""
        with self._changed:
            self._end = self.last_final = None

    def take(self) -> Taken | None:
        """The newest frame, or None. Raises each error of the server once. When nothing more comes, raises the reason every
        time."""
        with self._changed:
            self.raise_problem()
            taken, self._newest = self._newest, None
            if taken is None and self._end is not None:
                raise again(self._end)
            if taken is not None:
                self.last_final = taken.frame if taken.frame.is_final else None
                self._count_take()
            return taken

    def raise_problem(self) -> None:
        """Raises the next error of the server, if there is one."""
        with self._changed:
            if self._problems:
                self._count_take()
                raise again(self._problems.popleft())

    def _count_take(self) -> None:
        self.takes += 1
        self._wake()

    def wait(self, deadline: float, takes: int) -> bool:
        """Waits until take() has something to return or raise, or has been served more than `takes` times.

        Returns False if time.monotonic() reaches the deadline first.
        """
        with self._changed:
            return self._changed.wait_for(
                lambda: self._has_news() or self.takes != takes, max(0.0, deadline - time.monotonic())
            )

    def _has_news(self) -> bool:
        return bool(self._problems) or self._newest is not None or self._end is not None

    def listen(self, listener: Callable[[], None]) -> None:
        """Calls `listener` whenever take() gets something new or has returned it, and at once if it has something now. It must
        not wait."""
        with self._changed:
            self._listeners.add(listener)
            if self._has_news():
                listener()

    def forget(self, listener: Callable[[], None]) -> None:
        with self._changed:
            self._listeners.discard(listener)

    def _wake(self) -> None:
        self._changed.notify_all()
        for listener in list(self._listeners):
            listener()
