"""What a run of chaos.py records, and the judgement of it: the ten invariants of a session.

A history is a list of events, one JSON object a line. Each has "kind" and "at" (seconds); the others say what happened:

    run       seed, mode ("sqlite": one server, "redis": several), seconds
    sent      session, input_seq, x, token      an update leaves a client; x is where it moves the handle "tip"
    answered  session, input_seq, kept, token   its result came
    refused   session, input_seq, reason, token
    writer    session, epoch, token             AcquireWriter or CreateSession was answered
    opening   stream, session                   a stream is asked for
    opened    stream, session, epoch, input_seq, credit, client
    frame     stream, session, epoch, frame_seq, input_seq, is_final, bytes, probe (positions of some vertices)
    ack       stream, frame_seq                 written before the frames that it makes room for can come
    go_away   stream, reason
    end       stream, status, by_client         the stream is over; by_client: it was this end that cancelled
    shown     client, session, epoch, frame_seq what the client library gave to its caller
    fault     what                              "kill", "pause", "slow_store", "store", "drop", "envoy"
    last      session, input_seq, since         nothing is sent after this; a final frame was waited for
    broken    text                              a call failed that must not, after the faults; nothing comes after it
    reference x, probe                          the same handles, solved on a server without faults
    diagonal  length                            of the mesh
    memory    when ("before", "after"), resident, sessions, streams, counted
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import NamedTuple

Event = dict
RESIDENT_SLACK = 48 << 20
"""Bytes: what an allocator and gRPC keep for themselves after a first use."""


class Violation(NamedTuple):
    invariant: int
    text: str

    def __str__(self) -> str:
        return f"invariant {self.invariant}: {self.text}"


class History:
    """Thread-safe as far as list.append is."""

    def __init__(self, events: Iterable[Event] = ()) -> None:
        self.events: list[Event] = list(events)

    @classmethod
    def load(cls, path: str) -> History:
        with open(path) as file:
            return cls(json.loads(line) for line in file)

    def save(self, path: str) -> None:
        with open(path, "w") as file:
            for event in self.events:
                file.write(json.dumps(event) + "\n")

    def of(self, *kinds: str) -> list[Event]:
        return [event for event in self.events if event["kind"] in kinds]

    def by(self, key: str, *kinds: str) -> dict[str, list[Event]]:
        groups = defaultdict(list)
        for event in self.of(*kinds):
            groups[event[key]].append(event)
        return groups


def frame_numbers_rise(history: History):
    for stream, frames in history.by("stream", "frame").items():
        for before, after in zip(frames, frames[1:]):
            if after["epoch"] == before["epoch"] and after["frame_seq"] <= before["frame_seq"]:
                yield f"stream {stream}: frame {after['frame_seq']} after frame {before['frame_seq']} of epoch {after['epoch']}"


def inputs_never_fall(history: History):
    """Within a stream, and within an epoch over all streams, in the order of the frames' numbers."""
    for stream, frames in history.by("stream", "frame").items():
        for before, after in zip(frames, frames[1:]):
            if after["input_seq"] < before["input_seq"]:
                yield f"stream {stream}: input {after['input_seq']} after input {before['input_seq']}"
    for session, frames in history.by("session", "frame").items():
        ordered = sorted(frames, key=lambda frame: (frame["epoch"], frame["frame_seq"]))
        for before, after in zip(ordered, ordered[1:]):
            if after["epoch"] == before["epoch"] and after["input_seq"] < before["input_seq"]:
                yield f"session {session}: input falls to {after['input_seq']} in frame {after['frame_seq']} of epoch {after['epoch']}"


def the_last_input_is_answered(history: History):
    frames = history.by("session", "frame")
    for event in history.of("broken"):
        yield f"the service did not come back: {event['text']}"
    for last in history.of("last"):
        if not any(frame["is_final"] and frame["input_seq"] >= last["input_seq"] and frame["at"] >= last["since"]
                   for frame in frames[last["session"]]):
            yield f"session {last['session']}: no final frame for its last input, {last['input_seq']}"


def credit_is_kept(history: History):
    for stream, (opened, events) in streams(history).items():
        waiting: list[int] = []
        for event in events:
            if event["kind"] == "ack":
                waiting = [number for number in waiting if number > event["frame_seq"]]
            elif event["kind"] == "frame":
                waiting.append(event["frame_seq"])
                if len(waiting) > opened["credit"]:
                    yield f"stream {stream}: {len(waiting)} frames are not acknowledged, its credit is {opened['credit']}"


def slow_streams_hold_little(history: History):
    for stream, (opened, events) in streams(history).items():
        held = largest = 0
        for event in events:
            if event["kind"] == "ack":
                held = 0
            elif event["kind"] == "frame":
                held += event["bytes"]
                largest = max(largest, event["bytes"])
                if held > (opened["credit"] + 1) * largest:
                    yield f"stream {stream}: {held} bytes since the last acknowledgement, over {opened['credit']} + 1 frames"


def streams_end_once(history: History):
    for stream, (opened, events) in streams(history).items():
        ends = [event for event in events if event["kind"] == "end"]
        reasons = [event for event in events if event["kind"] == "go_away"]
        if len(ends) != 1:
            yield f"stream {stream}: {len(ends)} ends"
            continue
        if len(reasons) > 1:
            yield f"stream {stream}: {len(reasons)} reasons"
        if reasons and any(event["kind"] == "frame" for event in events[events.index(reasons[0]):]):
            yield f"stream {stream}: frames after its reason"
        given = len(reasons) + (ends[0]["status"] != "OK")
        if given == 0 and not ends[0]["by_client"]:
            yield f"stream {stream}: it ended without a reason"
        if reasons and ends[0]["status"] != "OK" and not ends[0]["by_client"] and not lost_connection(ends[0]["status"]):
            yield f"stream {stream}: it ended with {reasons[0]['reason']} and with {ends[0]['status']}"


def lost_connection(status: str) -> bool:
    """The way there broke, which no server can help."""
    return status in ("UNAVAILABLE", "CANCELLED", "INTERNAL", "UNKNOWN")


def kept_handles_come_back(history: History):
    """What was kept is there in every later epoch, and what converges is the result for it."""
    diagonal = next((event["length"] for event in history.of("diagonal")), 1.0)
    references = {event["x"]: event["probe"] for event in history.of("reference")}
    sent = {(event["session"], event["input_seq"]): event["x"] for event in history.of("sent")}
    kept: dict[str, int] = defaultdict(int)
    known: dict[str, int] = defaultdict(int)  # what was kept when a stream was asked for
    newest: dict[str, int] = defaultdict(int)  # epoch
    for event in history.events:
        if event["kind"] == "answered" and event["kept"]:
            kept[event["session"]] = max(kept[event["session"]], event["input_seq"])
        if event["kind"] == "opening":
            known[event["stream"]] = kept[event["session"]]
        if event["kind"] == "opened":
            # One that has lost the session without knowing it speaks for an old epoch: its clients take nothing of it.
            is_void = event["epoch"] < newest[event["session"]]
            newest[event["session"]] = max(newest[event["session"]], event["epoch"])
            before = known[event["stream"]]
            if event["input_seq"] < before and not is_void:
                yield f"session {event['session']}: it came back with input {event['input_seq']}, {before} was kept"
        if event["kind"] != "frame" or not event["is_final"] or "probe" not in event:
            continue
        x = sent.get((event["session"], event["input_seq"]))
        if x is None or x not in references:
            continue
        off = max(math.dist(a, b) for a, b in zip(event["probe"], references[x]))
        if off > 1e-4 * diagonal:
            yield f"session {event['session']}: the result for input {event['input_seq']} is off by {off:.3g}"


def no_old_epoch_is_shown(history: History):
    if all(event["mode"] == "sqlite" for event in history.of("run")):  # one server at a time: it knows the newest
        opened: dict[str, int] = defaultdict(int)
        known: dict[str, int] = defaultdict(int)  # when a stream was asked for
        for event in history.of("opening", "opened"):
            if event["kind"] == "opening":
                known[event["stream"]] = opened[event["session"]]
            elif event["epoch"] < known[event["stream"]]:
                yield f"session {event['session']}: a stream of epoch {event['epoch']} after one of {known[event['stream']]}"
            else:
                opened[event["session"]] = max(opened[event["session"]], event["epoch"])
    for client, frames in history.by("client", "shown").items():
        newest: dict[str, int] = defaultdict(int)
        for frame in frames:
            if frame["epoch"] < newest[frame["session"]]:
                yield f"client {client}: a frame of epoch {frame['epoch']} after one of {newest[frame['session']]}"
            newest[frame["session"]] = max(newest[frame["session"]], frame["epoch"])


def one_writer_an_epoch(history: History):
    shared = any(event["mode"] == "redis" for event in history.of("run"))
    holders: dict[tuple[str, int], str] = {}
    replaced: dict[str, float] = {}  # tokens, and when a newer one was there
    newest: dict[str, tuple[int, str]] = {}
    for event in sorted(history.of("writer"), key=lambda event: event["epoch"]):
        holder = holders.setdefault((event["session"], event["epoch"]), event["token"])
        if holder != event["token"]:
            yield f"session {event['session']}: two writers in epoch {event['epoch']}"
        before = newest.get(event["session"])
        if before and before[1] != event["token"]:
            replaced[before[1]] = event["at"]
        newest[event["session"]] = (event["epoch"], event["token"])
    began = {(event["session"], event["input_seq"], event["token"]): event["at"] for event in history.of("sent")}
    for event in history.of("answered"):
        when = began.get((event["session"], event["input_seq"], event["token"]))
        # Where several servers share a store, one that has lost a session without knowing it takes what it cannot keep.
        is_void = shared and not event["kept"]
        if when is not None and when > replaced.get(event["token"], math.inf) and not is_void:
            yield f"session {event['session']}: update {event['input_seq']} of a writer that had been replaced was taken"


def memory_returns(history: History):
    levels = {event["when"]: event for event in history.of("memory")}
    if "after" not in levels:
        return
    after = levels["after"]
    for what in ("sessions", "streams", "counted"):
        if after[what] != 0:
            yield f"{after[what]:g} {what} are left"
    if "before" in levels and after["resident"] > levels["before"]["resident"] + RESIDENT_SLACK:
        yield f"{after['resident'] / 2**20:.0f} MiB are resident, {levels['before']['resident'] / 2**20:.0f} before"


def streams(history: History) -> dict[str, tuple[Event, list[Event]]]:
    """How each stream was opened, and what then happened on it."""
    events = history.by("stream", "opened", "frame", "ack", "go_away", "end")
    return {stream: (of[0], of[1:]) for stream, of in events.items() if of[0]["kind"] == "opened"}


INVARIANTS: dict[int, Callable[[History], Iterable[str]]] = {
    1: frame_numbers_rise, 2: inputs_never_fall, 3: the_last_input_is_answered, 4: credit_is_kept,
    5: slow_streams_hold_little, 6: streams_end_once, 7: kept_handles_come_back, 8: no_old_epoch_is_shown,
    9: one_writer_an_epoch, 10: memory_returns,
}


def check(history: History) -> list[Violation]:
    return [Violation(number, text) for number, invariant in INVARIANTS.items() for text in invariant(history)]
