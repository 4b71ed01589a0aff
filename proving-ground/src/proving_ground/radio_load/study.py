"""The load tests behind docs/radio-load.md: which squads, radios and budgets, and the rows that come of them.

Choices of the code that is tested here were made on other seeds than these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from proving_ground.radio_load.contest import Row, contest
from proving_ground.radio_load.floor import squad_floor_bits_per_s
from proving_ground.radio_load.formats import FORMATS, OURS
from proving_ground.radio_load.load import Load

TRACKS: Final = ("patrol", "building", "recorded")
SEEDS: Final = (11, 13)
OTHERS_SEEDS: Final = SEEDS[:1]
FORMATS_S: Final = 900.0
BUDGETS: Final[Mapping[str, int]] = {"patrol": 34, "building": 34, "recorded": 37}
SHORT_TAG_BUDGETS: Final[Mapping[str, int]] = {"patrol": 25, "building": 25, "recorded": 29}
CURVE_BITRATES: Final = (18, 25, 34, 60, 150)
CURVE_S: Final = 300.0
FLOOR_P95_M: Final = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0)
LOSSES: Final = (0.0, 0.2, 0.3)
LOSS_BITRATES: Final[Mapping[bool, int]] = {True: 40, False: 55}
LOSS_S: Final = 300.0
CROWDS: Final = ((40, 85), (120, 220))
CROWD_S: Final = 200.0
RADIOS: Final = (("hf-300", 120), ("vhf-1200", 120), ("lora-long-fast", 90), ("udp", 74))
RADIO_S: Final = 300.0
OnProgress = Callable[[str], None]


@dataclass
class Study:
    """Rows of every part: formats by tracks; ours over budgets; over loss; by size of squad; over real radios.

    ``floor`` holds (p95 m, bit/s for twelve) by tracks. Rows have their settings with them.
    """

    formats: dict[str, list[Row]] = field(default_factory=dict)
    tags: list[Row] = field(default_factory=list)
    curves: dict[str, list[Row]] = field(default_factory=dict)
    floor: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    loss: list[Row] = field(default_factory=list)
    crowds: list[Row] = field(default_factory=list)
    radios: list[Row] = field(default_factory=list)


def run_study(data: Path | None, on_progress: OnProgress = lambda _what: None) -> Study:
    """All of it; without ``data`` the recorded walks are left out."""
    study = Study()
    for name in TRACKS if data is not None else TRACKS[:2]:
        on_progress(f"formats on {name}")
        load = Load(tracks=name, bitrate=BUDGETS[name], data=data, duration_s=FORMATS_S)
        ours = contest(load, [OURS], SEEDS)
        study.formats[name] = [*ours, *contest(load, list(FORMATS), OTHERS_SEEDS)]
        study.tags.append(_ours(replace(load, tag=4, bitrate=SHORT_TAG_BUDGETS[name])))
        on_progress(f"curve of {name}")
        shorter = replace(load, duration_s=CURVE_S)
        study.curves[name] = [_ours(replace(shorter, bitrate=bitrate)) for bitrate in CURVE_BITRATES]
        tracks = replace(load, seed=SEEDS[0]).squad()
        study.floor[name] = [(p95_m, squad_floor_bits_per_s(tracks, p95_m)) for p95_m in FLOOR_P95_M]
    on_progress("loss")
    study.loss = list(_loss_rows())
    on_progress("crowds")
    study.crowds = [
        _ours(Load(soldiers=count, bitrate=bitrate, duration_s=CROWD_S)) for count, bitrate in CROWDS
    ]
    on_progress("radios")
    study.radios = [_ours(Load(link=link, bitrate=bitrate, duration_s=RADIO_S)) for link, bitrate in RADIOS]
    return study


def _loss_rows() -> Sequence[Row]:
    return [
        _ours(Load(loss=loss, bitrate=bitrate, feedback=feedback, duration_s=LOSS_S))
        for feedback, bitrate in LOSS_BITRATES.items()
        for loss in LOSSES
    ]


def _ours(load: Load) -> Row:
    """Our row of one seed, with its settings and the floor at the p95 that it came to."""
    one = replace(load, seed=SEEDS[0])
    (row,) = contest(one, [OURS], [one.seed])
    p95_m = row["added_error_p95_m"]
    floor = squad_floor_bits_per_s(one.squad(), p95_m) if p95_m else None
    return {**settings_of(load), **row, "floor_bits_per_s": floor}


def settings_of(load: Load) -> dict[str, Any]:
    """What a row of the study is told apart by."""
    names = ("soldiers", "bitrate", "loss", "tag", "link", "tracks", "feedback", "duration_s")
    return {name: getattr(load, name) for name in names}
