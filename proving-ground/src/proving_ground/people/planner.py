"""Plans an itinerary: every leg becomes strides of both feet and knots of the torso."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from bootprint.errors import ConfigError
from proving_ground.people.foot import StrideRecord
from proving_ground.people.footfalls import TURN_PER_STEP_RAD, Steps, facing, places, step_arcs, step_times
from proving_ground.people.gaits import (
    LIFT_RAMP_S,
    LIFT_SPEED_M_S,
    LOW,
    POSTURES,
    TRANSITION_S,
    TURN_S,
    UPRIGHT,
    Pace,
    Posture,
    ShapeName,
    TorsoHabit,
    pace_of,
    torso_habit,
)
from proving_ground.people.legs import Activity, FloatArray, GaitName, Itinerary, Leg
from proving_ground.people.person import Person
from proving_ground.people.route import Route
from proving_ground.people.torso import TorsoKnot

LEFT, RIGHT = 1, -1
_GAP_AT_MOST_M = 0.5
_CRAWL_CLEARANCE_M, _SHUFFLE_CLEARANCE_M = 0.04, 0.05
_FLAT_M = 0.08  # a stride on stairs that rises by less is on a landing
_SAME_S = 1e-6
_CRAWL_SWING = 0.5  # of a step's time that a foot rests at both ends of its swing, on all fours


def leg_duration_s(person: Person, leg: Leg) -> float:
    """How long a leg takes this person, exactly."""
    if leg.travels:
        pace = pace_of(person, leg)
        steps = (len(step_arcs(leg, pace)) + 1) * pace.period_s
        return float(steps + 2.0 * _transition_s(leg))
    if leg.gait == "lift" and leg.duration_s is None:
        way_m = float(np.linalg.norm(leg.points_m[1] - leg.points_m[0]))
        return way_m / LIFT_SPEED_M_S + LIFT_RAMP_S
    return leg.duration_s or TURN_S


def _transition_s(leg: Leg) -> float:
    """To go down and, as long again, to rise."""
    if leg.gait not in LOW:
        return 0.0
    return TRANSITION_S if leg.duration_s is None or leg.travels else min(TRANSITION_S, leg.duration_s / 3.0)


@dataclass(frozen=True)
class Curve:
    """By which curve a foot goes: see `StrideRecord`."""

    shape: ShapeName | None = None
    backward: bool = False
    strike_m_s2: float = 0.0
    clearance_m: float = 0.0
    ramp_share: float = 0.0


@dataclass
class _Foot:
    """Where a foot stands."""

    place_m: FloatArray
    yaw_rad: float
    pitch_rad: float = 0.0
    strides: list[StrideRecord] = field(default_factory=list)

    def go(
        self,
        span_s: tuple[float, float],
        place_m: FloatArray,
        yaw_rad: float,
        pitch_rad: float,
        curve: Curve,
    ) -> None:
        """One displacement, from where the foot stands."""
        self.strides.append(
            StrideRecord(
                *span_s,
                self.place_m,
                place_m,
                self.yaw_rad,
                yaw_rad,
                self.pitch_rad,
                pitch_rad,
                curve.shape,
                curve.backward,
                curve.strike_m_s2,
                curve.clearance_m,
                curve.ramp_share,
            )
        )
        self.place_m, self.yaw_rad, self.pitch_rad = place_m, yaw_rad, pitch_rad


class Planner:
    """Goes through an itinerary leg by leg; ``feet``, ``knots`` and ``activities`` are what came of it."""

    def __init__(self, person: Person, itinerary: Itinerary, rng: np.random.Generator) -> None:
        self.person, self._rng = person, rng
        self.time_s = itinerary.start_s
        self._centre = itinerary.legs[0].points_m[0].copy()
        self._yaw, self._phase = itinerary.start_yaw_rad, 0
        self.feet = {side: _Foot(*self._beside(side)) for side in (LEFT, RIGHT)}
        self.activities: list[Activity] = []
        self.knots = [self._knot(-1.0, UPRIGHT)]
        if self.time_s > 0.0:
            self.activities.append(Activity(0.0, self.time_s, "stand"))
        for index, leg in enumerate(itinerary.legs):
            self._follow(index, leg)
        self._add(self._knot(self.time_s + 1.0, UPRIGHT))

    def _beside(self, side: int) -> tuple[FloatArray, float]:
        """Where a foot stands when the person stands."""
        aside = 0.5 * side * self.person.step_width_m
        across = np.array([-np.sin(self._yaw), np.cos(self._yaw), 0.0])
        return self._centre + aside * across, self._yaw + side * self.person.toe_out_rad

    def _follow(self, index: int, leg: Leg) -> None:
        apart = float(np.linalg.norm(leg.points_m[0] - self._centre))
        if apart > _GAP_AT_MOST_M:
            raise ConfigError(
                f"leg {index + 1} ({leg.gait}) starts {apart:.1f} m from where the leg before ended: "
                "its first point must be that place"
            )
        start_s = self.time_s
        self._rest()
        if leg.travels:
            self._travel(leg)
        elif leg.gait == "turn":
            self._turn(leg)
        elif leg.gait == "lift":
            self._ride(leg)
        else:
            self._hold(leg)
        self.time_s = start_s + leg_duration_s(self.person, leg)
        self._rest()
        self.activities.append(Activity(start_s, self.time_s, leg.gait))

    def _knot(self, time_s: float, posture: Posture) -> TorsoKnot:
        """The torso at rest, here and now."""
        leg_m = self.person.leg_length_m
        return TorsoKnot(
            time_s,
            float(self._centre[0]),
            float(self._centre[1]),
            float(self._centre[2]),
            self._yaw,
            float(self._phase),
            posture.height_share * self.person.belt_height_m,
            posture.lean_rad,
            posture.ahead_share * leg_m,
        )

    def _rest(self) -> None:
        self._add(self._knot(self.time_s, UPRIGHT))

    def _add(self, knot: TorsoKnot) -> None:
        """A knot, unless there is one at this time."""
        if knot.time_s > self.knots[-1].time_s + _SAME_S:
            self.knots.append(knot)

    def _hold(self, leg: Leg) -> None:
        """Stand; or kneel or lie down, stay, and rise again."""
        if leg.gait not in LOW:
            return
        duration_s, change_s = leg_duration_s(self.person, leg), _transition_s(leg)
        self._go_down(leg.gait, self.time_s, change_s)
        self._rise(leg.gait, self.time_s + duration_s - change_s, change_s)

    def _go_down(self, gait: GaitName, start_s: float, change_s: float) -> None:
        posture = POSTURES[gait]
        ahead = np.array([np.cos(self._yaw), np.sin(self._yaw), 0.0])
        for side, pitch in ((LEFT, posture.left_pitch_rad), (RIGHT, posture.right_pitch_rad)):
            back_m = posture.right_back_share * self.person.leg_length_m if side == RIGHT else 0.0
            if pitch > 0.0:
                foot = self.feet[side]
                place = foot.place_m - back_m * ahead
                self._shuffle(foot, start_s, start_s + change_s, place, pitch)
        self._add(self._knot(start_s + change_s, posture))

    def _rise(self, gait: GaitName, start_s: float, change_s: float) -> None:
        self._add(self._knot(start_s, POSTURES[gait]))
        for side, foot in self.feet.items():
            if foot.pitch_rad > 0.0:
                self._shuffle(foot, start_s, start_s + change_s, self._beside(side)[0], 0.0)

    @staticmethod
    def _shuffle(foot: _Foot, start_s: float, end_s: float, place_m: FloatArray, pitch_rad: float) -> None:
        curve = Curve(clearance_m=_SHUFFLE_CLEARANCE_M)
        foot.go((start_s, end_s), place_m, foot.yaw_rad, pitch_rad, curve)

    def _ride(self, leg: Leg) -> None:
        """In a lift: feet and torso go with the cabin."""
        duration_s = leg_duration_s(self.person, leg)
        way = leg.points_m[1] - leg.points_m[0]
        ramp_s = min(LIFT_RAMP_S, duration_s / 3.0)
        for foot in self.feet.values():
            span_s = (self.time_s, self.time_s + duration_s)
            foot.go(span_s, foot.place_m + way, foot.yaw_rad, 0.0, Curve(ramp_share=ramp_s / duration_s))
        even = 0.5 * ramp_s / (duration_s - ramp_s)
        begin = self._centre
        speed = way / (duration_s - ramp_s)
        ride = (float(speed[0]), float(speed[1]), float(speed[2]))
        for share, at_s in ((even, ramp_s), (1.0 - even, duration_s - ramp_s)):
            self._centre = begin + share * way
            self._add(self._knot(self.time_s + at_s, UPRIGHT)._replace(ride_m_s=ride))
        self._centre = begin + way

    def _turn(self, leg: Leg) -> None:
        """About on the spot, in quick short steps."""
        assert leg.facing_rad is not None
        turn = (leg.facing_rad - self._yaw + np.pi) % (2.0 * np.pi) - np.pi
        pairs = max(1, int(np.ceil(abs(turn) / TURN_PER_STEP_RAD)))
        yaws = self._yaw + turn * np.repeat(np.arange(1, pairs + 1), 2) / pairs
        duration_s = leg_duration_s(self.person, leg)
        pace = Pace("walk", 0.1, duration_s / (2 * pairs + 1), 0.5)
        first = LEFT if turn >= 0.0 else RIGHT
        centre = np.tile(self._centre, (2 * pairs, 1))
        habit = TorsoHabit(bounce_m=0.006, sway_m=0.012, strike_m_s2=1.0)
        self._steps(centre, yaws, np.zeros(2 * pairs), pace, habit, UPRIGHT, first, self.time_s)

    def _travel(self, leg: Leg) -> None:
        pace, change_s = pace_of(self.person, leg), _transition_s(leg)
        route, arcs = Route(leg.points_m), step_arcs(leg, pace)
        start_s = self.time_s
        if change_s:
            self._go_down(leg.gait, start_s, change_s)
        yaws = facing(leg, pace, arcs, self._yaw)
        slope = np.zeros(len(arcs)) if leg.gait == "stairs" else route.slope_at(arcs)
        posture = POSTURES.get(leg.gait, UPRIGHT)
        habit = torso_habit(self.person, pace)
        first = {"side_step_left": LEFT, "side_step_right": RIGHT}.get(leg.gait)
        self._steps(route.at(arcs), yaws, slope, pace, habit, posture, first, start_s + change_s)
        if change_s:
            self._rise(leg.gait, start_s + leg_duration_s(self.person, leg) - change_s, change_s)

    def _steps(
        self,
        centre: FloatArray,
        yaws: FloatArray,
        slope: FloatArray,
        pace: Pace,
        habit: TorsoHabit,
        posture: Posture,
        first: int | None,
        start_s: float,
    ) -> None:
        """Steps of both feet in turn, the last beside the other foot, and the torso above them."""
        count = len(centre)
        own = LEFT if self._phase % 2 == 0 else RIGHT
        skip = 0 if first is None or first == own else 1
        sides = np.where((np.arange(count) + (own == RIGHT) + skip) % 2 == 0, LEFT, RIGHT).astype(np.float64)
        boundary_s = step_times(start_s, count, pace.period_s, int(sides[0]), self.person, self._rng)
        closing = (np.arange(count) >= count - (2 if pace.pairs else 1)).astype(np.float64)
        steps = Steps(centre, yaws, slope, boundary_s, closing)
        place, yaw = places(steps, sides, pace, self.person, self._rng)
        for k, side in enumerate(sides):
            self._step(self.feet[int(side)], steps, k, place[k], float(yaw[k]), pace)
        for knot in self._torso_steps(steps, pace, habit, posture, skip):
            self._add(knot)

    def _step(self, foot: _Foot, steps: Steps, k: int, place: FloatArray, yaw: float, pace: Pace) -> None:
        start_s, middle_s, end_s = steps.boundary_s[k : k + 3].tolist()
        strike = pace.strike * self.person.strike_m_s2
        if pace.shape is None:
            span_s = (
                middle_s - _CRAWL_SWING * (middle_s - start_s),
                middle_s + _CRAWL_SWING * (end_s - middle_s),
            )
            curve = Curve(strike_m_s2=strike, clearance_m=_CRAWL_CLEARANCE_M)
            foot.go(span_s, place, yaw, foot.pitch_rad, curve)
            return
        pitch = -float(np.arctan(steps.slope[k])) * (1.0 - float(steps.closing[k]))
        flat = abs(place[2] - foot.place_m[2]) < _FLAT_M
        shape: ShapeName = "walk" if flat and pace.shape.startswith("stairs") else pace.shape
        foot.go((start_s, end_s), place, yaw, pitch, Curve(shape, pace.backward, strike))

    def _torso_steps(
        self, steps: Steps, pace: Pace, habit: TorsoHabit, posture: Posture, skip: int
    ) -> Iterator[TorsoKnot]:
        """Knots at the boundaries: the torso is between where its feet are then."""
        centre = np.vstack([self._centre, self._centre, steps.centre_m])
        yaws = np.concatenate([[self._yaw] * 2, steps.yaw_rad])
        between = 0.25 * (centre[:-2] + 2.0 * centre[1:-1] + centre[2:])
        turned = 0.25 * (yaws[:-2] + 2.0 * yaws[1:-1] + yaws[2:])
        course = np.arctan2(*(centre[2:] - centre[:-2])[:, 1::-1].T) - turned
        surge_m = habit.surge_m_s * pace.period_s / (2.0 * np.pi)
        rest = self._knot(0.0, posture)._replace(step_s=pace.period_s)
        yield rest._replace(time_s=float(steps.boundary_s[0]))
        for k, (place, yaw) in enumerate(zip(between.tolist(), turned.tolist(), strict=True)):
            share = 0.5 if k in (0, len(between) - 1) else 1.0
            yield rest._replace(
                time_s=float(steps.boundary_s[k + 1]),
                east_m=place[0],
                north_m=place[1],
                up_m=place[2],
                yaw_rad=yaw + share * habit.turn_rad * float(np.sin(course[k])),
                phase=float(self._phase + skip + k + 1),
                bounce_m=share * habit.bounce_m,
                surge_forward_m=share * surge_m * float(np.cos(course[k])),
                surge_left_m=share * surge_m * float(np.sin(course[k])),
                sway_m=share * habit.sway_m,
                twist_rad=share * habit.twist_rad,
                strike_m_s2=share * habit.strike_m_s2,
                moving=True,
            )
        self._centre, self._yaw = centre[-1].copy(), float(yaws[-1])
        self._phase += len(between) + 1 + skip
        yield self._knot(float(steps.boundary_s[-1]), posture if pace.shape is None else UPRIGHT)
