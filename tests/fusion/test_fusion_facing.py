"""Where the body faces: learned from steps ahead, kept while standing and turning, not from steps aside."""

import math
from collections.abc import Callable, Sequence

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.messages import BodyStep, Direction, FootPose, FootStep, Message, Position
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedFoot,
    SimulatedWalk,
    envelope,
    in_time_order,
    straight,
)

CONFIG = FusionConfig(gnss_sources=(), start=EAST)
WALK_S, STAND_S = 30.0, 6.0
WALK = SimulatedWalk(straight(0.0), WALK_S, STAND_S)


def boots(
    foot: SimulatedFoot, change: Callable[[FootStep], FootStep], walk: SimulatedWalk = WALK
) -> list[Envelope]:
    """A boot's messages with its steps changed."""

    def changed(message: Message) -> Message:
        if isinstance(message, FootPose) and math.hypot(*message.displacement_m) < 0.01:
            return msgspec.structs.replace(message, in_stance=True)
        return change(message) if isinstance(message, FootStep) else message

    messages = walk.messages(foot)
    return [Envelope(one.address, changed(one.message)) for one in messages]


def led(direction: Direction | None) -> Callable[[FootStep], FootStep]:
    """Steps that lead there."""

    def change(step: FootStep) -> FootStep:
        return msgspec.structs.replace(step, direction=direction if step.motion == "walking" else None)

    return change


def turned_on_the_spot(step: FootStep) -> FootStep:
    """Ahead, and in the third to fifth half second of standing a right angle to the left."""
    since_s = (step.time_ns - T0) / NS - WALK_S
    turn = math.pi / 6 if 1.0 < since_s <= 2.5 and step.motion == "standing" else 0.0
    return msgspec.structs.replace(led("forward")(step), heading_change_rad=step.heading_change_rad + turn)


def run(*streams: Sequence[Envelope]) -> list[Position]:
    core = FusionCore(CONFIG, WHO, ORIGIN, patient=True)
    out = [m for item in in_time_order(*map(list, streams)) for m in core.handle(item)]
    return [item.message for item in [*out, *core.close()] if isinstance(item.message, Position)]


def at(positions: Sequence[Position], time_s: float) -> Position:
    return next(one for one in positions if one.time_ns - T0 >= round(time_s * NS))


def away_deg(position: Position, azimuth_deg: float) -> float:
    assert position.facing_rad is not None
    return abs(math.remainder(math.degrees(position.facing_rad) - azimuth_deg, 360.0))


def test_who_walked_east_and_stands_faces_east_however_the_sensors_sit() -> None:
    out = run(*(boots(foot, led("forward")) for foot in (LEFT, RIGHT)))
    standing = [one for one in out if one.time_ns - T0 > round((WALK_S + 1.0) * NS)]
    assert standing
    assert max(away_deg(one, 90.0) for one in standing) < 3.0
    assert all(0.2 <= (one.facing_sigma_rad or 0.0) < 0.35 for one in standing)


def test_a_turn_on_the_spot_is_followed() -> None:
    out = run(*(boots(foot, turned_on_the_spot) for foot in (LEFT, RIGHT)))
    assert away_deg(at(out, WALK_S + 0.6), 90.0) < 3.0
    assert away_deg(out[-1], 0.0) < 3.0


@pytest.mark.parametrize("direction", [None, "backward", "left"])
def test_steps_that_do_not_lead_ahead_teach_nothing(direction: Direction | None) -> None:
    out = run(*(boots(foot, led(direction)) for foot in (LEFT, RIGHT)))
    assert {one.facing_rad for one in out} == {None}


def test_a_foot_in_the_air_does_not_say_where_the_body_faces() -> None:
    """One boot: known in stance, unknown in its swings."""
    core = FusionCore(msgspec.structs.replace(CONFIG, feet=("left_foot",)), WHO, ORIGIN, patient=True)
    out = [m for item in boots(LEFT, led("forward")) for m in core.handle(item)]
    told = [one.message for one in out if isinstance(one.message, Position)]
    walking = [one for one in told if 10.0 < (one.time_ns - T0) / NS < 20.0]
    known = [one for one in walking if one.facing_rad is not None]
    assert 0.2 * len(walking) < len(known) < 0.8 * len(walking)
    assert max(away_deg(one, 90.0) for one in known) < 3.0


@pytest.mark.parametrize(("direction", "faced_deg"), [("forward", 90.0), ("left", 180.0), ("right", 0.0)])
def test_without_boots_the_body_faces_as_its_unit_says(direction: Direction, faced_deg: float) -> None:
    steps = [
        envelope(
            "body_step",
            "body",
            BodyStep(
                time_ns=T0 + round(end_s * NS),
                sequence=number,
                start_time_ns=T0 + round((end_s - 0.6) * NS),
                length_m=0.8,
                length_sigma_m=0.05,
                azimuth_rad=math.pi / 2,
                azimuth_sigma_rad=0.1,
                motion="walking",
                direction=direction,
            ),
        )
        for number, end_s in enumerate(np.arange(0.6, 20.0, 0.6))
    ]
    end = run(steps)[-1]
    assert end.mode == "body"
    assert away_deg(end, faced_deg) < 0.1
    assert end.facing_sigma_rad == pytest.approx(
        math.hypot(0.1, 0.2, 0.2)
    )  # stated, the unit's seat, the trunk
