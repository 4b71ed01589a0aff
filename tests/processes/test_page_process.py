"""The page of a real sa-hub process: over loopback, over TLS with a token, and refused where it would be open."""

import datetime
import ipaddress
import json
import socket
import ssl
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.page.access import new_token
from support.hub_processes import CP, running, write_computer, write_realm
from support.waiting import wait_until

pytestmark = pytest.mark.processes
LINK = 'bind = "127.0.0.1:0"\npeers = ["127.0.0.1:9"]\nrate_bits_per_s = 9600'


def page_port() -> int:
    return free_ports(1, socket.SOCK_STREAM)[0]


def ask(url: str, context: ssl.SSLContext | None = None, **headers: str) -> Any:
    request = urllib.request.Request(url, headers=headers)
    with urllib.request.urlopen(request, timeout=30.0, context=context) as answer:
        return json.load(answer)


def test_page_of_a_hub_tells_of_its_health_and_is_told_of_in_it(tmp_path: Path) -> None:
    write_realm(tmp_path)
    port = page_port()
    config = write_computer(
        tmp_path, "cp", f'role = "command_post"\n[hub.history]\n[hub.page]\nport = {port}', LINK
    )
    with running(config, CP) as hub:
        root = f"http://127.0.0.1:{port}/api/v1"
        assert ask(f"{root}/post")["has_history"] is True
        wait_until(lambda: ask(f"{root}/picture")["health"], what="health on the page")
        assert ask(f"{root}/picture")["health"]["cp/sa-hub"]["state"] in ("ok", "degraded")
        wait_until(lambda: hub.health, what="the hub's health")
        assert hub.health[-1].counters["page_dropped"] == 0
        wait_until(lambda: ask(f"{root}/history")["end_s"], what="history")


def test_page_of_a_hub_that_was_started_again_shows_the_alerts_of_before(tmp_path: Path) -> None:
    write_realm(tmp_path)
    port = page_port()
    page = f'role = "command_post"\n[hub.history]\n[hub.page]\nport = {port}'
    config = write_computer(tmp_path, "cp", page, LINK)
    root = f"http://127.0.0.1:{port}/api/v1"
    with running(config, CP):
        seen = order(f"{root}/alerts", {"kind": "fire"})
        order(f"{root}/alerts", {"kind": "help"})
        order(f"{root}/alerts/{seen['id']}/acknowledgement", {})
    with running(config, CP):
        alerts = ask(f"{root}/picture")["alerts"].values()
    assert {each["kind"]: each["acknowledged_by"] for each in alerts} == {"fire": "local", "help": None}


def order(url: str, asked: dict[str, str]) -> Any:
    """Post it as the page does, as soon as there are a page and what it is about."""
    answers: list[Any] = []

    def is_answered() -> bool:
        request = urllib.request.Request(
            url, json.dumps(asked).encode(), {"content-type": "application/json"}
        )
        try:
            with urllib.request.urlopen(request, timeout=30.0) as answer:
                answers.append(json.load(answer))
        except urllib.error.HTTPError as refused:
            refused.close()
            return False
        except urllib.error.URLError:
            return False
        return True

    wait_until(is_answered, what=url)
    return answers[-1]


def test_page_for_others_takes_tls_and_a_token(tmp_path: Path) -> None:
    write_realm(tmp_path)
    port = page_port()
    token, known = new_token("eye", "view")
    page = (
        f'role = "command_post"\n[hub.page]\nhost = "0.0.0.0"\nport = {port}\n'
        'tls_certificate = "cert.pem"\ntls_key = "key.pem"\n'
        f'tokens = [{{ name = "eye", role = "view", sha256 = "{known.sha256}" }}]'
    )
    config = write_computer(tmp_path, "cp", page, LINK)
    certificate = write_certificate(config.parent)
    with running(config, CP):
        url = f"https://127.0.0.1:{port}/api/v1/post"
        context = ssl.create_default_context(cafile=certificate)
        with pytest.raises(urllib.error.HTTPError) as refused:
            ask(url, context)
        assert refused.value.code == 401
        refused.value.close()
        assert ask(url, context, Authorization=f"Bearer {token}")["who"] == "eye"


def test_page_that_would_be_open_to_all_is_refused_in_one_line(tmp_path: Path) -> None:
    write_realm(tmp_path)
    config = write_computer(tmp_path, "cp", 'role = "command_post"\n[hub.page]\nhost = "0.0.0.0"', LINK)
    code = "from sa_hub.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "--config", str(config)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert "can be reached by others" in line


def write_certificate(folder: Path) -> Path:
    """A certificate for this computer that vouches for itself, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "command post")])
    now = datetime.datetime.now(datetime.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + datetime.timedelta(hours=1))
        .add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), critical=False
        )
        .sign(key, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    (folder / "cert.pem").write_bytes(certificate.public_bytes(pem))
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    (folder / "key.pem").write_bytes(secret)
    return folder / "cert.pem"
