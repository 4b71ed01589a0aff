"""A person: how long their legs are and how they like to move. `Person.drawn` draws a plausible one."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Person:
    """One person's build and habits; the defaults are an average man in boots.

    ``walk_ratio_m_s``: step length over step frequency, which people keep at all speeds (Sekiya and Nagasaki 1998:
    0.0065 m min, here in m s). ``run_frequency_hz``: of running steps at no speed, which grows by
    0.2 Hz per m/s. Variabilities are coefficients of variation from step to step; ``asymmetry`` is by
    how much the right step's time exceeds the mean. ``toe_out_rad`` and ``stance_turn_rad_s`` turn the feet in
    opposite directions: outward as they stand, and (right foot, counter-clockwise) while they stand.
    ``creep`` and ``sink``: how much of the recorded mean creep in stance, level and down, this person's soles have.
    ``strike_m_s2``: by how much a foot that lands at 1.3 m/s shakes where the sensor sits, about; ``hardness``: how
    much of it is a knock, at ``knock_hz``, which soft soles and a sensor held by laces swallow.
    """

    leg_length_m: float = 0.92
    walk_speed_m_s: float = 1.35
    run_speed_m_s: float = 2.8
    sprint_speed_m_s: float = 5.0
    run_frequency_hz: float = 2.3
    walk_ratio_m_s: float = 0.39
    time_variability: float = 0.025
    length_variability: float = 0.025
    asymmetry: float = 0.01
    step_width_m: float = 0.11
    toe_out_rad: float = 0.12
    stance_turn_rad_s: float = 0.0
    creep: float = 1.0
    sink: float = 0.2
    strike_m_s2: float = 22.0
    hardness: float = 0.9
    knock_hz: float = 48.0
    sway_m: float = 0.004

    @property
    def belt_height_m(self) -> float:
        """The torso's reference above the ground when standing: a little above the hip joint."""
        return 1.06 * self.leg_length_m

    @staticmethod
    def drawn(rng: np.random.Generator) -> "Person":
        """A plausible adult: leg length 0.92 ± 0.05 m, habits scattered as people's are."""
        leg = float(np.clip(rng.normal(0.92, 0.05), 0.78, 1.06))
        tall = np.sqrt(leg / 0.92)
        return Person(
            leg_length_m=leg,
            walk_speed_m_s=float(np.clip(rng.normal(1.35, 0.1), 1.1, 1.6) * tall),
            run_speed_m_s=float(np.clip(rng.normal(2.8, 0.25), 2.3, 3.4) * tall),
            sprint_speed_m_s=float(np.clip(rng.normal(5.0, 0.4), 4.2, 6.0) * tall),
            walk_ratio_m_s=float(np.clip(rng.normal(0.39, 0.03), 0.32, 0.46)),
            time_variability=float(rng.uniform(0.015, 0.035)),
            length_variability=float(rng.uniform(0.015, 0.035)),
            asymmetry=float(rng.normal(0.0, 0.012)),
            step_width_m=float(rng.uniform(0.08, 0.14)),
            toe_out_rad=float(rng.normal(0.12, 0.06)),
            stance_turn_rad_s=float(rng.normal(0.0, 0.02)),
            creep=float(np.clip(rng.lognormal(0.0, 0.4), 0.3, 2.0)),
            sink=float(np.clip(rng.normal(0.2, 0.4), -0.8, 1.2)),
            strike_m_s2=float(np.clip(rng.lognormal(np.log(22.0), 0.25), 12.0, 40.0)),
            hardness=float(np.clip(rng.lognormal(np.log(0.9), 0.4), 0.4, 3.0)),
            knock_hz=float(rng.uniform(36.0, 60.0)),
            sway_m=float(rng.uniform(0.003, 0.006)),
        )
