"""A hub's account of itself: what its nets have refused and why, how its tracks are, and what is wrong."""

from collections import Counter
from collections.abc import Mapping

from bootprint.figures import Figures
from sa_hub.radio.net import RadioNet
from sa_hub.tracks import Tracks


def figures_of(own: Mapping[str, int], nets: Mapping[str, RadioNet], tracks: Tracks) -> Figures:
    """The hub's ``own`` counts, those of its nets by link name together, and how many tracks are in which state."""
    counters = Counter(own)
    for net in nets.values():
        counters.update({f"radio_{cause}": count for cause, count in net.meter.rejected.items()})
        counters["reports_unresolved"] += net.unresolved
        counters["notices_dropped"] += net.correspondence.outbox.dropped
        counters["notices_unacknowledged"] += net.correspondence.outbox.given_up
        counters["radio_counter_faults"] += net.counter_faults
        counters["radio_faults"] += net.faults
    states = Counter(known.state for known in tracks.all())
    gauges = {f"tracks_{state}": float(states[state]) for state in ("fresh", "stale", "lost")}
    note = _note(counters) or _unopened(nets)
    return Figures("degraded" if note else "ok", dict(counters), gauges, note)


def _note(counters: Mapping[str, int]) -> str:
    """What is wrong, if anything is."""
    if counters["radio_counter_faults"]:
        return "no fresh radio counters can be reserved: not sending"
    return "a radio net cannot speak, see the log" if counters["radio_faults"] else ""


def _unopened(nets: Mapping[str, RadioNet]) -> str:
    """Nets on which frames are heard of which none can be opened."""
    deaf = [name for name, net in nets.items() if net.opens_nothing]
    return f"hears frames on {', '.join(deaf)} but can open none: is the group key the same?" if deaf else ""
