"""The errors of a server, from its messages."""

from __future__ import annotations

from typing import Any, cast

from lpdeform.errors import Code, LpdeformError, from_status, make
from lpdeform.reasons import Reason
from lpdeform.v1 import google_rpc_pb2, service_pb2


def from_fault(fault: service_pb2.Fault) -> LpdeformError:
    return from_status(
        fault.code, fault.text, fault.reason, fault.element, fault.limit, fault.retry_after_ms, fault.input_seq
    )


def from_call(error: Any, address: str) -> LpdeformError:
    """The error of a grpc.RpcError, from its google.rpc.Status if the server sent one."""
    code = Code[error.code().name] if error.code().name in Code.__members__ else Code.UNKNOWN
    info, retry = google_rpc_pb2.ErrorInfo(), google_rpc_pb2.RetryInfo()
    for key, value in error.trailing_metadata() or ():
        if key != "grpc-status-details-bin" or not isinstance(value, bytes):
            continue
        for detail in google_rpc_pb2.Status.FromString(value).details:
            if detail.type_url.endswith("/google.rpc.ErrorInfo"):
                info.ParseFromString(detail.value)
            elif detail.type_url.endswith("/google.rpc.RetryInfo"):
                retry.ParseFromString(detail.value)
    message = error.details() or "The call failed."
    if code is Code.UNAVAILABLE and not info.reason:
        message, info.reason = f"No lpdeform server answers at {address}: {message}", "NO_SERVER"
    metadata = dict(info.metadata)
    return make(
        code,
        message,
        cast(Reason, info.reason),
        metadata.get("element", ""),
        metadata.get("limit", ""),
        metadata=metadata,
        retry_after=retry.retry_delay.seconds + retry.retry_delay.nanos / 1e9,
    )
