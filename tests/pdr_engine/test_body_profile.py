"""The person's profile: saved by the engine's part, loaded at the next start, refused when damaged."""

from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import GnssFix, ImuBatch
from bootprint.topics import Identity
from pdr_engine.body import BodyNavigator, BodySettings
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.profile import (
    SAVE_EVERY_NS,
    BodyProfile,
    EnginePart,
    load_profile,
    save_profile,
    with_profile,
)
from support.walking_trunk import START_NS, trunk_walk

ME = Identity("bp", "alpha", "a1")
PLACE = Origin(latitude_deg=59.0, longitude_deg=18.0)


def test_a_profile_comes_back_and_sets_the_beginning(tmp_path: Path) -> None:
    path = tmp_path / "state" / "body-profile.json"
    assert load_profile(path) is None
    save_profile(path, BodyProfile(scale=1.07, scale_sigma=0.03))
    profile = load_profile(path)
    assert profile == BodyProfile(scale=1.07, scale_sigma=0.03)
    assert profile is not None
    length = with_profile(BodySettings(), profile).length
    assert (length.scale, length.common_sigma_share) == (1.07, 0.03)


def test_weights_and_deviations_come_back_too(tmp_path: Path) -> None:
    path = tmp_path / "body-profile.json"
    known = BodyProfile(
        scale=1.0,
        scale_sigma=0.03,
        refinement=(0.02, -0.01, 0.0, 0.04),
        deviations=(Deviation(3, -2, 0.5, 7.9, 8),),
    )
    save_profile(path, known)
    profile = load_profile(path)
    assert profile is not None
    settings = with_profile(BodySettings(step_length="network", deviation_map=True), profile)
    navigator = BodyNavigator(settings)
    assert navigator.person.refinement == pytest.approx(known.refinement)
    assert navigator.deviations == known.deviations


@pytest.mark.parametrize("damage", [b"", b"{", b'{"scale": 40, "scale_sigma": 0.1}', b'{"scale": 1}'])
def test_a_damaged_profile_is_an_error_of_one_kind(tmp_path: Path, damage: bytes) -> None:
    path = tmp_path / "body-profile.json"
    path.write_bytes(damage)
    with pytest.raises(ValueError):  # noqa: PT011 (what msgspec says differs)
        load_profile(path)


def test_the_part_saves_what_the_fixes_told(tmp_path: Path) -> None:
    path = tmp_path / "body-profile.json"
    core = EngineCore(PdrConfig(places=("body",)), ME, PLACE)
    part, frame, stream = EnginePart(core, path), LocalFrame(PLACE), trunk_walk(100.0)
    part.tick(START_NS)
    assert not path.exists()
    for k in range(0, len(stream.time_ns), 100):
        cut = slice(k, k + 100)
        batch = ImuBatch.from_arrays(k, stream.time_ns[cut], stream.accel[cut], stream.gyro[cut])
        part.handle(Envelope(ME.address("imu", "body"), batch))
        latitude, longitude, _ = frame.to_geodetic(0.0, 1.25 * k / 100.0, 0.0)
        fix = GnssFix(
            time_ns=int(stream.time_ns[k]),
            fix_kind="3d",
            latitude_deg=latitude,
            longitude_deg=longitude,
            horizontal_accuracy_m=2.0,
        )
        part.handle(Envelope(ME.address("gnss", "body"), fix))
    part.tick(START_NS + SAVE_EVERY_NS)
    profile = load_profile(path)
    assert profile is not None
    assert profile.scale != 1.0
    assert profile.scale_sigma < 0.055
    path.unlink()
    part.close()
    assert path.exists()
    path.unlink()
    path.mkdir()
    part.close()
    assert part.figures().counters["profile_unsaved"] == 1
