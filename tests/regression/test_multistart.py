"""Parts of the search from several starts: how an unconstrained solution becomes an allowed start, what is kept."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.multistart import _outside, _Scout, drawn_inside
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.solver import SearchLog
from tsm_fmu.regression.specification import per_run_fields, search_space

MODEL = kernel("PairedTsmBacklash")


def problem(**bounds: tuple[float, float]) -> Problem:
    t = 0.01 * np.arange(60)
    runs = [FitRun(f"r{k}", t, np.sin(3 * t + k)[:, None], np.cos(t + k)[:, None]) for k in range(2)]
    space = search_space(MODEL, values={"c": 1.0, "beta": -0.4, "alpha": 8.0}, per_run=per_run_fields(MODEL))
    for field, (lo, hi) in bounds.items():
        space = space.with_bounds(field, lo, hi)
    return Problem(MODEL, runs, ("x_out",), space)


def test_a_solution_is_drawn_to_just_inside_the_condition_along_its_line() -> None:
    """C + beta > 0 from (1, -0.4) to (0.2, -0.9): 0.6 - 1.3 s, allowed up to s = 6/13; 98 % of that are taken."""
    one = problem()
    table = one.start()
    fields = {f: one.fields.index(f) for f in ("c", "beta", "alpha", "x_0")}
    table[:, fields["c"]], table[:, fields["beta"]], table[:, fields["alpha"]] = 0.2, -0.9, 11.0
    table[:, fields["x_0"]] = [0.3, -0.7]
    found = drawn_inside(one, table)
    s = 0.98 * 6.0 / 13.0
    for field, start, end in (("c", 1.0, 0.2), ("beta", -0.4, -0.9), ("alpha", 8.0, 11.0)):
        assert found[:, fields[field]] == pytest.approx([start + s * (end - start)] * 2, rel=1e-9)
    assert found[:, fields["x_0"]].tolist() == [0.3, -0.7]  # what each run has of its own stays
    assert not one.refused(found)


@pytest.mark.parametrize(("field", "bounds", "target", "share"), [
    ("alpha", (2.0, 10.0), 14.0, 1.0 / 3.0), ("alpha", (5.0, 99.0), 2.0, 0.5), ("c", (0.9, 1.5), 2.0, 0.5),
])  # fmt: skip
def test_a_solution_is_drawn_to_just_inside_the_bounds_of_the_fit(field, bounds, target, share) -> None:
    one = problem(**{field: bounds})
    table = one.start()
    j = one.fields.index(field)
    start = table[0, j]
    table[:, j] = target
    assert drawn_inside(one, table)[:, j] == pytest.approx([start + 0.98 * share * (target - start)] * 2, rel=1e-9)


def test_what_touches_a_bound_of_the_fit_is_outside() -> None:
    one = problem(alpha=(2.0, 10.0))
    row = one.start()[0]
    j = one.fields.index("alpha")
    for value, outside in ((2.0, True), (2.0001, False), (9.999, False), (10.0, True), (11.0, True)):
        row[j] = value
        assert _outside(one, row) is outside
    row[j], row[one.fields.index("beta")] = 5.0, -1.5
    assert _outside(one, row)  # against the model's condition


def test_points_of_a_scout_are_kept_for_all_runs_with_the_starts_own_values() -> None:
    one = problem()
    start = one.start()
    start[:, one.fields.index("x_0")] = 0.0
    log = SearchLog()
    scout = _Scout(one, log)
    few = one.start()[:1]
    few[0, one.fields.index("alpha")], few[0, one.fields.index("x_0")] = 17.0, 0.9
    scout.offer(few, 0.25)
    scout.simulated(3)
    assert log.simulations == 3
    assert log.best is not None
    assert log.best.shape == (2, 5)
    assert log.best[:, one.fields.index("alpha")].tolist() == [17.0, 17.0]
    assert log.best[:, one.fields.index("x_0")].tolist() == [0.0, 0.0]
