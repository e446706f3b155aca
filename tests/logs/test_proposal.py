"""The proposal of a log.toml: what is said, what is guessed, what is left to the user."""

import tomllib

import numpy as np
import pytest

from tsm_fmu.cli.app import run
from tsm_fmu.logs.record import read_record
from tsm_fmu.verbs.check import propose


@pytest.fixture
def own(tmp_path):
    t = np.arange(400) / 250.0
    x = 31.0 * np.sin(7.1 * t)
    noise = np.random.default_rng(5).standard_normal(t.size)
    rows = zip(t, x, np.rint(-11.0 * x + noise), 0.3 * np.cos(7.1 * t), 20.0 + 0.1 * noise, strict=True)
    head = "time_s;angle_motor_deg;counts;motor_torque_Nm;ambient\n"
    (tmp_path / "own.csv").write_text(head + "".join(";".join(f"{v:.4f}" for v in row) + "\n" for row in rows))
    return tmp_path / "own.csv"


def test_names_units_and_correlations_give_a_file_that_the_reader_takes(own, capsys):
    out = own.parent / "log.toml"
    assert run(["check", str(own), "--model", "TendonDrive", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert out.read_text() == text
    assert tomllib.loads(text)["map"] == {
        "time_s": "time [s]", "angle_motor_deg": "x_in [deg]", "motor_torque_Nm": "tau_in [Nm]",
    }  # fmt: skip
    counts = next(line for line in text.splitlines() if "counts" in line)
    assert counts.startswith("#")
    assert "x_out [UNIT]" in counts
    assert "correlation 1.00" in counts
    assert "# x_out = -1  # a guess" in text
    assert "# ambient: not known, left out" in text
    assert text.count("a guess") >= 5
    record = read_record(own)
    assert dict(record.units) == {"x_in": "rad", "tau_in": "N.m"}
    assert run(["check", str(own), "--model", "TendonDrive", "--out", str(out)]) == 2
    assert run(["check", str(own), "--out", str(out)]) == 2
    assert run(["check", str(own), "--model", "NoSuch"]) == 2


def test_a_log_that_says_all_leaves_nothing_to_guess(tmp_path, capsys):
    path = tmp_path / "own.csv"
    path.write_text("time [s],x_in [deg],x_out [rad]\n0,1,1\n1,3,2\n2,2,4\n")
    assert run(["check", str(path), "--model", "TendonDrive"]) == 0
    said = capsys.readouterr().out
    assert "a guess:" not in said
    assert said.count("the log says so") == 3


@pytest.mark.parametrize(
    ("head", "model", "expected"),
    [
        ("time [s],motor_angle [deg],load_angle [deg]", "PairedTsmBacklash", ("x_in", "x_out")),
        ("Zeit [s],Lastwinkel [°],Motorwinkel [°]", "PairedTsmBacklash", ("x_out", "x_in")),
        ("Zeit [s],Antriebslage [rad],abtrieb_winkel [rad]", "TendonDrive", ("x_in", "x_out")),
        ("t [s],motorAngle [deg],loadTorque [N.m]", "LebusTransmission", ("theta_in", "tau_load")),
        ("t [s],encoder [deg],x_h [deg]", "PairedTsmBacklash", ("x_in", "x_h")),
        ("t [s],velocity [m/s],load cell [N]", "LuGreFriction", ("v", "F")),
    ],
)  # fmt: skip
def test_words_of_the_lab_find_their_variable(tmp_path, head, model, expected):
    path = tmp_path / "own.csv"
    t = np.arange(50) / 50.0
    rows = zip(t, np.sin(7.1 * t), np.cos(11.3 * t), strict=True)
    path.write_text(head + "\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in rows))
    found = propose(path, model)
    names = {guess.column: guess.name for guess in found.guesses}
    assert tuple(names.get(cell.partition(" [")[0]) for cell in head.split(",")) == ("time", *expected)
