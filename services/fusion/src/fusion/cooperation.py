"""Ranges to the others of the squad correct a soldier who is less sure than they are (METHODS D10).

A peer's position may itself stem from what this soldier told, and errs alike from one range to the next. So ranges
are never averaged in as if they were news: where a peer is surer along the line between the two than the soldier
is, the soldier's error along that line becomes the peer's (`fusion.filter.Measurement.entangled`); where not,
nothing happens. A squad can so pass on what its surest member knows, and no rumour makes anybody surer than that.

Before anything is believed the peers must fit together (`fusion.consensus`); one who does not is left out for a
while. Who is unplaced, or too unsure for lines, is located by three peers or more, or is beside the one in range.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.messages import Range, Track, Vector3
from fusion.boots import Boots
from fusion.config import PeersConfig
from fusion.consensus import agreeing, bend_m2, line, located
from fusion.filter import Measurement
from fusion.models import body
from fusion.peers import Peers, Sight
from fusion.placement import Place
from fusion.state import Array

GROUP = "peers"  # of places that err alike, for placing
_POSE_SIGMA_M = 0.1  # of a body against its feet
_SURE_RAD = (
    0.35  # ranges through walls, believed whole, mend a heading that drifts, and would invent a lost one
)
_BEND_SHARE = 1.0  # of a line's own variance: bent more, a range is no line


class Cooperation:
    """What the squad's ranges do to one soldier's boots."""

    def __init__(self, config: PeersConfig, origin: Origin, counters: Counter[str]) -> None:
        self._config = config
        self._counters = counters
        self._peers = Peers(config, origin)
        self._next_ns: int | None = None
        self._doubted_ns: dict[str, int] = {}  # peers that contradicted, and when

    def track(self, track: Track) -> None:
        """The own hub tells where another soldier is."""
        self._peers.track(track)

    def range(self, boots: Boots, message: Range) -> Place | None:
        """A range was measured: now and then boots in ENU are corrected by all of them; others get a place."""
        if boots.reference is None:
            return None
        now_ns = message.time_ns
        self._peers.range(message, boots.place_at(now_ns, boots.alive(now_ns)) if boots.in_enu else None)
        if not self._is_due(now_ns):
            return None
        if not boots.in_enu:
            return self.place(now_ns, boots.track_point())
        self.correct(boots, now_ns)
        return None

    def _is_due(self, now_ns: int) -> bool:
        interval_ns = round(self._config.interval_s * NS_PER_S)
        if self._next_ns is not None and 0 < self._next_ns - now_ns <= interval_ns:
            return False
        self._next_ns = now_ns + interval_ns
        return True

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._peers.shift(by_ns)
        self._next_ns = None
        self._doubted_ns.clear()

    def doubted(self, now_ns: int) -> tuple[str, ...]:
        """Peers that are left out now."""
        lasts_ns = self._config.distrust_s * NS_PER_S
        return tuple(sorted(peer for peer, at in self._doubted_ns.items() if 0 <= now_ns - at <= lasts_ns))

    # --- a placed soldier --------------------------------------------------------------------------------------

    def correct(self, boots: Boots, now_ns: int) -> None:
        """Take over along each line what surer peers know."""
        stands = boots.stands(now_ns)
        if not stands:
            return
        here, spread = _believed(boots, stands)
        seen = self._seen(now_ns, here)
        sights, contradicting = agreeing(seen, here, spread, self._config.gate_probability)
        if not sights:
            moved = self._relocate(boots, stands, seen, contradicted=True)
        elif self._is_astray(sights, here, spread):
            moved = self._relocate(boots, stands, sights)
        else:
            ordered = sorted(sights, key=lambda one: one.place_sigma_m)
            moved = sum(self._draw(boots, stands, sight) for sight in ordered) > 0
        if moved:
            self._peers.clear_ranges()
        if sights or not moved:
            self._leave_out(contradicting, now_ns)

    def _seen(self, now_ns: int, here: Array | None) -> list[Sight]:
        left_out = self.doubted(now_ns)
        return [sight for sight in self._peers.sights(now_ns, here) if sight.peer not in left_out]

    def _leave_out(self, sights: Sequence[Sight], now_ns: int) -> None:
        for sight in sights:
            self._doubted_ns[sight.peer] = now_ns
            self._counters["peers_left_out"] += 1

    def _is_astray(self, sights: Sequence[Sight], here: Array, spread: Array) -> bool:
        """Whether the soldier is too unsure for most ranges to be lines."""
        bent = [
            self._bend_m2(sight, here, spread) > _BEND_SHARE * line(sight, here).variance_m2
            for sight in sights
        ]
        return len(sights) >= 3 and 2 * sum(bent) > len(bent)

    def _bend_m2(self, sight: Sight, here: Array, spread: Array) -> float:
        both = spread + sight.place_sigma_m**2 * np.eye(2)
        return bend_m2(line(sight, here).toward, both, sight.distance_m)

    def _draw(self, boots: Boots, stands: Sequence[body.Stand], sight: Sight) -> bool:
        """Along one line; whether the boots were moved."""
        here, spread = _believed(boots, stands)
        seen = line(sight, here)
        variance = seen.variance_m2 + self._bend_m2(sight, here, spread)
        if variance >= self._config.worth * float(seen.toward @ spread @ seen.toward):
            return False
        jacobian = seen.toward @ body.position_jacobian(boots.filter.state, stands)[:2]
        found = boots.correct(
            Measurement(
                "range",
                np.array([seen.residual_m]),
                jacobian[None, :],
                np.array([[variance]]),
                gate_probability=self._config.gate_probability,
                entangled=True,
                carries=boots.beyond_tangent(stands, math.sqrt(variance), _SURE_RAD),
            )
        )
        self._counters["ranges_taken" if found.accepted else "ranges_refused"] += 1
        return found.accepted

    def _relocate(
        self,
        boots: Boots,
        stands: Sequence[body.Stand],
        sights: Sequence[Sight],
        *,
        contradicted: bool = False,
    ) -> bool:
        """By all ranges at once, from wherever the soldier was thought to be.

        ``contradicted``: the soldier fits with none of them. If they fit together, it is the soldier who is lost.
        """
        here, spread = _believed(boots, stands)
        found = located(sights, float(here[2]), self._config.gate_probability)
        if found is None:
            return False
        away = found.place - here[:2]
        if contradicted:
            surprise = np.maximum(0.0, away**2 - np.diag(spread))
            boots.filter.widen_together(np.diag([*surprise, 0.0]))
            self._counters["corrected_by_all_peers"] += 1
        elif np.trace(found.covariance) >= self._config.worth * np.trace(spread):
            return False
        sigma_m = math.sqrt(0.5 * float(np.trace(found.covariance)))
        carries = boots.beyond_tangent(stands, sigma_m, _SURE_RAD)
        jacobian = body.position_jacobian(boots.filter.state, stands)[:2]
        boots.correct(Measurement("range", away, jacobian, found.covariance, entangled=True, carries=carries))
        self._counters["located_by_ranges"] += 1
        return True

    # --- an unplaced one ---------------------------------------------------------------------------------------

    def place(self, now_ns: int, local: Vector3) -> Place | None:
        """Where ranges say that an unplaced soldier is, who is at ``local`` in the boots frame; None if nowhere."""
        sights = self._seen(now_ns, None)
        if not sights:
            return None
        nearest = min(sights, key=lambda sight: math.hypot(sight.distance_m, sight.place_sigma_m))
        up_m = float(nearest.place[2])
        found = located(sights, up_m, self._config.gate_probability)
        enu, sigma_m = _beside(nearest)
        if found is not None:
            by_all_m = math.sqrt(float(np.linalg.eigvalsh(found.covariance)[-1]))
            if by_all_m < sigma_m:
                enu, sigma_m = (float(found.place[0]), float(found.place[1]), up_m), by_all_m
        if sigma_m > self._config.placement_accuracy_m:
            return None
        self._counters["places_by_ranges"] += 1
        return Place(now_ns, enu, sigma_m, math.hypot(sigma_m, nearest.distance_m), local, GROUP)


def _believed(boots: Boots, stands: Sequence[body.Stand]) -> tuple[Array, Array]:
    """Where the boots say that the body is (3,) m, and how sure in the plane (2, 2) m²."""
    state, covariance = boots.filter.state, boots.filter.covariance
    spread: Array = body.position_covariance(state, covariance, stands)[:2, :2] + _POSE_SIGMA_M**2 * np.eye(2)
    return body.position(state, stands), spread


def _beside(sight: Sight) -> tuple[Vector3, float]:
    """On a circle around a peer: its middle, and the sigma of an axis."""
    east, north, up = (float(part) for part in sight.place)
    return (east, north, up), math.hypot(sight.place_sigma_m, math.sqrt(0.5) * sight.distance_m)
