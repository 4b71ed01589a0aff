"""Puts a hub together from configuration, a group key and a source of counters for each net."""

from collections.abc import Callable

from bootprint.config import Member, Realm
from sa_hub.hub import HubCore
from sa_hub.radio.counters import CounterSource
from sa_hub.radio.frame import Codec
from sa_hub.radio.net import RadioNet
from sa_hub.radio.net_keys import NextKey, keys_of
from sa_hub.radio.relevance import Relevance
from sa_hub.radio.replay import Memory
from sa_hub.radio.scheduler import Policy
from sa_hub.radio.seal import Opener, Sealer
from sa_hub.settings import HubSettings, LinkProfile


def build_hub(
    realm: Realm,
    member: Member,
    settings: HubSettings,
    group_key: bytes,
    counters: Callable[[str], CounterSource],
    memories: Callable[[str], Memory] = lambda _net: {},
    next_key: NextKey | None = None,
) -> HubCore:
    """A hub's core. ``counters`` and ``memories`` give each net's counter source and replay memory by its name.
    ``next_key``: the group key that takes over, and when.

    In one process (no files) use ``lambda net: MemoryCounters()`` for the counters.
    """
    codec = Codec(realm.origin, exercise=settings.exercise)

    def net(link: LinkProfile) -> RadioNet:
        keys = keys_of(link.name, settings.tag_bytes, group_key, next_key)
        policy = Policy(
            threshold_m=link.threshold_m or settings.threshold_m,
            heartbeat_s=settings.heartbeat_s,
            loss=link.expected_loss,
        )
        sealer = Sealer(keys, member.number, counters(link.name))
        opener = Opener(keys, memories(link.name))
        relevance = _relevance(realm)
        return RadioNet(link, policy, member.number, codec, sealer, opener, relevance, relays=settings.relays)

    return HubCore(realm, member, settings, {link.name: net(link) for link in settings.links})


def _relevance(realm: Realm) -> Relevance:
    """Who leads, and who belongs together."""
    units = {member.number: member.unit for member in realm.roster}
    leaders = [member.number for member in realm.roster if member.role in ("squad_leader", "command_post")]
    return Relevance(units, frozenset(leaders))
