"""Where the residual of a fit lies, on what it depends, and a formula for it."""

from __future__ import annotations

from ..evidence import Place, ResidualShape
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.formula import shapes
from ..residual.locate import locate
from ..runs.motion_signals import coordinate_units


def located(fitted: Fitted, seed: int, *, formulas: bool) -> tuple[tuple[Place, ...], tuple[ResidualShape, ...]]:
    """Places of a fit's residual, most telling first, and its shape over the leading coordinates.

    Parameters
    ----------
    fitted : Fitted
    seed : int
        Of the noise that both are compared with.
    formulas : bool
        Whether formulas are looked for: only where something is missing.
    """
    channels, places = fitted.problem.channels, places_of(fitted)
    motion_unit, load_unit = coordinate_units(fitted.problem.kernel)
    where = locate(fitted.residuals, places, channels, motion_unit, load_unit, seed)
    units = {v.name: v.quantity.unit for v in fitted.problem.kernel.outputs}
    found = shapes(
        fitted.residuals, places, channels, [units[c] for c in channels], where, motion_unit, load_unit, seed, formulas
    )
    return tuple(where), tuple(found)
