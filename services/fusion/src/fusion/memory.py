"""What outlives the process: the estimate, saved every few seconds, so that a restart goes on where it was.

Only a placed walk is remembered; before that nothing is known that the configuration does not say. What has passed
between the saving and the restart is not guessed: the bus tells its newest steps again, each step is entered once
(`fusion.feet.StepLedger`), and what is still missing widens the covariance as any gap does.

A memory that is too old, of another soldier, of other feet or damaged is refused, and the reason is told. It is
refused too where the configuration names another start than it did: somebody has set the soldier anew.
"""

import math
from dataclasses import dataclass
from typing import Final

import msgspec
import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Config
from bootprint.messages import MotionClass
from bootprint.saved_state import Form, Kept
from fusion.config import FusionConfig, StartConfig
from fusion.estimator import Estimator
from fusion.feet import Foot
from fusion.state import Array, Layout

FILE = "fusion.state"
FORM: Final = Form("fusion", version=1, capacity=64 * 1024)
SAVE_EVERY_NS = 2 * NS_PER_S
_TOLD_AGAIN_NS = 600 * NS_PER_S  # no cache of the bus reaches further back
_SKEW = 1e-6  # relative: what rounding may leave of symmetry


class SavedFoot(Config, frozen=True):
    """One foot: what it needs to take its next step as that."""

    active: bool
    last_step: int | None
    end_ns: int | None
    heard_ns: int | None
    motion: MotionClass
    own: tuple[float, float, float, float]


class Saved(Config, frozen=True):
    """A placed walk at ``time_ns``: state (n,) and covariance (n·n,) of `fusion.state`, and the feet by place.

    ``next_ns`` and ``sequence`` are those of the next position; ``reference`` names the foot whose track counts.
    """

    soldier: str
    time_ns: int
    next_ns: int
    sequence: int
    began_ns: int
    reference: str
    start: StartConfig | None
    state: tuple[float, ...]
    covariance: tuple[float, ...]
    feet: dict[str, SavedFoot]


def understood(kept: Kept, soldier: str, config: FusionConfig) -> Saved:
    """The memory in a file of state; ValueError if it is no memory, or cannot be this soldier's."""
    try:
        saved = msgspec.msgpack.decode(kept.payload, type=Saved)
    except msgspec.MsgspecError as error:
        raise ValueError(f"no walk: {error}") from error
    if reason := objection(saved, soldier, config):
        raise ValueError(reason)
    return saved


def kept_of(saved: Saved | None) -> Kept | None:
    """A memory as a file of state keeps it."""
    return None if saved is None else Kept(saved.time_ns, msgspec.msgpack.encode(saved))


def objection(saved: Saved, soldier: str, config: FusionConfig) -> str | None:
    """Why a memory cannot be this soldier's; None if it can. Its age shows with the first message."""
    size = len(saved.state)
    expected = Layout.of(config.feet).size
    reasons = {
        f"of soldier {saved.soldier!r}": saved.soldier != soldier,
        f"of feet {', '.join(saved.feet)}": tuple(saved.feet) != config.feet
        or saved.reference not in saved.feet,
        "start has been configured anew": saved.start != config.start,
        "of another size": size != expected or len(saved.covariance) != size * size,
    }
    found = next((reason for reason, holds in reasons.items() if holds), None)
    return found or (None if _is_sound(saved) else "covariance is none")


def _is_sound(saved: Saved) -> bool:
    state, covariance = arrays(saved)
    if not (np.isfinite(state).all() and np.isfinite(covariance).all()):
        return False
    scale = float(np.abs(covariance).max())
    symmetric = bool(np.abs(covariance - covariance.T).max() <= _SKEW * scale)
    return symmetric and float(np.linalg.eigvalsh(covariance)[0]) >= -_SKEW * scale


def arrays(saved: Saved) -> tuple[Array, Array]:
    """State (n,) and covariance (n, n)."""
    state = np.array(saved.state, dtype=np.float64)
    return state, np.array(saved.covariance, dtype=np.float64).reshape(state.size, state.size)


def is_of_now(saved: Saved, time_ns: int, config: FusionConfig) -> bool:
    """Whether it is young enough for the first message heard, which may be an older step told again."""
    return -_TOLD_AGAIN_NS <= time_ns - saved.time_ns <= config.silence.remembered_s * NS_PER_S


def age_in_words(saved: Saved, time_ns: int) -> str:
    """For the reason of a refusal."""
    age_s = (time_ns - saved.time_ns) / NS_PER_S
    return f"{math.floor(abs(age_s))} s {'old' if age_s > 0.0 else 'ahead of the first message'}"


@dataclass(frozen=True, slots=True)
class Moment:
    """Where the core is: up to where messages have been taken in, and the next position."""

    time_ns: int
    next_ns: int
    sequence: int


def remember(estimator: Estimator, config: FusionConfig, soldier: str, moment: Moment) -> Saved | None:
    """What to save, of the feet; None while the soldier is not placed, or a camera alone has the walk."""
    boots = estimator.boots
    if not estimator.placed or boots.reference is None or boots.reference is boots.stand_in:
        return None
    feet = slice(0, boots.filter.layout.feet_size)
    return Saved(
        soldier=soldier,
        time_ns=moment.time_ns,
        next_ns=moment.next_ns,
        sequence=moment.sequence,
        began_ns=boots.began_ns,
        reference=boots.reference.place,
        start=config.start,
        state=tuple(boots.filter.state[feet].tolist()),
        covariance=tuple(boots.filter.covariance[feet, feet].ravel().tolist()),
        feet={place: _saved_foot(foot) for place, foot in boots.feet.items()},
    )


def _saved_foot(foot: Foot) -> SavedFoot:
    east, north, up, yaw = (float(value) for value in foot.own)
    return SavedFoot(
        active=foot.active,
        last_step=foot.ledger.last,
        end_ns=foot.end_ns,
        heard_ns=foot.heard_ns,
        motion=foot.motion,
        own=(east, north, up, yaw),
    )


def go_on(estimator: Estimator, saved: Saved) -> None:
    """Put the estimate where it was."""
    for place, one in saved.feet.items():
        foot = estimator.boots.feet[place]
        foot.active, foot.motion, foot.own = one.active, one.motion, np.array(one.own)
        foot.ledger.last, foot.end_ns, foot.heard_ns = one.last_step, one.end_ns, one.heard_ns
    state, covariance = arrays(saved)
    estimator.boots.go_on(state, covariance, saved.reference, saved.began_ns)
    estimator.go_on()
