"""Trials of the radio's promises: a squad's real hubs over one emulated net that loses frames at random.

How soon alerts reach everybody while positions flow, how soon a late joiner, or a hub that comes back after an
outage, has the picture. ``python -m proving_ground.radio_trials.delivery`` prints a table; all in event time,
and the same seeds give the same figures.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import msgspec
import typer

from bootprint.messages import Alert
from proving_ground.radio_trials.squad import Room, Trial

_LIMIT_S: Final = 120.0
RIGHT_M: Final = 10.0
"""Twice the error that makes a report due."""


@dataclass(frozen=True)
class Figure:
    """A row of the table: waits in seconds of those who got it, and how many did within the promise."""

    trial: str
    loss: float
    header_bytes: int
    promise_s: float
    n: int
    within_pct: float
    never: int
    p50_s: float | None
    p99_s: float | None
    worst_s: float | None
    bits_per_s: float


def figure(name: str, room: Room, promise_s: float, waits_s: Sequence[float], bits_per_s: float) -> Figure:
    """Sum up: a wait that never ended is infinite."""
    ended = sorted(wait for wait in waits_s if math.isfinite(wait))

    def quantile(share: float) -> float | None:
        return ended[min(len(ended) - 1, math.ceil(share * len(ended)))] if ended else None

    within = sum(wait <= promise_s for wait in ended)
    return Figure(
        trial=name,
        loss=room.loss,
        header_bytes=room.header_bytes,
        promise_s=promise_s,
        n=len(waits_s),
        within_pct=100.0 * within / len(waits_s),
        never=len(waits_s) - len(ended),
        p50_s=quantile(0.5),
        p99_s=quantile(0.99),
        worst_s=ended[-1] if ended else None,
        bits_per_s=bits_per_s,
    )


def alerts(room: Room, seeds: Iterable[int], count: int = 20, every_s: float = 15.0) -> Figure:
    """Alerts of soldiers in turn, from 60 s on; one wait for each alert and each other hub."""
    waits: list[float] = []
    bits = seconds = 0.0
    for seed in seeds:
        trial = Trial(room, seed)
        trial.start(room.names)
        raised: dict[str, float] = {}
        for index in range(count):
            trial.run(60.0 + index * every_s)
            name = room.names[index % len(room.names)]
            raised[str(index)] = trial.now_s
            trial.say(name, Alert(time_ns=trial.now_ns, soldier=name, kind="contact", text=str(index)))
        trial.run(60.0 + count * every_s + 60.0)
        waits += _alert_waits(trial, raised)
        bits += sum(trial.bits.values())
        seconds += trial.now_s
    return figure("alert", room, 10.0, waits, bits / seconds)


def _alert_waits(trial: Trial, raised: Mapping[str, float]) -> list[float]:
    came = {
        (name, envelope.message.text): at_s - raised[envelope.message.text]
        for at_s, name, envelope in trial.heard
        if isinstance(envelope.message, Alert)
    }
    pairs = len(raised) * (len(trial.room.names) - 1)
    return [*came.values(), *[math.inf] * (pairs - len(came))]


def _until_right(trial: Trial, name: str, allowed_m: float) -> float:
    """How long from now until a hub has shown everybody, with fresh tracks not farther off than this."""
    begin_s = trial.now_s
    missing = set(trial.room.names)
    while trial.now_s < begin_s + _LIMIT_S:
        trial.run(trial.now_s + 0.1)
        missing = {soldier for soldier in missing if not trial.error_m(name, soldier) <= allowed_m}
        if not missing:
            return trial.now_s - begin_s
    return math.inf


def late_joiner(room: Room, seeds: Iterable[int], late_s: float = 300.0) -> Figure:
    """The first soldier's hub starts so long after the others; until it shows everybody."""
    waits, bits, seconds = [], 0.0, 0.0
    for seed in seeds:
        trial = Trial(room, seed)
        trial.start(room.names[1:])
        trial.run(late_s)
        trial.start(room.names[:1])
        waits.append(_until_right(trial, room.names[0], math.inf))
        bits += sum(trial.bits.values())
        seconds += trial.now_s
    return figure("late joiner", room, 15.0, waits, bits / seconds)


def outage(room: Room, seeds: Iterable[int], who: str = "") -> Figure:
    """A link is gone for 300 s, everybody's or one hub's; until that hub has shown everybody right."""
    waits, bits, seconds = [], 0.0, 0.0
    watcher = who or room.names[0]
    for seed in seeds:
        trial = Trial(room, seed, [(who, 120.0, 420.0)])
        trial.start(room.names)
        trial.run(420.0)
        waits.append(_until_right(trial, watcher, RIGHT_M))
        bits += sum(trial.bits.values())
        seconds += trial.now_s
    return figure("outage of all" if not who else "outage of one", room, 15.0, waits, bits / seconds)


def trials(room: Room, seeds: Sequence[int]) -> dict[str, Callable[[], Figure]]:
    """Every trial by its name."""
    return {
        "alert": lambda: alerts(room, seeds),
        "joiner": lambda: late_joiner(room, seeds),
        "outage of all": lambda: outage(room, seeds),
        "outage of one": lambda: outage(room, seeds, room.names[0]),
    }


def main(
    seeds: Annotated[int, typer.Option(help="Runs of each trial.")] = 10,
    first_seed: int = 0,
    soldiers: Annotated[int, typer.Option(help="Soldiers beside the leader.")] = 12,
    only: Annotated[str, typer.Option(help="Begin of the names of the trials to run.")] = "",
    json: Annotated[bool, typer.Option(help="Rows as JSON.")] = False,
) -> None:
    """Alerts, late joiners and outages at 1.2 kbit/s, with and without UDP/IP headers, at 0 and 30 % loss."""
    for header_bytes in (0, 28):
        for loss in (0.0, 0.3):
            room = Room(soldiers=soldiers, loss=loss, header_bytes=header_bytes)
            for name, run in trials(room, range(first_seed, first_seed + seeds)).items():
                if name.startswith(only):
                    row = run()
                    typer.echo(msgspec.json.encode(row).decode() if json else _line(row))


def _line(row: Figure) -> str:
    waits = " ".join("-" if wait is None else f"{wait:6.1f}" for wait in (row.p50_s, row.p99_s, row.worst_s))
    return (
        f"{row.trial:14} loss {row.loss:.0%} header {row.header_bytes:2} n {row.n:6} "
        f"within {row.promise_s:.0f} s {row.within_pct:7.3f} % never {row.never} p50/p99/worst {waits} s "
        f"{row.bits_per_s:.0f} bit/s"
    )


if __name__ == "__main__":
    typer.run(main)
