"""The tendon in its sheath: however its pieces are cut up, nothing changes; integrals against quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from tsm_fmu.models.laws.capstan import Sheath, path_length, sheath_of, tension_integral

MU = 0.173


def sheath(pieces: list[tuple[float, float]]) -> Sheath:
    """Of (length, radius), radius 0 for a straight piece."""
    rows = pieces + [(0.0, 0.0)] * (8 - len(pieces))
    return sheath_of(MU, len(pieces), tuple(r[0] for r in rows), tuple(r[1] for r in rows))  # pyright: ignore


BENT = [(0.31, 0.0), (0.52, 0.23), (0.17, 0.0), (0.41, 0.11), (0.23, 0.0)]
"""Straight at both ends and between two bends."""
CUTS = {
    "straight pieces": [(0.2, 0.0), (0.11, 0.0), *BENT[1:4], (0.13, 0.0), (0.1, 0.0)],
    "bends": [BENT[0], (0.3, 0.23), (0.22, 0.23), BENT[2], (0.05, 0.11), (0.36, 0.11), BENT[4]],
}


def over_the_path(pieces: list[tuple[float, float]], a: float, b: float, T_a: float, slope: float) -> float:
    """Integral of T dl by quadrature along the path: straight pieces have the tension of their one lam."""
    total, at = 0.0, 0.0
    for length, radius in pieces:
        rate = MU / radius if radius else 0.0
        lo, hi = (max(0.0, (a - at) / rate), min(length, (b - at) / rate)) if rate else (0.0, length)
        if rate and hi > lo:
            total += quad(lambda l, at=at, rate=rate: T_a * math.exp(slope * (at + rate * l - a)), lo, hi)[0]
        elif not rate and a <= at < b:
            total += T_a * math.exp(slope * (at - a)) * length
        at += rate * length
    return total


@pytest.mark.parametrize("slope", [-1.0, 0.0, 1.0, 2.7])
@pytest.mark.parametrize(("a", "b"), [(0.0, 0.3), (0.1, 0.7), (0.05, 0.2), (0.4, 0.9)])
def test_the_integral_is_that_along_the_path(slope: float, a: float, b: float) -> None:
    one = sheath(BENT)
    assert b < one.lam
    assert tension_integral(one, a, b, 3.7, slope) == pytest.approx(over_the_path(BENT, a, b, 3.7, slope), rel=1e-10)


@pytest.mark.parametrize("slope", [-1.0, 0.0, 1.0])
def test_a_path_cut_anywhere_is_the_sum_of_its_parts(slope: float) -> None:
    """Also at a kink, where a straight piece lies: it belongs to one part."""
    one = sheath(BENT)
    kinks = np.cumsum([MU / r * l if r else 0.0 for l, r in BENT]).tolist()
    whole = tension_integral(one, 0.0, one.lam, 3.7, slope)
    for cut in sorted({*kinks, *np.linspace(0.01, 0.99, 7) * one.lam} - {0.0, one.lam}):
        parts = tension_integral(one, 0.0, cut, 3.7, slope)
        parts += tension_integral(one, cut, one.lam, 3.7 * math.exp(slope * cut), slope)
        assert parts == pytest.approx(whole, rel=1e-12), cut
    ends = 3.7 * (BENT[0][0] + BENT[4][0] * math.exp(slope * one.lam))  # the straight ends count once each
    assert whole > ends


@pytest.mark.parametrize("cut", CUTS)
def test_pieces_cut_up_change_nothing(cut: str) -> None:
    one, other = sheath(BENT), sheath(CUTS[cut])
    assert other.lam == pytest.approx(one.lam, rel=1e-14)
    assert path_length(other) == pytest.approx(path_length(one), rel=1e-14)
    for a, b in ((0.0, one.lam), (0.1, 0.7), (0.0, 0.2)):
        assert tension_integral(other, a, b, 3.7, -1.0) == pytest.approx(
            tension_integral(one, a, b, 3.7, -1.0), rel=1e-12
        )
