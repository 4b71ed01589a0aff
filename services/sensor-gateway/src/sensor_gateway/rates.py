"""How many samples a second each source delivers, in event time; may be read from another thread."""

import threading
from dataclasses import dataclass


@dataclass(slots=True)
class _Span:
    count: int
    first_ns: int
    last_ns: int


class RateMeter:
    """Counts per (subject, source); reading the rates starts the next interval."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._spans: dict[tuple[str, str], _Span] = {}

    def count(self, subject: str, source: str, samples: int, stamp_ns: int) -> None:
        """So many more samples, up to this stamp."""
        with self._lock:
            span = self._spans.get((subject, source))
            if span is None:
                self._spans[subject, source] = _Span(0, stamp_ns, stamp_ns)
            else:
                span.count += samples
                span.last_ns = stamp_ns

    def take(self) -> dict[str, float]:
        """Gauges ``rate_hz.<subject>/<source>`` since the last call; 0 where nothing came."""
        with self._lock:
            rates = {f"rate_hz.{'/'.join(key)}": _rate(span) for key, span in self._spans.items()}
            for span in self._spans.values():
                span.count, span.first_ns = 0, span.last_ns
            return rates


def _rate(span: _Span) -> float:
    elapsed_ns = span.last_ns - span.first_ns
    return span.count * 1e9 / elapsed_ns if elapsed_ns > 0 else 0.0
