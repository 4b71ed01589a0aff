"""How hub and page bear many soldiers: ``python -m support.page_load [--soldiers 500] [--seconds 30]``.

A real command post hears every soldier's own frames twice a second, archives and shows them; a real browser looks
on, and somebody clicks and presses keys in it. How long after each the page has handled it, and has painted what
came of it, the browser itself says (Event Timing). Painting is done in software here.
"""

import math
import random
import statistics
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from bootprint.commands.options import Json, write_json
from support.browser import running_chromium, tab
from support.crowd import CrowdedPost, crowded_post

_LEAST_MS: Final = 16.0
"""The browser tells of no event that took less."""
_OBSERVE: Final = """() => { window.told = [];
    new PerformanceObserver(list => window.told.push(...list.getEntries().filter(each => each.interactionId)
        .map(each => [each.interactionId, each.processingEnd - each.startTime, each.duration])))
        .observe({type: "event", durationThreshold: 16, buffered: false}); }"""


def main(
    soldiers: Annotated[int, typer.Option(min=1, max=1000, help="In the picture.")] = 500,
    seconds: Annotated[float, typer.Option(min=5.0, help="How long the browser is worked with.")] = 30.0,
    json_out: Json = None,
) -> None:
    """Measure hub and page under load."""
    with tempfile.TemporaryDirectory() as folder, crowded_post(Path(folder), soldiers) as post:
        row = {"soldiers": soldiers, **_work(post, soldiers, seconds)}
    write_json(row, json_out or "-")


def _work(post: CrowdedPost, soldiers: int, seconds: float) -> dict[str, Any]:
    """Click on people, switch floors; what the browser says of it, and what it cost the hub."""
    dice = random.Random(1)
    with running_chromium() as chromium, tab(chromium, post.address, 1280, 800) as looking:
        looking.wait(f"squad.state.tracks.size === {soldiers} && squad.map.ready && squad.fitted")
        looking.page.evaluate(_OBSERVE)
        before, began, began_cpu_s = post.counters(), time.monotonic(), post.cpu_s()
        rows, actions, until = looking.page.locator(".row[data-soldier]"), 0, time.monotonic() + seconds
        while time.monotonic() < until:
            rows.nth(dice.randrange(20)).click()
            looking.page.keyboard.press(dice.choice("0123t"))
            actions += 2
            looking.page.wait_for_timeout(200.0)
        told = looking.page.evaluate("window.told")
        lasted_s, cpu_s, after = time.monotonic() - began, post.cpu_s() - began_cpu_s, post.counters()
        assert looking.faults == []
    return {
        "hub_cpu_share": cpu_s / lasted_s,
        "archived_per_s": (after["history_taken"] - before["history_taken"]) / lasted_s,
        "dropped": after["page_dropped"] + after["history_dropped"] + after["frames_dropped"],
        "interactions": actions,
        **_spread("handled", _slowest(told, 1, actions)),
        **_spread("painted", _slowest(told, 2, actions)),
    }


def _slowest(told: list[list[float]], column: int, actions: int) -> list[float]:
    """Of each click's and key's events the slowest; those not told of took no more than 16 ms."""
    slowest: dict[float, float] = {}
    for event in told:
        slowest[event[0]] = max(slowest.get(event[0], 0.0), event[column])
    return sorted([*slowest.values(), *[_LEAST_MS] * (actions - len(slowest))])


def _spread(what: str, ordered: list[float]) -> dict[str, float]:
    """Median, 95th percentile and worst."""
    p95 = ordered[math.ceil(0.95 * len(ordered)) - 1]
    return {
        f"{what}_p50_ms": statistics.median(ordered),
        f"{what}_p95_ms": p95,
        f"{what}_worst_ms": ordered[-1],
    }


if __name__ == "__main__":
    typer.run(main)
