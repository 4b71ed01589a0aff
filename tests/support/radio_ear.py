"""Somebody with the group key on a radio net, who says what is in the frames that they hear, whoever sent them."""

from bootprint.config import Origin
from sa_hub.radio.content import Content
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.net_keys import NetKeys
from sa_hub.radio.seal import Opened, Opener
from sa_hub.settings import HubSettings


class RadioEar:
    """Hears each frame once, and from each sender's first full header on."""

    def __init__(self, net: str, key: bytes, origin: Origin) -> None:
        self._opener = Opener(NetKeys(key, net, HubSettings().tag_bytes))
        self._codec = Codec(origin)

    def content(self, frame: bytes, now_ns: int) -> tuple[Opened, Content] | None:
        """Who says what; None if it cannot be opened."""
        self._opener.pass_time(now_ns)
        try:
            opened = self._opener.open(frame)
            return opened, self._codec.decode(opened.sender, opened.payload, now_ns).content
        except FrameError:
            return None
