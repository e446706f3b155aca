"""Which effects of a hypothesis correct the form of the model, and are not missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..fits.nuisance import refit_without
from ..fits.significance import corrects_model_form, nearly_removed, shapes_reversals
from .hypotheses import Hypothesis


def beside(base: Hypothesis, spec: str, one: Hypothesis) -> Hypothesis:
    """A hypothesis with one effect more than another, which corrects the form of the model if it removes no more.

    Unless next to nothing is left with it of what the model without nuisance effects leaves, but for a law of what
    follows a reversal beside another effect on the same channel, or a nuisance effect that was one of its own does
    nothing any more beside it: no correction of a form does that.
    """
    spread = one.fitted.spread
    share = float(np.max(np.sqrt(np.maximum(base.measured - one.measured, 0.0)) / np.maximum(spread, 1e-300)))
    before = base.measured if base.added else np.maximum(base.measured, one.fitted.task.gap**2)
    with_form = replace(one, form_corrections=(*base.form_corrections, spec))
    another = shapes_reversals(spec) and _acts_with_another(spec, with_form.effects, one)
    corrects = corrects_model_form(spec, share, one.fitted.task, spread, beside_another=another)
    if (
        corrects
        and (another or not nearly_removed(before, one.measured).any())
        and base.significant.keys() <= with_form.significant.keys()
    ):
        return with_form
    plain = replace(one, form_corrections=base.form_corrections)
    if not any(map(shapes_reversals, base.form_corrections)) or not any(map(shapes_reversals, base.significant)):
        return plain
    if base.significant.keys() <= plain.significant.keys():
        return plain
    # what was large before may now be in what only corrected the form
    return replace(one, form_corrections=tuple(s for s in base.form_corrections if not shapes_reversals(s)))


def _acts_with_another(spec: str, effects: Sequence[str], one: Hypothesis) -> bool:
    """Whether one of some effects that is no law of what follows a reversal changes a channel that this one does."""
    others = [s for s in effects if not shapes_reversals(s)]
    return any((one.changed_by(s) & one.changed_by(spec)).any() for s in others)


def with_shapes_beside(one: Hypothesis) -> Hypothesis:
    """A copy in which laws of what follows a reversal that came before another effect there and do little are form.

    Alone such a law may have taken what the other effect does.
    """
    for spec in one.missing[:-1]:
        if not shapes_reversals(spec) or not _acts_with_another(spec, one.missing, one):
            continue
        less = refit_without(one.fitted, spec, one.nuisances)
        spread = np.maximum(one.fitted.spread, 1e-300)
        share = float(np.max(np.sqrt(np.maximum(less.rmse**2 - one.fitted.rmse**2, 0.0)) / spread))
        with_form = replace(one, form_corrections=(*one.form_corrections, spec))
        without = replace(one, added=tuple(s for s in one.added if s != spec), fitted=less, nuisance_tests=None)
        if (
            corrects_model_form(spec, share, one.fitted.task, spread, beside_another=True)
            and without.significant.keys() <= with_form.significant.keys()
        ):
            one = with_form
    return one
