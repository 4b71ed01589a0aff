"""What is acknowledged by radio is on the archive's disk: a real hub's part, whose archive begins to write late."""

import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.config import load_computer
from bootprint.messages import Alert, Message, Observation, Status
from bootprint.service import Context, Options
from sa_hub.companions import keeping
from sa_hub.companions.keeping import Keeping
from sa_hub.companions.worker import Fate, Promise
from sa_hub.history.archive import Archive
from sa_hub.hub import HubCore
from sa_hub.main import HubPart, build
from sa_hub.radio.answers import Answers
from sa_hub.radio.control import Acknowledgement, Fragment
from support.hub_processes import CP, write_computer, write_realm
from support.hub_squad import GROUP_KEY, ORIGIN, START_NS, S, hub, link, own_identity
from support.radio_ear import RadioEar
from support.radio_soldier import RadioSoldier
from support.routers import running_router
from support.waiting import wait_until

POST = 'role = "command_post"\n[hub.history]'


def acknowledged(answers: Answers, now_ns: int, kept_until: int | None) -> tuple[tuple[int, int], ...]:
    sending = answers.due(now_ns, kept_until)
    if sending is None:
        return ()
    sending.sent(now_ns, 1)
    assert isinstance(sending.content, Acknowledgement)
    return sending.content.heard


def test_only_what_was_heard_until_then_is_acknowledged() -> None:
    answers = Answers("seed")
    for sender, look in ((1, 7), (2, 8)):
        answers.owe(sender, "notice", 40 + sender, START_NS, by_name=True, look=look)
    later_ns = START_NS + 3 * S
    assert acknowledged(answers, later_ns, 6) == ()
    assert acknowledged(answers, later_ns, 7) == ((1, 41),)
    assert acknowledged(answers, later_ns, None) == ((2, 42),)


class Promises:
    """As companions give them; kept by hand, or broken."""

    def __init__(self) -> None:
        self.told: list[Message] = []
        self.given = self.kept = 0
        self.broken = False

    def __call__(self, envelopes: Sequence[Envelope]) -> Promise:
        self.told += [each.message for each in envelopes]
        self.given += 1
        return partial(self._fate, self.given)

    def _fate(self, mark: int) -> Fate:
        if self.broken:
            return "unkept"
        return "kept" if self.kept >= mark else "waiting"


def envelope(message: Message, subject: str = "alert") -> Envelope:
    return Envelope(CP.address(subject, "a1"), message)


ALERT = envelope(Alert(time_ns=START_NS, soldier="a1", kind="help"))
STATUS = envelope(Status(time_ns=1, soldier="a1", condition="ok"), "status")


def test_each_notice_waits_for_its_own_promise_and_for_no_later_one() -> None:
    promises = Promises()
    found = Keeping(promises)
    found.heard([STATUS])
    assert found.until() is None, "nobody waits for a status"
    found.heard([ALERT])
    found.heard([ALERT])
    assert found.until() == 0
    promises.kept = 2
    assert found.until() == 1
    promises.kept = 3
    assert found.until() is None
    assert found.unkept == 0
    assert promises.told == [STATUS.message, ALERT.message, ALERT.message]


def test_a_disk_that_never_answers_is_not_waited_for_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keeping, "LONGEST_S", 0.0)
    found = Keeping(Promises())
    found.heard([ALERT])
    assert found.until() is None
    assert found.unkept == 1


def test_nobody_waits_for_a_broken_promise_and_its_notices_are_counted() -> None:
    promises = Promises()
    found = Keeping(promises)
    found.heard([ALERT, STATUS, ALERT])
    promises.broken = True
    assert found.until() is None
    assert found.unkept == 2


@dataclass
class Pair:
    """A command post's part and a soldier's hub on a radio; both ticked by hand."""

    part: HubPart
    soldier: RadioSoldier
    now_ns: int = field(default_factory=time.time_ns)
    heard: list[Message] = field(default_factory=list)

    def step(self) -> bool:
        """A tenth of a second passes for both; whether anything is acknowledged."""
        self.now_ns += S // 10
        self.soldier.step(self.now_ns)
        self.heard += [each.message for each in self.part.tick(self.now_ns)]
        return bool(self.soldier.acknowledged)


@pytest.fixture
def pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Pair]:
    monkeypatch.setattr(keeping, "LONGEST_S", 600.0)
    write_realm(tmp_path)
    with (
        closing(RadioSoldier(tmp_path)) as soldier,
        running_router(f"unixsock-stream/{tmp_path / 'router'}") as router,
    ):
        config = write_computer(tmp_path, "cp", POST, soldier.way)
        context = Context("sa-hub", load_computer(config), Options(config=config, router=router))
        with closing(context.connect()):
            part = build(context)
            made = Pair(part, soldier)
            # Who has just started may not speak for up to a second: until then nothing is acknowledged anyway.
            part.handle(
                Envelope(CP.address("status", "person"), Status(time_ns=0, soldier="cp", condition="busy"))
            )
            wait_until(lambda: made.step() or soldier.frames_heard > 0, what="the post's first word")
            yield made
            part.close()


def test_an_alert_is_acknowledged_by_radio_when_it_is_on_the_disk(pair: Pair, tmp_path: Path) -> None:
    pair.soldier.alert("stairs", pair.now_ns)
    wait_until(lambda: pair.step() or any(isinstance(each, Alert) for each in pair.heard), what="the alert")
    # Acknowledgements go out 0.1 to 1.1 s after what they acknowledge, of which there have been a dozen by then.
    assert not any(pair.step() for _ in range(100)), "the archive has not even begun to write"
    pair.part.start()
    wait_until(pair.step, what="the acknowledgement")
    with closing(Archive(f"sqlite:///{tmp_path}/cp/state/history.db", create=False)) as archive:
        assert archive.count("alert", 0, 2**62) == 1


def test_a_clock_that_is_set_back_lets_nothing_be_acknowledged_before_it_is_on_the_disk(pair: Pair) -> None:
    pair.soldier.alert("stairs", pair.now_ns)
    wait_until(lambda: pair.step() or any(isinstance(each, Alert) for each in pair.heard), what="the alert")
    pair.now_ns -= 120 * S
    assert not any(pair.step() for _ in range(100)), "the archive has not even begun to write"
    pair.part.start()
    wait_until(pair.step, what="the acknowledgement")
    assert pair.part.figures().counters["acknowledged_unkept"] == 0


NARROW = link("squad", mtu_bytes=60)
LONG = "two trucks and a van behind the barn, four men and a dog, " * 3


def test_who_is_killed_among_the_parts_of_an_observation_gets_them_all_again() -> None:
    """The post has heard the first part alone, and had the time to acknowledge it, when it is started anew."""
    soldier, post = hub("a1", NARROW), hub("cp", NARROW, role="command_post")
    now_ns = START_NS
    observation = Observation(
        time_ns=now_ns, soldier="a1", latitude_deg=59.36, longitude_deg=18.05, accuracy_m=7.0, text=LONG
    )
    for each in (soldier, post):
        each.tick(now_ns)
    soldier.handle(Envelope(own_identity("a1").address("observation", "person"), observation))
    now_ns += S // 10
    soldier.tick(now_ns)
    ear = RadioEar("squad", GROUP_KEY, ORIGIN)
    said = [(frame.data, ear.content(frame.data, now_ns)) for frame in soldier.take_frames()]
    first, *_ = [(data, heard[1]) for data, heard in said if heard and isinstance(heard[1], Fragment)]
    assert first[1].last > 0
    post.receive("squad", first[0], now_ns)
    for _ in range(30):
        now_ns += S // 10
        exchange(post, soldier, now_ns)
    post, heard = hub("cp", NARROW, role="command_post"), list[Envelope]()
    for _ in range(300):
        now_ns += S // 10
        heard += exchange(soldier, post, now_ns)
    assert [each.message.text for each in heard if isinstance(each.message, Observation)] == [LONG]


def exchange(speaker: HubCore, listener: HubCore, now_ns: int) -> list[Envelope]:
    """One says what is due; what the other publishes of it."""
    speaker.tick(now_ns)
    heard = (listener.receive("squad", frame.data, now_ns) for frame in speaker.take_frames())
    return [each for envelopes in heard for each in envelopes]
