"""Figures of recorded walks beside those of their simulated twins, each with the bound it is held to.

A figure is the median or another percentile over strides, feet or runs; its ratio is simulated over recorded, and
it agrees when the ratio lies between 1/bound and bound.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proving_ground.agreement.signals import BANDS_HZ, Signature, signature_of
from proving_ground.agreement.strides import FloatArray
from proving_ground.agreement.twins import SETUPS, Kind, Recorded, is_stride, recorded_feet, twin
from proving_ground.evaluation.alignment import is_dense
from proving_ground.evaluation.evaluate import Row, Task, estimate_foot, evaluate_task
from proving_ground.evaluation.scoring import Align
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run

METHOD = "learned"
ALIGN: Align = "best-fit"
KINDS: tuple[Kind, ...] = ("walk", "run", "stairs_up", "stairs_down")
# Figure of the strides: percentiles to compare and bound.
_STRIDES: dict[str, tuple[tuple[int, ...], float]] = {
    "stride_s": ((50,), 1.1),
    "stride_m": ((50,), 1.35),
    "stance_share": ((50,), 1.5),
    "lift_m": ((50,), 2.0),
    "toe_down_rad": ((50,), 1.3),
    "accel_peak_m_s2": ((50, 90), 2.2),
    "rate_peak_rad_s": ((50, 90), 2.0),
    "accel_floor_m_s2": ((50,), 3.0),
    "rate_floor_rad_s": ((50,), 2.5),
}
_BAND_BOUND = 2.0
_FAST_BAND_HZ = 30.0
_FAST_BAND_BOUND = 5.0  # knocks above depend on how hard the sensor sits
# Figure of the foot INS: percentiles to compare, bound; signs are lost. The goal is the RMSE's; of the others the
# median of a few walks wanders.
_ERRORS: dict[str, tuple[tuple[int, ...], float]] = {
    "rmse_m": ((50, 75, 90), 2.0),
    "final_pct": ((50,), 2.5),
    "distance_error_pct": ((50,), 4.0),
    "heading_drift_deg_per_min": ((50,), 3.0),
    "height_final_m": ((50, 90), 4.0),
}
_RUNS_AT_LEAST = 2
_BLUNDER_M = 0.4  # strides err by 1 cm in the middle


@dataclass(frozen=True, slots=True)
class Observed:
    """One foot: its signature, and its row of errors where there is truth; ``odd``: its run was not fitted to."""

    dataset: str
    kind: Kind
    odd: bool
    signature: Signature | None
    row: Row | None


@dataclass(frozen=True, slots=True)
class Finding:
    """One figure of both: ``ratio`` is simulated over recorded and stays within ``bound`` on either side.

    ``held_out_ratio``: over the runs alone that no shape was fitted to; None where a set has none of them.
    """

    dataset: str
    kind: Kind
    figure: str
    recorded: float
    simulated: float
    bound: float
    held_out_ratio: float | None

    @property
    def ratio(self) -> float:
        """Simulated over recorded."""
        return self.simulated / self.recorded

    @property
    def agrees(self) -> bool:
        """Whether the ratio is within the bound."""
        return 1.0 / self.bound <= self.ratio <= self.bound


def load(data: Path) -> list[tuple[Recorded, bool]]:
    """Every recorded foot that can be matched, and whether its run was held out of the fit."""
    found = []
    for dataset in SETUPS:
        for index, run in enumerate(_runs(data, dataset)):
            held_out = run.kind == "foot" and index % 2 == 1
            found += [(foot, held_out) for foot in recorded_feet(dataset, run)]
    return found


def _runs(data: Path, dataset: str) -> list[Run]:
    """A set's runs; of a set of single files, each by itself."""
    if not (data / dataset).is_dir():
        return []
    walks = sorted((data / dataset).glob("imu_sample*.csv"))
    walks = [path for path in walks if "not_rotated" not in path.name and "ic_stride" not in path.name]
    return load_runs(walks or [data / dataset])


def observe(feet: Sequence[tuple[Recorded, bool]], seeds: int) -> Iterator[tuple[Observed, list[Observed]]]:
    """Each recorded foot and its simulated twins."""
    for index, (foot, held_out) in enumerate(feet):
        scored = survey_is_sound(foot)
        twins = [twin(foot, 1 + seed + seeds * index) for seed in range(seeds)]
        real, *made = (_observed(foot, run, held_out, scored) for run in (foot.run, *twins))
        yield real, made


def survey_is_sound(foot: Recorded) -> bool:
    """Whether there is a truth, and no surveyed stride is off by what no foot INS errs by within one stride."""
    truth = foot.run.truth.get(foot.place)
    if truth is None or is_dense(truth):
        return truth is not None
    found = estimate_foot(foot.imu, METHOD).track.at(truth.time_s)
    lengths = [np.hypot(*np.diff(way[:, :2], axis=0).T) for way in (found, truth.position_m)]
    return float(np.nanmax(np.abs(lengths[0] - lengths[1]))) < _BLUNDER_M


def _observed(foot: Recorded, run: Run, held_out: bool, scored: bool) -> Observed:
    task = Task(run, "foot", foot.place, METHOD, run.name)
    return Observed(
        foot.dataset,
        foot.kind,
        held_out,
        signature_of(run.imus[foot.place], is_stride),
        evaluate_task(task, ALIGN).row if scored else None,
    )


def compare(recorded: Sequence[Observed], simulated: Sequence[Observed]) -> list[Finding]:
    """All figures of every set and kind of which there are at least two feet."""
    return [
        finding
        for dataset in SETUPS
        for kind in KINDS
        for finding in _compare_group(
            dataset, kind, _group(recorded, dataset, kind), _group(simulated, dataset, kind)
        )
    ]


def _group(observed: Sequence[Observed], dataset: str, kind: Kind) -> list[Observed]:
    return [one for one in observed if one.dataset == dataset and one.kind == kind]


def _compare_group(
    dataset: str, kind: Kind, recorded: list[Observed], simulated: list[Observed]
) -> Iterator[Finding]:
    if len(recorded) < _RUNS_AT_LEAST:
        return
    held_out = [[one for one in group if one.odd] for group in (recorded, simulated)]
    real, made = figures(recorded), figures(simulated)
    real_odd, made_odd = (figures(group) for group in held_out)
    for name, (value, bound) in real.items():
        ratio = made_odd[name][0] / real_odd[name][0] if name in made_odd and name in real_odd else None
        yield Finding(dataset, kind, name, value, made[name][0], bound, ratio)


def figures(observed: Sequence[Observed]) -> dict[str, tuple[float, float]]:
    """Figures of a group of feet by name, each with its bound."""
    signatures = [one.signature for one in observed if one.signature is not None]
    rows = [one.row for one in observed if one.row is not None]
    found: dict[str, tuple[float, float]] = {}
    for name, (percentiles, bound) in _STRIDES.items() if signatures else ():
        values = np.concatenate([signature.per_stride[name] for signature in signatures])
        found |= _percentiles(name, values, percentiles, bound)
    for name in ("accel_rms_m_s2", "rate_rms_rad_s") if signatures else ():
        bands = np.median([getattr(signature, name) for signature in signatures], axis=0)
        for (low, high), value in zip(BANDS_HZ, bands, strict=True):
            bound = _FAST_BAND_BOUND if low >= _FAST_BAND_HZ else _BAND_BOUND
            found[f"{name} {low:g}-{high:g} Hz"] = (float(value), bound)
    for name, (percentiles, bound) in _ERRORS.items():
        sizes = np.array([abs(float(value)) for row in rows if (value := row[name]) is not None])
        if len(sizes) >= _RUNS_AT_LEAST:
            found |= _percentiles(name, sizes, percentiles, bound)
    return found


def _percentiles(
    name: str, values: FloatArray, percentiles: Sequence[int], bound: float
) -> dict[str, tuple[float, float]]:
    return {f"{name} p{share}": (float(np.percentile(values, share)), bound) for share in percentiles}
