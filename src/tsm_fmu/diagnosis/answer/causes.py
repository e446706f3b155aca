"""A column that drives an effect and that the drive makes itself: two names for one cause.

Friction may follow a thermometer because the room warms up, or because the drive's own work does: where work makes
what is measured, the effect that follows the column and the one that has such a state of its own say the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from ...effects import about, effect_of, shapes_of, sizes_of, starts_of
from ...kernels.arrays import FloatArray
from ...kernels.chain import attach
from ...kernels.kernel import Kernel, kernel
from ..criteria import EXPLAINED_SHARE, MUCH_LESS_RATIO
from ..fits.extent import Extent, quantiles
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..runs.motion_signals import Coordinates


def made_by_the_drive(spec: str, fitted: Fitted) -> str | None:
    """Id of the effect whose own state is what the column of another one shows; None if no motion makes that column.

    Parameters
    ----------
    spec : str
        The effect, as ``id~column`` or without.
    fitted : Fitted
        On the runs.
    """
    drives = attach(kernel(fitted.model), spec).drives
    alike = [e for e in about(spec).looks_like if starts_of(effect_of(e))]
    if not drives or not alike:
        return None
    names, signals = [v.name for v in fitted.problem.kernel.inputs], places_of(fitted)
    column = [run.inputs[:, names.index(drives[0].column)] for run in fitted.problem.runs]
    shares = {e: max(_shares(e, column, signals), default=0.0) for e in alike}
    most = max(shares, key=lambda e: shares[e])
    return most if shares[most] > EXPLAINED_SHARE else None


def _shares(effect: str, column: Sequence[FloatArray], signals: Sequence[Coordinates]) -> Iterator[float]:
    """Part of the mean square of a column within runs that is what an effect makes of a constant, shape by shape.

    With any state at the start of each run; without what such states alone explain as well, which any slow wandering
    has.

    Parameters
    ----------
    effect : str
    column : sequence of ndarray
        In each run.
    signals : sequence of Coordinates
    """
    module = effect_of(effect)
    alone, extent = Kernel(module), Extent(signals)
    names = [v.name for v in alone.inputs]
    if any(name != "y" and getattr(signals[0], name, None) is None for name in names):
        return
    size = next(iter(sizes_of(module).items()))
    tries = product(*([min(x), max(x)] for x in map(extent.states, starts_of(module).values())))
    starts = [dict(zip(starts_of(module), values, strict=True)) for values in tries]
    inputs = [np.column_stack([np.ones(c.time.size) if n == "y" else getattr(c, n) for n in names]) for c in signals]
    within = np.concatenate([y - y.mean() for y in column])
    edges = np.cumsum([0, *(y.size for y in column)])
    for row in quantiles(module):
        shape = {n: extent.at_quantile(s, float(q)) for (n, s), q in zip(shapes_of(module).items(), row, strict=True)}
        p = [alone.params(None, {size[0]: size[1].first, **shape, **start}) for start in (starts[0], starts[-1])]
        made = [[alone.simulate(one, c.time, u)[:, 0] for one in p] for c, u in zip(signals, inputs, strict=True)]
        own = np.zeros((edges[-1], 2 * len(column)))
        for k, (first, last) in enumerate(made):
            own[edges[k] : edges[k + 1], 2 * k] = 1.0
            own[edges[k] : edges[k + 1], 2 * k + 1] = (last - first) / size[1].first
        state = np.concatenate([first - 1.0 for first, _ in made]) / size[1].first
        left, of_starts = (_left(within, basis) for basis in (np.column_stack([own, state]), own))
        if left < MUCH_LESS_RATIO * of_starts:
            yield 1.0 - left / float(within @ within)


def _left(y: FloatArray, basis: FloatArray) -> float:
    """Sum of squares of a signal beside columns."""
    return float(np.sum((y - basis @ np.linalg.lstsq(basis, y)[0]) ** 2))
