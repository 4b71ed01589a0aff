"""The kernel without its compiler: numba's bits, a cache that mends itself, numba itself where all fails."""

import gc
import math
import shutil
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
import structlog
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import carray, cfunc, types

from bootprint.config import load_computer
from bootprint.service import Context, Options
from pdr_engine.foot import (
    METHODS,
    FootNavigator,
    FootSettings,
    build_kernel,
    kernel_cache,
    machine_code,
    warm_up,
)
from pdr_engine.foot.kernel_cache import cache_folders, read_sealed, write_sealed
from pdr_engine.foot.machine_code import C_LIBRARY, KernelError, linked, load_kernel, run_by_numba
from pdr_engine.foot.memory import SAMPLE
from pdr_engine.foot.tables import CHUNK, SHAPES, Table, Tables, fresh_tables
from pdr_engine.main import build
from support.foot_streams import Stream, still, turning, walk

Bind = Callable[[Tables], machine_code.Run]
WALK = walk(6)
REALM = """
id = "bp"
origin = { latitude_deg = 58.4, longitude_deg = 15.6 }
roster = [{ id = "a1", number = 1, unit = "alpha" }]
"""


@pytest.fixture(scope="module")
def native() -> Bind:
    kernel = load_kernel()
    assert kernel.fallback is None
    return kernel.bind


@pytest.fixture(scope="module")
def code() -> bytes:
    load_kernel()
    found = [sealed for folder in cache_folders() if (sealed := stored(folder))]
    return found[0]


def stored(folder: Path) -> bytes | None:
    return read_sealed(folder / machine_code._file_name())


def fed(bind: Bind, stream: Stream, foot: FootSettings, cuts: list[int]) -> Iterator[bytes]:
    """All tables after each batch and after the end."""
    tables = fresh_tables(foot)
    run = bind(tables)
    bounds = [0, *sorted(cuts), *range(CHUNK, len(stream.time_ns), CHUNK), len(stream.time_ns)]
    for a, b in zip(sorted(bounds), sorted(bounds)[1:], strict=False):
        tables.batch["time_ns"][: b - a] = stream.time_ns[a:b]
        tables.batch["accel"][: b - a] = stream.accel[a:b]
        tables.batch["gyro"][: b - a] = stream.gyro[a:b]
        run(b - a, False)
        yield content(tables)
    run(0, True)
    yield content(tables)


def content(tables: Tables) -> bytes:
    return b"".join(getattr(tables, name).tobytes() for name in SHAPES)


def faulty(seed: int) -> Stream:
    """A walk with what sensors do wrong: NaN, stamps that go back, clipped peaks, a short and a long silence."""
    rng = np.random.default_rng(seed)
    stream = Stream.joined(still(1.0), WALK, turning(1.0, 3.0), WALK)
    stream.accel[rng.integers(len(stream.accel), size=9)] = np.nan
    stream.gyro[rng.integers(len(stream.gyro), size=9), 1] = np.inf
    np.clip(stream.gyro, -6.5, 6.5, out=stream.gyro)
    stream.time_ns[900:] += 80_000_000
    stream.time_ns[1500:] += 3_000_000_000
    stream.time_ns[rng.integers(len(stream.time_ns), size=9)] -= 50_000_000
    return stream


@pytest.mark.parametrize("method", METHODS)
def test_every_method_gives_the_bits_that_numba_gives(method: Any, native: Bind) -> None:
    foot = FootSettings(method=method)
    assert list(fed(native, WALK, foot, [])) == list(fed(run_by_numba, WALK, foot, []))


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 2000), max_size=8))
def test_faults_and_any_batches_give_the_bits_that_numba_gives(seed: int, cuts: list[int]) -> None:
    stream = faulty(seed)
    ours, numbas = (
        list(fed(bind, stream, FootSettings(), cuts)) for bind in (load_kernel().bind, run_by_numba)
    )
    assert ours == numbas


def test_a_call_keeps_alive_what_it_points_to(code: bytes) -> None:
    """Neither the tables nor the loaded code may go while a call on them is left."""
    tables = fresh_tables(FootSettings())
    kept = [weakref.ref(getattr(tables, name)) for name in SHAPES]
    run = linked(code)(tables)
    tables.batch["accel"][:, 2] = 9.81
    del tables
    gc.collect()
    run(1, True)
    assert all(table() is not None for table in kept)
    assert int(kept[0]()["accepted"][0]) == 1
    del run
    gc.collect()
    assert all(table() is None for table in kept)


@pytest.mark.parametrize(
    "bad",
    [
        {"state": np.zeros(1, SAMPLE)},
        {"batch": np.zeros(CHUNK - 1, SAMPLE)},
        {"batch": np.zeros(2 * CHUNK, SAMPLE)[::2]},
        {"parameters": np.zeros(1, SHAPES["parameters"][0].newbyteorder())},
    ],
)
def test_tables_that_the_kernel_would_misread_are_refused(bad: dict[str, Table]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(bad))} must be"):
        replace(fresh_tables(FootSettings()), **bad)


def test_an_engine_runs_without_numba() -> None:
    """Loaded in a process of its own: no compiler, and nothing else of weight that the engine does not use."""
    load_kernel()
    script = (
        "import sys, pdr_engine.main as m; assert m.warm_up() is None\n"
        "print(sorted({'numba', 'scipy', 'pymap3d', 'matplotlib', 'pygeomag'} & set(sys.modules)))"
    )
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert said.stdout == "[]\n"


def undefined_symbols(elf: bytes) -> set[str]:
    """Names that an object file leaves open, from its symbol table (ELF, 64 bits)."""
    sections: dict[str, list[bytes]] = {}
    for section in llvm.ObjectFileRef.from_data(elf).sections():
        sections.setdefault((section.name() or b"").decode(), []).append(bytes(section.data()))
    [table], [names] = sections[".symtab"], sections[".strtab"]
    symbol = np.dtype([("name", "u4"), ("kind", "u2"), ("section", "u2"), ("value", "u8"), ("size", "u8")])
    rows = np.frombuffer(table, symbol)
    starts = rows["name"][(rows["section"] == 0) & (rows["name"] != 0)].tolist()
    return {names[start : names.index(b"\0", start)].decode() for start in starts}


@pytest.mark.skipif(sys.platform != "linux", reason="object files are ELF on Linux")
def test_the_object_file_leaves_nothing_open_but_the_c_library(code: bytes) -> None:
    open_ones = undefined_symbols(code)
    assert open_ones <= set(C_LIBRARY)
    assert {"atan2", "exp"} <= open_ones  # the list is really read


def _sine(x: Any) -> None:
    values = carray(x, 1)
    values[0] = math.sin(values[0])


def _raises(x: Any) -> None:
    values = carray(x, 1)
    if values[0] > 1.0:
        raise ValueError("too large")


def _allocates(x: Any) -> None:
    values = carray(x, 1)
    values[0] = np.cumsum(np.ones(int(values[0])))[-1]


def compiled_alone(function: Any) -> bytes:
    return build_kernel.object_code(cfunc(types.void(types.CPointer(types.float64)))(function))


def test_code_that_raises_or_allocates_is_refused() -> None:
    assert len(compiled_alone(_sine)) > 0
    with pytest.raises(KernelError, match="numba_unpickle"):
        compiled_alone(_raises)
    with pytest.raises(KernelError, match="NRT_"):
        compiled_alone(_allocates)


def _idle(
    state: Any, parameters: Any, batch: Any, estimates: Any, steps: Any, count: int, ends: bool
) -> None:
    carray(state, 1)[0].accepted = count


def test_code_that_gives_other_bits_is_refused(code: bytes) -> None:
    build_kernel.check(code)
    idle = build_kernel.object_code(cfunc(build_kernel.SIGNATURE)(_idle))
    with pytest.raises(KernelError, match="differ in state"):
        build_kernel.check(idle)


def test_a_sealed_file_is_whole_or_nothing(tmp_path: Path) -> None:
    path = tmp_path / "file"
    assert read_sealed(path) is None
    write_sealed(path, b"content")
    assert read_sealed(path) == b"content"
    assert list(tmp_path.iterdir()) == [path]
    whole = path.read_bytes()
    for damaged in (b"", whole[:-1], whole[:20], whole[:-1] + b"T", b"\0" * len(whole), whole + b"\0"):
        path.write_bytes(damaged)
        assert read_sealed(path) is None


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The one folder where kernels are looked for and kept, with numba's own cache so that it builds quickly."""
    load_kernel()
    warm = next(place for place in cache_folders() if stored(place))
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([tmp_path]))
    [place] = cache_folders()
    shutil.copytree(warm, place)
    return place


def test_a_damaged_file_is_built_anew(folder: Path) -> None:
    path = folder / machine_code._file_name()
    path.write_bytes(path.read_bytes()[:50_000])
    assert machine_code._object_code() == stored(folder)


def test_processes_may_build_at_once(folder: Path) -> None:
    path = folder / machine_code._file_name()
    path.unlink()
    command = [sys.executable, "-m", build_kernel.__name__, str(path)]
    builders = [subprocess.Popen(command) for _ in range(2)]
    assert [builder.wait(timeout=100) for builder in builders] == [0, 0]
    assert stored(folder) == machine_code._object_code()
    assert [left for left in folder.iterdir() if left.name.startswith("feed-")] == [path]


def test_a_kernel_that_lies_in_a_later_folder_is_found(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a read-only installation that was warmed up when it was made. Building would fail here."""
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([tmp_path / "empty", tmp_path]))
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    assert machine_code._object_code() == stored(folder)


def test_the_first_folder_that_can_be_written_is_taken_and_else_an_own_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    blocked = tmp_path / "file" / "below"
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([blocked, tmp_path / "free"]))
    assert kernel_cache.writable_folder().parent == tmp_path / "free"
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([blocked]))
    own = kernel_cache.writable_folder()
    write_sealed(own / "kernel", b"content")
    assert kernel_cache.writable_folder() == own
    assert own.name == cache_folders()[0].name


def test_the_chosen_folder_is_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_folders()[0].parent == tmp_path
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    assert cache_folders()[0].parent.name == "__pycache__"


@pytest.fixture
def no_builder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No kernel on disk, and no way to make one."""
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([tmp_path / "none"]))
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    load_kernel.cache_clear()
    warm_up.cache_clear()
    yield
    load_kernel.cache_clear()
    warm_up.cache_clear()


@pytest.mark.usefixtures("no_builder")
def test_where_no_kernel_can_be_built_numba_runs_it_and_the_log_says_so(tmp_path: Path) -> None:
    (tmp_path / "realm.toml").write_text(REALM, encoding="utf-8")
    path = tmp_path / "computer.toml"
    path.write_text('realm = "realm.toml"\nsoldier = "a1"\n', encoding="utf-8")
    with structlog.testing.capture_logs() as logs:
        build(Context("pdr-engine", load_computer(path), Options(config=path)))
    [line] = [log for log in logs if log["log_level"] == "warning"]
    assert "numba" in line["event"]
    assert "/nowhere/python" in line["reason"]
    navigator = FootNavigator()
    navigator.process(WALK.time_ns, WALK.accel, WALK.gyro)
    assert navigator.counters()["accepted"] == len(WALK.time_ns)


def test_a_build_that_fails_says_why_in_a_line(folder: Path) -> None:
    with pytest.raises(KernelError, match=r"cannot be compiled: OSError.*too long"):
        machine_code._build(folder / ("x" * 300))


def test_code_that_calls_the_unknown_is_told_and_does_not_end_the_process() -> None:
    module = llvm.parse_assembly(
        f"declare void @nobody_has_this()\ndefine void @{machine_code.ENTRY}() {{\n"
        "  call void @nobody_has_this()\n  ret void\n}"
    )
    with pytest.raises(RuntimeError, match="materialize"):
        linked(llvm.Target.from_default_triple().create_target_machine(jit=True).emit_object(module))
