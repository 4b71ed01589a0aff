"""Which notices a hub has seen: repeats, and copies that come over other ways, are not new."""

from collections import OrderedDict
from typing import Final

from sa_hub.radio.content import Notice
from sa_hub.radio.outbox import Key, key_of

_REMEMBERED: Final = 512


class Seen:
    """Remembers the newest."""

    def __init__(self) -> None:
        self._keys: OrderedDict[Key, None] = OrderedDict()

    def is_new(self, notice: Notice) -> bool:
        """Whether this event was not seen before; from now on it was."""
        key = key_of(notice)
        if key in self._keys:
            return False
        self._keys[key] = None
        if len(self._keys) > _REMEMBERED:
            self._keys.popitem(last=False)
        return True
