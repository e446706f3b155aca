"""What nuisance effects remove: beyond the form of a model or the clock of a good rig one of them is missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress

import numpy as np

from ...effects import about, effect_of, looks_like, place_of, sizes_as
from ...kernels.arrays import BoolArray, FloatArray
from ...kernels.kernel import kernel
from ...models.contract import InputError
from ...regression.problem import FitRun
from ..criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    DIFFERENCE_DEVIANCE,
    EFFECT_SPREAD_SHARE,
    LAW_FORM_SHARE,
    LITTLE_SPREAD_SHARE,
    NEARLY_ALL_SHARE,
    NOTABLE_RATIO,
    NUISANCE_SPREAD_SHARE,
    REFERENCE_RATIO,
    REFERENCED_SHAPE_SPREAD_SHARE,
    SHAPE_SPREAD_SHARE,
    UNLIKE_REFERENCE_RATIO,
)
from .carried import STEPS as MOVE_STEPS
from .carried import carried_over
from .nuisance import other_starts, refit_without
from .refit import Fitted, Task
from .takeover import without


def significant_nuisances(
    fitted: Fitted, specs: Sequence[str], nuisances: Sequence[str],
    holdout: Sequence[FitRun] = (), held_out: FloatArray | None = None,
) -> dict[str, tuple[float, Fitted]]:  # fmt: skip
    """Nuisance effects without which a fit gets clearly worse, and by more than the form of a model or of an effect.

    What is usual of good rigs is allowed for, unless reference runs show how much of it is usual of this one and it
    removes a notable part, or next to nothing is left with it: then it must remove what any effect must. On measured
    runs another curve of friction may stand for a lag; other motions tell them apart, if it is much there.

    Parameters
    ----------
    fitted : Fitted
    specs : sequence of str
        Specs to look at.
    nuisances : sequence of str
        All that are nuisance effects.
    holdout : sequence of FitRun
        Runs that were not fitted, if there are any.
    held_out : ndarray, shape (channels,), or None
        Mean square that the fit leaves of these; None without any.

    Returns
    -------
    dict of str to (float, Fitted)
        What each removes as part of a channel's spread, and the fit without it.
    """
    found = {}
    of_effects = np.sqrt(LAW_FORM_SHARE * np.maximum(fitted.task.gap**2 - fitted.rmse**2, 0.0))
    of_any = np.maximum(CLEAN_EFFECT_SPREAD_SHARE * fitted.spread, np.maximum(of_effects, fitted.task.steps))
    usual = np.maximum(NUISANCE_SPREAD_SHARE * fitted.spread, np.maximum(of_any, fitted.task.discrepancy))

    def removed(less: Fitted) -> FloatArray:  # RMS; nothing if no more than is allowed for, unless the model cannot run
        before, left = less.rmse**2, fitted.rmse**2
        known = nearly_removed(before, left)
        if fitted.task.reference_removal:
            known |= notably_removed(before, left, fitted.spread)
        least = np.where(known & (not after_reversal(spec, fitted.model)), of_any, usual)
        gone = _removed(less, fitted)
        return np.zeros_like(gone) if (gone <= least).all() else gone

    def removed_elsewhere(less: Fitted, steps: int) -> FloatArray:  # the same of held-out runs
        if held_out is None or after_reversal(spec, fitted.model) or sizes_as(effect_of(spec), "per run"):
            return np.zeros_like(of_any)
        before = carried_over(less, holdout, steps).mean_square
        gone = np.sqrt(np.maximum(before - held_out, 0.0))
        return np.where((before > UNLIKE_REFERENCE_RATIO**2 * held_out) & (gone > of_any), gone, 0.0)

    def gone(less: Fitted, steps: int) -> FloatArray:
        here = removed(less)
        return here if here.any() else removed_elsewhere(less, steps)

    for spec in fitted.effects:
        if sizes_as(effect_of(spec), "per run") and spec not in fitted.released:
            continue  # the zeros of runs: only one that moves within a run is an effect
        if spec not in specs or float(fitted.share_of(spec).max()) < CLEAN_EFFECT_SPREAD_SHARE:
            continue
        replaced = without(fitted, spec)  # its place taken by the other parameters: a refit leaves no more
        if not gone(replaced, 0).any():
            continue
        less = first = refit_without(fitted, spec, nuisances)
        of_less = gone(first, MOVE_STEPS)
        if not of_less.any():
            continue
        for start in other_starts(fitted, (replaced.values, replaced.per_run)):
            with suppress(InputError):  # the model cannot run there
                less = min(less, refit_without(fitted, spec, nuisances, start), key=lambda f: f.cost)
        added = [e for e in fitted.effects if e not in nuisances]
        if looks_like(spec, added) and not nearly_removed(less.rmse**2, fitted.rmse**2).any():
            continue  # beside what it hides behind it corrects the form of a law
        of_less = of_less if less is first else gone(less, MOVE_STEPS)
        if of_less.any():
            found[spec] = float(np.max(of_less / np.maximum(fitted.spread, 1e-300))), less
    return found


def telling_nuisances(fitted: Fitted, nuisances: Sequence[str]) -> tuple[str, ...]:
    """Nuisance effects of a fit that tell a family, not what is missing: a part that is too little for that may do.

    The one that removes most does, if that is beyond noise and more than next to nothing; and so do others that remove
    as much as a missing effect, and are none only because good rigs differ by more.

    Parameters
    ----------
    fitted : Fitted
    nuisances : sequence of str
        All that are nuisance effects.
    """
    spread, left, found = np.maximum(fitted.spread, 1e-300), fitted.rmse**2, dict[str, float]()
    least = np.maximum(DIFFERENCE_DEVIANCE * left / fitted.effective, (LITTLE_SPREAD_SHARE * spread) ** 2)
    for spec in (s for s in fitted.effects if s in nuisances):
        removed = refit_without(fitted, spec, nuisances).rmse ** 2 - left
        shown = removed > least
        if shown.any():
            found[spec] = float(np.max((removed / spread**2)[shown]))
    ranked = sorted(found, key=lambda spec: -found[spec])
    return tuple(spec for k, spec in enumerate(ranked) if k == 0 or found[spec] > EFFECT_SPREAD_SHARE**2)


def corrects_model_form(
    spec: str, share: float, task: Task, spread: FloatArray, *, beside_another: bool = False
) -> bool:
    """Whether an effect that removes this part of a channel's spread is the form of the model, and nothing missing.

    Parameters
    ----------
    spec : str
    share : float
    task : Task
    spread : ndarray, shape (channels,)
    beside_another : bool
        Whether another effect is missing: what its law lacks shows after reversals too.
    """
    on_reference = float(np.max(task.reference_removal.get(spec, np.zeros(1)) / np.maximum(spread, 1e-300)))
    if beside_another and shapes_reversals(spec):
        return share <= max(SHAPE_SPREAD_SHARE, REFERENCE_RATIO * on_reference)
    of_reversals = after_reversal(spec, task.model)
    if of_reversals and not task.reference_removal:
        return share <= SHAPE_SPREAD_SHARE
    least = REFERENCED_SHAPE_SPREAD_SHARE if of_reversals else 0.0
    return share <= max(least, REFERENCE_RATIO * on_reference)


def unlike_references(spec: str, without: FloatArray, fitted: Fitted) -> BoolArray:
    """Channels that a nuisance effect makes as good as on reference runs, which it hardly makes better, by far.

    The form of a model is the same on both.

    Parameters
    ----------
    spec : str
    without : ndarray, shape (channels,)
        RMS that a refit without it leaves.
    fitted : Fitted
        With it.
    """
    reference, on_reference = fitted.task.discrepancy, fitted.task.reference_removal.get(spec)
    if on_reference is None:
        return np.zeros(without.size, bool)
    removed = np.sqrt(np.maximum(without**2 - fitted.rmse**2, 0.0))
    return (
        (fitted.rmse <= REFERENCE_RATIO * reference)
        & (without > UNLIKE_REFERENCE_RATIO * reference)
        & (removed > UNLIKE_REFERENCE_RATIO * on_reference)
    )


def after_reversal(spec: str, model: str) -> bool:
    """Whether an effect is a law of what friction does after a reversal, as play before it is too."""
    return about(spec).after_reversal or is_play_before_friction(spec, model)


def is_play_before_friction(spec: str, model: str) -> bool:
    """Whether an effect is play of the motion itself."""
    return about(spec).play and place_of(spec)[1] == kernel(model).motion


def shapes_reversals(spec: str) -> bool:
    """Whether an effect is a law of what follows a reversal, play included."""
    return about(spec).after_reversal or about(spec).play


class RemovedOnReference(Mapping[str, FloatArray]):
    """What a nuisance effect removes on reference runs [RMS by channel], by spec: form, and nothing missing.

    Each is known once it is asked for: it takes a refit.

    Parameters
    ----------
    reference_fit : Fitted
        With the nuisance effects, on the reference runs.
    nuisances : sequence of str
    """

    def __init__(self, reference_fit: Fitted, nuisances: Sequence[str]) -> None:
        self._fit, self._nuisances, self._known = reference_fit, tuple(nuisances), dict[str, FloatArray]()

    def __getitem__(self, spec: str) -> FloatArray:
        if spec not in self._nuisances:
            raise KeyError(spec)
        if spec not in self._known:
            self._known[spec] = _removed(refit_without(self._fit, spec, self._nuisances), self._fit)
        return self._known[spec]

    def __iter__(self) -> Iterator[str]:
        return iter(self._nuisances)

    def __len__(self) -> int:
        return len(self._nuisances)


def _removed(before: Fitted, after: Fitted) -> FloatArray:
    """RMS that is gone, by channel."""
    return np.sqrt(np.maximum(before.rmse**2 - after.rmse**2, 0.0))


def notably_removed(before: FloatArray, after: FloatArray, spread: FloatArray) -> BoolArray:
    """Channels in which a notable part of the mean square is gone, and more than next to nothing of the spread."""
    return before - after > np.maximum(NOTABLE_RATIO * after, (LITTLE_SPREAD_SHARE * spread) ** 2)


def nearly_removed(before: FloatArray, after: FloatArray) -> BoolArray:
    """Channels in which next to nothing of a mean square is left."""
    return after < (1.0 - NEARLY_ALL_SHARE) * before
