"""The text and tables of docs/foot-ins.md, from what `figures` found; the filter's numbers are its settings'."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdr_engine.foot import METHODS, FootSettings
from pdr_engine.foot.memory import CLIP_LAG_NS, GAP_NS, HIDDEN, LATENCY_NS
from pdr_engine.foot.presets import REFERENCE, SENSORS
from proving_ground.evaluation.evaluate import Row
from proving_ground.evaluation.foot.cross_fit import summary
from proving_ground.evaluation.foot.heading_page import heading
from proving_ground.evaluation.foot.long_walks import Comparison
from proving_ground.evaluation.foot.motion_page import MotionFindings, classes, covariance
from proving_ground.evaluation.foot.robustness import Degradation, degradation_table
from proving_ground.evaluation.foot.stance_examples import SETS
from proving_ground.evaluation.foot.tried import TRIED
from proving_ground.performance.foot_benchmark import LIMITS, FootFigures

Errors = Mapping[str, Sequence[float]]
_COLUMNS = (
    ("rmse_m", "RMSE m", "{:.3f}"),
    ("final_m", "end m", "{:.2f}"),
    ("final_pct", "end %", "{:.2f}"),
    ("distance_error_pct", "distance %", "{:+.2f}"),
    ("height_final_m", "height m", "{:.2f}"),
    ("heading_drift_deg_per_min", "drift °/min", "{:+.2f}"),
    ("inside_95_pct", "in 95 %", "{:.0f}"),
    ("strides", "strides", "{}"),
    ("strides_true", "true", "{}"),
)
# Tag in the project's list of methods, what it is, and where it comes from.
_SOURCES = {
    "differential": (
        "C1",
        "differences of the acceleration, summed in a window",
        "shoe-mounted MEMS navigation",
    ),
    "gyro": ("D2", "RMS of the angular rate", "foot-mounted INS for soldiers (FOI)"),
    "shoe": (
        "SHOE",
        "likelihood ratio of both sensors, fixed threshold",
        "Skog et al. 2010; Wagstaff et al.",
    ),
    "ared": ("ARED", "energy of the angular rate", "Skog et al. 2010"),
    "adaptive": ("–", "SHOE whose threshold grows with the time since the last stance", "this project"),
    "learned": ("–", "a small network tells how fast the foot may be moving", "this project"),
}
_PUBLISHED = (
    ("nine states, one fixed SHOE threshold", 0.33, 3.3),
    ("the same with a trained LSTM detector", 0.108, 1.91),
)


@dataclass(frozen=True, slots=True)
class Findings:
    """Everything the page tells, by data set.

    ``rows``: every foot by every method. ``runs``: rows of the default, fused ones at the end. ``plain`` and
    ``ablation``: RMSE of every foot, by method in the plain filter and by variant. ``cost``: the benchmark.
    ``motion``: classes and covariance of the default's steps.
    ``long_walks``: simulated ones without and with the magnetometer, by surroundings.
    ``faults``: what faults of the sensor do, by set.
    ``cross_fit``: by set, RMSE of the feet that the network learned from, each with weights that have not seen it;
    None without the sets.
    """

    rows: Mapping[str, Sequence[Row]]
    runs: Mapping[str, Sequence[Row]]
    plain: Mapping[str, Errors]
    ablation: Mapping[str, Errors]
    cost: FootFigures
    motion: MotionFindings
    cross_fit: Mapping[str, Sequence[float]] | None = None
    long_walks: Mapping[str, Sequence[Comparison]] = field(default_factory=dict)
    faults: Mapping[str, Sequence[Degradation]] = field(default_factory=dict)


def page(findings: Findings) -> str:
    """The whole page as Markdown."""
    parts = (
        _head(),
        _how(),
        _published(findings),
        _sources(findings),
        _all_methods(findings),
        _ablation(findings),
        *([heading(findings.long_walks)] if findings.long_walks else []),
        _faults(findings),
        TRIED,
        _pictures(),
        classes(findings.motion),
        covariance(findings.motion),
        _sensors(),
        _cost(findings.cost),
        *(_runs(name, rows) for name, rows in findings.runs.items()),
    )
    return "\n\n".join(parts) + "\n"


def _head() -> str:
    return """# The foot INS and its figures

Made by `make figures` from the recorded data; `bootprint evaluate` gives the same rows. Errors are horizontal,
in metres, after a rigid fit of yaw and offset; one configuration for all. The sets are public recordings under
the MIT licence: pyshoe-vicon by Wagstaff, Peretroukhin and Kelly (University of Toronto; walking, running,
shuffling, backward, crawling, a ladder-like climb), foot-gcp from mtahakoroglu's repository
gait-driven-inertial-navigation-dataset (walks over surveyed points), xio-gait by x-io Technologies,
gaitmap-example by MaD Lab (FAU), dualfoot-fgo by Hu and Hu (60 Hz)."""


def _how() -> str:
    f, d, a = (getattr(FootSettings(), name) for name in ("filter", "detector", "alignment"))
    return f"""## How it works

- **Filter.** An error-state Kalman filter: position, velocity, attitude, and the lever arm from the sensor to
  the point of the sole that stands still. Where the sole stands, its velocity is measured to be zero
  (σ {f.zero_velocity_sigma_m_s:g} m/s an update at 200 Hz, other rates weigh the same); an innovation beyond
  {f.gate:g} sigmas inflates the measurement's noise instead of being refused. After each step place and heading
  are handed over with their 4×4 covariance and start anew (step-wise cascade).
- **Noise.** Densities, so that nothing depends on the rate: {f.accel_noise_m_s2_sqrt_hz:g} m/s²/√Hz and
  {f.gyro_noise_rad_s_sqrt_hz:g} rad/s/√Hz, and for what scale errors and bandwidth add {f.accel_scale_sqrt_s:g} √s
  of the force and {f.gyro_scale_sqrt_s:g} √s of the rate. A shock adds its change of force within a sample, times
  {1e3 * f.accel_timing_s:g} ms. Stamps may be irregular: each interval is taken as it is, and one above
  {1e-6 * GAP_NS:.0f} ms is a gap, which adds what a foot may do unseen.
- **Stance.** A network of {HIDDEN} hidden units looks at the energies of force and rate in windows from a second
  before a sample to 40 ms after it, and tells the scale σ of the foot's velocity there. Below
  {d.learned_sigma_m_s:g} m/s the zero-velocity update is applied, with {f.learned_noise:g} σ as its noise: a foot
  that rolls off or creeps holds the filter less firmly than one at rest. The network also tells the mean of that
  velocity, along the step's way and up: a foot that touches down still sinks and slides on, and an update that
  took this for nothing lifted every stride by up to a centimetre or two. {100 * f.learned_motion:g} % of that mean
  is expected, for walkers differ. σ was trained on pyshoe-vicon, the mean also on gaitmap-example and dualfoot-fgo
  (`proving_ground.evaluation.foot.train_stance`). `--method` or `[pdr.foot] method` chooses another
  detector:
  `adaptive` compares the SHOE statistic over {1e3 * d.shoe_window_s:g} ms with a threshold that stays for
  {d.adaptive_hold_s:g} s after a zero-velocity update and then grows by e^({d.adaptive_rate_per_s:g}·t).
- **Covariance.** What zero-velocity updates hide (a velocity of σ that lasts {f.hidden_motion_s:g} s) and
  {100 * f.step_scale:g} % of each step's length are part of it. A landing that surprises widens it as under
  Student's t, and so does the kind of motion; scale, slope and turn errors that all steps share are told apart
  (`pdr_engine.foot.uncertainty`).
- **Each step** also tells its class and direction, length, clearance (the swing's heights after the landing has
  corrected them), swing and stance times, and its quality (detector and landing).
- **Saturation.** A peak of the gyro whose flanks point higher than it reaches has been cut off: it is rebuilt
  between them (cubic Hermite, less high than they promise), and its axis is doubted while it lasts, the more the
  higher it was rebuilt; what of that is a turn about the vertical is partly alike from stride to stride. A
  runner's gyro of 500 °/s stands at its limit for 150 ms: what the far flank tells too late for the samples that
  are already used is added to the others. An accelerometer's limit shows by its repetition; at it, velocity along
  its axis is doubted.
- **Missing samples.** Up to {1e-6 * GAP_NS:.0f} ms are interpolated, with more noise. Across a longer gap the
  velocity stays, doubted by a white acceleration; from a second on the foot is aligned anew.
- **Alignment.** Attitude and gyro bias come from {a.window_s:g} s that are *verified* still, or after
  {a.patience_s:g} s from the quietest moment, with more doubt; every stop of {a.stop_s:g} s teaches the gyro bias
  and gravity again. Stillness is judged by variation: a rate that the bias known so far does not explain counts as
  bias only if it stays as even as no foot turns.
- **Latency.** A result comes {1e-6 * LATENCY_NS:.0f} ms after its sample ({1e-6 * CLIP_LAG_NS:.0f} ms of them to
  see a clipped peak's other flank, the rest to know the stance's end), the first ones once the foot is aligned.
  Batches of any size give the same bits as one pass."""


def _published(findings: Findings) -> str:
    """Mean RMSE as others report it on the same kinds of recordings, and ours."""
    default = FootSettings().method
    lines = [f"| {who} | {vicon:g} | {gcp:g} |" for who, vicon, gcp in _PUBLISHED if len(findings.plain) == 2]
    ours = " | ".join(_cell(_mean(_known(findings.rows[name], default)), "{:.3f}") for name in findings.plain)
    head = _header(["mean RMSE m", *findings.plain])
    table = [*head, *lines, f"| **the default here** | {ours} |"]
    return "\n".join(["## Beside what is published", "", *table, *_held_out(findings)])


def _held_out(findings: Findings) -> list[str]:
    """What the default's column on its own training set is worth."""
    if findings.cross_fit is None:
        return []
    return [
        "",
        f"The network's σ is trained on {SETS[0]}, its mean motion on {', '.join(SETS)}: the default's figures on",
        "these sets are of training data, here and below. With weights trained on the halves of the sets without",
        "the foot they are",
        "(`python -m proving_ground.evaluation.foot.cross_fit DATA`; of gaitmap-example and dualfoot-fgo the other",
        "half is the same walk's other foot):",
        "",
        *(f"- {name}: {summary(errors)}" for name, errors in findings.cross_fit.items()),
        "",
        "The filter's settings, the network's features and its size were chosen with all the sets in view; no",
        "recording was kept back from those choices. Attitude and lever arm, which training takes from the filter,",
        "are of the shipped weights in both halves.",
    ]


def _sources(findings: Findings) -> str:
    """Every source's method in its own row: in the plain nine-state filter, and in this one."""
    titles = [f"{name}, {where} filter" for name in findings.plain for where in ("plain", "this")]
    lines = [
        "## The sources' methods",
        "",
        "Stance detectors of the sources in the nine-state filter of D1 (bias from the start, no gate, no lever",
        "arm, no rebuilt peaks), and in this filter. Median / mean / worst RMSE in metres.",
        "",
        *_header(["tag", "method", "from", *titles]),
    ]
    for method in METHODS:
        tag, what, source = _SOURCES[method]
        cells = [
            _three(errors)
            for name, by_method in findings.plain.items()
            for errors in (by_method[method], _known(findings.rows[name], method))
        ]
        lines.append(f"| {tag} | {what} | {source} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _all_methods(findings: Findings) -> str:
    lines = ["## All sets and methods", "", *_header(["set", "method", "n", "median m", "mean m", "worst m"])]
    for name, rows in findings.rows.items():
        for method in METHODS:
            errors = _known(rows, method)
            if errors:
                figures = " | ".join(f"{value:.3f}" for value in _median_mean_worst(errors))
                lines.append(f"| {name} | {method} | {len(errors)} | {figures} |")
    return "\n".join(lines)


def _ablation(findings: Findings) -> str:
    lines = [
        "## What each choice is worth",
        "",
        "One choice taken away at a time, by settings alone (`proving_ground.evaluation.foot.ablation`).",
        "Median / mean / worst RMSE in metres.",
        "",
        *_header(["", *findings.ablation]),
    ]
    for name in next(iter(findings.ablation.values()), {}):
        cells = " | ".join(_three(variants[name]) for variants in findings.ablation.values())
        lines.append(f"| {name} | {cells} |")
    return "\n".join(lines)


def _faults(findings: Findings) -> str:
    lines = [
        "## What faults do",
        "",
        "The same runs with one fault of the sensor put into all of them at a time, by the default settings",
        "(`python -m proving_ground.evaluation.foot.robustness DATA/SET`; what each is: `evaluation.foot.faults`).",
        "Left-handed axes cannot be walked with; health says so after ten stances. A gyro bias of 0.1 rad/s is",
        "outside the default sensor's range: it is learnt where the foot rests for two seconds, as in few here.",
    ]
    for name, found in findings.faults.items():
        lines += ["", f"{name}:", "", degradation_table(found)]
    return "\n".join(lines)


def _pictures() -> str:
    return """## Pictures

The default's median and worst run of pyshoe-vicon and of foot-gcp, over the truth (grey):

![Tracks over the truth](img/foot-tracks.png)

How many runs stay below which RMSE, by method:

![Share of runs below an error, by method](img/foot-shares.png)"""


def _sensors() -> str:
    """The presets, as the filter sees them."""
    lines = [
        "## Sensors",
        "",
        f'`[pdr.foot] sensor = "…"` (default `{REFERENCE}`, with which everything above was tuned) exchanges the',
        "sensor's own part of the noise (`pdr_engine.foot.presets` says where each figure is from, and for which",
        "no maker's sheet was found); what motion adds stays, and so does every term set by hand. `unknown` starts",
        "as the worst of all and hears its densities where the foot rests.",
        "",
        *_header(
            [
                "sensor",
                "accel µg/√Hz",
                "gyro °/s/√Hz",
                "bias in run °/h",
                "bias at start °/s",
                "σ of gyro noise",
            ]
        ),
    ]
    for name, sheet in SENSORS.items():
        noise = FootSettings(sensor=name).filter.gyro_noise_rad_s_sqrt_hz
        lines.append(
            f"| `{name}` | {sheet.accel_m_s2_sqrt_hz / 9.80665e-6:.0f} "
            f"| {np.degrees(sheet.gyro_rad_s_sqrt_hz):.3f} | {3600 * np.degrees(sheet.bias_in_run_rad_s):.0f} "
            f"| {np.degrees(sheet.bias_turn_on_rad_s):.2f} | {noise:.5f} rad/s/√Hz |"
        )
    return "\n".join(lines)


def _cost(cost: FootFigures) -> str:
    lines = [
        "## What it costs",
        "",
        "`bootprint benchmark foot` on the machine that made this page, one core; the textbook's filter (nine",
        f"states, SHOE, plain NumPy) takes {cost.us_textbook:.0f} µs a sample in the same run.",
        "",
        *_header(["", "measured", "limit"]),
    ]
    for limit in LIMITS:
        measured = f"{getattr(cost, limit.figure):.2f} {limit.unit}"
        lines.append(f"| {limit.meaning} | {measured} | {limit.bounds} |")
    return "\n".join(lines)


def _runs(name: str, rows: Sequence[Row]) -> str:
    lines = [f"## {name}, run by run", "", *_header(["run", *(title for _, title, _ in _COLUMNS)])]
    for row in rows:
        cells = " | ".join(_cell(row[column], form) for column, _, form in _COLUMNS)
        lines.append(f"| {row['run']} | {cells} |")
    return "\n".join(lines)


def _known(rows: Sequence[Row], method: str) -> list[float]:
    return [float(rmse) for row in rows if row["method"] == method and (rmse := row["rmse_m"]) is not None]


def _median_mean_worst(errors: Sequence[float]) -> tuple[float, float, float]:
    return float(np.median(errors)), float(np.mean(errors)), float(np.max(errors))


def _mean(errors: Sequence[float]) -> float | None:
    return float(np.mean(errors)) if errors else None


def _three(errors: Sequence[float]) -> str:
    return " / ".join(f"{value:.3f}" for value in _median_mean_worst(errors)) if errors else "–"


def _header(titles: Sequence[str]) -> list[str]:
    return [f"| {' | '.join(titles)} |", "|---" * len(titles) + "|"]


def _cell(value: float | int | str | None, form: str) -> str:
    return "–" if value is None else form.format(value)
