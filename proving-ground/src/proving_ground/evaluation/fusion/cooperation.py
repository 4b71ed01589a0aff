"""What ranges between soldiers are worth: whole squads in lockstep, fusions, hubs and radio nets together.

A fusion hears what its own hub makes of the reports that came over the emulated radio, and its positions go out by
the same way: the loop that cooperation closes is played for real, in event time. ``python -m
proving_ground.evaluation.fusion.cooperation`` prints each trial's table.
"""

import argparse
import math
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from bootprint import logs
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.geodesy import moved_place
from bootprint.messages import Position, Track
from fusion.config import FusionConfig, PeersConfig
from fusion.engine import FusionCore
from pdr_engine.foot import warm_up
from proving_ground.evaluation.fusion.library_honesty import Honesty, cases, honesty
from proving_ground.evaluation.fusion.lines import Heard, fused
from proving_ground.exercises.event_time.radio_play import RadioPlay

SCENARIO = str(Path(__file__).parent / "scenarios" / "ranging-squad.toml")
SEEDS = (1, 3, 5)
_PLAYED_S = 180.0
_SETTLE_S = 60.0  # before it nobody is judged: the unplaced have to be placed
_LIE_M = 40.0

Hears = Callable[[Envelope], bool]


@dataclass(frozen=True)
class Seat:
    """One soldier of a squad: what is heard, how fusion is set, which of the messages are let through."""

    heard: Heard
    config: FusionConfig
    hears: Hears = lambda _envelope: True
    lies: bool = False


class SquadPlay:
    """Fusions, hubs and nets of a squad, a tenth of a second at a time; `run` once."""

    def __init__(self, seats: Sequence[Seat]) -> None:
        first = seats[0].heard
        self._seats = {seat.heard.soldier.id: seat for seat in seats}
        self._cores = {
            name: FusionCore(seat.config, seat.heard.identity, seat.heard.origin)
            for name, seat in self._seats.items()
        }
        self._next = dict.fromkeys(self._seats, 0)
        self.positions: dict[str, list[Position]] = defaultdict(list)
        end_ns = max(seat.heard.messages[-1][0] for seat in seats)
        self._radio = RadioPlay(first.exercise, {}, first.begins_ns, end_ns, watcher=self)

    def run(self) -> Mapping[str, list[Position]]:
        """Everybody's positions."""
        self._radio.run()
        for name, core in self._cores.items():
            self._put_out(name, core.close(), None)
        return self.positions

    def before(self, now_ns: int) -> bool:
        """A step of the radio: everybody's sensors up to then first."""
        for name, core in self._cores.items():
            seat, index = self._seats[name], self._next[name]
            messages = seat.heard.messages
            while index < len(messages) and messages[index][0] <= now_ns:
                if seat.hears(messages[index][1]):
                    self._put_out(name, core.handle(messages[index][1]), now_ns)
                index += 1
            self._next[name] = index
            self._put_out(name, core.tick(now_ns), now_ns)
        return True

    def _put_out(self, name: str, envelopes: Iterable[Envelope], now_ns: int | None) -> None:
        for envelope in envelopes:
            if isinstance(envelope.message, Position):
                self.positions[name].append(envelope.message)
                if now_ns is not None:
                    self._radio.hand(name, envelope, now_ns)

    def kept(self, computer: str, envelopes: list[Envelope]) -> None:
        """A hub has spoken; its fusion hears the tracks."""
        core = self._cores.get(computer)
        for envelope in envelopes:
            if core is not None and isinstance(envelope.message, Track):
                core.handle(replace(envelope, message=self._as_told(envelope.message)))

    def _as_told(self, track: Track) -> Track:
        """A liar's track is far off, and as sure as any."""
        seat = self._seats.get(track.soldier)
        if seat is None or not seat.lies:
            return track
        latitude, longitude = moved_place((track.latitude_deg, track.longitude_deg), _LIE_M, 0.0)
        return msgspec.structs.replace(track, latitude_deg=latitude, longitude_deg=longitude)


# --- trials ----------------------------------------------------------------------------------------------------


def _deaf(*subjects: str) -> Hears:
    return lambda envelope: envelope.address.subject not in subjects


def _as_they_are(heard: Sequence[Heard]) -> list[Seat]:
    return [Seat(one, one.config) for one in heard]


def _one_unplaced(heard: Sequence[Heard]) -> list[Seat]:
    """The third soldier has neither receiver nor start."""
    seats = _as_they_are(heard)
    config = msgspec.structs.replace(heard[2].config, start=None, gnss_sources=())
    seats[2] = Seat(heard[2], config, _deaf("gnss"))
    return seats


def _one_by_body(heard: Sequence[Heard]) -> list[Seat]:
    """The third soldier has neither receiver nor boots: the body-worn unit carries on from a start."""
    seats = _as_they_are(heard)
    config = msgspec.structs.replace(heard[2].config, gnss_sources=())
    seats[2] = Seat(heard[2], config, _deaf("gnss", "foot_step", "foot_pose"))
    return seats


def _one_lies(heard: Sequence[Heard]) -> list[Seat]:
    """As above, and what is heard of the second soldier is 40 m off."""
    seats = _one_by_body(heard)
    seats[1] = replace(seats[1], lies=True)
    return seats


def _nobody_sees_satellites(heard: Sequence[Heard]) -> list[Seat]:
    """All by boots without compass, from starts as good as each says; the third by body."""
    seats = [Seat(one, msgspec.structs.replace(one.config, gnss_sources=()), _deaf("gnss")) for one in heard]
    seats[2] = replace(seats[2], hears=_deaf("gnss", "foot_step", "foot_pose"))
    return seats


TRIALS: Mapping[str, Callable[[Sequence[Heard]], list[Seat]]] = {
    "one without satellites or start": _one_unplaced,
    "one without satellites or boots": _one_by_body,
    "the same, and a peer lies": _one_lies,
    "nobody has satellites, one no boots": _nobody_sees_satellites,
}


def alone(seats: Sequence[Seat]) -> list[Honesty]:
    """Each soldier's errors without ranges, in order, after the first minute; nobody has to hear of anybody."""
    return [honesty(seat.heard, _settled(seat, _fused_alone(seat))) for seat in seats]


def _fused_alone(seat: Seat) -> list[Position]:
    config = msgspec.structs.replace(seat.config, peers=PeersConfig(use=False))
    return fused(seat.heard, lambda envelope, _since_s: seat.hears(envelope), config)


def together(seats: Sequence[Seat]) -> list[Honesty]:
    """The same as a squad."""
    positions = SquadPlay(seats).run()
    return [honesty(seat.heard, _settled(seat, positions[seat.heard.soldier.id])) for seat in seats]


def _settled(seat: Seat, positions: Sequence[Position]) -> list[Position]:
    begin_ns = seat.heard.begins_ns + round(_SETTLE_S * NS_PER_S)
    return [one for one in positions if one.time_ns >= begin_ns]


Outcome = tuple[list[Honesty], list[Honesty]]


def measure(scenario: str, names: Sequence[str], seeds: Sequence[int]) -> dict[str, list[Outcome]]:
    """Each trial of each seed, without and with ranges."""
    found: dict[str, list[Outcome]] = {name: [] for name in names}
    for seed in seeds:
        heard = list(cases(scenario, seed, 5, _PLAYED_S))
        for name in names:
            seats = TRIALS[name](heard)
            found[name].append((alone(seats), together(seats)))
    return found


def table(found: Mapping[str, Sequence[Outcome]]) -> list[str]:
    """Lines of a Markdown table: the third soldier, and the others, without and with ranges."""
    lines = [
        "| trial | seeds | who | p50 m without | with | p95 m without | with | worst m without | with"
        " | inside 95 % without | with |",
        "|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for name, outcomes in found.items():
        third = [([off[2]], [on[2]]) for off, on in outcomes]
        others = [([*off[:2], *off[3:]], [*on[:2], *on[3:]]) for off, on in outcomes]
        lines += [_row(name, "the third", third), _row(name, "the others", others)]
    return lines


def _row(name: str, who: str, outcomes: Sequence[Outcome]) -> str:
    sides = [[one for outcome in outcomes for one in outcome[side]] for side in (0, 1)]
    figures = [_figures([one for one in side if one.error_m.size]) for side in sides]
    cells = [
        "–" if math.isnan(value) else f"{value:.1f}" for pair in zip(*figures, strict=True) for value in pair
    ]
    return f"| {name} | {len(outcomes)} | {who} | {' | '.join(cells)} |"


def _figures(found: Sequence[Honesty]) -> tuple[float, float, float, float]:
    if not found:
        return (float("nan"),) * 4
    error_m = np.concatenate([one.error_m for one in found])
    inside = np.concatenate([one.inside for one in found])
    return (
        float(np.median(error_m)),
        float(np.percentile(error_m, 95)),
        float(error_m.max()),
        100.0 * float(inside.mean()),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Play the trials asked for and print the table."""
    parser = argparse.ArgumentParser(description="squads with and without ranges between soldiers")
    parser.add_argument("--scenario", default=SCENARIO)
    parser.add_argument("--trials", nargs="+", choices=list(TRIALS), default=list(TRIALS))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    chosen = parser.parse_args(arguments)
    logs.configure("error")
    warm_up()
    sys.stdout.write("\n".join(table(measure(chosen.scenario, chosen.trials, chosen.seeds))) + "\n")


if __name__ == "__main__":
    main()
