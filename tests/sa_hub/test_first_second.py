"""A hub that starts listens at once and speaks when its epoch's second is over."""

from pathlib import Path

from sa_hub.first_second import FirstSecond
from sa_hub.radio.counters import FileCounters
from support.host_clock import JAN_2026_S, HostClock

BEGIN_S = JAN_2026_S + 0.25


def test_nets_wait_side_by_side_and_nobody_stands_still(tmp_path: Path) -> None:
    host = HostClock(BEGIN_S)
    first = FirstSecond(host.monotonic, host.sleep)
    for net in ("squad", "company"):
        FileCounters(tmp_path / net, host, sleep=first.waiting(net)).reserve()
    assert host.slept_s == []
    assert first.waits("squad")
    assert first.waits("company")
    host.now_s += 0.74
    assert first.waits("squad")
    host.now_s += 0.02
    assert not first.waits("squad")
    assert not first.waits("company")


def test_after_the_start_counters_of_a_new_epoch_are_waited_for(tmp_path: Path) -> None:
    host = HostClock(BEGIN_S)
    first = FirstSecond(host.monotonic, host.sleep)
    mine = FileCounters(tmp_path / "c", host, block=4, sleep=first.waiting("squad"))
    mine.reserve()
    first.started()
    host.now_s += 60.0
    FileCounters(tmp_path / "c", host, block=4, sleep=host.sleep).reserve()  # another's epoch by now
    host.slept_s.clear()
    host.now_s = float(int(host.now_s)) + 10.25
    assert mine.reserve().first == 0  # an epoch of its own
    assert host.slept_s == [0.75]
    assert not first.waits("squad")


def test_a_net_that_has_nothing_to_wait_for_may_speak() -> None:
    assert not FirstSecond().waits("squad")
