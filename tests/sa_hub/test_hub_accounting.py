"""What hubs tell of their nets by soldier: ages, expected errors, who is sure to know whom, whose place matters."""

import pytest

from bootprint.awareness import Contacts
from bootprint.bus import Envelope
from bootprint.messages import LinkReport, Observation, ObservationCode, Position
from support.hub_squad import ORIGIN, START_NS, Air, S, Walk, distance_m, hub, link, own_identity, position

SQUAD = link("squad", 300, header_bytes=0)
STANDING = Walk(speed_m_s=0.0)


def reports(air: Air, name: str) -> list[LinkReport]:
    """All that a hub told of its link."""
    return [e.message for who, e in air.outputs if who == name and isinstance(e.message, LinkReport)]


def test_a_link_tells_how_old_everybodys_report_on_it_is() -> None:
    air = Air({name: hub(name, SQUAD) for name in ("a1", "a2")})
    air.run(30.0, {"a1": Walk(), "a2": Walk(east_m=20.0)})
    air.run(20.0, {"a1": Walk()})
    report = reports(air, "a1")[-1]
    assert set(report.ages_s) == {"a1", "a2"}
    heard = air.tracks["a1", "a2"]
    assert report.ages_s["a2"] == pytest.approx((report.time_ns - heard.time_ns) / S, abs=0.01)
    # For 2 s after its last position a2 may still have told that one, moved on.
    assert report.ages_s["a2"] > 18.0 > report.ages_s["a1"] + 5.0


def test_expected_errors_are_unknown_before_the_first_frame_and_then_those_of_the_others() -> None:
    air = Air({name: hub(name, link("squad", 100, header_bytes=0)) for name in ("a1", "a2")})
    walks = {"a1": Walk(turn_deg=150.0), "a2": STANDING}
    air.run(1.0, walks)  # 100 bits: no frame
    assert reports(air, "a1")[-1].expected_errors_m == {"a1": None}
    air.run(9.0, walks)
    worst_m = 0.0
    for _ in range(60):
        air.run(1.0, walks)
        expected_m = reports(air, "a1")[-1].expected_errors_m["a1"]
        assert expected_m is not None
        worst_m = max(worst_m, abs(expected_m - distance_m(air.tracks["a2", "a1"], walks["a1"], air.now_ns)))
    assert worst_m < 3.0  # a cell, and what a frame on its way changes


def test_who_gives_feedback_is_known_to_know_others() -> None:
    narrow = link("squad", 300, header_bytes=0, expected_loss=0.2)
    names = ("lead", "a1", "a2")
    hubs = {name: hub(name, narrow, role="squad_leader" if name == "lead" else "soldier") for name in names}
    air = Air(hubs, loss=0.2, seed=3)
    air.run(240.0, {name: Walk(30.0 * n, turn_deg=60.0 + 20.0 * n) for n, name in enumerate(names)})
    contacts = [e.message for who, e in air.outputs if who == "lead" and isinstance(e.message, Contacts)]
    known = {each.soldier: set(each.knows) for each in contacts[-1].members}
    assert "lead" in known["a1"]
    assert "lead" in known["a2"]


def test_who_is_near_a_danger_is_told_of_more_closely_than_who_is_near_a_rally_point() -> None:
    """Whichever half of the squad is near it."""
    dangerous, harmless = (
        sum(near_to_far(code, near_first=first) for first in (True, False))
        for code in ("sniper", "rally_point")
    )
    assert dangerous < 0.97 * harmless


def near_to_far(code: ObservationCode, *, near_first: bool) -> float:
    """A leader tells of eight who walk, every other one where something was seen, the rest 2 km away.

    The ratio of their expected errors.
    """
    core = hub("lead", link("squad", 80, header_bytes=0), role="squad_leader")
    seen = Observation(
        time_ns=START_NS,
        soldier="lead",
        latitude_deg=ORIGIN.latitude_deg,
        longitude_deg=ORIGIN.longitude_deg,
        accuracy_m=5.0,
        text="there",
        code=code,
    )
    core.tick(START_NS)
    core.handle(Envelope(own_identity("lead").address("observation", "people"), seen))
    walks = {
        number: Walk(east_m=3.0 * number + 2000.0 * (number % 2 != near_first), turn_deg=turn_deg)
        for number, turn_deg in enumerate((130.0, -110.0, 95.0, -140.0, 120.0, -100.0, 150.0, -85.0), 1)
    }
    sums = dict.fromkeys(walks, 0.0)
    for step in range(3000):
        now_ns = START_NS + step * S // 10
        for number, walk in walks.items():
            message = position(f"a{number}", now_ns, walk).message
            assert isinstance(message, Position)
            core.take_in(message, number)
        for envelope in core.tick(now_ns):
            if isinstance(envelope.message, LinkReport) and step > 600:
                for number in sums:
                    sums[number] += envelope.message.expected_errors_m[f"a{number}"] or 0.0
        core.take_frames()
    near = sum(error_m for number, error_m in sums.items() if walks[number].east_m < 1000.0)
    return near / (sum(sums.values()) - near)
