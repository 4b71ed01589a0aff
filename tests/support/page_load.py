"""How the page bears many soldiers: ``python -m support.page_load [--soldiers 500] [--seconds 30] [--json FILE]``.

A process serves the real page for soldiers whose tracks all come twice a second; a real browser
looks on, and somebody clicks and presses keys in it. How long after each the page has handled it, and has painted
what came of it, the browser itself says (Event Timing, 16 ms and more). Painting is done in software here.
"""

import json
import math
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.commands.options import Json, write_json
from bootprint.config import Member, Origin, Realm
from bootprint.display import AGES
from bootprint.geodesy import LocalFrame
from bootprint.messages import Track
from bootprint.topics import Identity
from sa_hub.page.app import build_app
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk
from sa_hub.page.operations import Post
from sa_hub.page.server import PageServer
from sa_hub.page.settings import PageSettings
from support.browser import running_chromium, tab

ORIGIN: Final = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
PERIOD_S: Final = 0.5
_SPREAD_M: Final = 700.0
_OBSERVE: Final = """() => { window.paints = [];
    new PerformanceObserver(list => window.paints.push(
        ...list.getEntries().map(each => [each.processingEnd - each.startTime, each.duration])))
        .observe({type: "event", durationThreshold: 16, buffered: false}); }"""


def main(
    soldiers: Annotated[int, typer.Option(min=1, max=1000, help="In the picture.")] = 500,
    seconds: Annotated[float, typer.Option(min=5.0, help="How long the browser is worked with.")] = 30.0,
    json_out: Json = None,
) -> None:
    """Measure the page under load."""
    command = [sys.executable, "-m", "support.page_load", "serve", str(soldiers)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as hub:
        assert hub.stdin is not None
        assert hub.stdout is not None
        row = {"soldiers": soldiers, **_work(hub.stdout.readline().strip(), soldiers, seconds)}
        hub.stdin.close()
        row |= json.loads(hub.stdout.readline())
    write_json(row, json_out or "-")


def _work(address: str, soldiers: int, seconds: float) -> dict[str, Any]:
    """Click on people, switch floors, measure, for so long; what the browser says of it."""
    dice = random.Random(1)
    with running_chromium() as chromium, tab(chromium, address, 1280, 800) as looking:
        looking.wait(f"squad.state.tracks.size === {soldiers} && squad.map.ready && squad.fitted", 60.0)
        looking.page.evaluate(_OBSERVE)
        rows, actions, until = looking.page.locator(".row[data-soldier]"), 0, time.monotonic() + seconds
        while time.monotonic() < until:
            rows.nth(dice.randrange(20)).click()
            looking.page.keyboard.press(dice.choice("0123t"))
            actions += 2
            looking.page.wait_for_timeout(200.0)
        found = looking.page.evaluate("window.paints")
        assert looking.faults == []
    return {
        "actions": actions,
        "events_over_16_ms": len(found),
        **_spread("handled", [handled for handled, _ in found]),
        **_spread("painted", [painted for _, painted in found]),
    }


def _spread(what: str, values_ms: list[float]) -> dict[str, float | None]:
    """Median, 95th percentile and worst; None if every event took less than what is told of."""
    if not values_ms:
        return {f"{what}_{name}_ms": None for name in ("p50", "p95", "worst")}
    ordered = sorted(values_ms)
    p95 = ordered[math.ceil(0.95 * len(ordered)) - 1]
    return {
        f"{what}_p50_ms": statistics.median(ordered),
        f"{what}_p95_ms": p95,
        f"{what}_worst_ms": ordered[-1],
    }


def serve(soldiers: int) -> None:
    """Serve until standard input ends; then say what it cost."""
    with tempfile.TemporaryDirectory() as folder:
        realm = _realm(soldiers)
        desk = Desk(_post(realm), Audit(Path(folder) / "audit.jsonl"))
        settings = PageSettings(port=0, reads_per_s=1000.0)
        server = PageServer(build_app(desk, settings), settings, Path(folder), "page")
        server.start()
        print(server.address, flush=True)  # noqa: T201 - to the process that started this one
        print(json.dumps(_walk(realm, desk)), flush=True)  # noqa: T201
        server.close()


def _walk(realm: Realm, desk: Desk) -> dict[str, float]:
    """Tell of everybody twice a second until standard input ends."""
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    frame, dice = LocalFrame(ORIGIN), random.Random(2)
    places = {m.id: [dice.uniform(-_SPREAD_M, _SPREAD_M) for _ in range(2)] for m in realm.roster[1:]}
    headings = {m.id: dice.uniform(0.0, 2.0 * math.pi) for m in realm.roster[1:]}
    began, began_cpu, feeding_s = time.monotonic(), time.process_time(), 0.0
    while not ended.wait(PERIOD_S):
        fed = time.thread_time()
        desk.tell([_track(frame, member, places[member.id], headings) for member in realm.roster[1:]])
        feeding_s += time.thread_time() - fed
    lasted_s = time.monotonic() - began
    spent_s = time.process_time() - began_cpu - feeding_s
    return {"page_cpu_share": spent_s / lasted_s, "dropped": float(desk.dropped)}


def _track(frame: LocalFrame, member: Member, place: list[float], headings: dict[str, float]) -> Envelope:
    heading = headings[member.id] = headings[member.id] + 0.05
    velocity = 1.3 * math.sin(heading), 1.3 * math.cos(heading)
    place[0] += PERIOD_S * velocity[0]
    place[1] += PERIOD_S * velocity[1]
    latitude_deg, longitude_deg, height_m = frame.to_geodetic(place[0], place[1], 0.0)
    now_ns = time.time_ns()
    track = Track(
        time_ns=now_ns,
        soldier=member.id,
        number=member.number,
        state="fresh",
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=height_m,
        accuracy_m=1.5,
        east_velocity_m_s=velocity[0],
        north_velocity_m_s=velocity[1],
        floor=member.number % 3,
        received_ns=now_ns,
        via="hq",
    )
    return Envelope(Identity("bp", "hq", "cp").address("track", member.id), track)


def _realm(soldiers: int) -> Realm:
    post = Member(id="cp", number=0, unit="hq", callsign="Zero", role="command_post")
    squads = tuple(
        Member(id=f"s{n}", number=n, unit=f"squad-{(n - 1) // 12 + 1:02d}", callsign=f"S{n}")
        for n in range(1, soldiers + 1)
    )
    return Realm(id="bp", origin=ORIGIN, roster=(post, *squads))


def _post(realm: Realm) -> Post:
    return Post(
        realm=realm,
        member=realm.roster[0],
        ages=AGES,
        speed=1.0,
        now_ns=lambda: round(time.time() * NS_PER_S),
        publish=lambda _envelope: None,
        place=lambda _fix, _member: None,
        on_bus=lambda _member: False,
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["serve"]:
        serve(int(sys.argv[2]))
    else:
        typer.run(main)
