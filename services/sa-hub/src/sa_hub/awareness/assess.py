"""One friendly against what is dangerous around us: places relative to ours, and the probability of each reason."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from bootprint.awareness import Reason
from bootprint.clock import NS_PER_S
from bootprint.display import Held, free_sigma_m, sigma_m
from bootprint.geodesy import ground_offset, moved_place
from bootprint.prediction import moved_m
from sa_hub.awareness.danger import Corridor, Place, in_circle, in_corridor
from sa_hub.awareness.lines import Target
from sa_hub.awareness.warner import Danger
from sa_hub.radio.content import Report
from sa_hub.tracks import Known

_BEYOND_SIGMAS: Final = 4.0
"""A friendly farther beyond all that is dangerous than this is in no danger."""
_CLOSING_M_S: Final = 10.0
"""Two who run towards each other; doubt grows more slowly."""
_LONGEST_CLEAR_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class Standpoint:
    """Where we are believed to be now; height above the ellipsoid, one sigma for any horizontal direction."""

    latitude_deg: float
    longitude_deg: float
    sigma_m: float
    height_m: float | None
    floor: int | None


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What is dangerous around us: within ``near_m`` of us or of a target, and in the corridors."""

    near_m: float
    corridors: tuple[tuple[Reason, Corridor], ...] = ()
    targets: tuple[Target, ...] = ()

    @property
    def reach_m(self) -> float:
        """How far from us there is danger at all."""
        lines = (corridor.range_m + corridor.half_width_m for _, corridor in self.corridors)
        targets = (math.hypot(each.east_m, each.north_m) + 3.0 * each.sigma_m for each in self.targets)
        return self.near_m + max((0.0, *lines, *targets))


def standpoint_of(own: Known, now_ns: int) -> Standpoint:
    """Our own place, moved on since it came."""
    report = own.report
    age_s = max(0, now_ns - own.received_ns) / NS_PER_S
    place = moved_place(
        (report.latitude_deg, report.longitude_deg), *moved_m(report.east_m_s, report.north_m_s, age_s)
    )
    doubt_m = math.hypot(report.accuracy_m, free_sigma_m(age_s))
    return Standpoint(*place, doubt_m, report.height_m, report.floor)


def danger_of(
    friendly: str, known: Known, us: Standpoint, around: Surroundings, held: Held | None, now_ns: int
) -> Danger:
    """The likeliest place of this friendly in what is dangerous, and the probability of each reason.

    Who is not fresh *may* still be where the last report was, whatever the prediction says.
    """
    report = known.report
    age_s = (now_ns - report.time_ns) / NS_PER_S
    places = [_moved(report, us, age_s, held)]
    if known.state != "fresh":
        places.append(_last(report, us))
    found = [(dict(_probabilities(place, around)), place) for place in places]
    probabilities = {
        reason: max(each.get(reason, 0.0) for each, _ in found) for each, _ in found for reason in each
    }
    _, likeliest = max(found, key=lambda pair: max(pair[0].values(), default=0.0))
    return Danger(friendly, likeliest, probabilities, known.state, age_s, report.floor)


def clear_for_s(place: Place, reach_m: float) -> float:
    """For how long somebody this far from all danger cannot get into it, at most so long as a jump may matter."""
    beyond_m = place.distance_m - reach_m - _BEYOND_SIGMAS * place.sigma_m
    return min(beyond_m / _CLOSING_M_S, _LONGEST_CLEAR_S)


def _moved(report: Report, us: Standpoint, age_s: float, held: Held | None) -> Place:
    """Where the prediction puts them by now."""
    doubt_m = sigma_m(_accuracy_m(report), age_s, held)
    return _place(report, us, moved_m(report.east_m_s, report.north_m_s, age_s), doubt_m)


def _last(report: Report, us: Standpoint) -> Place:
    """Where they said they were."""
    return _place(report, us, (0.0, 0.0), _accuracy_m(report))


def _accuracy_m(report: Report) -> float:
    return math.hypot(report.accuracy_m, report.cell_m / math.sqrt(12.0))


def _place(report: Report, us: Standpoint, moved: tuple[float, float], doubt_m: float) -> Place:
    east_m, north_m = ground_offset(
        (us.latitude_deg, us.longitude_deg), (report.latitude_deg, report.longitude_deg)
    )
    heights = report.height_m, us.height_m
    floors = report.floor, us.floor
    return Place(
        east_m=east_m + moved[0],
        north_m=north_m + moved[1],
        sigma_m=math.hypot(doubt_m, us.sigma_m),
        up_m=None if heights[0] is None or heights[1] is None else heights[0] - heights[1],
        same_floor=None if None in floors else floors[0] == floors[1],
    )


def _probabilities(place: Place, around: Surroundings) -> Iterator[tuple[Reason, float]]:
    """Each reason's largest; nothing for who is far from all of it."""
    if place.distance_m > around.reach_m + _BEYOND_SIGMAS * place.sigma_m:
        return
    yield "near", in_circle(place, around.near_m)
    reasons: dict[Reason, float] = {}
    for reason, corridor in around.corridors:
        reasons[reason] = max(reasons.get(reason, 0.0), in_corridor(place, corridor))
    yield from reasons.items()
    if around.targets:
        yield "near_target", max(_at_targets(place, around))


def _at_targets(place: Place, around: Surroundings) -> Iterable[float]:
    """Probability to be as near to a target as is dangerous, for each; of its height nothing is known."""
    for target in around.targets:
        beside = Place(
            east_m=place.east_m - target.east_m,
            north_m=place.north_m - target.north_m,
            sigma_m=math.hypot(place.sigma_m, target.sigma_m),
        )
        yield in_circle(beside, around.near_m)
