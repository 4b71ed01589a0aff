"""The ``[fusion]`` section: what is taken, and one line for what is not."""

from pathlib import Path

import pytest

from bootprint.clock import DataClock
from bootprint.config import convert, load_computer
from bootprint.errors import ConfigError
from bootprint.service import Context, Options
from fusion.config import FusionConfig
from fusion.main import SERVICE, build

REALM = """
id = "bp"
origin = { latitude_deg = 58.4, longitude_deg = 15.6, height_m = 80.0 }
roster = [{ id = "a1", number = 1, unit = "alpha" }]
"""


def context(folder: Path, section: str) -> Context:
    (folder / "realm.toml").write_text(REALM, encoding="utf-8")
    path = folder / "computer.toml"
    path.write_text('realm = "realm.toml"\nsoldier = "a1"\n' + section, encoding="utf-8")
    return Context("fusion", load_computer(path), Options(config=path, speed="max"))


def test_an_empty_section_has_all_defaults_and_builds(tmp_path: Path) -> None:
    made = context(tmp_path, "")
    assert isinstance(made.clock, DataClock)
    part = build(made)
    assert part.figures().state == "starting"
    assert list(part.close()) == []
    assert set(SERVICE.subjects) == {
        "foot_step",
        "foot_pose",
        "gnss",
        "fix",
        "pressure",
        "body_step",
        "camera_motion",
        "range",
        "track",
        "rooms",
    }


def test_whole_numbers_and_lists_are_taken_as_toml_gives_them() -> None:
    values = {
        "feet": ["left_foot"],
        "gnss_sources": [],
        "start": {"east_m": 3, "north_m": 4, "azimuth_deg": 90},
    }
    config = convert(values, FusionConfig, where="here")
    assert config.feet == ("left_foot",)
    assert config.start is not None
    assert config.start.east_m == 3.0


@pytest.mark.parametrize(
    ("section", "complaint"),
    [
        ("[fusion]\nfeets = ['left_foot']\n", "did you mean 'feet'"),
        ("[fusion]\nfeet = []\n", "feet"),
        ("[fusion]\nfeet = ['left_foot', 'left_foot']\n", "twice"),
        ("[fusion]\nfeet = ['left foot']\n", "feet or gnss_sources 'left foot' must be 1 to 64 letters"),
        ("[fusion]\ngnss_sources = ['gnss', 'a/b']\n", "feet or gnss_sources 'a/b' must be 1 to 64 letters"),
        ("[fusion]\nreorder_window_s = -1.0\n", "reorder_window_s"),
        ("[fusion.gnss]\nuere = 3.0\n", "did you mean 'uere_m'"),
        ("[fusion.start]\neast_m = 1.0\n", "either east_m and north_m, or latitude_deg and longitude_deg"),
        (
            "[fusion.start]\nazimuth_deg = 1.0\n",
            "either east_m and north_m, or latitude_deg and longitude_deg",
        ),
        (
            "[fusion.start]\neast_m = 1.0\nnorth_m = 1.0\nlatitude_deg = 58.0\nlongitude_deg = 15.0\n",
            "either east_m and north_m, or latitude_deg and longitude_deg",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_its_place(
    tmp_path: Path, section: str, complaint: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        build(context(tmp_path, section))
    message = str(caught.value)
    assert "computer.toml: [fusion]" in message
    assert complaint in message
    assert "\n" not in message
