"""The search for hypotheses: the best candidates alone, then a second and a third effect beside the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects import looks_like, place_of, sizes_as
from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from ...regression.threads import together
from ..criteria import CONTENDING_RATIO, CONVERGED_SHARE, FURTHER_CANDIDATES, MOST_EFFECTS, SWAPPED_EFFECTS
from ..fits.nuisance import Start
from ..fits.placing import possible
from ..fits.references import serving_own_runs_alone
from ..fits.refit import Fitted
from ..fits.screening import Screened, screen
from ..fits.significance import is_play_before_friction
from ..runs.drivers import drives_of
from .baselines import Baselines
from .floors import open_channels
from .hypotheses import Hypothesis, hypothesis
from .refits import interleaved, probe, refit_candidates, refit_rivals
from .supported import choice_of, comes_near, leading, least_of_further, log_residual, with_fewer


@dataclass(frozen=True)
class Search:
    """What a search works on.

    Attributes
    ----------
    model : Kernel
        With the inputs of the runs.
    baselines : Baselines
    holdout : sequence of FitRun
    progress : callable
        Given what is being done.
    """

    model: Kernel
    baselines: Baselines
    holdout: Sequence[FitRun]
    progress: Callable[[str], None]

    def hypotheses(self) -> list[Hypothesis]:
        """The baseline with its nuisance parameters, each of the best candidates, pairs and triples of them.

        Where what hides behind a nuisance effect leaves less in its place, the search goes on from there.
        """
        found = self._from(self.baselines.with_nuisances)
        better = {h.added: h for h in self._from_values_of_references(found)}
        found = [*(h for h in found if h.added not in better), *better.values()]
        instead = self._in_place_of_nuisances(found)
        best = leading(instead) if instead else None
        if best is None or log_residual(best) >= log_residual(leading(found)):
            return [*found, *instead]
        return [*found, *(h for h in instead if h is not best), *self._from(best)]

    def _from(self, start: Hypothesis) -> list[Hypothesis]:
        """A hypothesis, and with one effect after another beside it."""
        found, singles, base = [start], list[Hypothesis](), start
        for _ in range(MOST_EFFECTS - len(start.added)):
            screened, starts = self._screened(base)
            reference = self.baselines.reference if not base.added else None
            more = refit_candidates(base, screened, self.holdout, reference, starts, self.progress)
            if not more:
                break
            found += more
            best = leading(more)
            if len(base.added) == 1:
                found = self._with_other_pairs(found, singles, base, screened)
                best = leading([h for h in found if len(h.added) == 2])
            found = with_fewer(best, found, self.baselines.refitted, self.holdout)
            if log_residual(best) >= log_residual(base):
                break
            singles, base = singles or more, best
            if self._enough(found, base):
                break
        return found

    def _from_values_of_references(self, found: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Single effects refitted from values that serve the reference runs too, where those of the baseline do not.

        Its own values may have taken what an effect does, and no step from there leads back. What leaves no less than
        the same effect does already is left out, and so is play before a friction, a curve for all that friction does
        after a reversal at other values.
        """
        joint = self.baselines.joint
        if joint is None:
            return []
        base = joint.with_nuisances
        screened, starts = replace(self, baselines=joint)._screened(base)
        screened = [s for s in screened if not is_play_before_friction(s.attached.spec, base.fitted.model)]
        held = refit_candidates(base, screened, (), joint.reference, starts, self.progress)
        known = {h.added: h for h in found}
        near = [h for h in held if log_residual(h) < min(map(log_residual, held)) + np.log(CONTENDING_RATIO)]

        def freed(one: Hypothesis) -> Hypothesis:
            fitted = serving_own_runs_alone(one.fitted, one.nuisances)
            return hypothesis(one.added, fitted, one.nuisances, self.holdout, one.reference_gain)

        def less(one: Hypothesis) -> bool:
            same = known.get(one.added)
            return same is None or log_residual(one) < log_residual(same) - CONVERGED_SHARE

        return list(filter(less, together(freed, near)))

    def _screened(self, base: Hypothesis) -> tuple[list[Screened], Mapping[str, Start]]:
        """Candidates to refit beside a hypothesis, best first, and a second place to start each from.

        One linear step from its fit, and one from the fit without the nuisance parameters that remove as much as an
        effect: they may have taken what a candidate explains.
        """
        fitted = base.fitted
        places = self._places(fitted)
        screened, starts = screen(fitted, places, self.progress), {}
        before = self._without_nuisances(base)
        if before is not fitted:
            instead = screen(before, places, self.progress)
            starts = _second_starts(before, instead)
            gains = {s.attached.spec: s.gain for s in instead}
            screened = [
                replace(s, gain=max(s.gain, gains[s.attached.spec])) for s in interleaved(screened, instead)
            ]  # fmt: skip
        if base.added:
            self.progress("probe of a further effect")
            screened = probe(fitted, screened, base.nuisances)
            screened = [s for s in screened if _promises(s.gain, before, least_of_further(base))][
                : len(base.significant) + FURTHER_CANDIDATES
            ]
        return screened, starts

    def _places(self, fitted: Fitted) -> list[Attached]:
        """Candidates beside a fit: not what the model's own law holds."""
        model = self.baselines.refitted.fitted
        return [c for c in candidate_places(self.model, fitted) if not model.has(c.module.NAME)]

    def _without_nuisances(self, one: Hypothesis) -> Fitted:
        """The fit without the nuisance parameters that may have taken what a candidate explains."""
        return one.fit_without_nuisances if one.added else self.baselines.refitted.fitted

    def _with_other_pairs(
        self, found: Sequence[Hypothesis], singles: Sequence[Hypothesis], first: Hypothesis,
        screened: Sequence[Screened],
    ) -> list[Hypothesis]:  # fmt: skip
        """With the second effect of the best pair beside other first ones, and close pairs refitted again."""
        pairs = self._from_either_side([h for h in found if len(h.added) == 2], singles, first)
        (second,) = (spec for spec in leading(pairs).added if spec not in first.added)  # begun from either side
        others = [h for h in sorted(singles, key=log_residual) if h.added != first.added][:SWAPPED_EFFECTS]
        candidate = [s for s in screened if s.attached.spec == second]
        for other in others:
            if second in other.fitted.effects or {*other.added, second} in [set(h.added) for h in pairs]:
                continue
            more = self._refitted(other, candidate or self._screened_alone(other, second))
            near = all(comes_near(h, leading(pairs)) for h in more)
            pairs += self._from_either_side(more, singles, other) if near else more
        return [h for h in found if len(h.added) != 2] + refit_rivals(pairs, self.holdout)

    def _from_either_side(
        self, pairs: Sequence[Hypothesis], singles: Sequence[Hypothesis], first: Hypothesis
    ) -> list[Hypothesis]:
        """Pairs of a first effect, the best one first, also begun from their second effect; the better of both.

        The first effect may have taken part of the second one, and hold the pair in the valley that this led to. Where
        that moves a pair no more, those behind it stay.
        """
        found = sorted(pairs, key=log_residual)
        alone = {h.added[-1]: h for h in singles}
        for k, pair in enumerate(found):
            second = alone.get(pair.added[-1])
            if second is None:
                continue
            swapped = self._refitted(second, self._screened_alone(second, first.added[-1]))
            better = [h for h in swapped if h.fitted.cost < (1.0 - CONVERGED_SHARE) * pair.fitted.cost]
            if not better:
                break
            found[k] = better[0]
        return found

    def _screened_alone(self, base: Hypothesis, spec: str) -> list[Screened]:
        """One candidate beside a hypothesis; none where it has no place there."""
        return screen(base.fitted, [c for c in self._places(base.fitted) if c.spec == spec], self.progress)

    def _refitted(self, base: Hypothesis, screened: Sequence[Screened]) -> list[Hypothesis]:
        return refit_candidates(base, screened, self.holdout, progress=self.progress)

    def _in_place_of_nuisances(self, found: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Supported hypotheses with what hides behind a nuisance effect of theirs, in its place.

        The nuisance effect is in every other hypothesis and has taken what an effect like it explains; with both a
        refit ends between them.
        """
        supported = choice_of(found, self.baselines.refitted).supported
        named = {spec for h in supported for spec in h.added}
        in_place = [(h, spec) for h in supported for spec in h.significant]
        if not any(h is found[0] for h in supported):
            in_place += [(found[0], spec) for spec in found[0].tested if looks_like(spec, named)]
        more = []
        for one, spec in in_place:
            fitted = one.tested[spec][1]
            channel = place_of(spec)[1]
            beside = (channel,) if channel else (channel, self.model.motion)  # play before a friction
            places = [c for c in self._places(fitted) if c.channel in beside and looks_like(c.spec, [spec])]
            nuisances = tuple(s for s in one.nuisances if s != spec)
            left = fitted.rmse**2 + one.reference_gain
            without = replace(one, fitted=fitted, nuisances=nuisances, measured=left)
            before = self._without_nuisances(one)
            starts = _second_starts(before, screen(before, places))
            screened = screen(fitted, places, self.progress)
            more += refit_candidates(without, screened, self.holdout, starts=starts, progress=self.progress)
        return more

    def _enough(self, found: Sequence[Hypothesis], base: Hypothesis) -> bool:
        """Whether one effect more can change nothing."""
        refitted = self.baselines.refitted
        winner = choice_of(found, refitted).winner
        if len(winner.effects) < len(base.missing):
            return True  # the last one did not help
        # nothing is left to explain, and nothing explained by what is rather a nuisance
        before = self.baselines
        left = open_channels(winner, refitted.fitted, before.reference, least_of_further(winner), form_share=0.0)
        return not winner.has_large_nuisance and not left.any()


def _second_starts(before: Fitted, screened: Sequence[Screened]) -> dict[str, Start]:
    """Where a refit with each candidate starts too: that fit, and the values of its linear step from there."""
    return {s.attached.spec: Start(before, s.starts[0]) for s in screened}


def candidate_places(model: Kernel, fitted: Fitted) -> list[Attached]:
    """Every effect at every place that a fit has not; a nuisance offset that is there can be released to drift.

    Parameters
    ----------
    model : Kernel
        With the inputs of the runs.
    fitted : Fitted
    """
    attached = tuple(getattr(model.module, "EFFECTS", ()))
    return [
        c for c in possible(model.name, fitted.problem.channels, attached, drives_of(model))
        if c.spec not in fitted.effects or (sizes_as(c.module, "zero") and c.spec not in fitted.released)
    ]  # fmt: skip


def _promises(gain: float, fitted: Fitted, least: FloatArray) -> bool:
    """Whether a candidate takes at least these parts of the spread of a channel, by its linear step or its probe."""
    return bool((np.sqrt(-np.expm1(-gain)) * fitted.rmse > least * fitted.spread).any())
