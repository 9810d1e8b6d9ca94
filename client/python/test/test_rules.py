"""The rules of what clients do after a stream, an answer or a loss: tests/golden/recovery.json, which all clients replay."""

from __future__ import annotations

import json
from typing import Any

import pytest

import lpdeform
from conftest import ROOT
from lpdeform._ledger import Ledger, NumberedUpdate
from lpdeform._recovery import Answer, Ending, Next, RecoveryRules, answer_of
from lpdeform.errors import Code, LpdeformError, make
from lpdeform.types import Change, Update
from lpdeform.v1 import service_pb2

Json = dict[str, Any]
TABLE = json.loads((ROOT / "tests/golden/recovery.json").read_text())


def error_of(said: Json) -> LpdeformError | None:
    if said["code"] == "ok":
        return None
    return make(Code(said["code"]), "No.", said.get("reason", ""), retry_after=said.get("retry_after_ms", 0) / 1000)


def ending_of(step: Json) -> Ending:
    go_away = None
    if (said := step.get("go_away")) is not None:
        reason = service_pb2.GoAwayReason.Value(f"GO_AWAY_REASON_{said['reason']}")
        go_away = service_pb2.GoAway(reason=reason, reconnect_after_ms=said["reconnect_after_ms"])
    error = error_of(step.get("ended", {"code": "ok"}))
    return Ending(error, go_away, step.get("stood_ms", 0) / 1000, step.get("away_ms", 0) / 1000)


def named(cases: list[Json]) -> list[Any]:
    return [pytest.param(case, id=case.get("name", str(number))) for number, case in enumerate(cases)]


@pytest.mark.parametrize("chance", [0, 1])
@pytest.mark.parametrize("case", named(TABLE["ends"]))
def test_after_a_stream(case: Json, chance: int) -> None:
    rules = RecoveryRules(case["has_copy"], case["reconnect_for_ms"] / 1000, lambda: chance)
    for step in case["steps"]:
        if step.get("fitted"):
            rules.frame_fitted()
        if step.get("begin"):
            rules.begin()
        if "failed_making" in step:
            failed = error_of(step["failed_making"])
            assert failed is not None
            recovery = rules.after_failed_making(failed)
        else:
            recovery = rules.after(ending_of(step))
        assert recovery.next is Next[step["next"].upper()]
        assert (recovery.why.code.value, recovery.why.reason) == (step["code"], step["reason"])
        assert recovery.pause * 1000 == pytest.approx(step["pause_ms"][chance])


@pytest.mark.parametrize("case", named(TABLE["answers"]))
def test_after_an_answer(case: Json) -> None:
    error = error_of(case["error"])
    assert error is not None
    assert answer_of(error, case.get("is_second", False)) is Answer[case["outcome"].upper()]


def change_of(said: str) -> Change:
    kind, *place = said.split()
    if kind == "remove":
        return lpdeform.Removal()
    motion = lpdeform.RigidMotion(translation=(float(place[0]), 0, 0))
    return motion if kind == "move" else lpdeform.Handle([0], motion)


def said_of(change: Change) -> str:
    if isinstance(change, lpdeform.Removal):
        return "remove"
    motion = change.motion if isinstance(change, lpdeform.Handle) else change
    assert isinstance(motion, lpdeform.RigidMotion)
    return f"{'set' if isinstance(change, lpdeform.Handle) else 'move'} {motion.translation[0]:g}"


class Replay:
    """A ledger, and the updates that it has sent."""

    def __init__(self, is_bare: bool) -> None:
        self.ledger = Ledger(begins_bare=is_bare)
        self.ledger.begin_epoch(1)

    def send(self, step: Json) -> NumberedUpdate:
        sent = self.ledger.send_next()
        assert sent.seq == step["seq"]
        return sent

    def do(self, step: Json) -> None:
        ledger, what = self.ledger, step["do"]
        if what == "add":
            ledger.add(Update({name: change_of(said) for name, said in step["handles"].items()}))
        elif what == "send":
            sent = self.send(step).update.handles
            assert {name: said_of(change) for name, change in sent.items()} == step["handles"]
        elif what == "accept":
            ledger.accept(step["seq"], step["kept"])
        elif what == "show":
            ledger.show(step.get("epoch", 1), step["seq"])
        elif what == "refuse":
            ledger.refuse(step["seq"])
        elif what == "reopened":
            ledger.reopened(step["epoch"], step["input_seq"])
        elif what == "nothing_waits":
            assert not ledger.has_waiting
        elif what == "newest":
            assert ledger.newest == step["newest"]
        elif what == "count_from":
            ledger.count_from(step["input_seq"])
        elif what == "remove_many":
            ledger.add(Update({f"{step['prefix']}{k}": lpdeform.Removal() for k in range(step["count"])}))
        elif what == "send_many":
            self.send(step)
        elif what == "sends":
            kinds = [said_of(change).split()[0] for change in self.send(step).update.handles.values()]
            found = {"sets": kinds.count("set"), "moves": kinds.count("move"), "removals": kinds.count("remove")}
            assert found == {kind: step.get(kind, 0) for kind in found}
        else:
            {"connection_lost": ledger.connection_lost, "session_lost": ledger.session_lost,
             "drop_unaccepted": ledger.drop_unaccepted}[what]()  # fmt: skip


@pytest.mark.parametrize("case", named(TABLE["ledger"]))
def test_the_book_of_updates(case: Json) -> None:
    replay = Replay(case["is_bare"])
    for step in case["steps"]:
        replay.do(step)
