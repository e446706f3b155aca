"""Rows that a replay sets, the steps between them, and units of what comes out, without an FMU."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim.master import _loop_note, _store_end, number_of_steps
from tsm_fmu.cosim.order import AlgebraicLoop
from tsm_fmu.cosim.replay import _rows, _si, _steps, agreement, check_measured, in_si
from tsm_fmu.cosim.system import Experiment, Link
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError


def description(variable_step: bool = False, **units: str) -> Any:
    ports = {name: SimpleNamespace(unit=unit) for name, unit in units.items()}
    return SimpleNamespace(ports=ports, path=SimpleNamespace(name="x.fmu"), variable_step=variable_step)


def test_inputs_are_set_in_the_units_of_the_fmu_and_as_they_are_where_it_has_none() -> None:
    t = 0.1 * np.arange(40)
    columns = {"a": np.sin(t), "T": 280.0 + t, "n": 3.0 * t, "f": 2.0 - t}
    record = Record("one", t, columns, {"a": "rad", "T": "K", "n": "N", "f": "N"})
    rows, notes = _rows(description(a="deg", T="degC", n="", f="kN"), ["a", "T", "n", "f"], record, None)
    expected = [np.degrees(columns["a"]), columns["T"] - 273.15, columns["n"], 1e-3 * columns["f"]]
    assert rows == pytest.approx(np.array(expected).T)
    assert notes == ()
    one, said = _rows(description(n="N"), ["n"], record, 4.0)
    assert one[:, 0] == pytest.approx(columns["n"])
    assert said == ("--cutoff 4 Hz is not used: the log has n itself, nothing is derived",)


def test_steps_are_those_of_the_record_or_even_ones_where_an_fmu_needs_them() -> None:
    def record(times: Any) -> Record:
        return Record("one", np.asarray(times), {}, {})

    uneven = record([2.0, 2.1, 2.25, 2.3, 2.4])
    assert _steps(description(True), uneven) == pytest.approx([0.1, 0.15, 0.05, 0.1])
    with pytest.raises(InputError, match=r"x.fmu needs equal steps, one has 0.[01]5 s at t = 2.(1|25) s among steps"):
        _steps(description(), uneven)
    for off, fits in ((0.9e-4, True), (1.1e-4, False)):  # of 0.1 s: a thousandth is rounding of a clock
        times = 2.0 + 0.1 * np.arange(1001.0)
        times[500:] += off
        times[501:] -= off
        if fits:
            assert _steps(description(), record(times)) == pytest.approx([0.1] * 1000, rel=1e-12)
        else:
            with pytest.raises(InputError, match="needs equal steps"):
                _steps(description(), record(times))


@pytest.mark.parametrize(
    ("unit", "si"), [("deg", "rad"), ("rad", "rad"), ("mm", "m"), ("", "1"), ("furlongs-own", "1"), ("kN", "N")]
)
def test_the_si_unit_of_a_port_is_1_where_nobody_knows_it(unit: str, si: str) -> None:
    assert _si(unit) == si


def test_what_comes_out_is_in_si_by_variable() -> None:
    t = np.arange(3.0)
    units = {"fmu.a": "deg", "fmu.T": "degC", "fmu.x.y": "m", "fmu.own": "mine"}
    columns = {"fmu.a": 180.0 * t, "fmu.T": t, "fmu.x.y": t, "fmu.own": 2 * t}
    run = Trajectory(t, columns, units, "why", ("note",))
    found = in_si(run)
    assert list(found.columns) == ["a", "T", "x.y", "own"]
    assert found.columns["a"] == pytest.approx(np.pi * t)
    assert found.columns["T"] == pytest.approx(t + 273.15)
    assert found.columns["x.y"] is run.columns["fmu.x.y"]
    assert found.units == {"a": "rad", "T": "K", "x.y": "m", "own": "mine"}
    assert (found.incomplete, found.messages) == ("why", ("note",))


def test_a_measured_output_must_be_of_the_quantity_that_the_output_gives() -> None:
    t = np.arange(3.0)
    record = Record("one", t, {"x": t, "F": t}, {"x": "rad", "F": "N"})
    check_measured(record, {"x": "rad", "F": "1", "other": "m"})
    with pytest.raises(InputError, match="channel 'F' in N -- expected a unit such as m"):
        check_measured(record, {"x": "rad", "F": "m"})


def test_a_simulation_that_ended_early_is_compared_as_far_as_it_went() -> None:
    t = 0.1 * np.arange(6)
    record = Record("one", t, {"x": t}, {"x": "rad"})
    early = agreement(t[:4], {"x": t[:4] + np.array([0.0, 0.0, 0.0, 0.2]), "y": t[:4]}, record)
    assert list(early) == ["x"]
    assert early["x"].rmse == pytest.approx(0.1)
    assert early["x"].samples == 4
    with pytest.raises(InputError, match="4 simulated rows for 6 of one, at other times"):
        agreement(t[1:5], {"x": t[:4]}, record)


@pytest.mark.parametrize(
    ("start", "stop", "step", "steps"),
    [(0.0, 1.0, 0.1, 10), (1.5, 2.0, 0.5, 1), (-1.0, 0.0, 0.25, 4), (0.0, 1.0 + 0.9e-7, 0.1, 10),
     (0.0, 1e8, 1.0, 10**8)],
)  # fmt: skip
def test_a_run_is_a_whole_number_of_steps(start: float, stop: float, step: float, steps: int) -> None:
    assert number_of_steps(start, stop, step) == steps


@pytest.mark.parametrize(
    ("start", "stop", "step", "message"),
    [
        (0.0, 1.0 + 1.1e-7, 0.1, "expected a whole number of steps -- set for example stop 1 s"),
        (0.0, 0.04, 0.1, "expected a whole number of steps -- set for example stop 0.1 s"),
        (2.0, 2.04, 0.1, "set for example stop 2.1 s"),
        (0.0, 1.01e8, 1.0, "expected at most 1e+08 steps"),
        (1.0, 1.0, 0.1, "expected start < stop and step > 0"),
        (1.0, 2.0, 0.0, "expected start < stop and step > 0"),
        (1.0, np.inf, 0.1, "expected start < stop and step > 0"),
        (-np.inf, 1.0, 0.1, "expected start < stop and step > 0"),
        (0.0, 1.0, np.nan, "expected start < stop and step > 0"),
    ],
)
def test_times_that_do_not_fit_are_refused(start: float, stop: float, step: float, message: str) -> None:
    with pytest.raises(InputError) as wrong:
        number_of_steps(start, stop, step)
    assert message in str(wrong.value)


class Rows:
    def __init__(self) -> None:
        self.times: list[float] = []
        self.notes: list[str] = []

    def store(self, time: float) -> None:
        self.times.append(time)

    def note(self, text: str) -> None:
        self.notes.append(text)


@pytest.mark.parametrize(
    ("reached", "running", "stored"),
    [(2.0, 3, [2.0]), (1.75, 3, []), (1.75, 1, [1.75]), (2.0 + 1e-9, 3, [2.0]), (2.0 - 4e-9, 3, [])],
)
def test_the_last_row_is_that_of_the_end_of_a_step_or_of_a_unit_alone(
    reached: float, running: int, stored: list[float]
) -> None:
    rows: Any = Rows()
    ended: Any = [
        SimpleNamespace(name=n, description=SimpleNamespace(path=SimpleNamespace(name=f"{n}.fmu")), ended_at=at)
        for n, at in (("a", 5.0), ("b", reached))
    ]
    _store_end(rows, ended, running, 2.0)
    assert rows.times == stored
    assert rows.notes == [f"FMU {n} ({n}.fmu) ended the run at t = {reached:g} s" for n in "ab"]


def test_a_loop_is_said_with_where_it_is_late() -> None:
    links = tuple(Link(("a", "y"), (n, "u"), "Real", 1.0, 0.0) for n in "bc")
    loop = AlgebraicLoop((("a", "y"), ("b", "u"), ("a", "y")), ("a", "b"), links)
    assert _loop_note(loop, "iterate") == "algebraic loop a.y -> b.u -> a.y: iterated in each step"
    assert _loop_note(loop, "delay") == "algebraic loop a.y -> b.u -> a.y: one step late at b.u, c.u"


@pytest.mark.parametrize(
    ("begin", "first"), [(0.0, 0), (1.0, 2), (1.0 + 0.4e-9, 2), (1.0 + 0.6e-9, 3), (3.0, 0), (9.0, 0)]
)
def test_a_window_begins_where_it_is_asked_to_or_with_the_run_if_that_ends_before(begin: float, first: int) -> None:
    time = 0.5 * np.arange(7)
    assert np.flatnonzero(Experiment(3.0, 0.5, evaluate_from=begin).window(time)).tolist() == list(range(first, 7))
