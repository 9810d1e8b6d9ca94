"""The judge of chaos.py: a good history passes, and one that violates an invariant fails for that invariant."""

import unittest

import history


def good():
    """A session through a takeover, a kill and a return, as it should be."""
    events = []

    def note(kind, **what):
        events.append({"kind": kind, "at": float(len(events)), **what})

    def frame(stream, epoch, seq, input_seq, is_final, x=None):
        probe = {} if x is None else {"probe": [[0, 0, 0], [0, 0, x]]}
        note("frame", stream=stream, session="s", epoch=epoch, frame_seq=seq, input_seq=input_seq, is_final=is_final, bytes=100,
             **probe)

    note("diagonal", length=1.0)
    note("memory", when="before", resident=50 << 20, sessions=0, streams=0, counted=0)
    note("writer", session="s", epoch=1, token="one")
    note("opening", stream="a", session="s")
    note("opened", stream="a", session="s", epoch=1, input_seq=0, credit=2, client="w")
    note("sent", session="s", input_seq=1, x=0.1, token="one")
    note("answered", session="s", input_seq=1, kept=True, token="one")
    frame("a", 1, 1, 1, False)
    frame("a", 1, 3, 1, True, 0.1)
    note("ack", stream="a", frame_seq=3)
    note("shown", client="l", session="s", epoch=1, frame_seq=3)
    note("writer", session="s", epoch=2, token="two")
    note("go_away", stream="a", reason="WRITER_REPLACED")
    note("end", stream="a", status="OK", by_client=False)
    note("sent", session="s", input_seq=2, x=0.2, token="one")
    note("refused", session="s", input_seq=2, reason="NOT_THE_WRITER", token="one")
    note("sent", session="s", input_seq=3, x=0.3, token="two")
    note("answered", session="s", input_seq=3, kept=True, token="two")
    note("fault", what="kill")
    note("opening", stream="b", session="s")
    note("opened", stream="b", session="s", epoch=3, input_seq=3, credit=1, client="w")
    frame("b", 3, 1, 3, True, 0.3)
    note("shown", client="l", session="s", epoch=3, frame_seq=1)
    note("ack", stream="b", frame_seq=1)
    note("end", stream="b", status="UNAVAILABLE", by_client=False)
    note("last", session="s", input_seq=3, since=0.0)
    note("reference", x=0.1, probe=[[0, 0, 0], [0, 0, 0.1]])
    note("reference", x=0.3, probe=[[0, 0, 0], [0, 0, 0.3]])
    note("memory", when="after", resident=60 << 20, sessions=0, streams=0, counted=0)
    return events


class Judge(unittest.TestCase):
    def judged(self, events):
        return history.check(history.History(events))

    def broken(self, invariant, change):
        """The history breaks this invariant, and no other, after the change."""
        events = good()
        change(events)
        found = self.judged(events)
        self.assertEqual({violation.invariant for violation in found}, {invariant}, found)

    @staticmethod
    def find(events, kind, /, **what):
        return next(event for event in events if event["kind"] == kind and all(event[key] == what[key] for key in what))

    def change(self, kind, what, /, **to):
        return lambda events: self.find(events, kind, **what).update(to)

    def drop(self, kind, /, **what):
        return lambda events: events.remove(self.find(events, kind, **what))

    def insert_after(self, kind, what, /, **event):
        def change(events):
            at = events.index(self.find(events, kind, **what))
            events.insert(at + 1, {"at": events[at]["at"] + 0.5, **event})
        return change

    def test_a_good_history_passes(self):
        self.assertEqual(self.judged(good()), [])

    def test_1_a_frame_number_that_does_not_rise(self):
        self.broken(1, self.change("frame", {"stream": "a", "frame_seq": 3}, frame_seq=1))

    def test_2_an_input_that_falls(self):
        self.broken(2, self.change("frame", {"stream": "a", "frame_seq": 1}, input_seq=2))

    def test_2_an_input_that_falls_on_another_stream_of_the_epoch(self):
        def change(events):
            of = {"stream": "c", "session": "s", "at": 20.0}
            events += [{"kind": "opened", "epoch": 1, "input_seq": 0, "credit": 1, "client": "w", **of},
                       {"kind": "frame", "epoch": 1, "frame_seq": 2, "input_seq": 0, "is_final": False, "bytes": 1, **of},
                       {"kind": "end", "status": "OK", "by_client": True, **of}]
        self.broken(2, change)

    def test_3_a_last_input_without_its_result(self):
        self.broken(3, self.change("last", {}, input_seq=4))

    def test_3_a_service_that_does_not_come_back(self):
        self.broken(3, lambda events: events.append({"kind": "broken", "at": 99.0, "text": "UNAVAILABLE"}))

    def test_3_a_result_that_came_before_it_was_asked_for(self):
        self.broken(3, self.change("last", {}, since=1e9))

    def test_4_more_frames_than_credit(self):
        self.broken(4, self.change("opened", {"stream": "a"}, credit=1))

    def test_5_more_bytes_than_credit_and_one_frame(self):
        def change(events):  # the parts of frames counted, but not the frames: so the credit seems to hold
            first = self.find(events, "frame", frame_seq=1, stream="a")
            at = events.index(first)
            for number in range(2):
                events.insert(at + 1 + number, {**first, "frame_seq": 1.25 + 0.25 * number})
            self.find(events, "opened", stream="a")["credit"] = 2
        events = good()
        change(events)
        self.assertEqual({violation.invariant for violation in self.judged(events)}, {4, 5})

    def test_6_a_stream_that_never_ends(self):
        self.broken(6, self.drop("end", stream="b"))

    def test_6_a_stream_that_ends_twice(self):
        self.broken(6, self.insert_after("end", {"stream": "b"}, kind="end", stream="b", status="OK", by_client=False))

    def test_6_a_stream_that_ends_without_a_reason(self):
        self.broken(6, self.drop("go_away", stream="a"))

    def test_6_two_reasons(self):
        self.broken(6, self.insert_after("go_away", {"stream": "a"}, kind="go_away", stream="a", reason="DRAINING"))
        self.broken(6, self.change("end", {"stream": "a"}, status="RESOURCE_EXHAUSTED"))

    def test_6_a_frame_after_the_reason(self):
        self.broken(6, self.insert_after("go_away", {"stream": "a"}, kind="frame", stream="a", session="s", epoch=1, frame_seq=4,
                                         input_seq=1, is_final=False, bytes=0))

    def test_7_a_kept_update_that_is_lost(self):
        self.broken(7, self.change("opened", {"stream": "b"}, input_seq=2))

    def test_7_a_result_for_other_handles(self):
        self.broken(7, self.change("frame", {"stream": "b"}, probe=[[0, 0, 0], [0, 0, 0.3002]]))

    def test_8_a_frame_of_an_old_epoch(self):
        self.broken(8, self.insert_after("shown", {"epoch": 3}, kind="shown", client="l", session="s", epoch=1, frame_seq=9))

    def test_8_a_stream_of_an_old_epoch_where_there_is_one_server(self):
        self.broken(8, self.change("opened", {"stream": "a"}, epoch=4))

    def test_7_a_server_that_lost_the_session_speaks_for_its_old_epoch_alone(self):
        def change(events):
            events.insert(0, {"kind": "run", "at": 0.0, "seed": 1, "mode": "redis", "seconds": 1})
            of = {"stream": "c", "session": "s"}
            events += [{"kind": "opening", "at": 90.0, **of},
                       {"kind": "opened", "at": 91.0, "epoch": 2, "input_seq": 1, "credit": 1, "client": "w", **of},
                       {"kind": "end", "at": 92.0, "status": "OK", "by_client": True, **of}]
        events = good()
        change(events)
        self.assertEqual(self.judged(events), [])
        self.find(events, "opened", stream="c")["epoch"] = 3
        self.assertEqual([violation.invariant for violation in self.judged(events)], [7])

    def test_9_two_writers_in_one_epoch(self):
        self.broken(9, self.insert_after("writer", {"epoch": 2}, kind="writer", session="s", epoch=2, token="three"))

    def test_9_an_update_of_a_writer_that_was_replaced(self):
        self.broken(9, self.change("refused", {"input_seq": 2}, kind="answered", kept=False))

    def test_9_a_server_that_lost_the_session_may_take_but_not_keep(self):
        def change(events):
            events.insert(0, {"kind": "run", "at": 0.0, "seed": 1, "mode": "redis", "seconds": 1})
            self.find(events, "refused", input_seq=2).update(kind="answered", kept=False)
        events = good()
        change(events)
        self.assertEqual(self.judged(events), [])
        self.find(events, "answered", input_seq=2)["kept"] = True
        self.assertEqual([violation.invariant for violation in self.judged(events)], [9])

    def test_10_memory_that_stays(self):
        for what in ("sessions", "streams", "counted"):
            self.broken(10, self.change("memory", {"when": "after"}, **{what: 1}))
        self.broken(10, self.change("memory", {"when": "after"}, resident=200 << 20))

    def test_histories_are_kept_as_they_are(self):
        import tempfile
        with tempfile.NamedTemporaryFile() as file:
            history.History(good()).save(file.name)
            self.assertEqual(history.History.load(file.name).events, good())


if __name__ == "__main__":
    unittest.main()
