"""Which effects could be missing, and how far each would go: one linear step from the refitted baseline.

The response of a candidate is its effect applied to the baseline's own signals, at a size that matches the
gap, for a spread of its shape parameters. What of it the baseline's parameters and the nuisance effects cannot
imitate is what the log can show of this effect; how much of the residual that part explains ranks the candidates
for the full refit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from ...effects import sizes_of
from ...kernels.arrays import BoolArray, FloatArray
from ...kernels.attached import Attached
from ...kernels.kernel import Kernel
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import IMITATED_SHARE
from .refit import Fitted
from .response import Responses, public

ROWS = 3000
"""Samples of all runs together that the linear step looks at."""
UNREACHED = 1e-6
"""Part of the residual's size that the response to the largest step makes at least: what does less, as a layer behind
the end of the motion, would need sizes without bounds."""
DAMPING = 1e-4
"""Keeps a response small of which nearly all is imitated by the baseline: the linear step must not lead far away."""


@dataclass(frozen=True)
class Screened:
    """What one linear step says of a candidate.

    Attributes
    ----------
    attached : Attached
        Effect and place.
    gain : float
        Log of the mean square that it would leave, over all counted channels, with the sign turned.
    starts : list of dict of str to float
        Parameters of the effect at the best shapes, best first, by public name of the chain.
    limits : dict of str to tuple
        Range of its shape parameters.
    """

    attached: Attached
    gain: float
    starts: list[dict[str, float]]
    limits: dict[str, tuple[float, float]]


def screen(
    fitted: Fitted, candidates: Sequence[Attached], counted: BoolArray,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Screened]:  # fmt: skip
    """Rank candidates by one linear step from a fitted baseline.

    Parameters
    ----------
    fitted : Fitted
    candidates : sequence of Attached
    counted : ndarray of bool, shape (channels,)
        Channels whose gap counts.
    progress : callable
        Given what is being done.
    """
    bench = _Bench(fitted, counted)

    def one(numbered: tuple[int, Attached]) -> Screened:
        number, candidate = numbered
        progress(f"screen {number}/{len(candidates)}: {candidate.spec}")
        return bench.screened(candidate)

    return sorted(together(one, list(enumerate(candidates, 1))), key=lambda s: -s.gain)


class _Bench:
    """The linearised baseline, on which candidates are tried."""

    def __init__(self, fitted: Fitted, counted: BoolArray) -> None:
        self.counted = counted
        fitted = fitted.at(thinned(fitted.problem.kernel, fitted.problem.runs, ROWS, ROWS // 10))
        self.responses = Responses(fitted, 1.0 / np.maximum(fitted.rmse, 1e-12 * fitted.spread))
        self.residual = self.responses.outside(self.responses.flat(fitted.residuals))

    def screened(self, attached: Attached) -> Screened:
        acting = self.responses.acting(attached)
        sizes = list(sizes_of(attached.module))
        tried: list[tuple[float, dict[str, float]]] = []
        for shape in self.responses.shapes(attached.module):
            columns, steps = acting.columns(shape)
            gain, amounts = self._explained(acting.effect, sizes, np.column_stack(columns))
            values = {**shape, **{n: a * h for n, a, h in zip(sizes, amounts, steps, strict=True)}}
            tried.append((gain, {public(attached, n): v for n, v in values.items()}))
        tried.sort(key=lambda one: -one[0])
        starts = [values for _, values in tried]
        return Screened(attached, tried[0][0], starts, self.responses.limits(acting))

    def _explained(self, effect: Kernel, sizes: Sequence[str], columns: FloatArray) -> tuple[float, FloatArray]:
        """Log of the mean square left over that without the effect, and the amounts of its size parameters."""
        outside = self.responses.outside(columns)
        scale, whole = np.linalg.norm(outside, axis=0), np.linalg.norm(columns, axis=0)
        reaches = whole > UNREACHED * np.linalg.norm(self.residual)
        shows = scale > IMITATED_SHARE * np.where(reaches, whole, np.inf)
        used = outside / np.where(shows, scale, np.inf)
        signed = {v.name: v.quantity.lo < 0.0 for v in effect.parameters}
        owner = [(i, sign) for i, n in enumerate(sizes) for sign in ((1.0, -1.0) if signed[n] else (1.0,))]
        matrix = np.column_stack([used[:, i] * sign for i, sign in owner])
        bulk = np.array([whole[i] / scale[i] if shows[i] else 1.0 for i, _ in owner])
        amounts, _ = nnls(matrix.T @ matrix + np.diag(DAMPING * bulk**2), matrix.T @ self.residual)
        found = np.zeros(len(sizes))
        for (i, sign), amount in zip(owner, amounts, strict=True):
            found[i] += sign * amount / scale[i] if shows[i] else 0.0
        after = self.residual - outside @ found
        count = self.counted.size
        before = np.maximum(np.sum(self.residual.reshape(-1, count) ** 2, axis=0), 1e-300)
        closed = np.maximum(np.sum(after.reshape(-1, count) ** 2, axis=0), 1e-6 * before)
        return float(np.sum(np.log(before / closed)[self.counted])), found
