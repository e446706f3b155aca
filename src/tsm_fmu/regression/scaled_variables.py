"""From the optimiser's scaled variables to parameter values that the model accepts.

A parameter with an open bound at zero is searched in its logarithm, every other one in units of the change
that moves the outputs by one standard deviation. A joint condition of the model has no
variable of its own: a point outside is drawn back straight to the boundary. The search then slides along that
boundary, also from a start on it, and the result names the condition that stopped it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray
from ..models.contract import Quantity
from .problem import Problem

BACK_STEPS, BACK_DIFFERENCE, BACK_INSIDE = 8, 1e-6, 1e-9
"""Steps to a boundary at most, the step of a margin's derivatives, and how far inside a point then is, all scaled."""
DECADES = 6.0
"""A logarithmic variable may leave its start by this much; there it counts as on a bound."""


@dataclass(frozen=True)
class ScaledVariable:
    """One searched value: a field, the run it belongs to (None: all), and its scale."""

    field: str
    run: int | None
    column: int
    centre: float
    scale: float
    sign: float
    lo: float
    hi: float

    def q(self, value: float) -> float:
        return math.log(max(abs(value), 1e-300)) if self.sign else (value - self.centre) / self.scale


class ScaledVariables:
    """The searched values of a problem.

    Parameters
    ----------
    problem : Problem
    shared, per_run : sequence of str
        Searched fields with one value for all runs, and with one for each.
    scales : mapping of str to float
        From `sensitivity.sensitivity_scales`.
    table : ndarray
        A valid table; the start and the anchor.
    """

    def __init__(
        self,
        problem: Problem,
        shared: Sequence[str],
        per_run: Sequence[str],
        scales: Mapping[str, float],
        table: FloatArray,
    ) -> None:
        self.problem = problem
        self.anchor = table.copy()
        self.axes = [_axis(problem, f, None, scales[f], table) for f in shared]
        self.axes += [_axis(problem, f, k, scales[f], table) for k in range(len(problem.runs)) for f in per_run]
        self.lo = np.array([axis.lo for axis in self.axes])
        self.hi = np.array([axis.hi for axis in self.axes])
        self._columns = np.array([axis.column for axis in self.axes], dtype=int)
        self._runs = np.array([-1 if axis.run is None else axis.run for axis in self.axes], dtype=int)
        self._sign = np.array([axis.sign for axis in self.axes])
        self._centre = np.array([axis.centre for axis in self.axes])
        self._scale = np.array([axis.scale for axis in self.axes])

    def of(self, table: FloatArray) -> FloatArray:
        """Scaled values of a table, strictly inside the bounds."""
        q = np.array([a.q(table[a.run or 0, a.column]) for a in self.axes])
        margin = np.minimum(1e-6, 0.01 * (self.hi - self.lo))
        return np.clip(q, self.lo + margin, self.hi - margin)

    def table(self, q: FloatArray) -> FloatArray:
        """Values at ``q``, drawn back to the boundary where the model refuses them."""
        table = self._raw(q)
        return self._raw(self._drawn_back(q)) if self._refused(table) else table

    def _drawn_back(self, q: FloatArray) -> FloatArray:
        """A point near by that the model takes; where steps to its edge lead to none, one on the way to the anchor."""
        near = q.copy()
        for _ in range(BACK_STEPS):
            broken = self._broken(near)
            if broken is None:
                break
            margin, slope = broken
            size = float(np.linalg.norm(slope))
            if not (np.isfinite(size) and size > 0.0):
                break
            near = np.clip(near + (BACK_INSIDE - margin / size) * slope / size, self.lo, self.hi)
        if not self._refused(self._raw(near)):
            return near
        anchor = np.array([a.q(self.anchor[a.run or 0, a.column]) for a in self.axes])
        inside, outside = 0.0, 1.0
        for _ in range(40):
            middle = 0.5 * (inside + outside)
            refused = self._refused(self._raw(anchor + middle * (q - anchor)))
            inside, outside = (inside, middle) if refused else (middle, outside)
        return anchor + inside * (q - anchor)

    def _broken(self, q: FloatArray) -> tuple[float, FloatArray] | None:
        """Margin of the first condition that a run does not meet at ``q``, and its derivatives; None if all are met."""
        unmet = enumerate(map(self.problem.unmet, self._distinct(self._raw(q))))
        k, condition = next(((k, c) for k, c in unmet if c is not None), (0, None))
        if condition is None:
            return None

        def margin(at: FloatArray) -> float:
            return condition.margin_of(self.problem.params(self._raw(at)[k]))

        here, slope = margin(q), np.zeros(q.size)
        for i, axis in enumerate(self.axes):
            if axis.run in (None, k):
                moved = q.copy()
                moved[i] += BACK_DIFFERENCE
                slope[i] = (margin(moved) - here) / BACK_DIFFERENCE
        return here, slope

    @property
    def groups(self) -> list[list[int]]:
        """Axes that can be moved at once: a shared field alone, or the same field of every run."""
        found: dict[tuple[str, bool], list[int]] = {}
        for i, axis in enumerate(self.axes):
            found.setdefault((axis.field, axis.run is None), []).append(i)
        return list(found.values())

    def accepts(self, q: FloatArray) -> bool:
        """Whether the model takes the values at ``q`` as they are."""
        return not self._refused(self._raw(q))

    def _raw(self, q: FloatArray) -> FloatArray:
        logarithmic, shared = self._sign != 0.0, self._runs < 0
        values = self._centre + self._scale * q
        values[logarithmic] = self._sign[logarithmic] * np.exp(q[logarithmic])
        table = self.anchor.copy()
        table[:, self._columns[shared]] = values[shared]
        table[self._runs[~shared], self._columns[~shared]] = values[~shared]
        return table

    def _refused(self, table: FloatArray) -> bool:
        if not self.problem.kernel.conditions:
            return False  # the search keeps the bounds; only a joint condition can refuse
        return self.problem.refused(self._distinct(table))

    def _distinct(self, table: FloatArray) -> FloatArray:
        """The rows of a table that can differ."""
        return table if self.problem.per_run else table[:1]


def logarithm_sign(quantity: Quantity) -> float:
    """Sign of a parameter that is searched, and known, in its logarithm; 0 for every other one."""
    if quantity.lo == 0.0 and quantity.open_lo:
        return 1.0
    return -1.0 if quantity.hi == 0.0 and quantity.open_hi else 0.0


def _axis(problem: Problem, field: str, run: int | None, scale: float, table: FloatArray) -> ScaledVariable:
    parameter, quantity = problem.space[field], problem.declared[field].quantity
    column = problem.fields.index(field)
    centre = float(table[run or 0, column])
    scale = scale if math.isfinite(scale) else max(abs(centre), 1.0)
    sign = logarithm_sign(quantity)
    if not sign:
        return ScaledVariable(
            field, run, column, centre, scale, sign, (parameter.lo - centre) / scale, (parameter.hi - centre) / scale
        )
    near, far = (parameter.lo, parameter.hi) if sign > 0.0 else (-parameter.hi, -parameter.lo)
    middle, reach = math.log(abs(centre)), DECADES * math.log(10.0)
    lo = max(middle - reach, math.log(near) if near > 0.0 else -math.inf)
    hi = min(middle + reach, math.log(far) if math.isfinite(far) else math.inf)
    return ScaledVariable(field, run, column, centre, scale, sign, lo, hi)
