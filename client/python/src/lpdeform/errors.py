"""The errors that this package raises, and its warning. proto/errors.md lists the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any, cast

from lpdeform.reasons import Reason


class Code(str, Enum):
    """The names of google.rpc.Code."""

    CANCELLED = "cancelled"
    UNKNOWN = "unknown"
    INVALID_ARGUMENT = "invalid_argument"
    DEADLINE_EXCEEDED = "deadline_exceeded"
    NOT_FOUND = "not_found"
    ALREADY_EXISTS = "already_exists"
    PERMISSION_DENIED = "permission_denied"
    RESOURCE_EXHAUSTED = "resource_exhausted"
    FAILED_PRECONDITION = "failed_precondition"
    ABORTED = "aborted"
    OUT_OF_RANGE = "out_of_range"
    UNIMPLEMENTED = "unimplemented"
    INTERNAL = "internal"
    UNAVAILABLE = "unavailable"
    DATA_LOSS = "data_loss"
    UNAUTHENTICATED = "unauthenticated"


_by_number = dict(enumerate(Code, start=1))


class LpdeformError(Exception):
    """Base of all errors of this package. `str(error)` is one sentence for people; programs use the attributes.

    code: the kind of error.
    reason: one of reasons.py, stable; a newer server may send others. Empty if the server was not reached.
    element: what is wrong: "vertex 17"; may be empty.
    limit: the limit that was violated; may be empty.
    metadata: all details from the server (google.rpc.ErrorInfo.metadata), including `element` and `limit`.
    input_seq: the update that the error is about; 0 if none.
    retry_after: seconds after which to retry; 0 if a retry does not help.
    """

    code: Code
    reason: Reason
    element: str
    limit: str
    metadata: Mapping[str, str]
    input_seq: int
    retry_after: float

    def __init__(
        self,
        code: Code,
        message: str,
        reason: Reason = "",
        element: str = "",
        limit: str = "",
        *,
        metadata: Mapping[str, str] | None = None,
        input_seq: int = 0,
        retry_after: float = 0.0,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.reason = reason
        self.element = element
        self.limit = limit
        self.metadata = dict(metadata or {})
        self.input_seq = input_seq
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes, as multiprocessing hands errors on."""
        numbers = {"metadata": self.metadata, "input_seq": self.input_seq, "retry_after": self.retry_after}
        return _remade, (type(self), (self.code, self.args[0], self.reason, self.element, self.limit), numbers)

    def __str__(self) -> str:
        return f"{self.args[0]} ({self.reason})" if self.reason else str(self.args[0])


def _remade(kind: type[LpdeformError], what: tuple[Any, ...], numbers: Mapping[str, Any]) -> LpdeformError:
    return kind(*what, **numbers)


class InvalidInput(LpdeformError, ValueError):
    """The input cannot be used: `element` and `limit` say what is wrong and why."""


class Unavailable(LpdeformError, ConnectionError):
    """No server answers, or it went away."""


class Timeout(LpdeformError, TimeoutError):
    """The result did not come in time."""


class SplitMeshWarning(UserWarning):
    """The mesh comes apart where border vertices in the same place are not welded. Each open() of such a mesh gives one."""


_classes: dict[Code, type[LpdeformError]] = {
    Code.INVALID_ARGUMENT: InvalidInput,
    Code.UNAVAILABLE: Unavailable,
    Code.DEADLINE_EXCEEDED: Timeout,
}


def make(
    code: Code,
    message: str,
    reason: Reason = "",
    element: str = "",
    limit: str = "",
    *,
    metadata: Mapping[str, str] | None = None,
    input_seq: int = 0,
    retry_after: float = 0.0,
) -> LpdeformError:
    """The error of the class for `code`."""
    return _classes.get(code, LpdeformError)(
        code, message, reason, element, limit, metadata=metadata, input_seq=input_seq, retry_after=retry_after
    )


def invalid(message: str, reason: Reason, element: str = "", limit: str = "") -> LpdeformError:
    return make(Code.INVALID_ARGUMENT, message, reason, element, limit)


def session_closed() -> LpdeformError:
    return make(Code.FAILED_PRECONDITION, "The session is closed.", "SESSION_CLOSED")


def exception(error: Exception) -> LpdeformError:
    """For an unexpected exception on a thread of this package."""
    return make(Code.INTERNAL, f"{type(error).__name__}: {error}", "EXCEPTION")


def again(error: LpdeformError) -> LpdeformError:
    """A copy to raise, so that tracebacks of several calls do not accumulate on one error."""
    return make(
        error.code,
        str(error.args[0]),
        error.reason,
        error.element,
        error.limit,
        metadata=error.metadata,
        input_seq=error.input_seq,
        retry_after=error.retry_after,
    )


def from_status(
    code: int, text: str, reason: str, element: str, limit: str, retry_after_ms: int = 0, input_seq: int = 0
) -> LpdeformError:
    """The error of a status as the server and the solver in this process say it; `code` is its number in google.rpc.Code."""
    metadata = {name: value for name, value in (("element", element), ("limit", limit)) if value}
    return make(
        _by_number.get(code, Code.UNKNOWN),
        text,
        cast(Reason, reason),
        element,
        limit,
        metadata=metadata,
        input_seq=input_seq,
        retry_after=retry_after_ms / 1000,
    )


def about(error: LpdeformError, input_seq: int) -> LpdeformError:
    """The error as one about this update."""
    error.input_seq = input_seq
    return error


def is_session_lost(error: LpdeformError) -> bool:
    """Whether the server does not have the session any more."""
    return error.code is Code.NOT_FOUND and error.reason.startswith("SESSION_")


def is_undecided(error: LpdeformError) -> bool:
    """Whether it is unknown if the server took the call, or may change: then the call is retried."""
    passing = (Code.UNAVAILABLE, Code.CANCELLED, Code.DEADLINE_EXCEEDED, Code.UNKNOWN)
    may_have_room = error.code is Code.RESOURCE_EXHAUSTED and error.retry_after > 0
    return error.code in passing or may_have_room or is_session_lost(error) or error.reason == "UPLOAD_UNKNOWN"


def is_taken_all_the_same(error: LpdeformError) -> bool:
    """Whether the server took the update, but cannot solve for it yet."""
    return error.code in (Code.FAILED_PRECONDITION, Code.ABORTED)
