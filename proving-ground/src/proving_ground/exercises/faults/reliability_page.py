"""Makes docs/reliability.md: every fault, what a person sees, how long until good again, what is lost.

python -m proving_ground.exercises.faults.reliability_page DOCS [RESULT.json...]

Results of `bootprint exercise run --storm` are put into docs/reliability.json, from which the page's figures are
made; without any the figures stay. A test that is named on the page and is not there is an error.
"""

import json
import statistics
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from bootprint.errors import ConfigError
from proving_ground.exercises.faults.reliability_rows import ROWS, FaultRow

_TESTS: Final = Path(__file__).parents[5] / "tests"
_FIGURES: Final = "reliability.json"
_COLUMNS: Final = ("down_s", "wrong_s", "right_after_s", "honest_after_s", "positions_missing")
_KEPT: Final = ("fault", "target", "details", *_COLUMNS)
_KEPT_OF_STORMS: Final = ("exercise", "duration_s", "latency_p99_ms", "speed")
_HEAD: Final = """# Reliability: what breaks, and what then

Made by `make figures` (`python -m proving_ground.exercises.faults.reliability_page docs`). Every fault below is
injected by the tests that are named, and most of them by exercises:

```sh
make storm                                                              # an hour of them, the goals, this page
bootprint exercise run building-clearing --storm 3 --report out/storm   # every kind at random, by a seed
bootprint exercise run my-scenario.toml --report out/faults             # [[faults]] of one's own: scenarios.md
python -m proving_ground.exercises.faults.reliability_page docs out/storm/result.json
```

In a storm faults come one after the other, twelve seconds apart, every kind once before any comes twice. `down` is
from a kill to the process's own first word on the bus (after a power cut: from the power's return). The command
post's picture is right while everybody in it is fresh by the hub's rule and within 10 m of the truth, and honest
while who is further off is inside the doubt that is shown. `wrong` is for how long it was not right, from the
fault's beginning on; `right` and `honest again` are how long after its end it is so for three seconds. `missing`
counts positions on fusion's grid (5 Hz) that were never told.

"""
_TAIL: Final = """
## How it holds

- **Saved state** (`bootprint.saved_state`) is one form for fusion and pdr-engine: two slots written in turn and in
  place, checksum, version, owner-only. Nothing is synced while a service works: a kill loses nothing of it, and
  after a power cut there is what the kernel wrote within half a minute; state may be a minute old.
- **The bus tells the last eight seconds of inertial samples again** (`Qos.RECENT`): a restarted engine misses
  none as long as saving (2 s), dying and starting take less, nor does one whose router was gone for less.
- **Memory** (`python -m proving_ground.exercises.faults.soak out/soak --speed 16 --minutes 7`:
  a soldier's services, 112 minutes of event time): after the first hour the worst of them grew by 0.2 % an hour;
  within the first hour by up to a sixth. On a machine of twenty others, where what waits takes memory too,
  pdr-engine grew by 0.7 % an hour, and fusion, which had fallen behind, once took 3 MB at a stroke.
- **`bootprint up`** starts again what ends, at once if it had run for 20 s, else after 0.25 s and up to 3 s while
  it keeps failing; it ends who is silent.
- **A start is cheap** ([performance.md](performance.md#start)): `up` and exercises fork services from a process
  that has imported them (`bootprint.fork_server`), so a start takes 0.02 to 0.06 s of processor instead of 0.4, and
  what is imported is in memory once. Should that process die, nobody could tell how its services end: they are
  ended and start again. A hub that may not speak yet (a fresh epoch's second has to pass) listens and shows its
  picture meanwhile. systemd units and containers of single services start the long way.
- **A router is back within milliseconds**, and looked for every half second.
- **Watching it**: `bootprint bus rates` shows every key's rate beside what the table of topics expects,
  `bootprint bus metrics --port 9464` (or `--textfile`) tells Prometheus of both and of all health; one process a
  computer, none of it inside the services. `--log-json` makes every log line a JSON object.

## Known limits

- A gateway that is killed loses the samples of its absence: a turn made then is not known, and the doubt says so.
- Two computers with one identity are told by counters (`own_echo`, `replayed`) only, not by an alert.
- An event that was said while its router was gone comes with the next event of the same kind and process.
"""


def main(docs: Path, results: Sequence[Path]) -> None:
    """Write the page; with results, its figures first."""
    _check_tests()
    if results:
        _keep_figures(docs / _FIGURES, results)
    figures = _figures(docs / _FIGURES)
    text = _HEAD + _circumstances(figures) + "\n".join(_table(figures["faults"])) + "\n" + _TAIL
    (docs / "reliability.md").write_text(text, encoding="utf-8")


def _check_tests() -> None:
    """ConfigError at the first test that is named and is not there."""
    for name in (test for row in ROWS for test in row.tests):
        file, function = name.split("::")
        path = _TESTS / file
        if not path.is_file() or f"def {function}(" not in path.read_text(encoding="utf-8"):
            raise ConfigError(f"docs/reliability.md names the test {name}, which is not there")


def _keep_figures(path: Path, results: Sequence[Path]) -> None:
    read = [json.loads(result.read_text(encoding="utf-8")) for result in results]
    rows = [{name: row[name] for name in _KEPT} for one in read for row in one["faults"]]
    storms = [{name: one.get(name) for name in _KEPT_OF_STORMS} for one in read]
    path.write_text(json.dumps({"storms": storms, "faults": rows}, indent=1) + "\n", encoding="utf-8")


def _figures(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {"storms": [], "faults": []}
    read: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return read


def _circumstances(figures: Mapping[str, Any]) -> str:
    storms, rows = figures["storms"], figures["faults"]
    if not storms:
        return ""
    minutes = sum(storm["duration_s"] for storm in storms) / 60.0
    speed = max(storm.get("speed") or 1.0 for storm in storms)
    hurried = "" if speed == 1.0 else f", {_number(speed)} times as fast as time"
    downs = [row["down_s"] for row in rows if row["down_s"] is not None]
    return (
        f"Figures of {len(storms)} storms of {storms[0]['exercise']}, {minutes:.0f} minutes{hurried}, "
        f"{len(rows)} faults. "
        f"Not right again within 10 s: {_late(rows, 'right_after_s')}; "
        f"not honest: {_late(rows, 'honest_after_s')}. "
        f"Down: {_spread(downs)} s; eight soldiers' 33 processes on {_load(storms)}. "
        "Medians, with the worst in brackets. A heading that one fault has cost is missing until satellites tell "
        "it, and counts against the faults that follow.\n\n"
    )


def _load(storms: Sequence[Mapping[str, Any]]) -> str:
    """How busy the machine was, by how late tracks were."""
    late_s = [storm["latency_p99_ms"] / 1e3 for storm in storms if storm.get("latency_p99_ms") is not None]
    if not late_s:
        return "one machine"
    return f"a machine whose tracks were {_number(min(late_s))} to {_number(max(late_s))} s late (p99)"


def _late(rows: Sequence[Mapping[str, Any]], name: str) -> int:
    return sum(row[name] is None or row[name] > 10.0 for row in rows)


def _table(rows: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    names = ("n", "down s", "wrong s", "right again s", "honest again s", "missing")
    yield f"| fault | what a person sees | what is lost | {' | '.join(names)} |"
    yield f"| --- | --- | --- |{' --: |' * len(names)}"
    for row in ROWS:
        yield _line(row, [each for each in rows if _is_of(row, each)])
    yield ""
    yield "The tests that inject each:"
    yield ""
    for row in ROWS:
        yield f"- {row.fault}: " + ", ".join(f"`{test}`" for test in row.tests)


def _is_of(row: FaultRow, played: Mapping[str, Any]) -> bool:
    for kind in row.kinds:
        fault, _, process = kind.partition(" ")
        if played["fault"] == fault and (not process or f"process {process}" in played["details"]):
            return True
    return False


def _line(row: FaultRow, played: Sequence[Mapping[str, Any]]) -> str:
    cells = [row.fault, row.sees, row.lost, str(len(played)) if row.kinds else "–"]
    downs = [each["down_s"] for each in played if each["down_s"] is not None]
    cells += [_spread(downs), *(_spread([each[name] for each in played]) for name in _COLUMNS[1:])]
    return f"| {' | '.join(cells)} |"


def _spread(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    never = f", {len(values) - len(known)} never" if len(known) < len(values) else ""
    return f"{_number(statistics.median(known))} ({_number(max(known))}){never}"


def _number(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
