"""Where a residual lies, against residuals built here; and how often noise without any law is said to have one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import gamma

from tsm_fmu.diagnosis.evidence import Place
from tsm_fmu.diagnosis.residual.locate import locate
from tsm_fmu.diagnosis.residual.surrogates import background, surrogates, tail
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates, coordinates_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

DT = 0.0103
SINES = {
    "one sine": ((1.07, 0.4137, 0.6),),
    "two sines": ((0.93, 0.31, 0.2), (0.41, 0.93, 1.1)),
    "no period": ((1.1, 0.131, 2.0), (0.45, 0.377, 0.3), (0.17, 0.831, 4.0)),
}


def noise(n: int, rho: float, rng: np.random.Generator) -> np.ndarray:
    """First-order autoregressive noise of unit variance, settled."""
    e = rng.normal(size=n + 3000)
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], e)[3000:]


def places(motion: str, n: int = 2000) -> list[Coordinates]:
    found = []
    for shift in (0.0, 1.3):
        t = np.arange(n) * DT
        x = np.sum([a * np.sin(2 * np.pi * f * t + p + shift) for a, f, p in SINES[motion]], axis=0)
        v = np.gradient(x, t)
        found.append(coordinates_of(kernel("LuGreFriction"), FitRun("r", t, v[:, None], v[:, None]), None))
    return found


def located(motion: str, law: str, amount: float, seed: int = 0, rho: float = 0.95) -> list[Place]:
    rng, where = np.random.default_rng(seed), places(motion)
    laws = {
        "none": lambda c: 0.0 * c.v,
        "even in v": lambda c: np.abs(c.v) ** 1.3,
        "after reversals": lambda c: c.s / (1.0 + (c.since_reversal / 0.07) ** 2),
        "low speed": lambda c: c.s / (1.0 + (c.v / 0.23) ** 2),
    }
    parts = []
    for c in where:
        y = laws[law](c)
        parts.append((amount * y / max(float(np.std(y)), 1e-9) + noise(y.size, rho, rng))[:, None])
    return locate(parts, where, ["F"], "rad", "1", seed)


@pytest.mark.parametrize("motion", SINES)
def test_noise_of_any_colour_lies_nowhere(motion: str) -> None:
    """Of 40 residuals of noise at most 4 may have any place at a false discovery rate of 5 %; of all p, 10 % < 5 %."""
    alarms, p = 0, []
    for seed in range(40):
        found = located(motion, "none", 0.0, seed, (0.3, 0.9, 0.98)[seed % 3])
        alarms += any(f.significant for f in found)
        p += [f.p for f in found]
    assert alarms <= 4
    assert np.mean(np.array(p) < 0.05) < 0.10
    assert np.mean(np.array(p) < 0.5) > 0.3  # nor are they all near 1


@pytest.mark.parametrize("motion", ["one sine", "two sines"])
def test_a_law_that_is_the_same_both_ways_is_at_odd_harmonics_and_the_other_at_even_ones(motion: str) -> None:
    if motion == "two sines":  # the third harmonic of the first sine: half a period on, the motion is its own mirror
        assert SINES[motion][1][1] == pytest.approx(3.0 * SINES[motion][0][1])
    even = {f.coordinate: f for f in located(motion, "even in v", 1.5)}
    odd = {f.coordinate: f for f in located(motion, "after reversals", 1.5)}
    for found, here, other in ((even, "even harmonics", "odd harmonics"), (odd, "odd harmonics", "even harmonics")):
        assert found[here].significant
        assert found[here].p < 1e-4
        assert not found[other].significant
        assert found[here].share_of_gap > 0.5 > 0.1 > found[here].share_of_samples
    base = SINES[motion][0][1]
    assert even["harmonic 2"].range == pytest.approx((2.0 * base, 2.0 * base), rel=2e-3)
    assert even["harmonic 2"].share_of_gap <= even["even harmonics"].share_of_gap + 1e-12


def test_the_share_of_a_harmonic_is_its_share_of_the_power() -> None:
    where = places("one sine")
    rng = np.random.default_rng(11)
    parts = []
    for c in where:
        turn = 2 * np.pi * SINES["one sine"][0][1] * c.time
        parts.append(
            (0.9 * np.sin(2 * turn + 0.3) + 0.5 * np.sin(3 * turn) + 0.4 * rng.normal(size=turn.size))[:, None]
        )
    found = {f.coordinate: f for f in locate(parts, where, ["F"], "rad", "1")}
    total = 0.5 * (0.9**2 + 0.5**2) + 0.4**2
    assert found["harmonic 2"].share_of_gap == pytest.approx(0.5 * 0.9**2 / total, abs=0.03)
    assert found["harmonic 3"].share_of_gap == pytest.approx(0.5 * 0.5**2 / total, abs=0.03)
    assert not found["harmonic 4"].significant


def test_without_a_period_a_band_that_moves_with_the_motion_is_found_and_another_is_not() -> None:
    where = places("no period")
    rng = np.random.default_rng(4)
    parts = [(0.8 * np.sign(c.v) + 1.5 * noise(c.v.size, 0.2, rng))[:, None] for c in where]
    bands = [f for f in locate(parts, where, ["F"], "rad", "1") if f.coordinate == "frequency"]
    assert sum(f.share_of_gap for f in bands) == pytest.approx(1.0, abs=0.05)
    low = min((f for f in bands if f.range[1] > 0.131), key=lambda f: f.range[1])
    high = max(bands, key=lambda f: f.range[0])
    assert low.significant
    assert low.explained > 0.5 * low.share_of_gap
    assert high.explained < 0.2 * high.share_of_gap


@pytest.mark.parametrize("motion", SINES)
@pytest.mark.parametrize(
    ("law", "coordinate", "limit"), [("after reversals", "distance since reversal", 0.4), ("low speed", "v", 1.2)]
)
def test_a_law_of_friction_is_found_though_its_sign_changes_with_the_direction(
    motion: str, law: str, coordinate: str, limit: float
) -> None:
    found = {f.coordinate: f for f in located(motion, law, 1.0, seed=3)}[coordinate]
    assert found.significant
    assert found.p < 1e-3
    assert found.explained == pytest.approx(0.5, abs=0.15)  # the law is half of the variance
    assert max(np.abs(found.range)) < limit
    assert found.share_of_gap > 1.2 * found.share_of_samples


def test_a_constant_is_a_function_of_nothing() -> None:
    where = places("no period")
    rng = np.random.default_rng(8)
    parts = [(5.0 + noise(c.v.size, 0.9, rng))[:, None] for c in where]
    found = locate(parts, where, ["F"], "rad", "1")
    assert not any(f.significant for f in found)
    assert max(f.explained for f in found if f.unit != "Hz") < 0.2


def test_surrogates_have_the_colour_of_the_noise_and_not_its_lines() -> None:
    rng = np.random.default_rng(21)
    n = 4000
    clean = 0.7 * noise(n, 0.9, rng)
    lined = clean + 1.0 * np.sin(2 * np.pi * 37.0 * np.arange(n) / n) + 0.31
    drawn = surrogates(lined, 300, rng)
    mean = lined.mean()
    assert drawn.shape == (n, 300)
    assert drawn.mean(axis=0) == pytest.approx(lined.mean(), abs=1e-9)
    assert float(drawn.var(axis=0).mean()) == pytest.approx(0.49, rel=0.2)
    lag = float(np.mean((drawn[1:] - mean) * (drawn[:-1] - mean)) / np.mean((drawn - mean) ** 2))
    assert lag == pytest.approx(0.9, abs=0.03)


def test_background_of_white_noise_is_its_variance() -> None:
    power = np.random.default_rng(2).chisquare(1, 6000) * 2.7
    found = float(background(power).mean())
    assert 2.7 < found < 1.1 * 2.7  # the median of 25 bins is a little high: on the safe side


def test_tail_of_a_gamma_distribution() -> None:
    drawn = gamma.rvs(3.1, scale=0.2, size=4000, random_state=6)
    for value in (1.0, 1.6):
        assert tail(value, drawn) == pytest.approx(float(gamma.sf(value, 3.1, scale=0.2)), rel=0.3)
    assert tail(50.0, drawn) == 1e-6
