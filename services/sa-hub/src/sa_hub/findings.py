"""What `bootprint doctor` looks at of the hub: its section, the group key, its links."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from bootprint.config import Computer
from bootprint.errors import ConfigError
from bootprint.findings import Finding, device, examined
from sa_hub.keys import load_group_key, load_next_key
from sa_hub.radio.link_profile import LinkProfile
from sa_hub.settings import HubSettings, check_settings


def findings(computer: Computer) -> Iterator[Finding]:
    """A finding for the section, the key, and each link."""
    try:
        section = computer.section("hub", HubSettings)
        check_settings(section, f"{computer.path}: [hub]")
    except ConfigError as error:
        yield Finding("fault", "hub", str(error))
        return
    yield Finding("ok", "hub", f"[hub] is right: a {section.role.replace('_', ' ')}'s")
    key = computer.keys_dir / f"{section.group_key or computer.realm.group_key}.key"
    yield examined("group key", partial(_load_keys, key), f"{key}: there, and for its owner only")
    if not section.links:
        mend = "add [[hub.links]] with a name, a profile (`bootprint radio profiles`) and addresses"
        yield Finding("warning", "radio", "no links: nobody will hear of this computer", mend)
    for link in section.links:
        yield _link(link)


def _load_keys(key: Path) -> None:
    load_group_key(key)
    load_next_key(key)


def _link(link: LinkProfile) -> Finding:
    if link.kind == "serial" and link.port is not None:
        return device(f"radio {link.name}", link.port)
    told = f"{link.kind}, {link.rate_bits_per_s} bit/s"
    if link.kind == "udp" and not link.peers:
        return Finding(
            "warning", f"radio {link.name}", f"{told}, but no peers: it only listens", "name its peers"
        )
    return Finding("ok", f"radio {link.name}", told)
