"""Identification finds what was planted, says how well, and says so when it cannot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import rig
from scipy.optimize import least_squares, minimize_scalar

from tsm_fmu.identification import fit as fit_module
from tsm_fmu.identification.findings import conditions_met, fields_on_bound
from tsm_fmu.identification.fit import Fit, FitInterrupted, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.sensitivity import sensitivity_scales
from tsm_fmu.regression.solver import Progress
from tsm_fmu.regression.specification import per_run_fields, search_space

BACKLASH = kernel("PairedTsmBacklash")
STEP = 2.0 * math.pi / 4000.0


def identified(runs: list[FitRun], fixed: tuple[str, ...] = (), **options) -> Fit:
    return fit(
        BACKLASH,
        runs,
        ("x_out",),
        search_space(BACKLASH, fixed=fixed, per_run=per_run_fields(BACKLASH)),
        **options,
    )


@pytest.fixture(scope="module")
def clean() -> FitRun:
    return rig.backlash_run("clean", 3)


@pytest.fixture(scope="module")
def three() -> list[FitRun]:
    offsets = {"a": -1.2617, "b": -1.1173, "c": 0.0371}
    return [
        rig.backlash_run(name, 10 * n, x_0=x_0, x_h_0=0.004 * n - 0.003, noise=0.002, encoder=STEP)
        for n, (name, x_0) in enumerate(offsets.items(), start=1)
    ]


def test_exact_data_give_the_planted_values(clean: FitRun) -> None:
    result = identified([clean])
    found = {name: result.parameters[name].value for name in ("c", "beta", "alpha", "x_0", "x_h_0")}
    assert found == pytest.approx({**rig.TRUE, "x_0": -1.2617, "x_h_0": 0.0113}, rel=1e-5)
    assert result.measured["x_out"].rmse < 1e-7
    assert result.at_bound == frozenset()
    assert result.undetermined == ()


def test_shared_and_per_run_values_from_coloured_noise_and_encoder_steps(three: list[FitRun]) -> None:
    result = identified(three)
    for name, true in rig.TRUE.items():
        p = result.parameters[name]
        assert p.stderr is not None
        assert abs(p.value - true) < 4.0 * p.stderr, name
        assert p.stderr < 0.1 * abs(true), name
    for name, x_0 in {"a": -1.2617, "b": -1.1173, "c": 0.0371}.items():
        run = result.runs[name]
        assert abs(run.values["x_0"] - x_0) < 4.0 * run.stderr["x_0"]
    assert result.measured["x_out"].rmse == pytest.approx(math.hypot(0.002, STEP / math.sqrt(12.0)), rel=0.05)


def test_standard_errors_cover_the_truth_under_coloured_noise() -> None:
    """Over seeds, (estimate - truth)/stderr has spread one; white-noise errors would make it four."""
    base = rig.backlash_run("r", 5)
    scores = []
    for seed in range(60):
        noise = rig.coloured(base.time.size, 0.003, 1000 + seed)
        result = identified([replace(base, targets=base.targets + noise[:, None])])
        scores.append(
            [(result.parameters[n].value - true) / result.parameters[n].stderr for n, true in rig.TRUE.items()]
        )
    spread = np.sqrt(np.mean(np.square(scores), axis=0))
    assert (spread > 0.7).all(), spread
    assert (spread < 1.5).all(), spread


def test_elimination_reaches_the_minimum_of_plain_least_squares(three: list[FitRun]) -> None:
    """Oracle: scipy on all parameters of one run at once, from the truth, without any of our search."""
    run = three[0]
    result = identified([run])
    problem = Problem(BACKLASH, [run], ("x_out",), search_space(BACKLASH))

    def residual(values: np.ndarray) -> np.ndarray:
        return (problem.outputs(0, values) - run.targets)[:, 0]

    plain = least_squares(residual, [0.9137, -0.3871, 13.7, -1.2617, 0.001], x_scale="jac", xtol=1e-12, ftol=1e-14)
    values = [result.parameters[f].value for f in problem.fields]
    assert values == pytest.approx(plain.x, rel=1e-4)
    assert run.time.size * result.measured["x_out"].rmse ** 2 == pytest.approx(2.0 * plain.cost, rel=1e-9)


DAHL = kernel("SingleTsmDahl")
CHANNELS = ("F", "T_out")
RHO1 = DAHL.named(DAHL.params())["rho1"]


def dahl(run: FitRun, rho1: float) -> np.ndarray:
    columns = [[o.name for o in DAHL.outputs].index(name) for name in CHANNELS]
    return DAHL.simulate(DAHL.params(values={"rho1": rho1}), run.time, run.inputs)[:, columns]


@pytest.fixture(scope="module")
def disputed() -> FitRun:
    """Friction and tension ask for different values of rho1, with noise of very different size."""
    t = 0.01 * np.arange(400)
    v = 0.05 * np.cos(2.1 * t)
    inputs = {"v": v, "a": np.gradient(v, t), "T_load": 2.0 + 0.5 * np.sin(0.9 * t)}
    run = FitRun("r", t, np.column_stack([inputs.get(i.name, 3.0 + 0.0 * t) for i in DAHL.inputs]), np.zeros((400, 2)))
    y = np.column_stack([dahl(run, 1.3 * RHO1)[:, 0], dahl(run, 0.7 * RHO1)[:, 1]])
    noise = np.random.default_rng(12).standard_normal((400, 2)) * (0.02, 0.1) * y.std(axis=0)
    return replace(run, targets=y + noise)


def weighed(run: FitRun, deviations: np.ndarray) -> float:
    """The value of rho1 with the least sum of squares over deviations, by a search of scipy alone."""

    def cost(rho1: float) -> float:
        return float(np.sum(((dahl(run, rho1) - run.targets) / deviations) ** 2))

    return float(minimize_scalar(cost, bounds=(0.2 * RHO1, 3.0 * RHO1), method="bounded", options={"xatol": 1e-12}).x)


def fitted_rho1(run: FitRun, **options) -> float:
    space = search_space(DAHL).freeing_only(["rho1"])
    return fit(DAHL, [run], CHANNELS, space, **options).parameters["rho1"].value


@pytest.mark.parametrize("deviations", [(0.01, 0.7), (0.4, 0.02), (0.3, 0.3)])
def test_given_deviations_weigh_the_channels(disputed: FitRun, deviations: tuple[float, float]) -> None:
    found = fitted_rho1(disputed, weights=dict(zip(CHANNELS, deviations, strict=True)))
    assert found == pytest.approx(weighed(disputed, np.array(deviations)), rel=1e-5)


def test_without_them_channels_weigh_by_what_is_left_in_them(disputed: FitRun) -> None:
    """Two rounds, each weighted with what the one before has left; the first with the spread of the channels."""
    deviations, rounds = disputed.targets.std(axis=0), []
    for _ in range(3):
        rounds.append(weighed(disputed, deviations))
        deviations = np.sqrt(np.mean((dahl(disputed, rounds[-1]) - disputed.targets) ** 2, axis=0))
    assert fitted_rho1(disputed) == pytest.approx(rounds[2], rel=1e-5)
    assert abs(rounds[2] - rounds[1]) > 0.01 * abs(rounds[2])  # it matters


def test_linear_intervals_are_standard_errors_to_each_side(three: list[FitRun]) -> None:
    result = identified(three, single_start=True)
    for name in rig.TRUE:
        p = result.parameters[name]
        ends = (p.value - 1.96 * p.stderr, p.value + 1.96 * p.stderr)
        assert result.intervals[name] == pytest.approx(ends, rel=1e-12)


@pytest.mark.parametrize(("part", "near"), [(0.5e-4, True), (2e-4, False)])
@pytest.mark.parametrize("end", ["lo", "hi"])
def test_a_value_is_on_a_bound_within_a_ten_thousandth_of_what_it_can_do(
    clean: FitRun, end: str, part: float, near: bool
) -> None:
    """x_0 moves the output by as much as itself: a standard deviation of the channel is its scale, 0.4 its size."""
    space = search_space(BACKLASH, values={"x_0": 0.4}).freeing_only(["x_0"])
    problem = Problem(BACKLASH, [clean], ("x_out",), space)
    scale = min(sensitivity_scales(problem)["x_0"], 0.4)
    bound = 0.4 + (part if end == "hi" else -part) * scale
    bounded = replace(problem, space=space.with_bounds("x_0", **{end: bound}))
    assert ("x_0" in fields_on_bound(bounded, bounded.start())) is near


@pytest.mark.parametrize(("part", "touched"), [(0.5e-4, True), (2e-4, False)])
def test_a_condition_holds_where_a_ten_thousandth_more_breaks_it(clean: FitRun, part: float, touched: bool) -> None:
    """B = c + beta: c and beta are of size 0.9, and a standard deviation of the output is less of either."""
    problem = Problem(BACKLASH, [clean], ("x_out",), search_space(BACKLASH).freeing_only(["c", "beta"]))
    table = problem.start()
    c, beta = (problem.fields.index(name) for name in ("c", "beta"))
    table[:, c], table[:, beta] = 0.9, -0.9
    scales = sensitivity_scales(problem.starting_at(table + np.eye(1, table.shape[1], c) * 0.1))
    table[:, c] += part * min(scales["c"], 0.9)
    found = conditions_met(problem, table)
    assert ("c" in dict.fromkeys(name for names in found.values() for name in names)) is touched


def test_the_mean_of_per_run_values_is_known_better_than_each(three: list[FitRun]) -> None:
    result = identified(three)
    for name in ("x_0", "x_h_0"):
        values = [run.values[name] for run in result.runs.values()]
        assert result.parameters[name].value == pytest.approx(np.mean(values), rel=1e-9)
        assert result.parameters[name].stderr == pytest.approx(np.std(values, ddof=1) / math.sqrt(3), rel=1e-9)


def test_values_of_an_interrupted_search_are_allowed_ones(clean: FitRun) -> None:
    """The best so far may break c + beta > 0: what is kept does not, and has the runs' own values fitted to it."""
    problem = Problem(BACKLASH, [clean], ("x_out",), search_space(BACKLASH, per_run=per_run_fields(BACKLASH)))
    table = problem.start()
    table[:, problem.fields.index("c")], table[:, problem.fields.index("beta")] = 0.9, -1.2
    assert problem.refused(table)
    kept = fit_module._interrupted(problem, table)
    assert not problem.refused(kept)
    left = (problem.outputs(0, kept[0]) - clean.targets)[:, 0]
    assert abs(left.mean()) < 1e-6 * np.abs(clean.targets).max()  # x_0 alone moves every sample alike


def test_same_seed_same_result(three: list[FitRun]) -> None:
    first, second = identified(three, seed=4), identified(three, seed=4)
    assert first.seed == 4
    assert first.parameters.valuesdict() == second.parameters.valuesdict()
    assert first.evaluations == second.evaluations


def test_held_out_run_takes_no_part_and_is_settled_on_its_first_two_seconds(three: list[FitRun]) -> None:
    held = three[2]
    late = held.time >= 2.0
    spoiled = replace(held, targets=held.targets + 0.5 * late[:, None])
    with_clean = identified(three[:2], holdout=[held])
    with_spoiled = identified(three[:2], holdout=[spoiled])
    assert with_clean.parameters.valuesdict() == with_spoiled.parameters.valuesdict()
    assert with_clean.runs["c"].values == with_spoiled.runs["c"].values
    assert with_clean.holdout["x_out"].samples == int(late.sum())
    assert with_clean.holdout["x_out"].rmse < 0.004
    assert with_spoiled.holdout["x_out"].rmse == pytest.approx(0.5, abs=0.004)


def test_joint_condition_stops_the_fit_and_is_named() -> None:
    run = rig.backlash_run("steep", 7, true={"c": 0.9137, "beta": -1.0523, "alpha": 8.3}, noise=0.001)
    result = identified([run])
    c, beta = (result.parameters[n].value for n in ("c", "beta"))
    assert c + beta > 0.0
    assert c + beta < 1e-3
    assert {"c", "beta"} <= result.at_bound
    assert any("B > 0" in finding and "beta" in finding for finding in result.findings)
    BACKLASH.params(values=result.parameters.valuesdict())


def test_bound_that_holds_the_fit_is_named_and_kept() -> None:
    run = rig.backlash_run("outward", 7, true={"c": 0.9137, "beta": 0.2317, "alpha": 8.3}, noise=0.001)
    result = identified([run])
    assert result.parameters["beta"].value < 0.0
    assert "beta" in result.at_bound
    assert any(finding.startswith("beta = ") and "on a bound" in finding for finding in result.findings)


def test_parameter_without_excitation_is_named() -> None:
    t = np.arange(0.0, 6.0, 1.0 / rig.RATE)
    x = 0.31 + 0.1 * t  # one direction, the start forgotten: nothing tells where a reversal would lead
    y = rig.TRUE["c"] * x + rig.TRUE["beta"] / rig.TRUE["alpha"] - 1.2617 + rig.coloured(t.size, 0.001, 8)
    result = identified([FitRun("one way", t, x[:, None], y[:, None])])
    assert {"beta", "alpha"} & {*result.undetermined, *result.at_bound}
    assert any("not determined" in finding or "on a bound" in finding for finding in result.findings)


def test_fixed_values_stay(clean: FitRun) -> None:
    space = search_space(BACKLASH, values={"alpha": 21.7}, fixed=["alpha"], per_run=per_run_fields(BACKLASH))
    result = fit(BACKLASH, [clean], ("x_out",), space)
    assert result.parameters["alpha"].value == 21.7
    assert result.parameters["alpha"].stderr is None
    assert result.measured["x_out"].rmse > 1e-4


@pytest.mark.parametrize(("phase", "point"), [("several starts", 1), ("several starts", 9), ("every sample", 2)])
def test_interruption_keeps_the_best_so_far(three: list[FitRun], phase: str, point: int) -> None:
    """From the first start on; what each run has of its own is fitted to what was found until then."""
    seen: list[Progress] = []

    def interrupt(at: Progress) -> None:
        seen.append(at)
        if sum(phase in one.phase and math.isfinite(one.error) for one in seen) == point:
            raise KeyboardInterrupt

    with pytest.raises(FitInterrupted) as stopped:
        identified(three, progress=interrupt)
    result = stopped.value.fit
    assert not result.complete
    assert result.findings[0].startswith("interrupted")
    spread = np.sqrt(np.mean([run.targets.var() for run in three]))
    assert result.measured["x_out"].rmse <= min(one.error for one in seen) * spread * (1.0 + 1e-6)
    assert phase in seen[-1].phase
    assert 1 <= seen[-1].number <= seen[-1].phases == 2


def test_phases_are_counted_to_the_end(three: list[FitRun]) -> None:
    seen: list[Progress] = []
    identified(three, progress=seen.append, intervals="profile")
    numbers = [one.number for one in seen]
    assert numbers == sorted(numbers)
    assert {one.phases for one in seen} == {3}
    assert numbers[-1] == 3
    assert seen[-1].phase.startswith("profile intervals")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: identified([]), "no measured run -- expected at least one"),
        (lambda r: identified([r], method="slow"), "method 'slow' -- expected one of fast, paper"),
        (lambda r: identified([r], fixed=("gain",)), "--fix gain of PairedTsmBacklash -- expected one of c, beta"),
        (
            lambda r: identified([r], fixed=("c", "beta", "alpha", "x_0", "x_h_0")),
            "no parameter of PairedTsmBacklash is left to fit",
        ),
        (
            lambda r: identified([r], holdout=[FitRun("short", r.time[:300], r.inputs[:300], r.targets[:300])]),
            "held-out run short of 1.495 s -- expected more than the 2 s",
        ),
        (lambda r: per_run_fields(BACKLASH, ["c"]), "--shared c of PairedTsmBacklash -- expected one of x_0, x_h_0"),
        (lambda r: search_space(BACKLASH, values={"beta": -1.2}), "gives B = c + beta"),
    ],
)
def test_wrong_use_is_one_line(clean: FitRun, call, message: str) -> None:
    with pytest.raises(InputError) as caught:
        call(clean)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
