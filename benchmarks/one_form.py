"""The translator's C, called through ctypes, beside numba's code in a simulation: could one compiled form serve both?

``python -m benchmarks.one_form``. C keeps Python's checks of each division and function; numba leaves them out.
"""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.fmu.native.zig import c_compiler
from tsm_fmu.kernels.kernel import compiled_run, kernel

from .ratio import Ratio, compare

MODELS = ("PairedTsmBacklash", "LuGreFriction")
ROWS = 20_000
LOOP = """
#include "%s.c"
#include "checked.c"
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
"""


def ratios() -> Iterator[Ratio]:
    """Time of a step in C over that of numba; C would have to be at least as fast."""
    for name in MODELS:
        with TemporaryDirectory(prefix="tsm_fmu_bench_") as folder:
            yield _ratio(name, Path(folder))


def _ratio(name: str, folder: Path) -> Ratio:
    k = kernel(name)
    for file, text in {**model_files(k), "run.c": LOOP % name}.items():
        (folder / file).write_text(text)
    layer = str(resources.files("tsm_fmu.fmu.native").joinpath("c"))
    flags = ["-std=c99", "-O2", "-fno-math-errno", "-ffp-contract=off", "-fPIC", "-shared", "-I", layer]
    built = folder / "run.so"
    subprocess.run([*c_compiler(), *flags, str(folder / "run.c"), "-lm", "-o", str(built)], check=True)
    in_c, run = ctypes.CDLL(str(built)).run, compiled_run(k.module)
    t = 1e-3 * np.arange(ROWS)
    u = (0.4 * np.sin(2.1 * t) + 0.05 * np.sin(17.3 * t))[:, None].copy()
    y, z = np.zeros((ROWS, len(k.outputs))), np.zeros((ROWS, len(k.outputs)))
    table, spans, at = np.array([k.params()], dtype=float), np.array([[0, ROWS, 0]]), np.zeros(1, dtype=np.int64)
    places = [ctypes.c_void_p(a.ctypes.data) for a in (table, t, u, z)]

    def by_numba() -> None:
        at[0] = 0
        run(table, spans, t, u, y, at)

    def by_c() -> None:
        in_c(places[0], ctypes.c_long(ROWS), *places[1:])

    by_numba()
    by_c()
    if not np.allclose(y, z, rtol=1e-10, atol=1e-14):
        raise RuntimeError(f"{name}: C and numba differ by {np.abs(y - z).max():g} -- expected the same numbers")
    return compare(f"{name}: translated C / numba, a step of a simulation", by_c, by_numba, ROWS, 1.0)


if __name__ == "__main__":
    for row in ratios():
        print(f"{row.what:<62} {1000 * row.ours_us:7.1f} ns {1000 * row.reference_us:7.1f} ns  x {row.ratio:.3g}")
