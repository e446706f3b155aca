"""Reference trajectories: closed forms, exact derivatives, time without drift."""

import math
from fractions import Fraction

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import reference_signal

REFERENCE = Kernel(reference_signal)


def signal(t: np.ndarray, preset: str | None = None, **values: float) -> np.ndarray:
    return REFERENCE.simulate(REFERENCE.params(preset, values), t, np.empty((t.size, 0)))


def test_periodic_motion_of_the_paper() -> None:
    t = np.arange(0.0, 20.0, 0.0137)
    w, a = 2 * math.pi * 0.2, math.radians(60)
    expected = np.column_stack([a * np.sin(w * t), a * w * np.cos(w * t), -a * w**2 * np.sin(w * t)])
    np.testing.assert_allclose(signal(t, "published"), expected, atol=1e-12)


def test_non_periodic_motion_of_the_paper() -> None:
    t = np.arange(0.0, 20.0, 0.0137)
    expected = np.radians(30) * (np.sin(2 * np.pi * 0.2 * t) + np.sin(2 * np.pi * 0.25 * math.sqrt(3) * t))
    np.testing.assert_allclose(signal(t, "non_periodic")[:, 0], expected, atol=1e-12)


KINDS = [
    {"kind": 1, "amplitude_2": 0.31, "amplitude_3": -0.17, "frequency_3": 3.3, "phase_1": 0.4, "phase_3": -2.0},
    {"kind": 3, "frequency_1": 0.3, "frequency_2": 4.1, "duration": 2.7, "phase_1": 0.9, "offset": 0.6},
]


@pytest.mark.parametrize("values", KINDS, ids=["sines", "chirp"])
def test_derivatives_are_those_of_the_position(values: dict[str, float]) -> None:
    h = 1e-4
    t = np.arange(0.0, 4.0, h)
    y, dy, ddy = signal(t, **values).T
    inside = np.abs(t[1:-1] - 2.7) > 2 * h if values["kind"] == 3 else slice(None)
    np.testing.assert_allclose(((y[2:] - y[:-2]) / (2 * h))[inside], dy[1:-1][inside], atol=2e-4)
    np.testing.assert_allclose(((dy[2:] - dy[:-2]) / (2 * h))[inside], ddy[1:-1][inside], atol=2e-3)


def test_chirp_reaches_its_second_frequency_and_keeps_it() -> None:
    t = np.arange(0.0, 8.0, 1e-4)
    y, dy, _ = signal(t, kind=3, amplitude_1=0.7, frequency_1=0.5, frequency_2=5.0, duration=4.0).T
    assert abs(y[t > 4.0]).max() == pytest.approx(0.7, rel=1e-4)
    crossings = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    late = t[crossings[t[crossings] > 4.0]]
    assert np.diff(late) == pytest.approx(0.2, abs=2e-4)
    swept = 2 * math.pi * (0.5 * 4.0 + 4.5 * 4.0 / 2)  # phase at the end of the sweep
    assert y[t.searchsorted(4.0)] == pytest.approx(0.7 * math.sin(swept), abs=3e-3)
    assert dy[0] == pytest.approx(0.7 * 2 * math.pi * 0.5)


@pytest.mark.parametrize("stroke", [3.7, -3.7])
def test_ramp_goes_there_and_back(stroke: float) -> None:
    t = np.arange(0.0, 23.0, 0.01)
    y, dy, ddy = signal(t, kind=2, speed=1.3, stroke=stroke, offset=0.4).T
    within = np.interp((1.3 * t) % 7.4, [0.0, 3.7, 7.4], [0.0, stroke, 0.0])
    np.testing.assert_allclose(y, 0.4 + within, atol=1e-12)
    assert set(dy) == {1.3, -1.3}
    assert dy[0] == math.copysign(1.3, stroke)
    assert not ddy.any()


@pytest.mark.parametrize(("cycles", "rest"), [(1.0, 0.0), (2.5, 3.7)])
def test_ramp_rests_after_its_cycles(cycles: float, rest: float) -> None:
    t = np.arange(0.0, 30.0, 0.1)
    y, dy, _ = signal(t, kind=2, speed=1.3, stroke=3.7, cycles=cycles).T
    after = t > cycles * 2 * 3.7 / 1.3
    np.testing.assert_allclose(y[after], rest, atol=1e-12)
    assert not dy[after].any()
    assert dy[~after].all()


def test_preset_of_the_long_transmission_covers_its_stroke() -> None:
    y = signal(np.arange(0.0, 40.0, 0.01), "ame2020")[:, 0]
    assert y.max() * 0.0125 == pytest.approx(0.785, abs=1e-3)
    assert y[-1] == 0.0


@pytest.mark.parametrize("dt", [1e-3, 1e-3 / 3, 0.0137])
def test_time_does_not_drift_over_300000_steps(dt: float) -> None:
    p = REFERENCE.params(values={"kind": 2, "speed": 1.0, "stroke": 1e9})  # y is the time
    none = reference_signal.Inputs()
    s, _ = reference_signal.start(p, none)
    plain = 0.0
    for _ in range(300_000):
        s, out = reference_signal.step(p, s, none, dt)
        plain += dt
    exact = Fraction(dt) * 300_000
    assert abs(Fraction(s.t) - exact) <= Fraction(math.ulp(s.t))
    assert out.y == pytest.approx(float(exact), rel=1e-14)
    assert abs(Fraction(plain) - exact) > 100 * Fraction(math.ulp(s.t))  # what a plain sum would lose
