"""Compiled simulation against scipy's ``solve_ivp``: the same equations and motion, at equal accuracy, for each model.

Every model of the papers that has a rate equation runs with its published parameters on the motion that its paper
imposes (for two of them on that of a sister paper), 20 000 samples in 20 s.

*Equal accuracy*: the error of the kernel is its RMS distance from a high-accuracy solution of the continuous motion;
it is mostly that of inputs that hold over a sample. ``solve_ivp`` gets RK45 or LSODA, whichever is faster, with the
loosest relative tolerance, on a grid of quarter decades, whose RMS error is no larger. It also gets what favours it:
the motion in closed form (a log would have to be interpolated at each call) and scalar arithmetic from ``math``.

On such smooth motions ``solve_ivp`` steps over a hundred samples at once, which no record loop can. The rows *held*
are the kernels' contract: inputs hold from sample to sample, as in an FMU or a log that is taken literally. There the
kernel is exact, and ``solve_ivp`` (RK45) is let off with an error of 1e-4 of the output's standard deviation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from tsm_fmu.kernels.kernel import Kernel, kernel

from .equations import (
    Array,
    Equations,
    Sines,
    backlash,
    bouc_wen,
    dahl,
    lugre,
    modified_lugre,
    paired_friction,
    solved,
)
from .ratio import Ratio, compare

ROWS = 20_000
SECONDS = 20.0
HELD_SECONDS = 2.0
LIMIT = 1.0 / 100.0
HELD_ERROR = 1e-4
TOLERANCES = 10.0 ** -np.arange(2.0, 9.0, 0.25)
SECOND = 0.25 * math.sqrt(3.0)
MILLIMETRES = ((3e-3, 0.2), (2e-3, 0.35))
"""Amplitude [m] and frequency [Hz], IFToMM 2013."""
RADIANS = ((0.5, 0.2), (0.6, SECOND))
"""Amplitude [rad] and frequency [Hz], MMT 2015 and MSSP 2015, the non-periodic motion."""


class Case(NamedTuple):
    """A model, its equations, its motion and the output that is compared."""

    model: str
    equations: Callable[[Any], Equations]
    motion: tuple[tuple[float, float], ...]
    preset: str = "published"
    channel: str = "F"


CASES = (
    Case("PairedTsmBacklash", backlash, RADIANS, channel="x_out"),
    Case("LuGreFriction", lugre, MILLIMETRES),
    Case("LuGreFriction", lugre, RADIANS, "mmt2015"),
    Case("SingleTsmDahl", dahl, MILLIMETRES),
    Case("SingleTsmLuGre", modified_lugre, RADIANS),
    Case("SingleTsmBoucWen", bouc_wen, MILLIMETRES),
    Case("PairedTsmFriction", paired_friction, RADIANS),
)
HELD = CASES[1:]
"""Those driven by a speed; a position that holds and jumps is no motion."""


def ratios() -> Iterator[Ratio]:
    """One row for each case, and one for each with held inputs.

    Raises
    ------
    RuntimeError
        If ``solve_ivp`` does not reach the accuracy.
    """
    for case in CASES:
        yield _smooth(case)
    for case in HELD:
        yield _held(case)


def inputs_of(model: Kernel, motion: Sines) -> Array:
    """Inputs of a kernel by column; tensions and torques, which only add to the outputs, are 20."""
    rest = np.full(motion.time.size, 20.0)
    return np.column_stack([motion.columns.get(v.name, rest) for v in model.inputs])


def rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def as_accurate(solve: Callable[[str, float], Array], truth: Array, error: float) -> tuple[str, float, float]:
    """Method, loosest relative tolerance, and seconds of the fastest ``solve_ivp`` with at most this RMS error."""
    found: list[tuple[float, str, float]] = []
    for method in ("RK45", "LSODA"):
        for rtol in TOLERANCES.tolist():
            with np.errstate(all="ignore"):  # a tolerance can be too loose for a stiff model: that one is not taken
                begin = perf_counter()
                close = rms(solve(method, rtol) - truth) <= error
                seconds = perf_counter() - begin
            if close:
                found.append((seconds, method, rtol))
                break
    if not found:
        raise RuntimeError(f"solve_ivp does not reach the error {error:g} of the kernel")
    seconds, method, rtol = min(found)
    return method, rtol, seconds


def _named(case: Case) -> str:
    return case.model + (f" {case.preset}" if case.preset != "published" else "")


def _smooth(case: Case) -> Ratio:
    model = kernel(case.model)
    p = model.params(case.preset)
    motion, equations = Sines(case.motion, np.linspace(0.0, SECONDS, ROWS)), case.equations(p)
    inputs, column = inputs_of(model, motion), [v.name for v in model.outputs].index(case.channel)
    size = float(np.abs(solved(equations._replace(output=lambda z, _: z), motion, "LSODA", 1e-6, 1e-3)).max())
    truth = solved(equations, motion, "LSODA", 1e-9, size, step=5e-3)
    error = rms((model.simulate(p, motion.time, inputs)[:, column] - truth)[1:])
    method, rtol, _ = as_accurate(lambda method, rtol: solved(equations, motion, method, rtol, size), truth, error)
    return compare(
        f"{_named(case)} / {method} {rtol:.0e}, error {100.0 * error / np.std(truth):.1g} %",
        lambda: model.simulate(p, motion.time, inputs),
        lambda: solved(equations, motion, method, rtol, size),
        ROWS,
        LIMIT,
        rounds=7,
    )._replace(reason="solve_ivp steps over many samples")


def _held(case: Case) -> Ratio:
    model = kernel(case.model)
    p = model.params(case.preset)
    rows = int(ROWS * HELD_SECONDS / SECONDS)
    motion, equations = Sines(case.motion, np.linspace(0.0, HELD_SECONDS, rows)), case.equations(p)
    inputs, column = inputs_of(model, motion), [v.name for v in model.outputs].index(case.channel)
    truth = model.simulate(p, motion.time, inputs)[:, column]
    wanted = HELD_ERROR * float(np.std(truth))
    for rtol in TOLERANCES.tolist():
        if rms(solved(equations, motion, "RK45", rtol, held=True) - truth) <= wanted:
            break
    else:
        raise RuntimeError(f"solve_ivp does not reach an error of {wanted:g} with held inputs")
    return compare(
        f"{_named(case)} held / RK45 {rtol:.0e}, error {HELD_ERROR:.0e}",
        lambda: model.simulate(p, motion.time, inputs),
        lambda: solved(equations, motion, "RK45", rtol, held=True),
        rows,
        LIMIT,
        rounds=3,
    )
