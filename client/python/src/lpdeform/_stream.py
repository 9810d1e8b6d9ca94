"""One Deform call as its link sees it."""

from __future__ import annotations

import time
from typing import Any

from lpdeform._notices import Notices
from lpdeform._rpc import Packer
from lpdeform._stop import Stop
from lpdeform.errors import LpdeformError
from lpdeform.v1 import service_pb2


class Stream(Notices):
    """One Deform call. The link's lock guards its fields."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number
        self.call: Any = None
        self.stop = Stop()
        """Ends this stream's uploads; the next stream sends them again."""
        self.is_open = False
        self.is_over = False
        self.opened_at = 0.0
        self.heard_at = time.monotonic()
        self.longest_silence = 45.0
        """After this long without a message the connection counts as dead: three of the heartbeats that the server announces."""
        self.ack_due = 0
        self.go_away: service_pb2.GoAway | None = None
        self.uploads: dict[int, Packer] = {}
        """By the updates that use them, until these are answered."""
        self.done: list[Packer] = []
        self.failure: LpdeformError | None = None
        """The error that kept an update from being sent."""

    def cancel(self) -> None:
        self.stop.set()
        if self.call is not None:
            self.call.cancel()
