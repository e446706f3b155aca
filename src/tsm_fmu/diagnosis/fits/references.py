"""Whether the values of a fit serve the reference runs too: those of the same rig without what is missing.

A refit of the model alone may move its values to where they imitate what is missing. They are then not those of the
rig, which reference runs show: one set of values serves both kinds of runs with the effect that is there, and without
it none does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...kernels.arrays import FloatArray
from ..criteria import CLEAN_EFFECT_SPREAD_SHARE, REFERENCE_RATIO
from .nuisance import again_from, best_refit
from .refit import Fitted

CHANGED_VALUES = 3
"""Values that may have changed between reference and measured runs: those whose move does most, one at a time."""


def jointly(fitted: Fitted, reference: Fitted, nuisances: Sequence[str], changed: str = "") -> Fitted:
    """A refit of the same effects in which the values serve reference runs too, where these effects do nothing.

    Parameters
    ----------
    fitted : Fitted
    reference : Fitted
        The model on reference runs.
    nuisances : sequence of str
        Nuisance effects.
    changed : str
        Field whose value may be another one there.
    """
    prior = reference.prior
    if changed:
        prior = prior.only([f for f in prior.fields if f != changed])
    joint = replace(fitted, task=replace(fitted.task, prior=prior))
    starts = [(one, fitted.per_run) for one in (fitted.values, {**fitted.values, **reference.shared_values})]
    return best_refit(joint, fitted.effects, starts, nuisances, fitted.released)


def serving_own_runs_alone(joint: Fitted, nuisances: Sequence[str]) -> Fitted:
    """A refit of a fit that served reference runs too, to its own runs alone."""
    return again_from(replace(joint, task=replace(joint.task, prior=None)), nuisances)


def left_of_references(reference: Fitted, values_of: Fitted) -> FloatArray:
    """What the values of a fit leave of reference runs [RMS by channel]; what each run has of its own stays.

    Parameters
    ----------
    reference : Fitted
        The model on reference runs.
    values_of : Fitted
        Without its effects but for those that the reference fit has too.
    """
    named = {reference.problem.declared[f].name: f for f in reference.problem.shared}
    values = values_of.values
    return reference.with_values({f: values[name] for name, f in named.items() if name in values}).rmse


def serve(reference: Fitted, values_of: Fitted) -> bool:
    """Whether the values of a fit leave little more of reference runs than their own do, in every channel."""
    return _hardly_more(left_of_references(reference, values_of), reference)


def serve_both(fitted: Fitted, reference: Fitted, nuisances: Sequence[str]) -> bool:
    """Whether some values serve the runs of a fit and reference runs nearly as well as each its own."""
    if serve(reference, fitted):
        return True
    joint = jointly(fitted, reference, nuisances)
    return serve(reference, joint) and _hardly_more(joint.rmse, fitted)


def serve_both_but_for_one(fitted: Fitted, reference: Fitted, nuisances: Sequence[str], most: FloatArray) -> bool:
    """Whether values of which one has changed since the reference runs serve both.

    One of the `CHANGED_VALUES` whose move between the two does most.

    Parameters
    ----------
    fitted : Fitted
    reference : Fitted
    nuisances : sequence of str
    most : ndarray, shape (channels,)
        What they may leave of the runs of the fit [RMS].
    """
    problem, there = fitted.problem, reference.shared_values
    known = {f: there[problem.declared[f].name] for f in problem.shared if problem.declared[f].name in there}
    moves = {f: float(np.nan_to_num(fitted.change_with({f: x}), nan=np.inf).max()) for f, x in known.items()}
    changed = sorted(moves, key=lambda f: -moves[f])[:CHANGED_VALUES]
    return any((jointly(fitted, reference, nuisances, one).rmse <= most).all() for one in changed)


def _hardly_more(left: FloatArray, fitted: Fitted) -> bool:
    """Whether this is within `REFERENCE_RATIO` of what a fit leaves, or more by less than any effect must remove."""
    least = (CLEAN_EFFECT_SPREAD_SHARE * fitted.spread) ** 2
    return bool(np.all(left**2 <= np.maximum((REFERENCE_RATIO * fitted.rmse) ** 2, fitted.rmse**2 + least)))
