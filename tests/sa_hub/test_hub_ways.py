"""Frames through files, pipes and a zenoh router, and links that hold a net back while they cannot send."""

import itertools
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.clock import ScaledClock
from bootprint.config import load_computer
from bootprint.errors import ConfigError
from bootprint.messages import Alert, LinkReport
from bootprint.service import Context, Options
from bootprint.zenoh_bus import open_bus
from sa_hub.main import HubPart, build
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.radio.links import Link
from sa_hub.radio.links.file_line import frames_in, line_of
from sa_hub.radio.links.opening import Surroundings, open_link
from support.hub_processes import write_computer, write_realm
from support.hub_squad import START_NS, S, Walk, hub, link, own_identity, position
from support.link_ears import Ears
from support.routers import free_endpoint, running_router
from support.waiting import wait_until

NOW_NS = START_NS + 5
Make = Callable[..., tuple[Link, Ears]]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Make]:
    """Makes running links that are closed in the end; ``number`` is whose computer it is."""
    with ExitStack() as stack:

        def make(number: int = 1, **options: object) -> tuple[Link, Ears]:
            profile = LinkProfile(name="squad", rate_bits_per_s=9600, **options)  # type: ignore[arg-type]
            around = Surroundings("bp", number, tmp_path, lambda: NOW_NS)
            ears = Ears(lambda on_frame: open_link(profile, on_frame, around))
            stack.callback(ears.link.close)
            return ears.link, ears

        yield make


# -- files ----------------------------------------------------------------------------------------------------


def test_frames_stand_in_the_file_with_their_event_time(opened: Make, tmp_path: Path) -> None:
    one, one_hears = opened(kind="file", path="air.txt")
    two, two_hears = opened(kind="file", path="air.txt")
    one.send(b"\x00\xff\n frame")
    assert two_hears.get() == b"\x00\xff\n frame"
    assert one_hears.get() == b"\x00\xff\n frame"  # its own echo, which the hub knows by its sender
    two.send(b"")
    assert one_hears.get() == b""
    text = (tmp_path / "air.txt").read_bytes()
    assert text == b"%d 00ff0a206672616d65\n%d \n" % (NOW_NS, NOW_NS)
    assert list(frames_in(text)) == [(NOW_NS, b"\x00\xff\n frame"), (NOW_NS, b"")]


def test_what_stood_in_the_file_before_is_not_heard_and_bad_lines_are_passed_over(
    opened: Make, tmp_path: Path
) -> None:
    path = tmp_path / "in.txt"
    path.write_bytes(line_of(1, b"old"))
    made, heard = opened(kind="file", path="out.txt", read_path="in.txt")
    whole = line_of(2, b"new")
    with path.open("ab") as file:
        for piece in (b"nonsense\n3 xyz\n\xff\xfe 00\n", whole[:4], whole[4:]):
            file.write(piece)
            file.flush()
    assert heard.get() == b"new"
    assert heard.empty()
    assert made.garbled == 3


def test_two_pipes_join_a_hub_to_a_planners_program(opened: Make, tmp_path: Path) -> None:
    for name in ("out", "in"):
        os.mkfifo(tmp_path / name)
    made, heard = opened(kind="file", path="out", read_path="in")
    made.send(b"from the hub")
    with (tmp_path / "out").open("rb") as pipe:
        assert pipe.readline() == line_of(NOW_NS, b"from the hub")
    with (tmp_path / "in").open("wb") as pipe:
        pipe.write(line_of(7, b"from the planner"))
    assert heard.get() == b"from the planner"


def test_a_pipe_that_nobody_reads_loses_frames_and_says_so(opened: Make, tmp_path: Path) -> None:
    for name in ("out", "in"):
        os.mkfifo(tmp_path / name)
    made, _ = opened(kind="file", path="out", read_path="in")
    while not made.send_faults:
        made.send(bytes(250))
    assert "squad" in made.fault
    with (tmp_path / "out").open("rb") as pipe:
        pipe.read1(60_000)
        made.send(b"again")
    assert made.fault == ""


def test_a_path_that_cannot_be_used_is_refused(opened: Make) -> None:
    with pytest.raises(ConfigError, match=r"link 'squad': cannot use .*no/such/folder.*No such file"):
        opened(kind="file", path="no/such/folder")


# -- zenoh ----------------------------------------------------------------------------------------------------


def test_frames_pass_through_the_nets_router_and_past_every_selector_of_the_bus(opened: Make) -> None:
    with running_router() as router, closing(open_bus(router)) as bus:
        one, one_hears = opened(1, kind="zenoh", router=router)
        two, two_hears = opened(2, kind="zenoh", router=router)
        seen: list[str] = []
        bus.subscribe_raw("bp/**", lambda key, _: seen.append(key))
        bus.subscribe_raw("**", lambda key, _: seen.append(key))
        wait_until(lambda: not one.busy and not two.busy, what="both are at the router")
        wait_until(lambda: (one.send(b"\x00frame"), not two_hears.empty())[1], what="the subscription stands")
        assert two_hears.get() == b"\x00frame"
        assert one_hears.empty()
        assert seen == []


def test_a_router_that_is_not_there_keeps_the_link_busy_until_it_is(opened: Make) -> None:
    endpoint = free_endpoint()
    one, _ = opened(1, kind="zenoh", router=endpoint)
    assert one.busy
    assert endpoint in one.fault
    one.send(b"nobody")
    assert one.send_faults == 1
    with running_router(endpoint):
        wait_until(lambda: not one.busy, what="the router is found")
        assert one.fault == ""
    wait_until(lambda: one.busy, what="its end is noticed")


# -- back-pressure --------------------------------------------------------------------------------------------


def test_a_busy_link_keeps_its_net_silent_and_nothing_stale_queues() -> None:
    core = hub("a1", link("net", 1200))
    for step in range(400):
        now_ns = START_NS + step * S // 10
        core.handle(position("a1", now_ns, Walk(turn_deg=90.0)))
        core.hold("net", busy=step < 300)
        core.tick(now_ns)
        frames = core.take_frames()
        if step < 300:
            assert frames == []
        elif frames:
            break
    assert step == 300
    # One report, of now: all that was due before was never made.
    assert len(frames) == 1


def test_a_link_tells_what_it_dropped_what_waits_and_what_its_duty_cycle_leaves() -> None:
    """LongSlow: 18 bit/s, so an alert waits; airtime sums up to what was sent."""
    profile = link("net", 18, profile="lora-long-slow")
    core = hub("a1", profile)
    reports: list[LinkReport] = []
    sent_bytes = 0
    for step in range(1800):
        now_ns = START_NS + step * S // 10
        core.handle(position("a1", now_ns, Walk(turn_deg=90.0)))
        if step == 300:
            alert = Alert(time_ns=now_ns, soldier="a1", kind="contact", text="x" * 40)
            core.handle(Envelope(own_identity("a1").address("alert", "people"), alert))
        outputs = core.tick(now_ns)
        sent_bytes += sum(profile.air_bytes(len(frame.data)) for frame in core.take_frames())
        reports += [each.message for each in outputs if isinstance(each.message, LinkReport)]
        if step in (50, 60):
            core.receive("net", bytes(40), now_ns)
    told = reports[-1]
    assert sum(told.drops.values()) == told.frames_rejected == 2
    keyed_s = 8 * sent_bytes / 183
    assert 10.0 < keyed_s < 20.0
    assert told.airtime_share == pytest.approx(keyed_s / 3600)
    assert told.duty_left_s == pytest.approx(360.0 - keyed_s)
    waiting = [report.frames_waiting for report in reports]
    assert set(waiting) == {0, 1}
    assert waiting[29] == 0
    assert waiting[31] == 1


def test_one_frame_at_a_time_leaves_at_the_radios_rate() -> None:
    """A VHF radio at 1.2 kbit/s takes 0.3 s of key-up, 8 bytes and the frame: half a second for a report."""
    core = hub("a1", link("net", 1200, profile="vhf-1200"))
    sent_ns = []
    for step in range(1200):
        now_ns = START_NS + step * S // 10
        core.handle(position("a1", now_ns, Walk(speed_m_s=25.0 * (-1) ** step)))
        core.tick(now_ns)
        sent_ns += [(now_ns, len(frame.data)) for frame in core.take_frames()]
    gaps = [(later - now, size) for (now, size), (later, _) in itertools.pairwise(sent_ns)]
    assert len(gaps) > 50
    assert all(gap_ns >= (0.3 + 8 * (size + 8) / 1200) * S for gap_ns, size in gaps)


def part_of(folder: Path, link_lines: str) -> tuple[HubPart, list[int]]:
    """A real hub's inside, and the list whose first number is its computer's clock, ns."""
    write_realm(folder)
    config = write_computer(folder, "a1", "threshold_m = 0.5\nheartbeat_s = 1.0", link_lines)
    options = Options(config, speed="max")  # then it waits for its epoch's second before it starts, not after
    context = Context("sa-hub", load_computer(config), options)
    host_ns = [START_NS]
    context.clock = ScaledClock(1.0, START_NS, host=lambda: host_ns[0])
    return build(context), host_ns


def test_while_a_modem_is_not_there_nothing_is_made_that_could_get_lost(tmp_path: Path) -> None:
    part, host_ns = part_of(tmp_path, 'kind = "serial"\nport = "/dev/no-modem"\nrate_bits_per_s = 1200')
    part.start()
    for step in range(100):
        host_ns[0] = START_NS + step * S // 10
        part.handle(position("a1", host_ns[0], Walk()))
        outputs = part.tick(host_ns[0])
    assert [each.message.frames_sent for each in outputs if isinstance(each.message, LinkReport)] in ([], [0])
    figures = part.figures()
    assert figures.counters["send_faults"] == 0
    assert figures.state == "degraded"
    assert "/dev/no-modem" in figures.note
    list(part.close())


def test_a_process_that_stood_still_does_not_say_all_at_once_what_it_missed(tmp_path: Path) -> None:
    """A real hub whose computer's clock is ours: positions go on coming while nothing ticks for four seconds."""
    part, host_ns = part_of(tmp_path, 'kind = "file"\npath = "air.txt"\nrate_bits_per_s = 9600')
    lines: list[int] = []
    for step in range(260):
        host_ns[0] = START_NS + step * S // 10
        part.handle(position("a1", host_ns[0], Walk(speed_m_s=30.0 * (-1) ** step)))
        if not 140 < step < 180:
            part.tick(host_ns[0])
        lines.append((tmp_path / "a1" / "air.txt").read_bytes().count(b"\n"))
    list(part.close())
    assert lines[140] > 50
    assert lines[179] == lines[140]
    assert lines[180] == lines[179] + 1
    assert lines[-1] > lines[180] + 20
