"""A session on a server, as the interface takes it. Only this needs grpcio and protobuf."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import cast

from lpdeform import _wire
from lpdeform._better import take_better_shape
from lpdeform._lease import Lease, Original, Snapshot, create_session, join_session, restore_session, route_of
from lpdeform._link import Link
from lpdeform._numbers import Copied
from lpdeform._opened import Connecting, Given, Reaching
from lpdeform._rpc import Rpc, default_address, new_request_id
from lpdeform._snapshot import snapshot
from lpdeform._solve import solve
from lpdeform._solving import SolveOptions
from lpdeform._stop import Stop
from lpdeform._undo import undo
from lpdeform.errors import LpdeformError
from lpdeform.types import Automatic, BetterShape, Floats, FrameOptions, Handle, SolveResult


class RemoteLink(Link):
    """A link with its calls."""

    @property
    def name(self) -> str:
        return self.lease.session

    @property
    def address(self) -> str:
        return self.rpc.address

    def solve(self, options: SolveOptions, stop: Stop) -> SolveResult:
        result = solve(self, options, stop)
        return dataclasses.replace(result, p=self._p(), faces=self.faces)

    def _p(self) -> float | Floats | None:
        """The newest p that was sent, if it is known."""
        with self.changed:
            sent = self.ledger.accepted_settings.p
        if sent is None and isinstance(self.original, Original):
            sent = 2.0 if self.original.settings.p is None else self.original.settings.p
        return None if sent is None or isinstance(sent, Automatic) else cast("float | Floats", sent)

    @property
    def vertices(self) -> Copied | None:
        return self.original.vertices if isinstance(self.original, Original) else None

    @property
    def faces(self) -> Copied | None:
        return self.original.faces if isinstance(self.original, Original) else None

    def undo(self, redo: bool, stop: Stop) -> int:
        return undo(self, redo, stop)

    def take_better_shape(self, stop: Stop) -> BetterShape:
        return take_better_shape(self, stop)

    def snapshot(self, stop: Stop) -> bytes:
        return snapshot(self, stop)


def _connect(to: Reaching) -> Rpc:
    return Rpc(to.address or default_address(), to.call_timeout, to.reconnect_for, to.token, to.tls)


class Remote(Connecting):
    """Opens sessions on a server."""

    def __init__(self, to: Reaching) -> None:
        self._rpc = _connect(to)

    def open(self, given: Given, handles: Mapping[str, Handle] | None, options: FrameOptions, stop: Stop, is_live: bool = True) -> RemoteLink:
        original = Original(
            vertices=given.vertices,
            faces=given.faces,
            normals=given.normals,
            weld=given.weld,
            weights=_wire.weights_to_wire(given.weights),
            free_components=_wire.free_components_to_wire(given.free_components),
            settings=given.settings,
        )
        try:
            lease = create_session(self._rpc, original, new_request_id(), stop)
        except BaseException:
            self._rpc.close()
            raise
        link = RemoteLink(self._rpc, lease, _wire.frame_options_to_wire(options), original, is_live)
        link.begin_with(handles)
        return link

    def join(self, name: str, as_writer: bool, options: FrameOptions, stop: Stop) -> RemoteLink:
        try:
            lease = _join_where_it_is(self._rpc, stop, name, as_writer)
            return RemoteLink(self._rpc, lease, _wire.frame_options_to_wire(options), None)
        except BaseException:
            self._rpc.close()
            raise

    def restore(self, snapshot: bytes, options: FrameOptions, stop: Stop) -> RemoteLink:
        original = Snapshot(bytes(snapshot))
        try:
            lease = restore_session(self._rpc, original, new_request_id(), stop)
            return RemoteLink(self._rpc, lease, _wire.frame_options_to_wire(options), original)
        except BaseException:
            self._rpc.close()
            raise


def _join_where_it_is(rpc: Rpc, stop: Stop, name: str, as_writer: bool) -> Lease:
    """With several servers behind a proxy, uses the route of the server that has the session."""
    try:
        lease = join_session(rpc, name, as_writer, stop)
        if lease.route:
            rpc.go_by(lease.route)
        return lease
    except LpdeformError as error:
        route = route_of(error)
        if not route or route == rpc.route:
            raise
        rpc.go_by(route)
        return join_session(rpc, name, as_writer, stop)
