"""The hub's configuration and its key: what is wrong is said in one line that tells the mend."""

import stat
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.config import convert
from bootprint.errors import ConfigError
from sa_hub.commands import register
from sa_hub.keys import create_group_key, load_group_key
from sa_hub.radio.profiles import named
from sa_hub.settings import HubSettings, LinkProfile, check_settings

LINK = {"name": "squad", "rate_bits_per_s": 1200}


def settings(**values: object) -> HubSettings:
    """As from a [hub] section."""
    converted = convert(values, HubSettings, where="computer.toml: [hub]")
    check_settings(converted, "computer.toml: [hub]")
    return converted


def test_defaults_fit_together() -> None:
    assert settings(links=[LINK]).links[0].header_bytes == 28
    assert not settings().relays
    assert settings(role="squad_leader").relays


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"role": "general"}, "role is 'general': expected one of"),
        ({"heartbeats_s": 3.0}, "did you mean 'heartbeat_s'"),
        ({"links": [{**LINK, "rate": 3}]}, "unknown key 'rate'"),
        ({"links": [{"name": "squad"}]}, "rate_bits_per_s"),
        ({"links": [LINK, LINK]}, "stands there twice"),
        ({"links": [{**LINK, "name": "a/b"}]}, "letters, digits"),
        ({"links": [{**LINK, "rate_bits_per_s": 10, "header_bytes": 28}]}, "want a higher rate_bits_per_s"),
        (
            {"links": [{**LINK, "rate_bits_per_s": 100, "peers": ["h:1"] * 8}]},
            "to 8 peer(s) may need 4352",
        ),
        ({"links": [{**LINK, "mtu_bytes": 20}]}, "40"),
        ({"heartbeat_s": 80.0}, "heartbeat_s < stale_s < lost_s, got 80, 75, 180"),
        ({"lost_s": 500.0}, "400"),
        ({"tag_bytes": 6}, "tag_bytes is 6"),
        ({"threshold_m": 0.0}, "> 0"),
    ],
)
def test_a_wrong_section_is_refused_in_one_line(values: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        settings(**values)
    assert message in str(caught.value)
    assert str(caught.value).startswith("computer.toml: [hub]")
    assert "\n" not in str(caught.value)


def test_a_new_key_is_random_and_for_its_owner_only(tmp_path: Path) -> None:
    paths = [tmp_path / "keys" / name for name in ("one.key", "two.key")]
    for path in paths:
        create_group_key(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    one, two = (load_group_key(path) for path in paths)
    assert len(one) == len(two) == 32
    assert one != two


def test_a_key_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "group.key"
    create_group_key(path)
    before = path.read_bytes()
    with pytest.raises(ConfigError, match="exists already"):
        create_group_key(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("content", "mode", "message"),
    [
        (None, 0o600, "no group key there"),
        ("00" * 32, 0o640, "chmod 600"),
        ("00" * 31, 0o600, "a key of 31 bytes, want 64 hexadecimal digits"),
        ("zz" * 32, 0o600, "not a group key"),
        ("é" * 32, 0o600, "not a group key"),
        ("", 0o600, "a key of 0 bytes"),
    ],
)
def test_a_wrong_key_file_is_refused_in_one_line(
    tmp_path: Path, content: str | None, mode: int, message: str
) -> None:
    path = tmp_path / "group.key"
    if content is not None:
        path.write_text(content)
        path.chmod(mode)
    with pytest.raises(ConfigError) as caught:
        load_group_key(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_makes_a_key_and_does_not_print_it(tmp_path: Path) -> None:
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    path = tmp_path / "group.key"
    result = CliRunner().invoke(app, ["keys", "new", str(path)])
    assert result.exit_code == 0
    assert load_group_key(path).hex() not in result.output
    assert isinstance(CliRunner().invoke(app, ["keys", "new", str(path)]).exception, ConfigError)


def link(**values: object) -> LinkProfile:
    return settings(links=[{"name": "squad", **values}]).links[0]


def test_a_named_radio_gives_what_the_link_does_not() -> None:
    vhf = link(profile="vhf-1200")
    assert (vhf.rate_bits_per_s, vhf.channel_bits_per_s, vhf.header_bytes, vhf.key_up_s) == (
        1200,
        1200,
        8,
        0.3,
    )
    assert vhf.air_bytes(20) == named("vhf-1200").air_bytes(20)
    own = link(profile="vhf-1200", rate_bits_per_s=300, header_bytes=0, peers=["h:1", "h:2"], depth_bits=1500)
    assert (own.rate_bits_per_s, own.channel_bits_per_s, own.depth_bits) == (300, 1200, 1500)
    assert own.air_bytes(20) == 2 * (20 + 45)
    lora = link(profile="lora-long-fast")
    assert lora.rate_bits_per_s == 106
    assert lora.air_bytes(20) == named("lora-long-fast").air_bytes(20)
    assert link(profile="lora-short-fast", duty_cycle=0.01).rate_bits_per_s == 108


def test_a_plain_link_paces_nothing_and_a_radio_sends_one_frame_after_the_other() -> None:
    assert link(rate_bits_per_s=1200).pace_bits_per_s is None
    assert link(profile="vhf-2400", rate_bits_per_s=100).pace_bits_per_s == 2400
    assert link(kind="serial", port="/dev/ttyS0", baud=1200, rate_bits_per_s=100).pace_bits_per_s == 960
    assert link(profile="raw", rate_bits_per_s=1_000_000).pace_bits_per_s == 1_000_000


def test_a_serial_frame_costs_its_framing_too() -> None:
    line = link(kind="serial", port="/dev/ttyS0", rate_bits_per_s=1200)
    assert line.air_bytes(20) == 25
    assert link(kind="zenoh", router="tcp/h:7447", rate_bits_per_s=9600).air_bytes(20) == 104


def test_the_longest_frame_fits_mtu_and_bits() -> None:
    assert link(rate_bits_per_s=1200).longest_frame(4000) == 250
    assert link(rate_bits_per_s=1200, peers=["h:1"] * 4).longest_frame(4000) == 4000 // 32 - 28
    assert link(rate_bits_per_s=1200).longest_frame(8 * 28 - 1) == 0
    slow = link(profile="lora-long-slow")
    longest = slow.longest_frame(slow.depth_bits)
    assert 8 * slow.air_bytes(longest) <= slow.depth_bits < 8 * slow.air_bytes(longest + 1)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"profile": "vhf1200"}, "did you mean 'vhf-1200'"),
        ({"kind": "carrier pigeon"}, "kind is 'carrier pigeon': expected one of"),
        ({"kind": "serial", "rate_bits_per_s": 1200}, "lacks the key 'port'"),
        ({"kind": "file", "profile": "raw"}, "lacks the key 'path'"),
        (
            {"profile": "raw", "baud": 9600},
            'baud belongs to kind = "serial"; this link is kind = "udp", which has bind, peers, interface',
        ),
        (
            {"kind": "serial", "port": "/dev/ttyS0", "profile": "raw", "peers": ["h:1"]},
            'peers belongs to kind = "udp"',
        ),
        (
            {"profile": "lora-long-fast", "rate_bits_per_s": 500},
            "a duty cycle of 10 % of 1074 bit/s leaves 106",
        ),
        ({"profile": "vhf-1200", "rate_bits_per_s": 2400}, "the radio sends at 1200"),
        ({"rate_bits_per_s": 1200, "depth_bits": 5000}, "want at most 4000"),
        (
            {"kind": "serial", "port": "p", "profile": "raw", "mtu_bytes": 1000},
            "at most 252 on a serial link",
        ),
        ({"profile": "lora-long-slow", "duty_cycle": 0.01}, "no more than 40 bits go in one burst"),
    ],
)
def test_keys_that_do_not_fit_the_kind_or_the_radio_are_refused(
    values: dict[str, object], message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        link(**values)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
