"""Parts of a fit: errors of one run alone, weights, intervals that were not reached, whose zeros count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import rig

from tsm_fmu.identification import fit as fit_module
from tsm_fmu.identification.fit import Fit, FitInterrupted, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.solver import Progress
from tsm_fmu.regression.specification import per_run_fields, search_space

BACKLASH = kernel("PairedTsmBacklash")
ZEROS = {"a": -1.2731, "b": -1.1837, "c": -1.2419, "d": -1.2077, "e": -1.1503}


@pytest.fixture(scope="module")
def runs() -> list[FitRun]:
    return [rig.backlash_run(n, 31 + k, x_0=z, noise=7e-4, seconds=6.0) for k, (n, z) in enumerate(ZEROS.items())]


def fitted(runs: Sequence[FitRun], *, own: bool = True, **options) -> Fit:
    per_run = per_run_fields(BACKLASH) if own else ()
    space = search_space(BACKLASH, None, {**rig.TRUE, "x_0": -1.2}, per_run=per_run)
    return fit(BACKLASH, runs, ("x_out",), space, single_start=True, **options)


def test_a_value_of_the_only_run_is_as_sure_as_in_that_run(runs: list[FitRun]) -> None:
    one = fitted(runs[:1])
    for name in ("x_0", "x_h_0"):
        assert one.parameters[name].value == one.runs["a"].values[name]
        assert one.parameters[name].stderr == pytest.approx(one.runs["a"].stderr[name])
    assert one.parameters["x_0"].stderr > 7e-4 / np.sqrt(runs[0].time.size)  # of the mean of white noise


def test_correlations_are_those_of_the_other_shared_parameters(runs: list[FitRun]) -> None:
    found = fitted(runs[:2])
    known = found.uncertainty
    assert set(known.names) == {"c", "beta", "alpha"}
    for i, name in enumerate(known.names):
        others = {n: known.correlation[i, j] for j, n in enumerate(known.names) if n != name}
        assert found.parameters[name].correl == pytest.approx(others)
    assert found.parameters["x_0"].correl is None


def test_intervals_that_an_interruption_did_not_reach_are_linear(runs: list[FitRun]) -> None:
    def stop(at: Progress) -> None:
        if at.phase.startswith("profile"):
            raise KeyboardInterrupt

    with pytest.raises(FitInterrupted) as stopped:
        fitted(runs[:2], intervals="profile", progress=stop)
    found, whole = stopped.value.fit, fitted(runs[:2], intervals="linear")
    assert not found.complete
    assert found.findings[0] == "interrupted: the intervals that were not reached are linear ones"
    assert found.parameters.valuesdict() == whole.parameters.valuesdict()
    assert found.intervals.keys() == whole.intervals.keys()
    for name, ends in whole.intervals.items():
        assert found.intervals[name] == pytest.approx(ends), name
    assert whole.complete
    assert not any("interrupted" in f for f in whole.findings)


def test_zeros_of_measured_runs_alone_are_said_to_move(runs: list[FitRun]) -> None:
    """Three held-out runs do not make two measured ones enough, nor their zeros those of measured ones."""
    few = fitted(runs[:2], own=False, holdout=runs[2:])
    assert not any("a constant error of x_out" in f for f in few.findings)
    (said,) = (f for f in fitted(runs[:3], own=False, holdout=runs[3:]).findings if "a constant error of x_out" in f)
    assert "RMS over 3 runs" in said


@pytest.mark.parametrize("size", [1e-12, 0.3])
def test_a_channel_weighs_by_what_is_left_of_it_and_an_exact_one_by_a_billionth(runs: list[FitRun], size) -> None:
    problem = Problem(BACKLASH, runs[:2], ("x_out",), search_space(BACKLASH))
    wiggle = [size * np.where(np.arange(r.time.size) % 2 == 0, 1.0, -1.0)[:, None] for r in runs[:2]]
    exact = [replace(r, targets=y + w) for r, y, w in zip(runs, problem.outputs_of_all(problem.start()), wiggle)]  # noqa: B905
    problem = problem.with_runs(exact)
    (spread,) = np.sqrt(np.mean([r.targets.var(axis=0) for r in runs[:2]], axis=0))
    least = max(size, 1e-9 * spread)
    assert fit_module._weights(problem, problem.start()) == pytest.approx([1.0 / least], rel=1e-6)


def test_a_run_is_simulated_with_its_own_inputs_for_its_own_errors(runs: list[FitRun]) -> None:
    found = fitted(runs[:3], holdout=runs[3:])
    for run in runs:
        values = {n: p.value for n, p in found.parameters.items()} | found.runs[run.name].values
        y = BACKLASH.simulate(BACKLASH.params(values=values), run.time, run.inputs)[:, 0]
        scored = run.time >= run.time[0] + (0.0 if run.name in "abc" else 2.0)
        error = (y - run.targets[:, 0])[scored]
        one = found.runs[run.name].channels["x_out"]
        assert one.rmse == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
        assert one.samples == np.count_nonzero(scored)
        assert (found.runs[run.name].stderr == {}) is (run.name not in "abc")
    squares = [found.runs[n].channels["x_out"].rmse ** 2 for n in "abc"]
    assert found.measured["x_out"].rmse == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-9)
    assert found.holdout["x_out"].samples == sum(found.runs[n].channels["x_out"].samples for n in "de")
