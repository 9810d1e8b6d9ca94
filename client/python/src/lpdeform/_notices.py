"""The notices that apply at present."""

from __future__ import annotations

from lpdeform.frames import Frame
from lpdeform.types import Notice


class Notices:
    def __init__(self) -> None:
        self.server_notice: Notice | None = None
        self.better: Notice | None = None
        """The notice of a better shape, while it applies."""

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
