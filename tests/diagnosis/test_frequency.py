"""Harmonics and bands of a residual: power by Parseval, periods by construction, chance by the surrogates given."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tsm_fmu.diagnosis.residual.frequency import (
    FEWEST_BINS,
    _bands,
    _drivers,
    _harmonics,
    _spectrum,
    _whole_periods,
    frequencies,
)
from tsm_fmu.diagnosis.residual.surrogates import tail
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates

DT = 0.01


def moving(x: np.ndarray, dt: float = DT) -> Coordinates:
    t, zero = dt * np.arange(x.size), np.zeros(x.size)
    v = np.gradient(x, t)
    return Coordinates(x, v, zero, np.where(v >= 0.0, 1.0, -1.0), zero, zero, zero, zero, None, t)


def sine(period: float, n: int, phase: float = 0.0, dt: float = DT) -> Coordinates:
    """With a second harmonic, so that half a period is none."""
    turn = 2.0 * np.pi * dt * np.arange(n) / period + phase
    return moving(0.4 + 0.7 * np.sin(turn) + 0.1 * np.cos(2.0 * turn), dt)


@pytest.mark.parametrize(("periods", "whole"), [(4.97, None), (5.03, 4), (5.97, 4), (6.4, 5), (11.7, 10)])
def test_whole_periods_are_all_but_one_that_is_left_to_compare_with(periods: float, whole: int | None) -> None:
    found = _whole_periods(sine(1.37, round(137 * periods)))
    if whole is None:
        assert found is None
        return
    assert found is not None
    count, period, number = found
    assert number == whole
    assert count == pytest.approx(137 * whole, abs=1)
    assert period == pytest.approx(1.37, rel=2e-3)


def test_a_period_between_two_samples_is_found_to_a_part_of_one() -> None:
    """73.64 samples: twenty periods are not twenty times 73 or 74."""
    found = _whole_periods(sine(0.7364, 1600))
    assert found is not None
    count, period, number = found
    assert abs(count - 73.64 * number) <= 0.5
    assert period == pytest.approx(0.7364, rel=0.5 / (73.64 * number))
    x = np.cumsum(np.random.default_rng(3).normal(size=300))
    assert _whole_periods(moving(x)) is None


def harmonics_of(
    lines: dict[int, float], n: int = 800, periods: int = 8, white: float = 0.0, mean: float = 0.0, count: int = 1
) -> list:
    """Bands of runs whose residual has these amplitudes at harmonics, against white surrogates."""
    rng = np.random.default_rng(6)
    turn = 2.0 * np.pi * periods * np.arange(n) / n
    one = np.sum([a * np.cos(k * turn + k) for k, a in lines.items()], axis=0) + mean
    noise = [rng.normal(size=(n, 40)) for _ in range(count)]
    residuals = [one + white * rng.normal(size=n) for _ in range(count)]
    whole = [(n, n * DT / periods, periods)] * count
    return _harmonics(residuals, noise, whole)


def test_the_share_of_each_harmonic_is_its_square_over_that_of_all() -> None:
    found = {b.name: b for b in harmonics_of({1: 0.9, 2: 0.4, 3: 0.3, 4: 0.2, 5: 0.15, 12: 0.1, 13: 0.25}, mean=3.0)}
    squares = {1: 0.81, 2: 0.16, 3: 0.09, 4: 0.04, 5: 0.0225, 12: 0.01, 13: 0.0625}
    whole = sum(squares.values())
    # rfft counts half of the spectrum: each line once
    shares = {"odd harmonics": (1, 3, 5), "even harmonics": (2, 4, 12)}
    shares |= {f"harmonic {k}": (k,) for k in (1, 2, 3, 4)}
    assert list(found) == list(shares)
    for name, members in shares.items():
        assert found[name].share == pytest.approx(sum(squares[k] for k in members) / whole, rel=1e-9), name
        assert found[name].explained == found[name].share
        assert found[name].chance == found[name].background
    assert found["odd harmonics"].range == pytest.approx((1.0, 11.0))  # [Hz] of a period of 1 s
    assert found["even harmonics"].range == pytest.approx((2.0, 12.0))
    assert found["harmonic 3"].range == pytest.approx((3.0, 3.0))
    assert found["odd harmonics"].background == pytest.approx(6 / 400, rel=0.3)  # of 400 bins of white noise
    assert found["harmonic 2"].background == pytest.approx(1 / 400, rel=0.5)


def test_runs_count_together_by_their_power_and_chance_is_that_of_the_surrogates() -> None:
    rng = np.random.default_rng(9)
    turn = 2.0 * np.pi * 5 * np.arange(400) / 400
    drawn = [rng.normal(size=(400, 30)), 3.0 * rng.normal(size=(400, 30))]
    found = _harmonics([np.sin(turn), 2.0 * np.sin(2 * turn)], drawn, [(400, 0.8, 5), (400, 0.84, 5)])
    by_name = {b.name: b for b in found}
    assert by_name["harmonic 1"].share == pytest.approx(0.2)
    assert by_name["harmonic 2"].share == pytest.approx(0.8)
    assert by_name["harmonic 2"].range == pytest.approx((2 / 0.82, 2 / 0.82))
    power = [np.abs(np.fft.rfft(d - d.mean(axis=0), axis=0)) ** 2 for d in drawn]
    chances = sum(p[10] for p in power) / sum(p.sum(axis=0) for p in power)
    assert by_name["harmonic 2"].background == pytest.approx(float(np.mean(chances)))
    assert by_name["harmonic 2"].p == tail(by_name["harmonic 2"].share, np.asarray(chances))


def test_harmonics_end_at_the_twelfth_or_below_half_the_sampling() -> None:
    assert [b.range[1] for b in harmonics_of({1: 1.0, 2: 0.1}, n=208, periods=8)[:2]] == pytest.approx(
        [11.0 * 8 / 2.08, 12.0 * 8 / 2.08]
    )
    few = harmonics_of({1: 1.0, 2: 0.1}, n=72, periods=8)  # 4.5 periods to half the sampling: three are well below
    assert [b.name for b in few] == ["odd harmonics", "even harmonics", "harmonic 1", "harmonic 2", "harmonic 3"]
    assert few[0].range[1] == pytest.approx(3.0 * 8 / 0.72)
    assert harmonics_of({1: 1.0, 2: 0.1}, n=48, periods=8)[-1].name == "harmonic 2"
    assert harmonics_of({1: 1.0}, n=47, periods=8) == []


def seen(places: Sequence[Coordinates], count: int | None = None) -> list[str]:
    rng = np.random.default_rng(1)
    residuals = [rng.normal(size=c.x.size if count is None else count) for c in places]
    return sorted({b.name for b in frequencies(residuals, [rng.normal(size=(r.size, 20)) for r in residuals], places)})


def test_harmonics_need_one_period_in_all_runs() -> None:
    assert "odd harmonics" in seen([sine(1.37, 1000), sine(1.37, 1200, 1.0)])
    assert "odd harmonics" in seen([sine(1.37, 1000), sine(1.39, 1200)])  # within 2 %
    assert seen([sine(1.37, 1000), sine(1.42, 1200)]) == ["frequency"]
    wandering = moving(np.cumsum(np.random.default_rng(5).normal(size=900)))
    assert seen([sine(1.37, 1000), wandering]) == ["frequency"]
    assert seen([sine(0.1, 4 * FEWEST_BINS)]) != []
    assert seen([sine(0.1, 4 * FEWEST_BINS), sine(0.1, 4 * FEWEST_BINS - 1)]) == []


def test_a_spectrum_keeps_the_power_of_white_noise_but_for_its_window() -> None:
    noise = 5.0 + np.random.default_rng(7).normal(size=(512, 300))
    power = np.abs(_spectrum(noise)) ** 2
    assert power[2:-2].mean() == pytest.approx(0.375, rel=0.02)  # mean square of a Hann window
    line = np.cos(2.0 * np.pi * 20.0 * np.arange(512) / 512)[:, None]
    found = np.abs(_spectrum(line + 3.0))[:, 0]
    assert found[19:22] == pytest.approx(np.array([0.125, 0.25, 0.125]) * 512**0.5, rel=1e-9)
    assert found[[0, 5, 40]] == pytest.approx(0.0, abs=1e-9)


def test_drivers_are_position_direction_and_speed_of_unit_spread() -> None:
    c = sine(1.37, 700)
    found = _drivers(c)
    for column, signal in zip(found.T, (c.x, c.s, np.abs(c.v)), strict=True):
        assert column == pytest.approx(signal / np.std(signal), rel=1e-9)
    still = _drivers(moving(np.full(50, 0.3)))
    assert np.isfinite(still[:, 2]).all()


def test_a_band_holds_what_goes_with_the_motion_whatever_its_phase() -> None:
    """A line late by any phase is one gain of the position's; a line where the motion has none is not."""
    n, f = 3000, 0.77
    t = DT * np.arange(n)
    c = moving(0.3 * np.sin(2 * np.pi * f * t))
    late = 0.5 * np.sin(2 * np.pi * f * t + 1.1)
    beside = 0.5 * np.sin(2 * np.pi * 1.3 * f * t)
    drawn = np.random.default_rng(4).normal(size=(n, 60))
    for residual, part in ((late, 1.0), (late + beside, 0.5), (beside, 0.0)):
        bands = _bands([residual], [drawn], [c])
        band = max(bands, key=lambda b: b.share)
        assert band.range == pytest.approx((0.5 * f, 2.0 * f), rel=1e-2)
        assert band.share == pytest.approx(1.0, abs=0.01)
        assert band.explained == pytest.approx(part, abs=0.07)
        assert (band.p < 5e-3) is (part > 0.4)
    low, middle, *_ = _bands([late], [drawn], [c])
    bins = 2 * n * DT * (middle.range[1] - middle.range[0]) / 2  # of the band, of which three are the drivers'
    assert middle.chance == pytest.approx(middle.background * 3 / bins, rel=0.25)
    assert low.background == pytest.approx(low.range[1] / 50.0, rel=0.2)


def test_bands_of_few_bins_are_left_out_and_runs_count_together() -> None:
    f = 0.9
    short = [moving(0.3 * np.sin(2 * np.pi * f * DT * np.arange(n) + 1.0)) for n in (900, 700)]
    rng = np.random.default_rng(2)
    residuals = [rng.normal(size=c.x.size) for c in short]
    drawn = [rng.normal(size=(c.x.size, 20)) for c in short]
    bands = _bands(residuals, drawn, short)
    # 0.45 Hz are 4.05 and 3.15 bins of 1/9 and 1/7 Hz: too few; the next has 12.15 and 9.45
    assert [b.range for b in bands] == [
        pytest.approx(e, rel=2e-2) for e in ((0.5 * f, 2 * f), (2 * f, 8 * f), (8 * f, 50.0))
    ]
    assert sum(b.share for b in bands) < 1.0
    only = _bands(residuals[1:], drawn[1:], short[1:])
    assert [b.range[0] for b in only] == pytest.approx([2 * f, 8 * f], rel=2e-2)
