"""``tsm-fmu run`` on the loop scenarios: JSON, results, report, and an .ssp that runs again."""

import json

import pandas as pd
import pytest

from tsm_fmu.cli.app import run

# scenario, case, stop, a quantity of that case and its unit, what the report is called
RUNS = [
    ("single_tsm_force", "bouc_wen.multi_periodic.lugre", "6", "error_rms", "N", "Distal tension"),
    ("lebus_drive", "m05_180.uncompensated", "20", "lost_motion", "mm", "LeBus"),
    ("single_tsm_drive", "08_hz.2_mm", "2", "followed", "mm", "Single tendon-sheath drive"),
    ("tendon_drive_loop", "motor.spring", "6", "work_lost", "J", "Tendon drive loop"),
    ("configuration_independence", "bends_apart", "7", "ratio_pull", "1", "Configuration independence"),
]


def metrics_of(capsys, *arguments):
    assert run(["run", *arguments, "--json"]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out)


@pytest.mark.parametrize(("scenario", "case", "stop", "quantity", "unit", "title"), RUNS)
def test_a_case_runs_and_its_ssp_runs_again(tmp_path, capsys, scenario, case, stop, quantity, unit, title):
    found = metrics_of(capsys, scenario, "--case", case, "--stop", stop, "--out", str(tmp_path / "first"))
    own = found["metrics"][case]
    assert isinstance(own["quantities"][quantity]["value"], float)
    assert own["quantities"][quantity]["unit"] == unit
    assert own["end"] == {"value": pytest.approx(float(stop)), "unit": "s"}
    report = (tmp_path / "first" / "report.html").read_text(encoding="utf-8")
    assert title in report
    assert case in report
    again = metrics_of(capsys, str(tmp_path / "first" / f"{scenario}.ssp"), "--out", str(tmp_path / "again"))
    first, second = (pd.read_csv(r["results"]).set_index("time [s]") for r in (found, again))
    assert len(first) > 100
    assert set(first) <= set(second)
    pd.testing.assert_frame_equal(first, second[list(first)], rtol=0, atol=0)


def test_a_lebus_run_that_ends_before_the_turn_has_no_way_back(tmp_path, capsys):
    found = metrics_of(capsys, "lebus_drive", "--case", "m10_180.hanging", "--stop", "5", "--out", str(tmp_path))
    assert "forward_max" in found["metrics"]["m10_180.hanging"]["quantities"]
    assert "reverse_max" not in found["metrics"]["m10_180.hanging"]["quantities"]


@pytest.mark.parametrize("scenario", [row[0] for row in RUNS])
def test_unknown_case_is_one_line(tmp_path, capsys, scenario):
    assert run(["run", scenario, "--case", "sideways", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err.strip()
    assert "case 'sideways'" in error
    assert "\n" not in error
