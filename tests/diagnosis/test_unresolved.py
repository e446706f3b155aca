"""Reversals that the samples do not resolve: found where a finer simulation disagrees, and only there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tsm_fmu.diagnosis.evidence import RunComparison
from tsm_fmu.diagnosis.runs.unresolved import doubt_of, unresolved_notes, with_doubt
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import search_space

FINE = 40


def dahl(x, x_0):
    """Friction of size 1 along a path."""
    z, found = 0.0, np.zeros(x.size)
    for k in range(1, x.size):
        dx = x[k] - x[k - 1]
        s = np.sign(dx)
        z = s + (z - s) * np.exp(-abs(dx) / x_0) if dx else z
        found[k] = z
    return found


def sampled(rate, x_0, frequency=0.71):
    """Position and friction of a sine as a log has them, and what a model makes of the samples alone."""
    time = np.arange(int(20.0 * rate) * FINE) / (rate * FINE)
    x = 0.31 * np.sin(2.0 * np.pi * frequency * time + 0.2)
    kept = slice(FINE - 1, None, FINE)
    return x[kept], dahl(x, x_0)[kept], dahl(x[kept], x_0)


def test_what_is_in_doubt_is_what_the_samples_do_not_say():
    x, truth, of_samples = sampled(40.0, 0.004)
    doubt, error = doubt_of(x, truth), np.abs(of_samples - truth)
    found, wrong = doubt > 0.0, error > 0.06
    late = np.arange(x.size) > 40
    assert wrong[late].mean() > 0.02
    assert (found | ~wrong)[late].all()
    assert (error <= doubt)[found & late].mean() > 0.9
    assert found.mean() < 0.2
    turning = np.abs(x) > 0.29
    assert turning[found & late].all()


def test_resolved_reversals_noise_and_fast_motion_without_friction_are_compared():
    rng = np.random.default_rng(661)
    x, truth, _ = sampled(900.0, 0.03)
    assert not doubt_of(x, truth).any()
    assert not doubt_of(x, truth + 0.08 * rng.standard_normal(x.size)).any()
    fast, _, _ = sampled(17.0, 0.03)
    assert not doubt_of(fast, 0.9 * fast + 0.02).any()


def test_steps_of_an_encoder_count():
    x, truth, _ = sampled(600.0, 0.002)
    assert (doubt_of(x, truth) > 0.0).mean() < 0.03
    step = 1.7e-3
    assert (doubt_of(step * np.round(x / step), truth) > 0.0).mean() > 0.03


@pytest.mark.parametrize(("rate", "some"), [(40.0, True), (4.0, False)])
def test_a_run_has_them_in_doubt_unless_that_is_most_of_it(rate, some):
    x, truth, _ = sampled(rate, 0.004)
    time = np.arange(x.size) / rate
    targets = np.column_stack([0.97 * x, truth])
    model = kernel("TendonDrive")
    run = FitRun("r", time, np.column_stack([x, 0.0 * x]), targets)
    found = with_doubt(model, run, ("x_out", "tau_in"))
    if not some:
        assert not found.unresolved.size
        return
    assert found.unresolved[:, 1].any()
    assert not found.unresolved[:, 0].any()


def test_what_is_in_doubt_leaves_what_is_beyond_it_however_a_run_is_cut():
    x, truth, _ = sampled(40.0, 0.004)
    time, model = np.arange(x.size) / 40.0, kernel("TendonDrive")
    run = with_doubt(
        model,
        FitRun("r", time, np.column_stack([x, 0.0 * x]), np.column_stack([0.97 * x, 0.013 * truth])),
        ("x_out", "tau_in"),
    )
    for cut in (run, run.every(3), run.compared_from(111), run.only(time > 7.3)):
        problem = Problem(model, [cut], ("x_out", "tau_in"), search_space(model, "published", {}))
        (gap,) = problem.gaps(problem.start())
        assert cut.unresolved.shape == gap.shape
        assert (gap[~cut.unresolved] != 0.0).mean() > 0.99
        np.testing.assert_allclose(problem.outputs(0, problem.start()[0]), cut.targets - gap, rtol=1e-12, atol=1e-15)
        whole = Problem(model, [FitRun("r", cut.time, cut.inputs, cut.targets)], problem.channels, problem.space)
        if not cut.lead_time.size:
            all_of_it = whole.gaps(whole.start())[0]
            beyond = np.sign(all_of_it) * np.maximum(np.abs(all_of_it) - cut.doubt, 0.0)
            np.testing.assert_allclose(gap, beyond, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("rate", "step"), [(40.0, 0.0), (600.0, 1.7e-3)])
def test_a_late_channel_is_beyond_what_the_log_leaves_open(rate, step):
    x, truth, _ = sampled(rate, 0.004)
    read = step * np.round(x / step) if step else x
    time, late = np.arange(x.size) / rate, np.interp(np.arange(x.size) - 0.06 * rate, np.arange(x.size), truth)
    model, errors = kernel("LuGreFriction"), []
    for y in (truth, late):
        run = FitRun("r", time, np.gradient(x, time)[:, None], y[:, None])
        doubt = with_doubt(model, replace(run, inputs=np.gradient(read, time)[:, None]), ("F",)).doubt
        errors.append(run.doubting(doubt).excess(dahl(read, 0.004)[:, None])[0])
    beyond = [np.sqrt(np.mean(e[60:] ** 2)) for e in errors]
    assert beyond[0] < 0.02
    assert beyond[1] > 10.0 * beyond[0]


def test_what_is_not_compared_is_said_and_no_error_of_an_fmu_either():
    x, truth, _ = sampled(40.0, 0.004)
    time, model = np.arange(x.size) / 40.0, kernel("TendonDrive")
    run = with_doubt(
        model,
        FitRun("r", time, np.column_stack([x, 0.0 * x]), np.column_stack([0.97 * x, 0.013 * truth])),
        ("x_out", "tau_in"),
    )
    share = 100.0 * run.unresolved[:, 1].mean()
    (said,) = unresolved_notes([run], ("x_out", "tau_in"))
    assert said.startswith(f"{share:.2g} % of the samples of tau_in are reversals, or rests after them, that these")
    assert "a gap" not in said
    lost = np.delete(np.arange(time.size), slice(300, 340))
    (said,) = unresolved_notes([run.only(np.isin(np.arange(time.size), lost))], ("x_out", "tau_in"))
    assert "do not resolve, or follow a gap of the log: they are compared beyond what that leaves open" in said
    assert list(unresolved_notes([FitRun("r", time, run.inputs, run.targets)], ("x_out", "tau_in"))) == []
    record = SimpleNamespace()
    one = RunComparison(record, time, run.targets, {}, x, {}, run.unresolved)
    error = one.error(run.targets + 1.0)
    np.testing.assert_array_equal(error, np.where(run.unresolved, 0.0, run.targets - (run.targets + 1.0)))
    assert (RunComparison(record, time, run.targets, {}, x, {}).error(run.targets) == 0.0).all()
