"""The bus over Eclipse Zenoh: the only module that imports zenoh.

Every process is a *client* of one router per computer; scouting, gossip and shared memory are off. What was
learned the hard way is kept here: sessions open in a loop that can be interrupted; samples leave zenoh through a
channel (a slow plain callback would stall the whole session and keep the process from exiting), which a service
empties when it likes (`Inlet`: waking threads for every message costs more than the messages do; `RingingInlet`:
for the few whose delay is worth that) and a tool by a thread per subscription; on closing, the session goes first
and the threads are joined after it.
"""

import json
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial

import zenoh
from zenoh import ext

from bootprint import wire
from bootprint.bus import Envelope, Handler
from bootprint.errors import BusError, WireError
from bootprint.keys.credentials import Credentials, is_secure
from bootprint.topics import BY_SUBJECT, CACHED_SAMPLES, Address, Identity, Qos, parse_key
from bootprint.zenoh_config import Table, client_settings, router_settings

RawHandler = Callable[[str, bytes], None]
_CHANNEL_SIZE = 4096
_MISS_HEARTBEAT_S = 0.5
_RETRY_S = 0.2

_Publisher = zenoh.Publisher | ext.AdvancedPublisher
_Samples = zenoh.handlers.Handler[zenoh.Sample]
_Subscriber = zenoh.Subscriber[_Samples] | ext.AdvancedSubscriber[_Samples]


def _config(table: Table) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps(table))


class Inlet:
    """A subscription whose messages wait until they are taken."""

    def __init__(self, subscriber: _Subscriber, bounded: bool) -> None:
        self._samples = subscriber.handler
        self._subscriber = subscriber
        self._bounded = bounded
        self.rejected = 0
        """Messages that were no valid message of their topic (counted, dropped)."""
        self.overruns = 0
        """Times that the channel was found full: older messages may have been dropped."""

    def _next(self) -> zenoh.Sample | None:
        return self._samples.try_recv()

    def take(self) -> Iterator[Envelope]:
        """What waits now, in the order of its arrival; at most a channel full."""
        for count in range(1, _CHANNEL_SIZE + 1):
            sample = self._next()
            if sample is None:
                return
            self.overruns += self._bounded and count == _CHANNEL_SIZE
            envelope = self._decoded(str(sample.key_expr), sample.payload.to_bytes())
            if envelope is not None:
                yield envelope

    def _decoded(self, key: str, payload: bytes) -> Envelope | None:
        try:
            return _decode(key, payload)
        except WireError:
            self.rejected += 1
            return None


class RingingInlet(Inlet):
    """An inlet that tells of every arrival, from a thread in which `attend` runs."""

    def __init__(self, subscriber: _Subscriber, bounded: bool) -> None:
        super().__init__(subscriber, bounded)
        self._waiting: deque[zenoh.Sample] = deque(maxlen=_CHANNEL_SIZE)

    def attend(self, ring: Callable[[], None]) -> None:
        """Let messages wait, and ring for each, until the subscription ends."""
        for sample in self._samples:
            self._waiting.append(sample)
            ring()

    def _next(self) -> zenoh.Sample | None:
        return self._waiting.popleft() if self._waiting else None


def _decode(key: str, payload: bytes) -> Envelope:
    address = parse_key(key)
    return Envelope(address, wire.decode(address.subject, payload))


def log_to_standard_output(what: str) -> None:
    """Let zenoh log, in the terms of RUST_LOG; once a process, before anything is opened."""
    os.environ["RUST_LOG"] = what
    zenoh.try_init_log_from_env()


class EmbeddedRouter:
    """A zenoh router inside this process (~22 MB); it routes in its own threads until closed."""

    def __init__(self, endpoint: str, settings: Table | None = None) -> None:
        """Listen at ``endpoint`` such as ``tcp/127.0.0.1:7447``; BusError if that is taken or malformed.

        ``settings``: zenoh's own, which then say all there is to say (`bootprint.zenoh_config`).
        """
        try:
            self._session = zenoh.open(_config(settings or router_settings([endpoint])))
        except zenoh.ZError as error:
            raise BusError(f"cannot start a router at {endpoint}: {_first_line(error)}") from error
        self.endpoint = endpoint

    def bus(self) -> "ZenohBus":
        """A way for the router itself to say something; closing it stops the router."""
        return ZenohBus(self._session, lossless=False)

    @property
    def sessions(self) -> int:
        """How many sessions are at this router."""
        return len(list(self._session.info.transports()))

    def name_of(self, session: str) -> str:
        """The common name on a session's certificate, by the session's id; "" if there is none."""
        names = (link.auth_identifier for link in self._session.info.links() if str(link.zid) == session)
        return next(filter(None, names), "")

    def close(self) -> None:
        """Stop routing."""
        self._session.close()


def open_bus(
    router: str,
    *,
    credentials: Credentials | None = None,
    timeout_s: float = 5.0,
    lossless: bool = False,
    should_stop: Callable[[], bool] | None = None,
) -> "ZenohBus":
    """Connect to a router, waiting for it up to ``timeout_s``; BusError says what to do if none answers.

    ``credentials``: what to show at an address that wants it (``tls/…``); ConfigError if they are not all there.
    ``lossless``: publishers wait instead of dropping and subscribers push back, for replay as fast as possible.
    """
    deadline = time.monotonic() + timeout_s
    try:
        config = _config(client_settings(router, _checked(router, credentials)))
    except zenoh.ZError as error:
        raise BusError(f"router {router!r} is no address; want one like tcp/127.0.0.1:7447") from error
    while True:
        try:
            return ZenohBus(zenoh.open(config), lossless=lossless)
        except zenoh.ZError as error:
            stopping = should_stop is not None and should_stop()
            if stopping or time.monotonic() >= deadline:
                raise BusError(
                    f"no router at {router} (waited {timeout_s:g} s): start one with `bootprint router` "
                    "or name another with --router"
                ) from error
        time.sleep(_RETRY_S)


def _checked(router: str, credentials: Credentials | None) -> Credentials | None:
    """What is to be shown at that address."""
    if not is_secure(router):
        return None
    if credentials is None:
        raise BusError(f"router {router} wants a certificate: name this computer's file with --config")
    credentials.check()
    return credentials


class ZenohBus:
    """Envelopes over one zenoh session; made by `open_bus`."""

    def __init__(self, session: zenoh.Session, *, lossless: bool) -> None:
        self._session = session
        self._lossless = lossless
        self._publishers: dict[Address, _Publisher] = {}
        self._subscribers: list[object] = []
        self._inlets: list[Inlet] = []
        self._tokens: list[zenoh.LivelinessToken] = []
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._closed = False
        self._rejected = 0

    def publish(self, envelope: Envelope) -> None:
        """Send one message by its topic's quality of service; from any thread."""
        payload = wire.encode(envelope.message)
        publisher = self._publishers.get(envelope.address) or self._declare(envelope.address)
        try:
            publisher.put(payload)
        except zenoh.ZError as error:
            if not self._closed:
                raise BusError(f"cannot publish {envelope.address.key}: {_first_line(error)}") from error

    def _declare(self, address: Address) -> _Publisher:
        with self._lock:
            if address not in self._publishers:
                self._publishers[address] = self._new_publisher(address)
            return self._publishers[address]

    def _new_publisher(self, address: Address) -> _Publisher:
        control = zenoh.CongestionControl.BLOCK if self._lossless else zenoh.CongestionControl.DROP
        qos = address.topic.qos
        if self._is_plain(qos):
            return self._session.declare_publisher(address.key, congestion_control=control)
        watched = (
            qos is not Qos.RECENT
        )  # where the next sample comes soon, it shows a hole as well as a heartbeat
        return ext.declare_advanced_publisher(
            self._session,
            address.key,
            congestion_control=control,
            cache=ext.CacheConfig(max_samples=CACHED_SAMPLES[qos]),
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=_MISS_HEARTBEAT_S if watched else None
            ),
            publisher_detection=watched,
        )

    def _is_plain(self, qos: Qos) -> bool:
        """Whether nothing is kept for who comes late; a replay at full speed has nobody who does."""
        return qos is Qos.STREAM or (qos is Qos.RECENT and self._lossless)

    @property
    def rejected(self) -> int:
        """Messages that were no valid message of their topic (counted, dropped)."""
        return self._rejected + sum(inlet.rejected for inlet in self._inlets)

    @property
    def overruns(self) -> int:
        """Times that an inlet was found full: older messages may have been dropped."""
        return sum(inlet.overruns for inlet in self._inlets)

    def open_inlet(self, selector: str, ring: Callable[[], None] | None = None) -> Inlet:
        """Let every message that matches wait until it is taken; same care as `subscribe`.

        ``ring`` is called from a thread whenever one has come; what is not taken in time then makes room, even on
        a bus without loss.
        """
        subscriber = self._declared(self._new_subscriber, selector)
        if ring is None:
            inlet = Inlet(subscriber, bounded=not self._lossless)
        else:
            inlet = RingingInlet(subscriber, bounded=True)
            self._run(f"bell {selector}", partial(inlet.attend, ring))
        self._inlets.append(inlet)
        return inlet

    def subscribe(self, selector: str, handler: Handler) -> None:
        """Call ``handler`` from a thread with every valid message that matches; recover missed events.

        A selector that names its subject gets that topic's care (history and recovery for events and states).
        """

        def decoded(key: str, payload: bytes) -> None:
            try:
                envelope = _decode(key, payload)
            except WireError:
                self._rejected += 1
                return
            handler(envelope)

        self._spawn(self._new_subscriber, selector, decoded)

    def subscribe_raw(self, selector: str, handler: RawHandler) -> None:
        """Call ``handler(key, payload)`` from a thread with everything that matches, valid or not."""
        self._spawn(self._plain_subscriber, selector, handler)

    def raw_publisher(self, key: str) -> Callable[[bytes], None]:
        """A function that puts bytes on a key that is no topic, dropped when congested; it may raise BusError."""
        publisher = self._session.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)

        def put(payload: bytes) -> None:
            try:
                publisher.put(payload)
            except zenoh.ZError as error:
                raise BusError(f"cannot publish {key}: {_first_line(error)}") from error

        return put

    def _plain_subscriber(self, selector: str) -> _Subscriber:
        return self._session.declare_subscriber(selector, self._channel())

    def _new_subscriber(self, selector: str) -> _Subscriber:
        topic = BY_SUBJECT.get(selector.split("/")[4]) if selector.count("/") == 5 else None
        if topic is None or self._is_plain(topic.qos):
            return self._plain_subscriber(selector)
        watched = topic.qos is not Qos.RECENT
        return ext.declare_advanced_subscriber(
            self._session,
            selector,
            self._channel(),
            history=ext.HistoryConfig(detect_late_publishers=watched, max_samples=CACHED_SAMPLES[topic.qos]),
            recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )

    def _channel(
        self,
    ) -> "zenoh.handlers.RingChannel[zenoh.Sample] | zenoh.handlers.FifoChannel[zenoh.Sample]":
        if self._lossless:
            return zenoh.handlers.FifoChannel(_CHANNEL_SIZE)
        return zenoh.handlers.RingChannel(_CHANNEL_SIZE)

    def _spawn(self, declare: Callable[[str], _Subscriber], selector: str, handler: RawHandler) -> None:
        subscriber = self._declared(declare, selector)

        def drain() -> None:
            for sample in subscriber.handler:
                handler(str(sample.key_expr), sample.payload.to_bytes())

        self._subscribers.append(subscriber)
        self._run(f"bus {subscriber.key_expr}", drain)

    def _run(self, name: str, body: Callable[[], None]) -> None:
        """A thread that ends with the session."""
        thread = threading.Thread(target=body, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    @staticmethod
    def _declared(declare: Callable[[str], _Subscriber], selector: str) -> _Subscriber:
        try:
            return declare(selector)
        except zenoh.ZError as error:
            raise BusError(f"{selector!r} is no selector of keys: {_first_line(error)}") from error

    def declare_alive(self, identity: Identity, service: str) -> None:
        """Hold a liveliness token for a service until the bus closes or the process dies."""
        self._tokens.append(self._session.liveliness().declare_token(identity.selector("health", service)))

    def alive(self, selector: str) -> set[str]:
        """The keys of the liveliness tokens that match (one query of the router)."""
        replies = self._session.liveliness().get(selector, timeout=1.0)
        return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}

    def is_connected(self) -> bool:
        """Whether the router is there now; zenoh looks for it by itself when it is not."""
        return bool(self._session.info.routers_zid())

    def close(self) -> None:
        """Close the session first, then join the threads that drained it; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._session.close()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(timeout=2.0)


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0].split(" at ")[0]
