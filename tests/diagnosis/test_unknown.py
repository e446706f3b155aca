"""Formulae and dependences of residuals that were built here, from other functions than those on offer."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tsm_fmu.diagnosis.residual.dependence import dependence
from tsm_fmu.diagnosis.residual.formula import _by_sindy, formula, shapes, text_of
from tsm_fmu.diagnosis.residual.library import folds
from tsm_fmu.diagnosis.residual.sparse import best_subsets, coefficients_of, cross_validated_shares, fewest_terms, sums
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates, coordinates_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.display import display
from tsm_fmu.regression.problem import FitRun

DT = 0.0097


def noise(n: int, rho: float, rng: np.random.Generator) -> np.ndarray:
    e = rng.normal(size=n + 3000)
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], e)[3000:]


def places(runs: int = 2, n: int = 2400, seed: int = 1, stroke: float = 0.047) -> list[Coordinates]:
    """Three sines of no common period, a stroke of a few centimetres."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(runs):
        t = np.arange(n) * DT
        sines = zip((0.9, 0.42, 0.2), (0.171, 0.437, 0.871), rng.random(3) * 6.0, strict=True)
        x = stroke * np.sum([a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in sines], axis=0)
        v = np.gradient(x, t)
        found.append(coordinates_of(kernel("LuGreFriction"), FitRun("r", t, v[:, None], v[:, None]), None))
    return found


def with_noise(laws: list[np.ndarray], seed: int, rho: float = 0.95, size: float = 1.0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    sigma = size * float(np.std(np.concatenate(laws)))
    return [y + sigma * noise(y.size, rho, rng) for y in laws]


def test_friction_after_reversals_gets_a_formula_of_the_right_size_and_reach() -> None:
    """A hyperbola, which is not on offer: within the reach found, formula and law are about the same."""
    where = places()
    laws = [0.12 * c.s / (1.0 + (c.since_reversal / 0.005) ** 2) for c in where]
    found = formula(with_noise(laws, 3, size=0.4), where, "N", "m", "N")
    first, value, unit = found.terms[0]
    reach = re.fullmatch(r"sgn\(v\) exp\(-d/([\d.]+) mm\)", first)
    assert reach is not None
    assert 2.0 < float(reach[1]) < 15.0
    assert unit == "N"
    assert value == pytest.approx(0.12, rel=0.5)
    assert found.share == pytest.approx(1.0 / 1.16, abs=0.12)
    assert found.text.startswith(f"{display('N', value)(value, 2)} sgn(v) exp(-d/{reach[1]} mm)")
    assert found.p < 1e-3


def test_a_viscous_residual_has_its_coefficient_and_the_unit_of_it() -> None:
    where = places()
    found = formula(with_noise([0.337 * c.v for c in where], 5, rho=0.9, size=0.5), where, "N", "m", "N")
    assert [t[0] for t in found.terms] == ["v"]
    assert found.terms[0][2] == "N.s/m"
    assert found.terms[0][1] == pytest.approx(0.337, rel=0.08)
    assert re.fullmatch(r"0\.3\d N\.s/m v", found.text)


def test_two_laws_give_two_terms_or_more() -> None:
    where = places(3)
    laws = [0.05 * c.s / (1.0 + (c.since_reversal / 0.004) ** 2) + 21.0 * c.x**2 for c in where]
    found = formula(with_noise(laws, 7, size=0.2), where, "N", "m", "N")
    assert 2 <= len(found.terms) <= 4
    assert any("exp(-d/" in t[0] for t in found.terms)
    assert any("^2" in t[0] or t[0] in ("", "x") for t in found.terms)
    assert found.share > 0.8


def test_a_load_dependent_residual_is_given_over_the_load() -> None:
    where = []
    for k, c in enumerate(places(4)):
        load = 3.0 + 2.0 * k + 0.5 * np.sin(0.7 * c.time)
        where.append(replace(c, load=load))
    laws = [0.041 * np.tanh(c.v / 0.003) * (c.load if c.load is not None else 0.0) for c in where]
    found = formula(with_noise(laws, 2, size=0.3), where, "N", "m", "N")
    assert found.terms[0][0] in ("sgn(v) |L|", "sgn(v) L")
    assert found.terms[0][1] == pytest.approx(0.041, rel=0.15)
    assert found.terms[0][2] == "1"


def test_something_that_sits_at_a_place_is_given_there() -> None:
    """A flat stop-and-go of 0.08 N between 12 and 24 mm, a box, not the bell on offer."""
    where = places()
    middle = [c.x - float(np.mean(np.concatenate([p.x for p in where]))) for c in where]
    laws = [0.08 * c.s * ((x > 0.012) & (x < 0.024)) for c, x in zip(where, middle, strict=True)]
    found = formula(with_noise(laws, 9, size=0.4), where, "N", "m", "N")
    place = re.fullmatch(r"sgn\(v\) exp\(-\(\(x ([+-]) ([\d.]+) mm\)/([\d.]+) mm\)\^2\)", found.terms[0][0])
    assert place is not None
    mean = 1e3 * float(np.mean(np.concatenate([p.x for p in where])))
    at = float(place[2]) * (1.0 if place[1] == "-" else -1.0) - mean
    assert 8.0 < at < 28.0
    assert found.share > 0.5 / 1.16  # half of what the law is worth


def test_coloured_noise_gets_no_formula() -> None:
    """At most 4 of 48 residuals of noise (about 5 %), with correlation times up to 2 s of a run of 23 s."""
    where = places()
    given = 0
    for seed in range(48):
        rng = np.random.default_rng(900 + seed)
        parts = [noise(c.v.size, (0.5, 0.95, 0.99, 0.995)[seed % 4], rng) for c in where]
        found = formula(parts, where, "N", "m", "N", seed)
        given += bool(found.text)
        assert bool(found.text) == bool(found.terms)
    assert given <= 4


def test_a_law_within_strong_noise_is_not_overstated() -> None:
    """The share predicted is what the law is worth, or less: it is counted on parts that did not choose the terms."""
    where = places(4)
    laws = [c.s / (1.0 + (c.v / 0.03) ** 2) for c in where]
    true = 1.0 / (1.0 + 1.5**2)
    shares = [formula(with_noise(laws, seed, size=1.5), where, "N", "m", "N").share for seed in range(6)]
    assert np.mean(shares) < true + 0.05
    assert np.mean(shares) > 0.5 * true


def test_intervals_hold_the_truth_under_coloured_noise() -> None:
    """Of the bins of a dependence 90 % intervals should hold the true mean; those of white noise would hold half."""
    where = places(2)
    laws = [0.3 * np.abs(c.v) / 0.1 for c in where]
    held = []
    for seed in range(12):
        curves = dependence(with_noise(laws, seed, rho=0.97, size=2.0), where, "v", "m", "N", seed)
        assert [c.direction for c in curves] == [""]
        for c in curves:
            truth = 0.3 * np.abs(c.at) / 0.1
            held += list((c.low <= truth) & (truth <= c.high))
    assert 0.78 < np.mean(held) < 0.99


def test_directions_are_apart_where_the_law_changes_sign() -> None:
    where = places(2)
    laws = [0.2 * c.s * np.exp(-c.since_reversal / 0.01) for c in where]
    forth, back = dependence(with_noise(laws, 4, size=0.1), where, "distance since reversal", "m", "N")
    assert (forth.direction, back.direction) == ("forth", "back")
    for curve, sign in ((forth, 1.0), (back, -1.0)):
        assert np.all(curve.low <= curve.mean + 1e-12)
        assert np.all(curve.mean <= curve.high + 1e-12)
        truth = sign * 0.2 * np.exp(-curve.at / 0.01)
        assert np.sqrt(np.mean((curve.mean - truth) ** 2)) < 0.02


@pytest.mark.filterwarnings("error")
def test_bins_without_samples_have_no_point() -> None:
    """An edge between two levels, where none of the samples is, makes a bin without any."""
    load = np.repeat([1.0, 2.5, 3.7], [1006, 822, 988])
    s = np.tile([1.0, -1.0], load.size // 2)
    (where,) = (replace(c, load=load, s=s) for c in places(1, load.size))
    residual = with_noise([0.3 * load], 2, size=0.1)
    for side, curve in zip((1.0, -1.0), dependence(residual, [where], "load", "m", "N"), strict=True):
        parts = [(load < 2.0) & (s == side), (load > 2.0) & (s == side)]  # the last bin holds its upper edge
        assert np.allclose(curve.at, [load[part].mean() for part in parts])
        assert np.allclose(curve.mean, [residual[0][part].mean() for part in parts])
        assert (curve.low < curve.mean).all()
        assert (curve.mean < curve.high).all()


def test_shapes_of_a_channel_without_a_law_are_empty_and_of_another_not() -> None:
    from tsm_fmu.diagnosis.residual.locate import locate

    where = places(2)
    law = with_noise([1e-3 * c.s / (1.0 + (c.since_reversal / 0.006) ** 2) for c in where], 1, size=0.3)
    rng = np.random.default_rng(6)
    both = [np.column_stack([y, 0.01 * noise(y.size, 0.9, rng)]) for y in law]
    seen = locate(both, where, ["tau", "x_out"], "m", "N")
    first, second = shapes(both, where, ["tau", "x_out"], ["N.m", "rad"], seen, "m", "N")
    assert first.dependences[0].coordinate in ("distance since reversal", "a", "v", "x")
    assert "mN.m sgn(v) exp(-d/" in first.formula.text
    assert second.formula.text == ""


def test_text_of_a_formula() -> None:
    terms = (("sgn(v) exp(-d/4 mm)", 0.1234, "N"), ("v", -0.0321, "N.s/m"), ("", 1203.0, "N"))
    assert text_of(terms) == "0.12 N sgn(v) exp(-d/4 mm) - 0.032 N.s/m v + 1200 N"
    assert text_of((("v", 0.0021, "N.m.s/rad"), ("", -0.0354, "N.m"))) == "0.0021 N.m.s/rad v - 35 mN.m"
    assert text_of((("x L", -0.0021, "rad/N"),)) == "-0.12 deg/N x L"
    assert text_of((("x", -0.0021, "1"),)) == "-0.0021 x"


def test_columns_are_chosen_as_an_exhaustive_search_would() -> None:
    """Two columns that only together explain anything: a greedy search alone begins with the decoy."""
    rng = np.random.default_rng(12)
    a, b = rng.normal(size=(2, 600))
    decoy = (a - b) / np.sqrt(2.0) + 0.6 * rng.normal(size=600)
    x = np.column_stack([a + 3.0 * b, rng.normal(size=600), decoy, a + 3.2 * b, rng.normal(size=600)])
    y = 5.0 * (x[:, 0] - x[:, 3]) + 0.01 * rng.normal(size=600)
    data = sums(x, y, folds([200, 200, 200]))
    first, second, *_ = best_subsets(*data.whole, most=3)
    assert second == [0, 3]
    assert len(first) == 1
    assert coefficients_of(*data.whole, second) == pytest.approx([5.0, -5.0], rel=0.01)
    assert cross_validated_shares(data)[1] > 0.99
    assert fewest_terms(cross_validated_shares(data)) == 2


def test_pysindy_is_asked_where_it_is_installed() -> None:
    pytest.importorskip("pysindy", reason="optional extra sindy is not installed")
    rng = np.random.default_rng(3)
    x = rng.normal(size=(800, 9))
    assert _by_sindy(x, 0.7 * x[:, 2] - 0.4 * x[:, 5] + 0.1 * rng.normal(size=800), 2) == [2, 5]


class Thresholded:
    """Sequentially thresholded least squares (Brunton 2016), as `pysindy.STLSQ` is called."""

    def __init__(self, threshold: float, alpha: float) -> None:
        self.threshold, self.alpha = threshold, alpha

    def fit(self, x: np.ndarray, y: np.ndarray) -> Thresholded:
        kept = np.arange(x.shape[1])
        for _ in range(20):
            gram = x[:, kept].T @ x[:, kept] + self.alpha * np.eye(kept.size)
            values = np.linalg.solve(gram, x[:, kept].T @ y[:, 0])
            if (np.abs(values) >= self.threshold).all():
                break
            kept = kept[np.abs(values) >= self.threshold]
        self.coef_ = np.zeros((1, x.shape[1]))
        self.coef_[0, kept] = values[: kept.size]
        return self


@pytest.mark.parametrize("unit", [1.0, 3.1e-4, 2.7e5])
def test_the_threshold_is_raised_until_few_enough_terms_are_left_whatever_the_unit(
    monkeypatch: pytest.MonkeyPatch, unit: float
) -> None:
    """PySINDy's interface with an optimiser written here, so that it runs where PySINDy is not installed."""
    monkeypatch.setitem(sys.modules, "pysindy", SimpleNamespace(STLSQ=Thresholded))
    rng = np.random.default_rng(3)
    x = rng.normal(size=(800, 9))
    y = unit * (0.7 * x[:, 2] - 0.4 * x[:, 5] + 0.2 * x[:, 7] + 0.1 * rng.normal(size=800))
    assert [_by_sindy(x, y, count) for count in (1, 2, 3)] == [[2], [2, 5], [2, 5, 7]]
    monkeypatch.setitem(sys.modules, "pysindy", None)  # not installed
    assert _by_sindy(x, y, 3) == []
