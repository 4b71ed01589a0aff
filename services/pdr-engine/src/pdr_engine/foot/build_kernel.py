"""Compiles the kernel for `machine_code`: ``python -m pdr_engine.foot.build_kernel FILE``.

numba gives LLVM's text of `stream.feed` behind a plain C signature. LLVM then takes the whole of it as one closed
program: it proves that nothing in it raises or frees, and drops the calls of numba and the interpreter that could
have. What is left calls C's library alone, and is written only once it has given the very bits that numba's gives.
"""

import sys
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import carray, cfunc, from_dtype, types

from pdr_engine.foot.kernel_cache import write_sealed
from pdr_engine.foot.machine_code import C_LIBRARY, ENTRY, KernelError, linked, run_by_numba
from pdr_engine.foot.settings import FootSettings
from pdr_engine.foot.stream import feed
from pdr_engine.foot.tables import CHUNK, ROWS, SHAPES, Tables, fresh_tables

SIGNATURE = types.void(
    *(types.CPointer(from_dtype(dtype)) for dtype, _ in SHAPES.values()), types.int64, types.boolean
)
_INTERVAL_NS = 5_000_000


def _entry(
    state: Any, parameters: Any, batch: Any, estimates: Any, steps: Any, count: int, ends: bool
) -> None:
    """`feed` on addresses."""
    feed(
        carray(state, 1),
        carray(parameters, 1),
        carray(batch, CHUNK),
        count,
        ends,
        carray(estimates, ROWS),
        carray(steps, ROWS),
    )


def compile_feed() -> bytes:
    """The object file of `feed` for this processor."""
    return object_code(cfunc(SIGNATURE, error_model="numpy")(_entry))


def object_code(compiled: Any) -> bytes:
    """The object file of a compiled C callback, named `ENTRY`; KernelError if it needs more than C's library."""
    machine = _host()
    module = llvm.parse_assembly(compiled.inspect_llvm())
    _close(module, compiled.native_name, machine)
    module.get_function(compiled.native_name).name = ENTRY
    if strangers := _strangers(module):
        raise KernelError(f"it may not raise, allocate or call Python, but refers to {', '.join(strangers)}")
    code: bytes = machine.emit_object(module)
    return code


def _host() -> llvm.TargetMachine:
    """This processor with all its features, as numba compiles for it."""
    target = llvm.Target.from_triple(llvm.get_process_triple())
    features = llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=3, jit=True)


def _close(module: llvm.ModuleRef, entry: str, machine: llvm.TargetMachine) -> None:
    """Nobody but the entry's caller calls in: let LLVM find out what can never happen, and leave that out."""
    for function in module.functions:
        if not function.is_declaration and function.name != entry:
            function.linkage = llvm.Linkage.internal
    passes = llvm.create_new_module_pass_manager()
    passes.add_ipsccp_pass()
    passes.add_simplify_cfg_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(3)))


def _strangers(module: llvm.ModuleRef) -> list[str]:
    """What the module refers to outside itself, C's library and LLVM's own operations."""
    outside = [it.name for it in (*module.functions, *module.global_variables) if it.is_declaration]
    return sorted(name for name in outside if not name.startswith("llvm.") and name not in C_LIBRARY)


def check(code: bytes) -> None:
    """Run a few strides by this code and by numba's; KernelError if a bit differs."""
    ours, numbas = _walked(linked(code)), _walked(run_by_numba)
    for name in SHAPES:
        if getattr(ours, name).tobytes() != getattr(numbas, name).tobytes():
            raise KernelError(f"machine code and numba's own differ in {name}")


def _walked(bind: Any) -> Tables:
    """The tables after some strides by this kernel: a second of rest, then swings and stances in turns."""
    tables = fresh_tables(FootSettings())
    seconds = np.arange(CHUNK) * _INTERVAL_NS * 1e-9
    swing = np.where((seconds > 1.0) & (seconds % 1.0 < 0.5), np.sin(4.0 * np.pi * seconds), 0.0)
    tables.batch["time_ns"] = np.arange(CHUNK) * _INTERVAL_NS
    tables.batch["accel"] = np.outer(swing, [25.0, 1.0, 12.0])
    tables.batch["accel"][:, 2] += 9.81
    tables.batch["gyro"] = np.outer(swing, [0.5, 8.0, 0.3])
    tables.batch["mag"] = np.outer(1.0 + 0.1 * np.sin(seconds), [15.0, 5.0, -40.0])
    bind(tables)(CHUNK, True)
    return tables


def build(path: Path) -> None:
    """Write the object file, once it has proved itself."""
    code = compile_feed()
    check(code)
    write_sealed(path, code)


if __name__ == "__main__":
    build(Path(sys.argv[1]))
