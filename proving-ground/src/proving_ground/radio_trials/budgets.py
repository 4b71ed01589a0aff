"""`bootprint benchmark budgets`: twelve soldiers with far too much to say, on every named radio, for half an hour.

The law (in every window of T seconds at most rate · T + depth bits, from an empty start) and the duty cycle are
checked on the frames that came out, over all windows, by sums of their own: nothing of the hub's bucket is asked.
"""

import hashlib
import random
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from itertools import accumulate
from typing import Annotated, Final

import numpy as np
import typer

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.commands.options import Json, write_json
from bootprint.config import Member, Origin, Realm
from bootprint.messages import Alert, Message, Observation, Position, Status
from bootprint.topics import SUBJECT_OF, Identity
from sa_hub.assembly import build_hub
from sa_hub.hub import STEP_NS, STEPS_PER_S, HubCore
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.profiles import named, names
from sa_hub.settings import HubSettings, LinkProfile

BROKEN: Final = 1  # exit code
_NET, _UNIT, _LEADER = "net", "alpha", "a1"
_ORIGIN: Final = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=50.0)
_REALM: Final = Realm(
    id="budgets",
    origin=_ORIGIN,
    roster=tuple(Member(id=f"a{number}", number=number, unit=_UNIT) for number in range(1, 13)),
)
_START_NS: Final = 1_790_000_000 * NS_PER_S
_GROUP_KEY: Final = hashlib.sha256(b"benchmark of budgets").digest()
_DEG_PER_M: Final = 1.0 / 111_405.0
_LOSS: Final = 0.1
_NOTICE_EVERY_S: Final = 20.0
_SILENCE_EVERY_S, _SILENCE_S = 300.0, 60.0


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame that a hub put out: event time from the start in steps of 0.1 s, and its length."""

    step: int
    frame_bytes: int


@dataclass(frozen=True, slots=True)
class BudgetRow:
    """One radio: ``fullest_window_pct`` is the most of rate · T + depth that any window of any hub used."""

    profile: str
    budget_bits_per_s: int
    depth_bits: int
    busiest_bits_per_s: float
    frames: int
    fullest_window_pct: float
    fullest_hour_duty_pct: float
    budget_exceeded: bool


def play(link: LinkProfile, minutes: float, seed: int = 1) -> dict[str, list[Sent]]:
    """What each hub put out in so many minutes of event time on this net."""
    squad = _Squad(link, seed)
    for step in range(round(60 * minutes * STEPS_PER_S)):
        squad.step(step)
    return squad.sent


class _Squad:
    """Twelve hubs on one net; the leader hears the others and relays them, busy links come and go."""

    def __init__(self, link: LinkProfile, seed: int) -> None:
        self.sent: dict[str, list[Sent]] = {member.id: [] for member in _REALM.roster}
        self._random = random.Random(seed)
        self._hubs = {member.id: _hub(member, link) for member in _REALM.roster}
        self._places = {member.id: [20.0 * member.number, 0.0] for member in _REALM.roster}

    def step(self, step: int) -> None:
        """A tenth of a second: everyone may move, have something to say, and speak."""
        now_ns = _START_NS + step * STEP_NS
        for name, hub in self._hubs.items():
            for message in self._news(name, step, now_ns):
                hub.handle(_own(name, message))
            hub.hold(_NET, busy=_is_silent(name, step))
            hub.tick(now_ns)
            self._speak(name, hub, step, now_ns)

    def _speak(self, name: str, hub: HubCore, step: int, now_ns: int) -> None:
        for frame in hub.take_frames():
            self.sent[name].append(Sent(step, len(frame.data)))
            if name != _LEADER and self._random.random() > _LOSS:
                self._hubs[_LEADER].receive(_NET, frame.data, now_ns)

    def _news(self, name: str, step: int, now_ns: int) -> Iterator[Message]:
        if step % STEPS_PER_S == 0:
            yield self._moved(name, now_ns)
        if self._random.random() < 1.0 / (_NOTICE_EVERY_S * STEPS_PER_S):
            yield self._notice(name, now_ns)

    def _moved(self, name: str, now_ns: int) -> Position:
        """Darts about, so that no prediction holds."""
        place = self._places[name]
        east, north = (self._random.uniform(-5.0, 5.0) for _ in range(2))
        place[0] += east
        place[1] += north
        return Position(
            time_ns=now_ns,
            latitude_deg=_ORIGIN.latitude_deg + place[1] * _DEG_PER_M,
            longitude_deg=_ORIGIN.longitude_deg + 2.0 * place[0] * _DEG_PER_M,
            height_m=50.0,
            east_m=place[0],
            north_m=place[1],
            up_m=0.0,
            mode="boots",
            covariance_m2=(1.0, 0.0, 0.0, 1.0, 0.0, 4.0),
            velocity_m_s=(east, north, 0.0),
        )

    def _notice(self, name: str, now_ns: int) -> Message:
        match self._random.randrange(3):
            case 0:
                return Alert(time_ns=now_ns, soldier=name, kind="contact", text="two o'clock, 200 m")
            case 1:
                return Observation(
                    time_ns=now_ns,
                    soldier=name,
                    latitude_deg=_ORIGIN.latitude_deg,
                    longitude_deg=_ORIGIN.longitude_deg,
                    accuracy_m=5.0,
                    text="a vehicle, its engine running, and three people beside it" * 3,
                )
            case _:
                return Status(time_ns=now_ns, soldier=name, condition="ok")


def _is_silent(name: str, step: int) -> bool:
    """A link that is gone for a minute out of five, each at its own time: its bucket is full afterwards."""
    offset_s = _REALM.member(name).number * _SILENCE_S / 2.0
    return (step / STEPS_PER_S + offset_s) % _SILENCE_EVERY_S < _SILENCE_S


def _hub(member: Member, link: LinkProfile) -> HubCore:
    settings = HubSettings(
        role="squad_leader" if member.id == _LEADER else "soldier",
        links=(link,),
        threshold_m=0.5,
        heartbeat_s=3.0,
    )
    return build_hub(_REALM, member, settings, _GROUP_KEY, lambda _net: MemoryCounters())


def _own(name: str, message: Message) -> Envelope:
    source = "fusion" if isinstance(message, Position) else "person"
    return Envelope(Identity(_REALM.id, _UNIT, name).address(SUBJECT_OF[type(message)], source), message)


# -- the law ----------------------------------------------------------------------------------------------------


def check(link: LinkProfile, sent: dict[str, list[Sent]], minutes: float) -> BudgetRow:
    """One row: what the busiest and the boldest of the hubs did with the budget."""
    paid = [[(each.step, 8 * link.air_bytes(each.frame_bytes)) for each in log] for log in sent.values()]
    rate = link.rate_bits_per_s
    depth = min(max(4000, 2 * rate), 40 * rate)
    fullest = max(_fullest_window(log, rate, depth) for log in paid)
    duty = max(_fullest_hour_bits(log) for log in paid) / (3600 * link.channel_bits_per_s)
    return BudgetRow(
        profile=link.profile or link.name,
        budget_bits_per_s=rate,
        depth_bits=depth,
        busiest_bits_per_s=max(sum(bits for _, bits in log) for log in paid) / (60.0 * minutes),
        frames=sum(map(len, paid)),
        fullest_window_pct=float(100 * fullest),
        fullest_hour_duty_pct=100.0 * duty,
        budget_exceeded=fullest > 1 or duty > link.duty_cycle,
    )


def _fullest_window(log: Sequence[tuple[int, int]], rate: int, depth: int) -> Fraction:
    """The largest share of what the law allows that stands in any window; more than 1 breaks it.

    In tenths of bits and steps of 0.1 s all of this is whole. From the start no depth is given: it is empty then.
    """
    steps = np.array([0, *(step for step, _ in log)])
    sums = np.cumsum([0, *(STEPS_PER_S * bits for _, bits in log)])
    worst = Fraction(0)
    for last in range(1, len(steps)):
        used = sums[last] - sums[:last]  # of frames 1 + index … last
        allowed = rate * (steps[last] - steps[1 : last + 1]) + STEPS_PER_S * depth
        allowed[0] = min(allowed[0], rate * steps[last])
        fullest = int(np.argmax(used / np.maximum(allowed, 1)))
        worst = max(worst, Fraction(int(used[fullest]), max(1, int(allowed[fullest]))))
    return worst


def _fullest_hour_bits(log: Sequence[tuple[int, int]]) -> int:
    """The most bits in any hour (all of a shorter play)."""
    steps = [step for step, _ in log]
    sums = [0, *accumulate(bits for _, bits in log)]
    ends = (bisect_left(steps, step + 3600 * STEPS_PER_S) for step in steps)
    return max((sums[end] - sums[begin] for begin, end in enumerate(ends)), default=0)


# -- the command ------------------------------------------------------------------------------------------------


def budgets(
    profile: Annotated[
        list[str] | None, typer.Option(help="A named radio; may be repeated (default: all).")
    ] = None,
    minutes: Annotated[float, typer.Option(help="Event time for each.", min=0.1, max=600.0)] = 30.0,
    seed: int = 1,
    json: Json = None,
) -> None:
    """Play twelve soldiers with too much to say on every radio; exit 1 if any window of any hub exceeds its budget.

    Example: bootprint benchmark budgets --profile vhf-1200 --minutes 5
    """
    links = [LinkProfile(name=_NET, profile=named(name).name) for name in profile or names()]
    rows = [check(link, play(link, minutes, seed), minutes) for link in links]
    if json is not None:
        write_json([asdict(row) for row in rows], json)
    if json != "-":
        _show(rows)
    if any(row.budget_exceeded for row in rows):
        raise typer.Exit(BROKEN)


def _show(rows: Sequence[BudgetRow]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in (
        "profile",
        "budget bit/s",
        "busiest hub",
        "frames",
        "fullest window %",
        "hour keyed %",
        "kept",
    ):
        table.add_column(heading, justify="left" if heading == "profile" else "right", no_wrap=True)
    for row in rows:
        table.add_row(
            row.profile,
            f"{row.budget_bits_per_s:,}",
            f"{row.busiest_bits_per_s:,.1f}",
            f"{row.frames:,}",
            f"{row.fullest_window_pct:.2f}",
            f"{row.fullest_hour_duty_pct:.2f}",
            "no" if row.budget_exceeded else "yes",
        )
    Console(width=max(110, Console().width)).print(table)
