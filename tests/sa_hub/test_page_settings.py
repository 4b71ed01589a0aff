"""Who can reach the page: what the configuration may say, and what it is told when it may not."""

from pathlib import Path
from typing import Any

import pytest

from bootprint.config import convert
from bootprint.errors import ConfigError
from sa_hub.page.access import Access, Rates, new_token
from sa_hub.page.settings import PageSettings, check_page, is_loopback

_TOKEN = {"name": "eye", "role": "view", "sha256": "0" * 64}


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"host": "0.0.0.0"}, "can be reached by others"),
        ({"host": "192.0.2.1", "tokens": [_TOKEN]}, "can be reached by others"),
        ({"tls_certificate": "cert.pem"}, "belong together"),
        ({"plan": "nowhere.geojson"}, "no such file"),
    ],
)
def test_what_would_open_the_page_or_is_missing_is_refused(
    tmp_path: Path, values: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        check_page(convert(values, PageSettings, "page"), tmp_path, "page")


@pytest.mark.parametrize("values", [{"role": "root"}, {"sha256": "short"}, {"token": "plain"}])
def test_tokens_are_digests_with_a_role(values: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        convert({"tokens": [_TOKEN | values]}, PageSettings, "page")


@pytest.mark.parametrize(
    ("host", "expected"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("10.0.0.1", False), ("pi", False)],
)
def test_loopback_is_told_by_the_address(host: str, expected: bool) -> None:
    assert is_loopback(host) is expected


def test_sessions_end_with_their_time_and_roles_rise() -> None:
    token, known = new_token("eye", "operate")
    access = Access(PageSettings(tokens=(known,)))
    opened = access.open_session(token, 0.0)
    assert opened is not None
    session, principal = opened
    assert (principal.may("view"), principal.may("operate"), principal.may("admin")) == (True, True, False)
    assert access.who(None, session, 12 * 3600.0 - 1.0) == principal
    assert access.who(None, session, 12 * 3600.0 + 1.0) is None
    assert access.open_session("guess", 0.0) is None


def test_a_rate_holds_in_the_long_run_for_each_alone() -> None:
    rates = Rates(2.0)
    taken = sum(rates.allows("one", tick / 100.0) for tick in range(1000))
    assert 2.0 * 10.0 <= taken <= 2.0 * 10.0 + 8.0
    assert rates.allows("other", 10.0)
