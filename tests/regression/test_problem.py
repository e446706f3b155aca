"""Many simulations in one call are those made one by one, whatever fails among them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record, kernel_inputs
from tsm_fmu.regression import problem as module
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import fit_run, search_space

MODEL = chain("TendonDrive", ("load_dependence", "delay@tau_in"))


def made(sizes: tuple[int, ...] = (611, 1300, 97), lead: int = 0) -> Problem:
    rng = np.random.default_rng(11)
    runs = []
    for number, size in enumerate(sizes):
        t = 0.013 * np.arange(size) + 0.7 * number
        u = np.column_stack([0.9 * np.sin(2.3 * t + number), 1.1 + 0.3 * np.cos(0.7 * t)])
        run = FitRun(f"run {number}", t, u, rng.normal(size=(size, 2)))
        runs.append(run.compared_from(lead) if lead else run)
    return Problem(MODEL, runs, ("x_out", "tau_in"), search_space(MODEL))


def rows(problem: Problem, count: int) -> list[tuple[int, np.ndarray]]:
    rng = np.random.default_rng(5)
    table = problem.start()
    found = []
    for k in rng.integers(0, len(problem.runs), count).tolist():
        row = table[k] * rng.uniform(0.9, 1.1, table.shape[1])
        row[problem.fields.index("tau_in__delay__T_d")] = rng.uniform(0.0, 0.3)
        found.append((k, row))
    return found


@pytest.mark.parametrize(("lead", "block", "piece"), list(product((0, 41), (40_000, 900, 300), (25_000, 1))))
def test_one_call_gives_what_single_calls_give(
    lead: int, block: int, piece: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_ROWS", block)
    monkeypatch.setattr(module, "PIECE_ROWS", piece)
    monkeypatch.setattr(module, "PARALLEL_ROWS", 1)
    problem = made(lead=lead)
    wanted = rows(problem, 23)
    together = problem.residuals(wanted)
    for (k, row), found in zip(wanted, together, strict=True):
        run = problem.runs[k]
        time, inputs = run.with_lead
        y = MODEL.simulate(problem.params(row), time, inputs)[lead:, problem.columns]
        error = (y - run.targets) * problem.weights
        edges = np.arange(0, len(error), problem.block)
        means = [error[a : a + problem.block].sum(axis=0) / np.sqrt(len(error[a : a + problem.block])) for a in edges]
        assert np.allclose(found, np.array(means).ravel(order="F"), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("length", [1, 2, 7, 611])
@pytest.mark.parametrize("block", range(2, module.FEW + 1))
def test_blocks_of_few_samples_are_added_up_to_the_bits_of_reduceat(block: int, length: int) -> None:
    samples = np.random.default_rng(3).normal(size=(2, length))
    assert np.array_equal(
        module._sums_of_few(samples, block), np.add.reduceat(samples, np.arange(0, length, block), axis=1)
    )


def test_values_in_doubt_leave_what_is_beyond_it_and_those_not_compared_nothing() -> None:
    problem = made((300,))
    point = [(0, problem.start()[0])]
    whole, doubt = problem.residuals(point)[0], np.zeros((300, 2))
    doubt[40:90, 1] = np.inf
    doubt[120:190, 0] = np.quantile(np.abs(whole[120:190]), 0.4) / problem.weights[0]
    run = problem.runs[0].doubting(doubt)
    within = problem.with_runs([run]).reweighted(problem.weights)
    found, allowed = within.residuals(point)[0], (doubt * problem.weights).T.ravel()
    assert np.allclose(found, np.sign(whole) * np.maximum(np.abs(whole) - allowed, 0.0), rtol=1e-12, atol=1e-15)
    assert 0.3 < (found[120:190] == 0.0).mean() < 0.5
    assert np.array_equal(found[allowed == 0.0], whole[allowed == 0.0])
    assert np.allclose(within.gaps(problem.start())[0].T.ravel(), -found / problem.weights.repeat(300), atol=1e-15)
    assert np.array_equal(run.doubting(0.1 * doubt).doubt, doubt)  # the larger of two
    assert not problem.runs[0].doubting(np.zeros((300, 2))).doubt.size


@pytest.mark.parametrize(("lead", "piece"), list(product((0, 41), (25_000, 900))))
def test_a_simulation_that_fails_is_nan_and_spoils_no_other(
    lead: int, piece: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PIECE_ROWS", piece)
    monkeypatch.setattr(module, "PARALLEL_ROWS", 1)
    problem = made(lead=lead)
    wanted = rows(problem, 12)
    failing = (0, 4, 5, 11)
    for i in failing:
        wanted[i][1][problem.fields.index("tau_in__delay__T_d")] = 1.0  # 77 steps: more than the delay keeps
    found = problem.residuals(wanted)
    assert [i for i, r in enumerate(found) if np.isnan(r).any()] == list(failing)
    assert all(np.isnan(found[i]).all() for i in failing)
    assert np.array_equal(found[6], problem.residual(*wanted[6]))


def test_whole_numbers_reach_the_model_whole() -> None:
    model = kernel("LebusWinding")
    t = 0.01 * np.arange(300)
    run = FitRun("run", t, np.column_stack([3.1 * t, *([10.3 + t] * (len(model.inputs) - 1))]), t[:, None])
    problem = Problem(model, [run], (model.outputs[0].name,), search_space(model))
    row = problem.start()[0]
    p = problem.params(row)
    assert p.n_layers == 2
    assert type(p.n_layers) is int
    state, outputs = model.module.start(model.params(), model.module.Inputs(*run.inputs[0]))
    given = [outputs]
    for u, dt in zip(run.inputs[1:], np.diff(t), strict=True):
        state, outputs = model.module.step(model.params(), state, model.module.Inputs(*u), dt)
        given.append(outputs)
    assert np.array_equal(problem.every_output(0, row), np.array(given))
    assert np.ptp(given, axis=0).max() > 0.0


def test_refused_is_what_the_model_says_of_each_row() -> None:
    problem = made()
    rng = np.random.default_rng(8)
    verdicts = []
    ends = [(q.lo, q.hi) for q in (v.quantity for v in MODEL.parameters)]
    for _ in range(400):
        row = problem.start()[0]
        j = int(rng.integers(row.size))
        near = [np.nextafter(end, to) for end in ends[j] for to in (-np.inf, np.inf)]
        row[j] = rng.choice([*ends[j], *near, np.nan, np.inf, -row[j], 3.0 * row[j]])
        refused = problem.refused(np.array([problem.start()[0], row]))
        try:
            MODEL.check(problem.params(row))
            said = ""
        except InputError as refusal:
            said = str(refusal)
        assert refused is bool(said), (problem.fields[j], row[j], said)
        verdicts.append(refused)
    assert 0.2 < np.mean(verdicts) < 0.9


def test_a_run_keeps_what_was_said_of_its_derived_inputs() -> None:
    model, t = kernel("SingleTsmDahl"), 0.01 * np.arange(400)
    x = 0.02 * np.sin(2.1 * t)
    columns = {"x": x, "T_in": 3.0 + 0.0 * t, "T_load": 2.0 + 0.0 * t, "F": np.sign(np.cos(2.1 * t))}
    record = Record("log", t, columns, {"x": "m", "T_in": "N", "T_load": "N", "F": "N"})
    run = fit_run(model, record, ("F",), cutoff=7.0)
    assert [note.partition(" by ")[0] for note in run.derived] == ["v derived from x", "a derived from x"]
    assert np.array_equal(run.inputs, kernel_inputs(record, model, 7.0).values)
    assert run.every(3).derived == run.compared_from(20).derived == run.derived


BACKLASH = kernel("PairedTsmBacklash")


def pooled(weights: dict[str, float], centres: dict[str, float]) -> tuple[Problem, np.ndarray]:
    t = 0.01 * np.arange(40)
    runs = [FitRun(f"r{k}", t, np.sin(t + k)[:, None], np.cos((1 + k) * t)[:, None]) for k in range(3)]
    space = search_space(BACKLASH, per_run=("x_0", "x_h_0"))
    found = Problem(BACKLASH, runs, ("x_out",), space, pooling=weights, centres=centres)
    table = found.start()
    table[:, found.fields.index("x_0")] = [0.1, 0.4, -0.2]
    table[:, found.fields.index("x_h_0")] = [0.01, 0.02, 0.06]
    return found, table


@pytest.mark.parametrize(
    ("weights", "centres", "expected"),
    [
        ({}, {}, []),
        ({"x_0": 2.0}, {}, [0.0, 0.6, -0.6]),  # about their mean, 0.1
        ({"x_0": 2.0}, {"x_0": -0.2}, [0.6, 1.2, 0.0]),
        ({"x_h_0": 10.0, "x_0": 2.0}, {"x_h_0": 0.0}, [0.0, 0.6, -0.6, 0.1, 0.2, 0.6]),
        ({"x_0": 0.0, "x_h_0": 10.0}, {}, [-0.2, -0.1, 0.3]),
        ({"c": 5.0}, {}, []),  # shared: there is nothing to pool
    ],
)
def test_pooled_values_cost_the_square_of_their_distance_beside_the_residuals(weights, centres, expected) -> None:
    problem, table = pooled(weights, centres)
    assert problem.penalties(table) == pytest.approx(expected, abs=1e-12)
    rest = sum(float(r @ r) for r in problem.residuals(list(enumerate(table))))
    assert problem.cost(table) == pytest.approx(rest + sum(e**2 for e in expected), rel=1e-12)


def test_where_nothing_is_compared_a_model_may_run_away() -> None:
    run = made((60,)).runs[0]
    doubt = np.zeros((60, 2))
    doubt[20:50, 1] = np.inf
    away = run.targets.copy()
    away[30, 1], away[5, 0] = np.inf, -np.inf
    with np.errstate(all="raise"):
        assert np.isneginf(run.doubting(doubt).excess(away)[0, 5])
        assert np.delete(run.doubting(doubt).excess(away)[0], 5).tolist() == [0.0] * 59
        assert run.doubting(doubt).excess(away)[1].tolist() == [0.0] * 60
        assert run.doubting(doubt).compared(away)[20:50] == pytest.approx(run.targets[20:50])


def test_a_cost_that_is_no_number_is_infinite() -> None:
    problem, table = pooled({}, {})
    spoiled = table.copy()
    spoiled[1, problem.fields.index("x_0")] = np.nan
    huge = table.copy()
    huge[1, problem.fields.index("x_0")] = 1e200
    assert problem.cost(spoiled) == problem.cost(huge) == np.inf
    assert np.isfinite(problem.cost(table))


def test_channels_weigh_by_their_spread_within_runs_unless_they_do_not_move() -> None:
    """The mean over runs of the variances: where a run's level lies counts for nothing."""
    rng = np.random.default_rng(2)
    t = 0.01 * np.arange(500)
    spreads = np.array([[0.2, 3.0], [0.6, 1.0]])
    targets = [k * 100.0 + s * rng.normal(size=(500, 2)) for k, s in enumerate(spreads)]
    u = np.column_stack([np.sin(t), np.cos(t)])
    runs = [FitRun(f"r{k}", t, u, y) for k, y in enumerate(targets)]
    weights = Problem(MODEL, runs, ("x_out", "tau_in"), search_space(MODEL)).weights
    assert weights == pytest.approx(1.0 / np.sqrt(np.mean([y.var(axis=0) for y in targets], axis=0)))
    still = [FitRun(r.name, t, u, np.column_stack([r.targets[:, 0], np.full(500, 7.0)])) for r in runs]
    weights = Problem(MODEL, still, ("x_out", "tau_in"), search_space(MODEL)).weights
    assert weights[1] == 1.0
