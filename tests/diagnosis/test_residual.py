"""Parts of the search for laws in a residual, each by hand: bins, densest windows, columns, folds, blocks, chance."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2, gamma

from tsm_fmu.diagnosis.residual import formula as formula_module
from tsm_fmu.diagnosis.residual.dependence import _blocks, _interval, _means, dependence
from tsm_fmu.diagnosis.residual.formula import formula
from tsm_fmu.diagnosis.residual.library import Term, _different, _Runs, library
from tsm_fmu.diagnosis.residual.locate import _densest, _Spread, axes_of, bins, locate
from tsm_fmu.diagnosis.residual.predictable import predictable_share
from tsm_fmu.diagnosis.residual.sparse import (
    Sums,
    best_subsets,
    coefficients_of,
    cross_validated_share,
    cross_validated_shares,
    fewest_terms,
    sums,
)
from tsm_fmu.diagnosis.residual.surrogates import SMALLEST, background, surrogates, tail
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates

DT = 0.01


def moving(x: np.ndarray, load: np.ndarray | None = None) -> Coordinates:
    t, zero = DT * np.arange(x.size), np.zeros(x.size)
    v = np.gradient(x, t)
    side = np.where(v >= 0.0, 1.0, -1.0)
    return Coordinates(x, v, np.gradient(v, t), side, side, zero, np.abs(x - x[0]), zero, load, t)


def drive(n: int = 1500, shift: float = 0.0) -> Coordinates:
    t = DT * np.arange(n)
    return moving(0.31 * np.sin(1.9 * t + shift) + 0.17 * np.sin(4.71 * t))


# Bins and places


def test_bins_hold_as_many_samples_each() -> None:
    values = np.random.default_rng(1).permutation(np.arange(160.0) ** 3)
    number = bins(values)
    assert number is not None
    assert np.bincount(number).tolist() == [10] * 16
    assert (np.diff(number[np.argsort(values)]) >= 0).all()
    assert bins(np.full(50, 2.0)) is None
    two = bins(np.repeat([3.0, 1.0], [40, 60]))
    assert two is not None
    assert two.tolist() == [1] * 40 + [0] * 60
    rare = np.zeros(400)
    rare[7] = 5.0
    assert bins(rare) is not None  # one that is elsewhere is a place of its own
    few = bins(np.repeat([1.0, 2.0, 3.0], [50, 30, 20]), 4)
    assert few is not None
    assert len(set(few.tolist())) >= 2


def test_coordinates_have_their_units_and_a_drum_only_beyond_a_turn() -> None:
    c = drive()
    plain = axes_of([c, drive(shift=0.4)], "m", "N")
    assert [(name, unit) for name, unit, _ in plain] == [
        ("x", "m"), ("v", "m/s"), ("a", "m/s2"), ("sgn v", "1"), ("distance since reversal", "m"), ("dwell", "s"),
        ("time", "s"),
    ]  # fmt: skip
    for name, _, values in plain:
        field = {"sgn v": "s", "distance since reversal": "since_reversal"}.get(name, name)
        assert values[: c.x.size] == pytest.approx(getattr(c, field))
        assert values.size == 3000
    load = np.linspace(1.0, 2.0, 1500)
    loaded = moving(c.x, load)
    assert axes_of([loaded], "rad", "N.m")[-1][:2] == ("load", "N.m")
    assert [a[0] for a in axes_of([loaded, c], "rad", "N.m")][-1] == "time"  # not in all runs
    for span, found in ((6.27, False), (6.29, True)):
        wide = moving(np.linspace(-1.0, -1.0 + span, 300))
        last = axes_of([wide], "rad", "1")[-1]
        assert (last[0] == "drum angle") is found
        if found:
            assert last[1] == "rad"
            assert last[2][0] == pytest.approx(2.0 * np.pi - 1.0)
            assert ((last[2] >= 0.0) & (last[2] < 2.0 * np.pi)).all()
        assert axes_of([wide], "m", "1")[-1][0] == "time"


def test_the_densest_window_holds_most_of_the_residual_beyond_its_samples() -> None:
    """Of ten bins the third and fourth have squares of 9 and 4, the seventh 25, the others 1; all as many samples."""
    squares = np.array([1.0, 1.0, 9.0, 4.0, 1.0, 1.0, 25.0, 1.0, 1.0, 1.0])
    number = np.repeat(np.arange(10), 200)
    values = np.linspace(0.0, 10.0, 2000)
    residual = np.sqrt(squares[number]) * np.where(np.arange(2000) % 2, 1.0, -1.0)
    best = max(
        ((i, j) for i, j in combinations(range(11), 2) if j - i < 10),
        key=lambda w: squares[w[0] : w[1]].sum() / squares.sum() - (w[1] - w[0]) / 10.0,
    )
    assert best == (6, 7)
    span, share, samples = _densest(residual, values, number)
    assert (share, samples) == (pytest.approx(25.0 / 45.0), pytest.approx(0.1))
    assert span == pytest.approx((6.0, 7.0), abs=0.02)
    squares[6] = 3.0
    residual = np.sqrt(squares[number]) * np.where(np.arange(2000) % 2, 1.0, -1.0)
    span, share, samples = _densest(residual, values, number)
    assert (share, samples) == (pytest.approx(13.0 / 23.0), pytest.approx(0.2))
    assert span == pytest.approx((2.0, 4.0), abs=0.03)


def test_the_share_that_means_of_bins_explain_is_that_of_an_analysis_of_variance() -> None:
    rng = np.random.default_rng(4)
    number = rng.integers(0, 5, 700)
    y = np.column_stack([np.array([3.0, -1.0, 0.5, 2.0, 0.0])[number] + rng.normal(size=700), rng.normal(size=700)])
    means = np.array([[y[number == k, j].mean() for k in range(5)] for j in range(2)])
    between = [np.sum((means[j][number] - y[:, j].mean()) ** 2) for j in range(2)]
    total = np.sum((y - y.mean(axis=0)) ** 2, axis=0)
    assert _Spread(y).between(number) == pytest.approx(between)
    assert _Spread(y).total == pytest.approx(total)
    still = _Spread(np.full((700, 1), 3.0))
    assert still.between(number) / still.total == pytest.approx([0.0])


def test_a_place_has_the_size_of_what_is_explained_beyond_chance_and_its_own_channel() -> None:
    where = [drive(), drive(shift=0.9)]
    rng = np.random.default_rng(2)
    parts = [np.column_stack([0.3 * rng.normal(size=c.x.size), 2.0 * c.s + rng.normal(size=c.x.size)]) for c in where]
    found = locate(parts, where, ["F", "tau"], "m", "1")
    side = next(p for p in found if (p.channel, p.coordinate) == ("tau", "sgn v"))
    assert side.explained == pytest.approx(0.8, abs=0.03)
    deviation = np.concatenate(parts)[:, 1].std()
    assert side.rms == pytest.approx(deviation * np.sqrt(side.explained - side.chance), rel=1e-6)
    assert side.significant
    assert max(p.explained for p in found if p.channel == "F") < 0.15
    order = [(not p.significant, p.chance - p.explained) for p in found]
    assert order == sorted(order)
    for p in (p for p in found if p.channel == "tau" and p.coordinate in ("x", "a")):
        assert p.explained > 0.7  # a function for each direction
        assert not p.significant  # the direction alone does as much


# Functions and their choice


def test_a_stroke_is_centred_where_its_middle_is_within_a_fiftieth_of_it() -> None:
    t = np.linspace(0.0, 6.0 * np.pi, 3000, endpoint=False)
    for middle, centred in ((0.0195, True), (0.0205, False), (-0.0195, True), (-0.0205, False)):
        runs = _Runs([moving(5.0 * np.sin(t) + 10.0 * middle)], "m", "N")
        assert (runs.middle == 0.0) is centred
        if not centred:
            assert runs.middle == pytest.approx(10.0 * middle)


def test_sizes_of_runs_are_those_of_the_longest_and_of_all() -> None:
    runs = _Runs([moving(np.linspace(1.0, 3.0, 200)), moving(np.linspace(-4.0, -1.0, 500))], "m", "N")
    assert (runs.span, runs.range, runs.length) == (pytest.approx(3.0), pytest.approx(7.0), pytest.approx(4.99))
    speeds = (2.0 / 1.99, 3.0 / 4.99)
    assert runs.speed == pytest.approx(np.sqrt((200 * speeds[0] ** 2 + 500 * speeds[1] ** 2) / 700.0))
    assert [t[0] for t in runs.t] == [0.0, 0.0]
    still = _Runs([moving(np.zeros(30))], "m", "N")
    assert (still.span, still.speed) == (1.0, 1.0)


@pytest.mark.parametrize(("correlation", "kept"), [(0.979, 2), (0.981, 1), (-0.981, 1)])
def test_a_function_that_is_nearly_another_is_left_out(correlation: float, kept: int) -> None:
    a, b = np.linalg.qr(np.random.default_rng(1).normal(size=(60, 2)))[0].T
    mixed = correlation * a + np.sqrt(1.0 - correlation**2) * b
    terms = [Term("a", "1", [7.0 * a[:20], 7.0 * a[20:]]), Term("b", "1", [0.3 * mixed[:20], 0.3 * mixed[20:]])]
    nothing = [Term("0", "1", [np.zeros(20), np.zeros(40)]), Term("inf", "1", [np.full(20, np.inf), np.zeros(40)])]
    assert [t.text for t in _different([*nothing, *terms])] == ["a", "b"][:kept]


def test_a_library_offers_each_function_once_and_simple_ones_first() -> None:
    offered = library([drive(), drive(shift=0.9)], "m", "N")
    texts = [t.text for t in offered]
    assert len(set(texts)) == len(texts)
    middle = 1e3 * np.mean(np.concatenate([drive().x, drive(shift=0.9).x]))
    assert texts[:2] == ["", f"(x - {middle:.3g} mm)"]
    values = np.column_stack([np.concatenate(t.values) for t in offered])
    values /= np.linalg.norm(values, axis=0)
    alike = np.abs(values.T @ values) - np.eye(len(texts))
    assert alike.max() < 0.98


def data_of(seed: int = 5, count: int = 4, noise: float = 0.2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Six columns of about unit size, the residual of three of them, and folds of unlike length."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(300, 6))
    x[:, 4] += 0.6 * x[:, 1]
    y = 0.9 * x[:, 1] - 0.5 * x[:, 3] + 0.3 * x[:, 5] + noise * rng.normal(size=300)
    return x, y, np.repeat(np.arange(count), [30, 50, 120, 100][:count])


def test_sums_are_products_by_fold() -> None:
    x, y, fold = data_of()
    data = sums(x, y, fold)
    assert data.gram.shape == (4, 6, 6)
    for f in range(4):
        inside = fold == f
        assert data.gram[f] == pytest.approx(x[inside].T @ x[inside])
        assert data.cross[f] == pytest.approx(x[inside].T @ y[inside])
        assert data.power[f] == pytest.approx(y[inside] @ y[inside])
        gram, cross = data.without(f)
        assert gram == pytest.approx(x[~inside].T @ x[~inside])
        assert cross == pytest.approx(x[~inside].T @ y[~inside])
    assert data.whole[0] == pytest.approx(x.T @ x)


def test_subsets_are_the_best_and_their_coefficients_those_of_least_squares() -> None:
    x, y, fold = data_of()
    data = sums(x, y, fold)
    for size, terms in enumerate(best_subsets(*data.whole), 1):
        left = {one: float(np.linalg.lstsq(x[:, one], y, rcond=None)[1][0]) for one in combinations(range(6), size)}
        assert tuple(terms) == min(left, key=lambda one: left[one])
        expected = np.linalg.lstsq(x[:, terms], y, rcond=None)[0]
        assert coefficients_of(*data.whole, terms) == pytest.approx(expected, rel=1e-6)
    assert [len(t) for t in best_subsets(*data.whole, most=2)] == [1, 2]
    two = Sums(data.gram[:, :2, :2], data.cross[:, :2], data.power)
    assert [len(t) for t in best_subsets(*two.whole)] == [1, 2]


def test_a_term_is_exchanged_until_no_other_helps_more() -> None:
    """The sum of three columns is the best one, and none of the best three beside them."""
    rng = np.random.default_rng(9)
    parts = rng.normal(size=(500, 3))
    decoy = parts @ [1.0, 1.0, 1.0] + 0.8 * rng.normal(size=500)
    x = np.column_stack([decoy, parts, rng.normal(size=500)])
    x /= np.sqrt(np.mean(x**2, axis=0))
    y = parts @ [1.0, 1.0, 1.0]
    first, _, third = best_subsets(x.T @ x, x.T @ y, most=3)
    assert first == [0]
    assert third == [1, 2, 3]


def test_shares_are_of_what_was_not_fitted() -> None:
    x, y, fold = data_of()
    data = sums(x, y, fold)
    lost = np.zeros(4)
    for f in range(4):
        seen = fold != f
        for k in range(4):
            terms = best_subsets(x[seen].T @ x[seen], x[seen].T @ y[seen])[k]
            a = np.linalg.lstsq(x[seen][:, terms], y[seen], rcond=None)[0]
            lost[k] += np.sum((y[~seen] - x[~seen][:, terms] @ a) ** 2)
    assert cross_validated_shares(data) == pytest.approx(1.0 - lost / np.sum(y**2), abs=1e-6)
    given = [1, 3]
    lost_given = 0.0
    for f in range(4):
        seen = fold != f
        a = np.linalg.lstsq(x[seen][:, given], y[seen], rcond=None)[0]
        lost_given += float(np.sum((y[~seen] - x[~seen][:, given] @ a) ** 2))
    assert cross_validated_share(data, given) == pytest.approx(1.0 - lost_given / np.sum(y**2), abs=1e-6)
    assert cross_validated_shares(data, most=2).shape == (2,)


@pytest.mark.parametrize(
    ("shares", "count"), [((0.5, 0.529, 0.52), 1), ((0.5, 0.531, 0.55), 2), ((0.1, 0.2, 0.9, 0.89), 3), ((0.4,), 1)]
)
def test_a_longer_formula_must_predict_three_hundredths_more(shares: tuple[float, ...], count: int) -> None:
    assert fewest_terms(np.array(shares)) == count


def test_a_formula_that_predicts_too_little_is_empty_and_says_how_much() -> None:
    where = [drive(), drive(shift=0.9), drive(shift=2.0)]
    rng = np.random.default_rng(3)
    noise = formula([rng.normal(size=c.x.size) for c in where], where, "N", "m", "1")
    assert (noise.text, noise.terms) == ("", ())
    assert 0.0 <= noise.share < 0.05
    found = formula([0.7 * c.v + 0.05 * rng.normal(size=c.x.size) for c in where], where, "N", "m", "1")
    assert [t[0] for t in found.terms] == ["v"]
    assert found.terms[0][1] == pytest.approx(0.7, rel=0.02)
    assert found.terms[0][2] == "N.s/m"
    power = 0.49 * np.mean(np.concatenate([c.v for c in where]) ** 2)
    assert found.share == pytest.approx(power / (power + 0.0025), abs=0.01)
    assert found.p < 0.02


def test_a_formula_beyond_doubt_is_compared_with_a_third_of_the_noises(monkeypatch: pytest.MonkeyPatch) -> None:
    """One beside noise that wanders with all: its chance is not that of a few."""
    where, rng, seen = [drive(), drive(shift=0.9), drive(shift=2.0)], np.random.default_rng(31), list[int]()
    real = formula_module._of_noise

    def counted(*given: Any) -> float:
        seen.append(1)
        return real(*given)

    monkeypatch.setattr(formula_module, "_of_noise", counted)
    law = [0.7 * c.v + 0.05 * rng.normal(size=c.x.size) for c in where]
    assert formula(law, where, "N", "m", "1").p == SMALLEST
    assert len(seen) == 13
    seen.clear()
    rng = np.random.default_rng(32)
    slow = [lfilter([0.243], [1.0, -0.97], rng.normal(size=c.x.size)) for c in where]
    weak = [y + 0.5 * c.v / np.sqrt(np.mean(c.v**2)) for c, y in zip(where, slow, strict=True)]
    assert SMALLEST < formula(weak, where, "N", "m", "1").p < 0.02
    assert len(seen) == 39


def test_what_coordinates_predict_is_judged_where_it_was_not_fitted() -> None:
    """A law of known share beside white noise, in two channels of unlike size."""
    where = [drive(1500, k) for k in (0.0, 0.9, 2.0)]
    rng, parts = np.random.default_rng(7), []
    for c in where:
        law = c.v / np.sqrt(np.mean(c.v**2))
        parts.append(np.column_stack([2.0 * law + rng.normal(size=c.x.size), 1e-3 * rng.normal(size=c.x.size)]))
    law, noise = predictable_share(parts, where, "m", "1")
    assert law == pytest.approx(0.8, abs=0.03)
    assert noise == pytest.approx(0.0, abs=0.02)
    assert predictable_share([0.0 * p for p in parts], where, "m", "1") == pytest.approx([1.0, 1.0])


# Means with intervals, and chance


def test_blocks_are_eight_a_run_or_four_times_as_long_as_the_noise_remembers() -> None:
    white = np.random.default_rng(5).normal(size=1600)
    number = _blocks([white[:1000], white[1000:]], white)
    assert (np.diff(number) >= 0).all()
    sizes = np.bincount(number)
    assert 1 <= sizes.min() <= sizes.max() < 12  # white noise forgets at once
    assert number[999] + 1 == number[1000]
    slow = np.repeat(np.random.default_rng(6).normal(size=16), 100)
    number = _blocks([slow[:1000], slow[1000:]], slow)
    assert np.bincount(number).tolist() == [125] * 8 + [75] * 8
    assert _blocks([white[:7], white[7:20]], white[:20])[:7].tolist() == [0] * 7


def test_an_interval_is_that_of_means_over_blocks() -> None:
    """Blocks of ten equal values: the mean of 100 of them scatters as one over ten, and not as the samples do."""
    rng = np.random.default_rng(8)
    each = rng.normal(size=100)
    residual = np.repeat(each, 20)
    number = np.tile([0, 1], 1000)
    residual = residual + np.where(number == 1, 5.0, 0.0)
    low, high = _interval(number, residual, np.repeat(np.arange(3, 303, 3), 20), 4)
    half = 1.645 * each.std() / 10.0
    for k, level in enumerate((0.0, 5.0)):
        assert low[k] == pytest.approx(each.mean() + level - half, abs=0.25 * half)
        assert high[k] == pytest.approx(each.mean() + level + half, abs=0.25 * half)
    assert _means(number, residual) == pytest.approx([each.mean(), each.mean() + 5.0])


@pytest.mark.parametrize(("samples", "drawn"), [(55, 0), (57, 1)])
def test_a_side_of_few_samples_is_not_drawn(samples: int, drawn: int) -> None:
    """Four in each of fourteen bins."""
    x = np.concatenate([np.linspace(0.0, 1.0, samples), np.linspace(1.0, 0.0, 400)])
    c = moving(x)
    s = np.concatenate([np.ones(samples), -np.ones(400)])
    c = Coordinates(c.x, c.v, c.a, s, s, c.x_pre, c.since_reversal, c.dwell, None, c.time)
    found = dependence([x], [c], "x", "m", "1")
    assert [d.direction for d in found] == ["forth", "back"][1 - drawn :]


def test_the_low_end_of_a_background_comes_from_narrow_windows() -> None:
    power = 1.0 + np.arange(400.0)
    found = background(power)
    of_mean = chi2.median(1)
    assert found[1] == found[2] == found[0] == pytest.approx(2.5)
    for k in (3, 7, 12):
        assert found[k] == pytest.approx(power[k] / of_mean), k  # of 1 to 2k - 1 the median is the middle
    assert found[200] == pytest.approx(power[200] / of_mean)
    lined = power.copy()
    lined[5] = 1e6
    assert background(lined)[5] == pytest.approx(found[5], rel=0.2)


def test_surrogates_have_the_variance_and_the_colour_of_the_background() -> None:
    rng = np.random.default_rng(3)
    n = 1000
    slow = np.cumsum(rng.normal(size=n))
    slow -= np.linspace(slow[0], slow[-1], n)
    for series in (rng.normal(size=n) + 7.0, 0.1 * slow):
        drawn = surrogates(series, 400, rng)
        assert drawn.mean(axis=0) == pytest.approx(series.mean())
        assert np.mean(drawn.var(axis=0)) == pytest.approx(series.var(), rel=0.35)
        steps = np.mean(np.diff(drawn, axis=0) ** 2)
        assert steps == pytest.approx(np.mean(np.diff(series) ** 2), rel=0.35)


def test_a_tail_is_counted_where_it_is_thick_and_else_of_a_gamma_distribution() -> None:
    drawn = np.arange(1.0, 100.0)
    assert tail(80.0, drawn) == pytest.approx(21.0 / 100.0)  # 20 of 99 are as large
    assert tail(90.5, drawn) == pytest.approx(10.0 / 100.0, abs=0.06)
    skewed = np.random.default_rng(2).gamma(2.0, 3.0, 999)
    skew = np.mean(((skewed - skewed.mean()) / skewed.std()) ** 3)
    shape = 4.0 / skew**2
    for value in (20.0, 40.0):
        z = (value - skewed.mean()) / skewed.std()
        assert tail(value, skewed) == pytest.approx(float(gamma.sf(shape + z * np.sqrt(shape), shape)), rel=1e-9)
    even = np.concatenate([drawn, 100.0 - drawn])  # without skewness nearly a normal one, of 0.05
    z = (110.0 - even.mean()) / even.std()
    assert tail(110.0, even) == pytest.approx(float(gamma.sf(1600.0 + 40.0 * z, 1600.0)), rel=1e-6)
    extreme = np.append(np.zeros(400), 50.0)  # of skewness 20, taken as 4
    z = (60.0 - extreme.mean()) / extreme.std()
    assert tail(60.0, extreme) == pytest.approx(max(1e-6, float(gamma.sf(0.25 + 0.5 * z, 0.25))), rel=1e-6)


def test_terms_of_a_formula_stand_by_the_size_of_what_they_do() -> None:
    where = [drive(shift=k) for k in (0.0, 0.9, 2.0)]
    rng = np.random.default_rng(6)
    rms = float(np.sqrt(np.mean(np.concatenate([c.v for c in where]) ** 2)))
    for of_v, of_size in ((0.3, 1.0), (1.0, 0.3)):
        law = [(of_v * c.v + of_size * np.abs(c.v)) / rms for c in where]
        found = formula([y + 0.01 * rng.normal(size=y.size) for y in law], where, "N", "m", "1")
        assert [t[0] for t in found.terms] == (["v", "|v|"] if of_v > of_size else ["|v|", "v"])
        assert [t[1] * rms for t in found.terms] == pytest.approx([1.0, 0.3], rel=0.02)
