"""The frame codec: every field comes back within its stated bound, and no bytes but frames are taken."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bootprint.config import Origin
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import (
    ALERT_KINDS,
    CONDITIONS,
    OBSERVATION_CODES,
    AlertNotice,
    Content,
    ObservationNotice,
    Report,
    Reports,
    StatusNotice,
)
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.layout import KIND_BITS, SQUAD, Kind, read_fields, write_fields
from sa_hub.radio.quantise import MODES, age_code, age_ticks
from sa_hub.radio.squad import partition

S = 1_000_000_000
NOW_NS = 1_790_000_000 * S
ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
CODEC = Codec(ORIGIN)
ROOMY = 10_000
FINEST_CELL_DEG = 180.0 / 2**26

floats = {"allow_nan": False, "allow_infinity": False}
latitudes = st.floats(-90.0, 90.0, **floats) | st.sampled_from([-90.0, 90.0, 0.0, 59.35])
longitudes = st.floats(-180.0, 180.0, **floats) | st.sampled_from([-180.0, 180.0, 0.0, 18.07])


@st.composite
def reports(draw: st.DrawFn, number: int | None = None, hops: int | None = None) -> Report:
    """Any valid report."""
    return Report(
        number=draw(st.integers(0, 1023)) if number is None else number,
        time_ns=NOW_NS + draw(st.integers(-400 * S, 0)),
        latitude_deg=draw(latitudes),
        longitude_deg=draw(longitudes),
        accuracy_m=draw(st.floats(0.0, 1e5, **floats)),
        east_m_s=draw(st.floats(-40.0, 40.0, **floats)),
        north_m_s=draw(st.floats(-40.0, 40.0, **floats)),
        height_m=draw(st.none() | st.floats(-500.0, 9000.0, **floats)),
        mode=draw(st.sampled_from(MODES)),
        floor=draw(st.none() | st.integers(-32, 95)),
        condition=draw(st.sampled_from(CONDITIONS)),
        hops=draw(st.integers(0, 3)) if hops is None else hops,
        facing_deg=draw(st.none() | st.floats(0.0, 360.0, **floats)),
    )


@st.composite
def squads(draw: st.DrawFn) -> list[Report]:
    """Soldiers with different numbers within some hundred metres of each other, anywhere on earth."""
    around = draw(reports())
    numbers = draw(st.lists(st.integers(0, 1023), min_size=1, max_size=12, unique=True))
    squad = []
    for number in numbers:
        latitude = around.latitude_deg + draw(st.floats(-0.003, 0.003))
        longitude = around.longitude_deg + draw(st.floats(-0.003, 0.003))
        squad.append(
            replace(
                draw(reports(number=number)),
                latitude_deg=max(-90.0, min(90.0, latitude)),
                longitude_deg=(longitude + 180.0) % 360.0 - 180.0,
                height_m=draw(st.none() | st.floats(0.0, 120.0)),
            )
        )
    return squad


def turned_deg(a: float, b: float) -> float:
    """Angle between two longitudes."""
    return abs((a - b + 180.0) % 360.0 - 180.0)


def assert_close(sent: Report, got: Report, resolution: int, age_s: float) -> None:
    """All fields within the bounds that docs/radio.md states, worked out here on their own."""
    half_cell = 0.5 * FINEST_CELL_DEG * 2**resolution * (1 + 1e-9)
    assert abs(got.latitude_deg - sent.latitude_deg) <= half_cell
    assert turned_deg(got.longitude_deg, sent.longitude_deg) <= half_cell
    assert -90.0 <= got.latitude_deg <= 90.0
    assert -180.0 <= got.longitude_deg <= 180.0
    assert -0.05 * S - (age_s / 32 * S + 1) <= got.time_ns - sent.time_ns <= 0.05 * S
    assert (got.height_m is None) == (sent.height_m is None)
    if sent.height_m is not None and got.height_m is not None:
        assert abs(got.height_m - sent.height_m) <= 0.5
    assert got.accuracy_m >= min(sent.accuracy_m, 1000.0)
    assert got.accuracy_m <= max(0.5, 2 * sent.accuracy_m) or sent.accuracy_m > 16.0
    assert_velocity(sent, got)
    assert (got.number, got.mode, got.floor, got.condition, got.hops) == (
        sent.number,
        sent.mode,
        sent.floor,
        sent.condition,
        sent.hops,
    )
    assert (got.facing_deg is None) == (sent.facing_deg is None)
    if sent.facing_deg is not None and got.facing_deg is not None:
        assert turned_deg(got.facing_deg, sent.facing_deg) <= 11.25


def assert_velocity(sent: Report, got: Report) -> None:
    """Direction to 1/32 turn; speed to √1.28 between 0.265 and 13.8 m/s; below 0.15 m/s standing."""
    speed, shown = math.hypot(sent.east_m_s, sent.north_m_s), math.hypot(got.east_m_s, got.north_m_s)
    if speed < 0.15:
        assert shown == 0.0
        return
    turned = math.atan2(got.east_m_s, got.north_m_s) - math.atan2(sent.east_m_s, sent.north_m_s)
    assert abs(math.remainder(turned, 2 * math.pi)) <= math.pi / 16 * (1 + 1e-9)
    if 0.266 <= speed <= 13.7:
        assert 1 / 1.1315 <= shown / speed <= 1.1315
    elif speed > 13.7:
        assert shown == pytest.approx(0.3 * 1.28**15)


@settings(deadline=None)
@given(reports(number=7, hops=0), st.integers(0, 7))
@example(Report(7, NOW_NS, 90.0, 180.0, 1.0, height_m=-430.0), 7)
@example(Report(7, NOW_NS, -90.0, -180.0, 1.0), 0)
def test_own_report_comes_back_within_its_bounds(report: Report, resolution: int) -> None:
    payload = CODEC.encode(7, Reports((report,)), resolution, ROOMY)
    assert payload[0] >> 4 == Kind.SELF
    content = CODEC.decode(7, payload, NOW_NS).content
    assert isinstance(content, Reports)
    assert_close(report, content.reports[0], resolution, age_s=0.0)


@settings(max_examples=50, deadline=None)
@given(squads(), st.integers(0, 7))
def test_a_squad_in_one_frame_comes_back_within_its_bounds(squad: list[Report], resolution: int) -> None:
    newest_ns = max(report.time_ns for report in squad)
    got: dict[int, Report] = {}
    for group in partition(squad, resolution):
        payload = CODEC.encode(1, Reports(tuple(group)), resolution, ROOMY)
        content = CODEC.decode(1, payload, NOW_NS).content
        assert isinstance(content, Reports)
        got |= {report.number: report for report in content.reports}
    assert sorted(got) == sorted(report.number for report in squad)
    for report in squad:
        age_s = (newest_ns - report.time_ns) / S + 0.2
        assert_close(report, got[report.number], resolution, age_s if age_s > 6.0 else 0.0)


@settings(max_examples=50, deadline=None)
@given(squads(), st.integers(0, 7))
def test_a_relay_gives_back_exactly_what_it_heard(squad: list[Report], resolution: int) -> None:
    recent = [replace(report, time_ns=NOW_NS - index * S // 10) for index, report in enumerate(squad)]
    for group in partition(recent, resolution):
        payload = CODEC.encode(1, Reports(tuple(group)), resolution, ROOMY)
        once = CODEC.decode(1, payload, NOW_NS).content
        assert CODEC.encode(1, once, resolution, ROOMY) == payload


def test_what_lies_beyond_the_range_saturates() -> None:
    report = Report(7, NOW_NS, 10.0, 20.0, 1e9, height_m=99_999.0, floor=400, east_m_s=300.0)
    deep = replace(report, height_m=-99_999.0, floor=-400)
    for sent, height_m, floor in ((report, 15_359.0, 95), (deep, -1024.0, -32)):
        payload = CODEC.encode(7, Reports((sent,)), 3, ROOMY)
        content = CODEC.decode(7, payload, NOW_NS).content
        assert isinstance(content, Reports)
        got = content.reports[0]
        assert (got.height_m, got.floor, got.accuracy_m) == (height_m, floor, 1000.0)
        assert got.east_m_s == pytest.approx(0.3 * 1.28**15)


@pytest.mark.parametrize("height_m", [None, 52.0])
def test_near_and_far_anchors_say_the_same_place(height_m: float | None) -> None:
    report = Report(7, NOW_NS, 59.4, 18.1, 1.0, height_m=height_m)
    far_away = Codec(Origin(latitude_deg=-30.0, longitude_deg=100.0))
    near, far = (codec.encode(7, Reports((report,)), 3, ROOMY) for codec in (CODEC, far_away))
    assert len(near) < len(far)
    decoded = [codec.decode(7, payload, NOW_NS) for codec, payload in ((CODEC, near), (far_away, far))]
    assert decoded[0] == decoded[1]


def test_a_squad_across_the_antimeridian_is_one_small_frame() -> None:
    squad = (Report(1, NOW_NS, 0.0, 179.9995, 1.0), Report(2, NOW_NS, 0.0, -179.9995, 1.0))
    assert partition(squad, 3) == [list(squad)]
    payload = CODEC.encode(9, Reports(squad), 3, ROOMY)
    content = CODEC.decode(9, payload, NOW_NS).content
    assert isinstance(content, Reports)
    shown = [report.longitude_deg for report in content.reports]
    assert shown == pytest.approx([179.9995, -179.9995], abs=2e-5)


@settings(max_examples=50, deadline=None)
@given(st.lists(reports(), max_size=20), st.integers(0, 7))
def test_partition_keeps_everyone_in_frames_that_can_be_written(group: list[Report], resolution: int) -> None:
    groups = partition(group, resolution)
    assert sorted(repr(report) for each in groups for report in each) == sorted(map(repr, group))
    for each in groups:
        CODEC.encode(1, Reports(tuple(each)), resolution, ROOMY)


def test_reports_too_far_apart_for_one_frame_are_the_callers_fault() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        CODEC.encode(
            9, Reports((Report(1, NOW_NS, 0.0, 0.0, 1.0), Report(2, NOW_NS, 1.0, 0.0, 1.0))), 0, ROOMY
        )


numbers = st.integers(0, 1023)
times = st.integers(NOW_NS - 3000 * S, NOW_NS + 3000 * S)
texts = st.text(max_size=220)
alerts = st.builds(AlertNotice, numbers, times, st.sampled_from(ALERT_KINDS), texts, st.integers(0, 3))
observations = st.builds(
    ObservationNotice,
    numbers,
    times,
    latitudes,
    longitudes,
    st.floats(0, 1e4),
    texts,
    st.integers(0, 3),
    st.none() | st.sampled_from(OBSERVATION_CODES),
)
statuses = st.builds(
    StatusNotice,
    numbers,
    times,
    st.sampled_from(CONDITIONS),
    st.none() | st.floats(0, 100),
    st.integers(0, 3),
)


@settings(deadline=None)
@given(alerts | observations | statuses, st.integers(14, 300))
def test_notices_come_back_with_as_much_text_as_fits(notice: Content, limit_bytes: int) -> None:
    assert not isinstance(notice, Reports)
    payload = CODEC.encode(1, notice, 0, limit_bytes)
    assert len(payload) <= limit_bytes
    got = CODEC.decode(1, payload, NOW_NS).content
    assert not isinstance(got, Reports)
    assert (got.number, got.hops) == (notice.number, notice.hops)
    assert abs(got.time_ns - notice.time_ns) <= 0.05 * S
    match notice, got:
        case (AlertNotice(), AlertNotice()):
            assert got.kind == notice.kind
            assert_text_cut(notice.text, got.text, limit_bytes - 6)
        case (ObservationNotice(), ObservationNotice()):
            assert abs(got.latitude_deg - notice.latitude_deg) <= 0.5 * FINEST_CELL_DEG * (1 + 1e-9)
            assert turned_deg(got.longitude_deg, notice.longitude_deg) <= 0.5 * FINEST_CELL_DEG * (1 + 1e-9)
            assert_text_cut(notice.text, got.text, limit_bytes - 14)
            assert got.code == notice.code
        case (StatusNotice(), StatusNotice()):
            assert got.condition == notice.condition
            assert (got.battery_pct is None) == (notice.battery_pct is None)
            assert abs((got.battery_pct or 0.0) - (notice.battery_pct or 0.0)) <= 0.5
        case _:
            pytest.fail(f"{notice} became {got}")


def test_an_observation_code_of_later_days_says_nothing_here() -> None:
    payload = CODEC.encode(
        1, ObservationNotice(1, NOW_NS, 59.0, 18.0, 5.0, "något nytt", code="infantry"), 0, 99
    )
    reader, writer = BitReader(payload), BitWriter()
    before = KIND_BITS + 1 + 16 + 10 + 2 + 1
    writer.put(reader.take(before), before)
    assert reader.take(6) == 1
    writer.put(63, 6)
    rest = 8 * len(payload) - before - 6
    writer.put(reader.take(rest), rest)
    got = CODEC.decode(1, writer.to_bytes(), NOW_NS).content
    assert isinstance(got, ObservationNotice)
    assert (got.code, got.text) == (None, "något nytt")


def assert_text_cut(sent: str, got: str, room_bytes: int) -> None:
    """What came is the beginning of what was sent, and no more was cut than had to be."""
    sent = sent.encode("utf-8", "replace").decode()
    assert sent.startswith(got)
    if got != sent:
        next_character = sent[len(got)].encode()
        full = len(got.encode()) + len(next_character) > min(room_bytes, 255)
        assert full or len(got) == 200


@settings(deadline=None)
@given(st.binary(max_size=80))
def test_any_bytes_are_a_frame_or_a_frame_error(payload: bytes) -> None:
    try:
        content = CODEC.decode(5, payload, NOW_NS).content
    except FrameError:
        return
    reports_in = content.reports if isinstance(content, Reports) else ()
    for report in reports_in:
        assert -90.0 < report.latitude_deg < 90.0
        assert -180.0 < report.longitude_deg < 180.0
        assert 0 <= report.number <= 1023


@settings(max_examples=50, deadline=None)
@given(squads(), st.data())
def test_damaged_squad_frames_are_frames_or_frame_errors(squad: list[Report], data: st.DataObject) -> None:
    payload = CODEC.encode(1, Reports(tuple(partition(squad, 3)[0])), 3, ROOMY)
    damaged = bytearray(payload)
    damaged[data.draw(st.integers(0, len(payload) - 1))] ^= data.draw(st.integers(1, 255))
    cut = bytes(damaged[: data.draw(st.integers(0, len(payload)))])
    for candidate in (bytes(damaged), cut, bytes(damaged) + b"\0"):
        try:
            CODEC.decode(1, candidate, NOW_NS)
        except FrameError:
            continue


def test_a_place_beyond_the_pole_is_refused() -> None:
    at_the_pole = Report(2, NOW_NS, 90.0, 0.0, 1.0)
    south_of_it = replace(at_the_pole, number=3, latitude_deg=89.999)
    payload = CODEC.encode(1, Reports((at_the_pole, south_of_it)), 0, ROOMY)
    reader = BitReader(payload)
    reader.take(KIND_BITS)
    values = read_fields(reader, SQUAD, {})
    writer = BitWriter()
    writer.put(Kind.SQUAD, KIND_BITS)
    write_fields(writer, SQUAD, {**values, "far_latitude": values["far_latitude"] + 1})
    head_bits = KIND_BITS + sum(field.width(values) for field in SQUAD if field.present(values))
    rest = int.from_bytes(payload) & ((1 << (8 * len(payload) - head_bits)) - 1)
    writer.put(rest, 8 * len(payload) - head_bits)
    with pytest.raises(FrameError, match="beyond the pole"):
        CODEC.decode(1, writer.to_bytes(), NOW_NS)


def test_time_is_taken_as_the_nearest_to_the_receivers_own() -> None:
    report = Report(7, NOW_NS, 59.0, 18.0, 1.0)
    payload = CODEC.encode(7, Reports((report,)), 3, ROOMY)
    for off_s in (-3200, 0, 3200):
        content = CODEC.decode(7, payload, NOW_NS + off_s * S).content
        assert isinstance(content, Reports)
        assert content.reports[0].time_ns == NOW_NS


def test_exercise_is_told() -> None:
    payload = Codec(ORIGIN, exercise=True).encode(3, StatusNotice(3, NOW_NS, "ok"), 0, ROOMY)
    assert CODEC.decode(3, payload, NOW_NS).exercise


@given(st.integers(0, 4032))
def test_ages_round_up_by_less_than_a_thirty_second_part(ticks: int) -> None:
    shown = age_ticks(age_code(ticks))
    assert ticks <= shown <= ticks + max(0, ticks - 32) / 32
    assert age_code(shown) == age_code(ticks)


def test_ages_beyond_the_range_are_refused() -> None:
    with pytest.raises(ValueError, match="403"):
        age_code(4033)


@settings(deadline=None)
@given(
    st.lists(st.integers(1, 40).flatmap(lambda bits: st.tuples(st.integers(0, 2**bits - 1), st.just(bits))))
)
def test_bits_come_back(values: list[tuple[int, int]]) -> None:
    writer = BitWriter()
    for value, bits in values:
        writer.put(value, bits)
    data = writer.to_bytes()
    assert len(data) == -(-sum(bits for _, bits in values) // 8)
    reader = BitReader(data)
    assert [reader.take(bits) for _, bits in values] == [value for value, _ in values]
    reader.finish()


def test_bits_are_most_significant_first() -> None:
    writer = BitWriter()
    writer.put(0b101, 3)
    writer.put(0b1, 1)
    writer.put(0xFF, 8)
    assert writer.to_bytes() == bytes([0b1011_1111, 0b1111_0000])
    with pytest.raises(ValueError, match="does not fit"):
        writer.put(4, 2)
