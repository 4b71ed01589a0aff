"""A soldier's hub on a real socket, in the test's own hands: its alerts go by radio to a real command post."""

import socket
from pathlib import Path

from bootprint.bus import Envelope
from bootprint.config import load_realm
from bootprint.messages import Alert
from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.assembly import build_hub
from sa_hub.keys import load_group_key
from sa_hub.radio.content import AlertNotice
from sa_hub.radio.control import COUNTED_BITS, Acknowledgement
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings
from support.hub_processes import A1
from support.hub_squad import link
from support.radio_ear import RadioEar

_NET = "net"
_LOOPBACK = "127.0.0.1"
_COUNTED = 1 << COUNTED_BITS


class RadioSoldier:
    """``acknowledged``: texts of the alerts that somebody has said to have. Realm and keys lie in ``folder``."""

    def __init__(self, folder: Path) -> None:
        self.acknowledged: list[str] = []
        self._radio = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._radio.bind((_LOOPBACK, 0))
        self._radio.setblocking(False)
        (self._post,) = free_ports(1, socket.SOCK_DGRAM)
        realm = load_realm(folder / "realm.toml")
        key = load_group_key(folder / "keys" / "group.key")
        settings = HubSettings(links=(link(_NET),))
        self._number = realm.member("a1").number
        self._core = build_hub(realm, realm.member("a1"), settings, key, lambda _net: MemoryCounters())
        self._ear = RadioEar(_NET, key, realm.origin)
        self._said: dict[int, str] = {}

    @property
    def way(self) -> str:
        """The command post's link to this one, for `write_computer`."""
        own = self._radio.getsockname()[1]
        return f'bind = "{_LOOPBACK}:{self._post}"\npeers = ["{_LOOPBACK}:{own}"]\nrate_bits_per_s = 9600'

    @property
    def frames_heard(self) -> int:
        """How many frames of the command post's have come."""
        return self._core.frames_heard(_NET)

    def alert(self, text: str, now_ns: int) -> None:
        """Alert everybody."""
        alert = Alert(time_ns=now_ns, soldier="a1", kind="help", text=text)
        self._core.handle(Envelope(A1.address("alert", "person"), alert))

    def step(self, now_ns: int) -> None:
        """It is ``now_ns``: say what is due, hear what has come."""
        self._core.tick(now_ns)
        for frame in self._core.take_frames():
            self._note_said(frame.data, now_ns)
            self._radio.sendto(frame.data, (_LOOPBACK, self._post))
        for data in self._arrived():
            self._core.receive(_NET, data, now_ns)
            self._note_heard(data, now_ns)

    def close(self) -> None:
        """Off the air."""
        self._radio.close()

    def _arrived(self) -> list[bytes]:
        found = []
        while True:
            try:
                found.append(self._radio.recv(2048))
            except OSError:  # nothing more; or nobody listens at the post
                return found

    def _note_said(self, frame: bytes, now_ns: int) -> None:
        """Under which bits of its counter an alert went out."""
        match self._ear.content(frame, now_ns):
            case opened, AlertNotice() as alert:
                self._said[opened.counter % _COUNTED] = alert.text

    def _note_heard(self, frame: bytes, now_ns: int) -> None:
        """Which alerts a frame acknowledges, each once."""
        match self._ear.content(frame, now_ns):
            case _, Acknowledgement() as answer:
                texts = [
                    self._said.get(counted) for sender, counted in answer.heard if sender == self._number
                ]
                self.acknowledged += [each for each in texts if each and each not in self.acknowledged]
