"""docs/radio.md says what the code does: its tables are the code's, its sizes and defaults are measured here."""

import re
import tomllib
from pathlib import Path

import pytest

from bootprint.config import convert
from sa_hub.radio.content import Entry, Report, Reports, Update
from sa_hub.radio.frame import Codec
from sa_hub.radio.layout import layout_markdown
from sa_hub.radio.link_profile import DEFAULT_BAUD
from sa_hub.radio.links.serial_line import DEFAULT_GUARD_S
from sa_hub.radio.profiles.table import profiles_markdown
from sa_hub.settings import HubSettings, LinkProfile
from support.hub_squad import ORIGIN, START_NS

MANUAL = (Path(__file__).parents[2] / "docs" / "radio.md").read_text(encoding="utf-8")
HEADER_AND_TAG = 2 + 8
RESOLUTION = 3


def test_the_tables_are_the_codes_own() -> None:
    between = re.search(r"<!-- layout -->\n\n(.*)\n\n<!-- end of layout -->", MANUAL, re.DOTALL)
    assert between is not None
    assert between[1] == layout_markdown()


def test_the_table_of_radios_is_made_from_their_files() -> None:
    between = re.search(r"<!-- profiles -->\n\n(.*)\n\n<!-- end of profiles -->", MANUAL, re.DOTALL)
    assert between is not None
    assert between[1] == profiles_markdown()


def test_the_examples_of_other_kinds_of_links_are_right() -> None:
    toml = MANUAL.split("```toml\n")[2].split("```")[0]
    section = tomllib.loads(toml)["hub"]
    links = convert(section, HubSettings, where="docs/radio.md").links
    assert [link.kind for link in links] == ["serial", "zenoh", "file"]
    assert (links[0].baud, links[0].guard_s) == (DEFAULT_BAUD, DEFAULT_GUARD_S)


def walker(number: int, metres: float, height_m: float | None, speed_m_s: float, hops: int) -> Report:
    return Report(
        number=number,
        time_ns=START_NS,
        latitude_deg=ORIGIN.latitude_deg + metres * (number * 37 % 41) / 41 / 111_405,
        longitude_deg=ORIGIN.longitude_deg + metres * (number * 29 % 41) / 41 / 56_891,
        accuracy_m=1.5,
        east_m_s=speed_m_s,
        height_m=height_m,
        hops=hops,
    )


def size(reports: list[Report]) -> int:
    """Bytes of a frame with a short header and the 8-byte tag, sent by number 1."""
    return HEADER_AND_TAG + len(Codec(ORIGIN).encode(1, Reports(tuple(reports)), RESOLUTION, 9999))


@pytest.mark.parametrize(
    ("line", "reports"),
    [
        ("one soldier in full, walking, height known", [walker(1, 9.0, 60.0, 1.3, 0)]),
        ("one soldier in full, standing, or height unknown", [walker(1, 9.0, 60.0, 0.0, 0)]),
        ("one soldier in full, standing, or height unknown", [walker(1, 9.0, None, 1.3, 0)]),
        (
            "8 soldiers in full within 120 m, one instant, numbers in a row",
            [walker(number, 120.0, 60.0 + number % 3 * 3, 1.3, 1) for number in range(2, 10)],
        ),
        (
            "40 soldiers in full within 300 m, one instant, numbers in a row",
            [walker(number, 300.0, 60.0 + number % 3 * 3, 1.3, 1) for number in range(2, 42)],
        ),
    ],
)
def test_the_sizes_are_as_told(line: str, reports: list[Report]) -> None:
    told = re.search(rf"\| {re.escape(line)} \| (\d+) \|", MANUAL)
    assert told is not None
    assert size(reports) == int(told[1])


@pytest.mark.parametrize(
    ("line", "count", "bound"),
    [
        ("one soldier of its own, walking, as an update", 1, 20),
        ("8 soldiers walking, numbers in a row, as an update", 8, 58),
        ("40 soldiers walking, numbers in a row, as an update", 40, 250),
    ],
)
def test_the_sizes_of_updates_are_as_told(line: str, count: int, bound: int) -> None:
    told = re.search(rf"\| {re.escape(line)} \| (\d+) \|", MANUAL)
    entries = tuple(Entry(number, 7 * number, 5 * number, (3, 6)) for number in range(1, count + 1))
    update = Update(START_NS // 100_000_000, 3, 4, 0, entries)
    assert told is not None
    size = HEADER_AND_TAG + len(Codec(ORIGIN).encode(1, update, RESOLUTION, 9999))
    assert size == int(told[1])
    assert size <= bound


def test_the_example_configuration_shows_the_defaults() -> None:
    toml = MANUAL.split("```toml\n")[1].split("```")[0]
    section = tomllib.loads(toml)["hub"]
    link = section.pop("links")[0]
    convert({**section, "links": [link]}, HubSettings, where="docs/radio.md")
    defaults = HubSettings()
    shown = {name: value for name, value in section.items() if name != "role"}
    assert shown == {name: getattr(defaults, name) for name in shown}
    profile = LinkProfile(name="net", rate_bits_per_s=1)
    assert (link["header_bytes"], link["mtu_bytes"]) == (profile.header_bytes, profile.mtu_bytes)
