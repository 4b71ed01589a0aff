"""Warnings of friendlies in danger: they begin when it has become probable enough, and end without flickering."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from bootprint.awareness import REASONS, FriendlyWarning, Reason
from bootprint.clock import NS_PER_S
from bootprint.geodesy import azimuth_of
from bootprint.messages import TrackState
from sa_hub.awareness.danger import Place
from sa_hub.awareness.settings import WarningSettings

_REPEAT_NS: Final = 5 * NS_PER_S
_ENDS_AT: Final = 0.5
"""Of the probability at which a warning begins."""
_OF_NEWS: Final[frozenset[Reason]] = frozenset({"near", "in_facing"})


@dataclass(frozen=True, slots=True)
class Danger:
    """One friendly at one moment: where, and how probably for which reason; state and age are the track's."""

    friendly: str
    place: Place
    probabilities: Mapping[Reason, float]
    state: TrackState
    age_s: float
    floor: int | None


@dataclass(slots=True)
class _Spell:
    """How long a reason has held: since when, and when it last did."""

    since_ns: int
    last_ns: int


@dataclass(slots=True)
class _Case:
    """What is going on with one friendly; ``told`` is what was warned of last."""

    spells: dict[Reason, _Spell] = field(default_factory=dict)
    told: tuple[tuple[Reason, ...], TrackState] = ((), "fresh")
    told_ns: int = 0


class FriendlyWarner:
    """Dangers in, warnings out, when one begins, changes or ends, and every 5 s while it lasts."""

    def __init__(self, soldier: str, settings: WarningSettings) -> None:
        self._soldier = soldier
        self._settings = settings
        self._hold_ns = round(settings.hold_s * NS_PER_S)
        self._familiar_ns = round(settings.familiar_s * NS_PER_S)
        self._cases: dict[str, _Case] = {}

    def watches(self, friendly: str) -> bool:
        """Whether there is, or was a moment ago, anything to warn of."""
        return friendly in self._cases

    def judge(self, dangers: Sequence[Danger], now_ns: int) -> Iterator[FriendlyWarning]:
        """What to tell now; to be given everybody who is watched, and whoever may be in danger."""
        for danger in dangers:
            case = self._cases.get(danger.friendly) or _Case()
            self._count(case, danger, now_ns)
            if not case.spells and not case.told[0]:
                self._cases.pop(danger.friendly, None)
                continue
            self._cases[danger.friendly] = case
            reasons = tuple(self._reasons(case, danger.state, now_ns))
            if self._is_to_be_told(case, (reasons, danger.state), now_ns):
                case.told, case.told_ns = (reasons, danger.state), now_ns
                yield self._warning(danger, reasons, now_ns)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for case in self._cases.values():
            case.told_ns -= by_ns
            for spell in case.spells.values():
                spell.since_ns -= by_ns
                spell.last_ns -= by_ns

    def _count(self, case: _Case, danger: Danger, now_ns: int) -> None:
        """Begin, lengthen and forget the spells of reasons."""
        for reason in REASONS:
            spell = case.spells.get(reason)
            holds = spell is not None and now_ns - spell.last_ns <= self._hold_ns
            least = self._settings.begins_at * (_ENDS_AT if holds else 1.0)
            if danger.probabilities.get(reason, 0.0) >= least:
                if spell is None:
                    case.spells[reason] = _Spell(now_ns, now_ns)
                else:
                    spell.last_ns = now_ns
            elif spell is not None and now_ns - spell.last_ns > self._memory_ns(reason):
                del case.spells[reason]

    def _memory_ns(self, reason: Reason) -> int:
        return self._familiar_ns if reason in _OF_NEWS else self._hold_ns

    def _reasons(self, case: _Case, state: TrackState, now_ns: int) -> Iterable[Reason]:
        """Those that hold, or did a moment ago, and are still news."""
        for reason in REASONS:
            spell = case.spells.get(reason)
            if spell is None or now_ns - spell.last_ns > self._hold_ns:
                continue
            familiar = spell.last_ns - spell.since_ns >= self._familiar_ns
            if not (familiar and reason in _OF_NEWS and state == "fresh"):
                yield reason

    def _is_to_be_told(self, case: _Case, now: tuple[tuple[Reason, ...], TrackState], now_ns: int) -> bool:
        if not now[0] and not case.told[0]:
            return False
        return now != case.told or now_ns - case.told_ns >= _REPEAT_NS

    def _warning(self, danger: Danger, reasons: tuple[Reason, ...], now_ns: int) -> FriendlyWarning:
        place = danger.place
        of = [danger.probabilities.get(reason, 0.0) for reason in reasons or REASONS]
        return FriendlyWarning(
            time_ns=now_ns,
            soldier=self._soldier,
            friendly=danger.friendly,
            reasons=reasons,
            probability_pct=100.0 * min(1.0, max(of)),
            distance_m=place.distance_m,
            azimuth_rad=azimuth_of(place.east_m, place.north_m),
            sigma_m=place.sigma_m,
            state=danger.state,
            age_s=danger.age_s,
            up_m=place.up_m,
            floor=danger.floor,
        )
