"""The fast mode of the camera against the rendered path: errors of the same size, failures in the same places."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proving_ground.motion import Motion
from proving_ground.sensors import (
    CameraWorld,
    Figure,
    LightZone,
    Mounting,
    OdometryQuality,
    measure_camera,
    render_pair,
)
from proving_ground.sensors.camera_render import TO_BODY
from sensor_gateway.recordings.run import CameraSeries
from support.camera_rooms import CAMERA, EVERYWHERE, WALKING, Swaying, corridor, room, yard
from support.moving import Circling, Straight
from support.visual_odometry import movement

EXACT = OdometryQuality(still=0.0, per_m=0.0, per_rad=0.0, share=0.0, turn_still=0.0, turn_per_m=0.0,
                        turn_per_rad=0.0, scale=0.0)  # fmt: skip


@dataclass(frozen=True)
class Errors:
    """Root mean squares over frames and axes, and the share of frames without a motion."""

    translation_m: float
    rotation_rad: float
    failed: float


def fast(
    motion: Motion, world: CameraWorld, quality: OdometryQuality, duration_s: float = 2.0, seed: int = 1
) -> CameraSeries:
    rng = np.random.default_rng(seed)
    return measure_camera(motion, duration_s, Mounting(), CAMERA, quality, world, rng)


def fast_errors(motion: Motion, world: CameraWorld) -> Errors:
    shifts, turns, frames = [], [], 0
    for seed in range(10):
        series = fast(motion, world, OdometryQuality(), seed=seed)
        start, begun = motion.at(series.start_time_s)
        end, ended = motion.at(series.time_s)
        shifts.append(series.translation_m - begun.inv().apply(end - start))
        turns.append(((begun.inv() * ended).inv() * Rotation.from_rotvec(series.rotation_rad)).as_rotvec())
        frames += 19
    return errors_of(np.concatenate(shifts), np.concatenate(turns), frames)


def rendered_errors(motion: Motion, world: CameraWorld, frames: int = 9) -> Errors:
    rng = np.random.default_rng(1)
    time_s = np.arange(frames) / CAMERA.rate_hz
    place, attitude = motion.at(time_s)
    pairs = [
        render_pair(world, CAMERA, float(when), here, turned, rng)
        for when, here, turned in zip(time_s, place, attitude, strict=True)
    ]
    shifts, turns = [], []
    for number, (before, after) in enumerate(pairwise(pairs)):
        step = movement(CAMERA, before, after)
        if step is None:
            continue
        axes = attitude[number] * TO_BODY
        shifts.append(step.translation_m - axes.inv().apply(place[number + 1] - place[number]))
        true_turn = axes.inv() * attitude[number + 1] * TO_BODY
        turns.append((true_turn.inv() * step.rotation).as_rotvec())
    return errors_of(np.array(shifts).reshape(-1, 3), np.array(turns).reshape(-1, 3), len(pairs) - 1)


def errors_of(shifts: np.ndarray, turns: np.ndarray, frames: int) -> Errors:
    size = [float(np.sqrt(np.mean(values**2))) if len(values) else np.nan for values in (shifts, turns)]
    return Errors(size[0], size[1], 1.0 - len(shifts) / frames)


def dark(share: float) -> CameraWorld:
    return room(zones=(LightZone("dark", EVERYWHERE, share),))


def smoky(per_m: float) -> CameraWorld:
    return room(zones=(LightZone("smoke", EVERYWHERE, per_m),))


@pytest.mark.parametrize(
    ("motion", "world"),
    [
        (WALKING, room()),
        (WALKING, dark(0.9)),
        (WALKING, room(figures=(Figure(Straight((-1.2, -1.0, 1.0), (1.2, 0.0, 0.0))),))),
        (Swaying(Straight((-2.0, -1.0, 1.5)), 1.57), room()),
        (Swaying(Straight((-2.0, 0.0, 1.5), (1.2, 0.0, 0.0))), corridor()),
        (WALKING, yard()),
    ],
    ids=["room", "dark", "person ahead", "turning", "corridor", "open sky"],
)
def test_errors_are_those_of_the_rendered_path(motion: Motion, world: CameraWorld) -> None:
    """Within a factor of 2.5 in translation and 3 in rotation; both mostly work."""
    rendered, simulated = rendered_errors(motion, world), fast_errors(motion, world)
    assert max(rendered.failed, simulated.failed) < 0.1
    assert 1 / 2.5 < simulated.translation_m / rendered.translation_m < 2.5
    assert 1 / 3.0 < simulated.rotation_rad / rendered.rotation_rad < 3.0


@pytest.mark.parametrize(
    ("motion", "world"),
    [
        (WALKING, dark(0.995)),
        (WALKING, smoky(2.0)),
        (Swaying(Straight((4.85, -2.0, 1.5), (0.0, 0.8, 0.0))), room()),
    ],
    ids=["dark", "smoke", "nose to the wall"],
)
def test_both_fail_where_nothing_can_be_seen(motion: Motion, world: CameraWorld) -> None:
    assert rendered_errors(motion, world, frames=5).failed > 0.9
    assert fast_errors(motion, world).failed > 0.9


def test_without_errors_it_is_the_motion_in_the_body_s_axes() -> None:
    """Circling: at 10 Hz a turn of 0.06 rad to the left and a chord ahead."""
    series = fast(Circling(2.0, 0.6, 1.5), room(), EXACT)
    np.testing.assert_allclose(series.rotation_rad, np.tile([0.0, 0.0, 0.06], (19, 1)), atol=1e-12)
    chord = 2.0 * 2.0 * np.sin(0.03)
    expected = [chord * np.cos(0.03), chord * np.sin(0.03), 0.0]
    np.testing.assert_allclose(series.translation_m, np.tile(expected, (19, 1)), atol=1e-12)
    np.testing.assert_allclose(series.time_s - series.start_time_s, 0.1)


def test_stated_sigmas_are_honest() -> None:
    ratios = []
    for seed in range(40):
        series = fast(WALKING, room(), OdometryQuality(), seed=seed)
        assert series.translation_sigma_m is not None
        start, begun = WALKING.at(series.start_time_s)
        true = begun.inv().apply(WALKING.at(series.time_s)[0] - start)
        ratios.append((series.translation_m - true) / series.translation_sigma_m[:, None])
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1.0, abs=0.15)


def test_a_dark_corner_makes_a_gap_and_doubt_before_it() -> None:
    lights_out = LightZone("dark", EVERYWHERE, 0.999, start_s=1.0, end_s=1.5)
    series = fast(WALKING, room(zones=(lights_out,)), OdometryQuality())
    inside = (series.time_s > 0.95) & (series.start_time_s < 1.45)
    assert not inside.any()
    assert len(series.time_s) == 19 - 6
    assert series.confidence_pct is not None
    dim = fast(WALKING, dark(0.95), OdometryQuality())
    assert dim.confidence_pct is not None
    assert dim.confidence_pct.mean() < 0.5 * series.confidence_pct.mean()


def test_a_scale_error_stays_with_the_camera() -> None:
    quality = replace(EXACT, scale=0.05)
    lengths = []
    for seed in range(60):
        series = fast(Circling(2.0, 0.6, 1.5), room(), quality, 1.0, seed)
        length = np.linalg.norm(series.translation_m, axis=1)
        assert np.ptp(length) < 1e-12
        lengths.append(length[0])
    assert np.std(lengths) / np.mean(lengths) == pytest.approx(0.05, rel=0.3)
