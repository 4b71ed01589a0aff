"""Bus messages to radio contents and back: names to roster numbers, covariances to one sigma."""

import math

from bootprint.config import Member
from bootprint.display import Held
from bootprint.geodesy import major_axis_sigma_m
from bootprint.messages import Alert, Fix, Message, Observation, Position, Status, Track
from sa_hub.radio.content import (
    AlertNotice,
    Condition,
    Notice,
    ObservationNotice,
    Report,
    StatusNotice,
)
from sa_hub.tracks import Known


def report_of_position(
    position: Position, number: int, velocity_m_s: tuple[float, float], condition: Condition
) -> Report:
    """A soldier's fused position as the radio tells it."""
    east_m2, cross_m2, _, north_m2, _, _ = position.covariance_m2
    return Report(
        number=number,
        time_ns=position.time_ns,
        latitude_deg=position.latitude_deg,
        longitude_deg=position.longitude_deg,
        accuracy_m=major_axis_sigma_m(east_m2, cross_m2, north_m2),
        east_m_s=velocity_m_s[0],
        north_m_s=velocity_m_s[1],
        height_m=position.height_m,
        mode=position.mode,
        floor=position.floor,
        condition=condition,
        facing_deg=None if position.facing_rad is None else math.degrees(position.facing_rad) % 360.0,
    )


def report_of_fix(fix: Fix, number: int, condition: Condition) -> Report:
    """A place that a person gave: nothing measures it from then on, hence "coasting"."""
    return Report(
        number=number,
        time_ns=fix.time_ns,
        latitude_deg=fix.latitude_deg,
        longitude_deg=fix.longitude_deg,
        accuracy_m=fix.accuracy_m,
        height_m=fix.height_m,
        mode="coasting",
        condition=condition,
        facing_deg=None if fix.azimuth_rad is None else math.degrees(fix.azimuth_rad) % 360.0,
    )


def track_of(known: Known, member: Member, held: Held | None, sequence: int) -> Track:
    """What the bus is told of a soldier; the rounding to a lattice cell counts into the accuracy.

    ``held``: how well the net that it came over keeps the picture right, if that is known.
    """
    report = known.report
    return Track(
        time_ns=report.time_ns,
        sequence=sequence,
        soldier=member.id,
        number=member.number,
        state=known.state,
        latitude_deg=report.latitude_deg,
        longitude_deg=report.longitude_deg,
        height_m=report.height_m,
        accuracy_m=math.hypot(report.accuracy_m, report.cell_m / math.sqrt(12.0)),
        east_velocity_m_s=report.east_m_s,
        north_velocity_m_s=report.north_m_s,
        mode=report.mode,
        floor=report.floor,
        facing_rad=None if report.facing_deg is None else math.radians(report.facing_deg),
        callsign=member.callsign or None,
        received_ns=known.received_ns,
        via=known.via,
        hops=report.hops,
        held_m=None if held is None else held.sigma_m,
        held_s=None if held is None else held.silence_s,
    )


def notice_of(message: Alert | Observation | Status, number: int) -> Notice:
    """What the radio tells of a message."""
    match message:
        case Alert():
            return AlertNotice(number, message.time_ns, message.kind, message.text)
        case Observation():
            return ObservationNotice(
                number=number,
                time_ns=message.time_ns,
                latitude_deg=message.latitude_deg,
                longitude_deg=message.longitude_deg,
                accuracy_m=message.accuracy_m,
                text=message.text,
                code=message.code,
            )
        case Status():
            return StatusNotice(number, message.time_ns, message.condition, message.battery_pct)


def message_of(notice: Notice, soldier: str) -> Message:
    """What the bus is told of a notice."""
    match notice:
        case AlertNotice():
            return Alert(time_ns=notice.time_ns, soldier=soldier, kind=notice.kind, text=notice.text)
        case ObservationNotice():
            return Observation(
                time_ns=notice.time_ns,
                soldier=soldier,
                latitude_deg=notice.latitude_deg,
                longitude_deg=notice.longitude_deg,
                accuracy_m=notice.accuracy_m,
                text=notice.text,
                code=notice.code,
            )
        case StatusNotice():
            return Status(
                time_ns=notice.time_ns,
                soldier=soldier,
                condition=notice.condition,
                battery_pct=notice.battery_pct,
            )
