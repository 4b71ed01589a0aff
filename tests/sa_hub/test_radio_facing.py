"""Where a soldier faces: told of who stands, where bits are cheap, and forgotten when he goes."""

from dataclasses import replace

import pytest

from sa_hub.radio.content import Entry, Facing, Report, Reports, Update
from sa_hub.radio.frame import Codec
from sa_hub.radio.grid import Grid
from sa_hub.radio.references import resolved
from sa_hub.radio.room import Room
from sa_hub.radio.scheduler import Policy, Scheduler
from support.hub_squad import ORIGIN, START_NS, S
from support.radio_reports import METRE_DEG

GRID, CODEC = Grid(ORIGIN), Codec(ORIGIN)
FULL = Room(4000.0, 4000.0, 1200.0, 16000.0, 80.0)
HALF_EMPTY = Room(1500.0, 4000.0, 10.0, 1600.0, 80.0)


def at(seconds: float, facing_deg: float | None, north_m: float = 0.0, north_m_s: float = 0.0) -> Report:
    """Soldier 1, some metres north of the origin."""
    return Report(
        1,
        START_NS + round(seconds * S),
        ORIGIN.latitude_deg + north_m * METRE_DEG,
        ORIGIN.longitude_deg,
        1.0,
        north_m_s=north_m_s,
        facing_deg=facing_deg,
    )


class Told:
    """A scheduler whose frames are on the air at once; what receivers have of soldier 1."""

    def __init__(self, room: Room, waited_s: int) -> None:
        self.room, self.plan = room, Scheduler(Policy(), own=1, grid=GRID)
        self.sent_bits: list[int] = []
        for second in range(waited_s):  # the price of bits follows the bucket
            self.plan.pass_time(room, 1, START_NS - (waited_s - second) * S)

    def report(self, report: Report) -> Reports | Update | None:
        content = self.plan.plan([report], self.room, report.time_ns)
        if content is not None:
            payload = CODEC.encode(1, content, 3, 999)
            self.sent_bits.append(8 * len(payload))
            decoded = CODEC.decode(1, payload, report.time_ns).content
            self.plan.sent(len(self.sent_bits) - 1, decoded, report.time_ns)
        return content

    @property
    def facing_deg(self) -> float | None:
        return self.plan._history.told[0].facing_deg


def test_who_stands_is_told_with_his_facing_where_bits_are_cheap() -> None:
    told = Told(FULL, 600)
    told.report(at(0.0, 100.0))
    assert told.facing_deg == pytest.approx(90.0)  # the nearest 1/16 turn of 100°, 4.44 of them
    assert told.report(at(0.5, 105.0)) is None
    content = told.report(at(1.0, 200.0))
    assert isinstance(content, Update)
    assert content.entries[0].facing == Facing(9)
    assert told.facing_deg == pytest.approx(202.5)


def test_who_walks_is_not() -> None:
    told = Told(FULL, 600)
    told.report(at(0.0, 100.0, north_m_s=1.3))
    assert told.facing_deg is None


def test_where_bits_are_dear_it_costs_nothing() -> None:
    """The same frames, whether fusion knows the facing or not."""
    with_facing, without = Told(HALF_EMPTY, 1), Told(HALF_EMPTY, 1)
    for second in range(120):
        step = at(second, 3.0 * second, north_m=second // 20 * 20.0)
        plain = replace(step, facing_deg=None)
        with_facing.report(step)
        without.report(plain)
        assert with_facing.sent_bits == without.sent_bits
    assert len(without.sent_bits) > 3
    assert with_facing.facing_deg is None


@pytest.mark.parametrize(
    ("north_m", "velocity", "facing", "faces"),
    [
        (1.0, None, None, 90.0),
        (1.0, None, Facing(15), 337.5),
        (1.0, None, Facing(None), None),
        (1.0, (0, 4), None, None),
        (9.0, None, None, None),
    ],
)
def test_who_is_told_near_by_faces_as_before(
    north_m: float, velocity: tuple[int, int] | None, facing: Facing | None, faces: float | None
) -> None:
    place = at(1.0, None, north_m)
    row, column = GRID.row(place.latitude_deg, 0), GRID.column(place.longitude_deg, 0)
    tick = place.time_ns * 10 // S
    entry = Entry(1, row, column, velocity, facing=facing)
    report = resolved(GRID, at(0.0, 90.0), Update(tick, 0, 8, 0, (entry,)), entry, tick)
    assert report is not None
    assert report.facing_deg == faces
