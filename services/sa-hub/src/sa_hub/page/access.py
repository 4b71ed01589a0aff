"""Who may do what on the page: roles by token, sessions by cookie, no changes from other sites, no floods.

On loopback nobody needs a token; the Host header must then name this computer, since a foreign site could else
point its own name at it (DNS rebinding).
"""

import hashlib
import hmac
import secrets
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from sa_hub.page.settings import ROLES, PageSettings, Role, Token, is_loopback

COOKIE: Final = "bootprint_session"
SESSION_S: Final = 12 * 3600.0
_MOST_SESSIONS: Final = 256
_MOST_BUCKETS: Final = 4096
_BURST_S: Final = 4.0


@dataclass(frozen=True, slots=True)
class Principal:
    """Who asks, by name, and their role."""

    name: str
    role: Role

    def may(self, role: Role) -> bool:
        """Whether they may do what needs this role."""
        return ROLES.index(self.role) >= ROLES.index(role)


class Access:
    """Tells who somebody is; ``now_s`` is any steady clock."""

    def __init__(self, settings: PageSettings) -> None:
        self._local = settings.is_local and not settings.tokens
        self._loopback = settings.is_local
        self._tokens = settings.tokens
        self._sessions: OrderedDict[str, tuple[Principal, float]] = OrderedDict()

    def host_is_ours(self, host: str) -> bool:
        """Whether a Host header can be of a page that is served on loopback; elsewhere tokens decide."""
        return not self._loopback or is_loopback(urlsplit(f"//{host}").hostname or "")

    @staticmethod
    def origin_is_ours(origin: str | None, host: str) -> bool:
        """Whether a request comes from our own page, or from no page at all."""
        return origin is None or urlsplit(origin).netloc == host

    def who(self, bearer: str | None, session: str | None, now_s: float) -> Principal | None:
        """Whose token or session this is; on loopback without tokens everybody is the operator at this computer."""
        if self._local:
            return Principal("local", "admin")
        if bearer is not None:
            return self._by_token(bearer)
        principal, until_s = self._sessions.get(session or "", (None, 0.0))
        return principal if now_s < until_s else None

    def open_session(self, token: str, now_s: float) -> tuple[str, Principal] | None:
        """A session for a browser that shows this token once."""
        principal = self._by_token(token)
        if principal is None:
            return None
        session = secrets.token_urlsafe(32)
        self._sessions[session] = (principal, now_s + SESSION_S)
        if len(self._sessions) > _MOST_SESSIONS:
            self._sessions.popitem(last=False)
        return session, principal

    def close_session(self, session: str | None) -> None:
        """Forget a session."""
        self._sessions.pop(session or "", None)

    def _by_token(self, token: str) -> Principal | None:
        digest = digest_of(token)
        for known in self._tokens:
            if hmac.compare_digest(known.sha256, digest):
                return Principal(known.name, known.role)
        return None


class Rates:
    """A token bucket for each of many keys: ``per_s`` in the long run, four seconds' worth at once."""

    def __init__(self, per_s: float) -> None:
        self._per_s = per_s
        self._depth = max(1.0, _BURST_S * per_s)
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def allows(self, key: str, now_s: float) -> bool:
        """Whether one more is within the rate; counts it if so."""
        left, since_s = self._left.get(key, (self._depth, now_s))
        left = min(self._depth, left + self._per_s * (now_s - since_s))
        allowed = left >= 1.0
        self._left[key] = (left - allowed, now_s)
        self._left.move_to_end(key)
        if len(self._left) > _MOST_BUCKETS:
            self._left.popitem(last=False)
        return allowed


def digest_of(token: str) -> str:
    """What the configuration knows of a token; tokens are 256 random bits, so no salt is needed."""
    return hashlib.sha256(token.encode()).hexdigest()


def new_token(name: str, role: Role) -> tuple[str, Token]:
    """A new token and the line of the configuration that knows it."""
    token = secrets.token_urlsafe(32)
    return token, Token(name=name, role=role, sha256=digest_of(token))
