"""Satellites correct the boots, as long as they are to be believed; when they were not, what they did is undone."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bootprint.messages import FootPose, FootStep
from fusion.boots import Boots
from fusion.chi_square import chi_square_quantile
from fusion.config import FusionConfig
from fusion.filter import Innovation, Measurement
from fusion.models import body, gnss
from fusion.satellites import SatellitePosition, Satellites
from fusion.shadows import Shadow, Shadows
from fusion.state import Array
from fusion.trust import Receiver, heading_sigma_rad, normalised_squared, residual

# Stated for the height itself, where the plane's figure is for both axes together; and the air's delays last.
_HEIGHT_LASTS = 2.0


class SatelliteAid:
    """What satellites do to a placed soldier's boots."""

    def __init__(self, config: FusionConfig, satellites: Satellites, counters: Counter[str]) -> None:
        self._gnss, self._trust = config.gnss, config.trust
        self._coasting_s = config.silence.coasting_s
        self._satellites = satellites
        self._counters = counters
        self.shadows = Shadows(config.trust.shadow_interval_s)
        self._receivers: dict[str, Receiver] = {}

    # --- what else the boots are told ---------------------------------------------------------------------------

    def step(self, place: str, step: FootStep) -> None:
        """A step that the boots have been told."""
        self.shadows.step(place, step)

    def pose(self, place: str, pose: FootPose) -> None:
        """A pose that the boots have been told."""
        self.shadows.pose(place, pose)

    @property
    def boots(self) -> list[Boots]:
        """The shadows' boots, for what moves the whole body."""
        return [shadow.boots for shadow in self.shadows]

    def forget(self) -> None:
        """The boots have been moved from outside: shadows of before say nothing any more."""
        self.shadows.clear()

    def believes(self, source: str) -> bool:
        """Whether a receiver is not known to go astray."""
        return source not in self._receivers or self._receivers[source].distrusted_ns is None

    # --- satellites ---------------------------------------------------------------------------------------------

    def correct(self, boots: Boots, position: SatellitePosition) -> Boots:
        """The boots after a fix: corrected, left alone, or set back to before a receiver went astray."""
        receiver = self._receivers.setdefault(position.source, Receiver())
        position = self._as_seen(boots, position, receiver)
        if receiver.distrusted_ns is not None:
            self._hear_again(boots, position, receiver)
        elif self._is_found_out(boots, position, receiver):
            boots = self._fall_back(boots, position, receiver)
        if receiver.distrusted_ns is not None:
            self._satellites.distrust(position)
            return boots
        if receiver.is_settled(position.time_ns, self._trust.retrust_s):
            self.shadows.split_off(boots, self._counters, position.time_ns)
        self._update(boots, position, receiver)
        return boots

    def _as_seen(self, boots: Boots, position: SatellitePosition, receiver: Receiver) -> SatellitePosition:
        """The fix with the accuracy that its receiver has shown of late, if that is worse than what it says."""
        miss, _ = residual(boots, np.array(position.enu[:2]), position.time_ns)
        scatter_m = receiver.scatter_m(miss, position.time_ns, self._trust.scatter_window_s)
        return replace(position, sigma_m=max(position.sigma_m, scatter_m))

    def _is_found_out(self, boots: Boots, position: SatellitePosition, receiver: Receiver) -> bool:
        silent_s = boots.silent_s(position.time_ns)
        if silent_s is None or silent_s > self._coasting_s or boots.standing_in(position.time_ns):
            return False  # nothing to compare with: shadows have no camera
        astray = any(self._astray_by(shadow, position) > 1.0 for shadow in self._witnesses())
        return receiver.strays(astray, position.time_ns, self._trust.confirm_s)

    def _witnesses(self) -> Iterator[Shadow]:
        """Shadows whose heading is sure: beyond that their covariance, a linear one, is none of their errors.

        A runner's gyros saturate: within a minute of it boots can turn by more than a spoofer could drag.
        """
        surest = math.radians(self._trust.witness_heading_sigma_deg)
        return (shadow for shadow in self.shadows if heading_sigma_rad(shadow.boots) <= surest)

    def _astray_by(self, shadow: Shadow, position: SatellitePosition) -> float:
        """How far a fix is from where a shadow is, of what both their errors explain."""
        enu = np.array(position.enu[:2])
        sigma_m = math.sqrt(0.5) * position.sigma_m  # stated in the plane, compared by axis
        squared = normalised_squared(shadow.boots, enu, sigma_m, position.time_ns)
        return squared / chi_square_quantile(1.0 - self._trust.false_alarm, 2)

    def _fall_back(self, boots: Boots, position: SatellitePosition, receiver: Receiver) -> Boots:
        """To the shadow that contradicts most: it has seen all of the drag, by the sharpest dead reckoning."""
        receiver.distrust(position.time_ns)
        self._counters["gnss_distrusted"] += 1
        best = max(self._witnesses(), key=lambda shadow: self._astray_by(shadow, position), default=None)
        if best is not None:
            boots = self.shadows.revived(best, self._counters)
        self.shadows.clear()
        return boots

    def _hear_again(self, boots: Boots, position: SatellitePosition, receiver: Receiver) -> None:
        enu = np.array(position.enu[:2])
        squared = normalised_squared(boots, enu, position.sigma_m, position.time_ns)
        agreeing = squared <= chi_square_quantile(self._trust.agreement, 2)
        if receiver.agrees(agreeing, position.time_ns, self._trust.retrust_s):
            receiver.trust(position.time_ns)
            self._counters["gnss_trusted_again"] += 1
            away, _ = residual(boots, enu, position.time_ns)  # dead reckoning was wrong by this much
            boots.filter.widen_together(np.diag([*(away**2), 0.0]))

    def _update(self, boots: Boots, position: SatellitePosition, receiver: Receiver) -> None:
        here = body.position(boots.filter.state, boots.stands(position.time_ns))[:2]
        inflation = gnss.correlation_inflation(position.since_s, receiver.moved_m(here), self._gnss)
        noise = gnss.noise(position.sigma_m, None)
        beyond = boots.beyond_tangent(boots.stands(position.time_ns), position.sigma_m)
        innovation = self._correct_axes(boots, position, slice(0, 2), noise, inflation, carries=beyond)
        self._satellites.judge(position, innovation)
        if innovation.accepted:
            receiver.heard_at = here
        if innovation.accepted and position.up_sigma_m is not None:
            noise = np.array([[position.up_sigma_m**2]])
            height = self._correct_axes(boots, position, slice(2, 3), noise, _HEIGHT_LASTS * inflation)
            self._counters["gnss_height_rejected"] += not height.accepted

    def _correct_axes(
        self,
        boots: Boots,
        position: SatellitePosition,
        axes: slice,
        noise: Array,
        inflation: float,
        *,
        carries: Array | None = None,
    ) -> Innovation:
        stands = boots.stands(position.time_ns)
        state = boots.filter.state
        return boots.correct(
            Measurement(
                "gnss",
                (np.array(position.enu) - body.position(state, stands))[axes],
                body.position_jacobian(state, stands)[axes],
                noise * inflation,
                gate_noise=noise,
                gate_probability=self._gnss.gate_probability,
                carries=carries,
            )
        )
