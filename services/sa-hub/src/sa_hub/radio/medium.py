"""What a frame costs on the air of a given radio: header bytes, key-up, whole slots, LoRa symbols, duty cycle.

Costs are whole bytes at the radio's rate, rounded up: a second of keyed transmitter costs ``rate / 8`` bytes, be it
payload, a preamble or the rest of a slot. So one token bucket of bits serves every kind of radio.
"""

import math
from fractions import Fraction
from functools import cache
from typing import Annotated, Final

from msgspec import Meta

from bootprint.config import Config
from sa_hub.radio.budget import depth_bits

DUTY_WINDOW_S: Final = 3600
"""Duty cycles are counted over any hour (ETSI EN 300 220-1, definition of duty cycle)."""


class Lora(Config, frozen=True):
    """A LoRa modem's settings; ``coding_rate`` is the denominator of 4/5 … 4/8."""

    spreading_factor: Annotated[int, Meta(ge=7, le=12)]
    bandwidth_hz: Annotated[int, Meta(ge=7_800, le=1_625_000)]
    coding_rate: Annotated[int, Meta(ge=5, le=8)]
    preamble_symbols: Annotated[int, Meta(ge=6, le=65_535)] = 8
    crc: bool = True
    explicit_header: bool = True

    @property
    def symbol_s(self) -> Fraction:
        """Length of a symbol, 2^SF / BW, s, exactly."""
        return Fraction(2**self.spreading_factor, self.bandwidth_hz)

    @property
    def low_data_rate(self) -> bool:
        """Whether symbols are so long (16 ms) that the low data rate optimisation is on."""
        return self.symbol_s >= Fraction(16, 1000)

    @property
    def rate_bits_per_s(self) -> int:
        """Bits of payload per second of symbols, preamble not counted, rounded down."""
        return int(self.spreading_factor * Fraction(4, self.coding_rate) / self.symbol_s)

    def airtime_s(self, frame_bytes: int) -> Fraction:
        """Time on air of a frame, s, exactly (Semtech AN1200.13, section 4; SX1276 data sheet, 4.1.1.7)."""
        bits = 8 * frame_bytes - 4 * self.spreading_factor + 28 + 16 * self.crc
        bits -= 0 if self.explicit_header else 20
        per_block = 4 * (self.spreading_factor - 2 * self.low_data_rate)
        payload_symbols = 8 + max(-(-bits // per_block) * self.coding_rate, 0)
        return (self.preamble_symbols + Fraction(17, 4) + payload_symbols) * self.symbol_s


class Medium(Config, frozen=True):
    """A radio as a sender pays for it; times in s of event time.

    ``key_up_s`` is paid before every frame, ``slot_s`` rounds a transmission up to whole slots (or interleaver
    blocks), ``duty_cycle`` is the share of any hour in which the transmitter may be keyed.
    """

    rate_bits_per_s: Annotated[int, Meta(ge=1)]
    header_bytes: Annotated[int, Meta(ge=0, le=200)]
    mtu_bytes: Annotated[int, Meta(ge=40, le=60_000)]
    latency_s: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0
    key_up_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    slot_s: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0
    duty_cycle: Annotated[float, Meta(gt=0.0, le=1.0)] = 1.0
    lora: Lora | None = None

    def air_bytes(self, frame_bytes: int) -> int:
        """What one frame costs on the air, all overhead included."""
        link_bytes = frame_bytes + self.header_bytes
        return link_bytes if self.is_plain else math.ceil(self._air_bits(link_bytes) / 8)

    def _air_bits(self, link_bytes: int) -> Fraction:
        if self.lora is not None:
            return self.lora.airtime_s(link_bytes) * self.rate_bits_per_s
        bits = 8 * link_bytes + _exact(self.key_up_s) * self.rate_bits_per_s
        if self.slot_s == 0.0:
            return bits
        slot_bits = _exact(self.slot_s) * self.rate_bits_per_s
        return math.ceil(bits / slot_bits) * slot_bits

    def airtime_s(self, frame_bytes: int) -> float:
        """How long a frame keeps the transmitter keyed, s."""
        return 8 * self.air_bytes(frame_bytes) / self.rate_bits_per_s

    @property
    def is_plain(self) -> bool:
        """Whether a frame costs its bytes and the header's only, whatever the rate."""
        return self.lora is None and self.key_up_s == 0.0 and self.slot_s == 0.0

    @property
    def sustained_bits_per_s(self) -> int:
        """What one sender may spend for ever: the rate, or so much that no hour exceeds the duty cycle.

        An hour may hold rate · 3600 s + depth of the bucket, so the depth's share is kept back.
        """
        if self.duty_cycle == 1.0:
            return self.rate_bits_per_s
        allowed = int(_exact(self.duty_cycle) * self.rate_bits_per_s * DUTY_WINDOW_S)
        return max(1, (allowed - depth_bits(math.ceil(allowed / DUTY_WINDOW_S))) // DUTY_WINDOW_S)


@cache
def _exact(value: float) -> Fraction:
    """A configured decimal as written: 0.6 is 3/5, not the nearest binary fraction."""
    return Fraction(str(value))
