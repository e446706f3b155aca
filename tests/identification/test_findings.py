"""What a fit says of itself, each sentence at its limit: just inside and just outside, signs, units, several runs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.identification.findings import fields_on_bound, findings
from tsm_fmu.identification.informative import check_informative
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import per_run_fields, search_space
from tsm_fmu.regression.uncertainty import Uncertainty

BACKLASH, BOUC_WEN = kernel("PairedTsmBacklash"), kernel("SingleTsmBoucWen")


def problem_of(model: Kernel, runs: int = 1, per_run: tuple[str, ...] = ()) -> Problem:
    t = 0.01 * np.arange(40)
    moved = np.sin(3.0 * t)[:, None] * np.ones(len(model.inputs))
    all_runs = [FitRun(f"r{k}", t, moved, np.cos(t + k)[:, None]) for k in range(runs)]
    return Problem(model, all_runs, (model.outputs[0].name,), search_space(model, per_run=per_run))


def known(names: tuple[str, ...] = (), stderr: dict[str, float] | None = None, **changed: object) -> Uncertainty:
    errors = {name: 0.0 for name in names} | (stderr or {})
    one = Uncertainty(errors, ({},), np.eye(len(names)), names, 1.0, 10.0, 1.0, dict.fromkeys(names, 1.0))
    return replace(one, **changed)


@pytest.mark.parametrize(
    ("model", "field", "one_signed"),
    [(BACKLASH, "alpha", True), (BACKLASH, "beta", True), (BACKLASH, "x_0", False), (BOUC_WEN, "rho1", True),
     (BOUC_WEN, "mu1", False), (BOUC_WEN, "sigma", False)],
)  # fmt: skip
@pytest.mark.parametrize("ratio", [0.999, 1.001])
def test_a_value_of_one_sign_is_undetermined_where_its_interval_holds_zero(model, field, one_signed, ratio) -> None:
    problem = problem_of(model).over(search_space(model).freeing_only([field]))
    table = problem.start()
    value = -0.37 if field in ("beta", "mu1", "x_0") else 0.71
    table[:, problem.fields.index(field)] = value
    error = ratio * abs(value) / 1.96
    told, undetermined = findings(problem, table, frozenset(), {}, known((field,), {field: error}))
    expected = one_signed and ratio > 1.0
    assert undetermined == ((field,) if expected else ())
    text = f"{field} = {value:.6g} (standard error {error:.3g}) is not determined by these runs"
    assert told == ((text,) if expected else ())
    told, undetermined = findings(problem, table, frozenset(), {}, known((field,), {field: math.nan}))
    assert (told, undetermined) == ((f"{field} = {value:.6g} is not determined by these runs",), (field,))
    assert findings(problem, table, frozenset([field]), {}, known())[1] == ()  # on its bound that is said alone


def test_per_run_values_are_undetermined_where_one_run_does_not_hold_them() -> None:
    problem = problem_of(BACKLASH, 3, per_run_fields(BACKLASH))
    table = problem.start()
    table[:, problem.fields.index("x_0")] = [0.1, 0.3, -0.1]
    errors = dict.fromkeys(problem.shared, 1e-9)
    runs = ({"x_0": 0.1, "x_h_0": 0.1}, {"x_0": math.nan, "x_h_0": 0.2}, {"x_0": 0.1, "x_h_0": 0.3})
    told, undetermined = findings(problem, table, frozenset(), {}, known(("c",), errors, per_run=runs))
    assert undetermined == ("x_0",)
    assert told == ("x_0 = 0.1 is not determined by these runs",)
    assert findings(problem, table, frozenset(), {}, known(("c",), errors, per_run=({}, {}, {}))) == ((), ())


def test_what_a_bound_or_a_condition_holds_is_told_in_the_order_of_the_model_with_unit_and_range() -> None:
    problem = problem_of(BACKLASH, 2, per_run_fields(BACKLASH))
    problem = problem.over(problem.space.with_bounds("x_0", lo=-0.25, hi=0.75))
    table = problem.start()
    table[:, problem.fields.index("x_0")] = [0.5, 0.75]
    table[:, problem.fields.index("alpha")] = 123.456789
    errors = dict.fromkeys(problem.shared, 1e-9)
    at_bound = frozenset(["x_0", "alpha"])
    told, _ = findings(problem, table, at_bound, {"B > 0": ("c", "beta")}, known(("c",), errors))
    asks = "the model asks for more, or these runs do not hold it"
    assert told == (
        f"alpha = 123.457 1/rad is on a bound [0, inf]: {asks}",
        f"x_0 = 0.625 rad is on a bound [-0.25, 0.75]: {asks}",
        "the condition B > 0 holds the fit: c, beta",
    )


@pytest.mark.parametrize(("number", "said"), [(999.0, False), (1001.0, True), (math.inf, True)])
def test_parameters_that_trade_are_named_with_their_largest_correlation(number: float, said: bool) -> None:
    matrix = np.array([[1.0, 0.41, -0.93], [0.41, 1.0, 0.87], [-0.93, 0.87, 1.0]])
    errors = dict.fromkeys(("c", "beta", "alpha", "x_0", "x_h_0"), 1e-9)
    names = ("alpha", "c", "beta")
    about = known(names, errors, correlation=matrix, condition_number=number)
    problem = problem_of(BACKLASH)
    told, _ = findings(problem, problem.start(), frozenset(), {}, about)
    text = (
        f"condition number {number:.3g}: the parameters trade against each other, most of all alpha and beta "
        "(correlation -0.9300)"
    )
    assert told == ((text,) if said else ())
    nothing_shared = known((), errors, condition_number=number)
    assert findings(problem, problem.start(), frozenset(), {}, nothing_shared) == ((), ())


@pytest.mark.parametrize(("decades", "found"), [(5.93, False), (5.95, True), (-5.93, False), (-5.95, True)])
@pytest.mark.parametrize("field", ["alpha", "beta"])
def test_a_value_that_has_run_six_decades_away_is_on_a_bound(field: str, decades: float, found: bool) -> None:
    """At rest, where a value has no effect and is near no bound for another reason; one of two runs is enough."""
    problem = problem_of(BACKLASH, 2)
    still = [replace(run, inputs=np.zeros_like(run.inputs)) for run in problem.runs]
    problem = problem.with_runs(still).over(problem.space.freeing_only([field]))
    table = problem.start()
    table[1, problem.fields.index(field)] *= 10.0**decades
    assert (fields_on_bound(problem, table) == {field}) is found


def test_a_value_on_its_bound_is_told_of_any_run_also_where_it_has_no_effect() -> None:
    """SingleTsmBoucWen at rest: nothing has an effect, and only the bound itself counts."""
    problem = problem_of(BOUC_WEN, 3, ("mu1",))
    still = [replace(run, inputs=np.zeros_like(run.inputs)) for run in problem.runs]
    problem = problem.with_runs(still).over(problem.space.with_bounds("mu1", lo=-0.9, hi=0.9).freeing_only(["mu1"]))
    j = problem.fields.index("mu1")
    for value, on in ((0.9, True), (-0.9, True), (0.9 * (1.0 - 1e-9), False), (0.0, False)):
        table = problem.start()
        table[2, j] = value
        assert (fields_on_bound(problem, table) == {"mu1"}) is on


def run_of(name: str, x: np.ndarray, y: np.ndarray) -> FitRun:
    return FitRun(name, 0.01 * np.arange(len(x)), x, y)


def test_as_many_values_as_parameters_are_too_few_and_one_more_is_enough() -> None:
    """Five parameters are free; two channels of every run count."""
    x = np.linspace(0.0, 1.0, 9)[:, None]
    space = search_space(BACKLASH)
    for lengths, channels, enough in (((2, 3), 1, False), ((3, 3), 1, True), ((2,), 2, False), ((3,), 2, True)):
        runs = [run_of(f"r{n}", x[:n], x[:n] * np.arange(1, channels + 1)) for n in lengths]
        problem = Problem(BACKLASH, runs, ("x_out", "x_h")[:channels], space)
        if enough:
            check_informative(problem)
            continue
        with pytest.raises(InputError) as wrong:
            check_informative(problem)
        names = ", ".join(run.name for run in runs)
        values = channels * sum(lengths)
        assert str(wrong.value).startswith(f"{values} measured values in {names} for 5 free parameters of PairedTsm")


def test_a_channel_that_never_moves_and_inputs_that_never_do_are_refused_and_no_others() -> None:
    model = kernel("TendonDrive")
    moving, still = np.linspace(0.1, 1.0, 30), np.full(30, 0.731)
    both = [np.column_stack([moving, still]), np.column_stack([still, still + 1.0])]
    space = search_space(model)

    def check(inputs: list[np.ndarray], targets: list[np.ndarray]) -> None:
        runs = [run_of(f"r{k}", x, y) for k, (x, y) in enumerate(zip(inputs, targets, strict=True))]
        check_informative(Problem(model, runs, ("x_out", "tau_in"), space))

    free = [np.column_stack([moving, moving]), np.column_stack([still, moving])]
    check([both[0], both[1]], free)  # one channel rests in one run, one input moves in one
    with pytest.raises(InputError) as wrong:
        check([both[0], both[0]], [both[0], both[1]])
    assert str(wrong.value).startswith("channel 'tau_in' is 0.731 in every row of r0, r1 -- expected one that moves")
    assert str(wrong.value).endswith("leave it out with --map tau_in=NAME")
    with pytest.raises(InputError) as wrong:
        check([both[1], both[1]], free)
    assert str(wrong.value).startswith("no input of TendonDrive moves in r0, r1 (x_in, tau_out) -- expected motion")
