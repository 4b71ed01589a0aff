"""The scaffold of every service: arguments, logging, signals, router, liveliness, health, and a clean end.

A service is a `Part` (its core plus whatever it opens) in a loop of one thread: messages are fetched from the bus
many times a second, and soon after one of those that ring; posted jobs come through an inbox at once, `tick` comes
with host time, outputs go to the bus. So a core is never called from two threads, and a quiet process sleeps.
"""

import gc
import resource
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Protocol

import structlog
import typer

from bootprint import logs, pulse
from bootprint.bus import Core, Envelope
from bootprint.clock import EventClock, make_clock
from bootprint.config import Computer, load_computer
from bootprint.errors import BootprintError
from bootprint.figures import Figures
from bootprint.inbox import Inbox, Job
from bootprint.messages import Health
from bootprint.stopping import Stop
from bootprint.topics import Identity
from bootprint.zenoh_bus import Inlet, ZenohBus, open_bus

DEFAULT_BEAT_S = 0.05
_LEAST_BEAT_S = 0.002
# Of a beat, and at most: what comes so soon after a message that rings is looked at with it.
_GATHERED, _LONGEST_GATHER_S = 0.05, 0.01
_TICK_S = 0.1
_HEALTH_S = 1.0
EXIT_BAD_INPUT = 2


class Part(Protocol):
    """A service's inside, as the scaffold drives it; all but `start` run in the main thread."""

    def start(self) -> None:
        """The bus is open: open sources, start threads."""

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take one message in."""

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Event time is ``now_ns``."""

    def figures(self) -> Figures:
        """State and counts for the health message."""

    def close(self) -> Iterable[Envelope]:
        """The end: free everything; the last outputs."""


class CoreWithFigures(Core, Protocol):
    """A pure core that also counts."""

    def figures(self) -> Figures:
        """State and counts for the health message."""


class CorePart:
    """A `Part` that is nothing but a pure core."""

    def __init__(self, core: CoreWithFigures) -> None:
        self._core = core

    def start(self) -> None:
        """Nothing to open."""

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Pass the message to the core."""
        return self._core.handle(envelope)

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Pass event time to the core."""
        return self._core.tick(now_ns)

    def figures(self) -> Figures:
        """The core's own figures."""
        return self._core.figures()

    def close(self) -> Iterable[Envelope]:
        """A core that has last words says them through an optional ``close``."""
        last_words: Job | None = getattr(self._core, "close", None)
        return last_words() if last_words else ()


@dataclass(frozen=True)
class Options:
    """What the command line said."""

    config: Path
    router: str | None = None
    router_wait_s: float = 10.0
    speed: str = "1"
    clock_origin_s: float | None = None
    clock_offset_s: float = 0.0
    wait_for: tuple[str, ...] = ()
    stop_on_eof: bool = False
    beat_s: float = DEFAULT_BEAT_S
    log_level: str = "info"
    log_json: bool = False


class Context:
    """What a part may use of the world outside it.

    ``beat_s``: host seconds between two looks at bus and clock; a part that waits for neither may lengthen it.
    """

    def __init__(self, service: str, computer: Computer, options: Options) -> None:
        self.service = service
        self.computer = computer
        self.options = options
        self.identity: Identity = computer.identity
        self.clock: EventClock = make_clock(options.speed, options.clock_origin_s, options.clock_offset_s)
        self.log: structlog.stdlib.BoundLogger = structlog.get_logger().bind(
            service=service, soldier=self.identity.soldier
        )
        self.lossless = options.speed == "max"
        self.beat_s = _beat_s(options)
        self.inbox = Inbox(min(_GATHERED * self.beat_s, _LONGEST_GATHER_S))
        self.stopping = Stop()
        self.exit_code = 0
        self._bus: ZenohBus | None = None

    @property
    def bus(self) -> ZenohBus:
        """The open bus."""
        if self._bus is None:
            raise RuntimeError("the bus is not open yet")
        return self._bus

    def connect(self) -> ZenohBus:
        """Open the bus; BusError if no router answers in time."""
        self._bus = open_bus(
            self.options.router or self.computer.router,
            credentials=self.computer.credentials,
            timeout_s=self.options.router_wait_s,
            lossless=self.lossless,
            should_stop=self.stopping.is_set,
        )
        return self._bus

    def publish(self, envelope: Envelope) -> None:
        """Send one message; from any thread."""
        self.bus.publish(envelope)

    def post(self, job: Job) -> None:
        """Run ``job`` in the main loop and publish what it returns; from any thread."""
        self.inbox.post(job, patient=self.lossless)

    def wait_alive(self, services: Sequence[str], timeout_s: float = 30.0) -> bool:
        """Wait until these services of this soldier hold their liveliness tokens; False if not in time."""
        wanted = {self.identity.selector("health", service) for service in services}
        deadline = time.monotonic() + timeout_s
        while wanted - self.bus.alive(self.identity.selector("health")):
            if time.monotonic() > deadline or self.wait_stop(0.1):
                return False
        return True

    def wait_stop(self, timeout_s: float) -> bool:
        """Sleep, interruptibly; True when the service is stopping."""
        return self.stopping.wait(timeout_s)

    def finish(self, exit_code: int = 0) -> None:
        """Ask the main loop to end."""
        self.exit_code = exit_code
        self.stopping.finish()


@dataclass(frozen=True)
class Service:
    """A service: its name (also its command and its liveliness token), its inputs and how its part is built.

    ``beat_s``: between two looks at the bus, unless the command line says otherwise. ``ringing``: those of its
    inputs that are looked at soon after they come, for who waits for them (a thread each), unless it says more.
    """

    name: str
    summary: str
    subjects: tuple[str, ...]
    build: Callable[[Context], Part]
    beat_s: float = DEFAULT_BEAT_S
    ringing: tuple[str, ...] = ()

    def main(self) -> None:
        """The console script: parse arguments, run, exit (2 with one line on bad input)."""
        self._app()()

    def preload(self) -> None:
        """Read an empty command line: what reads them brings libraries of its own only then (`fork_server`)."""
        typer.main.get_command(self._app()).make_context(self.name, [])

    def _app(self) -> typer.Typer:
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        app.command(help=self.summary)(self._command)
        return app

    def _command(
        self,
        config: Annotated[Path, typer.Option(help="This computer's configuration.")] = Path("computer.toml"),
        router: Annotated[str | None, typer.Option(help="Router to use, e.g. tcp/127.0.0.1:7447.")] = None,
        router_wait: Annotated[float, typer.Option(help="Seconds to wait for the router.")] = 10.0,
        speed: Annotated[str, typer.Option(help="Event time runs this many times as fast, or 'max'.")] = "1",
        clock_origin: Annotated[
            float | None,
            typer.Option(help="UTC seconds at which event time equals host time (with --speed)."),
        ] = None,
        clock_offset: Annotated[
            float, typer.Option(help="Seconds to add to this computer's clock, which may be wrong.")
        ] = 0.0,
        wait_for: Annotated[str, typer.Option(help="Services to wait for before replaying: a,b,c.")] = "",
        stop_on_eof: Annotated[bool, typer.Option(help="Stop when standard input closes.")] = False,
        beat: Annotated[
            float | None,
            typer.Option(
                min=0.002, max=1.0, help="Seconds between two looks at the bus; more saves processor."
            ),
        ] = None,
        log_level: Annotated[str, typer.Option(help="debug, info, warning or error.")] = "info",
        log_json: Annotated[bool, typer.Option(help="Log one JSON object a line.")] = False,
    ) -> None:
        options = Options(
            config=config,
            router=router,
            router_wait_s=router_wait,
            speed=speed,
            clock_origin_s=clock_origin,
            clock_offset_s=clock_offset,
            wait_for=tuple(name for name in wait_for.split(",") if name),
            stop_on_eof=stop_on_eof,
            beat_s=self.beat_s if beat is None else beat,
            log_level=log_level,
            log_json=log_json,
        )
        try:
            logs.configure(log_level, json=log_json)
            code = run(self, Context(self.name, load_computer(config), options))
        except BootprintError as error:
            sys.stderr.write(f"{self.name}: {error}\n")
            code = EXIT_BAD_INPUT
        raise typer.Exit(code)


def run(service: Service, context: Context) -> int:
    """Run a service until a signal, end of input or its own wish; returns the exit code."""
    with context.stopping as stopping:
        if context.options.stop_on_eof:
            stopping.watch_input()
        return _run(service, context)


def _run(service: Service, context: Context) -> int:
    part = service.build(context)
    bus = context.connect()
    try:
        inlets = [_inlet(service, context, subject) for subject in service.subjects]
        part.start()
        bus.declare_alive(context.identity, service.name)
        gc.collect()
        gc.freeze()  # what has been imported stays: no collection need look at it again
        context.log.info("running", router=context.options.router or context.computer.router)
        _Loop(service, part, context, inlets).run()
        context.log.info("stopped", exit_code=context.exit_code)
    finally:
        context.stopping.finish()
        bus.close()
    return context.exit_code


def _inlet(service: Service, context: Context, subject: str) -> Inlet:
    """A subject's messages.

    Nothing rings for who was told to look less often, to save processor, nor at full speed, where the loop looks
    all the time and messages have to push back.
    """
    rings = subject in service.ringing and not context.lossless and context.options.beat_s <= service.beat_s
    return context.bus.open_inlet(context.identity.selector(subject), context.inbox.ring if rings else None)


def _resident_mb() -> float:
    """Resident memory of this process (Linux; a child's ru_maxrss would begin with its parent's)."""
    with open("/proc/self/statm", "rb", buffering=0) as file:  # noqa: PTH123 - a Path costs more than the reading
        return int(file.read(64).split()[1]) * resource.getpagesize() / 1e6


def _beat_s(options: Options) -> float:
    """Host seconds between two looks at the bus: what a message may wait is a matter of event time."""
    if options.speed == "max":
        return _LEAST_BEAT_S
    return max(_LEAST_BEAT_S, options.beat_s / float(options.speed))


class _Loop:
    """The main loop: jobs, messages, tick, health."""

    def __init__(self, service: Service, part: Part, context: Context, inlets: Sequence[Inlet]) -> None:
        self._service = service
        self._part = part
        self._context = context
        self._inlets = inlets
        self._errors = 0
        self._health_sequence = 0
        self._connected = True
        self._router_losses = 0

    def run(self) -> None:
        context, part = self._context, self._part
        next_fetch = next_tick = next_health = time.monotonic()
        while not context.stopping.is_set():
            self._work(next_fetch)
            found = self._fetch()
            now = time.monotonic()
            next_fetch = now if found and context.lossless else now + context.beat_s
            if now >= next_tick:
                next_tick = now + (_TICK_S if context.lossless else context.beat_s)
                self._guarded(lambda: part.tick(context.clock.now_ns()))
            if now >= next_health:
                next_health = now + _HEALTH_S
                self._guarded(self._health)
        self._work(time.monotonic())
        self._fetch()
        self._guarded(part.close)
        self._guarded(lambda: self._health(stopped=True))

    def _work(self, until: float) -> None:
        """Do posted jobs as they come, until a host time or the bell."""
        for job in self._context.inbox.jobs(until):
            self._guarded(job)

    def _fetch(self) -> bool:
        """Hand over what waits on the bus; whether there was anything."""
        found = False
        self._context.inbox.answer()
        for inlet in self._inlets:
            for envelope in inlet.take():
                found = True
                self._context.clock.observe(envelope.message.time_ns)
                self._guarded(partial(self._part.handle, envelope))
        return found

    def _guarded(self, job: Job) -> None:
        """Publish what the job yields; an error is logged and counted, for nothing sent may stop a process."""
        try:
            for envelope in job():
                self._context.publish(envelope)
        except Exception as error:
            self._errors += 1
            self._context.log.exception("handler failed", error=str(error), count=self._errors)

    def _watch_router(self) -> None:
        """Tell of a router that is gone or back: what was said meanwhile may be lost."""
        connected = self._context.bus.is_connected()
        if connected != self._connected:
            self._connected = connected
            self._router_losses += not connected
            self._context.log.warning("router back" if connected else "router lost")
        if connected:
            pulse.beat(self._service.name)

    def _health(self, *, stopped: bool = False) -> Iterable[Envelope]:
        context = self._context
        self._watch_router()
        figures = self._part.figures()
        usage = resource.getrusage(resource.RUSAGE_SELF)
        self._health_sequence += 1
        yield Envelope(
            context.identity.address("health", self._service.name),
            Health(
                time_ns=context.clock.now_ns(),
                sequence=self._health_sequence,
                service=self._service.name,
                state="stopped" if stopped else "degraded" if self._errors else figures.state,
                counters={
                    **figures.counters,
                    "handler_errors": self._errors,
                    "bus_rejected": context.bus.rejected,
                    "bus_overruns": context.bus.overruns,
                    "inbox_dropped": context.inbox.dropped,
                    "router_losses": self._router_losses,
                },
                gauges={
                    **figures.gauges,
                    "cpu_s": usage.ru_utime + usage.ru_stime,
                    "memory_mb": _resident_mb(),
                },
                note=figures.note,
            ),
        )
