"""What a fit to other runs says of parameters: how its sum of squares rises around it, to second order.

With it a fit to some runs of a rig is one to those others as well, which are not simulated: its values serve both.
A parameter that is searched in its logarithm is known in it (`scaled_variables.logarithm_sign`): there the rise is
nearer to a square over a wide range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from ..kernels.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Prior:
    """The rise of the sum of squares of a fit.

    Attributes
    ----------
    fields : tuple of str
        Shared free parameters of the fit.
    centre : ndarray, shape (fields,)
        Their values there, or the logarithms.
    logarithmic : ndarray of bool, shape (fields,)
    slopes : tuple of ndarray
        Of each channel, without a weight: a triangle whose columns are what each run has of its own, then the fields.
    """

    fields: tuple[str, ...]
    centre: FloatArray
    logarithmic: BoolArray
    slopes: tuple[FloatArray, ...]

    def only(self, fields: Sequence[str]) -> Prior:
        """What it says of some of its fields, the others wherever the sum of squares rises least."""
        kept = [f for f in self.fields if f in fields]
        own = len(self.slopes[0].T) - len(self.fields) if self.slopes else 0
        places = [self.fields.index(f) for f in kept]
        order = [*(k for k in range(own + len(self.fields)) if k - own not in places), *(own + k for k in places)]
        return Prior(
            tuple(kept), self.centre[places], self.logarithmic[places],
            tuple(triangle_of(one[:, order]) for one in self.slopes),
        )  # fmt: skip

    def rows(self, weights: FloatArray) -> FloatArray:
        """Rows whose products with the distances from the centre have the rise as their sum of squares.

        Parameters
        ----------
        weights : ndarray, shape (channels,)
            Factor of each channel's residual.
        """
        stacked = triangle_of(np.vstack([w * one for w, one in zip(weights, self.slopes, strict=True)]))
        own = stacked.shape[1] - len(self.fields)
        return stacked[own:, own:]

    def distances(self, values: FloatArray) -> FloatArray:
        """How far values of the fields are from the centre."""
        return self.searched(values) - self.centre

    def searched(self, values: FloatArray) -> FloatArray:
        """The values, or their logarithms."""
        return np.where(self.logarithmic, np.log(np.maximum(np.abs(values), 1e-300)), values)

    def unit(self, values: FloatArray) -> FloatArray:
        """Change of each value for a unit of `searched`."""
        return np.where(self.logarithmic, values, 1.0)


def triangle_of(rows: FloatArray) -> FloatArray:
    """The triangular factor of rows, as many rows as columns."""
    found = np.zeros((rows.shape[1], rows.shape[1]))
    factor = np.atleast_2d(qr(rows, mode="r")[0])[: rows.shape[1]]
    found[: len(factor)] = factor
    return found
