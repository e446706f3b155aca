"""``tsm-fmu run`` and ``tsm-fmu simulate`` on real FMUs: numbers, files, messages."""

import json
import re

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cli.app import run as tsm_fmu
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.order import schedule
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System, check_system
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import read_record, write_record


def inertia_loop(fmus, connections):
    return System(
        (
            Component("motor", fmus("DcMotor"), {"u": 1.7}),
            Component("inertia", fmus("Sum"), {"k1": 3e-4, "u2": 0.0, "u3": 0.0}),
        ),
        tuple(Connection(*c) for c in connections),
    )


def test_an_inertia_behind_the_motor_is_an_algebraic_loop_and_the_message_says_where_it_belongs(fmus):
    system = inertia_loop(fmus, [("motor.domega", "inertia.u1"), ("inertia.y", "motor.tau_load")])
    with pytest.raises(InputError) as caught:
        schedule(check_system(system))
    message = str(caught.value)
    for port in ("motor.domega", "inertia.u1", "inertia.y", "motor.tau_load"):
        assert port in message
    assert "an inertia that closes it belongs into the motor's J_load" in message


def test_a_damper_behind_the_motor_is_none(fmus):
    plan = schedule(check_system(inertia_loop(fmus, [("motor.omega", "inertia.u1"), ("inertia.y", "motor.tau_load")])))
    assert plan.components == ("motor", "inertia")


def test_a_wrong_parameter_is_reported_by_the_fmu_that_has_it_not_by_one_that_follows(fmus):
    system = System(
        (
            Component("backlash", fmus("PairedTsmBacklash"), {"alpha": -3.0, "x_in": 0.2}),
            Component("load", fmus("RotationalLoad")),
        ),
        (Connection("backlash.x_out", "load.phi"),),
    )
    with pytest.raises(InputError, match=r"^FMU backlash \(PairedTsmBacklash\.fmu\) has no finite .*alpha = -3\.0"):
        simulate_system(system, 0.1, 0.01)


@pytest.fixture(scope="module")
def scenario_run(tmp_path_factory):
    out = tmp_path_factory.mktemp("mssp")
    arguments = ["--case", "periodic.law_1", "--case", "periodic.uncompensated", "--stop", "1.5"]
    assert tsm_fmu(["run", "mssp_feedforward", *arguments, "--set", "load.k=0.07", "--out", str(out), "--json"]) == 0
    return out


def test_run_writes_results_report_and_systems_that_give_the_same_numbers_again(scenario_run, tmp_path, capsys):
    assert sorted(p.name for p in (scenario_run / "systems").iterdir()) == [
        "periodic_law_1.ssp",
        "periodic_uncompensated.ssp",
    ]
    again = ["run", str(scenario_run / "systems" / "periodic_law_1.ssp"), "--out", str(tmp_path), "--json"]
    assert tsm_fmu(again) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert "algebraic loop motor.domega -> friction.a" in captured.err
    first, second = (read_record(folder / "results.csv") for folder in (scenario_run, tmp_path))
    assert "periodic.law_1.compensator.x_ff" in first.columns
    for column, values in first.columns.items():
        if column.startswith("periodic.law_1."):
            assert np.array_equal(values, second.columns[column.removeprefix("periodic.law_1.")]), column
    assert {"metrics", "comparison", "results", "report"} <= set(found)
    error = np.degrees(second.columns["error.y"])
    tracking_error = found["metrics"]["periodic_law_1"]["tracking_error"]
    assert tracking_error["unit"] == "deg"
    assert tracking_error["peak_to_peak"] == pytest.approx(np.ptp(error), rel=1e-9)
    assert (scenario_run / "report.html").read_text().count("<h1") == 1
    assert (scenario_run / "results.csv").read_text().splitlines()[0].startswith("time [s],")


def test_run_prints_a_table_of_the_tracking_errors(tmp_path, capsys):
    arguments = ["run", "mssp_feedforward", "--case", "periodic.b065_law_1", "--stop", "0.3", "--out", str(tmp_path)]
    assert tsm_fmu(arguments) == 0
    printed = capsys.readouterr().out
    assert re.search(r"periodic\.b065_law_1: tracking error .* deg", printed)
    assert str(tmp_path / "report.html") in printed.replace("\n", "")


def test_set_reaches_the_component(scenario_run):
    run = read_record(scenario_run / "results.csv")
    tau, phi = run.columns["periodic.law_1.load.tau"], run.columns["periodic.law_1.backlash.x_out"]
    k, d = np.linalg.lstsq(np.column_stack([phi, np.gradient(phi, run.time)]), tau, rcond=None)[0]
    assert k == pytest.approx(0.07, rel=0.02)
    assert d == pytest.approx(0.001, rel=0.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nonsense"], "'nonsense' -- expected one of mssp_feedforward"),
        (["none.ssp"], "SSP none.ssp -- expected an existing .ssp file"),
        (["mssp_feedforward", "--case", "periodic"], "case 'periodic' -- expected one of periodic.law_1"),
        (["mssp_feedforward", "--set", "gearbox.n=3"], "'gearbox.n' -- expected component.variable with one of"),
        (["mssp_feedforward", "--set", "load=3"], "'load' in system"),
        (["mssp_feedforward", "--set", "load.mass=3"], "RotationalLoad.fmu has no such variable"),
        (
            ["mssp_feedforward", "--set", "load.k=soft"],
            "start value load.k = 'soft' -- expected a finite number [N.m/rad]",
        ),
        (["mssp_feedforward", "--step", "0.7"], "expected a whole number of steps"),
        (  # in a loop: what fails first is named, not the controller that gets its NaN
            ["mssp_feedforward", "--case", "periodic.law_1", "--set", "motor.R_a=-1"],
            "FMU motor (DcMotor.fmu) has no finite phi, omega, domega, i at t = 0 s: DcMotor: initialisation failed: "
            "parameter R_a = -1.0 ohm",
        ),
    ],
)
def test_wrong_use_of_run_is_one_line(arguments, message, tmp_path, capsys):
    assert tsm_fmu(["run", *arguments, "--out", str(tmp_path)]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.strip().count("\n") == 0
    assert captured.out == ""


def test_a_run_that_fails_in_its_first_step_leaves_no_results(fmus, tmp_path, capsys):
    """The velocity filter of the load is driven to a value that no float holds."""
    system = System(
        (
            Component("reference", fmus("ReferenceSignal"), {"amplitude_1": 1.1}),
            Component("boost", fmus("Sum"), {"k1": 1e200, "u2": 0.0, "u3": 0.0}),
            Component("load", fmus("RotationalLoad"), {"k": 1e150}),
        ),
        (Connection("reference.y", "boost.u1"), Connection("boost.y", "load.phi")),
    )
    path = write_ssp(tmp_path / "boost.ssp", (system, Experiment(1.0, 0.01)))
    assert tsm_fmu(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert re.search(r"FMU load \(RotationalLoad\.fmu\) returned Discard from doStep at t = 0 s", captured.err)
    assert "rows kept" not in captured.err
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Drive and distal angle in degrees, uneven in time, the distal side not from our model."""
    random = np.random.default_rng(8)
    time = np.cumsum(random.uniform(0.8e-3, 1.4e-3, 4000))
    x_in = 40.0 * np.sin(2.1 * time) + 11.0 * np.sin(5.3 * time + 0.4)
    x_out = 0.93 * x_in - 3.0 * np.tanh(4.0 * np.gradient(x_in, time)) + random.normal(0.0, 0.05, time.size)
    path = tmp_path_factory.mktemp("log") / "run.csv"
    return write_record(path, time, {"x_in": x_in, "x_out": x_out}, {"x_in": "deg", "x_out": "deg"})


@pytest.mark.parametrize("form", ["fmu", "model"])
def test_simulate_scores_against_the_log_as_its_contract_says(fmus, log, tmp_path, capsys, form):
    what = str(fmus("PairedTsmBacklash")) if form == "fmu" else "PairedTsmBacklash:published"
    out = tmp_path / "result.csv"
    assert tsm_fmu(["simulate", what, "--input", str(log), "--set", "beta=-0.3", "--out", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"channels", "steps", "wall_s"} <= set(found)
    assert found["steps"] == 3999
    channel = found["channels"]["x_out"]
    record, result = read_record(log), read_record(out)
    k = kernel("PairedTsmBacklash")
    y = k.simulate(k.params(values={"beta": -0.3}), record.time, record.columns["x_in"][:, None])
    assert np.abs(result.columns["x_out"] - y[:, 0]).max() <= 1e-15
    error = y[:, 0] - record.columns["x_out"]
    assert channel["unit"] == "rad"
    assert channel["rmse"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert channel["peak_to_peak_error"] == pytest.approx(np.ptp(error), rel=1e-12)
    assert channel["nrmse"] == pytest.approx(channel["rmse"] / np.std(record.columns["x_out"]), rel=1e-12)


@pytest.mark.parametrize(
    ("what", "extra", "message"),
    [
        ("PairedTsmBacklash:best", [], "preset 'best' of PairedTsmBacklash -- expected one of published"),
        ("Backlash", [], "model 'Backlash' -- expected one of"),
        ("none.fmu", [], "FMU none.fmu -- expected an existing .fmu file"),
        (
            "PairedTsmBacklash",
            ["--set", "gamma=3"],
            "parameter 'gamma' of PairedTsmBacklash -- expected one of c, beta",
        ),
        ("PairedTsmBacklash", ["--set", "c=wide"], "--set c=wide -- expected a finite number"),
        ("PairedTsmBacklash", ["--set", "alpha=-1"], "parameter alpha = -1.0 1/rad"),
        ("PairedTsmBacklash", ["--map", "x_in=y"], "has no channel 'x_in' -- it has y, x_out"),
        ("somewhere/card.json", [], "'somewhere/card.json' -- expected a file that ends in .fmu or .toml"),
    ],
)
def test_wrong_use_of_simulate_is_one_line(log, tmp_path, capsys, what, extra, message):
    assert tsm_fmu(["simulate", what, "--input", str(log), "--out", str(tmp_path / "r.csv"), *extra]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.strip().count("\n") == 0
    assert not (tmp_path / "r.csv").exists()
