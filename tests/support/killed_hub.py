"""kill -9 of a command post's hub in the middle of writing: ``python -m support.killed_hub --kills 50``.

A real ``sa-hub`` with archive and page is fed over its bus; somebody alerts over the page, a soldier alerts over
the radio, and a recorder writes the bus. Hub and recorder are killed at a random moment. Then the archive and the
recording are opened: every alert that the page had answered or the radio acknowledged is there, at least as many
statuses as health had told of, every line of the audit but a cut one, and all of the recording that could be read
before.
"""

import json
import logging
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from http.client import HTTPException
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import structlog
import typer

from bootprint.bus import Envelope
from bootprint.commands.options import Json, write_json
from bootprint.errors import RecordingError
from bootprint.messages import Alert, Health, Status
from bootprint.recording import Recording
from bootprint.zenoh_bus import ZenohBus, open_bus
from proving_ground.exercises.processes.stage import free_ports
from sa_hub.history.archive import Archive
from sa_hub.history.settings import DEFAULT_SUBJECTS
from support.databases import new_database, postgres
from support.hub_processes import CP, command, write_computer, write_realm
from support.radio_soldier import RadioSoldier
from support.routers import running_router
from support.waiting import wait_until

END: Final = 2**62
_RADIO_STEP_S: Final = 0.05
_RADIO_STEPS: Final = 8
"""The soldier alerts every so many steps."""
_FEED_S: Final = 0.002
_PATIENCE_S: Final = 240.0
_RECORD: Final = "from bootprint.cli import main; main()"
Database = Literal["sqlite", "postgresql"]


@dataclass
class Trial:
    """A command post that is killed again and again, and what it has acknowledged so far."""

    folder: Path
    url: str
    dice: random.Random
    port: int = field(default_factory=lambda: free_ports(1, socket.SOCK_STREAM)[0])
    alerts: list[str] = field(default_factory=list)
    statuses: int = 0
    kills: int = 0
    recorded: int = 0

    def __post_init__(self) -> None:
        write_realm(self.folder)
        self.soldier = RadioSoldier(self.folder)
        hub = (
            f'role = "command_post"\n[hub.history]\nurl = "{self.url}"\n'
            f"[hub.page]\nport = {self.port}\nchanges_per_s = 1000.0"
        )
        self.config = write_computer(self.folder, "cp", hub, self.soldier.way)

    @property
    def log(self) -> Path:
        """What hub and recorder say of themselves."""
        return self.folder / "log"

    def kill_once(self) -> None:
        """Start hub and recorder, feed them, kill both in the middle of it; then look at what is left."""
        stored = self._stored()
        recording = self.folder / f"recording-{self.kills}.mcap"
        socket_file = f"unixsock-stream/{self.config.parent / 'router'}"
        with (
            running_router(socket_file) as router,
            self._running(router, recording) as processes,
            closing(open_bus(router)) as bus,
            self._feeding(bus),
        ):
            told = self._wait(bus, recording)
            readable = _readable(recording)
            for each in processes:
                each.send_signal(signal.SIGKILL)
                each.wait()
        self.kills += 1
        self._check(stored, told, recording, readable)

    @contextmanager
    def _running(
        self, router: str, recording: Path
    ) -> Iterator[tuple["subprocess.Popen[bytes]", "subprocess.Popen[bytes]"]]:
        record = [sys.executable, "-c", _RECORD, "record", str(recording), "--router", router]
        with self.log.open("wb") as log:
            hub, recorder = (
                subprocess.Popen(each, stdout=log, stderr=log)
                for each in (command(self.config, "--router", router), record)
            )
        try:
            yield hub, recorder
        finally:
            for each in (hub, recorder):
                each.kill()
                each.wait()

    @contextmanager
    def _feeding(self, bus: ZenohBus) -> Iterator[None]:
        """Somebody tells and alerts all the while, whether or not there is still a hub."""
        stop = threading.Event()
        feeds = (self._feed, self._alert, self._radio)
        threads = [threading.Thread(target=each, args=(bus, stop)) for each in feeds]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            stop.set()
            for thread in threads:
                thread.join()

    def _wait(self, bus: ZenohBus, recording: Path) -> int:
        """Until a random moment after all have written; how many messages health has told to be stored."""
        health = bus.open_inlet(CP.selector("health", "sa-hub"))
        before, by_radio, told = len(self.alerts), len(self.soldier.acknowledged), 0

        def have_written() -> bool:
            nonlocal told
            for envelope in health.take():
                assert isinstance(envelope.message, Health)
                told = envelope.message.counters.get("history_taken", 0)
            have_alerted = len(self.alerts) > before and len(self.soldier.acknowledged) > by_radio
            return told > 0 and have_alerted and _readable(recording) > 0

        try:
            wait_until(have_written, _PATIENCE_S, "something on the disks")
        except AssertionError as error:
            error.add_note(f"kill {self.kills}, told {told}, alerts {len(self.alerts) - before}")
            error.add_note(self.log.read_text()[-2000:])
            raise
        threading.Event().wait(self.dice.uniform(0.0, 1.0))  # the moment of death is to be any
        have_written()
        return told

    def _feed(self, bus: ZenohBus, stop: threading.Event) -> None:
        """Statuses of the post's own people, some hundreds a second."""
        while not stop.wait(_FEED_S):
            status = Status(time_ns=time.time_ns(), soldier="cp", condition="ok")
            bus.publish(Envelope(CP.address("status", "person"), status))

    def _alert(self, _bus: ZenohBus, stop: threading.Event) -> None:
        """Alerts over the page, one after the other; known is what was answered."""
        while not stop.is_set():
            text = f"{self.kills}-{len(self.alerts)}"
            try:
                self._post("alerts", {"kind": "help", "text": text})
            except (OSError, HTTPException):  # there is no hub, yet or any more
                stop.wait(_FEED_S)
                continue
            self.alerts.append(text)

    def _radio(self, _bus: ZenohBus, stop: threading.Event) -> None:
        """A soldier alerts over the radio; known is what was acknowledged."""
        step = 0
        while not stop.wait(_RADIO_STEP_S):
            now_ns = time.time_ns()
            if step % _RADIO_STEPS == 0:
                self.soldier.alert(f"radio-{self.kills}-{step}", now_ns)
            self.soldier.step(now_ns)
            step += 1

    def _post(self, path: str, body: Any) -> None:
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}/api/v1/{path}",
            json.dumps(body).encode(),
            {"content-type": "application/json"},
        )
        with urllib.request.urlopen(request, timeout=10.0) as answer:
            answer.read()

    def close(self) -> None:
        """The soldier goes off the air."""
        self.soldier.close()

    def _stored(self) -> int:
        """Messages in the archive, without those that the soldier, who has no answer yet, will send once more."""
        with closing(Archive(self.url)) as archive:
            alerts = [each.message for each in archive.messages("alert", 0, END)]
            unanswered = {each.text for each in alerts if isinstance(each, Alert) and each.soldier == "a1"}
            return _count(archive) - len(unanswered - set(self.soldier.acknowledged))

    def _check(self, stored: int, told: int, recording: Path, readable: int) -> None:
        with closing(Archive(self.url, create=False)) as archive:
            texts = [getattr(each.message, "text", "") for each in archive.messages("alert", 0, END)]
            lost = {*self.alerts, *self.soldier.acknowledged} - set(texts)
            assert not lost, f"acknowledged and lost: {sorted(lost)}"
            assert len(texts) == len(set(texts)), "an alert is there twice"
            assert _count(archive) >= stored + told, "fewer than health had told"
            assert archive.unreadable == 0
            self.statuses = archive.count("status", 0, END)
        with (self.config.parent / "state/page/audit.jsonl").open("rb") as audit:
            whole = sum(1 for line in audit if line.endswith(b"\n") and json.loads(line))
        assert whole >= len(self.alerts)
        left = _readable(recording)
        assert left >= readable > 0
        self.recorded += left


def _count(archive: Archive) -> int:
    return sum(archive.count(subject, 0, END) for subject in DEFAULT_SUBJECTS)


def _readable(recording: Path) -> int:
    """How many messages a recording that may be growing, or cut off, gives; 0 before it has a beginning."""
    try:
        return Recording(recording).report.messages
    except RecordingError:
        return 0


@contextmanager
def archive_url(database: Database, folder: Path) -> Iterator[str]:
    """A fresh archive's address."""
    if database == "sqlite":
        yield f"sqlite:///{folder}/history.db"
        return
    with postgres() as server:
        yield new_database(server, "killed")


def main(
    kills: Annotated[int, typer.Option(min=1, help="Of each database's hub.")] = 50,
    seed: Annotated[int, typer.Option(help="Of the moments of death.")] = 1,
    json_out: Json = None,
) -> None:
    """Kill hubs on SQLite and on PostgreSQL; an AssertionError says what was lost."""
    # Recordings that are cut off are what this is about: not worth a warning each.
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
    rows = []
    databases: tuple[Database, ...] = ("sqlite", "postgresql")
    for database in databases:
        with tempfile.TemporaryDirectory() as folder, archive_url(database, Path(folder)) as url:
            with closing(Trial(Path(folder), url, random.Random(seed))) as trial:
                for _ in range(kills):
                    trial.kill_once()
            rows.append(
                {
                    "database": database,
                    "kills": trial.kills,
                    "alerts_acknowledged": len(trial.alerts),
                    "alerts_acknowledged_by_radio": len(trial.soldier.acknowledged),
                    "statuses_stored": trial.statuses,
                    "messages_recorded": trial.recorded,
                }
            )
    write_json(rows, json_out or "-")


if __name__ == "__main__":
    typer.run(main)
