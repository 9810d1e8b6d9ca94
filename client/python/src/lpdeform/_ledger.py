"""The writer's record of updates."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import NamedTuple

from lpdeform.types import Change, Handle, Removal, Settings, Update

_resize_handle = "resize"


class NumberedUpdate(NamedTuple):
    """An update and its number, the input_seq for the server."""

    seq: int
    update: Update


def merged(older: Update, newer: Update) -> Update:
    """`older` and then `newer` as one update: the newest value of each handle and each setting wins.

    A motion for a handle that `older` adds moves the added handle.
    """
    handles = dict(older.handles)
    settings = older.settings
    resize = older.resize
    if _resize_handle in newer.handles:
        resize = None
    if newer.resize is not None:
        resize = newer.resize
        handles.pop(_resize_handle, None)
        settings = replace(settings, p=None, stiffness=None)
    for name, change in newer.handles.items():
        handles[name] = _changed(handles.get(name), change)
    given = {one.name: value for one in fields(Settings) if (value := getattr(newer.settings, one.name)) is not None}
    return Update(handles, replace(settings, **given), resize, older.begins_step or newer.begins_step)


def _changed(before: Change | None, change: Change) -> Change:
    if isinstance(before, Handle) and not isinstance(change, (Handle, Removal)):
        return replace(before, motion=change)
    return change


def _settled(state: Update) -> Update:
    """The state after all motions and removals have been carried out."""
    kept = {name: change for name, change in state.handles.items() if isinstance(change, Handle)}
    return replace(state, handles=kept, begins_step=False)


def _without_old_removals(update: Update) -> Update:
    """Limits how many removed handles are remembered. Motions stay: they may move handles that the session was created with."""
    if sum(isinstance(change, Removal) for change in update.handles.values()) <= Ledger.most_removals:
        return update
    kept = {name: change for name, change in update.handles.items() if not isinstance(change, Removal)}
    return replace(update, handles=kept)


class Ledger:
    """What the server has accepted, what is under way (at most `window` updates), and what waits, coalesced into one update.

    Its size is bounded by the handles and settings themselves. The accepted state is enough to recreate the session. Not
    thread-safe.
    """

    window = 4
    most_removals = 8192
    """How many removed handles are remembered. If there are more, all of them are forgotten."""

    def __init__(self, begins_bare: bool = True) -> None:
        """`begins_bare`: whether a recreated session has no handles but those recorded here; otherwise it also has those of
        its file."""
        self._begins_bare = begins_bare
        self._next_seq = 1
        self._epoch = 0
        self._newest_dropped = 0
        self._accepted = NumberedUpdate(0, Update())
        self._unkept = NumberedUpdate(0, Update())  # accepted since the server last stored something, as sent
        self._restore: NumberedUpdate | None = None
        self._in_flight: list[NumberedUpdate] = []
        self._waiting: NumberedUpdate | None = None

    def add(self, update: Update) -> int:
        """Accepts an update and returns its number."""
        seq = self._next_seq
        self._next_seq += 1
        self._waiting = NumberedUpdate(seq, merged(self._waiting.update if self._waiting else Update(), update))
        return seq

    @property
    def has_waiting(self) -> bool:
        return self._restore is not None or self._waiting is not None

    @property
    def can_send(self) -> bool:
        return self.has_waiting and len(self._in_flight) < self.window

    @property
    def has_restore(self) -> bool:
        """Whether send_next() will return the state of a lost session."""
        return self._restore is not None

    @property
    def has_in_flight(self) -> bool:
        return bool(self._in_flight)

    def send_next(self) -> NumberedUpdate:
        """The next update to send, which is now under way."""
        if self._restore is not None:
            next_one, self._restore = self._restore, None
        elif self._waiting is not None:
            next_one, self._waiting = self._waiting, None
        else:
            raise AssertionError("nothing waits")
        self._in_flight.append(next_one)
        return next_one

    def accept(self, seq: int, is_kept: bool = False) -> None:
        """The server has accepted the update with this number. Unknown numbers are ignored.

        `is_kept`: this update and all accepted before it survive a restart of the server.
        """
        for sent in [one for one in self._in_flight if one.seq == seq]:
            self.accept_change(sent, is_kept)
            self._in_flight.remove(sent)
            return
        if is_kept and seq >= self._unkept.seq:  # shown before it was answered
            self._unkept = NumberedUpdate(0, Update())

    def show(self, epoch: int, seq: int) -> None:
        """A frame shows the update of this number.

        If it is of the present epoch, the update is ours, so the server has taken it, though its answer may still be on its
        way. Earlier updates without an answer may have been refused: then nothing changes until they are answered. A restore has
        the number of an update that was accepted before: no frame shows that it came.
        """
        if epoch == self._epoch and self._in_flight and self._in_flight[0].seq == seq > self._accepted.seq:
            self.accept(seq)

    def take_number(self) -> int:
        """A number for a change that the server computes itself; report it by accept_change()."""
        self._next_seq += 1
        return self._next_seq - 1

    def accept_change(self, change: NumberedUpdate, is_kept: bool) -> None:
        """Adds a change that the server has accepted."""
        if not is_kept:
            unkept = _without_old_removals(merged(self._unkept.update, change.update))
            self._unkept = NumberedUpdate(max(self._unkept.seq, change.seq), unkept)
        elif change.seq >= self._unkept.seq:
            self._unkept = NumberedUpdate(0, Update())
        state = merged(self._accepted.update, change.update)
        state = _settled(state) if self._begins_bare else _without_old_removals(state)
        self._accepted = NumberedUpdate(max(self._accepted.seq, change.seq), state)

    def resumed_at(self, seq: int) -> None:
        """The session continues, and its newest update is `seq`.

        Updates that the server accepted after that and did not store are sent first, by themselves.
        """
        if seq < self._unkept.seq and self._restore is None:
            self._restore = NumberedUpdate(self._accepted.seq, self._unkept.update)

    def reopened(self, epoch: int, seq: int) -> None:
        """The same for a session that is now at `epoch`.

        A newer epoch means that another server has the session. Its newest update may have come by a single call, so earlier
        updates may be missing. Therefore everything that was not stored is sent again; values that the server has already do no
        harm.
        """
        is_another = epoch > self._epoch
        self._epoch = max(epoch, self._epoch)
        self.resumed_at(0 if is_another else seq)

    def begin_epoch(self, epoch: int) -> None:
        """The session was just created, joined or taken over."""
        self._epoch = epoch
        self._newest_dropped = 0

    @property
    def accepted_settings(self) -> Settings:
        return self._accepted.update.settings

    @property
    def newest_accepted(self) -> int:
        return self._accepted.seq

    def refuse(self, seq: int) -> None:
        """The server has refused the update with this number."""
        self._in_flight = [one for one in self._in_flight if one.seq != seq]

    def connection_lost(self) -> None:
        """Updates under way wait again. Sending them twice does no harm, because they have the same values."""
        again: NumberedUpdate | None = None
        for sent in self._in_flight:
            if sent.seq == self._accepted.seq:  # an unanswered restore stays separate
                self._restore = sent
            else:
                again = NumberedUpdate(sent.seq, merged(again.update, sent.update) if again else sent.update)
        self._in_flight = []
        if again is None:
            return
        if self._waiting is not None:
            again = NumberedUpdate(self._waiting.seq, merged(again.update, self._waiting.update))
        self._waiting = again

    def session_lost(self) -> None:
        """The server has lost the session: its accepted state is sent first, by itself."""
        self.connection_lost()
        if self._accepted.seq > 0:
            self._restore = self._accepted

    def drop_unaccepted(self) -> None:
        """Another writer took over: drops everything that the server has not accepted, and everything that it may have lost."""
        self._newest_dropped = self.newest
        self._restore = None
        self._unkept = NumberedUpdate(0, Update())
        self._in_flight = []
        self._waiting = None

    def count_from(self, seq: int) -> None:
        """Later numbers are higher than `seq`, the newest that the server knows."""
        if self._next_seq > seq:
            return
        self._next_seq = seq + 1
        if self._waiting is not None:
            self._waiting = NumberedUpdate(self._next_seq, self._waiting.update)
            self._next_seq += 1

    @property
    def newest(self) -> int:
        """The newest update that was not refused; 0 if there is none."""
        if self._waiting is not None:
            return self._waiting.seq
        return max([self._accepted.seq, *(one.seq for one in self._in_flight)])

    @property
    def newest_dropped(self) -> int:
        """What `newest` was before the last drop_unaccepted() of this epoch; 0 if there was none. Results of earlier updates
        answer none that was dropped."""
        return self._newest_dropped
