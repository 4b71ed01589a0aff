"""Makes the documents' pictures of the command post's page: ``python -m support.page_pictures docs/img``.

A squad clears a building, one soldier has been silent from early on; people at the post have alerted and observed.
"""

import io
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser

from proving_ground.exercises.event_time.shown_play import Pace, ShownPlay, walked_exercise
from sa_hub.history.archive import Archive
from support.browser import CAN_RUN, WHY_NOT, Tab, running_chromium, tab
from support.waiting import wait_until

SILENT = {"a3": 38.0}
AGES = {"stale_s": 45.0, "lost_s": 90.0}
LOOK_S = 150.0
_SETTLE_MS = 1500


def main(folder: Path) -> None:
    """All pictures into a folder; without a browser there is nothing to do, and that is said."""
    if not CAN_RUN:
        sys.stderr.write(f"no pictures of the page: {WHY_NOT}\n")
        return
    exercise, lines = walked_exercise("building-clearing", 1, SILENT, AGES)
    with tempfile.TemporaryDirectory() as scratch:
        archive = Archive(f"sqlite:///{scratch}/history.db")
        play = ShownPlay(exercise, lines, Path(scratch), Pace(0.25, LOOK_S), archive=archive)
        with running_chromium() as chromium, play:
            wait_until(lambda: play.elapsed_s >= LOOK_S, timeout_s=120.0, what="the squad's way until then")
            _take(chromium, play, folder / "command-post.webp", (1440, 860), _command_post)
            _take(chromium, play, folder / "command-post-day.webp", (1180, 820), _by_day)
        archive.close()


def _take(
    chromium: Browser, play: ShownPlay, path: Path, size: tuple[int, int], prepare: Callable[[Tab], None]
) -> None:
    with tab(chromium, play.address, *size) as looking:
        looking.wait("squad.map.ready && squad.fitted")
        prepare(looking)
        looking.page.wait_for_timeout(_SETTLE_MS)
        picture = Image.open(io.BytesIO(looking.page.screenshot()))
        picture.save(path, quality=80, method=6)


def _command_post(looking: Tab) -> None:
    """By night, with a fresh alert, things seen, and the radio's budget."""
    page = looking.page
    for x, y, code, text in ((110, 600, "sniper", "2nd floor window"), (660, 600, "rally_point", "")):
        page.keyboard.press("o")
        page.locator("#map").click(position={"x": x, "y": y})
        page.select_option('dialog [name="code"]', code)
        page.fill('dialog [name="text"]', text)
        page.fill('dialog [name="accuracy_m"]', "1.5")
        page.click("dialog .primary")
        page.wait_for_timeout(400)
    page.keyboard.press("l")
    page.select_option('dialog [name="kind"]', "contact")
    page.fill('dialog [name="text"]', "shots from the stairwell, hold")
    page.click("dialog .primary")
    page.click('.row[data-soldier="a3"]')
    page.keyboard.press("f")
    page.mouse.move(700, 420)


def _by_day(looking: Tab) -> None:
    """By day on a tablet: one soldier's card, and who of the others is on that floor."""
    page = looking.page
    page.keyboard.press("a")
    page.keyboard.press("n")
    soldier = looking.wait("squad.state.seen().find(each => each.track.floor === 1)?.track.soldier")
    page.click('#floors [data-floor="1"]')
    page.click(f'.row[data-soldier="{soldier}"]')
    page.wait_for_timeout(600)
    page.keyboard.press("f")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
