"""The papers' search: the box it draws from, what it searches at all, and what it is told."""

from __future__ import annotations

import math

import numpy as np
import pytest
import rig

from tsm_fmu.identification import genetic
from tsm_fmu.identification.genetic import Evolution
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.scaled_variables import ScaledVariables
from tsm_fmu.regression.seeds import dimensional_scales
from tsm_fmu.regression.sensitivity import sensitivity_scales
from tsm_fmu.regression.solver import Progress, SearchLog, Solution
from tsm_fmu.regression.specification import per_run_fields, search_space

BACKLASH = kernel("PairedTsmBacklash")


@pytest.fixture(scope="module")
def run() -> FitRun:
    return rig.backlash_run("r", 21, noise=0.002).every(8)


def test_the_box_holds_start_and_physical_size_with_a_factor_of_thirty_and_the_bounds(run: FitRun) -> None:
    space = (
        search_space(BACKLASH, values={"c": 7.0, "alpha": 0.02}).with_bounds("c", hi=9.0).with_bounds("x_0", lo=-0.1)
    )
    problem = Problem(BACKLASH, [run], ("x_out",), space)
    variables = ScaledVariables(problem, problem.shared, (), sensitivity_scales(problem), problem.start())
    sizes = dimensional_scales(problem)
    box = dict(zip([axis.field for axis in variables.axes], genetic._box(problem, variables), strict=True))
    for field in ("c", "beta", "alpha"):  # searched in the logarithm of their size
        ends = sorted((abs(problem.space[field].start), sizes[field]))
        low, high = (math.exp(end) for end in box[field])
        assert low == pytest.approx(ends[0] / 30.0)
        assert high == pytest.approx(min(30.0 * ends[1], 9.0 if field == "c" else math.inf))
    scales = {axis.field: axis.scale for axis in variables.axes}
    assert box["x_0"] == pytest.approx((-0.1 / scales["x_0"], 3.0), abs=1e-5)
    assert box["x_h_0"] == pytest.approx((-3.0, 3.0), abs=1e-5)


@pytest.mark.parametrize(
    ("free", "given", "phases"),
    [
        (("alpha",), False, ["differential evolution", "simplex"]),
        (("alpha",), True, ["simplex"]),
        (("x_0",), False, ["linear parameters"]),
    ],
)
def test_the_log_has_the_phases_that_were_announced_and_every_simulation(run, monkeypatch, free, given, phases) -> None:
    monkeypatch.setattr(genetic, "GENERATIONS", 2)
    space = search_space(BACKLASH, values=rig.TRUE, per_run=per_run_fields(BACKLASH)).freeing_only(free)
    problem = Problem(BACKLASH, [run, run.every(2)], ("x_out",), space)
    told: list[Progress] = []
    log = SearchLog(told.append)
    start = Solution(problem.start()) if given else None
    solver = Evolution(4)
    if problem.shared:
        assert solver.phases(problem, start) == len(phases)
    log.plan(len(phases))
    found = solver(problem, log, start)
    assert list(dict.fromkeys(one.phase for one in told)) == phases
    assert log.simulations > 0
    assert log.simulations % 2 == 0  # every point is simulated in both runs
    assert problem.cost(found.table) <= problem.cost(problem.start())
    by_hand = math.sqrt(
        problem.cost(found.table) / sum(r.size for r in problem.residuals(list(enumerate(found.table))))
    )
    assert min(one.error for one in told) == pytest.approx(by_hand, rel=1e-9)
    if free == ("x_0",):  # solved for: the mean of what is left, of each run its own
        still = Problem(BACKLASH, problem.runs, ("x_out",), space).outputs_of_all(problem.start())
        offsets = [float(np.mean(r.targets - y)) for r, y in zip(problem.runs, still, strict=True)]
        assert found.table[:, problem.fields.index("x_0")] == pytest.approx(offsets, abs=1e-6)


def test_nothing_is_announced_beside_the_one_phase_where_nothing_is_free(run: FitRun) -> None:
    problem = Problem(BACKLASH, [run], ("x_out",), search_space(BACKLASH).freeing_only([]))
    assert Evolution().phases(problem) == 1
