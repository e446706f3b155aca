"""What a fit to other runs says of parameters: with it a fit serves those runs as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.descent import Descent
from tsm_fmu.regression.prior import Prior
from tsm_fmu.regression.prior_of_fit import prior_of_fit
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import search_space

DRIVE = kernel("TendonDrive")
FREE = ("c", "beta", "sigma0", "tau_c", "tau_v")
"""Of them sigma0 is searched in its logarithm."""
TRUE = {"c": 0.93, "beta": -0.41, "sigma0": 37.0, "tau_c": 0.61, "tau_v": 0.083, "tau_s": 0.9, "v_s": 0.21}
PRECISE = Descent(1e-14, 1e-14, 1e-14, 200, difference=1e-7)


def measured(number: int, size: int, seed: int) -> FitRun:
    """A run of the drive at values that no fit begins from, with noise."""
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(size)
    rate, load = 2.1 + 0.7 * number, 0.8 + 0.37 * number
    u = np.column_stack([0.7 * np.sin(rate * t) + 0.2 * np.sin(3.1 * rate * t), load + 0.3 * np.cos(0.9 * t)])
    y = DRIVE.simulate(DRIVE.params(None, TRUE), t, u)
    outputs = [v.name for v in DRIVE.outputs]
    y = y[:, [outputs.index("x_out"), outputs.index("tau_in")]]
    return FitRun(f"run {number}", t, u, y + rng.normal(scale=[0.011, 0.017], size=y.shape))


def problem(runs: list[FitRun]) -> Problem:
    """All fixed at the truth but for the five, which begin aside, and the zero of each run."""
    space = search_space(DRIVE, None, {**TRUE, "c": 1.0, "beta": -0.3, "sigma0": 50.0, "tau_c": 0.5, "tau_v": 0.05})
    fields = [*FREE, *(f for f in space.per_run if f == "x_0")]
    return Problem(DRIVE, runs, ("x_out", "tau_in"), space.freeing_only(fields), np.array([31.0, 19.0]))


def fitted(one: Problem) -> np.ndarray:
    return PRECISE.refined(one, one.start())


def shared(one: Problem, table: np.ndarray) -> np.ndarray:
    return table[0, [one.fields.index(f) for f in FREE]]


def test_values_of_a_fit_with_it_are_those_of_a_fit_to_all_runs() -> None:
    """An independent route to the same values: both kinds of runs simulated in one problem."""
    here, there = [measured(0, 700, 1)], [measured(1, 900, 2), measured(2, 500, 3)]
    alone, others, every = problem(here), problem(there), problem([*here, *there])
    prior = prior_of_fit(others, fitted(others))
    found = shared(alone, fitted(replace(alone, prior=prior)))
    expected, by_itself = shared(every, fitted(every)), shared(alone, fitted(alone))
    assert np.abs(found - expected).max() < 0.02 * np.abs(by_itself - expected).max()


def test_it_costs_what_the_fit_loses() -> None:
    """The rise of the sum of squares near the minimum, what each run has of its own moved along."""
    there = problem([measured(1, 900, 2), measured(2, 500, 3)]).reweighted(np.array([23.0, 41.0]))
    table = fitted(there)
    prior = prior_of_fit(there, table)
    other = replace(problem([measured(0, 300, 1)]).reweighted(there.weights), prior=prior)
    rng = np.random.default_rng(7)
    for _ in range(5):
        moved = table.copy()
        for f in FREE:
            moved[:, there.fields.index(f)] *= 1.0 + 2e-3 * rng.standard_normal()
        held = there.over(there.space.fixing(FREE))
        best = PRECISE.refined(held, moved)
        penalty = float(np.sum(other.penalties(moved[:1]) ** 2))
        assert penalty == pytest.approx(there.cost(best) - there.cost(table), rel=0.05)


def test_of_some_fields_the_others_go_where_they_cost_least() -> None:
    """Schur's complement of the products, by an inverse instead of triangles."""
    rng = np.random.default_rng(5)
    slopes = tuple(rng.normal(size=(40, 6)) for _ in range(2))  # two of the runs' own, then four fields
    fields = ("a", "b", "c", "d")
    prior = Prior(fields, np.arange(4.0), np.array([False, True, False, True]), slopes)
    weights = np.array([0.7, 3.1])
    kept = prior.only(("d", "b", "unknown"))
    assert kept.fields == ("b", "d")
    assert kept.centre.tolist() == [1.0, 3.0]
    assert kept.logarithmic.all()
    products = sum(w**2 * one.T @ one for w, one in zip(weights, slopes, strict=True))
    expected = np.linalg.inv(np.linalg.inv(products)[np.ix_([3, 5], [3, 5])])
    rows = kept.rows(weights)
    assert rows.T @ rows == pytest.approx(expected, rel=1e-9)


def test_of_a_fit_with_nothing_free_nothing_is_known() -> None:
    there = problem([measured(1, 300, 2)])
    nothing = there.over(there.space.fixing(there.space.free))
    prior = prior_of_fit(nothing, nothing.start())
    here = problem([measured(0, 300, 1)])
    table = here.start()
    assert not prior.fields
    assert replace(here, prior=prior).cost(table) == here.cost(table)


def test_a_descent_with_it_ends_where_the_slope_of_the_cost_is_none() -> None:
    there, here = problem([measured(1, 900, 2)]), problem([measured(0, 400, 1)])
    known = replace(here, prior=prior_of_fit(there, fitted(there)))
    table = fitted(known)
    least = known.cost(table)
    for f in FREE:
        for factor in (0.995, 1.005):
            moved = table.copy()
            moved[:, known.fields.index(f)] *= factor
            assert known.cost(moved) > least
