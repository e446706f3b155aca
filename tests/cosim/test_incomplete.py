"""What is left on disk when a run fails: the rows that were computed, and nothing where none was."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.cases import run_cases
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Experiment, System
from tsm_fmu.cosim.trajectory import SimulationStopped
from tsm_fmu.logs.record import read_record, write_record

TIMING = Experiment(stop=0.3, step=0.01)


def belt(foreign, t_fail, experiment=TIMING):
    return System((Component("belt", foreign["failing"], {"mode": 1, "t_fail": t_fail}),), ()), experiment


@pytest.mark.parametrize(("t_fail", "rows"), [(0.0, 0), (0.01, 2), (0.17, 18)])
def test_run_and_simulate_keep_computed_rows_only(foreign, tmp_path, capsys, t_fail, rows):
    log = write_record(tmp_path / "log.csv", np.arange(31) * 0.01, {"other": np.zeros(31)}, {"other": "N"})
    system = write_ssp(tmp_path / "belt.ssp", belt(foreign, t_fail))
    replayed = [
        "simulate",
        str(foreign["failing"]),
        "--input",
        str(log),
        "--set",
        "mode=1",
        "--set",
        f"t_fail={t_fail}",
    ]
    for arguments in (
        ["run", str(system), "--out", str(tmp_path)],
        [*replayed, "--out", str(tmp_path / "results.csv")],
    ):
        kept = tmp_path / "results.incomplete.csv"
        kept.unlink(missing_ok=True)
        assert run(arguments) == 2
        said = capsys.readouterr().err
        assert f"returned Discard from doStep at t = {t_fail:g} s: the belt slipped" in said
        assert (f"; {rows} rows kept in {kept}" in said) == (rows > 0)
        assert kept.exists() == (rows > 0)
        if rows:
            assert read_record(kept).time.size == rows
        assert not (tmp_path / "results.csv").exists()


def test_cases_before_one_that_never_begins_are_kept_whole(foreign):
    cases = {"a": belt(foreign, 9.0), "b": belt(foreign, 0.0)}
    with pytest.raises(SimulationStopped, match=r"^case b: FMU belt .* at t = 0 s: the belt slipped") as caught:
        run_cases(cases)
    kept = caught.value.trajectory
    assert kept.incomplete.startswith("FMU belt")
    assert [column.tolist() for column in kept.columns.values()] == [list(range(31))]


def test_cases_for_one_table_must_share_their_times(foreign):
    cases = {"a": belt(foreign, 9.0), "b": belt(foreign, 9.0, replace(TIMING, step=0.05))}
    expected = "case b starts at 0 s with step 0.05 s, case a at 0 s with step 0.01 s -- expected the same in one table"
    with pytest.raises(InputError, match=re.escape(expected)):
        run_cases(cases)


def test_a_tracking_error_must_be_an_angle(foreign):
    cases = {"seen": (System((Component("u", foreign["units"]),), ()), replace(TIMING, tracking_error="u.temperature"))}
    with pytest.raises(InputError, match=r"tracking error u\.temperature of case seen is in degC -- expected rad"):
        run_cases(cases)
