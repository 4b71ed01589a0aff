"""What nets are told of others: by a relay, to one who asked for the picture, and after contact came back."""

from collections.abc import Iterator, Sequence
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import MAX_HOPS, Report, one_hop_on
from sa_hub.radio.net import RadioNet
from sa_hub.tracks import Tracks

ANSWER_NS: Final = 5 * NS_PER_S
"""For how long a hub that does not relay tells of others, once it was asked."""


class Retelling:
    """What a relay passes on, and what each net is to hear again, by the net's name."""

    def __init__(self, tracks: Tracks, own: int, *, relays: bool) -> None:
        self._tracks = tracks
        self._own = own
        self._relays = relays
        self._answers: dict[str, tuple[int, set[int]]] = {}

    def see_to(self, name: str, net: RadioNet, step_ns: int) -> None:
        """Tell everybody to one who asked; after contact came back, all that this net has from us alone."""
        if net.correspondence.regained:
            net.correspondence.regained = False
            net.scheduler.forget(known.report.number for known in self._tracks.all() if known.via != name)
        if net.correspondence.answering.due(step_ns):
            fresh = {known.report.number for known in self._tracks.all() if known.state == "fresh"}
            net.scheduler.forget(fresh)
            self._answers[name] = step_ns + ANSWER_NS, fresh

    def others(self, name: str, step_ns: int) -> Sequence[Report]:
        """Others' reports that a hub which does not relay tells for a moment, because somebody asked."""
        until_ns, numbers = self._answers.get(name, (0, set()))
        if self._relays or step_ns >= until_ns:
            return ()
        known = (self._tracks.get(number) for number in numbers - {self._own})
        return [one_hop_on(each.report) for each in known if each and each.report.hops < MAX_HOPS]

    def candidates(self, own: Report | None) -> list[Report]:
        """What every net may be told: our own report and, from a relay, others' that it may pass on; by number."""
        found = [] if own is None else [own]
        if self._relays:
            found += self._to_pass_on()
        return sorted(found, key=lambda report: report.number)

    def _to_pass_on(self) -> Iterator[Report]:
        """Others' reports that are not lost and may pass another relay."""
        for known in self._tracks.all():
            passable = known.state != "lost" and known.report.hops < MAX_HOPS
            if passable and known.report.number != self._own:
                yield known.passed_on

    def clear(self) -> None:
        """The clock was set back: who still wants something asks again."""
        self._answers.clear()
