"""Simulated people through the foot INS: it must find their strides and tell their motions apart."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootNavigator
from proving_ground.evaluation.alignment import count_strides
from proving_ground.people import INSTEP_M, GaitName, PersonMotion
from proving_ground.sensors import Mounting, imu_class, measure_imu
from support.people_walks import walked


def steps_of(motion: PersonMotion, foot: str):
    """The steps that the foot INS finds in what an industrial unit on the instep measures."""
    mounting = Mounting(INSTEP_M, Rotation.from_euler("XYZ", [0.2, -0.4, 0.7]))
    rng = np.random.default_rng(5)
    imu = measure_imu(getattr(motion, foot), motion.duration_s, mounting, imu_class("industrial"), None, rng)
    navigator = FootNavigator()
    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    outputs = [navigator.process(time_ns, imu.accel_m_s2, imu.gyro_rad_s), navigator.finish()]
    return [step for output in outputs for step in output.steps]


@pytest.mark.parametrize("gait", ["walk", "run", "stairs", "backward", "side_step_left"])
def test_the_foot_ins_counts_every_stride(gait: GaitName) -> None:
    way = [[0, 0, 0], [6.5, 0, 3.4]] if gait == "stairs" else [[0, 0, 0], [18, 0, 0]]
    motion = walked(gait, way, seed=4)
    for foot, falls in motion.footfalls.items():
        true_m = np.diff(falls.place_m, axis=0)
        found = count_strides(np.array([step.displacement_m for step in steps_of(motion, foot)]))
        # Of 47 short side steps the detector splits some amid their swing; of the others every stride counts.
        assert abs(found - count_strides(true_m)) <= {"run": 1, "side_step_left": 9}.get(gait, 0)


def test_standing_walking_and_running_are_told_apart() -> None:
    shares = {}
    for gait in ("walk", "run"):
        motion = walked(gait, [[0, 0, 0], [25, 0, 0]])
        motions = [step.motion for step in steps_of(motion, "right_foot")]
        assert motions[0] == motions[-1] == "standing"
        going = [one for one in motions if one != "standing"]
        shares[gait] = going.count("running") / len(going)
    assert shares["walk"] < 0.1
    assert shares["run"] > 0.6


def test_the_way_that_the_foot_ins_finds_is_the_persons() -> None:
    motion = walked("walk", [[0, 0, 0], [40, 0, 0]], seed=6)
    steps = steps_of(motion, "left_foot")
    length_m = sum(float(np.hypot(*step.displacement_m[:2])) for step in steps)
    # Within what recorded walks show (foot-gcp: up to 1.2 %).
    assert abs(length_m - 40.0) / 40.0 < 0.012
