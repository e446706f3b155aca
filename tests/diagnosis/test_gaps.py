"""The gap of a channel in numbers: floors, closures and their intervals, from errors whose squares are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tsm_fmu.diagnosis.answer.gaps import Errors, _interval, closure, gaps
from tsm_fmu.diagnosis.choice.floors import Floors

FLAT = np.array([1.0, -1.0, 1.0, -1.0])


def errors(measured: list[tuple[float, float]], holdout: list[tuple[float, float]] = ()) -> Errors:  # pyright: ignore
    """Two channels of these sizes in each run; of other sign from sample to sample."""
    sides = ([np.column_stack([a * FLAT, b * FLAT]) for a, b in runs] for runs in (measured, holdout))
    return Errors(*map(tuple, sides))  # pyright: ignore[reportArgumentType]


GIVEN, REFITTED, FINAL = (errors([(x, 10.0 * x), (7.0 * x, 10.0 * x)]) for x in (0.5, 0.4, 0.1))
"""RMS of the first channel: five times the number; the second ten times, in both runs."""
FLOORS = Floors(
    noise=np.array([0.3, 0.7]), least=np.array([0.2, 0.6]), reference=None, open_=np.array([True, True]),
    unexplained=np.array([False, True]),
)  # fmt: skip


def found(final: Errors = FINAL, floors: Floors = FLOORS, with_effects: bool = True, refitted: Errors = REFITTED):
    return gaps(
        ("F", "x"), ("N", "rad"), GIVEN, refitted, final, floors, np.array([0.011, 0.022]), np.array([False, True]),
        with_effects=with_effects,
    )  # fmt: skip


def test_errors_are_root_mean_squares_over_the_samples_of_all_runs() -> None:
    one = found()
    assert (one["F"].elsewhere, one["x"].elsewhere) == (False, True)
    assert list(one) == ["F", "x"]
    f, x = one["F"], one["x"]
    assert (f.unit, x.unit) == ("N", "rad")
    assert (f.before, f.refitted, f.after) == (pytest.approx(2.5), pytest.approx(2.0), pytest.approx(0.5))
    assert (x.before, x.refitted, x.after) == (pytest.approx(5.0), pytest.approx(4.0), pytest.approx(1.0))
    assert (f.holdout_before, f.holdout_refitted, f.holdout_after) == (None, None, None)
    assert (f.threshold, x.threshold, f.unexplained, x.unexplained) == (0.011, 0.022, False, True)
    assert (f.floor, f.floor_least, f.reference) == (0.3, 0.2, None)


def test_closures_count_from_the_refit_with_effects_and_else_from_the_model_as_given() -> None:
    f = found()["F"]
    assert f.closure == pytest.approx(1.0 - (0.25 - 0.09) / (4.0 - 0.09))
    assert f.closure_least == pytest.approx(1.0 - (0.25 - 0.04) / (4.0 - 0.04))
    f = found(with_effects=False)["F"]
    assert f.closure == pytest.approx(1.0 - (0.25 - 0.09) / (6.25 - 0.09))
    assert f.closure_interval is None


def test_on_held_out_runs_what_is_closed_is_counted_there() -> None:
    refitted = replace(REFITTED, holdout=errors([(3.0, 1.0)]).measured)
    final = replace(FINAL, holdout=errors([(1.0, 0.9)]).measured)
    given = replace(GIVEN, holdout=errors([(4.0, 2.0)]).measured)
    one = gaps(
        ("F", "x"), ("N", "rad"), given, refitted, final, FLOORS, np.zeros(2), np.zeros(2, bool), with_effects=True
    )
    f, x = one["F"], one["x"]
    assert (f.holdout_before, f.holdout_refitted, f.holdout_after) == (4.0, 3.0, 1.0)
    assert (f.refitted, f.after) == (pytest.approx(2.0), pytest.approx(0.5))
    assert f.closure == pytest.approx(1.0 - (1.0 - 0.09) / (9.0 - 0.09))
    assert x.closure == pytest.approx(1.0 - (0.81 - 0.49) / (1.0 - 0.49))


def test_no_floor_is_above_what_a_fit_leaves_but_that_of_reference_runs() -> None:
    high = replace(FLOORS, noise=np.array([3.0, 3.0]), least=np.array([0.7, 3.5]))
    one = found(floors=high)
    assert (one["F"].floor, one["F"].floor_least) == (pytest.approx(0.5), pytest.approx(0.5))
    assert (one["x"].floor, one["x"].floor_least) == (pytest.approx(1.0), pytest.approx(1.0))
    worse = found(floors=high, final=GIVEN)["F"]  # then the refit leaves least
    assert (worse.floor, worse.floor_least) == (pytest.approx(2.0), 0.7)
    beside = found(floors=replace(high, reference=np.array([0.9, 1.9])))
    assert (beside["F"].floor, beside["F"].floor_least, beside["F"].reference) == (3.0, 0.7, 0.9)
    assert (beside["x"].floor, beside["x"].closure) == (3.0, pytest.approx(1.0 - (1.0 - 9.0) / (16.0 - 9.0)))


@pytest.mark.parametrize(("share", "is_gap"), [(0.0201, True), (0.0199, False)])
def test_a_gap_is_a_fiftieth_above_the_square_of_its_floor(share: float, is_gap: bool) -> None:
    noise = np.array([0.3])
    before = noise**2 * (1.0 + share)
    assert (closure(before, noise**2, noise) is not None) is is_gap


def test_the_interval_is_that_of_the_mean_over_runs() -> None:
    """Many runs of one length with gaps that scatter a little: the quantiles of a normal mean."""
    rng = np.random.default_rng(8)
    before = [np.full(5, 2.0)] * 80
    left = 0.5 + 0.1 * rng.normal(size=80)  # mean square of each run
    after = [np.full(5, x**0.5) for x in left]
    interval = _interval(before, after, 0.4)
    assert interval is not None
    closed = 1.0 - (left - 0.16) / (4.0 - 0.16)
    half = float(norm.ppf(0.95)) * closed.std() / 80**0.5
    assert interval == pytest.approx((closed.mean() - half, closed.mean() + half), abs=0.15 * half)
    assert _interval(before[:2], after[:2], 0.4) is None
    assert _interval(before[:3], before[:3], 0.4) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert _interval(before[:3], after[:3], 2.0) is None  # nothing is above the floor


def test_long_runs_weigh_by_their_samples_and_draws_without_a_gap_do_not_count() -> None:
    before = [np.full(90, 2.0), np.full(10, 0.5), np.full(10, 0.5)]
    after = [np.full(90, 1.0), np.full(10, 0.5), np.full(10, 0.5)]
    interval = _interval(before, after, 0.6)  # of the short runs alone nothing is above it
    assert interval is not None
    once, twice = (
        ((90.0 * k + 2.5 * (3 - k)) / (80.0 * k + 30.0), (360.0 * k + 2.5 * (3 - k)) / (80.0 * k + 30.0))
        for k in (1, 2)
    )  # the long run drawn so often
    low, high = interval
    assert high == pytest.approx(1.0 - (once[0] - 0.36) / (once[1] - 0.36))
    most = 1.0 - (twice[0] - 0.36) / (twice[1] - 0.36)
    assert 1.0 - (1.0 - 0.36) / (4.0 - 0.36) - 1e-9 < low < most + 1e-9


def test_validation_is_on_held_out_runs_if_there_are_any() -> None:
    both = errors([(1.0, 2.0)], [(3.0, 4.0), (5.0, 6.0)])
    assert both.validation is both.holdout
    assert both.rms == pytest.approx([1.0, 2.0])
    assert both.rms_holdout == pytest.approx([17.0**0.5, 26.0**0.5])
    alone = errors([(1.0, 2.0)])
    assert alone.validation is alone.measured
    assert alone.rms_holdout is None
