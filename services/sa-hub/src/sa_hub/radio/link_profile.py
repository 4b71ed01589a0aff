"""A radio net's configuration: which way its frames go, what a frame costs there, and what this hub may spend.

``profile`` names a radio (`sa_hub.radio.profiles`) whose figures hold where the link gives none of its own. Every
kind of link has keys of its own; a key of another kind is refused.
"""

from bisect import bisect_right
from functools import cached_property
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from bootprint.config import Config
from bootprint.errors import ConfigError
from sa_hub.radio.budget import depth_bits
from sa_hub.radio.medium import Lora, Medium
from sa_hub.radio.profiles import named, names

Kind = Literal["udp", "serial", "zenoh", "file"]
SMALLEST_MTU_BYTES: Final = 40
SERIAL_FRAMING_BYTES: Final = 5
"""Two delimiters, the code byte of COBS, and a check sum of 16 bits."""
LONGEST_SERIAL_FRAME_BYTES: Final = 252
"""So that frame and check sum need one code byte only."""

_KEYS: Final[dict[str, tuple[str, ...]]] = {
    "udp": ("bind", "peers", "interface"),
    "serial": ("port", "baud", "guard_s"),
    "zenoh": ("router",),
    "file": ("path", "read_path"),
}
_NEEDED: Final = {"serial": "port", "zenoh": "router", "file": "path"}
_HEADER_BYTES: Final = {"udp": 28, "serial": 0, "zenoh": 84, "file": 0}
_MTU_BYTES: Final = 250
DEFAULT_BAUD: Final = 9600
_DATA_SHARE: Final = 0.8
"""Of a serial line's bits: start and stop bit carry nothing."""
_NOT_GIVEN: Final = -1
"""Stands in a key until the link's profile has filled it in."""


class LinkProfile(Config, frozen=True, dict=True):
    """One radio net. After construction every number is there: the link's own, its profile's, or its kind's.

    ``rate_bits_per_s``: what this hub may spend for ever; ``channel_bits_per_s``: the radio's rate while it sends.
    ``depth_bits``: of the bucket, at most DESIGN's formula. ``threshold_m``: the error that receivers'
    pictures are to stay below on this net; the hub's own if None. ``expected_loss``: the share of frames that a
    receiver misses, as long as none tells what it heard.
    """

    name: str
    kind: Kind = "udp"
    profile: str | None = None
    rate_bits_per_s: Annotated[int, Meta(gt=0)] = _NOT_GIVEN
    channel_bits_per_s: Annotated[int, Meta(gt=0)] = _NOT_GIVEN
    header_bytes: Annotated[int, Meta(ge=0, le=200)] = _NOT_GIVEN
    mtu_bytes: Annotated[int, Meta(ge=SMALLEST_MTU_BYTES, le=60_000)] = _NOT_GIVEN
    key_up_s: Annotated[float, Meta(ge=0.0, le=10.0)] = _NOT_GIVEN
    slot_s: Annotated[float, Meta(ge=0.0, le=60.0)] = _NOT_GIVEN
    duty_cycle: Annotated[float, Meta(gt=0.0, le=1.0)] = _NOT_GIVEN
    depth_bits: Annotated[int, Meta(gt=0)] = _NOT_GIVEN
    lora: Lora | None = None
    threshold_m: Annotated[float, Meta(gt=0.0)] | None = None
    expected_loss: Annotated[float, Meta(ge=0.0, le=0.8)] = 0.0
    # udp: host:port to listen at, to send to, and the interface of multicast
    bind: str | None = None
    peers: tuple[str, ...] = ()
    interface: str | None = None
    # serial: the modem's port; silence kept after hearing and after sending
    port: str | None = None
    baud: Annotated[int, Meta(ge=50, le=4_000_000)] | None = None
    guard_s: Annotated[float, Meta(ge=0.0, le=10.0)] | None = None
    # zenoh: endpoint of the router that all of the net share
    router: str | None = None
    # file: where frames are appended; frames appended there by others are heard
    path: str | None = None
    read_path: str | None = None

    def __post_init__(self) -> None:
        self._check_keys()
        for key, value in self._defaults().items():
            if getattr(self, key) in (_NOT_GIVEN, None):
                msgspec.structs.force_setattr(self, key, value)
        self._check_numbers()

    def _check_keys(self) -> None:
        """ValueError for keys of another kind, or without those that this kind needs."""
        for kind, keys in _KEYS.items():
            for key in keys:
                if kind != self.kind and getattr(self, key) not in (None, ()):
                    raise ValueError(
                        f'{key} belongs to kind = "{kind}"; '
                        f'this link is kind = "{self.kind}", which has {", ".join(_KEYS[self.kind])}'
                    )
        needed = _NEEDED.get(self.kind)
        if needed and getattr(self, needed) is None:
            raise ValueError(f'kind = "{self.kind}" lacks the key {needed!r}')

    def _defaults(self) -> dict[str, Any]:
        """The figures that hold where the link gives none."""
        medium = self._base()
        duty_cycle = medium.duty_cycle if self.duty_cycle == _NOT_GIVEN else self.duty_cycle
        channel = self.lora.rate_bits_per_s if self.lora else medium.rate_bits_per_s
        if self.channel_bits_per_s != _NOT_GIVEN:
            channel = self.channel_bits_per_s
        elif medium.is_plain and self.lora is None:
            channel = max(channel, self.rate_bits_per_s)
        paid = msgspec.structs.replace(medium, rate_bits_per_s=channel, duty_cycle=duty_cycle)
        rate = paid.sustained_bits_per_s if self.rate_bits_per_s == _NOT_GIVEN else self.rate_bits_per_s
        return {
            "rate_bits_per_s": rate,
            "channel_bits_per_s": channel,
            "header_bytes": medium.header_bytes,
            "mtu_bytes": medium.mtu_bytes,
            "key_up_s": medium.key_up_s,
            "slot_s": medium.slot_s,
            "duty_cycle": duty_cycle,
            "depth_bits": depth_bits(rate),
            "lora": medium.lora,
        }

    def _base(self) -> Medium:
        """The named radio; without one, a link of this kind whose channel is all this hub's."""
        if self.profile is not None:
            try:
                return named(self.profile)
            except ConfigError as error:
                raise ValueError(str(error)) from error
        rate = self.lora.rate_bits_per_s if self.lora else self.rate_bits_per_s
        if self.kind == "serial":
            rate = int(_DATA_SHARE * (self.baud or DEFAULT_BAUD))
        if rate == _NOT_GIVEN:
            raise ValueError(f"lacks the key 'rate_bits_per_s', or profile = one of {', '.join(names())}")
        return Medium(rate_bits_per_s=rate, header_bytes=_HEADER_BYTES[self.kind], mtu_bytes=_MTU_BYTES)

    def _check_numbers(self) -> None:
        """ValueError for numbers that are right alone and wrong together."""
        most = self.medium.sustained_bits_per_s
        if self.rate_bits_per_s > self.channel_bits_per_s:
            raise ValueError(
                f"rate_bits_per_s is {self.rate_bits_per_s}: the radio sends at {self.channel_bits_per_s}"
            )
        if self.duty_cycle < 1.0 and self.rate_bits_per_s > most:
            raise ValueError(
                f"rate_bits_per_s is {self.rate_bits_per_s}: a duty cycle of {100 * self.duty_cycle:g} % "
                f"of {self.channel_bits_per_s} bit/s leaves {most}"
            )
        if self.depth_bits > (most := depth_bits(self.rate_bits_per_s)):
            raise ValueError(f"depth_bits is {self.depth_bits}: want at most {most} at this rate_bits_per_s")
        if self.kind == "serial" and self.mtu_bytes > LONGEST_SERIAL_FRAME_BYTES:
            raise ValueError(
                f"mtu_bytes is {self.mtu_bytes}: want at most {LONGEST_SERIAL_FRAME_BYTES} on a serial link"
            )

    @cached_property
    def medium(self) -> Medium:
        """What one copy of a frame costs."""
        return Medium(
            rate_bits_per_s=self.channel_bits_per_s,
            header_bytes=self.header_bytes,
            mtu_bytes=self.mtu_bytes,
            key_up_s=self.key_up_s,
            slot_s=self.slot_s,
            duty_cycle=self.duty_cycle,
            lora=self.lora,
        )

    @property
    def pace_bits_per_s(self) -> int | None:
        """The rate at which a frame leaves before the next one is made; None if nothing is told of the radio."""
        told = self.profile is not None or self.lora is not None or self.kind == "serial"
        return self.channel_bits_per_s if told or self.channel_bits_per_s != self.rate_bits_per_s else None

    @property
    def copies(self) -> int:
        """How often each frame goes on the air: once for every peer."""
        return max(1, len(self.peers))

    def copy_bytes(self, frame_bytes: int) -> int:
        """What one copy of a frame costs on the air, the link's own framing included."""
        framing = SERIAL_FRAMING_BYTES if self.kind == "serial" else 0
        return self.medium.air_bytes(frame_bytes + framing)

    def air_bytes(self, frame_bytes: int) -> int:
        """What a frame costs on the air, to all peers, the link's headers included."""
        return self.copies * self.copy_bytes(frame_bytes)

    def longest_frame(self, bits: int) -> int:
        """The longest frame, bytes, that fits the MTU and costs no more than so many bits; 0 if none does."""
        sizes = range(self.mtu_bytes + 1)
        return max(0, bisect_right(sizes, bits, key=lambda size: 8 * self.air_bytes(size)) - 1)
