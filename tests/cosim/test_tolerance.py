"""What a loop's tolerance page and a sweep's page say and draw, from points whose numbers are known."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim.exchange import FmuFailure, _mixed, solve
from tsm_fmu.cosim.order import AlgebraicLoop
from tsm_fmu.cosim.sweep import Point
from tsm_fmu.cosim.sweep_report import (
    SweepTable,
    chief_numbers,
    distributions,
    lines_axis,
    sweep_answer,
    sweep_section,
    sweep_table,
    worst_tables,
)
from tsm_fmu.cosim.tolerance import (
    bands,
    bands_figure,
    covered,
    rank_correlation,
    tolerance_answer,
    tolerance_sections,
)

DEGREE = 180.0 / math.pi


def draw(level: float, *cases: str) -> Point:
    return Point({}, {}, trace={case: tuple(level + 0.5 * k for k in range(3)) for case in cases})


def test_bands_are_quantiles_of_the_draws_that_have_the_signal():
    time = np.array([0.0, 1.0, 2.0])
    draws = [draw(k, "a") for k in range(41)] + [Point({}, {}, "broke")]
    found = bands("a", time, "rad", draw(7.25, "a"), draws)
    assert found is not None
    assert found.nominal.tolist() == [7.25, 7.75, 8.25]
    for row, level in zip(found.quantiles, (1.0, 10.0, 20.0, 30.0, 39.0), strict=True):
        assert row == pytest.approx(level + np.array([0.0, 0.5, 1.0]))
    assert bands("b", time, "rad", draw(1.0, "a"), draws) is None
    assert bands("a", time, "rad", draw(1.0, "a"), draws[:1]) is None
    without = bands("a", time, "rad", draw(1.0, "b"), draws[:2])
    assert without is not None
    assert np.isnan(without.nominal).all()
    figure = bands_figure(found, "title", "e.y")
    above, below = figure.panels
    assert (above.y_label, below.y_label) == ("e.y [deg]", "less that of the card [deg]")
    assert np.asarray(above.lines[0].y) == pytest.approx(DEGREE * found.nominal)
    assert above.lines[0].dashed
    for panel, less in ((above, 0.0), (below, found.nominal)):
        for band, (low, high) in zip(panel.bands, ((0, 4), (1, 3)), strict=True):
            for part, row in ((band.mean, 2), (band.low, low), (band.high, high)):
                assert np.asarray(part) == pytest.approx(DEGREE * (found.quantiles[row] - less))
    assert [band.name for band in above.bands] == ["95 % of the draws", "50 % of the draws"]


@pytest.mark.parametrize("draws", [1, 59, 1000])
def test_the_worst_of_many_draws_covers_what_wilks_says(draws: int):
    """With n draws the share q of all lies below the largest with probability 1 - q^n."""
    assert 1.0 - covered(draws) ** draws == pytest.approx(0.95)
    assert covered(59) == pytest.approx(0.95, abs=1e-3)  # the number that is known for 95/95


def table(values: dict[str, list[float]], units: dict[str, str], **axes: list[Any]) -> SweepTable:
    at = [dict(zip(axes, row, strict=True)) for row in zip(*axes.values(), strict=True)]
    about = {n: {"unit": "N" if isinstance(v[0], float) else "", "values": sorted(set(v))} for n, v in axes.items()}
    failed = ["why" if math.isnan(v) else "" for v in next(iter(values.values()))]
    return SweepTable(about, at, {n: np.array(v) for n, v in values.items()}, units, failed)


def test_an_answer_has_the_spread_the_worst_and_what_it_covers():
    values = [float(k) for k in range(40)] + [-55.5, math.nan, math.nan]
    one = table({"e.std": values, "other": values}, {"e.std": "deg", "other": "1"}, k=[float(k) for k in range(43)])
    low, high = np.quantile(values[:41], [0.025, 0.975])
    assert tolerance_answer(one, {"e.std": 3.25}, 43) == (
        f"e.std: 3.25 deg with the values of the card; 95 % of 41 draws lie from {low:.4g} to {high:.4g} deg. The "
        f"worst, -55.5 deg, is not exceeded by {100 * 0.05 ** (1 / 41):.3g} % of such drives, with 95 % confidence. "
        "2 draws failed."
    )


def test_what_drives_a_number_is_told_by_ranks_of_the_draws_that_ran():
    rng = np.random.default_rng(4)
    a, b = rng.normal(size=30), rng.normal(size=30)
    number = np.exp(a)
    number[7] = np.nan
    columns = {"a": a.tolist(), "b": b.tolist(), "same": [2.0] * 30}
    one = table({"y": number.tolist(), "flat": [1.0] * 30}, {"y": "N", "flat": "N"}, **columns)
    bands_, spread, drivers = tolerance_sections(one, list(columns), [], ["first", "second"])
    (rows,) = [t.rows for t in drivers.tables]
    good = np.isfinite(number)
    ranks = [np.argsort(np.argsort(x[good])) for x in (b, number)]
    expected = f"{np.corrcoef(*ranks)[0, 1]:.2f}"
    assert list(map(list, rows)) == [["y", "1.00", expected, ""], ["flat", "", "", ""]]
    assert spread.text == "first\n\nsecond"
    assert bands_.title == "Bands over time"
    assert rank_correlation(a, -np.arctan(a)) == pytest.approx(-1.0)
    few = table({"y": [1.0, 2.0, math.nan]}, {"y": "N"}, a=[1.0, 2.0, 3.0])
    assert list(tolerance_sections(few, ["a"], [], [])[2].tables[0].rows[0]) == ["y", ""]


def test_spread_and_worst_of_a_number_leave_failures_out():
    values = [float(k) for k in range(21)] + [-30.0, math.nan]
    one = table({"y": values, "lost": [math.nan] * 23}, {"y": "N", "lost": "N"}, k=[0.5 * k for k in range(23)])
    spread, failed = worst_tables(one)
    ((name, unit, low, middle, high, worst, there),) = spread.rows
    good = np.array(values[:-1])
    assert (name, unit, worst, there) == ("y", "N", -30.0, "k = 10.5")
    assert (low, middle, high) == pytest.approx(np.percentile(good, [5, 50, 95]))
    assert list(failed.rows) == [("k = 11", "why")]
    assert failed.caption == "Points without a result."


@pytest.mark.parametrize(("values", "drawn"), [
    ([1.0] * 7 + [2.0], 1), ([1.0] * 6 + [2.0], 0), ([1.0] * 9, 0), ([1.0] * 6 + [2.0, math.nan], 0),
])  # fmt: skip
def test_a_distribution_needs_eight_points_that_differ(values: list[float], drawn: int):
    one = table({"y": values}, {"y": "N"}, k=[float(k) for k in range(len(values))])
    found = distributions(one)
    assert len(found) == drawn
    for figure in found:
        steps = figure.panels[0].steps
        assert steps is not None
        assert np.sum(steps.counts) == len(values)
        assert figure.panels[0].x_label == "y [N]"


@pytest.mark.parametrize(("names", "chief"), [
    (["a.x.mean", "a.x.peak_to_peak", "tracking_error.std", "tracking_error.peak_to_peak", "gain"],
     ["tracking_error.peak_to_peak", "tracking_error.std", "gain"]),
    (["a.x.mean", "a.x.peak_to_peak", "b.peak_to_peak"], ["a.x.peak_to_peak", "b.peak_to_peak"]),
    (["a.x.mean", "a.x.std"], ["a.x.mean", "a.x.std"]),
    ([f"n{k}" for k in range(12)], [f"n{k}" for k in range(8)]),
])  # fmt: skip
def test_chief_numbers_are_tracking_errors_and_a_systems_own_else_swings(names: list[str], chief: list[str]):
    assert chief_numbers(names) == chief


def swept(
    points: list[tuple[dict[str, Any], float | None]], vary: dict[str, tuple[str, list[Any]]], **more: Any
) -> dict:
    listed = [{"values": at, "metrics": {} if y is None else {"gain": {"value": y, "unit": "N"}},
               "failed": "slipped" if y is None else ""} for at, y in points]  # fmt: skip
    axes = {n: {"unit": u, "values": v} for n, (u, v) in vary.items()}
    return {"vary": axes, "points": listed, "system": "belt", "complete": True, **more}


def test_a_sweep_of_numbers_is_lines_a_map_and_the_points_with_the_worst_first():
    """A plane k m - 7 over 4 and 2 values; one point failed."""
    ks, ms = [1.0, 2.0, 3.0, 4.0], [1.5, -2.0]
    points = [
        ({"a.k": k, "b.m": m}, None if (k, m) == (2.0, 1.5) else k * m - 7.0) for k, m in itertools.product(ks, ms)
    ]
    data = swept(points, {"a.k": ("rad", ks), "b.m": ("", ms)})
    data["vary"]["b.m"]["unit"] = "s"
    section = sweep_section(data)
    assert sweep_answer(data) == "8 points, 1 failed; complete. gain is at worst -15 N, at a.k = 4, b.m = -2."
    assert sweep_answer({**data, "complete": False}).startswith("8 points, 1 failed; interrupted.")
    assert section.title == "Sweep of belt"
    rows = section.tables[-1].rows
    assert section.tables[-1].heading == ["a.k [rad]", "b.m [s]", "gain [N]"]
    assert [row[-1] for row in rows] == [-15.0, -13.0, -11.0, -9.0, -5.5, -2.5, -1.0, None]
    assert rows[0][:2] == ["4", "-2"]
    one = sweep_table(data)
    assert lines_axis(one) == "a.k"
    cells, lines = (f.panels[0] for f in section.figures[:2])
    assert cells.cells is not None
    expected = [[k * m - 7.0 if (k, m) != (2.0, 1.5) else math.nan for k in ks] for m in ms]
    np.testing.assert_array_equal(np.asarray(cells.cells.values), expected)
    assert (cells.x_label, cells.y_label) == ("a.k [rad]", "b.m [s]")
    assert [line.name for line in lines.lines] == ["b.m = 1.5", "b.m = -2"]
    assert np.asarray(lines.lines[1].y) == pytest.approx([-9.0, -11.0, -13.0, -15.0])
    assert np.asarray(lines.lines[1].x).tolist() == ks


def test_a_map_shows_the_worst_over_the_other_axes_and_a_choice_is_bars():
    axes = {"a": ("N", [1.0, 2.0]), "b": ("N", [5.0, 6.0]), "c": ("N", [0.0, 1.0, 2.0])}
    numbers = {(a, b, c): a * (c - 1.5) - b for a in (1.0, 2.0) for b in (5.0, 6.0) for c in (0.0, 1.0, 2.0)}
    points = [(dict(zip("abc", at, strict=True)), y) for at, y in numbers.items()]
    section = sweep_section(swept(points, axes))
    titles = [f.title for f in section.figures]
    assert titles[:3] == ["gain [N], worst over c", "gain [N], worst over b", "gain [N], worst over a"]
    cells = section.figures[0].panels[0].cells
    assert cells is not None
    worst = [[min(numbers[a, b, c] for c in (0.0, 1.0, 2.0)) for a in (1.0, 2.0)] for b in (5.0, 6.0)]
    assert np.asarray(cells.values).tolist() == worst
    lines = next(f for f in section.figures if f.title == "gain over c").panels[0].lines
    assert len(lines) == 4
    chosen = swept([({"card": "x/one.toml"}, 1.5), ({"card": "x/two.toml"}, -2.0)], {"card": ("", ["a", "b"])})
    (bars,) = sweep_section(chosen).figures
    assert bars.title == "Over card"
    assert next(iter(bars.panels)).bars == {"one.toml": 1.5, "two.toml": -2.0}
    many = [({"a": float(a), "b": float(b)}, float(a + b)) for a in range(9) for b in range(7)]
    found = sweep_section(swept(many, {"a": ("N", list(range(9))), "b": ("N", list(range(7)))}))
    assert not [f for f in found.figures if f.title == "gain over a"]  # seven lines are too many
    assert found.tables[-1].caption == "Points, the worst of the first number first: 60 of 63."


LOOP = AlgebraicLoop((("a", "y"), ("b", "u"), ("a", "y")), ("a", "b"), ())


@pytest.mark.parametrize("size", [1, 2, 4])
def test_a_linear_loop_is_solved_in_as_many_passes_as_it_has_values_and_two(size: int):
    """Anderson's mixing is a Krylov method; without it these loops, which amplify, would run away."""
    rng = np.random.default_rng(size)
    matrix = rng.normal(size=(size, size)) * 2.0 + 3.0 * np.eye(size)
    right = rng.normal(size=size)
    passes, restored = [], []

    def one_pass(x: np.ndarray) -> np.ndarray:
        passes.append(x)
        return matrix @ x + right

    solve(LOOP, one_pass, lambda: restored.append(1), np.zeros(size), 1e-9, 0.5)
    exact = np.linalg.solve(np.eye(size) - matrix, right)
    assert passes[-1] == pytest.approx(exact, rel=1e-6, abs=1e-8)
    assert len(passes) <= size + 3
    assert len(restored) == len(passes) - 1  # a pass that is not the last is taken back


def test_a_loop_that_is_solved_at_once_takes_one_pass_and_one_that_never_is_says_so():
    taken: list[float] = []
    solve(LOOP, lambda x: x + 0.9e-6, lambda: taken.append(1.0), np.array([0.0]), 1e-6, 0.0)
    solve(LOOP, lambda x: x + 100.9 * 1e-6, lambda: taken.append(1.0), np.array([100.0]), 1e-6, 0.0)
    assert taken == []
    with pytest.raises(FmuFailure) as wrong:
        solve(LOOP, lambda x: x + 1.0 + np.abs(x), lambda: taken.append(1.0), np.array([0.3]), 1e-6, 2.5)
    assert "at t = 2.5 s: after 60 passes its values still change by " in str(wrong.value)
    assert "expected at most 1e-06" in str(wrong.value)
    passes = len(taken)
    assert 1 < passes <= 60
    with pytest.raises(FmuFailure, match=r"change by (nan|inf)"):
        solve(LOOP, lambda x: x * np.nan, lambda: taken.append(1.0), np.array([0.3]), 1e-6, 2.5)
    assert len(taken) == passes  # what is no number is not tried again


def test_the_first_mixing_is_a_plain_pass_and_the_next_a_secant():
    x, r = np.array([1.0]), np.array([0.5])
    assert _mixed([(x, r)]).tolist() == [1.5]
    assert _mixed([(x, r), (np.array([1.5]), np.array([0.25]))]) == pytest.approx([2.0])  # the residual's zero
    assert _mixed([(x, r), (np.array([1.5]), np.array([0.5]))]).tolist() == [2.0]  # no slope: a plain pass
