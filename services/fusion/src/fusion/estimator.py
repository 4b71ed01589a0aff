"""The fused estimate: boots, placement, satellites and people's fixes, one event after another in event time.

Before the soldier is placed the filter runs in the boots frame and `Placement` looks for the move into ENU; once
that is sure the filter is moved, and from then on satellites and fixes are ordinary updates.
"""

import math
from collections import Counter

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame, yaw_of_azimuth
from bootprint.messages import Fix, FootPose, FootStep, GnssFix, Mode, Vector3
from fusion.alignment import Walk
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.feet import Foot
from fusion.filter import Innovation, Measurement
from fusion.models import body, gnss
from fusion.output import Estimate, horizontal_sigma_m
from fusion.placement import UNKNOWN_UP_SIGMA_M, HeadingHint, Place, Placement, known_point
from fusion.satellites import SatellitePosition, Satellites
from fusion.state import Array

_DEFAULT_AZIMUTH_SIGMA_RAD = math.radians(10.0)  # of a fix that names an azimuth but not how sure


class Estimator:
    """Everything known about one soldier's whereabouts; fed in event time, asked at any moment."""

    def __init__(self, config: FusionConfig, origin: Origin, counters: Counter[str]) -> None:
        self._config = config
        self._frame = LocalFrame(origin)
        self._counters = counters
        self.boots = Boots(config, counters)
        self.satellites = Satellites(config.gnss, origin, counters)
        self.placement = Placement(config.align, config.gnss)
        self.placed = False
        self._hint: HeadingHint | None = None  # a direction to walk off in, given when already placed
        self._coasted_m2 = 0.0  # variance already added to the state in this silence
        self._begun_ns = 0
        self._start = config.start  # until the first step

    # --- what comes in -----------------------------------------------------------------------------------------

    def begin(self, time_ns: int) -> None:
        """The first message has this stamp."""
        self._begun_ns = time_ns

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
        foot = self.boots.step(place, step)
        if foot is None:
            return
        self._coasted_m2 = 0.0
        if foot is not self.boots.reference:
            return
        for hint in (self.placement.hint, self._hint):
            if hint is not None:
                hint.go(self.boots.track_point(), self._config.align)
        if not self.placed:
            self._try_placing()
        elif self._hint is not None and self._hint.is_learned(self._config.align):
            self._turn_to(self._hint)
            self._hint = None

    def pose(self, place: str, pose: FootPose) -> None:
        """A foot is somewhere between two steps."""
        self.boots.pose(place, pose)
        self._coasted_m2 = 0.0

    def gnss(self, source: str, fix: GnssFix, late_s: float = 0.0) -> None:
        """A receiver has a solution; one that comes late is carried along by the feet, if they remember."""
        moved = np.zeros(3) if late_s <= 0.0 else self._moved_within(late_s, fix.time_ns)
        self.satellites.note_stamp(usable=moved is not None)
        if moved is None:
            self._counters["gnss_too_late"] += 1
            return
        position = self.satellites.screen(source, fix)
        if position is None:
            return
        if late_s > 0.0:
            position = self.satellites.late(position, _xyz(moved) if self.placed else (0.0, 0.0, 0.0), late_s)
        if self.placed:
            self._correct_by(position)
        elif position.sigma_m > self._config.gnss.placement_accuracy_m:
            self._counters["gnss_too_coarse_to_place"] += 1
        else:
            self.satellites.placed_by(position)
            local = _xyz(np.array(self.boots.track_point()) - moved)
            self.placement.observe(
                Place(fix.time_ns, position.enu, position.sigma_m, position.up_sigma_m, local, source)
            )
            self._try_placing()

    def _moved_within(self, late_s: float, since_ns: int) -> Array | None:
        return self.boots.moved_since(since_ns) if late_s <= self._config.gnss.late_s else None

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
        move = self.placement.final
        if move is not None and self.boots.reference is not None:
            self.boots.move(move)
            self.placed = True
            self._counters["placed"] += 1

    def _turn_to(self, hint: HeadingHint) -> None:
        """A placed soldier has walked off in a named direction: correct the yaw of the foot that was watched."""
        foot = self.boots.reference
        if foot is None:
            return
        turn, sigma = hint.turn_rad, hint.turn_sigma_rad
        jacobian = np.zeros((1, self.boots.filter.state.size))
        jacobian[0, foot.block.yaw] = 1.0
        self.boots.filter.widen_together(np.zeros((3, 3)), turn**2)  # a person is believed, as with places
        self.boots.correct(Measurement("azimuth", np.array([turn]), jacobian, np.array([[sigma**2]])))

    def _believe(self, place: Place) -> None:
        """A person's word is not gated: where it contradicts the estimate, the estimate was not that sure."""
        stands = self.boots.stands(place.time_ns)
        residual = np.array(place.enu) - body.position(self.boots.filter.state, stands)
        axes = 2 if place.up_sigma_m is None else 3
        surprise = np.zeros(3)
        surprise[:axes] = residual[:axes] ** 2
        self.boots.filter.widen_together(np.diag(surprise))
        noise = np.diag([place.sigma_m**2, place.sigma_m**2, (place.up_sigma_m or UNKNOWN_UP_SIGMA_M) ** 2])
        jacobian = body.position_jacobian(self.boots.filter.state, stands)
        self.boots.correct(
            Measurement("fix", residual[:axes], jacobian[:axes], np.ascontiguousarray(noise[:axes, :axes]))
        )

    def _correct_by(self, position: SatellitePosition) -> None:
        self._coast(position.time_ns)
        innovation = self._correct_axes(position, slice(0, 2), gnss.noise(position.sigma_m, None))
        self.satellites.judge(position, innovation)
        if innovation.accepted and position.up_sigma_m is not None:
            height = self._correct_axes(position, slice(2, 3), np.array([[position.up_sigma_m**2]]))
            self._counters["gnss_height_rejected"] += not height.accepted

    def _correct_axes(self, position: SatellitePosition, axes: slice, noise: Array) -> Innovation:
        stands = self.boots.stands(position.time_ns)
        state = self.boots.filter.state
        return self.boots.correct(
            Measurement(
                "gnss",
                (np.array(position.enu) - body.position(state, stands))[axes],
                body.position_jacobian(state, stands)[axes],
                noise * position.inflation,
                gate_noise=noise,
                gate_probability=self._config.gnss.gate_probability,
            )
        )

    def _coast(self, now_ns: int) -> None:
        """Own up in the state to what silent feet may have walked, before a satellite fix is compared with it."""
        variance = self._coasting_m2(self.boots.silent_s(now_ns))
        if variance > self._coasted_m2:
            self.boots.filter.widen_together((variance - self._coasted_m2) * np.eye(3))
            self._coasted_m2 = variance

    def _coasting_m2(self, silent_s: float | None) -> float:
        silence = self._config.silence
        if silent_s is None or silent_s <= silence.coasting_s:
            return 0.0
        return (silence.drift_m_s * silent_s) ** 2

    def shift(self, by_ns: int) -> None:
        """The boots' clock has been set: all that was remembered by the old one moves along."""
        self._begun_ns += by_ns
        for part in (self.boots, self.satellites, self.placement):
            part.shift(by_ns)

    # --- what is asked -----------------------------------------------------------------------------------------

    def estimate(self, now_ns: int) -> Estimate:
        """The answer at ``now_ns``."""
        silent_s = self.boots.silent_s(now_ns)
        alive = self.boots.alive(now_ns) if silent_s is not None else []
        known = self._pose(now_ns, silent_s, alive)
        if known is None:
            return self._unplaced(now_ns, silent_s, alive)
        enu, covariance, turn = known
        covariance = covariance + max(0.0, self._coasting_m2(silent_s) - self._coasted_m2) * np.eye(3)
        moving = silent_s is not None and silent_s <= self._config.silence.coasting_s
        velocity, speed, course_sigma = self._motion(alive, turn) if moving else ((0.0, 0.0, 0.0), 0.0, None)
        return Estimate(
            mode=self._mode(now_ns, silent_s, covariance),
            enu=enu,
            covariance=covariance,
            velocity=velocity,
            speed_m_s=speed,
            course_sigma_rad=course_sigma,
            motion=self.boots.motion(now_ns) if moving else "unknown",
            sources=self._sources(now_ns, alive if moving else []),
            rejected=self.satellites.refused(now_ns),
        )

    def _unplaced(self, now_ns: int, silent_s: float | None, alive: list[Foot]) -> Estimate:
        """Nothing is known but that the soldier is in the area: at the origin, give or take a lot."""
        sigma = self._config.unplaced_sigma_m
        moving = silent_s is not None and silent_s <= self._config.silence.coasting_s
        return Estimate(
            mode="unplaced",
            enu=(0.0, 0.0, 0.0),
            covariance=np.diag([sigma**2, sigma**2, sigma**2]),
            speed_m_s=self._speed(alive) if moving else 0.0,
            motion=self.boots.motion(now_ns) if moving else "unknown",
            sources=self._sources(now_ns, alive if moving else []),
            rejected=self.satellites.refused(now_ns),
        )

    def _pose(
        self, now_ns: int, silent_s: float | None, alive: list[Foot]
    ) -> tuple[Vector3, Array, tuple[float, float] | None] | None:
        """Place, covariance (3, 3), and the turn (yaw, σ) of the filter's directions into ENU; None if unplaced."""
        local = (
            np.zeros(3) if not alive else sum((foot.at(now_ns) for foot in alive), np.zeros(3)) / len(alive)
        )
        if self.placed:
            return _xyz(local), self._covariance(alive), (0.0, 0.0)
        move = self.placement.provisional if alive else None
        if move is not None:
            jacobian = move.error_jacobian(_xyz(local))[:3]
            spread = move.rotation() @ self._covariance(alive) @ move.rotation().T
            covariance = spread + jacobian @ move.covariance @ jacobian.T
            return _xyz(move.point(_xyz(local))), covariance, (move.yaw_rad, math.sqrt(move.covariance[3, 3]))
        return self._near_a_place(now_ns, silent_s, _xyz(local), alive)

    def _near_a_place(
        self, now_ns: int, silent_s: float | None, local: Vector3, alive: list[Foot]
    ) -> tuple[Vector3, Array, None] | None:
        """Heading unknown: on a circle around the place that tells most."""
        nearest = self.placement.nearest(local)
        if nearest is None:
            return None
        place, variance = nearest
        if silent_s is None:  # no boots at all: time alone makes the place worth less
            variance += (self._config.silence.drift_m_s * max(0.0, (now_ns - place.time_ns) / NS_PER_S)) ** 2
        up_variance = (UNKNOWN_UP_SIGMA_M if place.up_sigma_m is None else place.up_sigma_m) ** 2
        up = place.enu[2] + local[2] - place.local[2]
        walked = self._covariance(alive) if alive else np.zeros((3, 3))
        return (
            (place.enu[0], place.enu[1], up),
            np.diag([variance, variance, up_variance]) + np.diag(np.diag(walked)),
            None,
        )

    def _covariance(self, alive: list[Foot]) -> Array:
        """Covariance (3, 3) of the body's position in the filter's frame, m²."""
        jacobian = body.position_jacobian(
            self.boots.filter.state, [(foot.block, foot.offset) for foot in alive]
        )
        spread: Array = jacobian @ self.boots.filter.covariance @ jacobian.T
        return spread + self._config.boots.pose_sigma_m**2 * np.eye(3)

    def _speed(self, alive: list[Foot]) -> float:
        strides = [foot.stride.speed_m_s for foot in alive if foot.stride is not None]
        return sum(strides) / len(strides) if strides else 0.0

    def _motion(
        self, alive: list[Foot], turn: tuple[float, float] | None
    ) -> tuple[Vector3, float, float | None]:
        """Velocity, speed and σ of the course: mean of the feet's last strides; no direction without heading."""
        if turn is None:
            return (0.0, 0.0, 0.0), self._speed(alive), None
        yaw, yaw_sigma = turn
        velocities = np.array([self.boots.velocity(foot) for foot in alive])
        east, north, up = _xyz(np.mean(velocities, axis=0))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        velocity = (cosine * east - sine * north, sine * east + cosine * north, up)
        return velocity, math.hypot(east, north), self._course_sigma(alive, yaw_sigma)

    def _course_sigma(self, alive: list[Foot], yaw_sigma: float) -> float | None:
        """Heading error and the last step's sideways error, the worst of the feet."""
        sigmas = [
            math.hypot(
                math.sqrt(max(0.0, float(self.boots.filter.covariance[foot.block.yaw, foot.block.yaw]))),
                foot.stride.lateral_sigma_m / foot.stride.length_m,
            )
            for foot in alive
            if foot.stride is not None and foot.stride.length_m > 0.0
        ]
        return math.hypot(max(sigmas), yaw_sigma) if sigmas else None

    def _sources(self, now_ns: int, alive: list[Foot]) -> tuple[str, ...]:
        return (*sorted(foot.place for foot in alive), *self.satellites.fresh(now_ns))

    def _mode(self, now_ns: int, silent_s: float | None, covariance: Array) -> Mode:
        silence = self._config.silence
        dead_s = (now_ns - self._begun_ns) / NS_PER_S if silent_s is None else silent_s
        unaided_s = min(dead_s, self.satellites.silent_s(now_ns))
        if unaided_s > silence.lost_s or horizontal_sigma_m(covariance) > silence.lost_sigma_m:
            return "lost"
        if self.satellites.fresh(now_ns):
            return "gnss"
        return "coasting" if dead_s > silence.coasting_s else "boots"


def _xyz(values: Array) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])
