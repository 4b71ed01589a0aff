"""Who is known to whom, as real hubs tell by what they hear: relays, a link that breaks, and one that mends."""

import pytest

from bootprint.awareness import Contact, Contacts
from sa_hub.awareness.contacts import ContactMap
from support.hub_squad import REALM, START_NS, Air, S, Walk, hub, link

SQUAD, COMPANY = link("squad"), link("company", 4800)
WALKS = {f"a{n}": Walk(east_m=15.0 * n, turn_deg=40.0 + 17.0 * n) for n in range(1, 4)}


def company() -> Air:
    """Three soldiers, their leader who relays to the command post."""
    soldiers = {name: hub(name, SQUAD) for name in WALKS}
    leader = hub("lead", SQUAD, COMPANY, role="squad_leader")
    return Air({**soldiers, "lead": leader, "cp": hub("cp", COMPANY, role="command_post")})


def newest(air: Air, receiver: str) -> Contacts:
    """The newest map that a hub has told."""
    return next(
        envelope.message
        for name, envelope in reversed(air.outputs)
        if name == receiver and isinstance(envelope.message, Contacts)
    )


def of(contacts: Contacts, soldier: str) -> Contact:
    """One member's row."""
    return next(each for each in contacts.members if each.soldier == soldier)


def test_a_relay_is_known_to_know_whom_it_passes_on() -> None:
    air = company()
    air.run(41.0, WALKS)
    contacts = newest(air, "cp")
    assert contacts.soldier == "cp"
    assert set(contacts.knows) == {"a1", "a2", "a3"}
    assert [each.soldier for each in contacts.members] == ["lead"]
    assert of(contacts, "lead").link == "company"
    assert set(of(contacts, "lead").knows) == {"a1", "a2", "a3"}
    assert all(START_NS <= since <= START_NS + 5 * S for since in of(contacts, "lead").knows.values())


def test_a_soldier_proves_to_know_itself_and_what_it_says_to_have_heard_of_us() -> None:
    air = company()
    air.run(61.0, WALKS)
    contacts = newest(air, "a1")
    assert {each.soldier: set(each.knows) for each in contacts.members} == {
        "a2": {"a1", "a2"},
        "a3": {"a1", "a3"},
    }
    assert set(contacts.knows) == {"a2", "a3"}


def test_in_a_quiet_net_it_goes_on_proving_that() -> None:
    air = company()
    air.run(100.0, WALKS)
    seen = len(air.outputs)
    air.run(60.0, WALKS)
    told = [e.message for name, e in air.outputs[seen:] if name == "a1" and isinstance(e.message, Contacts)]
    assert len(told) == 12
    for contacts in told:
        assert {each.soldier for each in contacts.members if "a1" in each.knows} >= {"a2", "a3"}


def test_the_map_is_told_every_five_seconds_under_one_key() -> None:
    air = company()
    air.run(60.0, WALKS)
    told = [e for name, e in air.outputs if name == "cp" and isinstance(e.message, Contacts)]
    assert [(e.message.time_ns - START_NS) // S for e in told] == list(range(0, 61, 5))
    assert {e.address.key for e in told} == {"bp/@v1/hq/cp/contacts/hub"}


def test_a_broken_link_shows_down_the_chain_and_a_mended_one_begins_anew() -> None:
    air = company()
    air.run(41.0, WALKS)
    early = of(newest(air, "cp"), "lead").knows
    air.cut_off.add("a2")
    air.run(90.0, WALKS)
    later = newest(air, "cp")
    assert set(later.knows) == set(of(later, "lead").knows) == {"a1", "a3"}
    assert of(later, "lead").knows["a1"] == early["a1"]
    mended_ns = air.now_ns
    air.cut_off.clear()
    air.run(20.0, WALKS)
    again = of(newest(air, "cp"), "lead").knows
    assert mended_ns <= again["a2"] <= mended_ns + 5 * S
    assert again["a1"] == early["a1"]


def test_a_member_who_is_silent_leaves_the_map() -> None:
    air = company()
    air.run(41.0, WALKS)
    air.cut_off.add("lead")
    air.run(100.0, WALKS)
    contacts = newest(air, "cp")
    assert (contacts.members, contacts.knows) == ((), {})


def test_knowledge_is_as_old_as_its_report_and_goes_back_with_the_clock() -> None:
    contacts = ContactMap(100, REALM.by_number(), 75 * S)
    contacts.heard(10, "company", 1000 * S)
    contacts.proven(10, 1, 940 * S)
    contacts.proven(10, 2, 990 * S)
    contacts.proven(10, 999, 990 * S)
    assert of(contacts.message(1000 * S), "lead").knows == {"a1": 940 * S, "a2": 990 * S}
    assert of(contacts.message(1020 * S), "lead").knows == {"a2": 990 * S}
    contacts.set_back(500 * S)
    row = of(contacts.message(520 * S), "lead")
    assert (row.heard_ns, row.knows) == (500 * S, {"a2": 490 * S})


@pytest.mark.parametrize(("pause_s", "unbroken"), [(74, True), (76, False)])
def test_a_pause_longer_than_fresh_breaks_the_spell(pause_s: int, unbroken: bool) -> None:
    contacts = ContactMap(100, REALM.by_number(), 75 * S)
    contacts.told(1, 100 * S)
    contacts.told(1, (100 + pause_s) * S)
    since_ns = contacts.message((100 + pause_s) * S).knows["a1"]
    assert since_ns == (100 if unbroken else 100 + pause_s) * S
