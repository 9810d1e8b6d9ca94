from lpdeform import Fixed, Handle, Removal, Resize, RigidMotion, Settings, Update
from lpdeform._ledger import Ledger, NumberedUpdate, merged


def move(height: float) -> Update:
    return Update({"tip": RigidMotion(translation=(0, 0, height))})


def height(update: Update) -> float:
    change = update.handles["tip"]
    motion = change.motion if isinstance(change, Handle) else change
    assert isinstance(motion, RigidMotion)
    return float(motion.translation[2])


def test_the_newest_value_of_each_handle_and_setting_wins() -> None:
    older = Update({"a": Fixed(), "b": Handle([1])}, Settings(p=1.0, stiffness=2.0))
    newer = Update({"a": Removal()}, Settings(p=3.0))
    both = merged(older, newer)
    assert isinstance(both.handles["a"], Removal)
    assert isinstance(both.handles["b"], Handle)
    assert (both.settings.p, both.settings.stiffness) == (3.0, 2.0)


def test_a_motion_moves_the_handle_that_waits_to_be_added() -> None:
    both = merged(Update({"tip": Handle([7])}), move(2))
    tip = both.handles["tip"]
    assert isinstance(tip, Handle)
    assert (tip.vertices, height(both)) == ([7], 2)


def test_a_resizing_replaces_what_stands_in_its_way() -> None:
    before = Update({"resize": Handle([1])}, Settings(p=4.0, length_unit=1.0))
    both = merged(before, Update(resize=Resize((2, 1, 1))))
    assert "resize" not in both.handles
    assert (both.settings.p, both.settings.length_unit) == (None, 1.0)
    assert merged(both, Update({"resize": Removal()})).resize is None


def test_what_waits_is_one_update_however_many_were_made() -> None:
    ledger = Ledger()
    for k in range(1, 101):
        assert ledger.add(move(k)) == k
    sent = ledger.send_next()
    assert (sent.seq, height(sent.update), ledger.has_waiting) == (100, 100, False)


def test_at_most_a_window_is_under_way() -> None:
    ledger = Ledger()
    for k in range(1, 10):
        ledger.add(move(k))
        if ledger.can_send:
            ledger.send_next()
    assert not ledger.can_send
    ledger.accept(1)
    assert ledger.can_send


def test_a_lost_connection_makes_all_that_was_unanswered_wait_again() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Handle([7])}))
    ledger.send_next()
    ledger.add(move(1))
    ledger.send_next()
    ledger.add(move(2))
    ledger.connection_lost()
    again = ledger.send_next()
    assert again.seq == 3
    assert isinstance(again.update.handles["tip"], Handle)
    assert height(again.update) == 2


def test_a_lost_session_gets_what_was_accepted_first_and_alone() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Handle([7]), "gone": Handle([8])}, Settings(p=3.0)))
    ledger.accept(ledger.send_next().seq)
    ledger.add(Update({"gone": Removal()}))
    ledger.accept(ledger.send_next().seq)
    ledger.add(move(5))
    ledger.session_lost()
    assert ledger.has_restore
    restore = ledger.send_next()
    assert (restore.seq, list(restore.update.handles), restore.update.settings.p) == (2, ["tip"], 3.0)
    ledger.connection_lost()  # unanswered, it stays on its own
    assert ledger.send_next() == restore
    assert height(ledger.send_next().update) == 5


def test_what_was_refused_is_not_sent_again() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Handle([7])}))
    ledger.refuse(ledger.send_next().seq)
    ledger.session_lost()
    assert not ledger.has_waiting
    assert ledger.newest == 0


def test_numbers_go_on_above_what_the_server_knows() -> None:
    ledger = Ledger()
    ledger.add(move(1))
    ledger.count_from(40)
    assert ledger.send_next().seq == 41
    assert ledger.add(move(2)) == 42


def test_what_was_taken_and_not_kept_is_sent_again_where_the_server_went_back() -> None:
    ledger = Ledger()
    for k, is_kept in ((1, True), (2, False), (3, False)):
        ledger.add(Update({"tip": Handle([7])}) if k == 1 else Update({"old": Removal()}) if k == 2 else move(5))
        ledger.send_next()
        ledger.accept(k, is_kept)
    ledger.resumed_at(3)
    assert not ledger.has_waiting
    ledger.resumed_at(1)
    sent = ledger.send_next()
    assert sent.seq == 3
    assert isinstance(sent.update.handles["old"], Removal)
    assert height(sent.update) == 5
    ledger.accept(3, True)
    ledger.resumed_at(1)
    assert not ledger.has_waiting


def test_a_change_that_the_server_made_counts_as_accepted() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Handle([7])}, begins_step=True))
    sent = ledger.send_next()
    assert sent.update.begins_step
    ledger.accept(sent.seq)
    number = ledger.take_number()
    ledger.accept_change(NumberedUpdate(number, move(2)), False)
    assert ledger.newest == number == 2
    ledger.session_lost()
    restored = ledger.send_next()
    assert (restored.seq, height(restored.update), restored.update.begins_step) == (2, 2, False)
    assert ledger.add(move(3)) == 3


def test_a_step_that_begins_is_not_lost_among_what_waits() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Fixed()}, begins_step=True))
    ledger.add(move(1))
    assert ledger.send_next().update.begins_step


def test_what_was_not_kept_is_void_once_another_writer_took_over() -> None:
    ledger = Ledger()
    for k, is_kept in ((1, True), (2, False)):
        ledger.add(Update({"tip": Handle([7])}) if k == 1 else move(5))
        ledger.send_next()
        ledger.accept(k, is_kept)
    ledger.drop_unaccepted()
    ledger.resumed_at(1)
    assert not ledger.has_waiting


def test_an_update_that_is_dropped_is_answered_by_no_result_before_it_until_a_new_epoch() -> None:
    ledger = Ledger()
    ledger.add(Update({"tip": Handle([7])}))
    ledger.send_next()
    ledger.accept(1)
    ledger.add(move(5))
    ledger.drop_unaccepted()
    assert (ledger.newest, ledger.newest_dropped) == (1, 2)
    ledger.begin_epoch(2)
    assert ledger.newest_dropped == 0
