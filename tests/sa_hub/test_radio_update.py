"""Squad updates: bits come back, and a receiver finds the right place or none, whatever it has missed."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.config import Origin
from bootprint.prediction import moved_m
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import Entry, Facing, Feedback, Level, Quality, Report, Reports, Update
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.grid import Grid
from sa_hub.radio.history import allowed_cells
from sa_hub.radio.layout import LATTICES, MISSES
from sa_hub.radio.quantise import PACES
from sa_hub.radio.references import References, resolved
from sa_hub.radio.room import Room
from sa_hub.radio.scheduler import Policy, Scheduler

S = 1_000_000_000
TICK = S // 10
START_NS = 1_790_000_000 * S
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
SENDER = 5
METRES_PER_DEG = 111_133.0
FINEST_M = 180.0 / 2**26 * METRES_PER_DEG

qualities = st.none() | st.builds(
    Quality, st.integers(0, 7), st.integers(0, 6), st.integers(0, 3), st.integers(0, 3)
)
levels = st.none() | st.builds(Level, st.none() | st.integers(-32, 95), st.none() | st.integers(0, 255))
facings = st.none() | st.builds(Facing, st.none() | st.integers(0, 15))
speeds = st.integers(0, 15) | st.sampled_from(PACES)
feedbacks = st.none() | st.integers(1, 8).flatmap(
    lambda steps: st.builds(
        Feedback,
        st.integers(0, 1023),
        st.integers(0, 255),
        st.just(4 * steps),
        st.integers(0, 2 ** (4 * steps) - 1),
    )
)


@st.composite
def an_entry(draw: st.DrawFn, number: int, reach: int, *, varied: bool) -> Entry:
    """Any entry of a frame with this reach; where it varies, a bit less near by and two more far off."""
    far, steady = varied and draw(st.booleans()), varied and draw(st.booleans())
    cells = st.integers(0, 2 ** (reach + varied * (2 if far else -1)) - 1)
    velocities = st.none() if steady else st.none() | st.tuples(st.integers(0, 15), speeds)
    return Entry(
        number,
        draw(cells),
        draw(cells),
        draw(velocities),
        draw(st.sampled_from([0, 0, 41, 60])),
        draw(qualities),
        draw(levels),
        draw(facings),
        far,
        steady,
    )


@st.composite
def updates(draw: st.DrawFn) -> Update:
    """Any update that a frame can hold, its low bits only."""
    resolution, reach = draw(st.sampled_from(LATTICES))
    varied = draw(st.booleans())
    numbers = draw(st.lists(st.integers(0, 1023), min_size=1, max_size=64, unique=True))
    entries = tuple(draw(an_entry(number, reach, varied=varied)) for number in sorted(numbers))
    misses = draw(st.sampled_from(MISSES))
    return Update(draw(st.integers(0, 255)), resolution, reach, misses, entries, draw(feedbacks), varied)


@settings(deadline=None, max_examples=60)
@given(updates(), st.integers(0, 1023), st.booleans())
def test_updates_come_back(update: Update, sender: int, exercise: bool) -> None:
    codec = Codec(ORIGIN, exercise=exercise)
    frame = codec.decode(sender, codec.encode(sender, update, 0, 9999), START_NS)
    assert frame.exercise == exercise
    assert frame.content == update


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=60))
def test_any_bytes_are_an_update_or_a_frame_error(data: bytes) -> None:
    payload = bytes([0x50 | data[0] & 15]) + data[1:] if data else b"\x50"
    try:
        content = Codec(ORIGIN).decode(SENDER, payload, START_NS).content
    except FrameError:
        return
    assert isinstance(content, Update)
    assert all(0 <= entry.number <= 1023 for entry in content.entries)


@given(st.integers(0, 5000), st.sampled_from([0, 2, 4, 6]))
def test_rice_numbers_come_back(value: int, parameter: int) -> None:
    writer = BitWriter()
    writer.put_rice(value, parameter)
    assert len(writer.to_bytes()) == math.ceil(((value >> parameter) + 1 + parameter) / 8)
    assert BitReader(writer.to_bytes()).take_rice(parameter) == value


@pytest.mark.parametrize("cause", ["own", "squad"])
def test_feedback_travels_on_frames_in_full_too(cause: str) -> None:
    report = Report(SENDER if cause == "own" else 6, START_NS, 59.35, 18.07, 1.0)
    told = Reports((report,), Feedback(9, 200, 8, 0b1011_0001))
    content = Codec(ORIGIN).decode(SENDER, Codec(ORIGIN).encode(SENDER, told, 3, 99), START_NS).content
    assert isinstance(content, Reports)
    assert content.feedback == told.feedback


# -- finding the place --------------------------------------------------------------------------------------------

places = st.tuples(
    st.floats(-89.9, 89.9), st.floats(-180.0, 180.0) | st.sampled_from([180.0, -180.0, 179.9999, -179.9999])
)


@settings(deadline=None)
@given(
    places,
    st.sampled_from(LATTICES),
    st.floats(-0.999, 0.999),
    st.floats(-0.999, 0.999),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.integers(0, 3000),
)
def test_a_place_within_the_guard_of_the_prediction_is_found(
    place: tuple[float, float],
    lattice: tuple[int, int],
    east_share: float,
    north_share: float,
    east_m_s: float,
    north_m_s: float,
    ticks: int,
) -> None:
    """Truth is put off the prediction by less than what `allowed_cells` says, worked out here in cells."""
    grid, (resolution, reach) = Grid(Origin(latitude_deg=place[0], longitude_deg=0.0, height_m=0.0)), lattice
    before = Report(7, START_NS, place[0], place[1], 1.0, east_m_s, north_m_s)
    east_m, north_m = moved_m(east_m_s, north_m_s, ticks / 10)
    cosine = max(math.cos(math.radians(place[0])), 1e-3)
    row_deg = 180.0 / 2**26
    guard = allowed_cells(resolution, reach)
    latitude = place[0] + north_m / METRES_PER_DEG + north_share * guard * row_deg
    longitude = place[1] + east_m / (METRES_PER_DEG * cosine) + east_share * guard * grid.column_deg(0)
    longitude = (longitude + 180.0) % 360.0 - 180.0
    if abs(latitude) >= 90.0:
        return
    row, column = grid.row(latitude, resolution), grid.column(longitude, resolution)
    entry = Entry(7, row % 2**reach, column % 2**reach, None)
    update = Update(0, resolution, reach, 0, (entry,))
    found = resolved(grid, before, update, entry, (START_NS + ticks * TICK) // TICK)
    if found is None:
        assert abs(latitude) > 89.0  # a cell that would lie beyond the pole
        return
    off = abs((found.longitude_deg - longitude + 180.0) % 360.0 - 180.0)
    assert abs(found.latitude_deg - latitude) <= 0.51 * row_deg * 2**resolution
    assert off <= 0.51 * grid.column_deg(resolution)


@pytest.mark.parametrize(("far", "reach"), [(False, 3), (True, 6)])
def test_who_goes_on_as_before_is_told_by_his_place_alone(far: bool, reach: int) -> None:
    """A frame of reach 4 that varies: 3 bits near by, 6 far off; the velocity is the one told before."""
    grid, tick = Grid(ORIGIN), START_NS // TICK + 80
    before = Report(7, START_NS, 59.35, 18.07, 1.0, 0.0, 1.25)
    gone_m = moved_m(0.0, 1.25, 8.0)[1] + (50.0 if far else 5.0)
    latitude = 59.35 + gone_m / METRES_PER_DEG
    row, column = grid.row(latitude, 3) % 2**reach, grid.column(18.07, 3) % 2**reach
    entry = Entry(7, row, column, None, far=far, steady=True)
    found = resolved(grid, before, Update(tick % 512, 3, 4, 0, (entry,), varied=True), entry, tick)
    assert found is not None
    assert found.latitude_deg == pytest.approx(latitude, abs=1.3 / METRES_PER_DEG)
    assert (found.east_m_s, found.north_m_s) == (0.0, 1.25)


def references_told(counter: int = 0) -> References:
    """A receiver that heard soldier 7 told in full in the frame with this counter."""
    references = References(Grid(ORIGIN))
    references.heard(SENDER, 1, counter)
    report = Report(7, START_NS, 59.35, 18.07, 1.0)
    references.told(SENDER, 1, counter, Reports((report,), tick=START_NS // TICK), START_NS)
    return references


def an_update(misses: int, number: int = 7) -> Update:
    return Update(START_NS // TICK % 512 + 10, 3, 4, misses, (Entry(number, 0, 0, None),))


@pytest.mark.parametrize(
    ("missed", "allowed", "found"), [(0, 0, 1), (1, 0, 0), (1, 1, 1), (3, 2, 0), (3, 4, 1)]
)
def test_who_missed_more_than_an_update_allows_leaves_it_out(missed: int, allowed: int, found: int) -> None:
    references = references_told()
    counter = 1 + missed
    references.heard(SENDER, 1, counter)
    reports = references.resolve(SENDER, 1, counter, an_update(allowed), START_NS + S)
    assert len(reports) == found
    assert references.unresolved == 1 - found


def test_an_entry_that_was_refused_counts_as_missed() -> None:
    references = references_told()
    references.heard(SENDER, 1, 2)  # 1 is lost
    assert references.resolve(SENDER, 1, 2, an_update(0), START_NS + S) == ()
    references.heard(SENDER, 1, 3)
    # The lost one and the refused one may both have told of the soldier.
    assert references.resolve(SENDER, 1, 3, an_update(1), START_NS + S) == ()
    references.heard(SENDER, 1, 4)
    assert len(references.resolve(SENDER, 1, 4, an_update(3), START_NS + S)) == 1


def test_a_frame_that_comes_late_is_not_taken_for_heard() -> None:
    references = references_told()
    for counter in (4, 5, 6):
        references.heard(SENDER, 1, counter)
    references.heard(SENDER, 1, 3)
    # 1 and 2 are lost, whatever came since.
    assert references.resolve(SENDER, 1, 3, an_update(1), START_NS + S) == ()
    assert len(references.resolve(SENDER, 1, 3, an_update(3), START_NS + S)) == 1


def test_what_a_sender_told_before_it_began_anew_is_nothing_to_build_on() -> None:
    references = references_told()
    references.heard(SENDER, 2, 1)
    assert references.resolve(SENDER, 2, 1, an_update(14), START_NS + S) == ()


def test_nobody_is_placed_whom_the_sender_never_told_in_full() -> None:
    references = references_told()
    references.heard(SENDER, 1, 1)
    assert references.resolve(SENDER, 1, 1, an_update(14, number=8), START_NS + S) == ()


def test_a_frame_older_than_what_is_known_is_left_out() -> None:
    references = references_told()
    for counter in (1, 3):
        references.heard(SENDER, 1, counter)
        assert len(references.resolve(SENDER, 1, counter, an_update(14), START_NS + S)) == 1
    references.heard(SENDER, 1, 2)
    assert references.resolve(SENDER, 1, 2, an_update(14), START_NS + S) == ()


def test_a_frame_of_an_earlier_epoch_is_left_out() -> None:
    references = references_told()
    references.heard(SENDER, 0, 1)
    assert references.resolve(SENDER, 0, 1, an_update(14), START_NS + S) == ()
    assert references.unresolved == 1


def test_nobody_is_placed_beyond_the_pole() -> None:
    """The last row there is, 2.4 m high, and the one after it."""
    grid, last = Grid(ORIGIN), 2**22 - 1
    before = Report(7, START_NS, 90.0 - 1e-6, 18.07, 1.0)
    tick = START_NS // TICK
    for row, found in ((last, True), (last + 1, False)):
        entry = Entry(7, row % 8, 0, None)
        report = resolved(grid, before, Update(tick % 512, 3, 3, 0, (entry,)), entry, tick)
        assert (report is not None) == found


@pytest.mark.parametrize(
    "entries",
    [
        (Entry(1020, 0, 0, None), Entry(1024, 0, 0, None)),
        (Entry(6, 0, 0, None, quality=Quality(0, 7, 0, 0)),),
    ],
)
def test_an_update_of_what_there_is_not_is_refused(entries: tuple[Entry, ...]) -> None:
    payload = Codec(ORIGIN).encode(SENDER, Update(0, 3, 3, 0, entries), 3, 99)
    with pytest.raises(FrameError) as caught:
        Codec(ORIGIN).decode(SENDER, payload, START_NS)
    assert caught.value.cause == "range"


def test_heights_do_not_run_away() -> None:
    """Low bits that always mean 127 m more: beyond what a frame can tell in full the height is unknown."""
    references = References(Grid(ORIGIN))
    references.heard(SENDER, 1, 0)
    start = Report(7, START_NS, 59.35, 18.07, 1.0, height_m=15_000.0)
    references.told(SENDER, 1, 0, Reports((start,), tick=START_NS // TICK), START_NS)
    heights_m = []
    for counter in range(1, 5):
        references.heard(SENDER, 1, counter)
        level = Level(None, (15_000 + 127 * counter) % 256)
        update = replace(an_update(0), entries=(Entry(7, 0, 0, None, level=level),))
        (report,) = references.resolve(SENDER, 1, counter, update, START_NS + S)
        heights_m.append(report.height_m)
    assert heights_m == [15_127.0, 15_254.0, None, None]


@pytest.mark.parametrize("off_s", [0, -3000, 3000])
def test_time_is_found_whatever_the_receivers_clock_says(off_s: int) -> None:
    references = References(Grid(ORIGIN))
    references.heard(SENDER, 1, 0)
    told = Reports((Report(7, START_NS, 59.35, 18.07, 1.0),), tick=START_NS // TICK)
    references.told(SENDER, 1, 0, told, START_NS + off_s * S)
    references.heard(SENDER, 1, 1)
    (report,) = references.resolve(SENDER, 1, 1, an_update(0), START_NS + (off_s + 2) * S)
    assert report.time_ns == START_NS + S


# -- sender and receivers together --------------------------------------------------------------------------------

ROOM = Room(4000.0, 8000.0, 1000.0, 1600.0, 80.0)
steps = st.lists(
    st.tuples(
        st.floats(-15.0, 15.0),  # metres gone in a second, east
        st.floats(-15.0, 15.0),
        st.sampled_from([0.0] * 8 + [30.0, 200.0, 5000.0]),  # a jump on top of that
        st.lists(st.booleans(), min_size=3, max_size=3),  # who hears
    ),
    min_size=5,
    max_size=60,
)


@settings(deadline=None, max_examples=40)
@given(st.sampled_from([(59.35, 18.07), (-33.0, 179.9999), (84.0, -180.0), (0.0, 0.0)]), steps)
def test_no_receiver_is_ever_told_a_wrong_place(
    place: tuple[float, float], walk: list[tuple[float, float, float, list[bool]]]
) -> None:
    """Whatever is lost: a report that a receiver makes of a frame is what the sender meant, or is not made."""
    origin = Origin(latitude_deg=place[0], longitude_deg=place[1], height_m=0.0)
    codec, grid = Codec(origin), Grid(origin)
    scheduler = Scheduler(Policy(loss=0.3), SENDER, grid)
    receivers = [References(grid) for _ in range(3)]
    latitude, longitude, now_ns, counter = *place, START_NS, 0
    cosine = math.cos(math.radians(place[0]))
    for east_m, north_m, jump_m, hear in walk:
        now_ns += S
        latitude += (north_m + jump_m) / METRES_PER_DEG
        longitude = (longitude + east_m / (METRES_PER_DEG * cosine) + 180.0) % 360.0 - 180.0
        report = Report(7, now_ns, latitude, longitude, 1.0, east_m, north_m, hops=1)
        scheduler.pass_time(ROOM, 2, now_ns)
        plan = scheduler.plan([report, replace(report, number=8, latitude_deg=place[0])], ROOM, now_ns)
        if plan is None:
            continue
        content = codec.decode(SENDER, codec.encode(SENDER, plan, 3, 9999), now_ns).content
        scheduler.sent(counter, content, now_ns)
        for references, heard in zip(receivers, hear, strict=True):
            if heard:
                for told in heard_by(references, counter, content, now_ns):
                    if told.number == 7:
                        assert_near(told, report, cosine)
        counter += 1


def heard_by(references: References, counter: int, content: object, now_ns: int) -> tuple[Report, ...]:
    """What a receiver makes of a frame."""
    references.heard(SENDER, 1, counter)
    if isinstance(content, Reports):
        references.told(SENDER, 1, counter, content, now_ns)
        return content.reports
    assert isinstance(content, Update)
    return references.resolve(SENDER, 1, counter, content, now_ns)


def assert_near(told: Report, report: Report, cosine: float) -> None:
    """Half a cell of 4.8 m each way, and the second's way that a place may be told ahead."""
    north_m = (told.latitude_deg - report.latitude_deg) * METRES_PER_DEG
    turned = (told.longitude_deg - report.longitude_deg + 180.0) % 360.0 - 180.0
    ahead_m = 1.01 * math.hypot(report.east_m_s, report.north_m_s)
    assert told.time_ns == report.time_ns
    assert math.hypot(north_m, turned * METRES_PER_DEG * cosine) <= 5.0 + ahead_m
