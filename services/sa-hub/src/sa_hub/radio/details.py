"""What changes seldom about a soldier, as it is told: only what has changed enough to matter is told again."""

from typing import Final

from sa_hub.radio import quantise as q
from sa_hub.radio.content import CONDITIONS, Facing, Level, Quality, Report
from sa_hub.radio.ground import turn_deg

DETAILS: Final = 3
"""Quality, level and facing: what is told only where it has changed."""
_ACCURACY_STEPS: Final = 2
_HEIGHT_STEP_M: Final = 3
_TURN_DEG: Final = 20.0


def quality_to_tell(report: Report, told: Report | None) -> Quality:
    """The codes to tell; an accuracy that has changed by a class only is told as before."""
    accuracy = q.accuracy_code(report.accuracy_m)
    if told is not None:
        before = q.accuracy_code(told.accuracy_m)
        accuracy = before if abs(accuracy - before) < _ACCURACY_STEPS else accuracy
    return Quality(accuracy, q.MODES.index(report.mode), report.hops, CONDITIONS.index(report.condition))


def level_to_tell(report: Report, told: Report | None) -> Level:
    """Floor and height to tell; a height that has changed by less than 3 m is told as before."""
    height_m = None if report.height_m is None else q.height_index(report.height_m)
    if told is not None and told.height_m is not None and height_m is not None:
        before = q.height_index(told.height_m)
        height_m = before if abs(height_m - before) < _HEIGHT_STEP_M else height_m
    floor = None if report.floor is None else q.floor_code(report.floor) + q.FLOOR_MIN
    return Level(floor, height_m)


def facing_to_tell(report: Report, told: Report | None) -> Facing:
    """The facing to tell; who has turned by less than 20° is told as before."""
    if report.facing_deg is None:
        return Facing(None)
    before = None if told is None else told.facing_deg
    if before is not None and abs(turn_deg(report.facing_deg - before)) < _TURN_DEG:
        return Facing(q.direction_code(before))
    return Facing(q.direction_code(report.facing_deg))


def details_code(report: Report, told: Report | None) -> tuple[int, int, int]:
    """One number each for the quality, the level and the facing to tell, equal where these are."""
    direction = facing_to_tell(report, told).direction
    return (
        _quality_code(quality_to_tell(report, told)),
        _level_code(level_to_tell(report, told)),
        -1 if direction is None else direction,
    )


def _quality_code(quality: Quality) -> int:
    return ((quality.accuracy * 8 + quality.mode) * 4 + quality.hops) * 4 + quality.condition


def _level_code(level: Level) -> int:
    floor = -1 if level.floor is None else q.floor_code(level.floor)
    height = -1 if level.height_m is None else level.height_m - q.HEIGHT_MIN_M
    return (floor + 1) * (2 << q.HEIGHT_BITS) + height + 1
