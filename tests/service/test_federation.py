"""Command posts whose routers are joined over TLS: each says its own, and one's trouble stays its own."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Computer
from bootprint.keys.authority import Authority
from bootprint.keys.routing import guarded_settings
from bootprint.messages import Status
from bootprint.topics import FRAMES, Identity
from bootprint.zenoh_bus import EmbeddedRouter, ZenohBus, open_bus
from support.guarded import A3, CP, CQ, make_authority, make_computer, secure_endpoint, shown_by
from support.routers import free_endpoint
from support.waiting import wait_until

Hear = Callable[[ZenohBus, str], list[str]]


class Posts:
    """Two command posts, cp and cq; cq's router joins cp's."""

    def __init__(self, folder: Path) -> None:
        self.authority: Authority = make_authority(folder)
        cp, cq = secure_endpoint(), secure_endpoint()
        self.cp = make_computer(self.authority, "cp", f'router = "{cp}"')
        self.cq = make_computer(self.authority, "cq", f'router = "{cq}"\n[bus]\nconnect = ["{cp}"]')
        self._stack = ExitStack()

    def router(self, computer: Computer) -> EmbeddedRouter:
        return EmbeddedRouter(computer.router, guarded_settings(computer))

    def bus(self, computer: Computer, name: str | None = None) -> ZenohBus:
        """At a computer's router, as that computer or by any other certificate."""
        shown = computer.credentials if name is None else shown_by(self.authority, name)
        return self._stack.enter_context(closing(open_bus(computer.router, credentials=shown)))

    def close(self) -> None:
        self._stack.close()


@pytest.fixture
def posts(tmp_path: Path) -> Iterator[Posts]:
    made = Posts(tmp_path)
    yield made
    made.close()


def hear(bus: ZenohBus, selector: str) -> list[str]:
    heard: list[str] = []
    bus.subscribe_raw(selector, lambda key, _: heard.append(key))
    return heard


def crosses(put: Callable[[bytes], None], heard: list[str], key: str) -> None:
    """Say it until it is heard: a route is there some time after a router is."""
    wait_until(lambda: (put(b"frame"), key in heard)[1], what=f"{key} on the other side")


def status(identity: Identity) -> Envelope:
    message = Status(time_ns=1, soldier=identity.soldier)
    return Envelope(identity.address("status", "person"), message)


def test_frames_cross_in_both_directions_and_nobody_speaks_for_another(posts: Posts) -> None:
    with (
        closing(posts.router(posts.cq)),
        closing(posts.router(posts.cp)),
    ):  # the one that joins is there first
        cp, cq = posts.bus(posts.cp), posts.bus(posts.cq)
        at_cp, at_cq = hear(cp, f"bp/{FRAMES}/posts/*"), hear(cq, f"bp/{FRAMES}/posts/*")
        of_cp, of_cq = f"bp/{FRAMES}/posts/100", f"bp/{FRAMES}/posts/101"
        crosses(cp.raw_publisher(of_cp), at_cq, of_cp)
        crosses(cq.raw_publisher(of_cq), at_cp, of_cq)
        # cq says something by cp's number, and by a soldier's: it stays where it was said, if it gets in at all.
        for number in (100, 3):
            cq.raw_publisher(f"bp/{FRAMES}/posts/{number}")(b"forged")
        before = len(at_cp)
        crosses(cq.raw_publisher(of_cq), at_cp, of_cq)
        wait_until(lambda: len(at_cp) > before, what="a frame after the forged ones")
        assert set(at_cp) - {of_cp} == {of_cq}


def test_a_squads_own_topics_stay_at_its_post(posts: Posts) -> None:
    with closing(posts.router(posts.cp)), closing(posts.router(posts.cq)):
        cp, cq, a3 = posts.bus(posts.cp), posts.bus(posts.cq), posts.bus(posts.cp, "a3.1")
        at_cp, at_cq = hear(cp, "bp/@v1/**"), hear(cq, "bp/@v1/**")
        of_cp, of_squad = hear(cq, "bp/@v1/hq/cp/**"), hear(cq, "bp/@v1/alpha/a3/**")
        put = a3.raw_publisher(status(A3).address.key)
        crosses(put, at_cp, status(A3).address.key)
        # A post's own tracks do cross, after what must not.
        crosses(cp.raw_publisher(status(CP).address.key), of_cp, status(CP).address.key)
        assert set(at_cq) == {status(CP).address.key}
        assert of_squad == []


def test_a_posts_end_is_its_own_and_it_comes_back_by_itself(posts: Posts) -> None:
    of_cp = f"bp/{FRAMES}/posts/100"
    with closing(posts.router(posts.cp)):
        cp, a3 = posts.bus(posts.cp), posts.bus(posts.cp, "a3.1")
        at_cp = hear(cp, "bp/@v1/**")
        with closing(posts.router(posts.cq)):
            at_cq = hear(posts.bus(posts.cq), f"bp/{FRAMES}/posts/*")
            crosses(cp.raw_publisher(of_cp), at_cq, of_cp)
        key = status(A3).address.key
        put = a3.raw_publisher(key)
        wait_until(
            lambda: (put(wire.encode(status(A3).message)), key in at_cp)[1], what="the squad's own words"
        )
        with closing(posts.router(posts.cq)):
            again = hear(posts.bus(posts.cq), f"bp/{FRAMES}/posts/*")
            crosses(cp.raw_publisher(of_cp), again, of_cp)


def test_a_post_reads_its_peers_own_subtree_by_certificate(posts: Posts) -> None:
    """A tool of cq at cp's router: cp's own topics, and nothing of cp's squad."""
    with closing(posts.router(posts.cp)):
        a3, cp, tool = posts.bus(posts.cp, "a3.1"), posts.bus(posts.cp), posts.bus(posts.cp, "cq.1")
        heard = hear(tool, "bp/@v1/hq/cp/**")
        hear_squad = hear(tool, "bp/@v1/alpha/a3/**")
        at_cp = hear(cp, "bp/@v1/alpha/a3/**")
        crosses(a3.raw_publisher(status(A3).address.key), at_cp, status(A3).address.key)
        crosses(cp.raw_publisher(status(CP).address.key), heard, status(CP).address.key)
        own = status(CQ).address.key
        crosses(tool.raw_publisher(own), hear(cp, "bp/@v1/hq2/cq/**"), own)
        assert hear_squad == []


def test_who_is_on_the_computer_is_the_computer_and_whoever_comes_over_the_net_shows_a_certificate(
    tmp_path: Path,
) -> None:
    """The services' own way over loopback needs none; it says what is the post's and hears all."""
    authority, door = make_authority(tmp_path), secure_endpoint()
    post = make_computer(authority, "cp", f'router = "{free_endpoint()}"\n[bus]\nlisten = ["{door}"]')
    with ExitStack() as stack:
        stack.enter_context(closing(EmbeddedRouter(post.router, guarded_settings(post))))
        service, tool = (stack.enter_context(closing(open_bus(post.router))) for _ in range(2))
        a3 = stack.enter_context(closing(open_bus(door, credentials=shown_by(authority, "a3.1"))))
        heard = hear(tool, "bp/@v1/**")
        crosses(a3.raw_publisher(status(A3).address.key), heard, status(A3).address.key)
        service.raw_publisher(status(CQ).address.key)(b"not ours to say")
        crosses(service.raw_publisher(status(CP).address.key), heard, status(CP).address.key)
        assert set(heard) == {status(A3).address.key, status(CP).address.key}
