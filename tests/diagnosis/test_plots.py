"""Figures of the page: runs before and after, a residual over its coordinates, the next motion, in units of people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.evidence import Dependence, Gap, ModelFit, NextMotion, ResidualShape, RunComparison
from tsm_fmu.diagnosis.report.plots import dependence_figures, motion_figures, run_sections, straight_line
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.logs.record import Record
from tsm_fmu.report import Figure, Line

T = 0.013 * np.arange(90)
X = 0.31 * np.sin(7.0 * T) + 0.04
ANGLE, TORQUE = 1.37 * X + 0.02 * np.cos(7.0 * T), 0.041 * np.sign(np.cos(7.0 * T)) + 0.003 * X
"""An angle that is nearly a line over the position, and a torque that is none."""
OFF = {"given": 0.0211, "refitted": -0.0074, "final": 0.0013}
DEGREE = 180.0 / np.pi
GIVEN, REFITTED, FINAL = (ModelFit("TendonDrive", effects, ()) for effects in ((), ("wear",), ("wear", "inertia")))


def compared(name: str, motion: np.ndarray | None = X) -> RunComparison:
    measured = np.column_stack([ANGLE, TORQUE])
    simulated = {stage: measured - np.array([off, 0.1 * off]) for stage, off in OFF.items()}
    record = Record(name, T, {"x_in": X}, {"x_in": "rad"}, None, "0")
    return RunComparison(record, T, measured, simulated, motion, {})


def gap(unit: str, before: float) -> Gap:
    return Gap(unit, before, 0.1 * before, None, None, 0.0, 0.0, None, None, None, before, None)


FOUND = Diagnosis(
    "named", channels=("x_out", "tau_in"), gap={"x_out": gap("rad", 0.0211), "tau_in": gap("N.m", 0.15)},
    given=GIVEN, refitted=REFITTED, final=FINAL, motion="x_in", motion_unit="rad",
    runs=tuple(compared(name) for name in "abcd"),
)  # fmt: skip


def drawn(figure: Figure) -> tuple[dict[str, Line], str, str]:
    """The lines of its only panel by name, and the labels of its axes."""
    (panel,) = figure.panels
    return {line.name: line for line in panel.lines}, panel.x_label, panel.y_label


def titles(figures: Sequence[Figure]) -> list[str]:
    return [figure.title for figure in figures]


def test_at_most_three_runs_are_drawn_and_the_first_section_says_of_how_many() -> None:
    for count, names, remark in ((4, "abc", "3 of 4 runs are drawn."), (3, "abc", ""), (1, "a", "")):
        sections = run_sections(replace(FOUND, runs=FOUND.runs[:count]))
        assert [s.title for s in sections] == [f"Run {name}" for name in names]
        assert [s.text for s in sections] == [remark] + [""] * (len(names) - 1)
    assert run_sections(replace(FOUND, final=None)) == []


@pytest.mark.parametrize(("final", "names"), [
    (FINAL, ["as given", "refitted", "after"]), (GIVEN, ["as given", "refitted"]), (REFITTED, ["as given", "refitted"]),
])  # fmt: skip
def test_the_answer_is_a_line_of_its_own_where_it_is_another_model(final: ModelFit, names: list[str]) -> None:
    figures = run_sections(replace(FOUND, final=final))[0].figures
    for figure in figures:
        lines, _, _ = drawn(figure)
        on_errors = "minus" in figure.title
        assert list(lines) == ([] if on_errors else ["measured"]) + names
        for name, line in lines.items():
            assert line.dashed == (name == "measured")
        if on_errors:  # the same colours as beside the measurement, which has the first
            assert [line.colour for line in lines.values()] == list(range(1, 1 + len(names)))


def test_each_channel_has_its_loop_its_history_and_its_errors_in_units_of_people() -> None:
    figures = run_sections(FOUND)[0].figures
    assert titles(figures) == [
        "x_out over x_in, less the measurement's straight line", "x_out", "x_out: measured minus simulated",
        "tau_in over x_in", "tau_in", "tau_in: measured minus simulated",
    ]  # fmt: skip
    line = np.polyval(np.polyfit(X, ANGLE, 1), X)
    loops, across, up = drawn(figures[0])
    assert (across, up) == ("x_in [deg]", "x_out [deg]")
    assert loops["measured"].y == pytest.approx(DEGREE * (ANGLE - line), abs=1e-9)
    assert loops["refitted"].y == pytest.approx(DEGREE * (ANGLE - OFF["refitted"] - line), abs=1e-9)
    assert all(one.x == pytest.approx(DEGREE * X) for one in loops.values())
    history, across, up = drawn(figures[1])
    assert (across, up) == ("time [s]", "[deg]")
    assert history["measured"].y == pytest.approx(DEGREE * ANGLE)
    assert history["after"].y == pytest.approx(DEGREE * (ANGLE - OFF["final"]))
    assert all(one.x == pytest.approx(T) for one in history.values())
    errors, across, up = drawn(figures[2])
    assert (across, up) == ("time [s]", "[deg]")
    assert [e.y for e in errors.values()] == [pytest.approx(np.full(90, DEGREE * off)) for off in OFF.values()]
    torque, across, up = drawn(figures[3])  # below 0.1 N.m, as the torque is; its error as given is not
    assert (across, up) == ("x_in [deg]", "tau_in [mN.m]")
    assert torque["measured"].y == pytest.approx(1e3 * TORQUE)
    assert torque["as given"].y == pytest.approx(1e3 * (TORQUE - 0.1 * OFF["given"]))
    history, across, up = drawn(figures[4])
    assert (history["after"].y, up) == (pytest.approx(1e3 * (TORQUE - 0.1 * OFF["final"])), "[mN.m]")
    errors, across, up = drawn(figures[5])
    assert (errors["refitted"].y, up) == (pytest.approx(np.full(90, 0.1 * OFF["refitted"])), "[N.m]")


def test_a_loop_less_its_line_has_the_unit_of_what_is_left() -> None:
    """A force of newtons along a line, and a loop of millinewtons about it."""
    force = 2.3 * X / X.std() + 0.011 * np.sign(np.cos(7.0 * T))
    run = replace(compared("a"), measured=force[:, None], simulated={s: force[:, None] - off for s, off in OFF.items()})
    one = replace(FOUND, channels=("F",), gap={"F": gap("N", 0.0211)}, runs=(run,))
    loop, history, errors = run_sections(one)[0].figures
    lines, _, up = drawn(loop)
    left = force - np.polyval(np.polyfit(X, force, 1), X)
    assert up == "F [mN]"
    assert lines["measured"].y == pytest.approx(1e3 * left, abs=1e-6)
    assert lines["as given"].y == pytest.approx(1e3 * (left - OFF["given"]), abs=1e-6)
    assert drawn(history)[0]["measured"].y == pytest.approx(force)
    assert drawn(history)[2] == "[N]"
    assert drawn(errors)[0]["after"].y == pytest.approx(np.full(90, 1e3 * OFF["final"]))


def test_a_speed_is_shown_as_one_and_without_a_motion_there_is_no_loop() -> None:
    fast = replace(FOUND, motion="v", motion_unit="m", runs=(compared("a", 5.0 * X),))
    _, across, _ = drawn(run_sections(fast)[0].figures[3])
    assert across == "v [mm/s]"
    assert drawn(run_sections(replace(fast, runs=(compared("a", 50.0 * X),)))[0].figures[3])[1] == "v [m/s]"
    still = replace(FOUND, motion="", runs=(compared("a", None),))
    shown = titles(run_sections(still)[0].figures)
    assert shown == [f"{c}{what}" for c in ("x_out", "tau_in") for what in ("", ": measured minus simulated")]


def test_the_line_is_that_of_least_squares() -> None:
    x, y = np.array([0.0, 1.0, 3.0]), np.array([1.0, 3.1, 6.9])
    line = straight_line(x, y)
    mean_x, mean_y = x.mean(), y.mean()
    slope = np.sum((x - mean_x) * (y - mean_y)) / np.sum((x - mean_x) ** 2)
    assert line == pytest.approx(mean_y + slope * (x - mean_x))
    for share, hidden in ((0.49, False), (0.51, True)):  # of the variance that is the line's
        x = np.array([-1.0, 1.0, -1.0, 1.0])
        loop = np.array([1.0, 1.0, -1.0, -1.0])  # not of the line
        assert (straight_line(x, x * share**0.5 + loop * (1.0 - share) ** 0.5) is not None) is hidden


def curve(coordinate: str, unit: str, direction: str, at: list[float], mean: list[float]) -> Dependence:
    a, m = np.array(at), np.array(mean)
    return Dependence(coordinate, unit, direction, a, m, m - 0.0012, m + 0.0017)


def test_a_residual_over_each_coordinate_has_a_band_for_each_direction() -> None:
    over_x = (
        curve("x", "rad", "forth", [-0.7, 0.2], [0.013, -0.037]), curve("x", "rad", "back", [-0.5, 0.3], [-0.02, 0.01]),
    )  # fmt: skip
    over_side = curve("sgn v", "1", "", [-1.0, 1.0], [0.004, -0.006])
    first, second = dependence_figures(ResidualShape("F", "N", (*over_x, over_side)))
    assert first.title == second.title == "Mean residual of F, 90 % interval"
    (panel,) = first.panels
    assert (panel.x_label, panel.y_label) == ("x [deg]", "[mN]")
    assert [band.name for band in panel.bands] == ["moving forth", "moving back"]
    for band, one in zip(panel.bands, over_x, strict=True):
        assert band.x == pytest.approx(DEGREE * one.at)
        assert band.mean == pytest.approx(1e3 * one.mean)
        assert band.low == pytest.approx(1e3 * one.mean - 1.2)
        assert band.high == pytest.approx(1e3 * one.mean + 1.7)
    (panel,) = second.panels
    assert (panel.x_label, panel.y_label) == ("sgn v", "[mN]")
    assert [band.name for band in panel.bands] == [""]
    assert panel.bands[0].x == pytest.approx([-1.0, 1.0])


def test_one_unit_holds_for_all_curves_of_a_figure_by_the_largest() -> None:
    """The second curve is large, the way and the force: neither is in thousandths then."""
    small = curve("distance since reversal", "m", "forth", [0.01, 0.3], [0.02, -0.01])
    for at, x_unit in ((1.9, "mm"), (2.1, "m")):
        for mean, y_unit in ((-0.09, "mN"), (-0.11, "N")):
            large = curve("distance since reversal", "m", "back", [-at, 0.1], [mean, 0.05])
            for curves in ((small, large), (large, small)):
                (figure,) = dependence_figures(ResidualShape("F", "N", curves))
                (panel,) = figure.panels
                assert (panel.x_label, panel.y_label) == (f"distance since reversal [{x_unit}]", f"[{y_unit}]")
    assert dependence_figures(ResidualShape("F", "N")) == []


def test_of_the_next_motion_what_moves_is_drawn_over_time() -> None:
    columns = {"x_in": -0.3 * np.cos(T), "tau_out": np.full(90, 0.7), "F": 0.02 * T, "v": -2.5 + 0.0 * T}
    columns["v"][17] = -2.4999
    units = {"x_in": "rad", "tau_out": "N.m", "F": "N", "v": "m/s"}
    figures = motion_figures(NextMotion("two sines", T, columns, units, 4.0))
    assert titles(figures) == ["x_in", "F", "v"]
    for figure, unit, factor in zip(figures, ("deg", "mN", "m/s"), (DEGREE, 1e3, 1.0), strict=True):
        lines, across, up = drawn(figure)
        assert (across, up) == ("time [s]", f"[{unit}]")
        assert list(lines) == [figure.title]
        assert lines[figure.title].x == pytest.approx(T)
        assert lines[figure.title].y == pytest.approx(factor * columns[figure.title])
