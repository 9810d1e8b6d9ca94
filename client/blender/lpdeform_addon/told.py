"""What the server was told of a mesh, and what it has refused. This module knows nothing of Blender."""


_unsure = object()
"""It is unknown what the server has."""


class Told:
    """Changes by their keys: names of handles, and of settings. Values are compared with ==; None is a removed handle.

    The server refuses an update as a whole and does not say which of several changes was at fault. So its changes are sent again
    one by one, each after the previous one is answered. A change that is refused alone waits until it is changed.
    """

    def __init__(self) -> None:
        self._told: dict = {}
        self._unanswered: dict = {}
        """The number of the update that carried each change."""
        self._refused: dict = {}
        self._is_careful = False

    def last(self, key):
        """What the server has for this key; None if it has nothing, or if that is unknown."""
        value = self._told.get(key)
        return None if value is _unsure else value

    @property
    def has_refusals(self) -> bool:
        return self._is_careful or bool(self._refused)

    def news(self, present: dict) -> list:
        """The keys of what must be sent now, out of everything present."""
        gone = {key: None for key, value in self._told.items() if value is not None and key not in present}
        keys = [key for key, value in {**present, **gone}.items() if self._is_new(key, value)]
        if not self._is_careful:
            return keys
        if self._unanswered:
            return []
        self._is_careful = bool(keys)
        return keys[:1]

    def _is_new(self, key, value) -> bool:
        return self._told.get(key) != value and not (key in self._refused and self._refused[key] == value)

    def tell(self, values: dict, number: int) -> None:
        """These values were sent, in the update with this number."""
        for key, value in values.items():
            self._refused.pop(key, None)
            self._unanswered[key] = number
            self._told[key] = value

    def answered(self, number: int) -> None:
        """A frame takes all updates up to this one into account."""
        self._unanswered = {key: seq for key, seq in self._unanswered.items() if seq > number}

    def refused(self) -> None:
        """An update was refused: one of those that are not answered."""
        if len(self._unanswered) == 1:
            (key,) = self._unanswered
            self._refused[key] = self._told[key]
        self._is_careful = True
        self._told.update(dict.fromkeys(self._unanswered, _unsure))
        self._unanswered = {}
