"""The companion that shares maps, put together from a computer's configuration."""

from collections.abc import Callable, Iterable

from bootprint.bus import Envelope
from bootprint.service import Context
from sa_hub.keys import load_group_key, load_next_key
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.rooms.sharing import RoomExchange, RoomLinks


def broadband(links: Iterable[LinkProfile]) -> dict[str, str]:
    """The links that carry maps, by name, with their routers."""
    return {link.name: link.router for link in links if link.kind == "zenoh" and link.router is not None}


def room_links(
    context: Context,
    links: Iterable[LinkProfile],
    group_key: str | None,
    announce: Callable[[Envelope], None],
) -> RoomLinks | None:
    """Sessions for the links of kind zenoh; None if there are none."""
    routers = broadband(links)
    if not routers:
        return None
    computer = context.computer
    key_file = computer.keys_dir / f"{group_key or computer.realm.group_key}.key"
    exchange = RoomExchange(
        computer.identity,
        computer.member.number,
        computer.realm.by_number(),
        load_group_key(key_file),
        load_next_key(key_file),
    )
    return RoomLinks(
        exchange, routers, computer.realm.id, computer.member.number, context.clock.now_ns, announce
    )
