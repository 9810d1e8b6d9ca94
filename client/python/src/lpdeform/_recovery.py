"""Decides what to do when a stream has ended."""

from __future__ import annotations

import random
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from lpdeform.errors import Code, LpdeformError, is_session_lost, is_taken_all_the_same, is_undecided, make
from lpdeform.v1 import service_pb2


class Next(Enum):
    RESUME = "open a stream to the same session"
    RECREATE = "the session is gone: recreate it from the client's copy, then open a stream"
    GIVE_UP = "nothing more comes"


class Recovery(NamedTuple):
    next: Next
    why: LpdeformError
    pause: float
    """Seconds to wait before the next try."""


class Ending(NamedTuple):
    """How a stream ended."""

    error: LpdeformError | None
    """The error; None if there was none."""
    go_away: service_pb2.GoAway | None = None
    """The server's reason, if it gave one; it takes precedence over `error`."""
    stood: float = 0.0
    """For how many seconds the stream was open."""
    away: float = 0.0
    """Seconds since a stream was last open."""


class Backoff:
    """Exponential backoff: 50 ms, doubled up to 2 s, each pause randomly between half and all of that.

    The random part keeps the clients of a restarted server from all returning at once.
    """

    first = 0.05
    most = 2.0
    most_asked = 60.0
    """The longest pause that a server may ask for."""

    def __init__(self, chance: Callable[[], float] = random.random) -> None:
        self._chance = chance
        self._longest = self.first

    def next(self, asked: float = 0.0) -> float:
        """The pause, in addition to `asked`, which the server asks for."""
        pause = (0.5 + 0.5 * self._chance()) * self._longest
        self._longest = min(2 * self._longest, self.most)
        return min(max(asked, 0.0), self.most_asked) + pause

    def reset(self) -> None:
        self._longest = self.first


class RecoveryRules:
    """What a session does after each of its streams.

    tests/golden/recovery.json has the rules as a table, which the clients in all languages replay.
    """

    most_misfits = 5
    """How many streams in a row may end with a message that does not fit, before the server counts as one of another version."""

    def __init__(self, has_copy: bool, reconnect_for: float, chance: Callable[[], float] = random.random) -> None:
        """`has_copy`: the session can be recreated. Gives up after `reconnect_for` seconds without an open stream."""
        self._has_copy = has_copy
        self._reconnect_for = reconnect_for
        self._backoff = Backoff(chance)
        self._misfits = 0

    def frame_fitted(self) -> None:
        """A complete frame came."""
        self._misfits = 0

    def begin(self) -> None:
        """The caller starts again, so earlier failures do not count."""
        self._misfits = 0
        self._backoff.reset()

    def after(self, ending: Ending) -> Recovery:
        if ending.stood >= Backoff.most:
            self._backoff.reset()  # a stream that breaks at once is not a success
        if ending.go_away is not None:
            next_step, why = _after_go_away(ending.go_away, self._has_copy)
            asked = ending.go_away.reconnect_after_ms / 1000
        else:
            next_step, why = _after_error(ending.error, self._has_copy)
            asked = ending.error.retry_after if ending.error is not None else 0.0
        if why.reason == "FRAME_PARTS":
            self._misfits += 1
            if self._misfits >= self.most_misfits:
                next_step = Next.GIVE_UP
        if ending.away > self._reconnect_for:
            next_step = Next.GIVE_UP
        return Recovery(next_step, why, self._backoff.next(asked))

    def after_failed_making(self, error: LpdeformError) -> Recovery:
        """The session could not be recreated."""
        step = Next.RECREATE if is_undecided(error) else Next.GIVE_UP
        return Recovery(step, error, self._backoff.next(error.retry_after))


_passing = {
    Code.CANCELLED,
    Code.UNKNOWN,
    Code.DEADLINE_EXCEEDED,
    Code.RESOURCE_EXHAUSTED,
    Code.INTERNAL,
    Code.UNAVAILABLE,
    Code.DATA_LOSS,
}


def _after_error(error: LpdeformError | None, has_copy: bool) -> tuple[Next, LpdeformError]:
    if error is None:
        return Next.RESUME, make(Code.UNAVAILABLE, "The server ended the stream.")
    if error.reason in ("FRAME_VERTICES", "EXCEPTION"):  # it is another mesh, so it would happen again
        return Next.GIVE_UP, error
    if is_session_lost(error):
        return (Next.RECREATE if has_copy else Next.GIVE_UP), error
    if error.code in _passing or is_undecided(error):
        return Next.RESUME, error
    if error.reason == "NOT_THE_WRITER":  # it happened while no stream was open
        return Next.GIVE_UP, make(Code.ABORTED, "Another writer took the session over.", "WRITER_REPLACED")
    return Next.GIVE_UP, error


def _after_go_away(go_away: service_pb2.GoAway, has_copy: bool) -> tuple[Next, LpdeformError]:
    text = go_away.text
    if go_away.reason == service_pb2.GO_AWAY_REASON_SESSION_DELETED:
        return Next.GIVE_UP, make(Code.NOT_FOUND, text, "SESSION_DELETED")
    if go_away.reason == service_pb2.GO_AWAY_REASON_SESSION_EXPIRED:
        return (Next.RECREATE if has_copy else Next.GIVE_UP), make(Code.NOT_FOUND, text, "SESSION_EXPIRED")
    if go_away.reason == service_pb2.GO_AWAY_REASON_WRITER_REPLACED:
        return Next.GIVE_UP, make(Code.ABORTED, text, "WRITER_REPLACED")
    if go_away.reason == service_pb2.GO_AWAY_REASON_PROTOCOL_ERROR:
        return Next.GIVE_UP, make(Code.INTERNAL, text, "PROTOCOL_ERROR")
    if go_away.reason == service_pb2.GO_AWAY_REASON_TOKEN_EXPIRED:
        return Next.RESUME, make(Code.UNAUTHENTICATED, text, "TOKEN_EXPIRED")
    return Next.RESUME, make(Code.UNAVAILABLE, text, "DRAINING")


class Answer(Enum):
    """What an error means for the update that it answers, or that a call carried."""

    AGAIN = "send it again, not before error.retry_after"
    RECREATE = "it waits until the session is recreated"
    TAKEN = "the server has it, but cannot solve for it yet"
    REFUSED = "it is refused"


def answer_of(error: LpdeformError, is_second: bool = False) -> Answer:
    """`is_second`: this update had the same answer before."""
    if is_session_lost(error):
        return Answer.RECREATE
    if is_taken_all_the_same(error):
        return Answer.TAKEN
    is_hopeless = is_second and error.reason == "UPLOAD_UNKNOWN"
    return Answer.AGAIN if is_undecided(error) and not is_hopeless else Answer.REFUSED


class Judge:
    """Decides what an error means for the updates that were sent.

    If uploads were lost, with a server that has ended or by a change of server, the update is sent again with new uploads, but
    only once: a server that loses those as well will not do better.
    """

    def __init__(self) -> None:
        self._resent = 0

    def answer_of(self, error: LpdeformError, seq: int) -> Answer:
        answer = answer_of(error, seq == self._resent)
        if error.reason == "UPLOAD_UNKNOWN":
            self._resent = seq
        return answer
