"""Named radios: what a frame costs on each, by figures from elsewhere or worked out by hand."""

import math

import pytest
import typer
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from sa_hub.commands import register
from sa_hub.radio.budget import depth_bits
from sa_hub.radio.medium import Lora, Medium
from sa_hub.radio.profiles import named, names

WANTED = {
    *("raw", "udp", "lte", "wifi"),
    *(f"vhf-{rate}" for rate in (1200, 2400, 4800, 9600, 16000)),
    *(f"hf-{rate}" for rate in (75, 300, 600, 1200, 2400)),
    *(f"uhf-{rate}" for rate in (16000, 32000, 64000)),
    *(f"lora-{name}" for name in ("short-fast", "medium-fast", "long-fast", "long-slow")),
}


def test_all_the_radios_are_there_and_say_where_their_figures_come_from() -> None:
    assert set(names()) >= WANTED
    for name in names():
        profile = named(name)
        assert profile.name == name
        assert profile.summary
        assert profile.source


def test_the_raw_radio_costs_nothing_but_the_frame() -> None:
    raw = named("raw")
    assert [raw.air_bytes(size) for size in (0, 1, 20, 250)] == [0, 1, 20, 250]
    assert raw.mtu_bytes == 250
    assert named("udp").air_bytes(20) == 48


def test_an_unknown_radio_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="did you mean 'vhf-1200'"):
        named("vhf1200")
    with pytest.raises(ConfigError, match="known: raw, udp, vhf-1200"):
        named("?")


@pytest.mark.parametrize(
    ("lora", "size", "airtime_ms"),
    [
        # The examples of public calculators after AN1200.13: LoRa at 125 kHz, 4/5, preamble 8.
        (Lora(spreading_factor=9, bandwidth_hz=125_000, coding_rate=5), 12, 144.384),
        (Lora(spreading_factor=7, bandwidth_hz=125_000, coding_rate=5), 13, 46.336),
        (Lora(spreading_factor=12, bandwidth_hz=125_000, coding_rate=5), 13, 1155.072),
        (Lora(spreading_factor=12, bandwidth_hz=125_000, coding_rate=5), 51, 2465.792),
    ],
)
def test_lora_airtime_is_that_of_the_public_calculators(lora: Lora, size: int, airtime_ms: float) -> None:
    assert float(lora.airtime_s(size)) == pytest.approx(airtime_ms / 1e3, rel=1e-12)


def test_lora_symbols_by_hand_without_header_and_check_sum() -> None:
    """SF8, 250 kHz (1.024 ms), 4/8: (8·10 − 32 + 28 − 20) / 32 = 1.75, so 8 + 2·8 symbols, and 12.25 before."""
    lora = Lora(spreading_factor=8, bandwidth_hz=250_000, coding_rate=8, crc=False, explicit_header=False)
    assert float(lora.airtime_s(10)) == pytest.approx((12.25 + 24) * 1.024e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "kbit_s"), [("short-fast", 10.94), ("medium-fast", 3.52), ("long-fast", 1.07)]
)
def test_lora_rates_are_those_told_for_the_presets(name: str, kbit_s: float) -> None:
    assert named(f"lora-{name}").rate_bits_per_s / 1e3 == pytest.approx(kbit_s, abs=0.005)


def test_a_lora_frame_costs_its_airtime() -> None:
    profile = named("lora-long-slow")
    assert profile.lora is not None
    airtime_s = float(profile.lora.airtime_s(20))
    assert profile.air_bytes(20) == math.ceil(airtime_s * profile.rate_bits_per_s / 8)
    assert profile.airtime_s(20) == pytest.approx(airtime_s, rel=0.03)


def test_key_up_and_whole_slots_are_paid() -> None:
    vhf = named("vhf-1200")
    assert vhf.air_bytes(20) == 20 + vhf.header_bytes + 0.3 * 1200 / 8
    # HF at 75 bit/s: 45 bits a block; 0.6 s of preamble and 8·(20 + 22) bits are 381 bits: nine blocks, 405 bits.
    assert named("hf-75").air_bytes(20) == math.ceil(405 / 8)
    slotted = Medium(rate_bits_per_s=8000, header_bytes=10, mtu_bytes=250, slot_s=0.05)
    assert [slotted.air_bytes(size) for size in (1, 40, 41, 90, 91)] == [50, 50, 100, 100, 150]


@pytest.mark.parametrize("name", sorted(WANTED))
def test_no_hour_can_exceed_the_duty_cycle(name: str) -> None:
    profile = named(name)
    rate = profile.sustained_bits_per_s
    most_s = (rate * 3600 + depth_bits(rate)) / profile.rate_bits_per_s
    assert most_s <= 3600 * profile.duty_cycle + depth_bits(rate) / profile.rate_bits_per_s * (
        profile.duty_cycle == 1.0
    )
    if profile.duty_cycle < 1.0:  # and little of what is allowed is given away
        assert most_s > 3600 * profile.duty_cycle * 0.93


@pytest.mark.parametrize("name", sorted(WANTED))
def test_the_bucket_can_hold_a_report_on_every_radio(name: str) -> None:
    profile = named(name)
    assert 8 * profile.air_bytes(40) <= depth_bits(profile.sustained_bits_per_s)


def test_the_command_lists_them() -> None:
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    shown = CliRunner().invoke(app, ["radio", "profiles"]).output
    assert all(name in shown for name in names())
    assert CliRunner().invoke(app, ["radio", "profiles", "--json", "-"]).output.count('"profile"') == len(
        names()
    )
