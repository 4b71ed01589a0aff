"""The hub's core: own messages and heard frames in; tracks, alerts, link reports and frames to send out.

Pure: event time comes with `tick` and `receive`, frames to send wait in `take_frames`. All radio decisions fall on
a grid of 0.1 s of event time. Steps that were missed are made up (the last 10 s of them) with what was known at
their time, so decisions do not depend on how often `tick` is called.
"""

from collections import Counter, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import structlog

from bootprint.awareness import Aim
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member, Realm
from bootprint.figures import Figures
from bootprint.messages import HARMLESS_CODES, Alert, Fix, Message, Observation, Position, Status
from bootprint.topics import Identity
from sa_hub.accounts import figures_of
from sa_hub.awareness.watch import Watch
from sa_hub.motion import Motion
from sa_hub.own_reports import OwnReports
from sa_hub.publishing import Publisher
from sa_hub.radio.content import MAX_HOPS, Condition, Notice, Report, Reports, StatusNotice, one_hop_on
from sa_hub.radio.net import RadioNet
from sa_hub.radio.outbox import CAPACITY
from sa_hub.radio.replay import Memory
from sa_hub.retelling import Retelling
from sa_hub.seen import Seen
from sa_hub.settings import HubSettings
from sa_hub.tracks import CLOCK_SET_BACK_NS, Known, SenderClock, Tracks
from sa_hub.translate import notice_of, report_of_fix, report_of_position

STEP_NS: Final = 100_000_000
STEPS_PER_S: Final = NS_PER_S // STEP_NS
MOST_STEPS_MADE_UP: Final = 10 * STEPS_PER_S


@dataclass(frozen=True, slots=True)
class OutgoingFrame:
    """Bytes for the air, and the link they belong to."""

    link: str
    data: bytes


class HubCore:
    """One computer's hub. ``nets``: its radio nets by link name, each with its own seal and budget."""

    def __init__(
        self, realm: Realm, member: Member, settings: HubSettings, nets: Mapping[str, RadioNet]
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._settings = settings
        self._member = member
        self._roster = realm.by_number()
        self._ids = {number: each.id for number, each in self._roster.items()}
        self._publisher = Publisher(Identity(realm.id, member.unit, member.id), self._roster)
        self._nets = dict(nets)
        self._tracks = Tracks(member.number, settings.own_ages, settings.ages)
        self._watch = Watch(member, self._roster, settings.warnings, settings.ages.stale_ns)
        self._conditions: dict[int, Condition] = {}
        self._clocks: dict[int, SenderClock] = {}
        self._motions: dict[int, Motion] = {}
        self._seen = Seen()
        self._unposted: deque[Notice] = deque(maxlen=CAPACITY)
        self._placed: Report | None = None
        self._own = OwnReports()
        self._retelling = Retelling(self._tracks, member.number, relays=settings.relays)
        self._now_ns = 0
        self._last_step: int | None = None
        self._frames: list[OutgoingFrame] = []

    # -- the core's entrances ----------------------------------------------------------------------------

    def handle(self, envelope: Envelope) -> list[Envelope]:
        """A message of our own soldier: position, fix, aim, alert, observation, status."""
        message = envelope.message
        if envelope.address.soldier != self._member.id:
            self.counters["foreign_messages"] += 1
            return []
        match message:
            case Position():
                self._placed = None
                self._watch.lines.position(message, self._now_ns)
                return self._own_report(self._report_of(message, self._member.number))
            case Fix():
                return self._place(message)
            case Aim():
                self._watch.lines.aim(message, self._now_ns)
                return []
            case Alert() | Observation() | Status():
                # What we publish of others comes back from the bus under our own subtree.
                return self._own_notice(message) if message.soldier == self._member.id else []
            case _:
                self.counters["foreign_messages"] += 1
                return []

    def take_in(self, position: Position, number: int) -> list[Envelope]:
        """Another soldier's fused position that came whole, by a way without frames: for a relay to tell on."""
        report = self._report_of(position, number)
        known = self._tracks.update(report, max(self._now_ns, report.time_ns), "bus")
        if known is None:
            self.counters["positions_out_of_order"] += 1
            return []
        return [self._track(known)]

    def place(self, fix: Fix, member: Member) -> list[Envelope]:
        """A person says where another soldier is, who cannot be told: our picture takes it, until they report."""
        report = report_of_fix(fix, member.number, self._conditions.get(member.number, "ok"))
        known = self._tracks.update(report, max(self._now_ns, report.time_ns), "person")
        return [] if known is None else [self._track(known)]

    def receive(self, link: str, datagram: bytes, now_ns: int) -> list[Envelope]:
        """A datagram from a link, arrived at ``now_ns`` of event time; anything may be in it."""
        self._advance(now_ns)
        # What was to be decided before this moment is decided before this is known.
        outputs = [] if self._last_step is None else self._steps_until((self._now_ns - 1) // STEP_NS)
        heard = self._nets[link].hear(datagram, self._now_ns, self._roster, exercise=self._settings.exercise)
        if heard is None:
            return outputs
        sender, content = heard
        self._watch.contacts.heard(sender, link, self._now_ns)
        if isinstance(content, Reports):
            return outputs + self._heard_reports(sender, content.reports, link)
        return outputs + self._heard_notice(content, link)

    def tick(self, now_ns: int) -> list[Envelope]:
        """Event time is ``now_ns``: tracks age, nets speak, links report."""
        self._advance(now_ns)
        return self._steps_until(self._now_ns // STEP_NS)

    def take_frames(self) -> list[OutgoingFrame]:
        """The frames to send since the last call, in order."""
        frames, self._frames = self._frames, []
        return frames

    @property
    def links(self) -> tuple[str, ...]:
        """The names of the hub's radio nets."""
        return tuple(self._nets)

    def hold(self, link: str, *, busy: bool) -> None:
        """Whether a link can take a frame now; until it can, its net keeps back what is due."""
        self._nets[link].hold(busy=busy)

    def kept(self, until: int | None, look: int) -> None:
        """Only what was received in looks up to ``until`` is to be acknowledged (None: all); ``look`` begins."""
        for net in self._nets.values():
            net.correspondence.kept_until, net.correspondence.look = until, look

    def memory(self, link: str) -> Memory:
        """What was heard on a link, for keeping over a restart."""
        return self._nets[link].opener.memory

    def frames_heard(self, link: str) -> int:
        """How many authentic frames came over a link, each once."""
        return self._nets[link].opener.opened

    def figures(self) -> Figures:
        """Counts of what was refused and why, over all links, and how many tracks are in which state."""
        return figures_of(self.counters, self._nets, self._tracks)

    # -- time -------------------------------------------------------------------------------------------------

    def _advance(self, now_ns: int) -> None:
        """Event time is ``now_ns``, or stands still until it is; far back means that a clock was set right."""
        if now_ns < self._now_ns - CLOCK_SET_BACK_NS:
            self._set_back(self._now_ns - now_ns)
        self._now_ns = max(self._now_ns, now_ns)
        self._post_own()
        self._own.settle(self._now_ns)
        self._tracks.own_arrived(self._now_ns)

    def _set_back(self, by_ns: int) -> None:
        """Our clock was set back: what is held in hub time goes with it, so that ages and budgets run on."""
        self.counters["clock_set_back"] += 1
        self._now_ns -= by_ns
        self._last_step = None
        self._clocks.clear()
        self._own.clear()
        self._retelling.clear()
        self._tracks.set_back(by_ns)
        self._watch.set_back(by_ns)
        for net in self._nets.values():
            net.set_back(by_ns)

    def _steps_until(self, step: int) -> list[Envelope]:
        """The steps since the last one, this one included; the first of all stands alone."""
        last = step - 1 if self._last_step is None else self._last_step
        self._last_step = max(last, step)
        first = max(last + 1, step - MOST_STEPS_MADE_UP + 1)
        return [output for each in range(first, step + 1) for output in self._step(each)]

    def _step(self, step: int) -> Iterable[Envelope]:
        """Tracks age, nets speak, once a second links report, and the watch tells what it sees in the picture."""
        step_ns = step * STEP_NS
        yield from [self._track(known) for known in self._tracks.changes(step_ns)]
        self._speak(step_ns)
        if step % STEPS_PER_S == 0:
            yield from self._each_second(step_ns)
        for source, message in self._watch.step(step_ns, self._tracks):
            yield self._publisher.message(source, message)

    # -- our own soldier --------------------------------------------------------------------------------------

    @property
    def _condition(self) -> Condition:
        return self._conditions.get(self._member.number, "ok")

    def _report_of(self, position: Position, number: int) -> Report:
        velocity = self._motions.setdefault(number, Motion()).update(position)
        return report_of_position(position, number, velocity, self._conditions.get(number, "ok"))

    def _place(self, fix: Fix) -> list[Envelope]:
        """A command post stands where a person put it; a soldier's fix is for the fusion to go on from."""
        if self._settings.role != "command_post":
            return []
        self._placed = report_of_fix(fix, self._member.number, self._condition)
        return self._own_report(self._placed)

    def _own_report(self, report: Report) -> list[Envelope]:
        known = self._tracks.update(report, max(self._now_ns, report.time_ns), "own")
        if known is None:
            self.counters["positions_out_of_order"] += 1
            return []
        self._own.add(report, self._now_ns)
        return [self._track(known)]

    def _own_notice(self, message: Alert | Observation | Status) -> list[Envelope]:
        notice = notice_of(message, self._member.number)
        if isinstance(notice, StatusNotice):
            self._conditions[notice.number] = notice.condition
        if self._seen.is_new(notice):
            self._note_target(message)
            self._unposted.append(notice)
            self._post_own()
        return []

    def _post_own(self) -> None:
        """What came before the first tick waits for it: the message's own time may be ahead of the hub's."""
        while self._now_ns and self._unposted:
            notice = self._unposted.popleft()
            for net in self._nets.values():
                net.post(notice, self._now_ns)

    # -- what was heard ---------------------------------------------------------------------------------------

    def _heard_reports(self, sender: int, reports: Sequence[Report], link: str) -> list[Envelope]:
        if not reports:
            return []
        clock = self._clocks.setdefault(sender, SenderClock())
        own = [report.time_ns for report in reports if report.number == sender and report.hops == 0]
        clock.observe(own, max(report.time_ns for report in reports), self._now_ns)
        offset_ns = clock.offset_ns
        outputs: list[Envelope] = []
        for report in reports:
            if offset_ns:
                report = replace(report, time_ns=report.time_ns + offset_ns)
            self._watch.contacts.proven(sender, report.number, report.time_ns)
            outputs += self._heard_report(report, link)
        return outputs

    def _heard_report(self, report: Report, link: str) -> list[Envelope]:
        if report.number not in self._roster:
            self.counters["unknown_soldiers"] += 1
            return []
        self._nets[link].scheduler.told(report)
        if report.number == self._member.number:
            return []
        before = self._tracks.get(report.number)
        known = self._tracks.update(report, self._now_ns, link)
        if known is None:
            self.counters["reports_not_newer"] += 1
            return []
        self._watch.told(before, known)
        return [self._track(known), *self._condition_change(report)]

    def _condition_change(self, report: Report) -> Iterable[Envelope]:
        """A report tells a condition, too; the bus hears of it when it has changed."""
        if report.condition == self._conditions.get(report.number, "ok"):
            return
        self._conditions[report.number] = report.condition
        yield self._notice(StatusNotice(report.number, report.time_ns, report.condition))

    def _heard_notice(self, notice: Notice, link: str) -> list[Envelope]:
        if notice.number not in self._roster:
            self.counters["unknown_soldiers"] += 1
            return []
        if notice.number == self._member.number or not self._seen.is_new(notice):
            return []
        if isinstance(notice, StatusNotice):
            self._conditions[notice.number] = notice.condition
        if self._settings.relays and notice.hops < MAX_HOPS:
            for name, net in self._nets.items():
                if name != link:
                    net.post(one_hop_on(notice), self._now_ns)
        return [self._notice(notice)]

    # -- what is told -----------------------------------------------------------------------------------------

    def _speak(self, step_ns: int) -> None:
        candidates = self._retelling.candidates(self._own_now(step_ns))
        for name, net in self._nets.items():
            self._retelling.see_to(name, net, step_ns)
            try:
                frames = net.speak([*candidates, *self._retelling.others(name, step_ns)], step_ns)
            except Exception:
                # A fault in one net's speech must not silence the others, nor lose the tracks of this step.
                net.faults += 1
                structlog.get_logger().exception("a net cannot speak", link=name, count=net.faults)
                continue
            self._frames += [OutgoingFrame(name, data) for data in frames]

    def _own_now(self, step_ns: int) -> Report | None:
        """Our own report for this step, unless we are lost ourselves."""
        known = self._tracks.get(self._member.number)
        return None if known is None or known.state == "lost" else self._own.at(step_ns, self._now_ns)

    def _each_second(self, second_ns: int) -> Iterable[Envelope]:
        """Link reports, and a command post that still stands where it was put."""
        if self._placed is not None:
            yield from self._own_report(replace(self._placed, time_ns=second_ns))
        fresh = sum(known.state == "fresh" for known in self._tracks.all())
        for name, net in self._nets.items():
            net.correspondence.known = fresh
            for listener, soldier, time_ns in net.scheduler.known_by_listeners():
                self._watch.contacts.proven(listener, soldier, time_ns)
            yield self._publisher.message(name, net.report(second_ns, self._ids))

    def _track(self, known: Known) -> Envelope:
        return self._publisher.track(known, self._watch.held(known.via))

    def _notice(self, notice: Notice) -> Envelope:
        envelope = self._publisher.notice(notice)
        self._note_target(envelope.message)
        return envelope

    def _note_target(self, message: Message) -> None:
        """What somebody has seen may be shot at, and who is near it matters more to everybody."""
        if not isinstance(message, Observation) or message.code in HARMLESS_CODES:
            return
        self._watch.lines.target(message, self._now_ns)
        for net in self._nets.values():
            net.scheduler.relevance.saw(self._now_ns, message.latitude_deg, message.longitude_deg)
