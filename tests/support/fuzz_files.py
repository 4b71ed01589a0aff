"""Fuzz of what reads files and requests: recordings, configuration, scenarios, bundles, state, maps, the page."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import NoneType
from typing import Any, Final

from bootprint.bus import Envelope
from bootprint.config import Origin, load_computer
from bootprint.errors import BootprintError
from bootprint.keys.bundle import open_bundle
from bootprint.messages import Pressure
from bootprint.recording import Recorder, Recording
from bootprint.rooms import RoomMap
from bootprint.rooms_geojson import geojson, read_geojson
from bootprint.saved_state import Form, Kept, StateError, StateFile
from bootprint.topics import Identity
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from proving_ground.scenario import load_scenario
from proving_ground.scenario.loading import STARTER
from sa_hub.history.archive import Archive
from sa_hub.page.endpoints import ENDPOINTS, ROOT
from sa_hub.page.past import Moment
from sa_hub.settings import HubSettings, check_settings
from sensor_gateway.recordings import load_runs
from sensor_gateway.settings import GatewaySettings
from support.fuzz_target import Feed, Target, refusing
from support.hub_squad import START_NS
from support.page_post import PostAir, browser, walked
from support.sensor_device import UTC_NS

_DATA: Final = Path(__file__).parents[1] / "data"
_SHORT_WALK: Final = _DATA / "short-walk"
_COMPOSE: Final = Path(__file__).parents[2] / "deploy" / "compose"


def _mcap_seeds(folder: Path) -> list[bytes]:
    path = folder / "whole.mcap"
    with Recorder(path, overwrite=True) as recorder:
        for sequence in range(6):
            message = Pressure(time_ns=UTC_NS + sequence, sequence=sequence, pressure_pa=1e5)
            recorder.write(Envelope(Identity("bp", "alpha", "a3").address("pressure", "body"), message))
            if sequence == 3:
                recorder.flush()
    return [path.read_bytes()]


def _mcap(folder: Path) -> Feed:
    path = folder / "fuzzed.mcap"

    def feed(data: bytes) -> str:
        path.write_bytes(data)
        recording = Recording(path, salvage=True)
        return f"{len(list(recording.envelopes()))} messages"

    return refusing(feed, BootprintError)


def _run_seeds(name: str) -> Callable[[Path], list[bytes]]:
    return lambda _: [b"\n".join((_SHORT_WALK / name).read_bytes().splitlines()[:40]) + b"\n"]


def _run(name: str) -> Callable[[Path], Feed]:
    """A run folder of which one file is fuzzed, and the others are sound."""

    def open_in(folder: Path) -> Feed:
        run = folder / f"run-{name}"
        run.mkdir(exist_ok=True)
        for other in ("left_foot.csv", "right_foot.csv", "truth.csv", "gnss.csv", "run.toml"):
            (run / other).write_bytes(_run_seeds(other)(folder)[0])

        def feed(data: bytes) -> str:
            (run / name).write_bytes(data)
            (found,) = load_runs([run])
            fixes = 0 if found.gnss is None else len(found.gnss.time_s)
            return f"{sorted(found.imus)}, truth of {sorted(found.truth)}, {fixes} fixes"

        return refusing(feed, BootprintError)

    return open_in


_BODIES: Final[dict[str, dict[str, Any]]] = {
    "/alerts": {"kind": "help", "text": "stairs"},
    "/observations": {
        "latitude_deg": 59.35,
        "longitude_deg": 18.07,
        "text": "two vehicles",
        "code": "vehicle",
    },
    "/sightings": {"soldier": "a1", "azimuth_deg": 90.0, "range_m": 40.0, "text": "door"},
    "/status": {"condition": "ok"},
    "/fixes": {"soldier": "a1", "latitude_deg": 59.35, "longitude_deg": 18.07, "accuracy_m": 3.0},
    "/alerts/{id}/acknowledgement": {},
}
_BEGIN_S: Final = START_NS // 1_000_000_000


def _http_seeds(_: Path) -> list[bytes]:
    """``METHOD path``, a line end, the body; ``{id}`` is an alert's that there is."""
    during = {Moment: f"?time_s={_BEGIN_S + 5}", NoneType: ""}
    span = f"?begin_s={_BEGIN_S}&end_s={_BEGIN_S + 60}"
    asked = [
        f"GET {ROOT}{each.path}{during.get(each.query or NoneType, span)}\n".encode()
        for each in ENDPOINTS
        if each.method == "GET"
    ]
    said = [f"POST {ROOT}{path}\n{json.dumps(body)}".encode() for path, body in _BODIES.items()]
    return asked + said


def _http(folder: Path) -> Feed:
    """Requests to the page's real application; its own exceptions come through the client."""
    air = walked(PostAir(folder, Archive(f"sqlite:///{folder / 'history.db'}")))
    client = browser(air, changes_per_s=1e6, reads_per_s=1e6).__enter__()
    alert = client.post(f"{ROOT}/alerts", json=_BODIES["/alerts"]).json()["id"]

    def feed(data: bytes) -> str:
        head, _, body = data.partition(b"\n")
        method, _, target = head.decode("latin-1").partition(" ")
        if not (method.isalpha() and method.isascii() and target.startswith("/") and target.isprintable()):
            return "no request"
        headers = {"content-type": "application/json"}
        path = "/" + target.lstrip("/").replace("{id}", alert)
        answer = client.request(method, path, content=body, headers=headers)
        if answer.status_code >= 500:
            raise AssertionError(f"{answer.status_code}: {answer.text}")
        return str(answer.status_code)

    return feed


def _config_seeds(_: Path) -> list[bytes]:
    return [path.read_bytes() for path in sorted(_COMPOSE.glob("*.toml")) if path.name != "realm.toml"]


_SECTIONS: Final[dict[str, Any]] = {
    "gateway": GatewaySettings,
    "pdr": PdrConfig,
    "fusion": FusionConfig,
    "hub": HubSettings,
}


def _config(folder: Path) -> Feed:
    path = folder / "computer.toml"
    (folder / "realm.toml").write_bytes((_COMPOSE / "realm.toml").read_bytes())

    def feed(data: bytes) -> str:
        path.write_bytes(data)
        computer = load_computer(path)
        sections = {name: computer.section(name, type_) for name, type_ in _SECTIONS.items()}
        check_settings(sections["hub"], "[hub]")
        return "taken"

    return refusing(feed, BootprintError)


def _scenario_seeds(_: Path) -> list[bytes]:
    library = ("straight-49m", "building-clearing", "stairs-and-lift")
    return [STARTER.read_bytes(), *(load_scenario(name).path.read_bytes() for name in library)]


def _scenario(folder: Path) -> Feed:
    path = folder / "scenario.toml"

    def feed(data: bytes) -> str:
        path.write_bytes(data)
        return f"{len(load_scenario(path).cast.soldiers)} soldiers"

    return refusing(feed, BootprintError)


_CODE: Final = "A" * 26


def _bundle_seeds(_: Path) -> list[bytes]:
    """Of `bootprint keys pack`, once: each packing draws keys of its own, and no seed would give the same again."""
    return [(_DATA / "fuzz-bundle.bin").read_bytes()]


def _bundle(_: Path) -> Feed:
    return refusing(lambda data: open_bundle(data, _CODE, "bundle").soldier, BootprintError)


_FORM: Final = Form("walk", 3, 1000)


def _state_seeds(folder: Path) -> list[bytes]:
    path = folder / "sound"
    file = StateFile(path, _FORM)
    for number in range(3):
        file.save(Kept(number, b"walk" * 50))
    file.close()
    return [path.read_bytes()]


def _state(folder: Path) -> Feed:
    path = folder / "state"

    def feed(data: bytes) -> str:
        path.write_bytes(data)
        kept = StateFile(path, _FORM).load()
        if kept is not None and kept.payload != b"walk" * 50:
            raise AssertionError("damage was taken for state")
        return "nothing" if kept is None else "taken"

    return refusing(feed, StateError)


_HOUSE: Final = Origin(latitude_deg=58.4, longitude_deg=15.6, height_m=80.0)


def _rooms_seeds(_: Path) -> list[bytes]:
    runs = ((0, 3, -2, 7, "walked", 0.5), (0, 4, -2, 3, "wall", 0.5), (1, 0, 0, 1, "seen", 1.0))
    rooms = RoomMap(time_ns=5, soldier="a1", cell_m=0.5, levels=((0, 0.0), (1, 2.8)), runs=runs)
    return [json.dumps(geojson(rooms, _HOUSE)).encode()]


def _rooms(_: Path) -> Feed:
    return refusing(lambda data: f"{len(read_geojson(data, _HOUSE).runs)} runs", ValueError)


_WHOLE_RUN: Final = r"\['left_foot', 'right_foot'\], truth of \['\w+'\], [1-9]\d* fixes"


def file_targets() -> Iterator[Target]:
    """All of them."""
    yield Target("mcap", _mcap_seeds, _mcap, "6 messages")
    for name in ("left_foot.csv", "gnss.csv", "truth.csv", "run.toml"):
        yield Target(f"run-{name.split('.')[0]}", _run_seeds(name), _run(name), _WHOLE_RUN)
    yield Target("http", _http_seeds, _http, "200")
    yield Target("config", _config_seeds, _config, "taken")
    yield Target("scenario", _scenario_seeds, _scenario, r"[1-9]\d* soldiers")
    yield Target("bundle", _bundle_seeds, _bundle, "a3")
    yield Target("saved-state", _state_seeds, _state, "taken")
    yield Target("rooms", _rooms_seeds, _rooms, "3 runs")
