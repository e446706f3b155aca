"""What stands in the row of a candidate: of a nuisance effect what it removes, not what the whole model removes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.candidates import candidates_of
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis, hypothesis
from tsm_fmu.diagnosis.evidence import Candidate, Gap
from tsm_fmu.diagnosis.fits.refit import Task, refit
from tsm_fmu.regression.problem import FitRun

Rig = Callable[..., FitRun]
NUISANCES = ("inertia", "presliding_shape")


@pytest.fixture(scope="module")
def runs(rig: Rig, hyperbola: Callable[[np.ndarray], np.ndarray]) -> list[FitRun]:
    return [rig(seed, inertia=0.061, presliding=hyperbola) for seed in (141, 142)]


@pytest.fixture(scope="module")
def fits(runs: list[FitRun], known: dict[str, float]) -> tuple[Hypothesis, Hypothesis]:
    """The model without any effect, and with two nuisance effects, both needed."""
    task = Task("LuGreFriction", runs, ("F",), known)
    start = {"inertia.m": 0.02, "presliding_shape.dF": 0.3, "presliding_shape.n": 1.7, "presliding_shape.x_0": 0.008}
    return hypothesis((), refit(task, (), {}), (), []), hypothesis((), refit(task, NUISANCES, start), NUISANCES, [])


def rows(fits: tuple[Hypothesis, Hypothesis], runs: list[FitRun], answered: tuple[str, ...]) -> dict[str, Candidate]:
    refitted, both = fits
    before, after = float(refitted.fitted.rmse[0]), float(both.fitted.rmse[0])
    gap = Gap(
        unit="N", before=before, after=after, holdout_before=None, holdout_after=None, floor=0.004, floor_least=0.004,
        closure=None, closure_least=None, closure_interval=None, refitted=before, holdout_refitted=None,
        threshold=0.01, reference=None,
    )  # fmt: skip
    listed = [(spec, both) for spec in NUISANCES]
    found = candidates_of(listed, answered, {"F": gap}, refitted, both, runs, (), unknown=False)
    return {c.spec: c for c in found}


def test_two_nuisance_effects_share_what_both_remove(fits: tuple[Hypothesis, Hypothesis], runs: list[FitRun]) -> None:
    found = rows(fits, runs, ())
    shares = [found[spec].closure_measured or 0.0 for spec in NUISANCES]
    assert min(shares) > 0.05
    assert max(shares) < 0.95
    assert 0.7 < sum(shares) < 1.3  # of what both remove, which is nearly all
    assert found["inertia"].channels["F"].measured > 2.0 * fits[1].fitted.rmse[0]


def test_an_effect_of_the_answer_has_the_numbers_of_the_answer(
    fits: tuple[Hypothesis, Hypothesis], runs: list[FitRun]
) -> None:
    found = rows(fits, runs, ("inertia",))
    assert found["inertia"].closure_measured == pytest.approx(1.0, abs=0.03)
    assert (found["presliding_shape"].closure_measured or 0.0) < 0.95
