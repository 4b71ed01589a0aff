"""Clocks that are wrong, set right, or not the computer's own: hubs go on speaking, and ages stay right."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bootprint.bus import Envelope
from bootprint.messages import LinkReport, Track
from sa_hub.hub import HubCore
from sa_hub.own_reports import OwnReports
from sa_hub.radio.content import Report
from sa_hub.radio.squad import partition
from sa_hub.tracks import SenderClock
from support.hub_squad import ORIGIN, START_NS, S, Walk, hub, link, position

SQUAD, BRAVO, COMPANY = link("squad"), link("bravo"), link("company", 4800)
STEP_NS = S // 20


class Exercise:
    """Hubs on one air, each with its own clock and sensors that may be stamped by another."""

    def __init__(self, hubs: Mapping[str, HubCore], walks: Mapping[str, Walk]) -> None:
        self.hubs = hubs
        self.walks = walks
        self.ahead_s = dict.fromkeys(hubs, 0.0)
        self.stamps_ahead_s = dict.fromkeys(hubs, 0.0)
        self.quiet: set[str] = set()
        self.now_ns = START_NS
        self.tracks: dict[tuple[str, str], Track] = {}
        self.sent: list[tuple[int, str, str, bytes]] = []
        self.outputs: list[tuple[str, Envelope]] = []

    def clock(self, name: str) -> int:
        """What a hub's computer takes for the time."""
        return self.now_ns + round(self.ahead_s[name] * S)

    def run(self, seconds: float, watch: Callable[[], None] = lambda: None) -> None:
        """Let time pass; frames arrive at once."""
        for _ in range(round(seconds * 20)):
            self.now_ns += STEP_NS
            for name, core in self.hubs.items():
                if name in self.walks and name not in self.quiet and self.now_ns % (S // 5) == 0:
                    self._sense(name, core)
                self._keep(name, core.tick(self.clock(name)))
            for name, core in self.hubs.items():
                for frame in core.take_frames():
                    self.sent.append((self.now_ns, name, frame.link, frame.data))
                    self._carry(name, frame.link, frame.data)
            watch()

    def _sense(self, name: str, core: HubCore) -> None:
        envelope = position(name, self.now_ns, self.walks[name])
        stamp_ns = self.clock(name) + round(self.stamps_ahead_s[name] * S)
        stamped = replace(envelope, message=_at(envelope, stamp_ns))
        self._keep(name, core.handle(stamped))

    def _carry(self, sender: str, net: str, data: bytes) -> None:
        for name, core in self.hubs.items():
            if name != sender and net in core.links:
                self._keep(name, core.receive(net, data, self.clock(name)))

    def _keep(self, name: str, envelopes: list[Envelope]) -> None:
        self.outputs += [(name, envelope) for envelope in envelopes]
        for envelope in envelopes:
            if isinstance(envelope.message, Track):
                self.tracks[name, envelope.message.soldier] = envelope.message

    def age_s(self, receiver: str, soldier: str) -> float:
        """How old the receiver shows the soldier's last report."""
        return (self.clock(receiver) - self.tracks[receiver, soldier].time_ns) / S

    def frames_of(self, name: str, since_ns: int) -> list[tuple[int, bytes]]:
        """When a hub spoke, and what it said."""
        return [(at_ns, data) for at_ns, who, _, data in self.sent if who == name and at_ns > since_ns]


def _at(envelope: Envelope, stamp_ns: int) -> object:
    message = envelope.message
    return type(message)(
        **{name: getattr(message, name) for name in message.__struct_fields__} | {"time_ns": stamp_ns}
    )


def test_a_hub_whose_clock_is_set_back_an_hour_speaks_on_within_its_budget() -> None:
    play = Exercise(
        {"a1": hub("a1", link("squad", 300)), "a2": hub("a2", link("squad", 300))},
        {"a1": Walk(), "a2": Walk(east_m=20.0)},
    )
    play.ahead_s["a1"] = 3600.0
    play.run(60.0)
    set_back_ns = play.now_ns
    play.ahead_s["a1"] = 0.0
    others: list[float] = []
    play.run(10.0, lambda: others.append(play.age_s("a1", "a2")))
    assert max(others) < 10.0
    assert play.hubs["a1"].figures().counters["clock_set_back"] == 1
    assert len(play.frames_of("a1", set_back_ns)) >= 2
    links = [e.message for n, e in play.outputs if n == "a1" and isinstance(e.message, LinkReport)]
    assert links[-1].time_ns == play.now_ns
    ages: list[float] = []
    play.run(110.0, lambda: ages.append(play.age_s("a2", "a1")))
    assert len(play.frames_of("a1", set_back_ns)) >= 15
    assert {play.tracks["a2", "a1"].state, play.tracks["a1", "a2"].state} == {"fresh"}
    assert max(ages) < 31.0
    assert play.age_s("a1", "a2") < 31.0
    sent = play.frames_of("a1", 0)
    for first, (begin_ns, _) in enumerate(sent):
        total = 0
        for end_ns, data in sent[first:]:
            total += 8 * (len(data) + 28)
            assert total <= 300 * (end_ns - begin_ns) / S + 4000


def test_full_headers_and_waiting_notices_go_on_after_the_clock_is_set_back() -> None:
    play = Exercise({"a1": hub("a1", SQUAD)}, {"a1": Walk(speed_m_s=0.0)})
    play.ahead_s["a1"] = 7200.0
    play.run(30.0)
    play.ahead_s["a1"] = 0.0
    since_ns = play.now_ns
    play.run(100.0)
    full = [data for _, data in play.frames_of("a1", since_ns) if data[1] & 1]  # 2 + 3 + 10 bits, then "full"
    assert full


def test_a_clock_set_back_by_less_than_a_minute_only_waits() -> None:
    core = hub("a1", SQUAD)
    core.tick(START_NS + 50 * S)
    assert core.tick(START_NS) == []
    assert "clock_set_back" not in core.figures().counters


@pytest.mark.parametrize("ahead_s", [600.0, -600.0, 7.0])
def test_a_relay_whose_own_stamps_are_off_serves_all_its_nets(ahead_s: float) -> None:
    lead = hub("lead", SQUAD, COMPANY, role="squad_leader")
    play = Exercise(
        {"a1": hub("a1", SQUAD), "lead": lead, "cp": hub("cp", COMPANY, role="command_post")},
        {"a1": Walk(), "lead": Walk(east_m=30.0)},
    )
    play.run(60.0)
    play.stamps_ahead_s["lead"] = ahead_s
    states: set[str] = set()
    play.run(120.0, lambda: states.update(play.tracks["cp", name].state for name in ("a1", "lead")))
    assert states == {"fresh"}
    assert play.age_s("cp", "a1") < 32.0
    assert abs(play.age_s("cp", "lead")) < 32.0
    assert play.tracks["a1", "lead"].state == "fresh"
    assert lead.figures().state == "ok"


def test_our_own_track_goes_stale_though_its_stamps_were_ahead() -> None:
    core = hub("a1", SQUAD)
    core.tick(START_NS)
    core.handle(position("a1", START_NS + 600 * S, Walk()))
    core.tick(START_NS + S)
    states = [e.message.state for e in core.tick(START_NS + 5 * S) if isinstance(e.message, Track)]
    assert states == ["stale"]


def test_a_fault_in_one_net_does_not_silence_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    core = hub("lead", SQUAD, COMPANY, role="squad_leader")

    def broken(*_: object) -> list[bytes]:
        raise ValueError("cannot say that")

    monkeypatch.setattr(core._nets["squad"], "speak", broken)
    core.tick(START_NS)
    core.handle(position("lead", START_NS + S, Walk()))
    outputs = core.tick(START_NS + 3 * S)
    assert {frame.link for frame in core.take_frames()} == {"company"}
    assert {e.address.source for e in outputs if isinstance(e.message, LinkReport)} == {"squad", "company"}
    assert core.figures().state == "degraded"
    assert core.figures().counters["radio_faults"] > 0


def _report(number: int, age_s: float) -> Report:
    return Report(number, START_NS - round(age_s * S), ORIGIN.latitude_deg, ORIGIN.longitude_deg, 1.0)


@given(st.lists(st.floats(0.0, 2000.0), min_size=1, max_size=12))
def test_reports_of_one_frame_are_no_farther_apart_than_an_age_can_say(ages_s: list[float]) -> None:
    groups = partition([_report(number, age_s) for number, age_s in enumerate(ages_s)], 3)
    assert sorted(report.number for group in groups for report in group) == list(range(len(ages_s)))
    for group in groups:
        times = [round(report.time_ns / 1e8) for report in group]
        assert max(times) - min(times) <= 4032


def test_reports_as_far_apart_as_an_age_can_say_go_in_one_frame() -> None:
    assert len(partition([_report(1, 0.0), _report(2, 403.2)], 3)) == 1
    assert len(partition([_report(1, 0.0), _report(2, 403.3)], 3)) == 2


def test_a_squad_whose_clocks_are_ahead_is_shown_at_its_age_behind_a_relay_without_sensors() -> None:
    play = Exercise(
        {
            "b1": hub("b1", BRAVO),
            "blead": hub("blead", BRAVO, COMPANY, role="squad_leader"),
            "cp": hub("cp", COMPANY, role="command_post"),
        },
        {"b1": Walk()},
    )
    play.ahead_s |= {"b1": 600.0, "blead": 600.0}
    play.run(60.0)
    assert 0.0 <= play.age_s("cp", "b1") < 15.0
    # Silence: stale 75 s after the last report, not ten minutes later.
    play.quiet.add("b1")
    play.run(90.0)
    assert play.tracks["cp", "b1"].state == "stale"
    # Their clocks are set right: followed after a few frames.
    play.quiet.clear()
    play.ahead_s |= {"b1": 0.0, "blead": 0.0}
    play.run(90.0)
    assert play.tracks["cp", "b1"].state == "fresh"
    assert -1.0 <= play.age_s("cp", "b1") < 31.0


def observed(*frames: tuple[list[int], int]) -> float:
    """The offset after frames of (own reports, newest report), in seconds after their arrival at 0."""
    clock = SenderClock()
    for own, newest in frames:
        clock.observe([each * S for each in own], newest * S, 0)
    return clock.offset_ns / S


def test_what_frames_tell_of_a_senders_clock() -> None:
    assert observed() == 0.0
    assert observed(([3], 3)) == 0.0  # within 10 s
    assert observed(([600], 600)) == -600.0
    assert observed(([-600], -600)) == 600.0
    assert observed(([], -90)) == 0.0  # an old report is no proof
    assert observed(([], 600), ([], 590)) == -600.0  # the newest is nearest to the truth
    assert observed(([-600], -600), ([], -640)) == 600.0
    assert observed(([600], 600), ([0], 0), ([0], 0)) == -600.0  # two late frames do not move it
    assert observed(([600], 600), ([0], 0), ([0], 0), ([0], 0)) == 0.0
    assert observed(([], 600), *[([], 0)] * 3) == 0.0
    assert observed(([-600], -600), *[([], -640)] * 64) == 600.0
    assert observed(([-600], -600), *[([], 0)] * 65) == 0.0


def test_own_reports_belong_to_their_step_and_are_told_in_the_hubs_time() -> None:
    own = OwnReports()
    for age_s, before_s in ((0.3, -1), (0.1, -1)):
        own.add(_report(1, age_s), START_NS + before_s * S)
    own.settle(START_NS)
    at = [own.at(START_NS - tenths * S // 10, START_NS) for tenths in (4, 3, 2, 1, 0)]
    assert at == [None, _report(1, 0.3), _report(1, 0.3), _report(1, 0.1), _report(1, 0.1)]
    own.add(_report(1, -5.0), START_NS)  # a little ahead of the clock: here already, as stamped
    own.settle(START_NS)
    assert own.at(START_NS, START_NS) == _report(1, -5.0)
    own.add(_report(1, -600.0), START_NS)
    own.settle(START_NS + S)
    assert own.at(START_NS + S, START_NS + S) == _report(1, -1.0)
