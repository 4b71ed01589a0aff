"""Who tried what they may not: read out of what a guarded router logs, for zenoh itself denies without a word.

Refused connections are warnings of its TLS link, unknown names an information, and denied messages (with allowed
ones) traces of its access control. When a key is first used, zenoh looks up all that could be done with it and logs
that too, in as many lines as there are actions; those are no attempts, and neither is what goes out to others.
"""

import re
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

Kind = Literal["no_certificate", "not_admitted", "denied"]
KINDS: Final[tuple[Kind, ...]] = ("no_certificate", "not_admitted", "denied")
LOG_FILTER: Final = (
    "error,zenoh_link_tls=warn,zenoh_link_quic=warn,zenoh::net::routing::interceptor::access_control=trace"
)
"""For RUST_LOG: all that is read here, and nothing else."""

_COLOUR: Final = re.compile(rb"\x1b\[[0-9;]*m")
_LINE: Final = re.compile(
    rb"\S+ +(?:TRACE|DEBUG|INFO|WARN|ERROR) +(?P<thread>.*?ThreadId\(\d+\)) (?P<module>\S+?): (?P<text>.*)"
)
_CACHING: Final = re.compile(rb"ACL \((?:in|e)gress\): caching permissions for ")
_DENIED: Final = re.compile(
    rb"(?P<zid>[0-9a-f]+) on (?P<subject>\S+) is unauthorized to (?P<action>.+?) \(ingress\) on (?P<key>\S+)"
)
_UNKNOWN: Final = re.compile(rb"(?P<zid>[0-9a-f]+) did not match any configured ACL subject")
_NAME: Final = re.compile(rb"CertCommonName\((?P<name>[^)]*)\)")
_ACTIONS: Final = 9
_LONGEST_LINE: Final = 4096
_RECENT_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Attempt:
    """One thing that was not let through: who (a certificate's name, as far as there is one) and what."""

    kind: Kind
    who: str
    what: str

    def __str__(self) -> str:
        match self.kind:
            case "no_certificate":
                return f"a connection without a valid certificate was refused: {self.what}"
            case "not_admitted":
                return f"{self.who} came with a certificate that the register does not hold: nothing gets through"
            case "denied":
                return f"{self.who} was denied {self.what}"


class LogReader:
    """Finds attempts in the bytes that a router logs, in pieces of any size.

    ``name_of``: the name on the certificate of a session, by its id; "" if it is not known (any more).
    """

    def __init__(self, name_of: Callable[[str], str]) -> None:
        self._name_of = name_of
        self._rest = b""
        self._looked_up: dict[bytes, int] = {}

    def read(self, data: bytes) -> list[Attempt]:
        """The attempts in what was logged now."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-_LONGEST_LINE:]
        return [attempt for line in lines if (attempt := self._attempt(line)) is not None]

    def _attempt(self, line: bytes) -> Attempt | None:
        found = _LINE.match(_COLOUR.sub(b"", line))
        if found is None:
            return None
        thread, text = found["thread"], found["text"]
        if found["module"].startswith(b"zenoh_link_"):
            return Attempt("no_certificate", "", _words(text.partition(b". Hint")[0]))
        if _CACHING.match(text):
            self._looked_up[thread] = _ACTIONS
            return None
        if self._looked_up.get(thread, 0) > 0:
            self._looked_up[thread] -= 1
            return None
        return self._refusal(text)

    def _refusal(self, text: bytes) -> Attempt | None:
        if denied := _DENIED.match(text):
            name = _NAME.search(denied["subject"])
            who = _words(name["name"]) if name else "a process on this computer"
            return Attempt("denied", who, f"{_words(denied['action']).lower()} on {_words(denied['key'])}")
        if unknown := _UNKNOWN.match(text):
            return Attempt("not_admitted", self._name_of(_words(unknown["zid"])) or "somebody", "")
        return None


class Attempts:
    """Counts since the start, and what is worth a person's attention now; times are host seconds."""

    def __init__(self) -> None:
        self.counts: Counter[Kind] = Counter()
        self._recent: deque[tuple[float, Attempt]] = deque(maxlen=1000)

    def note(self, attempts: list[Attempt], now_s: float) -> list[Attempt]:
        """Count them; those of a kind that was not seen in the last minute are returned, for the log."""
        self._forget(now_s)
        fresh: list[Attempt] = []
        for attempt in attempts:
            self.counts[attempt.kind] += 1
            if all(attempt != before for _, before in self._recent):
                fresh.append(attempt)
            self._recent.append((now_s, attempt))
        return fresh

    def told(self, now_s: float) -> str:
        """The newest attempt of the last minute, and how many there were; empty if there was none."""
        self._forget(now_s)
        if not self._recent:
            return ""
        more = f" ({len(self._recent)} attempts in the last minute)" if len(self._recent) > 1 else ""
        return f"{self._recent[-1][1]}{more}"

    def _forget(self, now_s: float) -> None:
        while self._recent and self._recent[0][0] < now_s - _RECENT_S:
            self._recent.popleft()


def _words(text: bytes) -> str:
    """Nothing that somebody sent may steer a terminal."""
    return text.decode("utf-8", "replace").encode("unicode_escape").decode()
