"""Holds a walk by others' maps of the same rooms.

A map is a shape, not a place on earth: who follows and who went before stood beside the same walls with the same
satellites, so that their agreement would prove nothing. So a map is *laid* on the own walk where it fits one of its
first stretches well; its offset becomes a state, as wrong as the own position is just then (`StateFilter.attach`),
and its turn about that place one that is unknown as yet. With b the offset, t the turn and c the place, a walk at p
is seen on the map at ``p + b + t·z×(p − c)``.
From then on each stretch that shows the offset anew tells what the walk has drifted since. How the map is bent,
its mapper's drift between there and here, is noise of the look.

Nothing is learned of a stretch that is no likelier by the map than anywhere. A map that fits clearly better
elsewhere than the walk can have drifted, or that leaps, is taken off: it, or the walk, is not what it was.
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bootprint.geodesy import major_axis_sigma_m
from bootprint.messages import Position
from bootprint.rooms import RoomMap
from fusion.boots import Boots
from fusion.filter import Measurement
from fusion.models import body
from fusion.rooms.field import RoomField
from fusion.rooms.matching import Look, look
from fusion.rooms.settings import RoomsConfig
from fusion.rooms.survey import Stood, stood_at
from fusion.state import Array

_MOST_MAPS = 16
_GATE = 0.999
_QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # z×
_LONGEST_LEAP_M = 1.0  # between two positions: somebody has put the walk elsewhere
_SETTLED_M = 5.0  # a stretch that showed nothing is laid again after so much more way


@dataclass(slots=True)
class _Known:
    """Another's map, its floors as they are needed, and where it was last looked at."""

    rooms: RoomMap
    floors: dict[int, RoomField | None] = field(default_factory=dict)
    sigma_m: float = 0.0  # of the mapper where it was laid on the walk; 0 before
    laid_at: Array = field(default_factory=lambda: np.zeros(2))  # and turns about

    def floor(self, number: int, config: RoomsConfig) -> RoomField | None:
        """The field of a floor; None where nobody has walked."""
        if number not in self.floors:
            made = RoomField(self.rooms, number, config)
            self.floors[number] = made if len(made.walked) else None
        return self.floors[number]


class RoomAid:
    """One soldier's use of others' maps."""

    def __init__(self, config: RoomsConfig, floor_height_m: float | None, counters: Counter[str]) -> None:
        self._config, self._floor_height_m, self._counters = config, floor_height_m, counters
        self._maps: dict[str, _Known] = {}
        self._walk: list[Stood] = []

    def hear(self, rooms: RoomMap) -> None:
        """Another's map, or a newer one of the same soldier."""
        known = self._maps.get(rooms.soldier)
        if known is None and len(self._maps) >= _MOST_MAPS:
            self._counters["rooms_maps_refused"] += 1
        elif known is None:
            self._maps[rooms.soldier] = _Known(rooms)
        elif rooms.time_ns > known.rooms.time_ns:
            known.rooms, known.floors = rooms, {}

    def hold(self, boots: Boots, position: Position) -> bool:
        """A position has been published: look at the maps if it is time; whether the boots were moved."""
        if not self._maps or boots.filter.tape is not None:
            return False
        self._go(stood_at(position, self._floor_height_m, self._config))
        if len(self._walk) * self._config.spacing_m < self._config.window_m:
            return False
        moved = self._lay(boots, position)
        self._walk = [] if moved else self._walk[math.ceil(_SETTLED_M / self._config.spacing_m) :]
        return moved

    def _go(self, stood: Stood | None) -> None:
        """Lengthen the stretch; one that leaves the floor, or leaps, begins anew."""
        if stood is None:
            self._walk = []
            return
        if not self._walk:
            self._walk = [stood]
            return
        last = self._walk[-1]
        way_m = math.hypot(stood.east_m - last.east_m, stood.north_m - last.north_m)
        if stood.floor != last.floor or way_m > self._config.spacing_m + _LONGEST_LEAP_M:
            self._walk = [stood]
        elif way_m >= self._config.spacing_m:
            self._walk.append(stood)

    # --- looking ------------------------------------------------------------------------------------------------

    def _lay(self, boots: Boots, position: Position) -> bool:
        """Lay the stretch over every map; the likeliest one tells."""
        walk = np.array([(stood.east_m, stood.north_m) for stood in self._walk])
        stands = boots.stands(position.time_ns)
        if not stands:
            return False
        found = [
            (seen, name, known)
            for name, known in sorted(self._maps.items())
            if (seen := self._look(boots, stands, name, known, walk)) is not None
        ]
        if not found:
            return False
        seen, name, known = max(found, key=lambda one: one[0].evidence)
        self._counters["rooms_looks"] += 1
        if boots.filter.layout.attached_of(name) is None:
            return self._register(boots, stands, name, known, seen, walk)
        return self._correct(boots, stands, name, known, seen, walk)

    def _look(
        self, boots: Boots, stands: list[body.Stand], name: str, known: _Known, walk: Array
    ) -> Look | None:
        """What this map shows; None where it has no such floor, or nobody could tell."""
        rooms = known.floor(self._walk[-1].floor, self._config)
        if rooms is None:
            return None
        jacobian, there = self._seen_at(boots, stands, name, known)
        prior = jacobian @ boots.filter.covariance @ jacobian.T
        prior += self._local_m2(known, rooms, there(walk)) * np.eye(2)
        if major_axis_sigma_m(prior[0, 0], prior[0, 1], prior[1, 1]) > self._config.most_sigma_m:
            return None
        return look(there(walk), prior, rooms, self._config)

    def _seen_at(
        self, boots: Boots, stands: list[body.Stand], name: str, known: _Known
    ) -> tuple[Array, Callable[[Array], Array]]:
        """∂(where the map has the soldier)/∂state (2, n), and how points (n, 2) of the walk come onto the map."""
        state = boots.filter.state
        jacobian = body.position_jacobian(state, stands)[:2]
        block = boots.filter.layout.attached_of(name)
        if block is None:
            return jacobian, lambda points: points
        offset, lever = state[block], body.position(state, stands)[:2] - known.laid_at
        jacobian[:, block] = np.column_stack([np.eye(2), _QUARTER @ lever])
        return (
            jacobian,
            lambda points: points + offset[:2] + offset[2] * (points - known.laid_at) @ _QUARTER.T,
        )

    def _local_m2(self, known: _Known, rooms: RoomField, walk: Array) -> float:
        """Variance of what belongs to this place alone: ways beside each other, and how the map is bent from where
        it was laid to here."""
        bent_m2 = abs(rooms.sigma_m(walk) ** 2 - known.sigma_m**2) if known.sigma_m else 0.0
        far_m = math.dist(walk[-1], known.laid_at) if known.sigma_m else 0.0
        return bent_m2 + (self._config.shape_share * far_m) ** 2 + self._config.place_sigma_m**2

    def _register(
        self, boots: Boots, stands: list[body.Stand], name: str, known: _Known, seen: Look, walk: Array
    ) -> bool:
        """Lay the map on the walk where it fits, if that is plain."""
        if not seen.is_full or seen.evidence < self._config.register_evidence:
            return False
        shift, noise = seen.shift()
        if major_axis_sigma_m(noise[0, 0], noise[0, 1], noise[1, 1]) > self._config.register_sigma_m:
            return False
        if seen.elsewhere > self._config.least_evidence:
            return False
        rooms = known.floor(self._walk[-1].floor, self._config)
        assert rooms is not None
        size = boots.filter.layout.size
        # D = b + δ: the offset is what was seen less the own error.
        response = np.vstack([-body.position_jacobian(boots.filter.state, stands)[:2], np.zeros(size)])
        doubt = np.diag([*2 * [self._config.place_sigma_m**2], self._config.map_turn_sigma_rad**2])
        doubt[:2, :2] += noise
        known.laid_at = body.position(boots.filter.state, stands)[:2]
        boots.filter.attach(name, np.append(shift, 0.0), response, doubt)
        known.sigma_m = rooms.sigma_m(walk + shift)
        self._counters["rooms_laid"] += 1
        return True

    def _correct(
        self, boots: Boots, stands: list[body.Stand], name: str, known: _Known, seen: Look, walk: Array
    ) -> bool:
        """The map tells what the walk has drifted since it was looked at last."""
        block = boots.filter.layout.attached_of(name)
        assert block is not None
        if seen.elsewhere > self._config.register_evidence:
            return self._take_off(boots, name)
        if seen.evidence < self._config.least_evidence or len(seen.values) == 0:
            return False
        rooms = known.floor(self._walk[-1].floor, self._config)
        assert rooms is not None
        jacobian, there = self._seen_at(boots, stands, name, known)
        boots.filter.loosen(block, np.diag([*2 * [self._config.offset_walk_m**2], 0.0]))
        local = self._local_m2(known, rooms, there(walk)) * seen.rows @ seen.rows.T
        measurement = Measurement(
            "rooms",
            seen.values,
            seen.rows @ jacobian,
            np.diag(seen.noise) + local,
            gate_probability=_GATE,
        )
        if not boots.correct(measurement).accepted:
            return self._take_off(boots, name)
        self._counters["rooms_corrections"] += 1
        return True

    def _take_off(self, boots: Boots, name: str) -> bool:
        boots.filter.detach(name)
        self._counters["rooms_taken_off"] += 1
        return True
