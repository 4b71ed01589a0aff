"""`bootprint bus metrics`: what services and topics tell of themselves, for Prometheus.

One exporter a computer listens to the bus, so the services themselves have neither port, thread nor library for it.
Names: every counter of a health message is ``bootprint_<name>_total``, every gauge ``bootprint_<name>`` (units
stand in the names), labelled by soldier and service; rates are those of `bus rates`, labelled by key.
"""

import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Final

import typer
from prometheus_client import CollectorRegistry, start_http_server, write_to_textfile
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from bootprint import wire
from bootprint.commands.options import Config, Duration, Router, bus_way
from bootprint.commands.rates import RateMeter
from bootprint.errors import ConfigError, WireError
from bootprint.messages import Health, ServiceState
from bootprint.stopping import Stop
from bootprint.topics import VERSION, parse_key

_LOOPBACK: Final = "127.0.0.1"
_STATES: Final[tuple[ServiceState, ...]] = ServiceState.__args__  # type: ignore[attr-defined]
_SERVICE: Final = ("soldier", "service")
_WRITE_EVERY_S: Final = 10.0
_LOST_AFTER_S: Final = 600.0
"""Who has told nothing for so long is no longer shown."""


class BusMetrics(Collector):
    """The newest health of every service, and every key's rate; `observe` from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._health: dict[tuple[str, str], tuple[float, Health]] = {}
        self._rates = RateMeter()

    def observe(self, key: str, payload: bytes) -> None:
        """A message has been heard."""
        with self._lock:
            self._rates.observe(key, payload)
            try:
                address = parse_key(key)
                message = wire.decode(address.subject, payload) if address.subject == "health" else None
            except WireError:
                return
            if isinstance(message, Health):
                self._health[address.soldier, message.service] = time.monotonic(), message

    def collect(self) -> Iterator[Metric]:
        """All families as of now."""
        with self._lock:
            now_s = time.monotonic()
            health = {
                who: told for who, told in sorted(self._health.items()) if now_s - told[0] < _LOST_AFTER_S
            }
            rows = self._rates.rows()
        yield from _of_health(health, now_s)
        families: dict[str, CounterMetricFamily | GaugeMetricFamily] = {
            "messages": CounterMetricFamily("bootprint_messages", "Messages heard.", labels=["key"]),
            "rate_hz": GaugeMetricFamily("bootprint_rate_hz", "Of the last ten seconds.", labels=["key"]),
            "expected_hz": GaugeMetricFamily(
                "bootprint_rate_expected_hz", "By the table of topics.", labels=["key"]
            ),
        }
        off = GaugeMetricFamily(
            "bootprint_rate_off", "1 while a rate is not as expected.", labels=["key", "state"]
        )
        for row in rows:
            for name, family in families.items():
                value = getattr(row, name)
                if value is not None:
                    family.add_metric([row.key], value)
            off.add_metric([row.key, row.state], float(row.state not in ("ok", "event")))
        yield from (*families.values(), off)


def _of_health(health: dict[tuple[str, str], tuple[float, Health]], now_s: float) -> Iterator[Metric]:
    age = GaugeMetricFamily("bootprint_health_age_seconds", "Since a service last spoke.", labels=_SERVICE)
    state = GaugeMetricFamily("bootprint_state", "1 for the state it is in.", labels=(*_SERVICE, "state"))
    numbers: dict[str, Metric] = {}
    for who, (heard_s, told) in health.items():
        age.add_metric(who, now_s - heard_s)
        for each in _STATES:
            state.add_metric((*who, each), float(told.state == each))
        for name, count in told.counters.items():
            _counter(numbers, name).add_metric(who, count)
        for name, value in told.gauges.items():
            _gauge(numbers, name).add_metric(who, value)
    yield from (age, state, *numbers.values())


def _counter(families: dict[str, Metric], name: str) -> CounterMetricFamily:
    full = _named(name)
    family = families.setdefault(
        f"{full}_total", CounterMetricFamily(full, "As told in health.", labels=_SERVICE)
    )
    assert isinstance(family, CounterMetricFamily)
    return family


def _gauge(families: dict[str, Metric], name: str) -> GaugeMetricFamily:
    full = _named(name)
    family = families.setdefault(full, GaugeMetricFamily(full, "As told in health.", labels=_SERVICE))
    assert isinstance(family, GaugeMetricFamily)
    return family


def _named(name: str) -> str:
    return "bootprint_" + re.sub(r"[^a-zA-Z0-9_]", "_", name)


def metrics(
    config: Config = None,
    router: Router = None,
    port: Annotated[
        int | None, typer.Option(help="Answer scrapes on this port of loopback.", min=0, max=65535)
    ] = None,
    textfile: Annotated[
        Path | None, typer.Option(help="Write every ten seconds, for node_exporter's textfile collector.")
    ] = None,
    duration: Duration = None,
) -> None:
    """Tell Prometheus of every service's health and every topic's rate, until Ctrl-C.

    Example: bootprint bus metrics --port 9464
    """
    if port is None and textfile is None:
        raise ConfigError("nobody to tell: want --port, --textfile or both")
    collector = BusMetrics()
    registry = CollectorRegistry(auto_describe=False)
    registry.register(collector)
    with Stop(duration) as stop:
        bus = bus_way(config, router).open(should_stop=stop.is_set)
        try:
            bus.subscribe_raw(f"*/{VERSION}/**", collector.observe)
            if port is not None:
                _serve(port, registry)
            while not stop.wait(_WRITE_EVERY_S):
                _write(textfile, registry)
            _write(textfile, registry)
        finally:
            bus.close()


def _serve(port: int, registry: CollectorRegistry) -> None:
    try:
        server, _ = start_http_server(port, addr=_LOOPBACK, registry=registry)
    except OSError as error:
        raise ConfigError(f"--port {port}: {error.strerror}") from error
    typer.echo(f"http://{_LOOPBACK}:{server.server_port}/metrics", err=True)


def _write(textfile: Path | None, registry: CollectorRegistry) -> None:
    if textfile is None:
        return
    try:
        write_to_textfile(str(textfile), registry)
    except OSError as error:
        raise ConfigError(f"--textfile {textfile}: cannot be written: {error.strerror}") from error
