"""What a card keeps of a fit's errors: standard errors, and how they go together."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..card import Correlation
from ..kernels.kernel import Kernel
from .scaled_variables import logarithm_sign
from .uncertainty import Uncertainty

LOOSE = 10.0
"""Standard error of a logarithm from which on the parameter is not determined: e**10 times as much does as well."""


def correlation(
    kernel: Kernel, known: Uncertainty, errors: Mapping[str, float | None], values: Mapping[str, float]
) -> Correlation | None:
    """How the errors of the shared parameters go together; None where the log determines none of them.

    Parameters with an open bound at zero are taken in their logarithm, the coordinate in which they were searched.

    Parameters
    ----------
    kernel : Kernel
        The model that was fitted.
    known : Uncertainty
    errors : mapping of str to float or None
        Standard errors that the card states, by field; None or NaN where the log does not determine the parameter.
    values : mapping of str to float
        Of the parameters, by field.
    """
    declared = {v.field: v for v in kernel.parameters}

    def determined(field: str) -> bool:
        error = errors.get(field)
        if error is None or not math.isfinite(error):
            return False
        return not (logarithm_sign(declared[field].quantity) and error > LOOSE * abs(values[field]))

    kept = [k for k, field in enumerate(known.names) if determined(field)]
    if not kept:
        return None
    names = tuple(declared[known.names[k]].name for k in kept)
    matrix = np.clip(known.correlation[np.ix_(kept, kept)], -1.0, 1.0)
    matrix = 0.5 * (matrix + matrix.T)
    np.fill_diagonal(matrix, 1.0)
    taken = tuple(declared[known.names[k]].name for k in kept if logarithm_sign(declared[known.names[k]].quantity))
    return Correlation(names, tuple(tuple(row) for row in matrix.tolist()), taken)
