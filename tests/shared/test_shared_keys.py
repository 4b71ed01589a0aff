"""The realm's authority, its register, bundles and what they refuse; and that no secret is ever told."""

import json
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import typer
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID
from typer.testing import CliRunner

from bootprint.commands import keys as commands
from bootprint.config import load_computer
from bootprint.errors import ConfigError
from bootprint.findings import Finding
from bootprint.keys.authority import Authority, create_authority, open_authority
from bootprint.keys.bundle import Content, install, new_code, open_bundle, pack
from bootprint.keys.credentials import is_secure, stays_here
from bootprint.keys.findings import key_findings
from bootprint.keys.register import REGISTER, load_register
from bootprint.keys.routing import listening
from bootprint.keys.secret_files import create_secret, next_path
from support.guarded import make_authority, make_computer

NOW = datetime(2026, 12, 1, 6, tzinfo=UTC)
TLS = 'router = "tls/127.0.0.1:7447"\n'


def certificate(path: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate(path.read_bytes())


def test_a_certificate_is_its_computers_and_nothing_more(tmp_path: Path) -> None:
    made = create_authority(tmp_path, "bp", 100, NOW).issue("a3", ("10.1.0.3", "post.example"), 50, NOW)
    found = certificate(tmp_path / "computers" / "a3.1.crt")
    assert [str(each.value) for each in found.subject] == ["a3.1"]
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "post.example"]
    assert [str(each) for each in names.get_values_for_type(x509.IPAddress)] == ["127.0.0.1", "10.1.0.3"]
    assert not found.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    assert set(found.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value) == {
        ExtendedKeyUsageOID.CLIENT_AUTH,
        ExtendedKeyUsageOID.SERVER_AUTH,
    }
    assert found.not_valid_after_utc == NOW + timedelta(days=50)
    found.verify_directly_issued_by(made.certificate)


def test_everything_is_for_its_owner_only_and_nothing_is_overwritten(tmp_path: Path) -> None:
    made = create_authority(tmp_path, "bp", 100, NOW).issue("a3", (), 50, NOW)
    modes = {stat.S_IMODE(path.stat().st_mode) for path in tmp_path.rglob("*") if path.is_file()}
    assert modes == {0o600}
    with pytest.raises(ConfigError, match=r"ca\.key: exists already; a key is never overwritten"):
        create_authority(tmp_path, "bp", 100, NOW)
    (tmp_path / "computers" / "a3.2.key").write_bytes(b"something else")
    with pytest.raises(ConfigError, match="never overwritten"):
        made.issue("a3", (), 50, NOW)


def test_a_new_certificate_takes_the_old_ones_place(tmp_path: Path) -> None:
    made = create_authority(tmp_path, "bp", 100, NOW).issue("a3", (), 50, NOW).issue("a4", (), 50, NOW)
    again = made.issue("a3", (), 50, NOW).revoke("a4", NOW)
    assert [each.name for each in again.register.valid] == ["a3.2"]
    assert [each.name for each in again.register.revoked] == ["a3.1", "a4.1"]
    assert open_authority(tmp_path).register == again.register
    # Who was revoked comes back under a name of its own.
    assert [each.name for each in again.issue("a4", (), 50, NOW).register.valid] == ["a3.2", "a4.2"]
    with pytest.raises(ConfigError, match="'a9' has no certificate to revoke"):
        again.revoke("a9", NOW)


def test_no_certificate_outlives_its_authority(tmp_path: Path) -> None:
    made = create_authority(tmp_path, "bp", 100, NOW)
    with pytest.raises(ConfigError, match="--days 101: the authority itself ends in 100 days"):
        made.issue("a3", (), 101, NOW)
    with pytest.raises(ConfigError, match="neither an address nor a host's name"):
        made.issue("a3", ("münchen",), 5, NOW)
    with pytest.raises(ConfigError, match="cannot be a certificate's name"):
        made.issue("a" * 64, (), 5, NOW)


def test_a_register_that_somebody_else_wrote_is_refused(tmp_path: Path) -> None:
    made = create_authority(tmp_path / "one", "bp", 100, NOW).issue("a3", (), 50, NOW)
    path = tmp_path / "one" / REGISTER
    good = path.read_bytes()
    path.write_bytes(good.replace(b'"a3.1"', b'"a4.1"'))
    with pytest.raises(ConfigError, match="is not signed by this realm's authority"):
        open_authority(tmp_path / "one")
    other = create_authority(tmp_path / "two", "bp", 100, NOW)
    path.write_bytes((tmp_path / "two" / REGISTER).read_bytes())
    with pytest.raises(ConfigError, match="is not signed"):
        load_register(tmp_path / "one", made.certificate)
    assert load_register(tmp_path / "one", other.certificate) == other.register
    for damaged in (b"", b"{}", good[:-20], b'{"register": {}, "signature": "zz"}'):
        path.write_bytes(damaged)
        with pytest.raises(ConfigError, match=r"register\.json"):
            load_register(tmp_path / "one", made.certificate)


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return make_authority(tmp_path, "a5")


def test_a_bundle_opens_with_its_own_code_alone_and_shows_nothing_else(authority: Authority) -> None:
    code = new_code()
    sealed = pack(authority, "a3", {"keys/group.key": b"very secret"}, code)
    content = open_bundle(sealed, f" {code.upper()} ".replace("-", " ").strip(), "b")
    assert (content.soldier, content.realm, content.number) == ("a3", "bp", authority.register.number)
    assert content.files["keys/group.key"] == b"very secret"
    private = (authority.folder / "computers" / "a3.1.key").read_bytes()
    assert content.files["keys/computer.key"] == private
    for secret in (b"very secret", private[40:60], b"a3"):
        assert secret not in sealed
    with pytest.raises(ConfigError, match="does not open"):
        open_bundle(sealed, new_code(), "b")
    with pytest.raises(ConfigError, match="want 26 letters and digits"):
        open_bundle(sealed, "password", "b")
    with pytest.raises(ConfigError, match="is no bundle"):
        open_bundle(b"PK" + sealed, code, "b")


def test_a_bundle_with_any_byte_changed_is_refused(authority: Authority) -> None:
    code = new_code()
    sealed = pack(authority, "a3", {}, code)
    for place in range(0, len(sealed), max(1, len(sealed) // 60)):
        damaged = bytearray(sealed)
        damaged[place] ^= 0x40
        with pytest.raises(ConfigError):
            open_bundle(bytes(damaged), code, "b")


def test_a_bundle_cannot_write_anywhere_else(authority: Authority) -> None:
    code = new_code()
    for name in ("../group.key", "keys/../../x", "/etc/passwd", "keys/.hidden", "run.sh", "keys/a\n"):
        with pytest.raises(ConfigError, match="which is no file of a computer"):
            open_bundle(pack(authority, "a3", {name: b""}, code), code, "b")


def opened(authority: Authority, soldier: str, others: dict[str, bytes]) -> Content:
    code = new_code()
    return open_bundle(pack(authority, soldier, others, code), code, "b")


def test_an_update_is_this_computers_newer_one(authority: Authority, tmp_path: Path) -> None:
    home = tmp_path / "home"
    old = opened(authority, "a3", {"keys/group.key": b"1", "keys/group.next.key": b"2"})
    install(old, home, "b", update=False)
    with pytest.raises(ConfigError, match="exists already; --update"):
        install(old, home, "b", update=False)
    newer = authority.issue("a3", (), 5, datetime.now(UTC))
    install(opened(newer, "a3", {"keys/group.key": b"2"}), home, "b", update=True)
    assert [str(each.value) for each in certificate(home / "keys" / "computer.crt").subject] == ["a3.2"]
    assert (home / "keys" / "group.key").read_bytes() == b"2"
    # A roll-over that is over leaves no key behind that would take over again.
    assert not next_path(home / "keys" / "group.key").exists()
    with pytest.raises(ConfigError, match="is older"):
        install(old, home, "b", update=True)
    with pytest.raises(ConfigError, match="is a4's, this computer is a3's"):
        install(opened(newer, "a4", {}), home, "b", update=True)
    stranger = create_authority(tmp_path / "stranger", "bp", 9, datetime.now(UTC))
    with pytest.raises(ConfigError, match="is another authority's"):
        install(opened(stranger.issue("a3", (), 5, datetime.now(UTC)), "a3", {}), home, "b", update=True)


def levels(findings: list[Finding]) -> dict[str, str]:
    return {each.subject: each.level for each in findings}


def test_findings_tell_what_ends_soon_what_is_over_and_who_is_revoked(authority: Authority) -> None:
    a3 = make_computer(authority, "a3", TLS)
    now = datetime.now(UTC)
    # The certificate holds 20 days, its authority 30.
    assert levels(list(key_findings(a3, now))) == {
        "certificate": "warning",
        "authority": "warning",
        "register": "ok",
    }
    late = list(key_findings(a3, now + timedelta(days=21)))
    assert [each.level for each in late] == ["fault"]
    assert "ended" in late[0].what
    assert "keys issue" in late[0].mend
    early = list(key_findings(a3, now - timedelta(days=400)))
    assert "is this computer's clock right?" in early[0].what
    again = authority.issue("a3", (), 20, now)
    a3_register = a3.keys_dir / REGISTER
    a3_register.write_bytes((again.folder / REGISTER).read_bytes())
    revoked = {each.subject: each for each in key_findings(a3, now)}
    assert "a3.1 is revoked" in revoked["register"].what
    (a3.keys_dir / "computer.key").chmod(0o640)
    assert "others may read this key" in next(iter(key_findings(a3, now))).what
    (a3.keys_dir / "computer.key").unlink()
    assert "no key there" in next(iter(key_findings(a3, now))).what


def test_a_bus_that_stays_on_its_computer_needs_no_certificate(authority: Authority) -> None:
    a3 = make_computer(authority, "a3")
    assert not a3.is_guarded
    assert levels(list(key_findings(a3, datetime.now(UTC)))) == {"certificate": "ok"}


@pytest.mark.parametrize(
    ("lines", "error"),
    [
        ('[bus]\nlisten = ["tcp/0.0.0.0:7447"]', "is open to everybody; want tls/HOST:PORT"),
        ('router = "tcp/10.1.0.3:7447"\n[bus]\nlisten = ["tls/0.0.0.0:7448"]', "makes \\[bus\\] useless"),
        ('[bus]\nlisen = ["tls/0.0.0.0:7448"]', "lisen"),
    ],
)
def test_an_open_door_beside_a_guarded_one_is_refused(authority: Authority, lines: str, error: str) -> None:
    with pytest.raises(ConfigError, match=error):
        make_computer(authority, "a3", lines)


@pytest.mark.parametrize(
    ("lines", "endpoints"),
    [
        ("", ["tcp/127.0.0.1:7447"]),
        (TLS, ["tls/127.0.0.1:7447"]),
        (TLS + '[bus]\nlisten = ["tls/10.1.0.3:7447"]', ["tls/127.0.0.1:7447", "tls/10.1.0.3:7447"]),
        (TLS + '[bus]\nlisten = ["tls/0.0.0.0:7447"]', ["tls/0.0.0.0:7447"]),
        ('[bus]\nlisten = ["tls/0.0.0.0:7447"]', ["tcp/127.0.0.1:7447", "tls/0.0.0.0:7447"]),
    ],
)
def test_a_router_listens_once_at_each_place(authority: Authority, lines: str, endpoints: list[str]) -> None:
    assert listening(make_computer(authority, "a3", lines)) == endpoints


def test_what_is_secure_and_what_stays_here() -> None:
    assert is_secure("tls/host:1")
    assert is_secure("quic/host:1")
    assert not is_secure("tcp/127.0.0.1:1")
    assert stays_here("tcp/localhost:7447")
    assert stays_here("unixsock-stream//run/bus")
    assert not stays_here("tcp/10.0.0.1:7447")
    assert not stays_here("tcp/localhost.example:7447")


# -- commands -------------------------------------------------------------------------------------------------


def run(*arguments: object) -> str:
    app = typer.Typer(pretty_exceptions_enable=False)
    commands.register(app)
    result = CliRunner().invoke(app, ["keys", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_from_authority_to_computer_by_command_and_no_secret_is_told(tmp_path: Path) -> None:
    planner = make_authority(tmp_path / "made").folder.parent  # for a realm and a group key
    realm, key = planner / "realm.toml", planner / "group.key"
    (tmp_path / "a3").mkdir()
    config = tmp_path / "a3" / "computer.toml"
    config.write_text(f'realm = "realm.toml"\nsoldier = "a3"\n{TLS}[hub]\nrole = "soldier"\n')
    (tmp_path / "a3" / "realm.toml").write_text(realm.read_text())
    ca, code, bundle, home = (tmp_path / name for name in ("ca", "a3.code", "a3.bundle", "home"))

    told = run("authority", ca, "--realm", realm)
    told += run("issue", ca, "a3", "a4", "--host", "10.1.0.3")
    told += run("revoke", ca, "a4")
    told += run("pack", ca, "a3", "--out", bundle, "--code", code, "--config", config, "--group-key", key)
    told += run("unpack", bundle, "--code", code, "--to", home)
    told += run("show", home / "keys")
    told += run("check", home / "computer.toml")
    settings = run("router", home / "computer.toml")

    assert "a4.1" in told
    assert "revoked" in told
    rows = json.loads(run("show", ca, "--json", "-"))
    assert [(row["name"], row["state"]) for row in rows] == [("a3.1", "valid"), ("a4.1", "revoked")]
    assert (home / "keys" / "group.key").read_bytes() == key.read_bytes()
    subjects = json.loads(settings)["access_control"]["subjects"]
    assert [each["cert_common_names"] for each in subjects] == [["a3.1"]]
    secrets = [
        key.read_text().strip(),
        code.read_text().strip(),
        *(
            path.read_text().splitlines()[1]
            for path in tmp_path.rglob("*.key")
            if "BEGIN" in path.read_text()
        ),
    ]
    assert len(secrets) >= 5
    for secret in secrets:
        assert secret not in told + settings
    with pytest.raises(ConfigError, match=r"a3\.bundle: exists already"):
        run("pack", ca, "a3", "--out", bundle, "--code", code)


def test_a_bundle_takes_no_other_computers_configuration(authority: Authority, tmp_path: Path) -> None:
    config = tmp_path / "computer.toml"  # beside the realm
    code, out = tmp_path / "code", tmp_path / "out"
    for lines, error in (
        ('realm = "realm.toml"\nsoldier = "a4"', "is a4's, not a3's"),
        ('realm = "../realm.toml"\nsoldier = "a3"', "a bundle puts it where realm = 'realm.toml'"),
        ('realm = "realm.toml"\nsoldier = "a3"\nkeys_dir = "/keys"', "keys_dir = '/keys'"),
    ):
        config.write_text(lines)
        with pytest.raises(ConfigError, match=error):
            run("pack", authority.folder, "a3", "--out", out, "--code", code, "--config", config)


def test_a_code_that_others_may_read_is_not_used(authority: Authority, tmp_path: Path) -> None:
    code = tmp_path / "code"
    create_secret(code, new_code().encode())
    code.chmod(0o644)
    with pytest.raises(ConfigError, match="others may read this code"):
        run("pack", authority.folder, "a3", "--out", tmp_path / "out", "--code", code)


def test_a_computer_reads_its_own_files_after_unpacking(authority: Authority) -> None:
    computer = make_computer(authority, "a4", TLS)
    assert load_computer(computer.path).is_guarded
    computer.credentials.check()
