"""Response and first sign change of a linear second-order system against the matrix exponential."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

from tsm_fmu.models.laws import linear_second_order
from tsm_fmu.models.laws.linear_second_order import first_fall_below_zero, response, slope_response

CASES = [
    (1.7e4, 2.3e6),  # poles far apart, as of a small motor
    (3.1e5, 0.7),  # ten decades apart
    (21.3, 21.3**2 / 4),  # double
    (21.3, 21.3**2 / 4 * (1 + 1e-13)),
    (21.3, 21.3**2 / 4 * (1 - 1e-13)),
    (4.4, 913.7),  # complex
    (0.0, 77.1),  # undamped
]


@pytest.mark.parametrize(("a_1", "a_0"), CASES)
@pytest.mark.parametrize("t", [3.7e-7, 1.1e-5, 4.9e-4, 0.0231, 0.42, 3.3])
def test_slope_response_and_its_integral_keep_all_digits(a_1: float, a_0: float, t: float) -> None:
    expected = _in_60_digits(Decimal(a_1), Decimal(a_0), Decimal(t))
    # an error of a rounding in a_1 t and sqrt(a_0) t is inherent
    inherent = 1e-15 * (1.0 + a_1 * t + math.sqrt(a_0) * t)
    scale = min(t, 1.0 / math.sqrt(a_0)) if a_1 == 0.0 else abs(expected[0])
    found = slope_response(a_1, a_0, t)
    assert abs(found[0] - expected[0]) <= 20 * inherent * scale + 1e-300
    assert abs(found[1] - expected[1]) <= 1e-13 * expected[1]


def _in_60_digits(a_1: Decimal, a_0: Decimal, t: Decimal) -> tuple[float, float]:
    with localcontext(prec=120):
        square = a_1 * a_1 / 4 - a_0
        if square > 0:
            fast, slow = -a_1 / 2 - square.sqrt(), -a_1 / 2 + square.sqrt()
            e = ((slow * t).exp() - (fast * t).exp()) / (slow - fast)
            return float(e), float((((slow * t).exp() - 1) / slow - ((fast * t).exp() - 1) / fast) / (slow - fast))
        before, term, e, g = Decimal(0), t, t, t * t / 2  # power series, from h'' = -a_1 h' - a_0 h
        for k in range(2, 900):
            before, term = term, -(a_1 * t * term / k + a_0 * t * t * before / (k * (k - 1)))
            e, g = e + term, g + term * t / (k + 1)
        return float(e), float(g)


@pytest.mark.parametrize(("a_1", "a_0"), CASES)
def test_first_fall_agrees_with_a_dense_scan(a_1: float, a_0: float) -> None:
    rng = np.random.default_rng(20150104)
    slow = a_0 / max(a_1, math.sqrt(a_0))
    found_some = 0
    for _ in range(60):
        t_end = rng.uniform(0.2, 4.0) / slow
        h, dh, ddh = rng.uniform(0.0, 1.0), rng.normal() * slow * 3, rng.normal() * slow * math.sqrt(a_0) * 3
        times = np.linspace(0.0, t_end, 4001)
        values = np.array([response(h, dh, ddh, a_1, a_0, t) for t in times])
        crossing = first_fall_below_zero(h, dh, ddh, a_1, a_0, t_end, *slope_response(a_1, a_0, t_end))
        below = np.flatnonzero(values < 0.0)
        if below.size:
            found_some += 1
            assert times[below[0] - 1] <= crossing <= times[below[0]]
        elif crossing < math.inf:  # a dip narrower than the scan
            assert response(h, dh, ddh, a_1, a_0, crossing) <= 0.0
    assert found_some >= 5


@pytest.mark.parametrize(("a_1", "a_0"), CASES)
def test_crossing_is_exact_and_takes_few_points(a_1: float, a_0: float, monkeypatch: pytest.MonkeyPatch) -> None:
    points: list[int] = []

    def counted(*arguments: float) -> tuple[float, float]:
        points[-1] += 1
        return slope_response(*arguments)

    monkeypatch.setattr(linear_second_order, "slope_response", counted)
    rng = np.random.default_rng(2021)
    slow = a_0 / max(a_1, math.sqrt(a_0))
    for _ in range(300):
        t_end = 10 ** rng.uniform(-4, 1) / slow
        h = 10 ** rng.uniform(-20, 0)
        dh, ddh = rng.normal(size=2) * 10 ** rng.uniform(-3, 3, 2) * (1.0, slow) / t_end
        end = slope_response(a_1, a_0, t_end)
        points.append(0)
        t = first_fall_below_zero(h, dh, ddh, a_1, a_0, t_end, *end)
        if points[-1] == 0 or t == math.inf:
            points.pop()
            continue
        e, g = slope_response(a_1, a_0, t)
        lean = ddh + a_1 * dh
        # what E and G are of the size of, before they cancel within themselves near a whole period
        terms = h + abs(dh) * min(t, 1.0 / math.sqrt(a_0)) + abs(lean) * min(0.5 * t * t, 2.0 / a_0)
        assert abs(h + dh * e + lean * g) <= 1e-14 * terms
    assert len(points) > 50
    assert np.median(points) <= 8
    assert max(points) <= 130  # bisection: 53, and one for each power of two that the crossing is nearer than the end
