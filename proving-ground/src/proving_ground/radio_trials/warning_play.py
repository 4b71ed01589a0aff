"""A squad with weapons on one radio net: who truly was in danger of whom, and who was warned of it.

The people walk as a library scenario has them; each weapon swings to a new direction every some seconds. What
everybody's hub is told of its own soldier is the truth; whatever is wrong in a warning came of the radio.
"""

import hashlib
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from bootprint.awareness import Aim, FriendlyWarning, Reason
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member, Origin, Realm
from bootprint.geodesy import LocalFrame, wrap_angle
from bootprint.messages import Message, Position
from bootprint.topics import SUBJECT_OF, Identity
from proving_ground.exercises.processes.emulated_radio import Air, NetProfile
from sa_hub.assembly import build_hub
from sa_hub.awareness.danger import BODY_M
from sa_hub.awareness.settings import WarningSettings
from sa_hub.hub import STEP_NS, HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
STEPS_PER_S: Final = 5
REASONS: Final[tuple[Reason, ...]] = ("near", "in_aim")
# Nothing becomes familiar, so that every time somebody comes near counts.
SETTINGS: Final = WarningSettings(facing=False, familiar_s=1e6, range_m=150.0)
_NET: Final = "squad"
_START_NS: Final = 1_790_000_000 * NS_PER_S
_ORIGIN: Final = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
_GROUP_KEY: Final = hashlib.sha256(b"warnings").digest()
_SIGMA_M: Final = 1.0
_AIM_SIGMA_RAD: Final = 0.03
_SWING_EVERY_S: Final = 8.0
_SWING_RAD_S: Final = 1.0


@dataclass(frozen=True)
class Radio:
    """One net for all: each hub may spend an equal part of its rate."""

    rate_bits_per_s: int
    loss: float = 0.0
    header_bytes: int = 0


@dataclass(frozen=True)
class Outcome:
    """By reason: who was in danger of whom, and who was warned of whom, (T, n, n): [step, us, friendly]."""

    true: dict[Reason, BoolArray]
    warned: dict[Reason, BoolArray]


def play_warnings(place_m: FloatArray, radio: Radio, seed: int) -> Outcome:
    """Play ways (n, T, 3) m, east, north, up, five samples a second."""
    count, steps, _ = place_m.shape
    azimuth_rad = swings(count, steps, seed)
    squad = _Squad(count, radio, seed)
    for step in range(steps):
        squad.step(step, place_m[:, step], azimuth_rad[:, step], _velocity(place_m, step))
    return Outcome(true_dangers(place_m, azimuth_rad), squad.warned(steps))


def swings(count: int, steps: int, seed: int) -> FloatArray:
    """Azimuths (n, T) of weapons that turn, at a radian a second, to a new direction every eight seconds or so."""
    rng = np.random.default_rng([seed, 1])
    azimuth = rng.uniform(-math.pi, math.pi, count)
    wanted = azimuth.copy()
    found = np.empty((count, steps))
    for step in range(steps):
        new = rng.random(count) < 1.0 / (_SWING_EVERY_S * STEPS_PER_S)
        wanted = np.where(new, rng.uniform(-math.pi, math.pi, count), wanted)
        left = np.array([wrap_angle(angle) for angle in wanted - azimuth])
        azimuth = azimuth + np.clip(left, -_SWING_RAD_S / STEPS_PER_S, _SWING_RAD_S / STEPS_PER_S)
        found[:, step] = azimuth
    return found


def true_dangers(place_m: FloatArray, azimuth_rad: FloatArray) -> dict[Reason, BoolArray]:
    """Who is in danger of whom, (T, n, n): within the distance, or in the corridor, and no man's height above."""
    offset = (place_m[None, :] - place_m[:, None]).transpose(2, 0, 1, 3)  # [step, us, friendly, axis]
    east, north, up = offset[..., 0], offset[..., 1], offset[..., 2]
    sine, cosine = np.sin(azimuth_rad.T)[..., None], np.cos(azimuth_rad.T)[..., None]
    along, across = east * sine + north * cosine, east * cosine - north * sine
    others = ~np.eye(len(place_m), dtype=bool) & (np.abs(up) <= BODY_M)
    line = (np.abs(across) <= SETTINGS.half_width_m) & (along > 0.0) & (along <= SETTINGS.range_m)
    return {"near": others & (np.hypot(east, north) <= SETTINGS.near_m), "in_aim": others & line}


def _velocity(place_m: FloatArray, step: int) -> FloatArray:
    """(n, 3) m/s over the last step."""
    return np.asarray((place_m[:, step] - place_m[:, max(0, step - 1)]) * STEPS_PER_S)


class _Squad:
    """The hubs and the air between them."""

    def __init__(self, count: int, radio: Radio, seed: int) -> None:
        members = tuple(Member(id=f"s{index}", number=index + 1, unit="squad") for index in range(count))
        self._realm = Realm(id="warnings", origin=_ORIGIN, roster=members)
        self._frame = LocalFrame(_ORIGIN)
        profile = NetProfile(_NET, radio.rate_bits_per_s, 0.05, radio.loss, radio.header_bytes, seed)
        self._air = Air(profile, [member.id for member in members], zero_s=0.0)
        self._hubs = {member.id: self._hub(member, radio, count) for member in members}
        self._told: dict[tuple[int, int], list[tuple[float, tuple[Reason, ...]]]] = {}

    def _hub(self, member: Member, radio: Radio, count: int) -> HubCore:
        link = LinkProfile(
            name=_NET, rate_bits_per_s=radio.rate_bits_per_s // count, header_bytes=radio.header_bytes
        )
        settings = HubSettings(links=(link,), warnings=SETTINGS)
        return build_hub(self._realm, member, settings, _GROUP_KEY, lambda _net: MemoryCounters())

    def step(self, step: int, place_m: FloatArray, azimuth_rad: FloatArray, velocity_m_s: FloatArray) -> None:
        """A fifth of a second: everybody's place and weapon, then two steps of the hubs."""
        now_ns = _START_NS + step * NS_PER_S // STEPS_PER_S
        for index, hub in enumerate(self._hubs.values()):
            place, velocity = place_m[index].tolist(), velocity_m_s[index].tolist()
            hub.handle(self._envelope(index, self._position(now_ns, place, velocity)))
            azimuth = float(azimuth_rad[index])
            aim = Aim(time_ns=now_ns, azimuth_rad=azimuth, azimuth_sigma_rad=_AIM_SIGMA_RAD)
            hub.handle(self._envelope(index, aim))
        for tick_ns in range(now_ns, now_ns + NS_PER_S // STEPS_PER_S, STEP_NS):
            self._tick(tick_ns)

    def _tick(self, now_ns: int) -> None:
        now_s = (now_ns - _START_NS) / NS_PER_S
        for delivery in self._air.arrived(now_s):
            self._hubs[delivery.member].receive(_NET, delivery.datagram, now_ns)
        for index, (name, hub) in enumerate(self._hubs.items()):
            self._keep(index, now_s, hub.tick(now_ns))
            for frame in hub.take_frames():
                self._air.transmit(name, frame.data, now_s)

    def _position(self, now_ns: int, place_m: list[float], velocity_m_s: list[float]) -> Position:
        latitude_deg, longitude_deg, height_m = self._frame.to_geodetic(*place_m)
        return Position(
            time_ns=now_ns,
            mode="boots",
            latitude_deg=latitude_deg,
            longitude_deg=longitude_deg,
            height_m=height_m,
            east_m=place_m[0],
            north_m=place_m[1],
            up_m=place_m[2],
            covariance_m2=(_SIGMA_M**2, 0.0, 0.0, _SIGMA_M**2, 0.0, _SIGMA_M**2),
            velocity_m_s=(velocity_m_s[0], velocity_m_s[1], velocity_m_s[2]),
        )

    def _envelope(self, index: int, message: Message) -> Envelope:
        identity = Identity(self._realm.id, "squad", f"s{index}")
        return Envelope(identity.address(SUBJECT_OF[type(message)], "truth"), message)

    def _keep(self, index: int, now_s: float, outputs: Iterable[Envelope]) -> None:
        for envelope in outputs:
            if isinstance(envelope.message, FriendlyWarning):
                friendly = int(envelope.message.friendly[1:])
                self._told.setdefault((index, friendly), []).append((now_s, envelope.message.reasons))

    def warned(self, steps: int) -> dict[Reason, BoolArray]:
        """By reason: of whom everybody was warned at each step, (T, n, n)."""
        count = len(self._hubs)
        found = {reason: np.zeros((steps, count, count), dtype=bool) for reason in REASONS}
        for (us, friendly), told in self._told.items():
            for (from_s, reasons), until_s in zip(told, self._ends(told), strict=True):
                span = slice(math.ceil(from_s * STEPS_PER_S), math.ceil(min(until_s * STEPS_PER_S, steps)))
                for reason in set(reasons).intersection(REASONS):
                    found[reason][span, us, friendly] = True
        return found

    def _ends(self, told: list[tuple[float, tuple[Reason, ...]]]) -> Iterator[float]:
        yield from (at_s for at_s, _ in told[1:])
        yield math.inf
