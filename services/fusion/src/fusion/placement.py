"""How a soldier gets a place and a heading: known points, directions walked off in, satellite tracks.

The filter runs from the first step on in the boots frame (`fusion.state`). Placing is one rigid move of that frame
into ENU, found here from

- **places**: "at this moment the soldier was there" (``[fusion.start]``, a `Fix`, a satellite fix);
- a **heading hint**: "from here they walk off in this direction" (the azimuth of the start or of a `Fix`). A boot's
  sensor sits at an unknown angle on the boot, so an azimuth cannot be compared with the sensor's yaw; it is
  compared with the direction of the first metres walked. After half a metre the direction is provisional
  (published, with its large σ), after ``align.distance_m`` it is taken.
- **two tracks laid over one another**: without a hint, the walked track is fitted to the places once it is long
  against their errors, satellite errors taken as correlated in time.

Until the heading is known only the place is: the soldier is within a circle around it, of the distance moved since.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame, wrap_angle
from bootprint.messages import Vector3
from fusion.alignment import RigidFit, Walk, fit_rigid
from fusion.chi_square import chi_square_quantile
from fusion.config import AlignConfig, GnssConfig, StartConfig
from fusion.state import Array
from fusion.transform import RigidTransform

UNKNOWN_UP_SIGMA_M = 100.0
_STANCE_SIGMA_M = 0.3  # the body is not exactly over the foot whose track is fitted
_SPACING_M = 1.0  # places nearer to each other tell no direction
_MOST_PLACES = 60
_BEGINNING = (0.0, 0.0, 0.0)  # of the boots frame, where nothing has erred
_CROOKED = 1.5  # a path so much longer than its chord is not straight


@dataclass(frozen=True, slots=True)
class Place:
    """Where the soldier was (ENU) when the boots frame said ``local``. Errors of one ``group`` are correlated."""

    time_ns: int
    enu: Vector3
    sigma_m: float
    up_sigma_m: float | None
    local: Vector3
    group: str | None = None


def known_point(start: StartConfig, frame: LocalFrame, time_ns: int) -> Place:
    """The configured start: where the boots frame begins."""
    east, north = start.east_m or 0.0, start.north_m or 0.0
    if start.latitude_deg is not None and start.longitude_deg is not None:
        height_m = frame.origin.height_m + start.up_m
        east, north, _ = frame.to_enu(start.latitude_deg, start.longitude_deg, height_m)
    return Place(time_ns, (east, north, start.up_m), start.sigma_m, start.up_sigma_m, (0.0, 0.0, 0.0))


@dataclass(slots=True)
class HeadingHint:
    """The soldier walks off from ``place`` in the direction ``yaw_rad`` (counter-clockwise from east).

    ``turn_rad`` is by how much the walked direction must be turned to be the one named, ``turn_sigma_rad`` how sure
    that is: of all the chords since the start the one that tells most, which in a walk that bends is an early one.
    """

    place: Place
    yaw_rad: float
    sigma_rad: float
    walk: Walk
    turn_rad: float = 0.0
    turn_sigma_rad: float = math.inf
    # ... if that is the newest one, of a walk from where the frame begins: its end
    sighted: Vector3 | None = None

    def go(self, to: Vector3, align: AlignConfig) -> None:
        """The soldier has made a step to here."""
        self.walk.go(to)
        self.sighted = None
        if self.walk.chord_m < align.provisional_m:
            return
        sigma = math.hypot(self.sigma_rad, self.walk.sigma_rad(align))
        if sigma < self.turn_sigma_rad:
            self.turn_rad, self.turn_sigma_rad = wrap_angle(self.yaw_rad - self.walk.direction_rad), sigma
            self.sighted = to if self.place.local == _BEGINNING else None

    @property
    def is_begun(self) -> bool:
        """Whether a direction is known at all."""
        return math.isfinite(self.turn_sigma_rad)

    def is_learned(self, align: AlignConfig) -> bool:
        """Whether the soldier has walked far enough, or so much that the beginning will not get any clearer."""
        far_enough = self.walk.chord_m >= align.distance_m or self.walk.path_m >= _CROOKED * align.distance_m
        return self.is_begun and far_enough


@dataclass(slots=True)
class Placement:
    """What is known about where the boots frame lies, until it is known well enough to move the filter there."""

    align: AlignConfig
    gnss: GnssConfig
    places: list[Place] = field(default_factory=list)
    hint: HeadingHint | None = None
    course: tuple[float, float] | None = None  # the turn into ENU and its sigma, rad, as Doppler tells it
    refused: int = 0  # places that did not fit the track
    _fit: RigidTransform | None = None

    def observe(self, place: Place) -> None:
        """A place has become known; perhaps it makes the fit of the tracks good enough."""
        if self._replaces_last(place):
            self.places.pop()
        elif self.places and _apart(self.places[-1], place) < _SPACING_M and place.group is not None:
            return
        self.places.append(place)
        if len(self.places) > _MOST_PLACES:
            del self.places[1::2]  # thin out: the length of the walk tells the heading
        self._fit_tracks()

    def _replaces_last(self, place: Place) -> bool:
        if not self.places or _apart(self.places[-1], place) >= _SPACING_M:
            return False
        return place.group is None or place.sigma_m < self.places[-1].sigma_m

    def point_to(self, place: Place, yaw_rad: float, sigma_rad: float) -> None:
        """The soldier will walk off from this place in this direction."""
        self.hint = HeadingHint(place, yaw_rad, sigma_rad, Walk.begin(place.local))

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        self.places = [replace(place, time_ns=place.time_ns + by_ns) for place in self.places]

    @property
    def final(self) -> RigidTransform | None:
        """The move into ENU once it is sure enough to be made."""
        if self.hint is not None and self.hint.is_learned(self.align):
            return self._hinted(self.hint)
        return self._fit or (None if self.course is None else self._turned(*self.course))

    @property
    def northward(self) -> RigidTransform | None:
        """The move to the best known place of a frame whose yaw is true already; None before any is known."""
        return self._turned(0.0, 0.0)

    def _turned(self, yaw_rad: float, sigma_rad: float) -> RigidTransform | None:
        """The move by a known turn to the best known place; None before any is known."""
        best = min(self.places, key=lambda place: place.sigma_m, default=None)
        if best is None:
            return None
        up_sigma = UNKNOWN_UP_SIGMA_M if best.up_sigma_m is None else best.up_sigma_m
        covariance = np.diag([best.sigma_m**2, best.sigma_m**2, up_sigma**2, sigma_rad**2])
        return RigidTransform(best.local, best.enu, yaw_rad, covariance)

    @property
    def provisional(self) -> RigidTransform | None:
        """The move into ENU as far as a heading hint and a first step tell it."""
        if self.hint is not None and self.hint.is_begun:
            return self._hinted(self.hint)
        return None

    def nearest(self, local: Vector3) -> tuple[Place, float] | None:
        """The place that tells most about where the soldier is now, and the variance per axis, m².

        With unknown heading the soldier is anywhere on a circle of the distance d moved: variance d²/2 per axis.
        """
        if not self.places:
            return None

        def variance(place: Place) -> float:
            moved = math.hypot(local[0] - place.local[0], local[1] - place.local[1])
            return place.sigma_m**2 + 0.5 * moved**2

        best = min(reversed(self.places), key=variance)
        return best, variance(best)

    def around(self, local: Vector3, walked: Array) -> tuple[Place, Vector3, Array] | None:
        """Heading unknown: on a circle around the place that tells most; it, ENU, and the covariance (3, 3), m².

        ``walked`` (3, 3): how sure the way is. None if no place is known.
        """
        nearest = self.nearest(local)
        if nearest is None:
            return None
        place, variance = nearest
        up_sigma_m = UNKNOWN_UP_SIGMA_M if place.up_sigma_m is None else place.up_sigma_m
        enu = (place.enu[0], place.enu[1], place.enu[2] + local[2] - place.local[2])
        return place, enu, np.diag([variance, variance, up_sigma_m**2]) + np.diag(np.diag(walked))

    def _hinted(self, hint: HeadingHint) -> RigidTransform:
        place = hint.place
        horizontal = place.sigma_m**2
        up_sigma = UNKNOWN_UP_SIGMA_M if place.up_sigma_m is None else place.up_sigma_m
        covariance = np.diag([horizontal, horizontal, up_sigma**2, hint.turn_sigma_rad**2])
        return RigidTransform(place.local, place.enu, hint.turn_rad, covariance, hint.sighted)

    def _fit_tracks(self) -> None:
        """Fit the walked track to the places; a worst one that cannot be true is dropped and the rest waits."""
        if len(self.places) < 2 or all(_apart(self.places[0], place) < _SPACING_M for place in self.places):
            return
        track = np.array([place.local[:2] for place in self.places])
        enu = np.array([place.enu[:2] for place in self.places])
        fit = fit_rigid(track, enu, self._place_covariance())
        if fit.chi_square > chi_square_quantile(self.gnss.gate_probability, 2 * len(track) - 3):
            self._drop_worst(fit)
        elif math.sqrt(fit.covariance[2, 2]) <= math.radians(self.gnss.placement_heading_sigma_deg):
            self._fit = self._with_height(fit)

    def _place_covariance(self) -> Array:
        """Errors of the places, one axis (k, k), m².

        A receiver's error has a part that is new each time and one that lives for ``correlation_s``. How large
        each is nobody says; so both are taken as large as the stated accuracy, and no baseline looks too good.
        """
        sigma = np.array([place.sigma_m for place in self.places])
        time = np.array([place.time_ns / NS_PER_S for place in self.places])
        group = np.array([place.group or f"#{index}" for index, place in enumerate(self.places)])
        apart = np.abs(time[:, None] - time[None, :]) / max(self.gnss.correlation_s, 1e-3)
        shared = np.where(group[:, None] == group[None, :], np.exp(-apart), 0.0)
        satellites = np.array([place.group is not None for place in self.places])
        np.fill_diagonal(shared, np.where(satellites, 2.0, 1.0))
        return np.outer(sigma, sigma) * shared + _STANCE_SIGMA_M**2 * np.eye(len(sigma))

    def _drop_worst(self, fit: RigidFit) -> None:
        sigma = np.array([place.sigma_m for place in self.places])
        worst = int(np.argmax(np.hypot(*fit.residuals.T) / sigma))
        del self.places[worst]
        self.refused += 1

    def _with_height(self, fit: RigidFit) -> RigidTransform:
        known = [place for place in self.places if place.up_sigma_m is not None]
        best = min(known, key=lambda place: place.up_sigma_m or 0.0, default=None)
        covariance = np.zeros((4, 4))
        planar = np.array([0, 1, 3])
        covariance[np.ix_(planar, planar)] = fit.covariance
        sigma = UNKNOWN_UP_SIGMA_M if best is None or best.up_sigma_m is None else best.up_sigma_m
        covariance[2, 2] = sigma**2
        pivot_up, target_up = (0.0, 0.0) if best is None else (best.local[2], best.enu[2])
        return RigidTransform(
            (float(fit.pivot[0]), float(fit.pivot[1]), pivot_up),
            (float(fit.target[0]), float(fit.target[1]), target_up),
            wrap_angle(fit.yaw_rad),
            covariance,
        )


def _apart(one: Place, other: Place) -> float:
    return math.hypot(one.local[0] - other.local[0], one.local[1] - other.local[1])
