"""NMEA and UBX against values worked out by hand."""

import datetime
import math

import pytest
from pyubx2 import GET, UBXMessage

from bootprint.messages import GnssFix
from sensor_gateway.decoders.gnss import GnssDecoder
from sensor_gateway.readings import MessageReading
from sensor_gateway.settings import Device, Protocol
from support.sensor_device import nmea


def utc_ns(*moment: int, micros: int = 0) -> int:
    seconds = datetime.datetime(*moment, tzinfo=datetime.UTC).timestamp()  # type: ignore[misc, arg-type]
    return int(seconds) * 1_000_000_000 + micros * 1000


ARRIVAL = utc_ns(2026, 3, 23, 12, 35, 20)
GGA = "GPGGA,123519.25,4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,"
RMC = "GPRMC,123519.25,A,4807.038,N,01131.000,W,010.0,090.0,230326,003.1,W"
GST = "GPGST,123519.25,3.2,6.6,4.7,47.3,3.0,4.0,22.0"
NEXT_GGA = GGA.replace("19.25", "20.25")
NEXT_RMC = RMC.replace("19.25", "20.25")


def receiver(protocol: Protocol = "nmea", geoid_undulation_m: float | None = None) -> GnssDecoder:
    return GnssDecoder(Device(protocol=protocol, gnss_name="rx", geoid_undulation_m=geoid_undulation_m))


def fixes(decoder: GnssDecoder, *parts: str | bytes) -> list[GnssFix]:
    data = b"".join(nmea(part) if isinstance(part, str) else part for part in parts)
    return messages(decoder.feed(data, ARRIVAL))


def messages(readings: list[object]) -> list[GnssFix]:
    found = []
    for reading in readings:
        assert isinstance(reading, MessageReading)
        assert (reading.source, reading.clock) == ("rx", None)
        assert isinstance(reading.message, GnssFix)
        found.append(reading.message)
    return found


def test_sentences_of_one_epoch_make_one_fix() -> None:
    (fix,) = fixes(receiver(), GGA, RMC, GST, NEXT_GGA)
    assert fix.time_ns == utc_ns(2026, 3, 23, 12, 35, 19, micros=250_000)
    assert fix.fix_kind == "3d"
    assert fix.latitude_deg == pytest.approx(48 + 7.038 / 60, abs=1e-9)
    assert fix.longitude_deg == pytest.approx(-(11 + 31 / 60), abs=1e-9)
    assert fix.height_m == pytest.approx(545.4 + 46.9)
    assert fix.horizontal_accuracy_m == 5.0  # 3-4-5
    assert fix.vertical_accuracy_m == 22.0
    assert (fix.satellites, fix.hdop) == (8, 0.9)
    assert fix.speed_m_s == pytest.approx(5.14444, abs=1e-5)
    assert fix.course_rad == pytest.approx(math.pi / 2)


def test_without_gst_the_accuracy_is_unknown_whatever_the_hdop() -> None:
    fix = fixes(receiver(), GGA, NEXT_GGA)[0]
    assert (fix.hdop, fix.horizontal_accuracy_m, fix.vertical_accuracy_m) == (0.9, None, None)


def test_a_fix_is_told_with_the_last_sentence_of_its_epoch_once_that_is_learned() -> None:
    decoder = receiver()
    assert fixes(decoder, GGA, RMC) == []
    assert len(fixes(decoder, NEXT_GGA)) == 1
    (fix,) = fixes(decoder, NEXT_RMC)
    assert fix.time_ns == utc_ns(2026, 3, 23, 12, 35, 20, micros=250_000)


def test_a_lost_last_sentence_is_learned_again() -> None:
    """The first epoch's GST was lost; later ones must still get their accuracy."""
    decoder = receiver()
    later = [
        sentence.replace("19.25", f"{second}.25") for second in range(20, 24) for sentence in (GGA, RMC, GST)
    ]
    told = fixes(decoder, GGA, RMC, *later)
    assert [fix.horizontal_accuracy_m for fix in told] == [None, None, 5.0, 5.0, 5.0]


def test_gsa_tells_a_fix_without_height() -> None:
    gsa = "GNGSA,A,2,80,71,73,79,69,,,,,,,,1.83,1.09,1.47"
    fix = fixes(receiver(), gsa, GGA, NEXT_GGA)[0]
    assert (fix.fix_kind, fix.height_m) == ("2d", None)


def test_stated_geoid_serves_a_receiver_that_tells_none() -> None:
    without = GGA.replace("46.9,M", ",")
    assert fixes(receiver(), without, NEXT_GGA)[0].height_m is None
    assert fixes(receiver(geoid_undulation_m=23.0), without, NEXT_GGA)[0].height_m == pytest.approx(568.4)


@pytest.mark.parametrize(
    ("quality", "kind"),
    [(0, "none"), (2, "dgnss"), (4, "rtk_fixed"), (5, "rtk_float"), (6, "dead_reckoning"), (8, "none")],
)
def test_gga_quality(quality: int, kind: str) -> None:
    fix = fixes(receiver(), GGA.replace("W,1,", f"W,{quality},"), NEXT_GGA)[0]
    assert fix.fix_kind == kind
    assert (fix.latitude_deg is None) == (kind == "none")


def test_a_date_told_once_holds_over_midnight() -> None:
    decoder = receiver()
    fixes(decoder, RMC.replace("123519.25", "235959.00").replace("230326", "230325"))
    told = fixes(decoder, *(GGA.replace("123519.25", f"00000{second}.00") for second in (0, 1)))
    midnight_ns = utc_ns(2025, 3, 24, 0, 0, 0)
    assert [fix.time_ns - midnight_ns for fix in told] == [-1_000_000_000, 0, 1_000_000_000]


def test_without_any_date_the_day_nearest_to_the_arrival_is_meant() -> None:
    decoder = receiver()
    data = nmea(GGA.replace("123519.25", "235959.00")) + nmea(GGA.replace("123519.25", "000000.00"))
    told = messages(decoder.feed(data, utc_ns(2026, 3, 24, 0, 0, 0)))
    assert [fix.time_ns for fix in told] == [utc_ns(2026, 3, 23, 23, 59, 59), utc_ns(2026, 3, 24, 0, 0, 0)]


def test_a_receiver_without_time_says_that_it_is_alive() -> None:
    decoder = receiver()
    assert fixes(decoder, "GPGGA,,,,,,0,00,,,M,,M,,", "GPRMC,,V,,,,,,,,,,N") == [
        GnssFix(time_ns=ARRIVAL, fix_kind="none", satellites=0)
    ]
    assert decoder.counts["fixes_without_time"] == 1


def test_damaged_sentences_are_counted_and_do_no_harm() -> None:
    decoder = receiver()
    damaged = nmea(GGA).replace(b"4807", b"4907")
    assert fixes(decoder, b"$GPG\xb5b$$", damaged, GGA, b"\xff\x00" * 100, NEXT_GGA)[0].satellites == 8
    assert decoder.counts["frames_broken"] > 0
    assert decoder.counts["frames"] == 2


def pvt(**changes: float) -> bytes:
    time = {"year": 2026, "month": 3, "day": 4, "hour": 5, "min": 6, "second": 7, "nano": -250}
    state = {"validDate": 1, "validTime": 1, "fixType": 3, "gnssFixOk": 1, "numSV": 12}
    place = {"lon": -11.5, "lat": 48.25, "height": 545400, "hMSL": 500000, "hAcc": 1234, "vAcc": 2345}
    motion = {"gSpeed": 1500, "sAcc": 300, "headMot": 90.0}
    return bytes(
        UBXMessage("NAV", "NAV-PVT", GET, **{**time, **state, **place, **motion, **changes}).serialize()
    )


def test_pvt_is_ellipsoidal_and_in_metres() -> None:
    (fix,) = fixes(receiver("ubx"), pvt())
    assert fix == GnssFix(
        time_ns=utc_ns(2026, 3, 4, 5, 6, 7) - 250,
        fix_kind="3d",
        latitude_deg=48.25,
        longitude_deg=-11.5,
        height_m=545.4,
        horizontal_accuracy_m=1.234,
        vertical_accuracy_m=2.345,
        satellites=12,
        speed_m_s=1.5,
        speed_accuracy_m_s=0.3,
        course_rad=math.pi / 2,
    )


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"gnssFixOk": 0}, "none"),
        ({"fixType": 1}, "dead_reckoning"),
        ({"fixType": 2}, "2d"),
        ({"fixType": 5}, "none"),
        ({"diffSoln": 1}, "dgnss"),
        ({"diffSoln": 1, "carrSoln": 1}, "rtk_float"),
        ({"fixType": 4, "diffSoln": 1, "carrSoln": 2}, "rtk_fixed"),
    ],
)
def test_pvt_fix_kinds(changes: dict[str, float], kind: str) -> None:
    assert fixes(receiver("ubx"), pvt(**changes))[0].fix_kind == kind


def test_pvt_without_valid_time_is_stamped_on_arrival_and_counted() -> None:
    decoder = receiver("ubx")
    assert fixes(decoder, pvt(validTime=0))[0].time_ns == ARRIVAL
    assert decoder.counts["fixes_without_time"] == 1


def test_in_a_mixed_stream_ubx_is_preferred_and_every_byte_may_come_alone() -> None:
    decoder = receiver("nmea+ubx")
    stream = pvt() + nmea(GGA) + b"\xb5\xb5b\x01\x07" + pvt(second=8) + nmea(NEXT_GGA) + pvt(second=9)
    told = [fix for byte in stream for fix in messages(decoder.feed(bytes((byte,)), ARRIVAL))]
    assert [fix.time_ns for fix in told] == [utc_ns(2026, 3, 4, 5, 6, s) - 250 for s in (7, 8, 9)]


def stamped_by(decoder: GnssDecoder, *parts: str | bytes) -> list[str]:
    data = b"".join(nmea(part) if isinstance(part, str) else part for part in parts)
    return [
        reading.stamped_by for reading in decoder.feed(data, ARRIVAL) if isinstance(reading, MessageReading)
    ]


def test_who_told_a_stamp_is_said() -> None:
    """A date comes with RMC or ZDA; leap seconds are sure when the receiver says so."""
    zda = "GPZDA,123518.00,23,03,2026,00,00"
    timeless = "GPGGA,,,,,,0,00,,,M,,M,,"
    assert stamped_by(receiver(), GGA, NEXT_GGA) == ["host_date", "host_date"]
    assert stamped_by(receiver(), timeless, GGA, RMC, NEXT_GGA) == ["arrival", "sensor"]
    assert stamped_by(receiver(), zda, GGA, NEXT_GGA) == ["sensor", "sensor"]
    unsure, sure, none = pvt(), pvt(second=8, fullyResolved=1), pvt(validDate=0)
    assert stamped_by(receiver("ubx"), unsure, sure, none) == ["host_date", "sensor", "arrival"]


def test_the_end_of_the_stream_gives_out_the_last_epoch() -> None:
    decoder = receiver()
    assert fixes(decoder, GGA) == []
    assert len(messages(decoder.cut(ARRIVAL))) == 1
    assert messages(decoder.cut(ARRIVAL)) == []
