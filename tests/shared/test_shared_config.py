"""Configuration errors say the file, the place, what stands there and what would be right."""

import math
import re
from pathlib import Path

import msgspec
import pytest

from bootprint.config import Config, convert, load_computer, load_realm
from bootprint.errors import ConfigError

REALM = """
id = "bp"
origin = { latitude_deg = 47.05, longitude_deg = 8.31, height_m = 480.0 }

[[roster]]
id = "a1"
number = 1
unit = "alpha"
callsign = "Adler"

[[roster]]
id = "b2"
number = 1023
unit = "bravo"
"""
COMPUTER = """
realm = "realm.toml"
soldier = "b2"
state_dir = "var/state"

[pdr]
rate_hz = 200
"""


class Pdr(Config, frozen=True):
    rate_hz: float = 100.0


class Udp(Config, frozen=True, tag_field="kind", tag="udp"):
    port: int


class Serial(Config, frozen=True, tag_field="kind", tag="serial"):
    device: str
    baud: int = 921_600


class Gateway(Config, frozen=True):
    sources: tuple[Udp | Serial, ...] = ()
    named: dict[str, Pdr] = msgspec.field(default_factory=dict)
    extra: Pdr | None = None


def write(folder: Path, realm: str = REALM, computer: str = COMPUTER) -> Path:
    (folder / "realm.toml").write_text(realm, encoding="utf-8")
    path = folder / "computer.toml"
    path.write_text(computer, encoding="utf-8")
    return path


def test_a_computer_knows_its_realm_and_its_paths(tmp_path: Path) -> None:
    computer = load_computer(write(tmp_path))
    assert computer.identity.selector("imu") == "bp/@v1/bravo/b2/imu/*"
    assert computer.realm.by_number()[1].callsign == "Adler"
    assert computer.router == "tcp/127.0.0.1:7447"
    assert computer.state_dir == tmp_path / "var/state"
    assert computer.relative("x.tlog") == tmp_path / "x.tlog"
    assert computer.section("pdr", Pdr) == Pdr(rate_hz=200.0)
    assert computer.section("gateway", Gateway) == Gateway()


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('id = "bp"', 'idd = "bp"', "unknown key 'idd'; did you mean 'id'?"),
        ("number = 1023", "nummer = 1", "unknown key 'nummer' in roster[1]; did you mean 'number'?"),
        ("height_m", "heigth_m", "unknown key 'heigth_m' in origin; did you mean 'height_m'?"),
        (
            'unit = "bravo"',
            'unit = "bravo"\nxyz = 1',
            "unknown key 'xyz' in roster[1]; known keys: id, number, unit",
        ),
        ("number = 1023", 'number = "7"', "roster[1].number is '7': expected int"),
        ("number = 1023", "number = 1024", "roster[1].number is 1024: expected int <= 1023"),
        ("47.05", "97.05", "origin.latitude_deg is 97.05: expected float <= 90.0"),
        ("480.0", "nan", "origin.height_m is nan: expected a number within ±1e+12"),
        ("480.0", "-inf", "origin.height_m is -inf: expected a number within ±1e+12"),
        ("number = 1023\n", "", "roster[1] lacks the key 'number'"),
        ('id = "bp"', "", "missing the key 'id'"),
        ("number = 1023", "number = 1", "roster has number 1 more than once; make each unique"),
        ('id = "b2"', 'id = "a1"', "roster has id a1 more than once"),
        ('id = "b2"', 'id = "b/2"', "roster id 'b/2' must be 1 to 64 letters"),
        ('unit = "alpha"', 'unit = ""', "roster unit '' must be 1 to 64 letters"),
        ('id = "bp"', 'id = "*"', "id '*' must be 1 to 64 letters"),
        ("number = 1023", "number == 1023", "not valid TOML: Invalid value (at line 13"),
    ],
)
def test_what_is_wrong_with_a_realm_is_said_in_one_line(
    tmp_path: Path, old: str, new: str, complaint: str
) -> None:
    assert old in REALM
    write(tmp_path, realm=REALM.replace(old, new))
    with pytest.raises(ConfigError, match=re.escape(complaint)) as caught:
        load_realm(tmp_path / "realm.toml")
    assert str(caught.value).startswith(f"{tmp_path / 'realm.toml'}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"sorces": []}, "unknown key 'sorces'; did you mean 'sources'?"),
        (
            {"sources": [{"kind": "serial", "baut": 1}]},
            "unknown key 'baut' in sources[0]; did you mean 'baud'?",
        ),
        (
            {"sources": [{"kind": "udp", "port": 1}, {"kind": "tty"}]},
            "sources[1].kind is 'tty': expected one of",
        ),
        (
            {"sources": [{"kind": "udp", "device": "x"}]},
            "unknown key 'device' in sources[0]; known keys: port",
        ),
        ({"sources": [{"port": 1}]}, "sources[0] lacks the key 'kind'"),
        ({"sources": [3]}, "sources[0] is 3: expected a table"),
        ({"sources": 3}, "sources is 3: expected a list"),
        ({"named": {"a": {}, "b": {"rate": 1}}}, "unknown key 'rate' in named.b; did you mean 'rate_hz'?"),
        ({"named": {"a": {}, "b": {"rate_hz": "x"}}}, "named.b.rate_hz is 'x': expected float"),
        ({"extra": {"rat_hz": 1}}, "unknown key 'rat_hz' in extra; did you mean 'rate_hz'?"),
        ([], "the file: expected a table"),
    ],
)
def test_nested_tables_and_lists_are_named_down_to_the_key(values: object, complaint: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(f"here: {complaint}")):
        convert(values, Gateway, where="here")


class Times(Config, frozen=True):
    """Own checks after conversion must not put the common ones out of force."""

    wait_s: float = 1.0
    batch_ms: float = 1.0
    start_time_s: float = 0.0
    rate_bits_per_s: float = 1.0
    name: str = ""
    waits: tuple[Pdr, ...] = ()

    def __post_init__(self) -> None:
        assert self.wait_s < 1e9


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"wait_s": math.inf}, "wait_s is inf: expected a number within ±1e+07"),
        ({"wait_s": math.nan}, "wait_s is nan: expected a number within ±1e+07"),
        ({"wait_s": -1e300}, "wait_s is -1e+300: expected a number within ±1e+07"),
        ({"wait_s": 10_000_001}, "wait_s is 10000001: expected a number within ±1e+07"),
        ({"batch_ms": 1.1e10}, "batch_ms is 11000000000.0: expected a number within ±1e+10"),
        ({"waits": [{}, {"rate_hz": math.inf}]}, "waits[1].rate_hz is inf: expected a number"),
        ({"waits": [{"rate_hz": [1.0, math.nan]}]}, "waits[0].rate_hz[1] is nan: expected a number"),
    ],
)
def test_numbers_that_are_none_or_beyond_all_sense_are_named(values: object, complaint: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(f"here: {complaint}")):
        convert(values, Times, where="here")


def test_large_numbers_that_make_sense_are_taken() -> None:
    values = {"wait_s": 1e7, "batch_ms": 1e10, "start_time_s": 1.8e9, "rate_bits_per_s": 54e6, "name": "inf"}
    assert convert(values, Times, where="here") == Times(**values)


def test_a_section_is_checked_by_the_service_it_belongs_to(tmp_path: Path) -> None:
    computer = load_computer(write(tmp_path, computer=COMPUTER.replace("rate_hz", "rate_khz")))
    with pytest.raises(
        ConfigError, match=re.escape("computer.toml: [pdr]: unknown key 'rate_khz'; did you mean")
    ):
        computer.section("pdr", Pdr)


def test_a_soldier_must_be_on_the_roster(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'c3' is not in the roster of realm 'bp' \(known: a1, b2\)"):
        load_computer(write(tmp_path, computer=COMPUTER.replace("b2", "c3")))


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    path = tmp_path / "computer.toml"
    with pytest.raises(ConfigError, match=r"computer\.toml: no such file"):
        load_computer(path)
    path.write_bytes(b"realm = '\xff'")
    with pytest.raises(ConfigError, match=r"computer\.toml: cannot be read: .*utf-8"):
        load_computer(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_computer(tmp_path)
