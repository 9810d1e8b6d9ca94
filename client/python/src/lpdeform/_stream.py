"""One Deform call as its link sees it."""

from __future__ import annotations

import time
from typing import Any

from lpdeform._rpc import Packer, Stop
from lpdeform.errors import LpdeformError
from lpdeform.frames import Frame
from lpdeform.types import Notice
from lpdeform.v1 import service_pb2


class Stream:
    """One Deform call. The link's lock guards its fields."""

    def __init__(self, number: int) -> None:
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
        self.server_notice: Notice | None = None
        self.better: Notice | None = None
        """The notice of a better shape, while it applies."""
        self.uploads: dict[int, Packer] = {}
        """By the updates that use them, until these are answered."""
        self.done: list[Packer] = []
        self.failure: LpdeformError | None = None
        """The error that kept an update from being sent."""

    @property
    def notice(self) -> Notice | None:
        """A better shape takes precedence: it concerns the newest result, and load the next updates."""
        return self.better or self.server_notice

    def take_notice(self, notice: Notice) -> None:
        if notice.reason == "better_shape":
            self.better = notice
        else:
            self.server_notice = notice

    def shown(self, frame: Frame) -> None:
        """Drops the notice of a better shape if the frame answers a later update or is the shape."""
        better = self.better
        if better is not None and (frame.input_seq > better.input_seq or frame.energy <= better.energy):
            self.better = None

    def cancel(self) -> None:
        self.stop.set()
        if self.call is not None:
            self.call.cancel()
