"""From the optimiser's variables to values and back: the same table, the bounds, and what a condition refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.scaled_variables import DECADES, ScaledVariables, logarithm_sign
from tsm_fmu.regression.specification import per_run_fields, search_space

MODEL = kernel("PairedTsmBacklash")
SCALES = {"c": 0.31, "beta": 0.17, "alpha": 4.9, "x_0": 0.023, "x_h_0": math.inf}


@pytest.fixture
def variables() -> ScaledVariables:
    t = 0.01 * np.arange(50)
    runs = [FitRun(f"r{k}", t, np.sin(t + k)[:, None], np.cos(t)[:, None]) for k in range(3)]
    problem = Problem(MODEL, runs, ("x_out",), search_space(MODEL, per_run=per_run_fields(MODEL)))
    table = problem.start()
    table[:, problem.fields.index("x_0")] = [0.1, -0.2, 0.3]
    return ScaledVariables(problem, problem.shared, problem.per_run, SCALES, table)


def test_values_are_their_centre_and_their_scale_times_the_variable(variables: ScaledVariables) -> None:
    rng = np.random.default_rng(4)
    q = variables.of(variables.anchor) + rng.uniform(-0.03, 0.03, len(variables.axes))
    table = variables.table(q)
    for axis, one in zip(variables.axes, q, strict=True):
        anchor = variables.anchor[axis.run or 0, axis.column]
        scale = SCALES[axis.field] if math.isfinite(SCALES[axis.field]) else max(abs(anchor), 1.0)
        expected = math.copysign(math.exp(one), axis.sign) if axis.sign else anchor + scale * one
        rows = range(3) if axis.run is None else [axis.run]
        assert [table[k, axis.column] for k in rows] == pytest.approx([expected] * len(rows), rel=1e-12)
    assert variables.of(table) == pytest.approx(q, abs=1e-9)
    assert variables.accepts(q)


def test_each_shared_field_moves_alone_and_one_of_each_run_at_once(variables: ScaledVariables) -> None:
    fields = [{variables.axes[i].field for i in group} for group in variables.groups]
    assert sorted(next(iter(f)) for f in fields if len(f) == 1) == ["alpha", "beta", "c", "x_0", "x_h_0"]
    assert sorted(len(group) for group in variables.groups) == [1, 1, 1, 3, 3]
    assert sorted(i for group in variables.groups for i in group) == list(range(len(variables.axes)))


def test_bounds_are_those_of_the_space_in_the_same_scale(variables: ScaledVariables) -> None:
    for axis in variables.axes:
        parameter = variables.problem.space[axis.field]
        if axis.sign:
            low, high = math.exp(axis.lo), math.exp(axis.hi)
            start = abs(axis.centre)
            near, far = sorted((abs(parameter.lo), abs(parameter.hi)))
            assert low == pytest.approx(max(near, start * 10.0**-DECADES), rel=1e-9)
            assert high == pytest.approx(min(far, start * 10.0**DECADES), rel=1e-9)
        else:
            ends = (axis.centre + axis.scale * axis.lo, axis.centre + axis.scale * axis.hi)
            assert ends == pytest.approx((parameter.lo, parameter.hi), rel=1e-9)
    far = variables.of(np.full_like(variables.anchor, 1e9))
    assert (far > variables.lo).all()
    assert (far < variables.hi).all()


def test_what_a_condition_refuses_is_drawn_back_straight_to_its_edge(variables: ScaledVariables) -> None:
    """C + beta > 0: c and beta come back, both logarithms, and nothing else; nearer than on the way to the anchor."""
    names = [axis.field for axis in variables.axes]
    here = variables.of(variables.anchor)
    q = here.copy()
    q[names.index("c")] -= 2.0  # c = 1.00056 - 0.62
    q[names.index("x_0")] += 0.4
    assert not variables.accepts(q)
    table = variables.table(q)
    c, beta = (table[0, variables.problem.fields.index(n)] for n in ("c", "beta"))
    assert 0.0 < c + beta < 1e-9
    moved = variables.of(table) - q
    both = [names.index("c"), names.index("beta")]
    assert moved[both[0]] > 0.0 > moved[both[1]]
    assert np.delete(moved, both) == pytest.approx(0.0, abs=1e-5)
    way = np.linspace(0.0, 1.0, 2001)[:, None] * (here - q) + q
    first = next(point for point in way if variables.accepts(point))
    assert np.linalg.norm(moved) < 0.8 * np.linalg.norm(first - q)


def test_a_search_that_begins_on_the_edge_of_a_condition_leaves_it(variables: ScaledVariables) -> None:
    """There every point beyond lies on a line that leads nowhere; what is not of the condition moves all the same."""
    problem = variables.problem
    on_edge = variables.anchor.copy()
    on_edge[:, problem.fields.index("beta")] = -on_edge[:, problem.fields.index("c")] + 1e-12
    again = ScaledVariables(problem, problem.shared, problem.per_run, SCALES, on_edge)
    names = [axis.field for axis in again.axes]
    q = again.of(on_edge)
    q[names.index("beta")] += 0.3  # a logarithm: further below 0
    q[names.index("alpha")] += 0.2
    moved = again.of(again.table(q)) - again.of(on_edge)
    assert moved[names.index("alpha")] == pytest.approx(0.2, rel=1e-6)
    assert moved[names.index("c")] == pytest.approx(0.15, rel=0.2)  # along the edge, beside which c = -beta
    assert moved[names.index("beta")] == pytest.approx(0.15, rel=0.2)


def test_a_condition_that_steps_do_not_reach_is_approached_on_the_line(variables: ScaledVariables) -> None:
    """Where neither c nor beta may come back, the last value on the way from the anchor is taken."""
    names = [axis.field for axis in variables.axes]
    here = variables.of(variables.anchor)
    q = here.copy()
    q[names.index("c")] -= 2.0
    q[names.index("x_0")] += 0.4
    variables.lo, variables.hi = q - 1e-9, q + 1e-9  # for the steps; the line goes beyond
    table = variables.table(q)
    variables.lo, variables.hi = np.full(q.size, -50.0), np.full(q.size, 50.0)
    moved = variables.of(table) - here
    assert moved[names.index("x_0")] / moved[names.index("c")] == pytest.approx(-0.2, rel=1e-3)


def test_only_a_bound_of_zero_that_is_open_makes_a_logarithm() -> None:
    signs = {v.name: logarithm_sign(v.quantity) for v in MODEL.parameters}
    assert signs["alpha"] == 1.0
    assert signs["x_0"] == 0.0


@pytest.mark.parametrize("shared", [False, True])
def test_a_row_that_breaks_a_condition_is_refused_in_whichever_run(shared: bool) -> None:
    """C + beta > 0, with a beta of each run: the second alone breaks it; with shared values the first row tells."""
    t = 0.01 * np.arange(50)
    runs = [FitRun(f"r{k}", t, np.sin(t + k)[:, None], np.cos(t)[:, None]) for k in range(3)]
    problem = Problem(MODEL, runs, ("x_out",), search_space(MODEL, per_run=() if shared else ("beta",)))
    table = problem.start()
    both = ScaledVariables(problem, problem.shared, problem.per_run, SCALES, table)
    j = problem.fields.index("beta")
    for k in range(3):
        moved = table.copy()
        moved[slice(None) if shared else k, j] = -1.2
        assert not both.accepts(both.of(moved))
        moved[:, j] = -0.99
        assert both.accepts(both.of(moved))


@pytest.mark.parametrize(("field", "lo", "hi"), [("alpha", 3.0, 40.0), ("beta", -0.95, -0.2), ("alpha", None, None)])
def test_a_logarithm_has_the_bounds_of_the_space_where_they_are_nearer_than_its_decades(field, lo, hi) -> None:
    t = 0.01 * np.arange(50)
    space = search_space(MODEL)
    if lo is not None:
        space = space.with_bounds(field, lo, hi)
    problem = Problem(MODEL, [FitRun("r", t, np.sin(t)[:, None], np.cos(t)[:, None])], ("x_out",), space)
    variables = ScaledVariables(problem, [field], (), SCALES, problem.start())
    (axis,) = variables.axes
    start = abs(problem.space[field].start)
    near, far = sorted((abs(lo), abs(hi))) if lo is not None else (start * 1e-6, start * 1e6)
    assert (math.exp(axis.lo), math.exp(axis.hi)) == pytest.approx((near, far), rel=1e-9)
