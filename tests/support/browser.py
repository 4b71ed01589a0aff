"""A real browser for tests of the page: Debian's Chromium, drawing WebGL in software, kept off the network."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import Browser, Page, Request, sync_playwright

from sa_hub.page.app import STATIC

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
IS_BUILT = (STATIC / "index.html").is_file()
WHY_NOT = (
    "no Chromium (apt-get install chromium)" if CHROMIUM is None else "the page is not built (make page)"
)
CAN_RUN = CHROMIUM is not None and IS_BUILT
# WebGL by software, and all else as a browser without graphics hardware does it: imitated hardware is slow.
_ARGUMENTS = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
    "--disable-accelerated-2d-canvas",
    "--no-sandbox",
    "--mute-audio",
]
_LOOK_MS = 50
_PATIENCE_MS = 90_000
_ALONE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"


@dataclass
class Tab:
    """A tab with a page in it; ``faults`` are errors of its scripts and requests to anybody else."""

    page: Page
    faults: list[str] = field(default_factory=list)

    def says(self, script: str) -> Any:
        """The value of an expression in the page, where ``squad`` is the map's handle."""
        return self.page.evaluate(f"(() => {{ const squad = window.bootprint; return ({script}); }})()")

    def wait(self, script: str, timeout_s: float = _PATIENCE_MS / 1000) -> Any:
        """Until an expression in the page is true, then its value.

        Looked at from here: the page's own rules forbid it to evaluate strings.
        """
        deadline = time.monotonic() + timeout_s
        while not (value := self.says(f"squad && ({script})")):
            assert time.monotonic() < deadline, f"not within {timeout_s} s: {script}"
            self.page.wait_for_timeout(_LOOK_MS)
        return value


@contextmanager
def running_chromium() -> Iterator[Browser]:
    """The browser; one for all tests of a module."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=[*_ARGUMENTS, _ALONE])
        yield chromium
        chromium.close()


@contextmanager
def tab(chromium: Browser, address: str, width: int = 1000, height: int = 640) -> Iterator[Tab]:
    """A tab at an address, without anybody's cookies; nothing but this computer can be reached."""
    page = chromium.new_page(viewport={"width": width, "height": height})
    found = Tab(page)
    home = urlsplit(address).netloc

    def note_foreign(request: Request) -> None:
        if urlsplit(request.url).netloc not in (home, ""):
            found.faults.append(f"asks {request.url}")

    page.set_default_timeout(_PATIENCE_MS)  # of a busy machine
    page.on("request", note_foreign)
    page.on("pageerror", lambda error: found.faults.append(str(error)))
    page.goto(address)
    yield found
    page.close()
