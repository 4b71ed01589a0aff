"""Two real hubs over real links: a shaped, lossy cable between network namespaces, a slow serial line with noise.

What a hub spends is counted where it leaves the computer: by the kernel's interface counter, byte by byte on the
line. Decisions fall on a grid of 0.1 s that a tick follows within 0.1 s, so windows get that much slack, no more.
"""

import random
import signal
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest

from support.hub_processes import A1, CP, Walker, newest_age_s, running, write_computer, write_realm
from support.namespaces import cable
from support.serial_pair import SerialPair
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes"), pytest.mark.timeout(180)]
TALKATIVE = "threshold_m = 1.0\nheartbeat_s = 1.0"
SLACK_S = 0.2
ETHERNET_UDP_BYTES = 14 + 20 + 8


def law_breaks(
    counted: Sequence[tuple[float, int]], rate: int, depth_bits: int
) -> list[tuple[float, float, int]]:
    """Windows (from s, to s, bits) between two readings of (time s, bytes so far) that carried too much."""
    return [
        (begin_s, end_s, 8 * (after - before))
        for first, (begin_s, before) in enumerate(counted)
        for end_s, after in counted[first + 1 :]
        if 8 * (after - before) > rate * (end_s - begin_s + SLACK_S) + depth_bits
    ]


def test_the_kernel_counts_no_more_than_the_budget_on_a_shaped_and_lossy_cable(tmp_path: Path) -> None:
    rate, depth, length_s = 2400, 4800, 9.0
    frozen_s = (4.0, 6.0)  # a process that stood still has no more to give afterwards than its bucket holds
    write_realm(tmp_path)
    with ExitStack() as stack:
        one, two = stack.enter_context(cable(rate_bits_per_s=4800, loss=0.2))
        links = {
            "a1": f'bind = "{one.address}:6970"\npeers = ["{two.address}:6970"]',
            "cp": f'bind = "{two.address}:6970"\npeers = ["{one.address}:6970"]',
        }
        told = f"rate_bits_per_s = {rate}\nheader_bytes = {ETHERNET_UDP_BYTES}"
        soldier = write_computer(tmp_path, "a1", TALKATIVE, f"{links['a1']}\n{told}")
        post = write_computer(tmp_path, "cp", 'role = "command_post"', f"{links['cp']}\n{told}")
        assert one.sent_bytes() == 0
        begin_s = time.monotonic()
        a1 = stack.enter_context(running(soldier, A1, one.within))
        cp = stack.enter_context(running(post, CP, two.within))
        stack.enter_context(Walker(a1))
        counted: list[tuple[float, int]] = [(begin_s, 0)]
        talk_s = time.monotonic()

        def over() -> bool:
            now_s = time.monotonic()
            counted.append((now_s, one.sent_bytes()))
            still = frozen_s[0] < now_s - talk_s < frozen_s[1]
            a1.process.send_signal(signal.SIGSTOP if still else signal.SIGCONT)
            return now_s > talk_s + length_s

        wait_until(over, what="nine seconds of talk and silence")
        assert law_breaks(counted, rate, depth) == []
        assert 8 * counted[-1][1] <= rate * (counted[-1][0] - begin_s)  # empty at start
        assert 8 * counted[-1][1] > 0.4 * rate * (length_s - 2.0)  # and there was enough to say
        wait_until(lambda: any(track.soldier == "a1" for track in cp.tracks), what="the soldier's track")
        wait_until(lambda: any(report.frames_lost > 0 for report in cp.reports), what="losses are noticed")
        wait_until(
            lambda: a1.reports and one.sent_bytes() in {report.bytes_sent for report in a1.reports[-3:]},
            what="the hub's own account is the kernel's",
        )
        one.link("down")
        wait_until(lambda: a1.health and "unreachable" in a1.health[-1].note, what="the loss is told")
        one.link("up")
        wait_until(lambda: newest_age_s(cp.tracks) < 1.0, what="the picture is right again")
        wait_until(lambda: a1.health[-1].note == "", what="the hub is well again")


@pytest.mark.parametrize(("baud", "rate"), [(9600, 4800), (1200, 600)])
def test_hubs_speak_over_a_slow_serial_line_with_noise_on_it(tmp_path: Path, baud: int, rate: int) -> None:
    write_realm(tmp_path)
    noise = random.Random(5)
    with ExitStack() as stack:
        line = SerialPair(tmp_path, baud)
        stack.callback(line.close)
        # The post has no position to tell, so it tells nothing of what it missed either.
        link = 'kind = "serial"\nport = "{}"\nbaud = {}\nrate_bits_per_s = {}\nexpected_loss = 0.2'
        soldier = write_computer(tmp_path, "a1", TALKATIVE, link.format(line.ends[0].path, baud, rate))
        post = write_computer(
            tmp_path,
            "cp",
            'role = "command_post"\nheartbeat_s = 2.0',
            link.format(line.ends[1].path, baud, rate),
        )
        line.start()
        begin_s = time.monotonic()
        a1 = stack.enter_context(running(soldier, A1))
        cp = stack.enter_context(running(post, CP))
        stack.enter_context(Walker(a1))

        noisy_at_s = begin_s

        def make_noise() -> None:
            nonlocal noisy_at_s
            if time.monotonic() > noisy_at_s:
                line.inject(1, noise.randbytes(noise.randrange(1, 30)))
                noisy_at_s = time.monotonic() + noise.expovariate(1.0)

        def heard_in_spite_of_noise() -> bool:
            make_noise()
            return len({track.time_ns for track in cp.tracks if track.soldier == "a1"}) >= 12

        def noise_is_counted() -> bool:
            make_noise()  # what came before the modem was opened, nobody could hear
            return bool(cp.health) and cp.health[-1].counters["link_garbled"] > 0

        wait_until(heard_in_spite_of_noise, what="twelve reports")
        passed = list(line.ends[0].passed)
        counted = [(begin_s, 0), *((at_s, index + 1) for index, (at_s, _) in enumerate(passed))]
        depth = min(max(4000, 2 * rate), 40 * rate)
        assert law_breaks(counted[:: max(1, len(counted) // 500)], rate, depth) == []
        assert 8 * len(passed) <= rate * (passed[-1][0] - begin_s)
        wait_until(noise_is_counted, what="noise is counted")
        line.unplug(1)
        wait_until(lambda: cp.health[-1].state == "degraded", what="the unplugged modem is told")
        line.plug(1)
        wait_until(lambda: newest_age_s(cp.tracks) < 2.0, what="the picture is right again")
        wait_until(lambda: cp.health[-1].state == "ok", what="the hub is well again")
