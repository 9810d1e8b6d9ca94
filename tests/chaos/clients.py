"""The users of a session in chaos.py: its writer, a slow reader, and a caller of the client library."""

from __future__ import annotations

import contextlib
import queue
import random
import threading
import time

import grpc

import lpdeform
import lpdeform._rpc
from lpdeform.v1 import handle_pb2, service_pb2

from machines import PATIENCE
from wire import Book, Stream, Wire, create_request, held, motion


class Writer:
    """One session and all that write to it, on a thread of its own."""

    def __init__(self, book: Book, port: int, seed: str) -> None:
        self.book, self.port, self.seed = book, port, seed
        self.chance = random.Random(seed)
        self.seq = 0
        self.xs: dict[int, float] = {}
        self.name = self.token = ""
        self.are_handles_kept = False
        self.fault: BaseException | None = None
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)

    def make(self) -> None:
        with Wire(self.port, self.seed) as wire:
            made = wire.patiently("CreateSession", create_request(f"chaos of seed {self.seed}"))
        self.name, self.token = made.session.name, made.writer_token
        self.book.note("writer", session=self.name, epoch=made.session.epoch, token=self.token)

    def _run(self) -> None:
        try:
            while not self.is_over.is_set():
                with Wire(self.port, self.seed) as wire:
                    self.chance.choice((self._stream, self._stream, self._calls, self._take_over))(wire)
        except BaseException as error:  # to be raised where the run is judged
            self.fault = error

    def next(self, token: str):
        self.seq += 1
        x = round(0.02 * (self.seq % 97), 6)
        self.xs[self.seq] = x
        if self.are_handles_kept and self.chance.random() < 0.8:
            handles = [handle_pb2.HandleUpdate(name="tip", move=motion(x))]
        else:
            handles = [held("base", 0), held("tip", x)]
        self.book.note("sent", session=self.name, input_seq=self.seq, x=x, token=token)
        return service_pb2.Update(input_seq=self.seq, handles=handles)

    def _answered(self, result) -> None:
        if isinstance(result, service_pb2.UpdateResult) and result.kept:
            self.are_handles_kept = True

    def _stream(self, wire: Wire) -> None:
        stream = Stream(self.book, wire, self.name, self.token, "writer", credit=self.chance.choice((1, 2, 2, 4)))
        count = self.chance.randint(1, 8)
        for _ in range(count):
            stream.send(self.next(self.token))
            time.sleep(self.chance.choice((0, 0, 0.01, 0.05)))
        end = time.monotonic() + PATIENCE
        while count > 0 and (result := self._result(stream, end)) is not None:
            self._answered(result)
            count -= getattr(result, "input_seq", 1) != 0
        if self.chance.random() < 0.5:
            self._await(stream, self.seq)
        stream.end()

    def _result(self, stream: Stream, end: float):
        while time.monotonic() < end and not self.is_over.is_set():
            try:
                return stream.results.get(timeout=0.1)
            except queue.Empty:
                if stream.is_over.is_set():
                    return None
        return None

    def _await(self, stream: Stream, seq: int, patience: float = 3.0) -> bool:
        end = time.monotonic() + patience
        while time.monotonic() < end and not stream.is_over.is_set():
            if stream.settled.get(seq):
                return True
            time.sleep(0.005)
        return bool(stream.settled.get(seq))

    def _update(self, wire: Wire, token: str) -> None:
        update = self.next(token)
        request = service_pb2.UpdateHandlesRequest(session=self.name, writer_token=token, update=update)
        try:
            result = wire.call("UpdateHandles", request, timeout=5).result
        except grpc.RpcError as error:
            self.book.note("refused", session=self.name, input_seq=update.input_seq, reason=error.code().name, token=token)
            return
        self.book.note("answered", session=self.name, input_seq=result.input_seq, kept=result.kept, token=token)
        self._answered(result)

    def _calls(self, wire: Wire) -> None:
        for _ in range(self.chance.randint(1, 5)):
            self._update(wire, self.token)

    def _take_over(self, wire: Wire) -> None:
        """Another writer comes, and the one before tries once more."""
        before = self.token
        try:
            taken = wire.call("AcquireWriter", service_pb2.AcquireWriterRequest(session=self.name), timeout=5)
        except grpc.RpcError:
            self.token = ""  # it may have happened: only another takeover gives a token that is known
            while not self.token and not self.is_over.is_set():
                self._regain(wire)
            return
        self._gain(taken)
        self._update(wire, before)

    def _gain(self, taken) -> None:
        self.token = taken.writer_token
        self.seq = max(self.seq, taken.input_seq)
        self.book.note("writer", session=self.name, epoch=taken.epoch, token=self.token)

    def _regain(self, wire: Wire) -> None:
        try:
            self._gain(wire.call("AcquireWriter", service_pb2.AcquireWriterRequest(session=self.name), timeout=5))
        except grpc.RpcError:
            time.sleep(0.05)

    def finish(self) -> None:
        """After the faults: one more update, and its result."""
        self.is_over.set()
        self.thread.join(PATIENCE)
        if self.fault:
            raise self.fault
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            with Wire(self.port, self.seed) as wire:
                self.token = ""
                while not self.token and time.monotonic() < end:
                    self._regain(wire)
                self.are_handles_kept = False
                since = self.book.now()
                stream = Stream(self.book, wire, self.name, self.token, "writer", credit=2)
                update = self.next(self.token)
                stream.send(update)
                is_settled = self._await(stream, update.input_seq, 20.0)
                stream.end()
            if is_settled:
                break
        self.book.note("last", session=self.name, input_seq=self.seq, since=since)


class SlowReader:
    """Looks on, and from time to time acknowledges nothing for a while."""

    def __init__(self, book: Book, port: int, writer: Writer, seed: str) -> None:
        self.book, self.port, self.writer, self.chance = book, port, writer, random.Random(seed)
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        while not self.is_over.is_set():
            with Wire(self.port, self.writer.seed) as wire:
                stream = Stream(self.book, wire, self.writer.name, "", "slow", credit=self.chance.choice((1, 2, 8)))
                while not stream.is_over.is_set() and not self.is_over.is_set():
                    stream.is_slow.set()
                    self.is_over.wait(self.chance.uniform(0.1, 0.6))
                    stream.acknowledge_all()
                    self.is_over.wait(self.chance.uniform(0.02, 0.3))
                stream.end()
            self.is_over.wait(0.02)

    def finish(self) -> None:
        self.is_over.set()
        self.thread.join(PATIENCE)


class Onlooker:
    """What the client library shows to its caller."""

    def __init__(self, book: Book, port: int, session: str, way: str) -> None:
        self.book, self.session, self.way, self.name = book, session, way, book.name("library")
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self._run, args=(port,), daemon=True)

    def _run(self, port: int) -> None:
        while not self.is_over.is_set():
            try:
                with self._comes_this_way(), lpdeform.join(self.session, address=f"127.0.0.1:{port}", reconnect_for=PATIENCE) as session:
                    self._look(session)
            except lpdeform.LpdeformError:
                self.is_over.wait(0.05)
                self.name = self.book.name("library")  # a new one knows nothing of the one before

    @contextlib.contextmanager
    def _comes_this_way(self):
        """All that share a session come by one server. Nobody else makes a client meanwhile."""
        before = lpdeform._rpc.new_request_id
        lpdeform._rpc.new_request_id = lambda: self.way
        try:
            yield
        finally:
            lpdeform._rpc.new_request_id = before

    def _look(self, session) -> None:
        while not self.is_over.is_set():
            frame = session.poll()
            if frame is None:
                self.is_over.wait(0.005)
                continue
            self.book.note("shown", client=self.name, session=self.session, epoch=frame.epoch, frame_seq=frame.frame_seq)

    def finish(self) -> None:
        self.is_over.set()
        self.thread.join(PATIENCE)
