"""The text and tables of docs/radio-load.md, from what `study` found."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from proving_ground.radio_load.formats import FORMATS, OURS
from proving_ground.radio_load.study import (
    CROWD_S,
    CURVE_S,
    FORMATS_S,
    LOSS_S,
    OTHERS_SEEDS,
    RADIO_S,
    SEEDS,
    Study,
)

_BY_FORMAT: Final = (
    ("bits_per_s", "bit/s", "{:.0f}"),
    ("bytes_per_report", "bytes a report", "{:.1f}"),
    ("added_error_p50_m", "p50 m", "{:.1f}"),
    ("added_error_p95_m", "p95 m", "{:.1f}"),
    ("added_error_p99_m", "p99 m", "{:.1f}"),
    ("age_p95_s", "age p95 s", "{:.0f}"),
    ("missing_pct", "unknown %", "{:.1f}"),
    ("squeezed_error_p95_m", "p95 m within the budget", "{:.0f}"),
    ("squeezed_missing_pct", "unknown % then", "{:.0f}"),
)
_OURS: Final = (
    ("bits_per_s", "bit/s", "{:.1f}"),
    ("added_error_p50_m", "p50 m", "{:.1f}"),
    ("added_error_p95_m", "p95 m", "{:.1f}"),
    ("added_error_p99_m", "p99 m", "{:.1f}"),
    ("age_p95_s", "age p95 s", "{:.0f}"),
    ("missing_pct", "unknown %", "{:.1f}"),
    ("budget_exceeded", "budget exceeded", "{}"),
    ("floor_bits_per_s", "floor bit/s", "{:.1f}"),
)


def page(study: Study) -> str:
    """The whole page as Markdown."""
    parts = (
        _HEAD,
        _HOW,
        *(_formats(name, rows) for name, rows in study.formats.items()),
        "![Added error against bits a second](img/radio-load-curves.png)",
        _FLOOR,
        _curves(study),
        _section("The shorter tag", _TAGS, study.tags, ("tracks", "tag", "bitrate")),
        _section("Loss", _LOSS, study.loss, ("feedback", "bitrate", "loss")),
        "![Added error under loss](img/radio-load-loss.png)",
        _section("Larger squads", _CROWDS, study.crowds, ("soldiers", "bitrate")),
        _section("Radios with costs", _RADIOS, study.radios, ("link", "bitrate")),
        _sources(),
    )
    return "\n\n".join(parts) + "\n"


def _list(seeds: Sequence[int]) -> str:
    return " and ".join(str(seed) for seed in seeds)


_HEAD: Final = f"""# The radio under load

Made by `make figures`. `bootprint radio loadtest` gives the same rows for any squad, radio, budget and loss;
`bootprint radio sweep` repeats it with many seeds (local processes or Dask).

**Added error**: every second, how far off a receiver shows a soldier, against the newest place that the soldier's
own fusion has told by then, at that place's time; pooled over receivers, soldiers and seconds. Neither the fusion's
own error nor its half second is in it; deciding, waiting for bits, the time on the air, rounding and losses are.
A receiver that has never heard of a soldier shows nothing: that is "unknown". The first tables
play {FORMATS_S:.0f} s. Seeds are {_list(SEEDS)} for our own rows there, {_list(OTHERS_SEEDS)} elsewhere; none of
them was used to choose anything."""

_HOW: Final = """## How it is tested

- **Squads.** `patrol` and `building` are the library's urban patrol and building clearing with other people, in
  other directions, at other times for every seed; soldiers beyond a scenario's number are further squads of it some
  hundred metres away. `recorded` joins recorded walks (way-points of malls, surveyed footprints, motion capture)
  with halts between. What fusion says of them is modelled after this project's own on the same scenarios: five
  positions a second, half a second late, an error that wanders (1.8 m outdoors, with a jump now and then; 0.6 m
  indoors), and a stride's mean as velocity.
- **Ours.** One real hub (`sa_hub`) speaks for the squad under its budget, real hubs receive; all positions reach
  the sender as fusions tell them, five times a second. With loss there are three receivers. With feedback they
  walk, too, and report themselves on the same radio; what that costs is not in the sender's bits.
- **Others.** Every soldier's device speaks for itself by its system's rule. Bits are what the rule asks for, errors
  are over the radio at its full rate (`raw`: 9600 bit/s, no header). "Within the budget" is the same over a radio
  no faster than our budget, where each device's queue holds four messages. None of them authenticates, ours does.
- **The budget** is told from the frames on the air alone: in every window of T seconds at most rate · T + depth."""

_FLOOR: Final = """The dashed line is the floor of any code: velocity as Brownian motion, reverse water-filling
(`proving_ground.radio_load.floor` has the derivation), its intensity taken from the tracks. It knows the future,
pays for no header and no authentication, so nobody reaches it; it tells how much is left."""

_TAGS: Final = """An authentication tag of 4 bytes in place of 8, at a smaller budget."""
_LOSS: Final = f"""Urban patrol, {LOSS_S:.0f} s, three receivers that each lose frames for themselves."""
_CROWDS: Final = f"""Urban patrol, {CROWD_S:.0f} s, all through one hub; 400 soldiers take some minutes
(`bootprint radio loadtest --soldiers 400 --bitrate 650 --format bootprint`)."""
_RADIOS: Final = f"""Urban patrol, {RADIO_S:.0f} s; bits are those on the air, header, key-up, slots and symbols
included (`bootprint radio profiles`)."""


def _formats(name: str, rows: Sequence[Mapping[str, Any]]) -> str:
    columns = [title for _, title, _ in _BY_FORMAT]
    lines = [f"## {name.capitalize()}, twelve soldiers", "", *_header(["format", *columns])]
    for row in rows:
        label = f"**{row['format']}**" if row["format"] == OURS else row["format"]
        lines.append(_line([label, *_cells(row, _BY_FORMAT)]))
    return "\n".join(lines)


def _curves(study: Study) -> str:
    text = f"Our own curve, {CURVE_S:.0f} s, with the floor at the p95 that came out; below, too."
    rows = [row for rows in study.curves.values() for row in rows]
    return _section("Budgets", text, rows, ("tracks", "bitrate"))


def _section(title: str, text: str, rows: Sequence[Mapping[str, Any]], settings: Sequence[str]) -> str:
    columns = [name.replace("_", " ") for name in settings] + [title for _, title, _ in _OURS]
    lines = [f"## {title}", "", text, "", *_header(columns)]
    lines += [_line([*(_setting(row[name]) for name in settings), *_cells(row, _OURS)]) for row in rows]
    return "\n".join(lines)


def _setting(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _cells(row: Mapping[str, Any], columns: Sequence[tuple[str, str, str]]) -> list[str]:
    return [_cell(row[name], style) for name, _, style in columns]


def _cell(value: Any, style: str) -> str:
    if value is None:
        return "–"
    return _setting(value) if isinstance(value, bool) else style.format(value)


def _header(columns: Sequence[str]) -> list[str]:
    return [_line(columns), _line(["---"] * len(columns))]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _sources() -> str:
    lines = ["## Where the others' rules and bytes come from", ""]
    lines += [f"- **{each.name}** ({each.title}): {each.source}." for each in FORMATS.values()]
    return "\n".join(lines)
