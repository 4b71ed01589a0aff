"""One walk damaged in many ways: what each damage must do to fusion, and whether it does.

Damages of the sensors change the run before the foot INS sees it (as `evaluation.foot.faults` does for one foot
alone); damages of the way change which messages reach fusion, and when. Every expectation is one that can fail.

python -m proving_ground.evaluation.fusion.damages
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from bootprint import logs
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from proving_ground.evaluation.foot.faults import Change, biased, clipped, missing
from proving_ground.evaluation.fusion.damage_play import (
    BEGIN_NS,
    Arrival,
    Outcome,
    RunChange,
    StreamChange,
    played,
)
from sensor_gateway.recordings.run import ImuSeries

LEFT, RIGHT = "left_foot", "right_foot"
_MIDDLE_S = 80.0
_LATER_S = (90.0, 130.0)
_SAME_M = 1e-6
_SEED = 5
_TRUTHFUL_PCT = 85.0  # of one walk: errors of its positions are alike
Check = Callable[[Outcome, Outcome], bool]


@dataclass(frozen=True)
class Damage:
    """A damage: its name, what is expected in words, and as a check of (damaged, untouched)."""

    name: str
    expected: str
    check: Check
    on_run: RunChange | None = None
    on_stream: StreamChange | None = None
    options: dict[str, Any] | None = None
    satellites: bool = False


@dataclass(frozen=True)
class Finding:
    """A damage and what it did."""

    damage: Damage
    outcome: Outcome
    as_expected: bool


# --- on the way ------------------------------------------------------------------------------------------------


def late(by_s: float, source: str | None = None, share: float = 1.0) -> StreamChange:
    """Messages of feet (of one foot) arrive later; of ``share`` of them, at random."""

    def change(arrivals: list[Arrival]) -> list[Arrival]:
        chosen = np.random.default_rng(_SEED).random(len(arrivals)) < share
        by_ns = round(by_s * NS_PER_S)
        return [
            replace(one, at_ns=one.at_ns + by_ns * bool(late)) if _is_of(one, source) else one
            for one, late in zip(arrivals, chosen, strict=True)
        ]

    return change


def lost(share: float) -> StreamChange:
    """So many messages of the feet never come."""

    def change(arrivals: list[Arrival]) -> list[Arrival]:
        gone = np.random.default_rng(_SEED).random(len(arrivals)) < share
        return [one for one, lost in zip(arrivals, gone, strict=True) if not (lost and one.is_foot)]

    return change


def doubled(arrivals: list[Arrival]) -> list[Arrival]:
    """Everything comes twice, the second time half a second later."""
    return [*arrivals, *(replace(one, at_ns=one.at_ns + NS_PER_S // 2) for one in arrivals)]


def silent(source: str, begin_s: float, end_s: float = np.inf) -> StreamChange:
    """Nothing comes of a foot between these times."""
    return lambda arrivals: [
        one for one in arrivals if not (_is_of(one, source) and begin_s <= _second(one) < end_s)
    ]


def stamped(by_s: float, share: float) -> StreamChange:
    """A share of the feet's poses is stamped ahead of its time."""

    def change(arrivals: list[Arrival]) -> list[Arrival]:
        wrong = np.random.default_rng(_SEED).random(len(arrivals)) < share
        return [
            _restamped(one, by_s) if hit and one.of("foot_pose") else one
            for one, hit in zip(arrivals, wrong, strict=True)
        ]

    return change


def receiver_ahead(by_s: float) -> StreamChange:
    """The receiver's clock is ahead of everybody's."""
    return lambda arrivals: [_restamped(one, by_s) if one.of("gnss") else one for one in arrivals]


def _restamped(arrival: Arrival, by_s: float) -> Arrival:
    message = arrival.envelope.message
    moved = msgspec.structs.replace(message, time_ns=message.time_ns + round(by_s * NS_PER_S))
    return replace(arrival, envelope=Envelope(arrival.envelope.address, moved))


def _is_of(arrival: Arrival, source: str | None) -> bool:
    return arrival.is_foot and source in (None, arrival.envelope.address.source)


def _second(arrival: Arrival) -> float:
    return (arrival.at_ns - BEGIN_NS) / NS_PER_S


# --- of a sensor -----------------------------------------------------------------------------------------------


def foot(change: Change, place: str = RIGHT) -> RunChange:
    """One foot's unit is changed."""
    return lambda run: replace(run, imus=run.imus | {place: change(run.imus[place])})


def after(change: Change, begin_s: float = _MIDDLE_S) -> Change:
    """The same from a time on."""

    def part(imu: ImuSeries) -> ImuSeries:
        later = (imu.time_s >= begin_s)[:, None]
        changed = change(imu)
        return replace(
            imu,
            accel_m_s2=np.where(later, changed.accel_m_s2, imu.accel_m_s2),
            gyro_rad_s=np.where(later, changed.gyro_rad_s, imu.gyro_rad_s),
        )

    return part


def stuck(imu: ImuSeries) -> ImuSeries:
    """From the middle on the unit repeats its last sample."""
    last = int(np.searchsorted(imu.time_s, _MIDDLE_S))
    held = np.minimum(np.arange(len(imu.time_s)), last)
    return replace(imu, accel_m_s2=imu.accel_m_s2[held], gyro_rad_s=imu.gyro_rad_s[held])


def clock(ppm: float) -> Change:
    """The unit's clock runs so much too fast."""
    return lambda imu: replace(imu, time_s=imu.time_s * (1.0 + 1e-6 * ppm))


def noisy(imu: ImuSeries) -> ImuSeries:
    """A loose connector: large random numbers on all axes."""
    rng = np.random.default_rng(_SEED)
    return replace(
        imu,
        accel_m_s2=imu.accel_m_s2 + rng.normal(0.0, 30.0, imu.accel_m_s2.shape),
        gyro_rad_s=imu.gyro_rad_s + rng.normal(0.0, 5.0, imu.gyro_rad_s.shape),
    )


# --- what is expected ------------------------------------------------------------------------------------------


def same(found: Outcome, untouched: Outcome) -> bool:
    """Not a hair different."""
    pairs = dict(zip(untouched.seconds.round(3), untouched.errors_m, strict=True))
    both = [
        (error, pairs[t])
        for t, error in zip(found.seconds.round(3), found.errors_m, strict=True)
        if t in pairs
    ]
    return len(both) > 0.99 * len(pairs) and all(abs(one - other) < _SAME_M for one, other in both)


def within(p95_m: float, *counted: str) -> Check:
    """The error stays within, the ellipse tells the truth, and these counts are not zero."""
    return lambda found, _: (
        found.p95_m <= p95_m
        and found.inside_95_pct >= _TRUTHFUL_PCT
        and all(found.counters[name] > 0 for name in counted)
    )


def alone_on(source: str, p95_m: float) -> Check:
    """Later only this foot is named as a source; the error stays within."""
    other = ({LEFT, RIGHT} - {source}).pop()
    return lambda found, _: other not in found.sources(*_LATER_S) and within(p95_m)(found, found)


def counted_same(found: Outcome, untouched: Outcome) -> bool:
    """The copies were seen, and did nothing."""
    return same(found, untouched) and found.counters["duplicate_steps"] > 0


def joined_again(found: Outcome, _: Outcome) -> bool:
    """The foot is named again after its silence."""
    return found.p95_m <= 1.5 and RIGHT in found.sources(125.0, 140.0)


def on_the_way(name: str, expected: str, check: Check, change: StreamChange, **options: Any) -> Damage:
    """A damage of messages on their way."""
    return Damage(name, expected, check, on_stream=change, **options)


def of_the_right_unit(name: str, expected: str, check: Check, change: Change) -> Damage:
    """A damage of the right foot's sensor."""
    return Damage(f"right unit {name}", expected, check, on_run=foot(change))


def dying(name: str, expected: str, check: Check, satellites: bool = False, **dies_s: float) -> Damage:
    """A service dies, and is back after two seconds."""
    return Damage(name, expected, check, options=dies_s, satellites=satellites)


DAMAGES: Sequence[Damage] = (
    Damage("untouched", "within 0.6 m", within(0.6)),
    on_the_way("all messages 0.2 s late", "the same positions", same, late(0.2)),
    on_the_way("a third 0.15 s late: out of order", "the same positions", same, late(0.15, share=0.33)),
    on_the_way(
        "right foot 1.5 s late",
        "as late as it: within 2.5 m",
        within(2.5, "late_foot_step"),
        late(1.5, RIGHT),
    ),
    on_the_way("everything twice", "counted, the same positions", counted_same, doubled),
    on_the_way("5 % of messages lost", "made good, within 1 m", within(1.0, "steps_made_good"), lost(0.05)),
    on_the_way("20 % of messages lost", "owned up to, within 12 m", within(12.0, "lost_steps"), lost(0.2)),
    on_the_way("1 % of poses an hour ahead", "refused, within 0.6 m", within(0.6), stamped(3600.0, 0.01)),
    on_the_way("1 % of poses 5 s ahead", "5 s of way too late: within 8 m", within(8.0), stamped(5.0, 0.01)),
    on_the_way(
        "right foot silent from 80 s", "left alone, within 2 m", alone_on(LEFT, 2.0), silent(RIGHT, 80.0)
    ),
    on_the_way(
        "right foot silent for 20 s", "joins again, within 1.5 m", joined_again, silent(RIGHT, 80.0, 100.0)
    ),
    of_the_right_unit("with a clock 200 ppm fast", "within 0.8 m", within(0.8), clock(200.0)),
    of_the_right_unit("with a clock 0.5 % fast", "within 1.5 m", within(1.5), clock(5000.0)),
    of_the_right_unit("stuck from 80 s", "left alone, within 2 m", alone_on(LEFT, 2.0), stuck),
    of_the_right_unit("noise from 80 s", "left alone, within 2 m", alone_on(LEFT, 2.0), after(noisy)),
    of_the_right_unit("bias 0.3 rad/s from 80 s", "within 1.5 m", within(1.5), after(biased(0.3))),
    of_the_right_unit(
        "clips at 150 °/s", "left alone, within 6 m", alone_on(LEFT, 6.0), clipped(gyro_deg_s=150.0)
    ),
    of_the_right_unit("loses 20 % of samples", "within 1 m", within(1.0), missing(0.2)),
    dying("fusion dies", "goes on, within 0.8 m", within(0.8, "memory_gone_on_from"), fusion_dies_s=80.0),
    dying("pdr-engine dies", "goes on, within 0.8 m", within(0.8, "late_foot_step"), engine_dies_s=90.0),
    dying("... in a corner", "goes on, within 0.8 m", within(0.8, "late_foot_step"), engine_dies_s=80.0),
    dying(
        "both die in a corner, with satellites",
        "within 1.5 m",
        within(1.5, "memory_gone_on_from"),
        satellites=True,
        engine_dies_s=80.0,
        fusion_dies_s=80.0,
    ),
    dying("gateway dies", "gap owned up to, within 8 m", within(8.0), gateway_dies_s=90.0),
    dying(
        "... in a corner, with satellites", "within 10 m", within(10.0), satellites=True, gateway_dies_s=80.0
    ),
    Damage("with satellites", "within 1.5 m", within(1.5, "gnss_accepted"), satellites=True),
    on_the_way(
        "receiver 20 s ahead", "refused, within 0.6 m", within(0.6), receiver_ahead(20.0), satellites=True
    ),
)


def findings(damages: Sequence[Damage] = DAMAGES) -> Iterator[Finding]:
    """Every damage done to the walk alone."""
    untouched = played()
    for damage in damages:
        options = {"satellites": damage.satellites, **(damage.options or {})}
        outcome = played(damage.on_run, damage.on_stream, **options)
        yield Finding(damage, outcome, damage.check(outcome, untouched))


def damages_table(found: Sequence[Finding]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| damage | expected | p95 m | end m | inside 95 % | told | as expected |",
        "|---|---|---|---|---|---|---|",
    ]
    return lines + [_line(finding) for finding in found]


_TELLING = (
    "late_foot_step",
    "late_foot_pose",
    "duplicate_steps",
    "lost_steps",
    "steps_made_good",
    "foot_restarts",
    "feet_apart",
    "feet_diverged",
    "feet_dropped",
    "implausible_steps",
    "poses_after_silence",
    "poses_out_of_reach",
    "memory_gone_on_from",
    "gnss_rejected",
    "gnss_too_late",
)


def _line(finding: Finding) -> str:
    outcome = finding.outcome
    told = ", ".join(f"{name} {outcome.counters[name]}" for name in _TELLING if outcome.counters[name])
    cells = (
        finding.damage.name,
        finding.damage.expected,
        f"{outcome.p95_m:.2f}",
        f"{outcome.end_m:.2f}",
        f"{outcome.inside_95_pct:.0f}",
        told or "–",
        "yes" if finding.as_expected else "**no**",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """The command: the table on standard output."""
    logs.configure("error")
    sys.stdout.write("\n".join(damages_table(list(findings()))) + "\n")


if __name__ == "__main__":
    main()
