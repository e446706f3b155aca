"""The translator's C, called through ctypes, beside numba's code: could one compiled form serve FMUs and Python alike?

``python -m benchmarks.one_form``. Of models and of chains as a diagnosis tries them: a step of a simulation, which is
what fits and diagnoses spend their time on; a Jacobian by all real parameters, in C by forward differentiation, as the
fits do it by numba with forward differences; and what is waited for before the first of them, the compiler. C keeps
Python's checks of each division and function; numba leaves them out. Times of compilers are CPU.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.fmu.native.zig import c_compiler
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.compiled_cache import VARIABLE
from tsm_fmu.kernels.kernel import Kernel, compiled_run
from tsm_fmu.models.contract import flat

from .ratio import Ratio, compare

UNITS = (
    "PairedTsmBacklash",
    "LuGreFriction",
    "PairedTsmFriction",
    "SingleTsmBoucWen",
    "TendonDrive",
    "TendonDrive+load_dependence",
    "TendonDrive+load_dependence+backlash@x_out",
    "DistalEstimator+coulomb",
)
ROWS = 10_000
CHANGE = 1e-6
COMPILE = "--compile"
LOOP = """
#include "%s.c"
#include "%s_derivatives.c"
#include "checked.c"
#include <string.h>
int run(const Params *p, long rows, const double *t, const double *u, double *y)
{
    State s, after;
    Outputs o;
    Fault fault = {false, ""};
    long k;
    model_start(p, (const Inputs *)u, &s, &o, &fault);
    ((Outputs *)y)[0] = o;
    for (k = 1; k < rows && !fault.raised; k++) {
        model_step(p, &s, (const Inputs *)u + k, t[k] - t[k - 1], &after, &o, &fault);
        s = after;
        ((Outputs *)y)[k] = o;
    }
    return fault.raised;
}

/* Outputs, and their slopes along each of the directions, one after the other. */
int jacobian(const Params *p, const Params *along, long many, long rows, const double *t, const double *u, double *y)
{
    Inputs still;
    Fault fault = {false, ""};
    long k, j;
    memset(&still, 0, sizeof still);
    for (j = 0; j < many && !fault.raised; j++) {
        State s, ds, after, dafter;
        Outputs o;
        model_start(p, (const Inputs *)u, &s, &o, &fault);
        model_start_derivative(p, (const Inputs *)u, along + j, &still, &ds, (Outputs *)y + j * rows, &fault);
        for (k = 1; k < rows && !fault.raised; k++) {
            const Inputs *now = (const Inputs *)u + k;
            const double dt = t[k] - t[k - 1];
            model_step_derivative(p, &s, now, dt, along + j, &ds, &still, &dafter, (Outputs *)y + j * rows + k, &fault);
            model_step(p, &s, now, dt, &after, &o, &fault);
            s = after;
            ds = dafter;
        }
    }
    return fault.raised;
}
"""


def ratios() -> Iterator[Ratio]:
    """Time in C over that of numba; C would have to be at least as fast everywhere. None of them is a limit.

    Raises
    ------
    RuntimeError
        Where their numbers differ.
    """
    for text in UNITS:
        with TemporaryDirectory(prefix="tsm_fmu_bench_") as folder:
            yield from _ratios(text, Path(folder))


def _kernel(text: str) -> Kernel:
    model, *effects = text.split("+")
    return chain(model, tuple(effects))


def _ratios(text: str, folder: Path) -> Iterator[Ratio]:
    k = _kernel(text)
    begin = sum(os.times()[2:4])
    library = _compiled(k, folder)
    in_gcc = sum(os.times()[2:4]) - begin
    p = np.array(flat(k.params()), dtype=float)
    t, u = _motion(k)
    columns = [j for j, v in enumerate(k.parameters) if v.kind is float]
    directions = np.eye(p.size)[columns]
    y, z = np.zeros((ROWS, len(k.outputs))), np.zeros((ROWS, len(k.outputs)))
    slopes = np.zeros((len(columns), ROWS, len(k.outputs)))
    by_numba, by_c = _numba(k, p[None, :], t, u, y), _c(library.run, p, None, t, u, z)
    by_numba()
    by_c()
    if not np.allclose(y, z, rtol=1e-10, atol=1e-14):
        raise RuntimeError(f"{text}: C and numba differ by {np.abs(y - z).max():g} -- expected the same numbers")
    yield compare(f"{text}: C / numba, a step of a simulation", by_c, by_numba, ROWS, float("inf"))
    if all(v.kind is float for v in k.parameters):
        table = p + CHANGE * np.vstack([np.zeros(p.size), directions])
        differences = _numba(k, table, t, u, np.zeros((ROWS * len(table), len(k.outputs))))
        slope = _c(library.jacobian, p, directions, t, u, slopes)
        yield compare(f"{text}: the same, Jacobian by {len(columns)} parameters", slope, differences, ROWS,
                      float("inf"), rounds=11)  # fmt: skip
    words = [sys.executable, "-m", "benchmarks.one_form", COMPILE, text]
    environment = {**os.environ, VARIABLE: ""}
    in_numba = float(subprocess.run(words, check=True, capture_output=True, text=True, env=environment).stdout)
    yield Ratio(f"{text}: the same, compiler", 1e6 * in_gcc, 1e6 * in_numba, in_gcc / in_numba, float("inf"))


def _compiled(k: Kernel, folder: Path) -> ctypes.CDLL:
    files = model_files(k)
    name = next(file for file in files if file.endswith("_derivatives.c")).removesuffix("_derivatives.c")
    for file, text in {**files, "run.c": LOOP % (name, name)}.items():
        (folder / file).write_text(text)
    layer = str(resources.files("tsm_fmu.fmu.native").joinpath("c"))
    flags = ["-std=c99", "-O2", "-fno-math-errno", "-ffp-contract=off", "-fPIC", "-shared", "-I", layer]
    built = folder / "run.so"
    subprocess.run([*c_compiler(), *flags, str(folder / "run.c"), "-lm", "-o", str(built)], check=True)
    return ctypes.CDLL(str(built))


def _motion(k: Kernel) -> tuple[np.ndarray, np.ndarray]:
    t = 1e-3 * np.arange(ROWS)
    scale = 1e-4 if k.motion == "v" else 1.0
    one = scale * (0.4 * np.sin(2.1 * t) + 0.05 * np.sin(17.3 * t))
    return t, np.column_stack([one / (1 + j) + (0.3 * j) for j in range(len(k.inputs))])


def _numba(k: Kernel, table: np.ndarray, t: np.ndarray, u: np.ndarray, y: np.ndarray) -> Callable[[], None]:
    run, at = compiled_run(k.module), np.zeros(1, dtype=np.int64)
    spans = np.array([[0, ROWS, ROWS * j] for j in range(len(table))])

    def call() -> None:
        at[0] = 0
        run(table, spans, t, u, y, at)

    return call


def _c(function: Any, p: np.ndarray, directions: np.ndarray | None, *arrays: np.ndarray) -> Callable[[], None]:
    places = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
    given = [ctypes.c_void_p(p.ctypes.data)]
    if directions is not None:
        given += [ctypes.c_void_p(directions.ctypes.data), ctypes.c_long(len(directions))]

    def call() -> None:
        if function(*given, ctypes.c_long(ROWS), *places):
            raise RuntimeError("a step failed")

    return call


def _numba_compile_time(text: str) -> float:
    """CPU seconds until the first simulation, with nothing kept."""
    k = _kernel(text)
    t, u = _motion(k)
    import numba  # noqa: F401  its import is no part of this

    begin = process_time()
    _numba(k, np.array([flat(k.params())], dtype=float), t, u, np.zeros((ROWS, len(k.outputs))))()
    return process_time() - begin


if __name__ == "__main__":
    if COMPILE in sys.argv:
        print(_numba_compile_time(sys.argv[-1]))
    else:
        for row in ratios():
            print(f"{row.what:<92} {row.ours_us:>10.3f} us {row.reference_us:>10.3f} us  x {row.ratio:.3g}", flush=True)
