"""What stands in the row of a candidate: of a nuisance effect what it removes, not what the whole model removes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.candidates import candidates_of, rows_of, steps_of
from tsm_fmu.diagnosis.choice.floors import Floors
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
    found = candidates_of(listed, answered, {"F": gap}, start_of({"F": gap}), refitted, both, runs, (), unknown=False)
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


SPREAD = np.array([2.0, 0.5])
CHANNELS = {"F": "N", "x": "rad"}


def made(added: str, rmse: tuple[float, float], held: tuple[float, float] | None = None, gain: float = 0.0) -> Any:
    """What leaves so much of two channels on the samples of the search, and a tenth more on all of them."""
    size = np.array(rmse)
    parameters = [SimpleNamespace(name=f"{e}.k", quantity=SimpleNamespace(unit="N.s")) for e in added.split()]
    fitted: Any = SimpleNamespace(
        rmse=size, spread=SPREAD, values={p.name: 0.3 for p in parameters}, effects=tuple(added.split()),
        at=lambda runs: SimpleNamespace(rmse=1.1 * size), task=SimpleNamespace(gap=np.zeros(1)),
        problem=SimpleNamespace(kernel=SimpleNamespace(parameters=parameters)),
    )  # fmt: skip
    out = None if held is None else np.array(held) ** 2
    return Hypothesis(tuple(added.split()), fitted, (), size**2 + gain, out, np.full(2, 1e5), np.full(2, 1e5),
                      nuisance_tests=dict)  # fmt: skip


def gaps(**changed: Any) -> dict[str, Gap]:
    """Of the refitted model 0.9 N and 0.2 rad are left, of the answer's 0.3 N and 0.05 rad."""
    values = {"holdout_refitted": None, "holdout_after": None, **changed}
    sizes = {"F": (0.9, 0.3, 0.2, 0.1), "x": (0.2, 0.05, 0.04, 0.04)}
    return {
        c: Gap(unit, before, after, None, v and v[2], floor, least, None, None, None, before, v and v[1])
        for (c, unit), (before, after, floor, least) in zip(CHANNELS.items(), sizes.values(), strict=True)
        for v in [(None, *((1.0, 0.4) if c == "F" else (0.25, 0.06))) if values["holdout_after"] else None]
    }


def log_of(*sides: tuple[float, float]) -> float:
    return float(np.mean([np.sum(np.log((np.array(s) / SPREAD) ** 2 + 9e-6)) for s in sides]))


def closed(before: float, after: float, floor: float) -> float:
    return 1.0 - (after**2 - floor**2) / (before**2 - floor**2)


PLAIN, FREE = made("", (0.9 / 1.1, 0.2 / 1.1), (1.1, 0.3)), made("", (0.8, 0.18), (1.0, 0.28))


def listed(one: Any, answered: tuple[str, ...] = (), *, unknown: bool = False, gap: Any = None) -> Candidate:
    rows = [(one.added[0], one)]
    (found,) = candidates_of(
        rows, answered, gap or gaps(), start_of(gap or gaps()), PLAIN, FREE, (), ("creep",), unknown=unknown
    )
    return found


def test_a_candidate_alone_has_what_it_leaves_on_all_samples_and_its_score_on_those_of_the_search() -> None:
    one = listed(made("wear", (0.5, 0.1)))
    assert one.channels["F"].measured == pytest.approx(0.55)
    assert one.channels["x"].measured == pytest.approx(0.11)
    assert one.score == pytest.approx(10.0 / np.log(10.0) * (log_of((0.8, 0.18)) - log_of((0.5, 0.1))))  # as judged
    assert one.channels["F"].closure_measured == pytest.approx((closed(0.9, 0.55, 0.1), closed(0.9, 0.55, 0.2)))
    assert one.channels["x"].closure_measured == pytest.approx((closed(0.2, 0.11, 0.04),) * 2)
    weights = (1.0 / 0.2**2, 1.0 / 0.04**2)
    removable = weights[0] * (0.81 - 0.04) + weights[1] * (0.04 - 0.0016)
    rest = weights[0] * (0.55**2 - 0.04) + weights[1] * (0.11**2 - 0.0016)
    assert one.closure_measured == pytest.approx(1.0 - rest / removable)
    assert (one.closure_holdout, one.channels["F"].closure_holdout, one.channels["F"].holdout) == (None, None, None)
    assert one.misfit == pytest.approx((0.55 / 2.0) ** 2 + (0.11 / 0.5) ** 2)
    assert (dict(one.parameters), dict(one.units), one.testable) == ({"k": 0.3}, {"k": "N.s"}, True)
    assert not listed(made("creep", (0.5, 0.1))).testable
    sure = listed(made("wear", (0.5, 0.1)), unknown=True)  # only what is surely noise is floor
    weights = (1.0 / 0.1**2, 1.0 / 0.04**2)
    removable = weights[0] * (0.81 - 0.01) + weights[1] * (0.04 - 0.0016)
    rest = weights[0] * (0.55**2 - 0.01) + weights[1] * (0.11**2 - 0.0016)
    assert sure.closure_measured == pytest.approx(1.0 - rest / removable)


def test_on_held_out_runs_it_takes_away_what_it_does_on_the_samples_of_the_search() -> None:
    gap = gaps(holdout_after=True)
    one = listed(made("wear", (0.5, 0.1), (0.55, 0.15)), gap=gap)
    assert one.channels["F"].holdout == pytest.approx(1.0 * 0.55 / 1.1)
    assert one.channels["x"].holdout == pytest.approx(0.25 * 0.15 / 0.3)
    assert one.channels["F"].closure_holdout == pytest.approx((closed(1.1, 0.55, 0.1), closed(1.1, 0.55, 0.2)))
    assert one.closure_holdout is not None
    answer = listed(made("wear", (0.5, 0.1), (0.55, 0.15)), ("wear",), gap=gap)
    assert answer.channels["F"].measured == 0.3
    assert answer.channels["F"].holdout == pytest.approx(0.4)
    assert answer.channels["F"].closure_holdout == pytest.approx((closed(1.0, 0.4, 0.1), closed(1.0, 0.4, 0.2)))
    assert answer.channels["x"].closure_measured == pytest.approx((closed(0.2, 0.05, 0.04),) * 2)


def test_what_is_gained_on_reference_runs_is_no_part_of_the_gap_but_of_the_answer() -> None:
    one = listed(made("wear", (0.5, 0.1), gain=0.02))
    assert one.channels["F"].closure_measured is not None
    left = np.sqrt(0.55**2 + 0.02)
    assert one.channels["F"].closure_measured[1] == pytest.approx(closed(0.9, left, 0.2))
    answer = listed(made("wear", (0.5, 0.1), gain=0.02), ("wear",))
    assert answer.channels["F"].closure_measured is not None
    assert answer.channels["F"].closure_measured[1] == pytest.approx(closed(0.9, 0.3, 0.2))


def test_rows_are_the_answers_effects_in_its_fit_then_each_alone_best_first() -> None:
    start, wear, creep = made("", (0.8, 0.2)), made("wear", (0.5, 0.1)), made("creep", (0.4, 0.1))
    both = made("wear creep", (0.1, 0.05))
    choice: Any = SimpleNamespace(winner=both)
    for unexplained, in_part, expected in (
        (False, False, [("wear", both), ("creep", both)]),
        (True, False, [("creep", creep), ("wear", wear)]),
        (True, True, [("wear", both), ("creep", both)]),  # of another channel than that which nothing explains
    ):
        left = np.array([False, unexplained])
        floors = Floors(np.ones(2), np.ones(2), None, left, left, in_part)
        assert rows_of([start, wear, creep, both], choice, floors) == expected


def start_of(found: dict[str, Any]) -> dict[str, tuple[float, float | None]]:
    return {channel: (g.refitted, g.holdout_refitted) for channel, g in found.items()}


def test_steps_of_an_answer_are_the_best_of_each_size_within_it() -> None:
    held = (0.55, 0.15)
    fits = [made("wear", (0.5, 0.1), held), made("creep", (0.4, 0.1), held), made("delay", (0.1, 0.1), held),
            made("creep slack", (0.3, 0.1), held), made("wear slack", (0.2, 0.1), held)]  # fmt: skip
    start = start_of(gaps(holdout_after=True))
    first, second = steps_of(fits, ("wear", "slack", "creep"), start, PLAIN, (), ())
    assert (first.effects, second.effects) == (("creep",), ("creep", "slack"))  # on from the first
    assert first.measured == pytest.approx({"F": 0.44, "x": 0.11})
    assert first.holdout == pytest.approx({"F": 0.5, "x": 0.125})
    assert steps_of(fits, ("wear",), start, PLAIN, (), ()) == ()
    assert len(steps_of(fits[:3], ("wear", "slack", "creep"), start, PLAIN, (), ())) == 1
    assert steps_of([replace(f, held_out=None) for f in fits], ("wear", "creep"), start, PLAIN, (), ())[0].holdout == {}
    assert steps_of(fits, ("wear", "creep"), start_of(gaps()), PLAIN, (), ())[0].holdout == {}
