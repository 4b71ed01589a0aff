"""Every radio's budget is kept by hubs that have too much to say; a frame's cost is worked out here anew."""

import math
import tomllib
from importlib import resources

import pytest

from proving_ground.radio_trials.budgets import Sent, check, play
from sa_hub.radio.profiles import names
from sa_hub.settings import LinkProfile

MINUTES = 0.6


def air_bits(name: str, frame_bytes: int) -> float:
    """From the profile's file, in floating point: what the frame needs on the air."""
    text = (resources.files("sa_hub.radio.profiles") / f"{name}.toml").read_text(encoding="utf-8")
    radio = tomllib.loads(text)
    length = frame_bytes + radio["header_bytes"]
    if lora := radio.get("lora"):
        sf, bandwidth, coding = lora["spreading_factor"], lora["bandwidth_hz"], lora["coding_rate"]
        slow = 2 if 2**sf / bandwidth > 0.016 else 0
        blocks = math.ceil((8 * length - 4 * sf + 28 + 16) / (4 * (sf - slow)))
        symbols = lora["preamble_symbols"] + 4.25 + 8 + max(blocks * coding, 0)
        return symbols * 2**sf / bandwidth * math.floor(sf * 4 / coding * bandwidth / 2**sf)
    seconds = radio.get("key_up_s", 0.0) + 8 * length / radio["rate_bits_per_s"]
    slot_s = radio.get("slot_s", 0.0)
    if slot_s:
        seconds = math.ceil(round(seconds / slot_s, 9)) * slot_s
    return float(seconds * radio["rate_bits_per_s"])


@pytest.mark.parametrize("name", names())
def test_no_window_carries_more_than_the_law_allows(name: str) -> None:
    link = LinkProfile(name="net", profile=name)
    sent = play(link, MINUTES, seed=4)
    rate = link.rate_bits_per_s
    depth = rate * min(max(4000 / rate, 2), 40)
    frames = 0
    for log in sent.values():
        paid = [(each.step / 10, air_bits(name, each.frame_bytes)) for each in log]
        frames += len(paid)
        for first, (begin_s, _) in enumerate(paid):
            total = 0.0
            for end_s, bits in paid[first:]:
                total += bits
                assert total <= rate * (end_s - begin_s) + depth + 1e-6
        total = 0.0
        for end_s, bits in paid:
            total += bits
            assert total <= rate * end_s + 1e-6
    assert frames >= 6  # a report takes LoRa's slowest preset half a minute of its budget
    row = check(link, sent, MINUTES)
    assert not row.budget_exceeded
    assert row.frames == frames


@pytest.mark.parametrize(
    ("steps", "kept"),
    [
        ([400], True),  # 480 bits, long earned
        ([3], False),  # 480 bits after 0.3 s: nothing has been earned yet
        ([1000] * 8, True),  # 8 · 480 bits at once, within the depth of 4,000
        ([1000] * 9, False),
        ([1000] * 8 + [1003], True),  # 4,320 bits, 4,000 and 360 earned since
        ([1000] * 8 + [1002], False),  # 4,320 bits, and 240 earned since
    ],
)
def test_a_broken_law_is_noticed(steps: list[int], kept: bool) -> None:
    """Frames of 32 bytes with UDP's 28: 480 bits each, at 1,200 bit/s."""
    link = LinkProfile(name="net", profile="udp", rate_bits_per_s=1200)
    assert 8 * link.air_bytes(32) == 480
    row = check(link, {"a1": [Sent(step, 32) for step in steps]}, 2.0)
    assert row.budget_exceeded is not kept


def test_a_broken_duty_cycle_is_noticed() -> None:
    """LongFast at 10 %: 360 s of any hour. A frame of 250 bytes takes 2.1 s; one in 20 s is too many."""
    link = LinkProfile(name="net", profile="lora-long-fast")
    airtime_s = 8 * link.air_bytes(250) / link.channel_bits_per_s
    assert 2.0 < airtime_s < 2.2
    for period_s, kept in ((math.floor(10 * airtime_s), False), (math.ceil(10 * airtime_s) + 1, True)):
        log = {"a1": [Sent(10 * second, 250) for second in range(1000, 2 * 3600, period_s)]}
        row = check(link, log, 120.0)
        assert (row.fullest_hour_duty_pct <= 10.0) is kept
