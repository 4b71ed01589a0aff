"""Who does what when, as strips of letters over time and as rows of a table."""

from proving_ground.people import GaitName, Itinerary, Person, leg_duration_s
from proving_ground.scenario.scenario import Play
from proving_ground.scenario.schedule import Timetable

LETTERS: dict[GaitName, str] = {
    "stand": "·",
    "turn": "·",
    "kneel": "k",
    "prone": "p",
    "walk": "w",
    "run": "r",
    "sprint": "R",
    "crawl": "c",
    "side_step_left": "s",
    "side_step_right": "s",
    "backward": "b",
    "stairs": "^",
    "lift": "L",
}
LEGEND = (
    "· stand  k kneel  p prone  w walk  r run  R sprint  c crawl  s side step  b backward  ^ stairs  L lift"
)


def strip(person: Person, itinerary: Itinerary, duration_s: float, columns: int) -> str:
    """A letter for each of ``columns`` equal slices of the exercise: what takes most of it."""
    spent: list[dict[str, float]] = [{} for _ in range(columns)]
    start_s, slice_s = itinerary.start_s, duration_s / columns
    for leg in itinerary.legs:
        end_s = start_s + leg_duration_s(person, leg)
        for index in range(int(start_s / slice_s), min(columns, int(end_s / slice_s) + 1)):
            share_s = min(end_s, (index + 1) * slice_s) - max(start_s, index * slice_s)
            letter = LETTERS[leg.gait]
            spent[index][letter] = spent[index].get(letter, 0.0) + max(share_s, 0.0)
        start_s = end_s
    return "".join(max(slot, key=lambda letter: slot[letter]) if slot else " " for slot in spent)


def ruler(duration_s: float, columns: int) -> str:
    """A line of times above strips of that many columns."""
    step_s = next((s for s in (10, 30, 60, 120, 300, 600, 1800) if columns * s / duration_s >= 8), 3600)
    line = [" "] * (columns + 8)
    for second in range(0, int(duration_s) + 1, step_s):
        mark = clock_text(second)
        at = round(second / duration_s * columns)
        line[at : at + len(mark)] = mark
    return "".join(line).rstrip()


def clock_text(time_s: float) -> str:
    """Minutes and seconds."""
    return f"{int(time_s) // 60}:{int(time_s) % 60:02d}"


def doings(timetable: Timetable) -> list[tuple[str, str]]:
    """Start and words of everything a soldier does; the same thing again at once is told once."""
    rows: list[tuple[str, str]] = []
    for doing in timetable.doings:
        if not rows or rows[-1][1] != doing.text:
            rows.append((clock_text(doing.start_s), doing.text))
    return rows


def distance_m(timetable: Timetable) -> float:
    """How far a soldier goes, in the plane."""
    total = 0.0
    for leg in timetable.itinerary.legs:
        steps = leg.points_m[1:, :2] - leg.points_m[:-1, :2]
        total += float((steps**2).sum(axis=1).__pow__(0.5).sum())
    return total


def longest_m(play: Play) -> float:
    """How far the soldier goes who goes furthest."""
    return max(distance_m(timetable) for timetable in play.timetables.values())
