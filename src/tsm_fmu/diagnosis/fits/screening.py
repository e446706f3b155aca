"""Which effects could be missing, and how far each would go: one linear step from the refitted baseline.

The response of a candidate is its effect applied to the baseline's own signals, at a size that matches the
gap, for a spread of its shape parameters. What of it the baseline's parameters and the nuisance freedom cannot
imitate is what the log can show of this effect; how much of the residual that part explains ranks the candidates
for the full refit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from ...effects import EFFECTS
from ...effects.coordinates import ANGLE
from ...kernels.chain import attach
from ...kernels.chain_source import Attached
from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError
from ...regression.problem import BoolArray, FloatArray
from ...regression.threads import together
from ..runs.thinning import thinned
from .refit import Fitted
from .response import Responses, public, sizes_of

ROWS = 3000
"""Samples of all runs together that the linear step looks at."""
DAMPING = 1e-4
"""Keeps a response small of which nearly all is imitated by the baseline: the linear step must not lead far away."""
IMITATED = 1e-3
"""A response of which less than this part is beyond the baseline's parameters says nothing."""


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


OF_A_TURN = ("drum_periodic", "winding_crossover")
LONG_STROKE = 1.25 * 2.0 * np.pi
"""Travel [rad] below which harmonics of an angle are any smooth function of the position: nothing repeats."""


def possible(
    model: str, channels: Sequence[str], attached: Sequence[str], inputs: Sequence[str], travel: float = np.inf
) -> list[Attached]:
    """Every effect at every place of the model where it can be seen in the channels.

    Parameters
    ----------
    model : str
    channels : sequence of str
        Measured ones.
    attached : sequence of str
        Effects that are there already.
    inputs : sequence of str
    travel : float
        Longest stroke of the runs, in the unit of the motion: effects of a turn need one.
    """
    base, found = kernel(model), []
    motion_units = ("rad", "m")
    units = {v.name: v.quantity.unit for v in base.outputs}
    for module in EFFECTS:
        if module.NAME == "quantisation":
            continue  # its levels are read from the log
        if module.NAME in OF_A_TURN and travel < LONG_STROKE:
            continue
        places = [module.NAME] if "friction" in module.PLACES else []
        if "output" in module.PLACES:
            allowed = [c for c in channels if units[c] in motion_units or not getattr(module, "MOTION_ONLY", False)]
            places += [f"{module.NAME}@{c}" for c in allowed]
        for text in places:
            try:
                one = attach(base, text)
            except InputError:
                continue
            wants_bend = "bend" in module.Inputs._fields and ANGLE not in inputs
            on_friction = not one.channel and module.NAME == "offset_drift"  # the same as on a channel
            if one.spec not in attached and not wants_bend and not on_friction and (one.channel or "@" not in text):
                if "@" not in text and one.channel:
                    continue
                found.append(one)
    return found


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
        self.left = self.responses.outside(self.responses.flat(fitted.residuals))

    def screened(self, attached: Attached) -> Screened:
        effect = Kernel(attached.module)
        sizes = sizes_of(attached.module)
        tried: list[tuple[float, dict[str, float]]] = []
        for shape in self.responses.shapes(effect):
            columns, steps = self.responses.columns(attached, shape)
            gain, amounts = self._explained(effect, sizes, np.column_stack(columns))
            values = {**shape, **{n: a * h for n, a, h in zip(sizes, amounts, steps, strict=True)}}
            tried.append((gain, {public(attached, n): v for n, v in values.items()}))
        tried.sort(key=lambda one: -one[0])
        starts = [values for _, values in tried]
        return Screened(attached, tried[0][0], starts, self.responses.limits(attached))

    def _explained(self, effect: Kernel, sizes: Sequence[str], columns: FloatArray) -> tuple[float, FloatArray]:
        """Log of the mean square left over that without the effect, and the amounts of its size parameters."""
        outside = self.responses.outside(columns)
        scale, whole = np.linalg.norm(outside, axis=0), np.linalg.norm(columns, axis=0)
        shows = scale > IMITATED * np.where(whole > 0.0, whole, np.inf)
        used = outside / np.where(shows, scale, np.inf)
        signed = {v.name: v.quantity.lo < 0.0 for v in effect.parameters}
        owner = [(i, sign) for i, n in enumerate(sizes) for sign in ((1.0, -1.0) if signed[n] else (1.0,))]
        matrix = np.column_stack([used[:, i] * sign for i, sign in owner])
        bulk = np.array([whole[i] / scale[i] if shows[i] else 1.0 for i, _ in owner])
        amounts, _ = nnls(matrix.T @ matrix + np.diag(DAMPING * bulk**2), matrix.T @ self.left)
        found = np.zeros(len(sizes))
        for (i, sign), amount in zip(owner, amounts, strict=True):
            found[i] += sign * amount / scale[i] if shows[i] else 0.0
        after = self.left - outside @ found
        count = self.counted.size
        before = np.maximum(np.sum(self.left.reshape(-1, count) ** 2, axis=0), 1e-300)
        closed = np.maximum(np.sum(after.reshape(-1, count) ** 2, axis=0), 1e-6 * before)
        return float(np.sum(np.log(before / closed)[self.counted])), found
