"""What people read after an exercise: ``result.json``, and ``report.html`` that needs no other file."""

import html
import json
from collections.abc import Sized
from pathlib import Path
from typing import Any

import numpy as np

from proving_ground.exercises.processes.usage import by_service
from proving_ground.exercises.reporting.plots import plots_of
from proving_ground.exercises.reporting.plotting import Plot
from proving_ground.exercises.reporting.tables import TABLES, html_table, summary
from proving_ground.exercises.scoring.picture import FALSE_M
from proving_ground.exercises.scoring.result import Result, ages_of

_MANY_ROWS = 20
_STYLE = """
:root{--ink:#1b1f23;--faint:#57606a;--line:#d0d7de;--blue:#0b6bcb}
body{font:15px/1.55 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1.2rem}
body{color:var(--ink);background:#fff}
h1{font-size:1.7rem;margin:0}h2{font-size:1.2rem;margin:2.2rem 0 .4rem}
p.note,figcaption{color:var(--faint);max-width:60rem}
.sub{color:var(--faint);margin:.2rem 0 1.4rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(13rem,1fr));gap:.8rem;margin:1rem 0}
.card{border:1px solid var(--line);border-radius:8px;padding:.7rem .9rem}
.card b{display:block;font-size:1.5rem;font-variant-numeric:tabular-nums}
.card span{color:var(--faint);font-size:.87rem}
.wide{overflow-x:auto}table{border-collapse:collapse;margin:.6rem 0;font-size:.9rem}
td,th{padding:.22rem .7rem;border-bottom:1px solid var(--line)}
th{text-align:left;font-weight:600;vertical-align:bottom}
td{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}td:first-child{text-align:left}
figure{margin:1rem 0}figure svg{max-width:100%;height:auto}
.log td{text-align:left}.log td:first-child{text-align:right}details{margin:.4rem 0}
summary{cursor:pointer;color:var(--blue)}
"""


def write_report(folder: Path, result: Result) -> None:
    """Write ``result.json`` and ``report.html`` into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "result.json").write_text(json.dumps(result.figures, indent=2) + "\n", encoding="utf-8")
    (folder / "report.html").write_text(_page(result), encoding="utf-8")


def _page(result: Result) -> str:
    name = html.escape(result.figures["exercise"])
    return (
        '<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">'
        f"<title>bootprint: {name}</title><style>{_STYLE}</style><h1>Exercise report: {name}</h1>"
        f"<p class=sub>{_circumstances(result)}</p>{_cards(result)}"
        f"{''.join(_figure(plot) for plot in plots_of(result))}"
        f"{_tables(result)}{_usage(result)}{_log(result)}{_glossary(result)}</html>\n"
    )


def _circumstances(result: Result) -> str:
    figures, exercise = result.figures, result.played.exercise
    sources = sorted({soldier.run.source for soldier in exercise.soldiers if soldier.run.source})
    how = "in one process, in event time"
    if figures["mode"] == "processes":
        pace = "in real time" if figures["speed"] == 1.0 else f"at {figures['speed']:g} times real time"
        how = f"{figures['processes']} processes {pace}"
    return html.escape(
        f"{_count(exercise.soldiers, 'soldier')}, {_count(exercise.hubs, 'post')}, "
        f"{_count(exercise.nets, 'radio net')}; "
        f"{figures['duration_s']:.0f} s; {how}. Walks: {'; '.join(sources) or 'unnamed'}."
    )


def _count(things: Sized, name: str) -> str:
    return f"{len(things)} {name}{'' if len(things) == 1 else 's'}"


def _cards(result: Result) -> str:
    figures = result.figures
    post = figures["pictures"][0] if figures["pictures"] else {}
    receiver = result.played.exercise.command_post
    cards = [
        (
            _median(figures["soldiers"], "dead_reckoning_error_p95_m"),
            "m",
            "foot steps alone, 95 % of the time",
        ),
        (_median(figures["soldiers"], "position_error_p95_m"), "m", "fused position, 95 % of the time"),
        (_median(figures["soldiers"], "inside_95_pct"), "%", "of truths inside the 95 % ellipse"),
        (_median(figures["soldiers"], "floor_correct_pct"), "%", "of the time on the right floor"),
        (post.get("picture_error_p95_m"), "m", f"picture at {receiver}, 95 % of the time"),
        (post.get("age_p95_s"), "s", f"age of what {receiver} knows, 95 % of the time"),
        (post.get("missing_pct"), "%", f"of everybody missing at {receiver}"),
        (figures.get("latency_p99_ms"), "ms", "from sensor to own track, 99 % of the time"),
    ]
    shown = "".join(
        f"<div class=card><b>{_short(value)} {unit}</b><span>{html.escape(words)}</span></div>"
        for value, unit, words in cards
        if value is not None
    )
    return f"<div class=cards>{shown}</div><p class=note>Of soldiers the median is shown.</p>"


def _short(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.2g}" if abs(value) < 1.0 else f"{value:.1f}"


def _median(rows: list[dict[str, Any]], column: str) -> float | None:
    values = [row[column] for row in rows if row[column] is not None]
    return float(np.median(values)) if values else None


def _figure(plot: Plot) -> str:
    return (
        f"<h2>{html.escape(plot.title)}</h2><figure>{plot.svg}"
        f"<figcaption>{html.escape(plot.caption)}</figcaption></figure>"
    )


def _tables(result: Result) -> str:
    return "".join(_table(title, result.figures[key]) for key, title in TABLES)


def _table(title: str, rows: list[dict[str, Any]]) -> str:
    head = f"<h2>{html.escape(title)}</h2>"
    if len(rows) <= _MANY_ROWS:
        return head + html_table(rows)
    return (
        f"{head}{html_table(summary(rows))}<details><summary>all {len(rows)} rows</summary>"
        f"{html_table(rows)}</details>"
    )


def _usage(result: Result) -> str:
    rows = result.figures.get("usage")
    if not rows:
        return ""
    return (
        f"<h2>Processes</h2>{html_table(by_service(rows))}"
        "<p class=note>Per cent of one processor while the exercise ran; memory is the proportional share (PSS). "
        "The umpire is the exercise itself: all computers' routers, the emulated nets and the observers. "
        "Services are forked from the fork-server, and share what it has imported.</p>"
        f"<details><summary>every process</summary>{html_table(rows)}</details>"
    )


def _log(result: Result) -> str:
    if not result.events:
        return "<h2>Event log</h2><p>Nothing befell anybody.</p>"
    rows = "".join(
        f"<tr><td>{_clock(event.time_s)}</td><td>{html.escape(event.who)}</td><td>{html.escape(event.what)}</td></tr>"
        for event in result.events
    )
    table = f"<table class=log><tbody>{rows}</tbody></table>"
    if len(result.events) > 2 * _MANY_ROWS:
        table = f"<details><summary>{len(result.events)} events</summary>{table}</details>"
    return f"<h2>Event log</h2>{table}"


def _clock(time_s: float) -> str:
    return f"{int(time_s) // 60}:{time_s % 60:04.1f}"


def _glossary(result: Result) -> str:
    ages = ages_of(result.played.exercise)
    return (
        "<h2>What the words mean</h2><p class=note>"
        "<b>Dead reckoning</b>: each foot's steps chained, laid over the truth by the best turn and shift; mean of "
        "both feet. <b>Fused</b>: what the soldier's own computer says. <b>Picture</b>: where a receiver believes "
        "somebody to be, moved on at constant velocity since the newest report; <b>added</b> is its distance from "
        "what the sender's fusion said. <b>Missing</b>: nothing known, or older than "
        f"{ages.lost_s:g} s. <b>False</b>: shown as fresh (younger than {ages.stale_s:g} s) and more than "
        f"{FALSE_M:g} m from the truth. "
        "<b>Lost</b> frames are those that a receiver should have heard.</p>"
    )
