"""What a router's log says of attempts: lines as zenoh 1.10.2 writes them."""

import pytest

from bootprint.keys.guard import Attempt, Attempts, LogReader

WHO = "f4c508d421dd24fc2c7c9134836dcd3e"
SUBJECT = f"Interface(lo)+CertCommonName(a4.1)+Transport(Tls)+{WHO}"
DENIED = Attempt("denied", "a4.1", "put on bp/@v1/alpha/a3/position/x")


def line(
    text: str, module: str = "zenoh::net::routing::interceptor::access_control", thread: int = 9
) -> bytes:
    return (
        f"\x1b[2m2026-11-22T20:57:13.057325Z\x1b[0m \x1b[35mTRACE\x1b[0m rx-0 ThreadId({thread:02}) "
        f"\x1b[2m{module}\x1b[0m\x1b[2m:\x1b[0m {text}\n"
    ).encode()


def acl(verdict: str, what: str, key: str = "bp/@v1/alpha/a3/position/x", subject: str = SUBJECT) -> str:
    return f"{WHO} on {subject} is {verdict} to {what} on {key}"


def read(*lines: bytes) -> list[Attempt]:
    return LogReader(lambda session: "a5.1" if session == WHO else "").read(b"".join(lines))


def test_what_somebody_tried_is_an_attempt_and_what_was_allowed_or_kept_from_others_is_not() -> None:
    assert read(
        line(acl("authorized", "Put (ingress)")),
        line(acl("unauthorized", "Put (egress)")),
        line("Access control is enabled"),
        line(acl("unauthorized", "Put (ingress)")),
        line(acl("unauthorized", "Declare Subscriber (ingress)", "bp/@v1/**")),
    ) == [DENIED, Attempt("denied", "a4.1", "declare subscriber on bp/@v1/**")]


def test_looking_up_what_could_be_done_with_a_key_is_no_attempt() -> None:
    actions = ["Query", "Reply", "Put", "Delete", "A", "B", "C", "D", "E"]
    looked_up = [line(acl("unauthorized", f"{each} (ingress)")) for each in actions]
    caching = line("ACL (ingress): caching permissions for `bp/@v1/alpha/a3` ...")
    elsewhere = line(acl("unauthorized", "Put (ingress)"), thread=10)
    attempt = line(acl("unauthorized", "Put (ingress)"))
    assert read(caching, *looked_up, attempt) == [DENIED]
    assert read(caching, elsewhere, *looked_up) == [DENIED]


@pytest.mark.parametrize("module", ["zenoh_link_tls::unicast", "zenoh_link_quic::unicast"])
def test_refused_connections_tell_why(module: str) -> None:
    told = line("invalid peer certificate: UnknownIssuer. Hint: increase the system open file limit.", module)
    (attempt,) = read(told)
    assert attempt == Attempt("no_certificate", "", "invalid peer certificate: UnknownIssuer")
    assert "without a valid certificate was refused" in str(attempt)


def test_a_name_that_is_not_in_the_register_is_looked_up_by_its_session() -> None:
    text = "{} did not match any configured ACL subject. Default permission `Deny` will be applied"
    assert read(line(text.format(WHO))) == [Attempt("not_admitted", "a5.1", "")]
    assert read(line(text.format("00ff"))) == [Attempt("not_admitted", "somebody", "")]


def test_pieces_of_any_size_give_the_same_and_nothing_sent_steers_a_terminal() -> None:
    data = line(acl("unauthorized", "Put (ingress)")) + line(
        acl("unauthorized", "Put (ingress)", "bp/\x07\x9bm")
    )
    reader = LogReader(lambda _: "")
    found = [attempt for start in range(len(data)) for attempt in reader.read(data[start : start + 1])]
    assert found == read(data)
    assert found[0] == DENIED
    assert all(str(attempt).isprintable() for attempt in found)
    assert reader.read(b"x" * 100_000 + b"\n\n" + bytes(range(256)) * 50) == []


def test_a_process_on_the_computer_itself_has_no_name() -> None:
    (attempt,) = read(
        line(acl("unauthorized", "Put (ingress)", subject=f"Interface(lo)+Transport(Tcp)+{WHO}"))
    )
    assert attempt.who == "a process on this computer"


def test_a_flood_is_counted_told_for_a_minute_and_logged_once() -> None:
    attempts = Attempts()
    assert attempts.note([DENIED] * 5000, 100.0) == [DENIED]
    assert attempts.note([DENIED], 101.0) == []
    assert attempts.counts == {"denied": 5001}
    assert attempts.told(150.0).startswith("a4.1 was denied put on bp/@v1/alpha/a3/position/x (")
    assert attempts.told(162.0) == ""
    assert attempts.note([DENIED], 163.0) == [DENIED]
