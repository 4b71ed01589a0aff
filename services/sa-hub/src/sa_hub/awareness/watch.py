"""A hub's watch over its own picture: who knows whom, how well nets keep it right, which friendlies are in danger.

The hub tells what it hears and knows; on the grid of its steps `Watch` gives messages to publish.
"""

from collections.abc import Iterator, Mapping
from typing import Final

from bootprint.awareness import Contacts, FriendlyWarning, Reason
from bootprint.clock import NS_PER_S
from bootprint.config import Member
from bootprint.display import Held
from sa_hub.awareness.assess import Standpoint, Surroundings, clear_for_s, danger_of, standpoint_of
from sa_hub.awareness.contacts import ContactMap
from sa_hub.awareness.danger import Corridor
from sa_hub.awareness.lines import Lines
from sa_hub.awareness.quality import NetQuality
from sa_hub.awareness.settings import WarningSettings
from sa_hub.awareness.warner import Danger, FriendlyWarner
from sa_hub.tracks import Known, Tracks

WARN_EVERY_NS: Final = NS_PER_S // 2
CONTACTS_EVERY_NS: Final = 5 * NS_PER_S


class Watch:
    """One hub's. ``fresh_ns``: the age at which a report is stale."""

    def __init__(
        self, member: Member, roster: Mapping[int, Member], settings: WarningSettings, fresh_ns: int
    ) -> None:
        self.contacts = ContactMap(member.number, roster, fresh_ns)
        self.lines = Lines(settings)
        self._own = member.number
        self._roster = roster
        self._settings = settings
        self._warner = FriendlyWarner(member.id, settings)
        self._nets: dict[str, NetQuality] = {}
        self._clear: dict[int, tuple[Known, int]] = {}
        self._reach_m = 0.0

    def held(self, link: str) -> Held | None:
        """How well a net keeps the picture right, None until enough was heard."""
        net = self._nets.get(link)
        return None if net is None else net.held

    def told(self, before: Known | None, known: Known) -> None:
        """The picture takes a report of another soldier in; ``before`` is what it knew of them until now."""
        report = known.report
        self.contacts.told(report.number, report.time_ns)
        if before is not None and before.state == "fresh":
            net = self._nets.setdefault(known.via, NetQuality())
            net.observe(before.report, report, known.received_ns)

    def set_back(self, by_ns: int) -> None:
        """The hub's clock was set back by so much."""
        self._clear.clear()
        for part in (self.contacts, self.lines, self._warner):
            part.set_back(by_ns)

    def step(self, step_ns: int, tracks: Tracks) -> Iterator[tuple[str, FriendlyWarning | Contacts]]:
        """What is to be told at this step of the hub's grid, and its source."""
        if self._settings.on and step_ns % WARN_EVERY_NS == 0:
            for warning in self._warner.judge(list(self._dangers(step_ns, tracks)), step_ns):
                yield warning.friendly, warning
        if step_ns % CONTACTS_EVERY_NS == 0:
            yield "hub", self.contacts.message(step_ns)

    def _dangers(self, now_ns: int, tracks: Tracks) -> Iterator[Danger]:
        """Everybody who is, or a moment ago was, in danger; nobody while we do not know where we are."""
        own = tracks.get(self._own)
        if own is None or own.report.mode == "unplaced":
            return
        us = standpoint_of(own, now_ns)
        around = self._surroundings(us, now_ns)
        reach_m = around.reach_m
        if reach_m > self._reach_m:
            self._clear.clear()
        self._reach_m = reach_m
        for known in tracks.all():
            report = known.report
            if report.number == self._own or report.mode == "unplaced" or self._is_clear(known, now_ns):
                continue
            friendly = self._roster[report.number].id
            danger = danger_of(friendly, known, us, around, self.held(known.via), now_ns)
            if danger.probabilities or self._warner.watches(friendly):
                yield danger
            elif known.state == "fresh":
                until_ns = now_ns + round(clear_for_s(danger.place, reach_m) * NS_PER_S)
                self._clear[report.number] = known, until_ns

    def _is_clear(self, known: Known, now_ns: int) -> bool:
        """Whether this one was too far away to be in danger yet, and has told nothing new since."""
        seen, until_ns = self._clear.get(known.report.number, (None, 0))
        return seen is known and now_ns < until_ns

    def _surroundings(self, us: Standpoint, now_ns: int) -> Surroundings:
        targets = self.lines.targets((us.latitude_deg, us.longitude_deg), us.sigma_m, now_ns)
        corridors: list[tuple[Reason, Corridor]] = [
            ("in_target_line", corridor) for corridor in self.lines.to_targets(targets)
        ]
        pointing = self.lines.pointing(now_ns)
        if pointing is not None:
            corridors.append(pointing)
        return Surroundings(self._settings.near_m, tuple(corridors), tuple(targets))
