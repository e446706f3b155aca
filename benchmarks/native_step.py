"""Native FMUs against the same equations written by hand in C, and against the Python flavour.

Both sides are called from C, or both from Python with buffers made beforehand, in one run, by turns.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np

from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.stimuli import stimuli
from tsm_fmu.kernels.kernel import Kernel, kernel

from . import fmu_cost
from .kernel_vs_c import FUNCTIONS, SOURCE
from .ratio import Ratio, compare

LIMIT = 1.3
REASON = "three calls through FMI with their checks, beside a loop without a call"
ROWS = 20_000

HOST = """
#include <stddef.h>

typedef int (*Step)(void *, double, double, int);
typedef int (*Set)(void *, const unsigned *, size_t, const double *);
typedef int (*Get)(void *, const unsigned *, size_t, double *);

/* Steps an FMU over a table: set one input, doStep, get the outputs. */
int drive(void *step, void *set, void *get, void *unit, long rows, double start, double size, const unsigned *input,
    const double *u, const unsigned *outputs, size_t n, double *y)
{
    long k;
    int worst = 0, status;
    for (k = 0; k < rows; k++) {
        status = ((Set)set)(unit, input, 1, u + k);
        worst = status > worst ? status : worst;
        status = ((Step)step)(unit, start + k * size, size, 1);
        worst = status > worst ? status : worst;
        status = ((Get)get)(unit, outputs, n, y + k * n);
        worst = status > worst ? status : worst;
    }
    return worst;
}
"""


def ratios() -> Iterator[Ratio]:
    """Native doStep over hand-written C, and over the Python flavour.

    Raises
    ------
    RuntimeError
        If there is no C compiler, or a unit refuses a step.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError("C compiler -- expected gcc or cc on PATH -- install one")
    with TemporaryDirectory(prefix="tsm_fmu_bench_") as place:
        folder = Path(place)
        (folder / "host.c").write_text(HOST)
        for source, library in ((str(SOURCE), "kernels.so"), (str(folder / "host.c"), "host.so")):
            flags = ["-O3", "-fPIC", "-shared", "-Wno-pedantic"]
            subprocess.run([compiler, *flags, source, "-o", str(folder / library), "-lm"], check=True)
        by_hand, host = ctypes.CDLL(str(folder / "kernels.so")), ctypes.CDLL(str(folder / "host.so"))
        for name, function in FUNCTIONS.items():
            yield _against_c(kernel(name), getattr(by_hand, function), host, folder)
        for name in FUNCTIONS:
            yield _against_python(kernel(name), folder)


def _against_c(k: Kernel, c_function: Callable[..., object], host: ctypes.CDLL, folder: Path) -> Ratio:
    path = build_fmu(k, folder / f"{k.name}_native.fmu", name=k.name, flavour="native", platforms=["linux64"])
    t = 2.0**-10 * np.arange(ROWS)
    u = 0.4 * np.sin(2.1 * t) + 0.05 * np.sin(17.3 * t)
    y, z = np.zeros((ROWS, len(k.outputs))), np.zeros((ROWS, len(k.outputs)))
    table = np.array([k.params()], dtype=float)
    with unpacked(path) as unpacked_folder:
        described = fmpy.read_model_description(str(unpacked_folder))
        library = ctypes.CDLL(f"{unpacked_folder}/binaries/linux64/{k.name}.so")
        library.fmi2Instantiate.restype = ctypes.c_void_p
        callbacks = (ctypes.c_void_p * 5)()
        unit = ctypes.c_void_p(library.fmi2Instantiate(b"one", 1, str(described.guid).encode(), b"", callbacks, 0, 0))
        no = ctypes.c_double(0.0)
        library.fmi2SetupExperiment(unit, 0, no, no, 0, no)
        library.fmi2EnterInitializationMode(unit)
        library.fmi2ExitInitializationMode(unit)
        references = {v.name: v.valueReference for v in described.modelVariables}
        input_ = (ctypes.c_uint * 1)(references[k.inputs[0].name])
        outputs = (ctypes.c_uint * len(k.outputs))(*(references[v.name] for v in k.outputs))
        calls = [ctypes.cast(library[f"fmi2{n}"], ctypes.c_void_p) for n in ("DoStep", "SetReal", "GetReal")]
        done = 0

        def ours() -> None:
            nonlocal done
            begin, size = ctypes.c_double(done * 2.0**-10), ctypes.c_double(2.0**-10)
            worst = host.drive(*calls, unit, ctypes.c_long(ROWS), begin, size, input_, _address(u), outputs,
                               ctypes.c_size_t(len(outputs)), _address(y))  # fmt: skip
            if worst:
                raise RuntimeError(f"{k.name} returned status {worst}")
            done += ROWS

        def in_c() -> None:
            c_function(_address(table), ctypes.c_long(ROWS), _address(t), _address(u), _address(z))

        found = compare(f"{k.name}: native set + doStep + get / C -O3", ours, in_c, ROWS, LIMIT)._replace(reason=REASON)
        library.fmi2FreeInstance(unit)
    return found


def _against_python(k: Kernel, folder: Path) -> Ratio:
    native = build_fmu(k, folder / f"{k.name}_n.fmu", name=k.name, flavour="native", platforms=["linux64"])
    python = build_fmu(k, folder / f"{k.name}_p.fmu", name=k.name, flavour="python")
    with ExitStack() as stack:
        ours, theirs = (stack.enter_context(fmu_cost.loop(path, k)) for path in (native, python))
        calls = len(stimuli(k, step=fmu_cost.STEP))
        return compare(f"{k.name}: native / python flavour, from Python", ours, theirs, calls, 1.0)


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
