"""Radio nets over zenoh at a guarded router: by certificate, each hub by its own number alone."""

from contextlib import closing
from pathlib import Path

from bootprint.config import Computer
from bootprint.keys.credentials import Credentials
from bootprint.keys.routing import guarded_settings
from bootprint.zenoh_bus import EmbeddedRouter
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.radio.links.opening import Surroundings, open_link
from support.guarded import make_authority, make_computer, secure_endpoint, shown_by
from support.link_ears import Ears
from support.waiting import wait_until


def ears(post: Computer, number: int, credentials: Credentials | None) -> Ears:
    profile = LinkProfile(name="posts", kind="zenoh", router=post.router, rate_bits_per_s=9600)
    around = Surroundings("bp", number, post.path.parent, lambda: 0, credentials)
    return Ears(lambda on_frame: open_link(profile, on_frame, around))


def test_frames_pass_by_certificate_and_under_nobody_elses_number(tmp_path: Path) -> None:
    authority = make_authority(tmp_path)
    post = make_computer(authority, "cp", f'router = "{secure_endpoint()}"')
    with closing(EmbeddedRouter(post.router, guarded_settings(post))):
        cp = ears(post, 100, post.credentials)
        a3 = ears(post, 3, shown_by(authority, "a3.1"))
        as_a3 = ears(post, 3, shown_by(authority, "a4.1"))  # a4's computer, set up as if it were a3's
        stranger = ears(post, 5, None)
        wait_until(lambda: not (cp.link.busy or a3.link.busy or as_a3.link.busy), what="three are admitted")
        wait_until(lambda: (a3.link.send(b"mine"), not cp.empty())[1], what="the route stands")
        heard: list[bytes] = []

        def both_speak() -> bool:
            as_a3.link.send(b"not mine")
            a3.link.send(b"last")
            if not cp.empty():
                heard.append(cp.get())
            return heard.count(b"last") >= 20

        wait_until(both_speak, what="twenty frames of the honest one")
        assert set(heard) <= {b"mine", b"last"}
        assert stranger.link.busy
        stranger.link.send(b"let me in")
        assert stranger.link.send_faults == 1
        for each in (cp, a3, as_a3, stranger):
            each.link.close()
