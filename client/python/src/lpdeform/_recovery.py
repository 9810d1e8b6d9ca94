"""What to do when a stream has ended."""

from __future__ import annotations

import random
from enum import Enum
from typing import NamedTuple

from lpdeform.errors import Code, LpdeformError, make
from lpdeform.v1 import service_pb2


class Next(Enum):
    RESUME = "open a stream to the same session"
    MAKE_ANEW = "the session is gone: make it from our copy, then open a stream"
    GIVE_UP = "nothing more comes"


class Recovery(NamedTuple):
    next: Next
    why: LpdeformError
    pause: float
    """Seconds; not to be tried before."""


_passing = {
    Code.CANCELLED,
    Code.UNKNOWN,
    Code.DEADLINE_EXCEEDED,
    Code.RESOURCE_EXHAUSTED,
    Code.INTERNAL,
    Code.UNAVAILABLE,
    Code.DATA_LOSS,
}


def recovery_after(ended: LpdeformError | None, go_away: service_pb2.GoAway | None, has_copy: bool) -> Recovery:
    """By the go-away message, where one came, or by what the call ended with: None where it ended without an error.

    `has_copy`: the session can be made anew.
    """
    if go_away is not None:
        return _after_go_away(go_away, has_copy)
    why = ended or make(Code.UNAVAILABLE, "The server ended the stream.")
    if why.reason in ("FRAME_VERTICES", "EXCEPTION"):  # it is another mesh; it would happen again
        return Recovery(Next.GIVE_UP, why, 0.0)
    if why.code in _passing:
        return Recovery(Next.RESUME, why, why.retry_after)
    if why.code is Code.NOT_FOUND and has_copy:
        return Recovery(Next.MAKE_ANEW, why, why.retry_after)
    if why.reason == "NOT_THE_WRITER":  # it happened while we were away
        return Recovery(Next.GIVE_UP, writer_replaced("Another writer took the session over."), 0.0)
    return Recovery(Next.GIVE_UP, why, 0.0)


def writer_replaced(text: str) -> LpdeformError:
    return make(Code.ABORTED, text, "WRITER_REPLACED")


def _after_go_away(go_away: service_pb2.GoAway, has_copy: bool) -> Recovery:
    pause = go_away.reconnect_after_ms / 1000
    text = go_away.text
    if go_away.reason == service_pb2.GO_AWAY_REASON_SESSION_DELETED:
        return Recovery(Next.GIVE_UP, make(Code.NOT_FOUND, text, "SESSION_DELETED"), pause)
    if go_away.reason == service_pb2.GO_AWAY_REASON_SESSION_EXPIRED:
        step = Next.MAKE_ANEW if has_copy else Next.GIVE_UP
        return Recovery(step, make(Code.NOT_FOUND, text, "SESSION_EXPIRED"), pause)
    if go_away.reason == service_pb2.GO_AWAY_REASON_WRITER_REPLACED:
        return Recovery(Next.GIVE_UP, writer_replaced(text), pause)
    if go_away.reason == service_pb2.GO_AWAY_REASON_PROTOCOL_ERROR:
        return Recovery(Next.GIVE_UP, make(Code.INTERNAL, text, "PROTOCOL_ERROR"), pause)
    return Recovery(Next.RESUME, make(Code.UNAVAILABLE, text, "DRAINING"), pause)


class Backoff:
    """Growing pauses: 50 ms doubled up to 2 s, each between half and the whole of that by chance.

    So that the clients of a restarted server do not all come at once.
    """

    first = 0.05
    most = 2.0

    def __init__(self) -> None:
        self._longest = self.first

    def next(self) -> float:
        pause = random.uniform(0.5, 1.0) * self._longest
        self._longest = min(2 * self._longest, self.most)
        return pause

    def reset(self) -> None:
        self._longest = self.first
