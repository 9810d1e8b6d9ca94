"""Replays the golden recordings to one client: replay.py PROGRAM [ARGUMENT...]

Runs `PROGRAM ARGUMENT... ADDRESS NUMBER_OF_ERRORS` against a server that says what frames.json and errors.json hold, byte for byte,
and compares what the program prints with expected.txt. The program

- opens a session of the mesh of the recording for each encoding that it has, sets both handles, waits for the result, and prints it
  and what the server said about itself;
- does so once more in float32, moves the tip elsewhere, takes that back, waits for the result, and prints it ("undo"); prints what
  settling says that may not wait, once the result was taken, while the move is under way, and once the result after the undo was
  taken ("settled again"); prints how long the snapshot of the session is, and the name of the session restored from it;
- opens a mesh of 1000 + k vertices for each error k, and prints what the call ended with;
- in one more session moves a handle named after each k, one after the other, and prints the fault that answers it.

What the client sends must mean what the recording has; numbers may be of either scalar.
"""

import base64
import itertools
import json
import queue
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import grpc
import numpy as np
from google.protobuf.json_format import MessageToDict
from lpdeform.v1 import data_pb2, frame_pb2, report_pb2, service_pb2

HERE = Path(__file__).parent
PATIENCE = 100.0  # seconds; never reached where all is well


def message(kind, text):
    return kind.FromString(base64.b64decode(text))


def numbers(buffer, scalar, count=None):
    """Of a Buffer, as doubles; the first `count`."""
    kind = "<f8" if scalar == data_pb2.SCALAR_FLOAT64 else "<f4"
    return np.frombuffer(buffer.inline, kind, -1 if count is None else count).astype(float).tolist()


def meaning_of_mesh(mesh):
    size = 8 if mesh.scalar == data_pb2.SCALAR_FLOAT64 else 4
    faces = np.frombuffer(mesh.data.inline, "<u4", offset=3 * mesh.vertex_count * size)
    return numbers(mesh.data, mesh.scalar, 3 * mesh.vertex_count), faces.tolist(), mesh.face_count


def meaning_of_creation(request):
    """All but the id, with what is left out said."""
    copy = service_pb2.CreateSessionRequest.FromString(request.SerializeToString())
    for field in ("request_id", "mesh"):
        copy.ClearField(field)
    if copy.weights == report_pb2.WEIGHT_KIND_COTANGENT:
        copy.ClearField("weights")
    if copy.free_components == service_pb2.FREE_COMPONENTS_ERROR:
        copy.ClearField("free_components")
    if not copy.settings.ListFields():
        copy.ClearField("settings")
    return meaning_of_mesh(request.mesh), MessageToDict(copy)


def meaning_of_handle(handle):
    motion = handle.motion
    rigid = motion.rigid
    where = "fixed"
    if motion.WhichOneof("kind") == "rigid" and (rigid.angle_radians or rigid.translation.ListFields()):
        where = (rigid.angle_radians, rigid.translation.x, rigid.translation.y, rigid.translation.z)
    held = np.frombuffer(handle.vertices.inline, "<u4").tolist()
    return held, where, handle.WhichOneof("hold"), handle.footprint_radius


class Differs(Exception):
    pass


class Service:
    """The recorded server."""

    def __init__(self):
        recorded = json.loads((HERE / "frames.json").read_text())
        self.creation = message(service_pb2.CreateSessionRequest, recorded["create_request"])
        self.streams = recorded["streams"]
        self.errors = json.loads((HERE / "errors.json").read_text())
        self.undo, self.snapshot = recorded["undo"], recorded["snapshot"]
        self.problems = []
        self.newest_moved = 0  # of the handles that are named after errors
        self.newest = queue.Queue()
        """What the newest stream is asked for, and None where that ends."""
        self.newest_input = 0

    def differs(self, context, text):
        self.problems.append(text)
        context.abort(grpc.StatusCode.INVALID_ARGUMENT, text)

    def create_session(self, request, context):
        error = request.mesh.vertex_count - 1000
        if 0 <= error < len(self.errors):
            self.fail(self.errors[error], context)
        if meaning_of_creation(request) != meaning_of_creation(self.creation):
            self.differs(context, f"another session is asked for: {meaning_of_creation(request)}")
        return message(service_pb2.CreateSessionResponse, self.streams[0]["create_response"])

    @staticmethod
    def fail(error, context):
        code = next(code for code in grpc.StatusCode if code.value[0] == error["code"])
        context.set_trailing_metadata((("grpc-status-details-bin", base64.b64decode(error["details"])),))
        context.abort(code, error["text"])

    def stream_for(self, options):
        for stream in self.streams:
            asked = message(service_pb2.DeformOpen, stream["open"]).options
            is_raw = options.encoding in (frame_pb2.ENCODING_RAW, frame_pb2.ENCODING_UNSPECIFIED)
            if options.encoding == asked.encoding and (not is_raw or options.scalar == asked.scalar):
                return stream
        raise Differs(f"no stream was recorded with {options}")

    def deform(self, requests, context):
        first = next(requests)
        stream = self.stream_for(first.open.options)
        opened, notice, _, result = (message(service_pb2.DeformResponse, text) for text in stream["responses"])
        yield opened
        yield notice
        asked = self.newest = queue.Queue()
        threading.Thread(target=self.hand_over, args=(requests, asked), daemon=True).start()
        wanted = {u.name: meaning_of_handle(u.set) for u in message(service_pb2.Update, stream["update"]).handles}
        have = {}
        for request in iter(asked.get, None):
            if isinstance(request, service_pb2.UndoUpdateRequest):
                undone = message(service_pb2.DeformResponse, self.undo["result"])
                undone.event.frame.header.input_seq = request.input_seq
                yield undone
                continue
            if request.WhichOneof("message") != "update":
                continue
            update = request.update
            self.newest_input = update.input_seq
            moved = [u for u in update.handles if u.WhichOneof("change") == "move"]
            if moved and moved[0].name == "tip":
                self.check_move(moved[0].move, context)
                yield service_pb2.DeformResponse(result=service_pb2.UpdateResult(input_seq=update.input_seq))
                continue
            if moved:
                newest = max(int(one.name) for one in moved)  # the others came again with it, or alone, on another stream
                if newest < self.newest_moved:
                    yield service_pb2.DeformResponse(result=service_pb2.UpdateResult(input_seq=update.input_seq))
                    continue
                self.newest_moved = newest
                yield from self.answer(newest, update.input_seq)
                continue
            have.update({u.name: meaning_of_handle(u.set) for u in update.handles})
            yield service_pb2.DeformResponse(result=service_pb2.UpdateResult(input_seq=update.input_seq))
            if have == wanted:
                result.event.frame.header.input_seq = update.input_seq
                yield result
            elif any(have[name] != wanted.get(name) for name in have):
                self.differs(context, f"another update is sent: {have}, not {wanted}")

    @staticmethod
    def hand_over(requests, asked):
        try:
            for request in requests:
                asked.put(request)
        except Exception:  # the call was cancelled
            pass
        asked.put(None)

    def check_move(self, motion, context):
        at = motion.rigid.translation
        if (at.x, at.y, at.z) != (0, 0, 1):
            self.differs(context, f"the tip is moved elsewhere: {motion}")

    def update_handles(self, request, context):
        self.newest_input = request.update.input_seq
        for change in request.update.handles:
            self.check_move(change.move, context)
        return service_pb2.UpdateHandlesResponse(result=service_pb2.UpdateResult(input_seq=request.update.input_seq))

    def undo_update(self, request, context):
        token = message(service_pb2.CreateSessionResponse, self.streams[0]["create_response"]).writer_token
        if (request.redo, request.writer_token, request.input_seq) != (False, token, self.newest_input + 1):
            self.differs(context, f"another step is undone: {request}, after update {self.newest_input}")
        self.newest.put(request)
        response = message(service_pb2.UndoUpdateResponse, self.undo["response"])
        response.result.input_seq = request.input_seq
        return response

    def snapshot_session(self, request, context):
        if request.session != message(service_pb2.CreateSessionResponse, self.streams[0]["create_response"]).session.name:
            self.differs(context, f"another session is asked for: {request}")
        file = base64.b64decode(self.snapshot["file"])
        for offset in itertools.count(0, 1000):
            if offset >= len(file):
                return
            part = file[offset : offset + 1000]
            yield service_pb2.SnapshotSessionResponse(size_bytes=len(file), offset=offset, data=part)

    def restore_session(self, request, context):
        if request.snapshot.inline != base64.b64decode(self.snapshot["file"]):
            self.differs(context, "another snapshot comes back")
        return message(service_pb2.RestoreSessionResponse, self.snapshot["restore_response"])

    def answer(self, number, input_seq):
        """The update's fault. One that passes is said of no update: that update would be sent again (recovery.json)."""
        fault = message(service_pb2.Fault, self.errors[number]["fault"])
        code = grpc.StatusCode
        passing = (code.CANCELLED, code.UNKNOWN, code.DEADLINE_EXCEEDED, code.UNAVAILABLE)
        if fault.retry_after_ms or fault.code in [one.value[0] for one in passing]:
            yield service_pb2.DeformResponse(result=service_pb2.UpdateResult(input_seq=input_seq))
            input_seq = 0
        fault.input_seq = input_seq
        yield service_pb2.DeformResponse(event=service_pb2.StreamEvent(fault=fault))

    def handlers(self):
        service, calls = service_pb2.DESCRIPTOR.services_by_name["DeformService"], {}
        plain = {
            "CreateSession": self.create_session,
            "DeleteSession": lambda *_: service_pb2.DeleteSessionResponse(),
            "UpdateHandles": self.update_handles,
            "UndoUpdate": self.undo_update,
            "RestoreSession": self.restore_session,
        }
        for method in service.methods:
            kind = getattr(service_pb2, method.input_type.name)
            if method.name in plain:
                make, act = grpc.unary_unary_rpc_method_handler, plain[method.name]
            elif method.name == "SnapshotSession":
                make, act = grpc.unary_stream_rpc_method_handler, self.snapshot_session
            elif method.name == "Deform":
                make, act = grpc.stream_stream_rpc_method_handler, self.deform
            else:
                continue
            calls[method.name] = make(act, kind.FromString, lambda response: response.SerializeToString())
        return grpc.method_handlers_generic_handler(service.full_name, calls)


def main():
    recorded = Service()
    server = grpc.server(ThreadPoolExecutor(16))  # streams that are open at once, and a call
    server.add_generic_rpc_handlers((recorded.handlers(),))
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/socket"
        server.add_insecure_port(address)
        server.start()
        done = subprocess.run([*sys.argv[1:], address, str(len(recorded.errors))], stdout=subprocess.PIPE, timeout=PATIENCE)
        server.stop(None)
    said = done.stdout.decode().splitlines()
    expected = (HERE / "expected.txt").read_text().splitlines()
    different = [(a, b) for a, b in zip(expected, said) if a != b]
    for wanted, line in different[:5]:
        print(f"expected {wanted}\nand not  {line}")
    for problem in recorded.problems[:5]:
        print(problem)
    ok = done.returncode == 0 and len(said) == len(expected) and not different and not recorded.problems
    print(f"{len(said)} lines of {len(expected)}, {len(different)} different, exit status {done.returncode}")
    sys.exit(0 if ok else 1)


main()
