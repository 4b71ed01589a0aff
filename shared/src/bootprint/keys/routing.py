"""A computer's guarded router: where it listens, what it joins, and whom it lets do what."""

from typing import Any, Final

from bootprint.config import Computer
from bootprint.keys.access import access_control
from bootprint.keys.certificates import certificate_of
from bootprint.keys.credentials import stays_here
from bootprint.keys.findings import check_belongs
from bootprint.keys.register import Register, load_register
from bootprint.keys.secret_files import read_secret
from bootprint.zenoh_config import router_settings

_ANYWHERE: Final = ("0.0.0.0", "[::]")


def guarded_settings(computer: Computer) -> dict[str, Any]:
    """Zenoh's configuration of the router; ConfigError if certificate or register are not as they should be."""
    computer.credentials.check()
    local = ("tcp", "unixsock-stream") if stays_here(computer.router) else ()
    return router_settings(
        listening(computer),
        computer.bus.connect,
        computer.credentials,
        access_control(computer.realm, computer.member, load_own_register(computer), local),
    )


def load_own_register(computer: Computer) -> Register:
    """The register on this computer; ConfigError if it is not its authority's, or another realm's."""
    path = computer.credentials.authority
    data = read_secret(path, "authority's certificate", "`bootprint keys unpack` brings it")
    register = load_register(computer.keys_dir, certificate_of(data, str(path)))
    check_belongs(register, computer)
    return register


def listening(computer: Computer) -> list[str]:
    """Where the router listens: for others as ``[bus]`` says, and where its own services look for it."""
    others = list(computer.bus.listen)
    return others if _is_covered(computer.router, others) else [computer.router, *others]


def _is_covered(router: str, others: list[str]) -> bool:
    """Whether the services' address is reached through another that we listen at: any host, the same port."""
    kind, _, place = router.partition("/")
    port = place.rpartition(":")[2]
    return any(f"{kind}/{anywhere}:{port}" in others for anywhere in _ANYWHERE)
