"""What every session does wherever it is: numbers updates, and tells which frame is the newest result."""

from __future__ import annotations

import threading
from collections.abc import Mapping

from lpdeform._box import FrameBox
from lpdeform._checks import checked_update
from lpdeform._ledger import Ledger
from lpdeform._stop import Stop
from lpdeform.errors import Code, LpdeformError, again, make, session_closed
from lpdeform.frames import Frame
from lpdeform.types import Handle, MeshReport, Update


class Following:
    """`changed` guards all state."""

    def __init__(self, ledger: Ledger, epoch: int, newest: int, is_live: bool) -> None:
        """`newest`: the number of the newest update. `is_live`: frames are wanted; otherwise no stream is opened."""
        self.box = FrameBox()
        self.changed = threading.Condition()
        self.ledger = ledger
        self.stop = Stop()
        self.is_solving = False
        self.is_closing = False
        self.is_live = is_live
        self.interruption: LpdeformError | None = None
        self._over: LpdeformError | None = None
        self._thread: threading.Thread | None = None
        self.ledger.count_from(newest)
        self.ledger.begin_epoch(epoch)

    @property
    def report(self) -> MeshReport:
        raise NotImplementedError

    @property
    def is_writer(self) -> bool:
        raise NotImplementedError

    def update(self, update: Update) -> int:
        raise NotImplementedError

    def take(self) -> Frame | None:
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    def enter(self, update: Update) -> int:
        """Checks the update and puts it into the ledger."""
        checked = checked_update(update, self.report.vertices, self.report.faces)
        with self.changed:
            if self.is_closing:
                raise session_closed()
            if self._over is not None:
                raise again(self._over)
            self.require_writer()
            seq = self.ledger.add(checked)
            self.changed.notify_all()
        return seq

    def begin_with(self, handles: Mapping[str, Handle] | None) -> None:
        """Closes the session if the handles that it begins with are refused at once."""
        if not handles:
            return
        try:
            self.update(Update(dict(handles)))
        except BaseException:
            self.close()
            raise

    def require_writer(self) -> None:
        if not self.is_writer:
            text = "A reader cannot change the session: take_over() first."
            raise make(Code.FAILED_PRECONDITION, text, "NOT_THE_WRITER")

    def take_result(self) -> Frame | None:
        """The frame taken last, by any caller, if it is the finished result of the newest update.

        Raises the refusal first if the last frame is the result only because a newer update has been refused meanwhile.
        """
        self.take()
        last = self.box.last_final
        if last is None or not self.is_result(last):
            return None
        self.box.raise_problem()
        return last

    def is_result(self, frame: Frame) -> bool:
        with self.changed:
            return frame.is_final and frame.input_seq >= max(self.ledger.newest, self.ledger.newest_dropped)
