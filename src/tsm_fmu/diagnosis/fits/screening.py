"""Which effects could be missing, and how far each would go: one linear step from the refitted baseline.

The response of a candidate is its effect applied to the baseline's own signals, at a size that matches the
gap, for a spread of its shape parameters. What of it the baseline's parameters and the nuisance effects cannot
imitate is what the log can show of this effect; how much of the residual that part explains ranks the candidates
for the full refit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from ...effects import shapes_of, sizes_of
from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.kernel import Kernel
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import IMITATED_SHARE
from .extent import quantiles
from .refit import Fitted
from .response import Acting, Responses, public

ROWS = 3000
"""Samples of all runs together that the linear step looks at."""
COLUMNS = 128
"""Responses that are looked at together, for memory."""
UNREACHED = 1e-6
"""Part of the residual's size that the response to the largest step makes at least: what does less, as a layer behind
the end of the motion, would need sizes without bounds."""
DAMPING = 1e-4
"""Keeps a response small of which nearly all is imitated by the baseline: the linear step must not lead far away."""
CLOSER, CLOSER_DRAWS, CLOSER_REACH = 2, 16, (0.1, 0.04, 0.015)
"""Of an effect with many shapes to begin from, so many of the best are improved by draws around them, at these
distances as parts of the range."""


@dataclass(frozen=True)
class Screened:
    """What one linear step says of a candidate.

    Attributes
    ----------
    attached : Attached
        Effect and place.
    gain : float
        Log of the mean square that it would leave, over all channels, with the sign turned.
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
    fitted: Fitted, candidates: Sequence[Attached], progress: Callable[[str], None] = lambda _: None
) -> list[Screened]:
    """Rank candidates by one linear step from a fitted baseline.

    Parameters
    ----------
    fitted : Fitted
    candidates : sequence of Attached
    progress : callable
        Given what is being done.
    """
    bench = _Bench(fitted)

    def one(numbered: tuple[int, Attached]) -> Screened:
        number, candidate = numbered
        progress(f"screen {number}/{len(candidates)}: {candidate.spec}")
        return bench.screened(candidate)

    return sorted(together(one, list(enumerate(candidates, 1))), key=lambda s: -s.gain)


class _Tried(NamedTuple):
    """One shape of a candidate: its gain, the quantiles of its shape parameters, and all of its values."""

    gain: float
    at: FloatArray
    values: dict[str, float]


def _closer(best: _Tried, tried: Callable[[FloatArray], list[_Tried]]) -> _Tried:
    """The best shape in a neighbourhood that shrinks: many shapes between those of a first draw fit nothing."""
    rng = np.random.default_rng(11)
    for reach in CLOSER_REACH:
        near = np.clip(best.at + reach * rng.standard_normal((CLOSER_DRAWS, best.at.size)), 0.0, 1.0)
        best = max([best, *tried(near)], key=lambda one: one.gain)
    return best


class _Bench:
    """The linearised baseline, on which candidates are tried."""

    def __init__(self, fitted: Fitted) -> None:
        fitted = fitted.at(thinned(fitted.problem.kernel, fitted.problem.runs, ROWS, ROWS // 10))
        self.channels = len(fitted.problem.channels)
        self.responses = Responses(fitted, 1.0 / np.maximum(fitted.rmse, 1e-12 * fitted.spread))
        self.residual = self.responses.outside(self.responses.flat(fitted.residuals))
        self.before = self._squares(self.residual)

    def screened(self, attached: Attached) -> Screened:
        acting, module = self.responses.acting(attached), attached.module
        tried = partial(self._tried, acting)
        found = sorted(tried(quantiles(module)), key=lambda one: -one.gain)
        if any(shape.tries for shape in shapes_of(module).values()):
            found = sorted([*(_closer(one, tried) for one in found[:CLOSER]), *found], key=lambda one: -one.gain)
        return Screened(attached, found[0].gain, [one.values for one in found], self.responses.limits(acting))

    def _tried(self, acting: Acting, at: FloatArray) -> list[_Tried]:
        """An effect at several shapes, by the quantiles of their ranges."""
        module, found = acting.attached.module, []
        sizes = list(sizes_of(module))
        for few in np.array_split(at, math.ceil(len(at) * len(sizes) / COLUMNS)):
            shapes = [self.responses.shape_at(module, one) for one in few]
            columns, steps = acting.columns(shapes)
            outside = self.responses.outside(columns)
            for one, shape, *parts in zip(few, shapes, columns, outside, steps.tolist(), strict=True):
                gain, amounts = self._explained(acting.effect, sizes, parts[0], parts[1])
                values = {**shape, **{n: a * h for n, a, h in zip(sizes, amounts, parts[2], strict=True)}}
                found.append(_Tried(gain, one, {public(acting.attached, n): float(v) for n, v in values.items()}))
        return found

    def _explained(
        self, effect: Kernel, sizes: Sequence[str], columns: FloatArray, outside: FloatArray
    ) -> tuple[float, FloatArray]:
        """Log of the mean square left over that without the effect, and the amounts of its size parameters."""
        scale, whole = (np.sqrt(np.einsum("ij,ij->i", rows, rows)) for rows in (outside, columns))
        reaches = whole > UNREACHED * np.linalg.norm(self.residual)
        shows = scale > IMITATED_SHARE * np.where(reaches, whole, np.inf)
        used = outside / np.where(shows, scale, np.inf)[:, None]
        signed = {v.name: v.quantity.lo < 0.0 for v in effect.parameters}
        owner = [(i, sign) for i, n in enumerate(sizes) for sign in ((1.0, -1.0) if signed[n] else (1.0,))]
        rows, signs = [i for i, _ in owner], np.array([sign for _, sign in owner])
        gram, cross = used @ used.T, used @ self.residual
        bulk = np.array([whole[i] / scale[i] if shows[i] else 1.0 for i in rows])
        normal = gram[np.ix_(rows, rows)] * np.outer(signs, signs) + np.diag(DAMPING * bulk**2)
        amounts, _ = nnls(normal, cross[rows] * signs)
        found = np.zeros(len(sizes))
        for (i, sign), amount in zip(owner, amounts, strict=True):
            found[i] += sign * amount / scale[i] if shows[i] else 0.0
        after = self.residual - found @ outside
        closed = np.maximum(self._squares(after), 1e-6 * self.before)
        return float(np.sum(np.log(self.before / closed))), found

    def _squares(self, column: FloatArray) -> FloatArray:
        """Sum of squares by channel."""
        by_channel = column.reshape(-1, self.channels)
        return np.maximum(np.einsum("ij,ij->j", by_channel, by_channel), 1e-300)
