"""The group key's roll-over: senders change at a stated time, receivers take both keys around it."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from bootprint.errors import ConfigError
from bootprint.keys.secret_files import next_path
from sa_hub.assembly import build_hub
from sa_hub.commands import register
from sa_hub.keys import (
    create_group_key,
    create_next_key,
    finish_roll,
    load_group_key,
    load_next_key,
)
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.errors import FrameError
from sa_hub.radio.net_keys import OVERLAP_NS, NetKeys, NextKey, RollOver, keys_of
from sa_hub.radio.seal import Opener, Sealer
from sa_hub.settings import HubSettings
from support.hub_squad import GROUP_KEY, REALM, START_NS, Air, S, Walk, link

OLD, NEW = NetKeys(bytes(32), "squad", 8), NetKeys(bytes(range(32)), "squad", 8)
FROM_NS = 1_800_000_000 * S
ROLL = RollOver(OLD, NEW, FROM_NS)


def opens(opener: Opener, frame: bytes, now_ns: int) -> bool:
    opener.pass_time(now_ns)
    try:
        opener.open(frame)
    except FrameError:
        return False
    return True


@pytest.mark.parametrize(
    ("after_s", "sealed_with_new", "old_opens", "new_opens"),
    [
        (-3600, False, True, True),
        (-1, False, True, True),
        (0, True, True, True),
        (OVERLAP_NS // S - 1, True, True, True),
        (OVERLAP_NS // S, True, False, True),
    ],
)
def test_who_seals_and_who_opens_around_the_change(
    after_s: int, sealed_with_new: bool, old_opens: bool, new_opens: bool
) -> None:
    now_ns = FROM_NS + after_s * S
    frame = Sealer(ROLL, 7, MemoryCounters()).seal(b"x", now_ns)
    assert opens(Opener(NEW), frame, now_ns) == sealed_with_new
    assert opens(Opener(OLD), frame, now_ns) != sealed_with_new
    assert opens(Opener(ROLL), Sealer(OLD, 7, MemoryCounters()).seal(b"x", now_ns), now_ns) == old_opens
    assert opens(Opener(ROLL), Sealer(NEW, 7, MemoryCounters()).seal(b"x", now_ns), now_ns) == new_opens


def test_one_replay_window_holds_for_both_keys() -> None:
    sender, opener = Sealer(ROLL, 7, MemoryCounters()), Opener(ROLL)
    frames = [sender.seal(b"x", FROM_NS + step * S) for step in range(-5, 5)]
    assert all(opens(opener, frame, FROM_NS) for frame in frames)
    for frame in frames:
        with pytest.raises(FrameError, match="heard before"):
            opener.open(frame)


def test_a_squad_goes_over_without_a_gap() -> None:
    next_key = NextKey(bytes(32), START_NS + 30 * S)

    def computer(name: str) -> object:
        settings = HubSettings(links=(link("squad"),))
        member = REALM.member(name)
        return build_hub(REALM, member, settings, GROUP_KEY, lambda _: MemoryCounters(), next_key=next_key)

    air = Air({name: computer(name) for name in ("a1", "a2")})  # type: ignore[misc]
    air.run(120.0, {"a1": Walk(), "a2": Walk(east_m=20.0)})
    for name in ("a1", "a2"):
        assert air.hubs[name].figures().counters.get("radio_forged", 0) == 0
        assert air.hubs[name].frames_heard("squad") > 5
    only_new = Opener(keys_of("squad", 8, bytes(32), None))
    taken = [(at_ns, opens(only_new, data, at_ns)) for at_ns, name, _, data in air.log if name == "a1"]
    assert not any(opened for at_ns, opened in taken if at_ns < START_NS + 30 * S)
    assert sum(opened for _, opened in taken) > 0


# -- files ----------------------------------------------------------------------------------------------------


def test_the_next_key_says_when_it_begins(tmp_path: Path) -> None:
    path = tmp_path / "group.key"
    create_group_key(path)
    assert load_next_key(path) is None
    begins = datetime(2026, 12, 1, 6, tzinfo=UTC)
    following = create_next_key(path, begins)
    assert following == tmp_path / "group.next.key"
    found = load_next_key(path)
    assert found is not None
    assert found.from_ns == 1_796_104_800 * S  # 2026-12-01 06:00 UTC
    assert found.group_key != load_group_key(path)
    assert following.stat().st_mode & 0o077 == 0
    with pytest.raises(ConfigError, match="exists already"):
        create_next_key(path, begins)


def test_the_roll_is_finished_a_day_later_and_not_before(tmp_path: Path) -> None:
    path = tmp_path / "group.key"
    create_group_key(path)
    with pytest.raises(ConfigError, match="no next key"):
        finish_roll(path, 0.0)
    begins = datetime(2026, 12, 1, 6, tzinfo=UTC)
    create_next_key(path, begins)
    coming = load_next_key(path)
    with pytest.raises(ConfigError, match="2026-12-02T06:00:00"):
        finish_roll(path, (begins + timedelta(hours=23)).timestamp())
    finish_roll(path, (begins + timedelta(hours=24)).timestamp())
    assert coming is not None
    assert load_group_key(path) == coming.group_key
    assert path.stat().st_mode & 0o077 == 0
    assert [each.name for each in tmp_path.iterdir()] == ["group.key"]


def test_a_lost_key_opens_nothing_from_the_change_on(tmp_path: Path) -> None:
    path = tmp_path / "group.key"
    create_group_key(path)
    begins = datetime(2026, 12, 1, 6, tzinfo=UTC)
    create_next_key(path, begins, is_lost=True)
    coming = load_next_key(path)
    assert coming is not None
    roll = keys_of("squad", 8, load_group_key(path), coming)
    captured = NetKeys(load_group_key(path), "squad", 8)
    for after_s, is_taken in ((-1, True), (0, False), (3600, False)):
        now_ns = coming.from_ns + after_s * S
        frame = Sealer(captured, 7, MemoryCounters()).seal(b"x", now_ns)
        assert opens(Opener(roll), frame, now_ns) == is_taken
    # Nobody uses the old one any more, so there is no day to wait for.
    finish_roll(path, begins.timestamp())
    assert load_group_key(path) == coming.group_key


@pytest.mark.parametrize(
    "content", ["", "00" * 32, "00" * 32 + "\nfrom tomorrow", "00" * 32 + "\nfrom 2026-12-01T06:00:00", "\n"]
)
def test_a_wrong_next_key_is_refused_in_one_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "group.key"
    create_group_key(path)
    following = next_path(path)
    following.write_text(content)
    following.chmod(0o600)
    with pytest.raises(ConfigError, match=r"group\.next\.key: does not say when it begins") as caught:
        load_next_key(path)
    assert "\n" not in str(caught.value)


def test_the_commands_make_and_finish_a_next_key(tmp_path: Path) -> None:
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    path = tmp_path / "group.key"
    create_group_key(path)
    result = CliRunner().invoke(app, ["keys", "roll", str(path), "--at", "2021-05-01T06:00"])
    assert result.exit_code == 0
    assert "group.next.key" in result.output
    coming = load_next_key(path)
    assert coming is not None
    assert coming.from_ns == round(datetime(2021, 5, 1, 6, tzinfo=UTC).timestamp()) * S
    assert coming.group_key.hex() not in result.output
    assert CliRunner().invoke(app, ["keys", "finish", str(path)]).exit_code == 0
    assert load_group_key(path) == coming.group_key
    roll = ["keys", "roll", str(path), "--at", "2021-05-01T06:00", "--lost"]
    assert CliRunner().invoke(app, roll).exit_code == 0
    lost = load_next_key(path)
    assert lost is not None
    assert (coming.overlap_ns, lost.overlap_ns) == (OVERLAP_NS, 0)
