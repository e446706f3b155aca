"""Where to start: the preset, the scales that the data give by their dimensions, and draws around both.

A parameter in N.m/rad starts near (torque of these runs) / (angle of these runs), one in 1/rad near the inverse
of the stroke, one in s near the time that the motion takes: physical seeds for any model, from its units.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.stats import qmc

from ..batching.stopping import interruptible
from ..kernels.arrays import FloatArray
from ..logs.units import unit_to_si
from .problem import Problem
from .scaled_variables import ScaledVariables

SPREAD = math.log(30.0)
"""Draws lie within this factor (in the logarithm) of a physical scale or of the preset."""


def dimensional_scales(problem: Problem) -> dict[str, float]:
    """Size that each parameter's unit suggests, from the RMS of inputs, measured channels and input rates."""
    rows: list[dict[str, float]] = []
    sizes: list[float] = []

    def observe(unit: str, size: float, per_second: float = 0.0) -> None:
        if size > 0.0:
            base = dict(unit_to_si(unit).base)
            base["s"] = base.get("s", 0.0) - per_second
            rows.append(base)
            sizes.append(math.log(size))

    units = {v.name: v.quantity.unit for v in (*problem.kernel.inputs, *problem.kernel.outputs)}
    for j, variable in enumerate(problem.kernel.inputs):
        observe(variable.quantity.unit, _rms([r.inputs[:, j] for r in problem.runs]))
        rates = [np.gradient(r.inputs[:, j], r.time) for r in problem.runs if r.time.size > 1]
        observe(variable.quantity.unit, _rms(rates, centred=False), per_second=1.0)
    for j, channel in enumerate(problem.channels):
        observe(units[channel], _rms([r.targets[:, j] for r in problem.runs]))
    symbols = sorted({s for row in rows for s in row})
    matrix = np.array([[row.get(s, 0.0) for s in symbols] for row in rows])
    logs = dict(zip(symbols, np.linalg.lstsq(matrix, np.array(sizes), rcond=None)[0], strict=True)) if rows else {}
    return {
        f: math.exp(sum(power * logs.get(s, 0.0) for s, power in unit_to_si(v.quantity.unit).base))
        for f, v in problem.declared.items()
    }


def starts(problem: Problem, variables: ScaledVariables, count: int, seed: int) -> list[FloatArray]:
    """Points to try first, in the scaled variables: the given start, the dimensional scales, then Sobol draws.

    Parameters
    ----------
    problem : Problem
    variables : ScaledVariables
    count : int
        How many draws at least; the next power of two is taken.
    seed : int

    Returns
    -------
    list of ndarray, shape (axes,)
    """
    scales = dimensional_scales(problem)
    given = variables.of(variables.anchor)
    physical = given.copy()
    for i, axis in enumerate(variables.axes):
        if axis.run is None:
            physical[i] = axis.q(math.copysign(scales[axis.field], axis.sign or axis.centre or 1.0))
    dimensions = len(variables.axes)
    if dimensions == 0:
        return [given]
    lo, hi = variables.lo + 1e-6, variables.hi - 1e-6
    load_direction_numbers()
    draws = 2.0 * qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random_base2(math.ceil(math.log2(count))) - 1.0
    points = [given, np.clip(physical, lo, hi)]
    for n, draw in enumerate(draws):
        around = points[2 * n // len(draws)]  # either half of Sobol's draws fills the range; every second does not
        reach = np.where([bool(axis.sign) for axis in variables.axes], SPREAD, np.maximum(1.0, abs(around)))
        points.append(np.clip(around + reach * draw, lo, hi))
    return points


@cache
def load_direction_numbers() -> None:
    """Before the first Sobol draw: scipy reads them where a Ctrl-C is dropped and what is drawn then is nonsense."""
    with interruptible():
        qmc.Sobol(2)


def _rms(samples: list[FloatArray], centred: bool = True) -> float:
    values = np.concatenate(samples)
    return float(np.sqrt(np.mean((values - values.mean() * centred) ** 2)))
