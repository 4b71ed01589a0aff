"""The inbox of a main loop: jobs as they come, and a bell that calls soon but not at once."""

import threading
import time
from collections.abc import Iterable

from bootprint import inbox as module
from bootprint.bus import Envelope
from bootprint.inbox import Inbox

HOUR_S = 3600.0


def nothing() -> Iterable[Envelope]:
    return ()


def test_jobs_come_in_order_and_those_that_wait_although_it_is_late() -> None:
    inbox = Inbox(gather_s=0.0)
    jobs = [lambda: (), lambda: (), lambda: ()]
    for job in jobs:
        inbox.post(job, patient=False)
    assert list(inbox.jobs(time.monotonic())) == jobs


def test_the_bell_ends_a_wait_of_an_hour() -> None:
    inbox = Inbox(gather_s=0.001)
    bell = threading.Timer(0.01, inbox.ring)
    bell.start()
    assert len(list(inbox.jobs(time.monotonic() + HOUR_S))) == 1
    bell.join()


def test_what_comes_in_the_moment_after_the_bell_is_waited_for() -> None:
    inbox = Inbox(gather_s=30.0)
    inbox.ring()
    jobs = inbox.jobs(time.monotonic() + HOUR_S)
    next(jobs)
    threading.Timer(0.01, inbox.post, (nothing,), {"patient": False}).start()
    assert next(jobs) is nothing


def test_it_rings_once_until_it_is_answered() -> None:
    inbox = Inbox(gather_s=0.0)
    for _ in range(3):
        inbox.ring()
    assert len(list(inbox.jobs(time.monotonic()))) == 1
    inbox.ring()
    assert list(inbox.jobs(time.monotonic())) == []
    inbox.answer()
    inbox.ring()
    assert len(list(inbox.jobs(time.monotonic()))) == 1


def test_a_job_without_room_is_dropped_and_counted() -> None:
    inbox = Inbox(gather_s=0.0)
    for _ in range(module._SIZE + 2):
        inbox.post(nothing, patient=False)
    assert inbox.dropped == 2
