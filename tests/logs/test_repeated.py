"""Rows that a logger wrote again: found where the drive moved on, not where a coarse log rests."""

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.checking import check_record
from tsm_fmu.logs.record import Record
from tsm_fmu.logs.repeated import repeated_rows, without_repeated_rows

RATE = 173.0
UNITS = {"x_in": "rad", "tau_in": "N.m"}


def log(step: float = 3.1e-4, noise: float = 0.004, samples: int = 4000) -> dict[str, np.ndarray]:
    """A rest, two sines and a stop, read in steps; a torque with noise, read in steps of its own."""
    t = np.arange(samples) / RATE
    moving = np.clip(t - 1.3, 0.0, 17.9)
    x = 0.9 * np.sin(1.7 * moving) + 0.31 * np.sin(4.9 * moving)
    tau = np.tanh(np.gradient(x, t) / 0.05) + noise * np.random.default_rng(53).standard_normal(samples)
    return {"x_in": step * np.round(x / step), "tau_in": 2e-3 * np.round(tau / 2e-3)}


def record(columns: dict[str, np.ndarray]) -> Record:
    return Record("r", np.arange(next(iter(columns.values())).size) / RATE, columns, UNITS)


def frozen(columns: dict[str, np.ndarray], *stretches: tuple[int, int]) -> dict[str, np.ndarray]:
    """Samples ``first`` to ``last`` hold what the one before them is."""
    found = {name: x.copy() for name, x in columns.items()}
    for x in found.values():
        for first, last in stretches:
            x[first : last + 1] = x[first - 1]
    return found


@pytest.mark.parametrize(("first", "count"), [(700, 9), (1313, 17), (1990, 40)])
def test_a_logger_that_stands_while_the_drive_moves_is_found(first: int, count: int) -> None:
    assert repeated_rows(record(frozen(log(), (first, first + count - 1)))) == [(first, first + count - 1)]


@pytest.mark.parametrize(("step", "noise"), [(3.1e-4, 0.004), (0.02, 0.0), (0.1, 0.0), (3.1e-4, 0.0)])
def test_rests_and_coarse_sensors_are_no_such_rows(step: float, noise: float) -> None:
    assert repeated_rows(record(log(step, noise))) == []


def test_a_load_that_jumps_at_a_rest_is_no_such_row() -> None:
    columns = log(noise=0.0)
    columns["tau_in"] = columns["tau_in"] + np.where(np.arange(4000) > 3700, 0.4, 0.0)
    assert repeated_rows(record(columns)) == []


def test_one_column_may_stand() -> None:
    columns = frozen(log(), (1313, 1329))
    assert repeated_rows(Record("r", np.arange(4000) / RATE, {"x_in": columns["x_in"]}, {"x_in": "rad"})) == []
    assert repeated_rows(record(columns | {"tau_in": log()["tau_in"]})) == []


def test_without_them_a_log_has_gaps_and_rows_stay_those_of_the_file() -> None:
    whole = record(frozen(log(), (700, 708), (1313, 1329)))
    (left,), _ = without_repeated_rows([whole])
    assert left.time.size == 4000 - 26
    assert not repeated_rows(left)
    assert [left.row(k) for k in (0, 699, 700, 1303, 1304)] == [2, 701, 711, 1314, 1332]
    assert [left.window(stop=30.0).row(k) for k in (699, 700)] == [701, 711]
    later = left.window(709 / RATE - 1e-9)
    assert [later.row(k) for k in (0, 603, 604)] == [711, 1314, 1332]
    (same,), _ = without_repeated_rows([record(log())])
    assert same.time.size == 4000


def test_the_check_says_it_and_no_jump_beside_it() -> None:
    found = check_record(record(frozen(log(), (1313, 1329)))).findings
    (one,) = [f for f in found if f.kind == "repeated"]
    assert one.rows == (1315, 1331)
    assert f"from {1313 / RATE:.3f} to {1329 / RATE:.3f} s (rows 1315 to 1331)" in one.text
    assert not [f for f in found if f.kind in ("jump", "glitch", "disturbance")]


def test_fits_and_diagnoses_leave_them_out_and_say_so() -> None:
    """By the rows of the file; what is left is compared."""
    clean = log(noise=0.001)
    clean["x_out"] = 0.93 * clean["x_in"] + 0.021 + 0.001 * np.random.default_rng(59).standard_normal(4000)
    columns = {name: clean[name] for name in ("x_in", "x_out")}
    time = np.arange(4000) / RATE
    units = {"x_in": "rad", "x_out": "rad"}
    whole, marred = (Record("r", time, one, units) for one in (columns, frozen(columns, (700, 708), (1313, 1353))))
    fits = [tsm.identify("PairedTsmBacklash", [one]) for one in (whole, marred)]
    said = "r: rows 702 to 710, 1315 to 1355 repeat the one before them in every column and are left out"
    assert said in fits[1].notes
    assert not any("repeat" in note for note in fits[0].notes)
    assert [one.records[0].time.size for one in fits] == [4000, 4000 - 50]
    assert [one.runs[0].targets.shape[0] for one in fits] == [4000, 4000 - 50]
    found = tsm.diagnose("PairedTsmBacklash", [marred])
    assert said in found.notes
