"""Puts a hub together from configuration, a group key and a source of counters for each net."""

from collections.abc import Callable

from bootprint.config import Member, Realm
from sa_hub.hub import HubCore
from sa_hub.radio.counters import CounterSource
from sa_hub.radio.frame import Codec
from sa_hub.radio.net import RadioNet
from sa_hub.radio.replay import Memory
from sa_hub.radio.scheduler import Policy
from sa_hub.radio.seal import NetKeys, Opener, Sealer
from sa_hub.settings import HubSettings, LinkProfile


def build_hub(
    realm: Realm,
    member: Member,
    settings: HubSettings,
    group_key: bytes,
    counters: Callable[[str], CounterSource],
    memories: Callable[[str], Memory] = lambda _net: {},
) -> HubCore:
    """A hub's core. ``counters`` and ``memories`` give each net's counter source and replay memory by its name.

    In one process (no files) use ``lambda net: MemoryCounters()`` for the counters.
    """
    codec = Codec(realm.origin, exercise=settings.exercise)

    def net(link: LinkProfile) -> RadioNet:
        keys = NetKeys(group_key, link.name, settings.tag_bytes)
        policy = Policy(
            threshold_m=link.threshold_m or settings.threshold_m,
            heartbeat_s=settings.heartbeat_s,
            confirm_s=settings.confirm_s,
            gather_s=settings.gather_s,
        )
        sealer = Sealer(keys, member.number, counters(link.name))
        return RadioNet(link, policy, member.number, codec, sealer, Opener(keys, memories(link.name)))

    return HubCore(realm, member, settings, {link.name: net(link) for link in settings.links})
