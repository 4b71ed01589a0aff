"""What each certificate may do at a computer's router, as zenoh's access control.

Everybody may say what is their own (their subtree of the realm, and their frames of radio nets that run over zenoh)
and read that, and the frames of others, which are sealed. A command post may also read the subtree of the computer
whose router it asks. The computer itself reads everything that reaches its router. All else is denied, and so is a
certificate that the register does not know: a revoked one, or one of another realm.

A subtree holds also ``@adv`` keys, by which zenoh recovers what was missed; ``**`` does not match those.
"""

from collections.abc import Sequence
from typing import Any, Final

from bootprint.config import Member, Realm
from bootprint.keys.register import Register
from bootprint.topics import FRAMES, VERSION

COMMAND_POST: Final = "command_post"

_SAYING: Final = ("put", "delete", "declare_queryable", "reply", "liveliness_token")
_ASKING: Final = ("declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query")


def subtree(realm: str, member: Member) -> tuple[str, ...]:
    """The keys of one computer's own topics."""
    own = f"{realm}/{VERSION}/{member.unit}/{member.id}"
    return f"{own}/**", f"{own}/**/@adv/**"


def access_control(realm: Realm, host: Member, register: Register, local: Sequence[str]) -> dict[str, Any]:
    """Zenoh's ``access_control`` for the router of ``host``; ``local``: protocols that only it can reach us by."""
    rules, subjects, policies = [], [], []
    for member in realm.roster:
        certificate = register.of(member.id)
        is_host = member.id == host.id
        who = _subjects(member.id, certificate.name if certificate else None, local if is_host else ())
        if not who:
            continue
        may = _rules(realm, member, host)
        rules += may
        subjects += who
        policies.append({"rules": [rule["id"] for rule in may], "subjects": [each["id"] for each in who]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _subjects(soldier: str, name: str | None, local: Sequence[str]) -> list[dict[str, Any]]:
    """Who counts as a soldier's computer: its certificate, and for the host whoever is on it."""
    certified = [] if name is None else [{"id": soldier, "cert_common_names": [name]}]
    return [*certified, *([{"id": f"{soldier} here", "link_protocols": list(local)}] if local else [])]


def _rules(realm: Realm, member: Member, host: Member) -> list[dict[str, Any]]:
    """What a computer may say and ask for at a router, and what it may be told and asked for there."""
    own = (*subtree(realm.id, member), f"{realm.id}/{FRAMES}/*/{member.number}")
    readable = _readable(realm, member, host)
    return [
        _allow(member, "says", "ingress", _SAYING, own),
        _allow(member, "is asked", "egress", _ASKING, _asked(realm, member, host)),
        _allow(member, "asks", "ingress", _ASKING, readable),
        _allow(member, "is told", "egress", _SAYING, readable),
    ]


def _asked(realm: Realm, member: Member, host: Member) -> tuple[str, ...]:
    """What a computer may be told that others listen to: it sends nothing that it thinks nobody wants.

    Selectors are often wider than what is its to say. Other posts' routers would refuse those, and report it.
    """
    frames = f"{realm.id}/{FRAMES}/**"
    if member.role == COMMAND_POST and member.id != host.id:
        return *subtree(realm.id, member), frames
    return *_everything(realm), frames


def _everything(realm: Realm) -> tuple[str, ...]:
    every = f"{realm.id}/{VERSION}/**"
    return every, f"{every}/@adv/**"


def _readable(realm: Realm, member: Member, host: Member) -> tuple[str, ...]:
    frames = f"{realm.id}/{FRAMES}/**"
    if member.id == host.id:
        return *_everything(realm), frames
    hosts = subtree(realm.id, host) if member.role == COMMAND_POST else ()
    return *subtree(realm.id, member), *hosts, frames


def _allow(
    member: Member, what: str, flow: str, messages: Sequence[str], keys: Sequence[str]
) -> dict[str, Any]:
    return {
        "id": f"{member.id} {what}",
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": list(keys),
    }
