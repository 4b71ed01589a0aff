"""`bootprint bus echo`, `bus rates` and `bus metrics`: look at the bus without knowing its types.

Messages are read with plain MessagePack, so that unknown versions and broken messages show as well.
"""

import queue
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Annotated, Any

import msgpack
import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table

from bootprint.commands.metrics import metrics
from bootprint.commands.options import BusWay, Config, Duration, Json, Router, bus_way, write_json
from bootprint.commands.rates import KeyRate, RateMeter
from bootprint.stopping import Stop
from bootprint.topics import VERSION

_POLL_S = 0.1
_REFRESH_S = 0.5
_SHOWN_ITEMS = 6
_EVERYTHING = f"*/{VERSION}/**"

Selector = Annotated[
    str, typer.Argument(help="Keys to listen to, e.g. 'bp/@v1/*/*/position/*'.", metavar="[SELECTOR]")
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    bus = typer.Typer(no_args_is_help=True, help="Look at the bus: messages and rates.")
    bus.command()(echo)
    bus.command()(rates)
    bus.command()(metrics)
    app.add_typer(bus, name="bus")


def echo(
    selector: Selector = _EVERYTHING,
    config: Config = None,
    router: Router = None,
    count: Annotated[int | None, typer.Option(help="Stop after this many messages.", min=1)] = None,
    duration: Duration = None,
) -> None:
    """Print every message as one line, arrays summarised, until Ctrl-C.

    Example: bootprint bus echo 'bp/@v1/*/a3/foot_step/*' --count 5
    """
    console = Console(soft_wrap=True, markup=False)
    left = count
    with Stop(duration) as stop, _listening(bus_way(config, router), selector, stop) as received:
        for key, payload in received():
            console.print(line(key, payload))
            left = None if left is None else left - 1
            if left == 0:
                return


@contextmanager
def _listening(way: BusWay, selector: str, stop: Stop) -> Iterator[Callable[[], Iterator[tuple[str, bytes]]]]:
    """A source of (key, payload) that ends with ``stop``."""
    inbox: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def received() -> Iterator[tuple[str, bytes]]:
        while not stop.is_set():
            try:
                yield inbox.get(timeout=_POLL_S)
            except queue.Empty:
                continue

    bus = way.open(should_stop=stop.is_set)
    try:
        stop.restart()
        bus.subscribe_raw(selector, lambda key, payload: inbox.put((key, payload)))
        yield received
    finally:
        bus.close()


def line(key: str, payload: bytes) -> str:
    """A message as one line: time, key, fields; arrays as their size."""
    text = f"{key} {_fields(payload)}"
    # Nothing from the bus may steer the terminal.
    return text if text.isprintable() else text.encode("unicode_escape").decode()


def _fields(payload: bytes) -> str:
    try:
        fields = msgpack.unpackb(payload)
    except ValueError as error:  # msgpack's own errors derive from it
        return f"not MessagePack, {len(payload)} B: {error}"
    if not isinstance(fields, dict):
        return _short(fields)
    clock = _clock(fields.pop("time_ns", None))
    return " ".join([clock, *(f"{name}={_short(value)}" for name, value in fields.items())])


def _clock(time_ns: object) -> str:
    """UTC time of day to the millisecond."""
    try:
        seconds, rest = divmod(int(time_ns), 1_000_000_000)  # type: ignore[call-overload]
        return f"{datetime.fromtimestamp(seconds, UTC):%H:%M:%S}.{rest // 1_000_000:03d}"
    except (TypeError, ValueError, OverflowError, OSError):
        return "--:--:--.---"


def _short(value: Any) -> str:
    match value:
        case bytes():
            return f"<{len(value)} B>"
        case float():
            return f"{value:.10g}"
        case list() if len(value) > _SHOWN_ITEMS:
            return f"[{len(value)} items]"
        case list():
            return f"({', '.join(map(_short, value))})"
        case dict():
            return "{" + ", ".join(f"{name}: {_short(item)}" for name, item in value.items()) + "}"
        case _:
            return str(value)


def rates(
    selector: Selector = _EVERYTHING,
    config: Config = None,
    router: Router = None,
    duration: Duration = None,
    json: Json = None,
) -> None:
    """Show how often each key speaks, in event time, against what the table of topics expects.

    Live until Ctrl-C; with --json the rows are written at the end.

    Example: bootprint bus rates --duration 10 --json -
    """
    meter = RateMeter()
    with Stop(duration) as stop, _listening(bus_way(config, router), selector, stop) as received:
        if json:
            for key, payload in received():
                meter.observe(key, payload)
        else:
            _live(meter, received())
    if json:
        write_json(meter.rows(), json)


def _live(meter: RateMeter, received: Iterator[tuple[str, bytes]]) -> None:
    with Live(_table(meter.rows()), auto_refresh=False) as live:
        shown = time.monotonic()
        for key, payload in received:
            meter.observe(key, payload)
            if time.monotonic() - shown >= _REFRESH_S:
                live.update(_table(meter.rows()), refresh=True)
                shown = time.monotonic()
        live.update(_table(meter.rows()), refresh=True)


def _table(rows: list[KeyRate]) -> Table:
    table = Table("key")
    table.columns[0].overflow = "fold"
    for heading in ("messages", "rate Hz", "expected Hz", "bytes/s", "state"):
        table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(
            row.key,
            str(row.messages),
            "" if row.rate_hz is None else f"{row.rate_hz:.2f}",
            "" if row.expected_hz is None else f"{row.expected_hz:g}",
            "" if row.bytes_per_s is None else f"{row.bytes_per_s:.0f}",
            row.state,
        )
    return table
