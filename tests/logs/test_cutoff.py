"""``--cutoff`` is never without effect in silence: every verb that reads it says when nothing is derived."""

import json

import numpy as np
import pytest

import tsm_fmu
from tsm_fmu.cli.app import run
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.differentiate import differentiate
from tsm_fmu.logs.record import read_record, write_record

UNUSED = "--cutoff 17 Hz is not used: the log has x, v, a, tau_in, tau_load itself, nothing is derived"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """The same motion with and without speed and acceleration in the log; friction from a closed form."""
    folder = tmp_path_factory.mktemp("logs")
    time = np.arange(700) * 0.0071
    w = 2.0 * np.pi * 0.37
    x, v, a = 0.83 * np.sin(w * time), 0.83 * w * np.cos(w * time), -0.83 * w**2 * np.sin(w * time)
    torque = 0.021 * np.tanh(9.0 * v) + 0.0013 * v
    columns = {"x": x, "tau_in": 0.31 + torque, "tau_load": np.full(time.size, 0.31), "tau_drive": 0.31 + torque}
    units = {"x": "rad", "tau_in": "N.m", "tau_load": "N.m", "tau_drive": "N.m", "v": "rad/s", "a": "rad/s2"}
    write_record(folder / "bare.csv", time, columns, units)
    whole = {**columns, "v": v, "a": a}
    write_record(folder / "whole.csv", time, whole, units)
    write_record(folder / "short.csv", time[:150], {name: column[:150] for name, column in whole.items()}, units)
    write_record(folder / "still.csv", time, {"tau_in": torque}, units)
    return folder


def simulate(folder, log):
    out = folder / "out.csv"
    return run(["simulate", "PairedTsmFriction", "--input", str(folder / log), "--out", str(out), "--cutoff", "17"])


def test_simulate(logs, capsys):
    assert simulate(logs, "whole.csv") == 0
    assert capsys.readouterr().err == UNUSED + "\n"
    assert simulate(logs, "bare.csv") == 0
    said = capsys.readouterr().err
    assert "v derived from x by a zero-phase Savitzky-Golay differentiator" in said
    assert "not used" not in said


def test_a_model_without_speed_inputs(logs, capsys):
    arguments = ["simulate", "PairedTsmBacklash", "--map", "x=x_in", "--input", str(logs / "bare.csv")]
    assert run([*arguments, "--out", str(logs / "out.csv"), "--cutoff", "17"]) == 0
    assert capsys.readouterr().err == "--cutoff 17 Hz is not used: the log has x_in itself, nothing is derived\n"


def test_identify(logs, capsys):
    def notes(*runs):
        measured = [argument for name in runs for argument in ("--measured", str(logs / name))]
        fixed = [a for p in ("rho", "lambda", "sigma", "n", "k_zeta", "upsilon", "k_x", "R") for a in ("--fix", p)]
        arguments = ["PairedTsmFriction", *measured, *fixed, "--out", str(logs / "card.toml"), "--cutoff", "17"]
        assert run(["identify", *arguments, "--json"]) == 0
        return json.loads(capsys.readouterr().out)["notes"]

    assert notes("whole.csv") == [UNUSED]
    assert UNUSED not in notes("whole.csv", "bare.csv")


def test_diagnose(logs, capsys):  # of a log too short for an answer
    arguments = ["PairedTsmFriction", "--measured", str(logs / "short.csv"), "--out", str(logs / "diagnosis")]
    assert run(["diagnose", *arguments, "--cutoff", "17", "--json"]) == 0
    assert UNUSED in json.loads(capsys.readouterr().out)["notes"]


def test_check(logs, capsys):
    assert run(["check", str(logs / "still.csv"), "--cutoff", "17"]) == 0
    assert capsys.readouterr().err == "--cutoff 17 Hz is not used: no position in still moves\n"
    assert run(["check", str(logs / "bare.csv"), "--cutoff", "17"]) == 0
    assert capsys.readouterr().err == ""


WIDE, NARROW = 110.0, 17.0


@pytest.fixture(scope="module")
def viscous(tmp_path_factory):
    """Position sin(w t) at the frequency where a cut-off of 17 Hz leaves 3 dB less, and F = 0.37 w cos(w t)."""
    time = np.arange(6001) / 1000.0
    w = 2.0 * np.pi * differentiate(time, np.sin(time), 1, NARROW).cutoff
    force = 0.37 * w * np.cos(w * time)
    path = tmp_path_factory.mktemp("viscous") / "viscous.csv"
    return write_record(path, time, {"x": np.sin(w * time), "F": force}, {"x": "m", "F": "N"})


ONLY_VISCOUS = {"F_c": 1e-9, "F_s": 1e-9, "sigma1": 0.0}


@pytest.mark.parametrize(("cutoff", "gain"), [(NARROW, np.sqrt(0.5)), (WIDE, 1.0)])
def test_the_cutoff_and_a_value_over_a_preset_act_in_simulate_and_identify(viscous, cutoff, gain):
    """Of viscous friction alone F = sigma2 v: what the cut-off takes from v is taken from F, or given to sigma2."""
    (record,) = (read_record(viscous),)
    inner, measured = slice(1000, -1000), record.columns["F"]
    found = tsm_fmu.simulate("LuGreFriction:published", record, values={**ONLY_VISCOUS, "sigma2": 0.37}, cutoff=cutoff)
    force = found.trajectory.columns["F"]
    assert force[inner] @ measured[inner] / (measured[inner] @ measured[inner]) == pytest.approx(gain, abs=0.01)
    fixed = [v.name for v in kernel("LuGreFriction").parameters if v.name != "sigma2"]
    fitted = tsm_fmu.identify("LuGreFriction:published", [record], values=ONLY_VISCOUS, fixed=fixed, cutoff=cutoff)
    assert fitted.as_json()["parameters"]["sigma2"]["value"] == pytest.approx(0.37 / gain, rel=0.03)  # ends of the run


@pytest.mark.parametrize("cutoff", [9.0, NARROW])
def test_the_cutoff_is_the_one_that_check_and_diagnose_derive_with(logs, cutoff):
    one = read_record(logs / "bare.csv")
    motion = tsm_fmu.check([one], cutoff=cutoff).runs[0].motion
    assert motion.cutoff == pytest.approx(cutoff, rel=0.1)  # a window is of whole samples
    runs = prepared(kernel("PairedTsmFriction"), [one], [one], [one], cutoff)
    for one in (*runs.measured, *runs.reference, *runs.holdout):
        told = [float(note.partition("cut-off ")[2].split()[0]) for note in one.derived]
        assert told == [pytest.approx(cutoff, rel=0.15)] * 2  # v and a
