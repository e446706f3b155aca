"""Laws that have lost their signature: a fit has driven their scale to the end of the range in which they have one.

Break-away that ages within a sample is a step after every rest, wear that is over at once a start-up: some other law,
in the words of this one; a drum of as few turns as it may have is any smooth law of the position, and so is a spring
that stiffens about an end of the stroke; a power of the speed with next to no exponent is Coulomb's. Only scales in
time, travel, turns, widths, centres and exponents count: of them a signature is made. A law of a load that stands is
one of something else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...effects import effect_of, prefix_of, shapes_of
from ...kernels.attached import Attached
from ...kernels.chain import attach
from ...kernels.kernel import kernel
from ..criteria import CENTRED_SHARE, CORE_SHARE, REPEATED_SHARE, SHAPE_RANGE_RATIO, STANDING_SHARE
from ..runs.motion_signals import coordinate_units
from .extent import turn_of
from .placing import least_stroke
from .refit import Fitted
from .response import places_of

SCALES = ("time", "travel", "turns", "width", "centre", "exponent")
OF_A_PART = ("exponent", "travel")
"""Of these, scales that belong to a part of a law: where that has no size they may be anywhere."""
ANGLES = 48
"""Parts of a turn in which places are the same."""
AT_AN_END = 0.02
"""Part of itself by which a scale may miss the end of its range: refits stop so near. And the part of what a law does
that the least scale may change of it, to call it the same."""


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
    if module.ABOUT.family == "load" and load_stands(fitted, attach(kernel(fitted.model), spec)):
        return True
    layers_alone = bool(module.ABOUT.core) and _little_of_it(fitted, spec, module.ABOUT.core)
    if turn_of(module) and not _of_known_drum(fitted, spec) and (layers_alone or _hardly_repeats(fitted, spec)):
        return True
    scales = [scale for scale in SCALES if not (scale == "width" and layers_alone)]
    for name, shape in shapes_of(module).items():
        parameter = f"{prefix_of(spec)}{name}"
        if shape.scale not in scales or parameter not in fitted.task.limits:
            continue
        lo, hi = fitted.task.limits[parameter]
        value, straight = fitted.values[parameter], module.ABOUT.family == "time"
        if shape.scale == "centre":  # the limits reach `SHAPE_RANGE_RATIO` times as far from the middle as the stroke
            if abs(value - 0.5 * (lo + hi)) > 0.5 * CENTRED_SHARE * (hi - lo) / SHAPE_RANGE_RATIO:
                return True
            continue
        at_an_end = value <= lo * (1.0 + AT_AN_END) or (value >= hi * (1.0 - AT_AN_END) and not straight)
        if at_an_end and not (shape.scale in OF_A_PART and _same_at(np.sqrt(lo * hi), name, fitted, spec)):
            return True
        if shape.scale == "time" and _same_at(lo, name, fitted, spec):
            return True
    return False


def _same_at(value: float, name: str, fitted: Fitted, spec: str) -> bool:
    """Whether a law does the same with another value of one of its parameters."""
    change = fitted.change_with({attach(kernel(fitted.model), spec).prefix + name: value})
    share = fitted.share_of(spec)
    return bool(share.any() and (change <= AT_AN_END * share).all())


def load_stands(fitted: Fitted, attached: Attached) -> bool:
    """Whether what a law of a load is driven by hardly changes: the sheath's angle, of one without that the load.

    It is then a law of the load alone, or of what else it takes: the direction, the friction itself.
    """
    signal = "bend" if "bend" in attached.module.Inputs._fields else "load"
    if attached.module.ABOUT.family != "load" or signal not in attached.module.Inputs._fields:
        return False
    drive, inputs = attached.drive(signal), [v.name for v in fitted.problem.kernel.inputs]
    column = drive.column if drive else fitted.problem.kernel.roles.load if signal == "load" else ""
    if column not in inputs:
        return False
    load = np.concatenate([run.inputs[:, inputs.index(column)] for run in fitted.problem.runs])
    return float(load.std()) < STANDING_SHARE * abs(float(load.mean()))


def _of_known_drum(fitted: Fitted, spec: str) -> bool:
    """Whether the motion is the angle of a drum that turns: its layers are where its turns are."""
    if coordinate_units(fitted.problem.kernel)[0] != "rad":
        return False
    return max(float(np.ptp(c.x)) for c in places_of(fitted)) >= least_stroke(effect_of(spec))


def _hardly_repeats(fitted: Fitted, spec: str) -> bool:
    """Whether a law of turns explains next to nothing where the runs pass the same angle in more than one turn.

    Of a size that a search has chosen a turn may be as long as it takes for a law at one place to come only once.
    """
    turn = 2.0 * np.pi * fitted.values[f"{prefix_of(spec)}{turn_of(effect_of(spec))}"]
    places = [np.floor(c.x / turn * ANGLES).astype(np.int64) for c in places_of(fitted)]
    angle, passed = np.unique(np.unique(np.concatenate(places)) % ANGLES, return_counts=True)
    again = np.isin(np.concatenate(places) % ANGLES, angle[passed > 1])
    weights = fitted.problem.weights
    explained = np.concatenate([
        np.sum((before * weights) ** 2 - (after * weights) ** 2, axis=1)
        for before, after in zip(fitted.switched_off(spec).residuals, fitted.residuals, strict=True)
    ])  # fmt: skip
    return bool(explained[again].sum() < REPEATED_SHARE * explained.sum())


def _little_of_it(fitted: Fitted, spec: str, core: Sequence[str]) -> bool:
    """Whether the sizes that make an effect do less than half of what it does."""
    of_core = fitted.change_with({attach(kernel(fitted.model), spec).prefix + name: 0.0 for name in core})
    return bool((of_core < CORE_SHARE * fitted.share_of(spec)).all())
