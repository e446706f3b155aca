"""Compiled kernel steps against the same loop written in C and compiled with -O3."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tsm_fmu.kernels.kernel import compiled_run, kernel

from .ratio import Ratio, compare

LIMIT = 1.5
ROWS = 20_000
SOURCE = Path(__file__).with_name("kernels.c")
FUNCTIONS = {"PairedTsmBacklash": "coleman_hodgdon", "LuGreFriction": "lugre"}


def ratios() -> Iterator[Ratio]:
    """One ratio per kernel; the results must agree first.

    Raises
    ------
    RuntimeError
        If there is no C compiler, or C and kernel do not give the same numbers.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError("C compiler -- expected gcc or cc on PATH -- install one")
    with TemporaryDirectory(prefix="tsm_fmu_bench_") as folder:
        path = Path(folder) / "kernels.so"
        subprocess.run([compiler, "-O3", "-fPIC", "-shared", str(SOURCE), "-o", str(path), "-lm"], check=True)
        library = ctypes.CDLL(str(path))
        for name, function in FUNCTIONS.items():
            yield _ratio(name, getattr(library, function))


def _ratio(name: str, c_function: ctypes._CFuncPtr) -> Ratio:  # type: ignore[name-defined]
    k = kernel(name)
    run = compiled_run(k.module)
    t = 1e-3 * np.arange(ROWS)
    random = np.random.default_rng(7)
    u = (0.4 * np.sin(2.1 * t) + 0.05 * np.sin(17.3 * t) + 1e-3 * random.standard_normal(ROWS))[:, None].copy()
    y, z = np.zeros((ROWS, len(k.outputs))), np.zeros((ROWS, len(k.outputs)))
    table, spans, at = np.array([k.params()], dtype=float), np.array([[0, ROWS, 0]]), np.zeros(1, dtype=np.int64)
    arguments = [table, t, u, z]
    pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in arguments]
    rows = ctypes.c_long(ROWS)

    def ours() -> None:
        at[0] = 0
        run(table, spans, t, u, y, at)

    def in_c() -> None:
        c_function(pointers[0], rows, *pointers[1:])

    ours()
    in_c()
    if not np.allclose(y, z, rtol=1e-10, atol=1e-14):
        raise RuntimeError(f"{name}: kernel and C differ by {np.abs(y - z).max():g} -- expected the same numbers")
    return compare(f"{name}: compiled kernel / C -O3", ours, in_c, ROWS, LIMIT)
