"""The fused estimate: boots, placement, satellites and people's fixes, one event after another in event time.

Before the soldier is placed the filter runs in the boots frame and `Placement` looks for the move into ENU; once
that is sure the filter is moved, and from then on satellites and fixes are ordinary updates.
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame, yaw_of_azimuth
from bootprint.messages import (
    BodyStep,
    CameraMotion,
    Fix,
    FootPose,
    FootStep,
    GnssFix,
    Pressure,
    Range,
    Vector3,
)
from fusion import going, told
from fusion.alignment import Walk
from fusion.body_track import BodyTrack
from fusion.boots import Boots
from fusion.camera import Camera
from fusion.carriers import Carriers
from fusion.coasting import Coasting
from fusion.config import FusionConfig
from fusion.cooperation import Cooperation
from fusion.facing import Facing
from fusion.feet import Foot
from fusion.heights import Heights
from fusion.output import Estimate
from fusion.placement import HeadingHint, Place, Placement, known_point
from fusion.protection import Protection, Protector
from fusion.satellite_aid import SatelliteAid
from fusion.satellites import SatellitePosition, Satellites
from fusion.state import Array, xyz
from fusion.velocity import Courses

_BOOTS_AWAITED_NS = 3 * NS_PER_S  # so long a body's steps wait for the boots to speak
_DEFAULT_AZIMUTH_SIGMA_RAD = math.radians(10.0)  # of a fix that names an azimuth but not how sure


class Estimator:
    """Everything known about one soldier's whereabouts; fed in event time, asked at any moment."""

    def __init__(self, config: FusionConfig, origin: Origin, counters: Counter[str]) -> None:
        self._config = config
        self._frame = LocalFrame(origin)
        self._counters = counters
        self.boots = Boots(config, counters)
        self.satellites = Satellites(config.gnss, origin, counters)
        self._aid = SatelliteAid(config, self.satellites, counters)
        self._body = BodyTrack(config.body, counters)
        self._camera = Camera(self.boots, config, counters)
        self.sight = self._camera.sight  # what its newest motion told of its surroundings
        self._facing = Facing()
        self._coasting = Coasting(config.silence)
        self._carriers = Carriers(config.silence, self.satellites, self._body)
        self._heights = Heights(config, self._aid.shadows, counters)
        self._protector = Protector(self._aid.shadows)
        self.cooperation = Cooperation(config.peers, origin, counters)
        self.placement = Placement(config.align, config.gnss)
        self._courses = Courses(config.velocity, counters)
        self.placed = False
        self._without_boots = False
        self._hint: HeadingHint | None = None  # a direction to walk off in, given when already placed
        self._begun_ns = 0
        self._start = config.start  # until the first step

    # --- what comes in -----------------------------------------------------------------------------------------

    def begin(self, time_ns: int) -> None:
        """The first message has this stamp."""
        self._begun_ns = time_ns

    def go_on(self) -> None:
        """The boots go on from a placed walk: its start is long past."""
        self.placed, self._start = True, None

    def _take_start(self, first: FootStep) -> None:
        """The configured start holds where the boots begin; who joins a walk that is under way is elsewhere."""
        start, self._start = self._start, None
        if start is None:
            return
        if first.sequence != 0:
            self._counters["start_refused"] += 1
            return
        place = known_point(start, self._frame, first.time_ns)
        self.placement.observe(place)
        if start.azimuth_deg is not None:
            yaw = yaw_of_azimuth(math.radians(start.azimuth_deg))
            self.placement.point_to(place, yaw, math.radians(start.azimuth_sigma_deg))

    def step(self, place: str, step: FootStep) -> None:
        """A foot has made a step."""
        self._take_start(step)
        self._body.take_back(self.boots, self._aid.boots, step)
        taken_along = self._camera.take_back(place, step)
        dropped = self._counters["feet_dropped"]
        foot = self.boots.step(place, step)
        self._camera.put_on(place, taken_along)
        self._facing.step(place, step)
        self._aid.step(place, step)
        if self._counters["feet_dropped"] > dropped:
            self._aid.forget()  # a foot that has gone astray has led shadows astray, whom no satellite held
        self._heights.step(self.boots, place, step)
        if foot is None:
            return
        self._coasting.over()
        if foot is self.boots.reference:
            self._follow_walk()

    def _follow_walk(self) -> None:
        """Whose track stands for the walk has moved."""
        for hint in (self.placement.hint, self._hint):
            if hint is not None:
                hint.go(self.boots.track_point(), self._config.align)
        if not self.placed:
            self._try_placing()
        elif self._hint is not None and self._hint.is_learned(self._config.align):
            self._aid.forget()
            told.turn(self.boots, self._hint)
            self._hint = None

    def pose(self, place: str, pose: FootPose) -> None:
        """A foot is somewhere between two steps."""
        self.boots.pose(place, pose)
        self._aid.pose(place, pose)
        self._coasting.over()

    def camera_motion(self, source: str, motion: CameraMotion) -> None:
        """A camera has moved."""
        step = self._camera.take(source, motion)
        self.sight = self._camera.sight
        if self.boots.standing_in(motion.time_ns):
            self._aid.forget()  # shadows have no camera: they stay behind
        if step is None:
            return
        self._coasting.over()
        if self._camera.is_reference:
            self._take_start(step)
            self._follow_walk()

    def body_step(self, step: BodyStep) -> None:
        """The body-worn unit has made a step."""
        if self.boots.reference is None and step.time_ns - self._begun_ns > _BOOTS_AWAITED_NS:
            self.boots.adopt(step.start_time_ns)
            if self._start is not None:
                self.placement.observe(known_point(self._start, self._frame, step.start_time_ns))
            self._start, self._without_boots = None, True
            self._try_placing()
        self._body.step(self.boots, self._aid.boots, step)
        self._facing.body_step(step, self._body.turned)

    def pressure(self, pressure: Pressure) -> None:
        """A barometer has measured."""
        self._heights.pressure(self.boots, pressure, outdoors=bool(self.satellites.fresh(pressure.time_ns)))

    def gnss(self, source: str, fix: GnssFix, late_s: float = 0.0) -> None:
        """A receiver has a solution; one that comes late is carried along by the feet, if they remember."""
        remembered = late_s <= self._config.gnss.late_s
        moved = np.zeros(3) if late_s <= 0.0 else self.boots.moved_since(fix.time_ns) if remembered else None
        self.satellites.note_stamp(usable=moved is not None)
        if moved is None:
            self._counters["gnss_too_late"] += 1
            return
        position = self.satellites.screen(source, fix)
        if position is None:
            return
        if late_s > 0.0:
            position = self.satellites.late(position, xyz(moved) if self.placed else (0.0, 0.0, 0.0), late_s)
        elif self._aid.believes(source):
            self.placement.course = self._courses.hear(self.boots, source, fix)
            self._body.fix(source, fix)
        if self.placed:
            self._correct_by(position)
        elif position.sigma_m > self._config.gnss.placement_accuracy_m:
            self._counters["gnss_too_coarse_to_place"] += 1
        else:
            self.satellites.placed_by(position)
            local = xyz(np.array(self.boots.track_point()) - moved)
            self.placement.observe(
                Place(fix.time_ns, position.enu, position.sigma_m, position.up_sigma_m, local, source)
            )
            self._try_placing()

    def range(self, message: Range) -> None:
        """A range to another soldier: a correction, or a place for who has none."""
        if self.placed:
            self._coasting.own_up(self.boots, message.time_ns)
        place = self.cooperation.range(self.boots, message)
        if place is not None:
            self.placement.observe(place)
            self._try_placing()

    def fix(self, fix: Fix, late_s: float = 0.0) -> None:
        """A person says where the soldier is; one that comes late is the less sure by what may have been walked."""
        height_m = self._frame.origin.height_m if fix.height_m is None else fix.height_m
        enu = self._frame.to_enu(fix.latitude_deg, fix.longitude_deg, height_m)
        if not self.satellites.is_in_range(enu):
            self._counters["fixes_out_of_range"] += 1
            return
        accuracy_m = min(max(fix.accuracy_m, 0.1), 1000.0 * self._config.gnss.max_range_km)
        sigma_m = math.hypot(accuracy_m, self._config.silence.drift_m_s * late_s)
        up_sigma_m = None if fix.height_m is None else sigma_m
        place = Place(fix.time_ns, enu, sigma_m, up_sigma_m, self.boots.track_point())
        self._counters["fixes"] += 1
        if self.placed:
            self._believe(place)
        else:
            self.placement.observe(place)
        if fix.azimuth_rad is not None:
            self._point_to(place, yaw_of_azimuth(fix.azimuth_rad), fix.azimuth_sigma_rad)
        if not self.placed:
            self._try_placing()

    def _point_to(self, place: Place, yaw_rad: float, sigma_rad: float | None) -> None:
        sigma = _DEFAULT_AZIMUTH_SIGMA_RAD if sigma_rad is None else max(sigma_rad, 1e-3)
        if self.placed:
            self._hint = HeadingHint(place, yaw_rad, sigma, Walk.begin(self.boots.track_point()))
        else:
            self.placement.point_to(place, yaw_rad, sigma)

    # --- placing and correcting --------------------------------------------------------------------------------

    def _try_placing(self) -> None:
        move = self.placement.northward if self._without_boots else self.placement.final
        if move is not None and self.boots.reference is not None:
            self.boots.move(move)
            self._camera.note_move(move)
            self.placed = True
            self._protector.know(move.target)
            self._counters["placed"] += 1

    def _believe(self, place: Place) -> None:
        """A person's word is not gated."""
        self._aid.forget()
        self._body.placed()
        self._protector.know(place.enu)
        told.believe(self.boots, place, self.boots.spread_of(self.boots.alive(place.time_ns)))

    def _correct_by(self, position: SatellitePosition) -> None:
        self._coasting.own_up(self.boots, position.time_ns)
        self._body.corrected(self.satellites.silent_s(position.time_ns))
        self.boots = self._aid.correct(self.boots, position)
        self._camera.follow(self.boots)

    def held_by(self, hold: Callable[[Boots], bool]) -> None:
        """Something outside (a map) may hold a placed walk: shadows do not know of it and are forgotten."""
        if self.placed and hold(self.boots):
            self._aid.forget()

    def shift(self, by_ns: int) -> None:
        """The boots' clock has been set: all that was remembered by the old one moves along."""
        self._begun_ns += by_ns
        self._aid.forget()
        parts = (
            self.boots,
            self._camera,
            self.satellites,
            self.placement,
            self._heights,
            self.cooperation,
            self._courses,
        )
        for part in parts:
            part.shift(by_ns)

    # --- what is asked -----------------------------------------------------------------------------------------

    def estimate(self, now_ns: int) -> Estimate:
        """The answer at ``now_ns``."""
        silent_s = self.boots.silent_s(now_ns)
        alive = self.boots.alive(now_ns) if silent_s is not None else []
        going_on = alive if silent_s is not None and silent_s <= self._config.silence.coasting_s else []
        unplaced = self._unplaced(now_ns, going_on)
        known = self._pose(now_ns, silent_s, alive)
        if known is None:
            return unplaced
        enu, covariance, turn = known
        covariance = covariance + self._coasting.pending_m2(silent_s) * np.eye(3)
        dead_s = (now_ns - self._begun_ns) / NS_PER_S if silent_s is None else silent_s
        velocity, speed, course_sigma = (
            going.motion(self.boots, going_on, turn) if going_on else ((0.0, 0.0, 0.0), 0.0, None)
        )
        return replace(
            unplaced,
            mode=self._carriers.mode(self.boots, now_ns, dead_s, covariance),
            enu=enu,
            covariance=covariance,
            velocity=velocity,
            speed_m_s=speed,
            course_sigma_rad=course_sigma,
            facing=self._facing.at(self.boots, now_ns, turn),
            protection=self._protection(now_ns, enu, covariance) if self.placed else None,
        )

    def _unplaced(self, now_ns: int, going_on: list[Foot]) -> Estimate:
        """Nothing is known but that the soldier is in the area: at the origin, give or take a lot."""
        return Estimate(
            mode="unplaced",
            enu=(0.0, 0.0, 0.0),
            covariance=self._config.unplaced_sigma_m**2 * np.eye(3),
            speed_m_s=going.speed_m_s(going_on) if going_on else 0.0,
            motion=going.motion_class(self.boots, now_ns) if going_on else "unknown",
            sources=self._carriers.sources(self.boots, now_ns, going_on),
            rejections=self._left_out(now_ns),
        )

    def _left_out(self, now_ns: int) -> dict[str, str]:
        """Sources that are not believed, and why."""
        feet = dict.fromkeys(self.boots.refused, "diverged")
        peers = dict.fromkeys(self.cooperation.doubted(now_ns), "contradicted")
        return feet | self.satellites.why_refused(now_ns) | peers

    def _protection(self, now_ns: int, enu: Vector3, covariance: Array) -> Protection:
        fresh = bool(self.satellites.fresh(now_ns))
        return self._protector.protect(enu, covariance, now_ns, by_satellites=fresh)

    def _pose(
        self, now_ns: int, silent_s: float | None, alive: list[Foot]
    ) -> tuple[Vector3, Array, tuple[float, float] | None] | None:
        """Place, covariance (3, 3), and the turn (yaw, σ) of the filter's directions into ENU; None if unplaced."""
        local = self.boots.place_at(now_ns, alive)
        if self.placed:
            return xyz(local), self.boots.spread_of(alive), (0.0, 0.0)
        move = self.placement.provisional if alive else None
        if move is not None:
            jacobian = move.error_jacobian(xyz(local))[:3]
            spread = move.rotation() @ self.boots.spread_of(alive) @ move.rotation().T
            covariance = spread + jacobian @ move.covariance @ jacobian.T
            return xyz(move.point(xyz(local))), covariance, (move.yaw_rad, math.sqrt(move.covariance[3, 3]))
        around = self.placement.around(xyz(local), self.boots.spread_of(alive) if alive else np.zeros((3, 3)))
        if around is None:
            return None
        place, enu, covariance = around
        if silent_s is None:  # no boots at all: time alone makes the place worth less
            drift_m = self._config.silence.drift_m_s * max(0.0, (now_ns - place.time_ns) / NS_PER_S)
            covariance = covariance + drift_m**2 * np.diag([1.0, 1.0, 0.0])
        return enu, covariance, None
