"""Where the residual of a fit lies, on what it depends, and a formula for it."""

from __future__ import annotations

from dataclasses import replace

from ..evidence import Place, ResidualShape
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.dependence import dependence
from ..residual.formula import shapes
from ..residual.locate import locate
from ..runs.motion_signals import coordinate_units


def with_position_law(
    found: tuple[ResidualShape, ...], fitted: Fitted, channel: str, seed: int
) -> tuple[ResidualShape, ...]:
    """The same with the residual of a channel over the position, where it is not drawn yet.

    Parameters
    ----------
    found : tuple of ResidualShape
        Of `located`.
    fitted : Fitted
    channel : str
    seed : int
        Of the intervals.
    """
    units = coordinate_units(fitted.problem.kernel)
    completed = []
    for one in found:
        has_position = any(d.coordinate == "x" for d in one.dependences)
        if one.channel == channel and not has_position:
            parts = [r[:, fitted.problem.channels.index(channel)] for r in fitted.residuals]
            law = dependence(parts, places_of(fitted), "x", *units, seed)
            one = replace(one, dependences=(*law, *one.dependences))
        completed.append(one)
    return tuple(completed)


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
