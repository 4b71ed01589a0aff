"""Exports as others read them, the import of a recording, and what the commands say to people."""

import csv
import json
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime
from pathlib import Path

import pytest
import typer
from lxml import etree
from mcap.reader import make_reader
from typer.testing import CliRunner

from bootprint.bus import Envelope
from bootprint.errors import BootprintError, ConfigError, RecordingError
from bootprint.messages import Alert, Health, Observation, Status, Track
from bootprint.recording import Recorder, read_envelopes
from bootprint.topics import Identity
from sa_hub.exports.exporting import FORMATS, export, format_of
from sa_hub.exports.source import Source, utc
from sa_hub.history.archive import Archive
from sa_hub.history.commands import register

CP, A9 = Identity("bp", "hq", "cp"), Identity("bp", "alpha", "a9")
S = 1_000_000_000
T0 = 1_760_000_000 * S
GPX = {"g": "http://www.topografix.com/GPX/1/1", "b": "urn:bootprint:1"}
KML = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}


def track(soldier: str, at_s: float, **more: object) -> Envelope:
    fields = {"height_m": 40.0, "callsign": f"<{soldier}>", "mode": "boots", **more}
    message = Track(
        time_ns=T0 + round(at_s * S),
        soldier=soldier,
        number=1,
        state="fresh",
        latitude_deg=59.0 + at_s / 1e4,
        longitude_deg=18.0,
        accuracy_m=2.0,
        **fields,  # type: ignore[arg-type]
    )
    return Envelope(CP.address("track", soldier), message)


STORED = [
    *(track("a1", at_s) for at_s in (0, 10, 20)),
    *(track("a1", at_s, height_m=None, floor=2) for at_s in (500, 510)),
    track("a2", 5),
    Envelope(
        CP.address("alert", "a1"), Alert(time_ns=T0 + 15 * S, soldier="a1", kind="contact", text="=1+1")
    ),
    Envelope(
        CP.address("observation", "a2"),
        Observation(
            time_ns=T0 + 30 * S,
            soldier="a2",
            latitude_deg=59.5,
            longitude_deg=18.5,
            accuracy_m=5.0,
            code="drone",
            text="two & one",
        ),
    ),
    Envelope(CP.address("status", "a2"), Status(time_ns=T0 + 31 * S, soldier="a2", battery_pct=40.0)),
    Envelope(CP.address("health", "sa-hub"), Health(time_ns=T0, service="sa-hub", state="ok")),
]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """An archive."""
    path = tmp_path / "history.db"
    with closing(Archive(f"sqlite:///{path}")) as archive:
        archive.store(STORED)
    return path


@pytest.fixture
def archive(file: Path) -> Iterator[Archive]:
    with closing(Archive(f"sqlite:///{file}")) as opened:
        yield opened


def written(archive: Archive, path: Path, *soldiers: str, begin_s: float = -1, end_s: float = 1000) -> bytes:
    source = Source(archive, T0 + round(begin_s * S), T0 + round(end_s * S), soldiers)
    export(source, path, format_of(path, None))
    return path.read_bytes()


def test_gpx_has_tracks_in_segments_and_waypoints(archive: Archive, tmp_path: Path) -> None:
    root = etree.fromstring(written(archive, tmp_path / "a.gpx"))
    assert [child.tag.split("}")[1] for child in root] == ["wpt", "wpt", "trk", "trk"]
    assert root.xpath("g:trk/g:name/text()", namespaces=GPX) == ["<a1>", "<a2>"]
    assert [len(each) for each in root.xpath("g:trk[1]/g:trkseg", namespaces=GPX)] == [3, 2]
    point = root.xpath("g:trk[1]/g:trkseg[1]/g:trkpt[2]", namespaces=GPX)[0]
    assert (point.get("lat"), point.get("lon")) == ("59.0010000", "18.0000000")
    assert point.findtext("g:time", namespaces=GPX) == "2025-10-09T08:53:30Z"
    assert point.findtext("g:ele", namespaces=GPX) == "40.0"
    assert point.findtext("g:extensions/b:accuracy", namespaces=GPX) == "2.0"
    assert root.xpath("count(g:trk[1]/g:trkseg[2]/g:trkpt/g:ele)", namespaces=GPX) == 0
    assert root.xpath("g:wpt/g:name/text()", namespaces=GPX) == ["contact =1+1", "drone two & one"]
    assert root.xpath("string(g:wpt[1]/@lat)", namespaces=GPX) == "59.0010000"


def test_kml_has_as_many_times_as_places(archive: Archive, tmp_path: Path) -> None:
    root = etree.fromstring(written(archive, tmp_path / "a.kml"))
    tracks = root.xpath("//gx:Track", namespaces=KML)
    counts = [(len(each.findall("k:when", KML)), len(each.findall("gx:coord", KML))) for each in tracks]
    assert counts == [(3, 3), (2, 2), (1, 1)]
    assert root.xpath("//k:Point/k:coordinates/text()", namespaces=KML)[1] == "18.5000000,59.5000000"


def test_geojson_has_lines_with_times_and_points(archive: Archive, tmp_path: Path) -> None:
    collection = json.loads(written(archive, tmp_path / "a.geojson"))
    kinds = [feature["geometry"]["type"] for feature in collection["features"]]
    assert kinds == ["LineString", "LineString", "Point", "Point", "Point"]
    line = collection["features"][0]
    assert line["geometry"]["coordinates"][1] == [18.0, 59.001, 40.0]
    assert line["properties"]["coordTimes"][1] == "2025-10-09T08:53:30Z"
    assert collection["features"][1]["properties"]["floors"] == [2, 2]
    assert collection["features"][1]["geometry"]["coordinates"][0] == [18.0, 59.05]


def test_csv_has_a_row_for_each_event_in_order_and_no_formulas(archive: Archive, tmp_path: Path) -> None:
    rows = list(csv.DictReader(written(archive, tmp_path / "a.csv").decode().splitlines()))
    assert [row["subject"] for row in rows] == (
        ["track", "track", "track", "alert", "track", "observation", "status", "track", "track"]
    )
    assert rows[3]["text"] == "'=1+1"
    assert rows[0]["latitude_deg"] == "59.0"
    assert (rows[-1]["height_m"], rows[-1]["floor"], rows[-1]["code"]) == ("", "2", "")
    assert rows[5]["code"] == "drone"


def test_mcap_is_a_recording_that_foxglove_puts_on_its_map(archive: Archive, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(archive, path)
    assert {repr(each) for _, each in read_envelopes(path)} == {repr(each) for each in STORED}
    with path.open("rb") as file:
        found = [
            (schema.name, channel.topic, json.loads(message.data))
            for schema, channel, message in make_reader(file).iter_messages()
            if schema is not None and schema.name.startswith("foxglove.")
        ]
    fixes = [fix for name, topic, fix in found if topic == "bp/@v1/hq/cp/track/a1/location_fix"]
    assert [name for name, *_ in found].count("foxglove.LocationFix") == 6
    assert (fixes[0]["frame_id"], fixes[0]["latitude"], fixes[0]["altitude"]) == ("a1", 59.0, 40.0)
    assert fixes[0]["timestamp"] == {"sec": T0 // S, "nsec": 0}
    assert fixes[0]["position_covariance"] == [4.0, 0, 0, 0, 4.0, 0, 0, 0, 4.0]
    assert fixes[-1]["position_covariance"][8] == 1e6
    [(_, topic, marked)] = [each for each in found if each[0] == "foxglove.GeoJSON"]
    assert topic == "bp/@v1/hq/cp/observation/a2/geojson"
    assert json.loads(marked["geojson"])["geometry"]["coordinates"] == [18.5, 59.5]


@pytest.mark.parametrize("format_", FORMATS)
def test_only_the_wanted_soldiers_and_span_are_exported(
    archive: Archive, tmp_path: Path, format_: str
) -> None:
    text = written(archive, tmp_path / f"a.{format_}", "a2")
    assert b"a2" in text
    assert b"a1" not in text.replace(b"bootprint.a1", b"")
    if format_ in ("csv", "geojson"):
        early = written(archive, tmp_path / f"b.{format_}", begin_s=-1, end_s=8).decode()
        assert "2025-10-09T08:53:25Z" in early
        assert "2025-10-09T08:53:30Z" not in early


def test_times_are_written_to_the_microsecond() -> None:
    assert utc(T0) == "2025-10-09T08:53:20Z"
    assert utc(T0 + 120_000_000) == "2025-10-09T08:53:20.12Z"
    assert datetime.fromisoformat(utc(T0 + 1234)).microsecond == 1


# -- the commands ---------------------------------------------------------------------------------------------


def run(*arguments: str) -> str:
    """What `bootprint history …` prints; its errors as they are."""
    app = typer.Typer()
    register(app)
    result = CliRunner().invoke(app, ["history", *arguments], catch_exceptions=False, standalone_mode=False)
    return result.output


def test_export_and_import_go_round(file: Path, tmp_path: Path) -> None:
    recording, copy = tmp_path / "a.mcap", tmp_path / "copy.db"
    assert "bytes" in run("export", str(file), str(recording))
    assert "10 of 10 messages taken in" in run("import", str(recording), str(copy))
    assert "10 of 10" in run("import", str(recording), str(copy))
    assert run("info", str(copy)).split(";")[1:] == run("info", str(file)).split(";")[1:]
    assert "soldiers: a1, a2\n" in run("info", str(copy))
    assert "         6  track\n" in run("info", str(copy))


def test_import_takes_one_hubs_picture_where_there_are_several(tmp_path: Path) -> None:
    elsewhere = Envelope(A9.address("track", "a1"), track("a1", 100).message)
    with Recorder(tmp_path / "two.mcap") as recorder:
        recorder.write(track("a1", 1))
        recorder.write(elsewhere)
    assert "1 of 2 messages" in run(
        "import", str(tmp_path / "two.mcap"), str(tmp_path / "b.db"), "--hub", "cp"
    )
    with closing(Archive(f"sqlite:///{tmp_path}/b.db")) as archive:
        assert archive.picture_at(T0 + 200 * S) == [track("a1", 1)]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("export", "nowhere.db", "a.gpx"), RecordingError, "no such history"),
        (("export", "FILE", "a.pdf"), ConfigError, "'pdf' is unknown; known: gpx, kml, geojson, csv, mcap"),
        (("export", "FILE", "a.gpx", "--soldier", "zz"), ConfigError, "'zz' has no tracks; known: a1, a2"),
        (("export", "FILE", "a.gpx", "--begin", "2030-01-01T00:00"), ConfigError, "nothing in that span"),
        (("export", "FILE", "FILE", "--format", "csv"), ConfigError, "exists already"),
        (("export", "FILE", "no/such/folder/a.gpx"), ConfigError, "cannot be written: No such file"),
        (("export", "FILE", "no/such/folder/a.mcap"), BootprintError, "cannot be written: No such file"),
        (("import", "nowhere.mcap", "b.db"), RecordingError, "no such recording"),
    ],
)
def test_what_a_person_can_mend_is_told_in_a_line(
    file: Path, arguments: tuple[str, ...], error: type[BootprintError], message: str
) -> None:
    with pytest.raises(error, match=message):
        run(*(str(file) if each == "FILE" else each for each in arguments))
    assert not list(file.parent.glob("*.part"))


def test_an_unfinished_export_leaves_nothing(
    archive: Archive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sa_hub.exports.gpx._write_track", full)
    with pytest.raises(ConfigError, match="No space left"):
        written(archive, tmp_path / "a.gpx")
    assert not list(tmp_path.glob("a.gpx*"))
