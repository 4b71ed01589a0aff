"""How many samples a second a unit sends, in event time."""

NS_PER_S = 1_000_000_000


class RateMeter:
    """Counts samples; the rate is that of the newest full second, 0 while the unit is silent."""

    def __init__(self) -> None:
        self._since_ns = 0
        self._count = 0
        self.rate_hz = 0.0
        self.newest_ns: int | None = None

    def count(self, newest_ns: int, samples: int) -> None:
        """So many samples came, the last one of this time."""
        self.newest_ns = newest_ns
        span_ns = newest_ns - self._since_ns
        self._count += samples
        if not 0 <= span_ns < NS_PER_S:
            self.rate_hz = self._count * NS_PER_S / span_ns if 0 < span_ns < 2 * NS_PER_S else 0.0
            self._since_ns, self._count = newest_ns, 0
