"""A column that drives an effect and that the drive makes itself: two names for one cause.

Friction may follow a thermometer because the room warms up, or because the drive's own work does: where work makes
what is measured, the effect that follows the column and the one that has such a state of its own say the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.linalg import block_diag

from ...effects import about, effect_of, sizes_of, starts_of
from ...kernels.arrays import FloatArray
from ...kernels.chain import attach
from ...kernels.kernel import Kernel, kernel
from ...regression.residuals import mean_square_beside
from ..criteria import EXPLAINED_SHARE, MUCH_LESS_RATIO
from ..fits.extent import Extent
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
    if any(n != "y" and getattr(signals[0], n, None) is None for n in names):
        return
    name, role = next(iter(sizes_of(module).items()))
    starts = extent.starts(module)
    inputs = [np.column_stack([np.ones(c.time.size) if n == "y" else getattr(c, n) for n in names]) for c in signals]
    within = np.concatenate([y - y.mean() for y in column])
    for shape in extent.shapes(module):
        p = [alone.params(None, {name: role.first, **shape, **start}) for start in (starts[0], starts[-1])]
        made = [[alone.simulate(one, c.time, u)[:, 0] for one in p] for c, u in zip(signals, inputs, strict=True)]
        each = [np.column_stack([np.ones(first.size), (last - first) / role.first]) for first, last in made]
        own = np.asarray(block_diag(*each), dtype=float)
        state = np.concatenate([first - 1.0 for first, _ in made]) / role.first
        left, of_starts = (mean_square_beside(columns, within) for columns in (np.column_stack([own, state]), own))
        if left < MUCH_LESS_RATIO * of_starts:
            yield 1.0 - left / float(np.mean(within**2))
