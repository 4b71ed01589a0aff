"""A foot that walks a known way: exact kinematics, then inertial samples with a little noise."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

RATE_HZ = 200.0
REST_S, STANCE_S, SWING_S = 2.0, 0.5, 0.6
STRIDE_M, LIFT_M, PITCH_RAD = 1.3, 0.1, 0.7
LEG = 5  # strides before each quarter turn to the left


@dataclass(frozen=True)
class WalkingFoot:
    """``time_s`` (n,), ``position_m`` (n, 3) truth, ``imu`` (n, 6) m/s² and rad/s."""

    time_s: np.ndarray
    position_m: np.ndarray
    imu: np.ndarray


def walking_foot(strides: int = 20, seed: int = 0, offset_m: float = 0.0) -> WalkingFoot:
    """Rest, then strides with a quarter turn to the left every few of them, then rest."""
    time_s = np.arange(0.0, 2 * REST_S + strides * (STANCE_S + SWING_S), 1.0 / RATE_HZ)
    position, yaw = np.tile([0.0, offset_m, 0.0], (len(time_s), 1)), np.zeros(len(time_s))
    pitch = np.zeros(len(time_s))
    heading = 0.0
    for stride in range(strides):
        u = np.clip((time_s - REST_S - stride * (STANCE_S + SWING_S)) / SWING_S, 0.0, 1.0)
        smooth = 10 * u**3 - 15 * u**4 + 6 * u**5
        turn = np.pi / 2 if (stride + 1) % LEG == 0 else 0.0
        yaw += turn * smooth
        heading += turn
        position[:, 0] += STRIDE_M * np.cos(heading) * smooth
        position[:, 1] += STRIDE_M * np.sin(heading) * smooth
        position[:, 2] += LIFT_M * 64.0 * (u * (1 - u)) ** 3
        pitch += PITCH_RAD * np.sin(2 * np.pi * u) * 16.0 * (u * (1 - u)) ** 2
    return WalkingFoot(time_s, position, samples(position, yaw, pitch, seed))


def samples(position: np.ndarray, yaw: np.ndarray, pitch: np.ndarray, seed: int) -> np.ndarray:
    """Force and rate (n, 6) of a sensor that goes this way, yaw before pitch (nose down), with a little noise."""
    rng = np.random.default_rng(seed)
    attitude = Rotation.from_euler("ZY", np.column_stack([yaw, pitch]))
    rate = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * RATE_HZ
    acceleration = np.gradient(np.gradient(position, axis=0), axis=0) * RATE_HZ**2
    force = attitude.inv().apply(acceleration + np.array([0.0, 0.0, 9.81]))
    gyro = np.vstack([np.zeros(3), rate])
    noise = rng.normal(size=(len(position), 6)) * np.repeat([0.02, 0.001], 3)
    return np.hstack([force, gyro]) + noise


def write_run_folder(folder: Path, feet: dict[str, WalkingFoot]) -> Path:
    """A run folder with these feet and the truth of the first."""
    folder.mkdir(parents=True)
    for place, foot in feet.items():
        columns = np.column_stack([foot.time_s, foot.imu])
        np.savetxt(
            folder / f"{place}.csv", columns, "%.6f", ",", header="time_s,ax,ay,az,gx,gy,gz", comments=""
        )
    first = next(iter(feet.values()))
    truth = np.column_stack([first.time_s, first.position_m])
    np.savetxt(folder / "truth.csv", truth, "%.6f", ",", header="time_s,east_m,north_m,up_m", comments="")
    return folder
