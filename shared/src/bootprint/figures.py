"""What a service tells of itself once a second; the scaffold puts it into a Health message."""

from dataclasses import dataclass, field

from bootprint.messages import ServiceState


@dataclass
class Figures:
    """State, faults and work as counters, rates and ages as gauges."""

    state: ServiceState = "ok"
    counters: dict[str, int] = field(default_factory=dict)
    gauges: dict[str, float] = field(default_factory=dict)
    note: str = ""
