"""Laws that have lost their signature: a fit has driven their scale to the end of the range in which they have one.

Break-away that ages within a sample is a step after every rest, wear that is over at once a start-up: some other law,
in the words of this one. Only scales in time and travel count: of them a signature is made.
"""

from __future__ import annotations

from ...effects import effect_of, prefix_of, shapes_of
from .refit import Fitted

SCALES = ("time", "travel")
AT_AN_END = 1e-3
"""Part of itself by which a scale may miss the end of its range: refits stop so near."""


def disguised(fitted: Fitted, spec: str) -> bool:
    """Whether a law is at an end of its range, where it is another one.

    A law of time that has not settled by the end of the runs is one all the same: it is straight.

    Parameters
    ----------
    fitted : Fitted
        With the effect.
    spec : str
    """
    module = effect_of(spec)
    for name, shape in shapes_of(module).items():
        parameter = f"{prefix_of(spec)}{name}"
        if shape.scale not in SCALES or parameter not in fitted.task.limits:
            continue
        lo, hi = fitted.task.limits[parameter]
        value, straight = fitted.values[parameter], module.ABOUT.family == "time"
        if value <= lo * (1.0 + AT_AN_END) or (value >= hi * (1.0 - AT_AN_END) and not straight):
            return True
    return False
