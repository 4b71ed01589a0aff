"""Steps of the body-worn unit as a source: beside the boots to learn from them, in their place when these are mute.

A body step has a length and an azimuth. While boots walk, stretches of some metres by boots and by body are laid
beside each other: that tells the angle at which the unit sits and the person's step length, far better than a belt
knows them by itself. Without boots a receiver's Doppler tells the same (`fusion.lessons`). When no boot has spoken
for a moment, the body's steps since then carry the feet along, so that nothing jumps; satellites, floors and people
go on correcting the same state. While a camera tells the same way they do not count. A soldier without boots begins
where they are known to be, in the azimuth's own north.

Azimuth and length err alike from step to step. So the covariance that a walk of ``D`` adds is ``σ_l²·DDᵀ`` along
and ``σ_α²·D⊥D⊥ᵀ`` across, which grows with the way's square; each step adds what it makes that grow. Corrections
by satellites take the memory of the way with them within ``memory_s``.
"""

import math
from collections import Counter, deque

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import BodyStep, FootStep, GnssFix
from fusion.boots import Boots
from fusion.config import BodyConfig
from fusion.lessons import Lessons
from fusion.state import Array
from fusion.wearing import Wearing, by_itself, kind

_PENDING = 16  # steps that may have been made before silence was noticed
_QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # turns a vector to the left


class BodyTrack:
    """The body's steps of one soldier."""

    def __init__(self, config: BodyConfig, counters: Counter[str]) -> None:
        self._config = config
        self._silence_ns = round(config.silence_s * NS_PER_S)
        self._counters = counters
        self._wearing = Wearing(config)
        self._pending: deque[BodyStep] = deque(maxlen=_PENDING)
        self._carried: list[tuple[int, Array]] = []  # what was carried since a foot last spoke
        # Where boots were, what the body went since by steps of which kind.
        self._stretch: tuple[Array, Array, str] | None = None
        self._ways: dict[
            str, Array
        ] = {}  # by kind of step, since the last absolute place, as far as remembered
        self._lessons = Lessons()
        self._heard_ns: int | None = None
        self._last_sequence = -1

    # --- what comes in -----------------------------------------------------------------------------------------

    def step(self, boots: Boots, also: list[Boots], step: BodyStep) -> None:
        """A body step; moves ``boots`` and those ``also`` if no foot speaks."""
        if step.sequence <= self._last_sequence and step.time_ns <= (self._heard_ns or 0):
            self._counters["duplicate_steps"] += 1  # told again, perhaps by an engine that was restarted
            return
        self._last_sequence = step.sequence
        self._heard_ns = max(self._heard_ns or step.time_ns, step.time_ns)
        self._pending.append(step)
        self._wearing.meet(step)
        taught = list(self._lessons.step(step))
        if not boots.in_enu or boots.reference is None:
            return
        if self._boots_speak(boots, step.time_ns):
            self._learn(boots, step)
            return
        self._stretch = None
        for lesson in taught:
            self._wearing.hear(*lesson)
        if self._camera_speaks(boots, step.time_ns):
            self._pending.clear()  # it tells the same way
            return
        self._carry_pending(boots, also)

    def fix(self, source: str, fix: GnssFix) -> None:
        """A receiver that is believed has a solution."""
        self._lessons.fix(source, fix)

    def _boots_speak(self, boots: Boots, now_ns: int) -> bool:
        heard_ns = boots.feet_heard_ns
        return heard_ns is not None and now_ns - heard_ns <= self._silence_ns

    def _camera_speaks(self, boots: Boots, now_ns: int) -> bool:
        heard_ns = None if boots.stand_in is None else boots.stand_in.heard_ns
        return heard_ns is not None and now_ns - heard_ns <= self._silence_ns

    def _carry_pending(self, boots: Boots, also: list[Boots]) -> None:
        stand_in_ns = None if boots.stand_in is None else boots.stand_in.heard_ns
        since_ns = max(boots.feet_heard_ns or 0, stand_in_ns or 0)
        for step in self._pending:
            if step.time_ns > since_ns:
                by, spread = self._moved(step)
                for one in (boots, *also):
                    one.carry(by, spread, step.time_ns)
                self._carried.append((step.time_ns, by))
                self._counters["steps_by_body"] += 1
        self._pending.clear()

    def take_back(self, boots: Boots, also: list[Boots], step: FootStep) -> None:
        """A foot tells, late, of the time in which the body carried it: its own word counts, not both."""
        if step.realigned:
            return  # it does not know the way
        told = [by for time_ns, by in self._carried if step.start_time_ns < time_ns <= step.time_ns]
        self._carried = [one for one in self._carried if one[0] > step.time_ns]
        if told:
            self._counters["steps_by_body_taken_back"] += len(told)
            for one in (boots, *also):
                one.carry(-np.sum(told, axis=0), np.zeros((3, 3)))

    def corrected(self, since_last_s: float) -> None:
        """Satellites have told a place: the way before it is forgotten little by little."""
        kept = math.exp(-max(0.0, since_last_s) / self._config.memory_s)
        self._ways = {of_kind: kept * way for of_kind, way in self._ways.items()}

    def placed(self) -> None:
        """A person has told a place."""
        self._ways.clear()

    # --- a step as a move --------------------------------------------------------------------------------------

    def _moved(self, step: BodyStep) -> tuple[Array, Array]:
        """By how much it moves the body (3,) m, and the covariance (3, 3) that it adds."""
        flat, of_kind = self._wearing.way(step), kind(step)
        before = self._shared(step)
        self._ways[of_kind] = self._ways.get(of_kind, np.zeros(2)) + flat
        own = (self._config.own_sigma * step.length_m) ** 2
        spread = np.zeros((3, 3))
        spread[:2, :2] = _positive(self._shared(step) - before) + own * np.eye(2)
        spread[2, 2] = own
        return np.append(flat, 0.0), spread

    def _shared(self, step: BodyStep) -> Array:
        """Covariance (2, 2) of the way: azimuths err alike, and lengths of steps of a kind."""
        learned = self._wearing.turn_variance
        least = step.azimuth_sigma_rad**2 if learned is None else 0.0
        turn = max((learned or self._config.turn_sigma_rad**2) + self._config.azimuth_sigma_rad**2, least)
        across = _QUARTER @ sum(self._ways.values(), np.zeros(2))
        covariance: Array = turn * np.outer(across, across)
        for of_kind, way in self._ways.items():
            covariance = covariance + self._wearing.scale_variance(of_kind) * np.outer(way, way)
        return covariance

    # --- learning ----------------------------------------------------------------------------------------------

    def _learn(self, boots: Boots, step: BodyStep) -> None:
        """Compare a stretch by boots with the same by body, once it is long and straight, of steps of a kind."""
        here, of_kind = np.array(boots.track_point()[:2]), kind(step)
        if self._stretch is None or self._stretch[2] != of_kind:
            self._stretch = here, np.zeros(2), of_kind
            return
        begun, by_body = self._stretch[0], self._stretch[1] + by_itself(step)
        self._stretch = begun, by_body, of_kind
        by_boots = here - begun
        if float(np.hypot(*by_body)) < self._config.stretch_m:
            return
        self._stretch = None
        angle_rad = math.atan2(by_boots[1], by_boots[0]) - math.atan2(by_body[1], by_body[0])
        self._wearing.hear(of_kind, angle_rad, float(np.hypot(*by_boots) / np.hypot(*by_body)))

    # --- what is asked -----------------------------------------------------------------------------------------

    @property
    def turned(self) -> tuple[float, float]:
        """See `Wearing.turned`."""
        return self._wearing.turned

    def drives(self, boots: Boots, now_ns: int) -> bool:
        """Whether the position moves by the body's steps alone."""
        if self._heard_ns is None or boots.carried_ns is None:
            return False
        return (
            not self._boots_speak(boots, now_ns)
            and not self._camera_speaks(boots, now_ns)
            and now_ns - self._heard_ns <= self._config.fresh_s * NS_PER_S
        )


def _positive(matrix: Array) -> Array:
    """The nearest positive semidefinite matrix: a way back must not make anybody sure."""
    values, vectors = np.linalg.eigh(matrix)
    result: Array = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return result
