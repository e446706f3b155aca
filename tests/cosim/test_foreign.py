"""Other people's FMUs: start values, arrays, Booleans, ends that they ask for; nothing is lost or silent."""

import json
import re
import zipfile

import fmpy
import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cli.app import run as tsm_fmu
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.master import METHODS, simulate_system
from tsm_fmu.cosim.replay import agreement, replay
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System, check_system
from tsm_fmu.cosim.trajectory import SimulationStopped
from tsm_fmu.logs.record import Record, read_record


def alone(fmu, **values):
    return System((Component("one", fmu, values),), ())


def test_start_values_survive_a_unit_that_resets_them_when_the_experiment_is_set_up(in_c):
    run = simulate_system(alone(in_c["moody"], k=-2.75, u=1.5), 0.03, 0.01)
    assert run.columns["one.y"].tolist()[1:] == [-2.75 * 1.5] * 3
    record = Record("r", np.arange(3) * 0.01, {"u": np.array([0.5, 1.5, -2.0])}, {"u": "1"})
    replayed = replay(in_c["moody"], record, parameters={"k": "3.25"})
    assert replayed.columns["y"].tolist()[1:] == [3.25 * 1.5, 3.25 * -2.0]


def test_start_values_are_those_of_fmpy(in_c):
    theirs = fmpy.simulate_fmu(
        str(in_c["moody"]), stop_time=0.05, step_size=0.01, output_interval=0.01, start_values={"k": 4.5, "u": -0.3}
    )
    ours = simulate_system(alone(in_c["moody"], k=4.5, u=-0.3), 0.05, 0.01)
    assert ours.columns["one.y"].tolist() == theirs["y"].tolist()


def test_a_boolean_output_gets_its_statistics_and_a_report(in_c, tmp_path, capsys):
    system = alone(in_c["moody"], u=0.7)
    path = write_ssp(tmp_path / "moody.ssp", (system, Experiment(stop=0.1, step=0.01)))
    assert tsm_fmu(["run", str(path), "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["metrics"]["system"]["signals"]["one.positive"]
    assert found["mean"] == pytest.approx(10 / 11)  # false in the first row only
    assert found["peak_to_peak"] == 1.0


def test_arrays_are_recorded_by_element_and_what_is_no_number_is_said(in_c):
    run = simulate_system(alone(in_c["arrays"], gain="1.5 -2.5", u="0.5 0.25 -1.5"), 0.03, 0.01)
    expected = np.outer([1.5, -2.5], [0.5, 0.25, -1.5])
    for i in range(2):
        for j in range(3):
            assert run.columns[f"one.Y[{i + 1},{j + 1}]"].tolist() == [expected[i, j]] * 4
    assert run.columns["one.n"].tolist() == [0, 1, 2, 3]
    assert run.columns["one.odd"].tolist() == [False, True, False, True]
    assert set(run.columns) == {f"one.Y[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)} | {"one.n", "one.odd"}
    assert run.messages == (
        "one.picture is not recorded: Binary, and the table holds numbers",
        "one.words is not recorded: String, and the table holds numbers",
    )


def test_a_table_of_arrays_can_be_read_again(in_c, tmp_path, capsys):
    system = alone(in_c["arrays"], u="0.5 0.25 -1.5")
    path = write_ssp(tmp_path / "a.ssp", (system, Experiment(stop=0.1, step=0.01)))
    assert tsm_fmu(["run", str(path), "--out", str(tmp_path / "out"), "--set", "one.u[2]=-0.75"]) == 0
    assert "one.picture is not recorded: Binary" in capsys.readouterr().err
    again = read_record(tmp_path / "out" / "results.csv")
    assert again.columns["one.Y[2,2]"].tolist() == [-1.5] * 11


def test_arrays_and_elements_connect(in_c, foreign):
    system = System(
        (
            Component("x", foreign["integrator"], {"u": 2.0, "x_0": 0.125}),
            Component("a", in_c["arrays"], {"u": 0.0, "gain[2]": -3.0}),
        ),
        (Connection("x.x", "a.u[3]"),),
    )
    run = simulate_system(system, 0.04, 0.01)
    assert run.columns["a.Y[1,3]"] == pytest.approx(0.125 + 0.02 * np.arange(5), rel=1e-14)
    assert run.columns["a.Y[2,3]"] == pytest.approx(-3.0 * run.columns["a.Y[1,3]"], rel=1e-14)
    assert run.columns["a.Y[2,2]"].tolist() == [0.0] * 5


@pytest.mark.parametrize(
    ("values", "connections", "message"),
    [
        ({"u": "1 2"}, (), "start value one.u = '1 2' has 2 numbers -- expected 3, one for each of u[1] to u[3]"),
        ({"u": "1 2 fast"}, (), "start value one.u[3] = 'fast' -- expected a finite number"),
        ({"size": 4, "u": 0}, (), "start value one.size = 4 changes the size of arrays -- expected its default 3"),
        ({}, (("one.Y", "one.u"),), "connection one.Y -> one.u joins 6 to 3 elements"),
        ({}, (("one.Y[3,1]", "one.u[1]"),), "arrays.fmu has no variable 'Y[3,1]' -- expected one of Y, n, odd"),
        ({"u[1]": 0.0}, (), "inputs one.u[2], one.u[3] not connected"),
    ],
)
def test_arrays_that_do_not_fit_are_named(in_c, values, connections, message):
    system = System((Component("one", in_c["arrays"], values),), tuple(Connection(*c) for c in connections))
    with pytest.raises(InputError, match=re.escape(message)):
        check_system(system)


@pytest.mark.parametrize("method", METHODS)
def test_an_fmu_may_end_the_simulation_and_the_rows_stay(in_c, method):
    """FMI 2.0: a discarded step with fmi2Terminated, the end inside the step; as FMPy does."""
    values = {"mood": 1, "t_end": 0.037, "u": 1.25}
    run = simulate_system(alone(in_c["moody"], **values), 0.1, 0.01, method=method)
    theirs = fmpy.simulate_fmu(
        str(in_c["moody"]), stop_time=0.1, step_size=0.01, output_interval=0.01, start_values=values
    )
    assert run.time == pytest.approx(theirs["time"], abs=1e-15)
    assert run.columns["one.y"].tolist() == theirs["y"].tolist() == [0.0, 1.25, 1.25, 1.25, -7.25]
    assert run.incomplete == ""
    assert run.messages == ("FMU one (moody.fmu) ended the run at t = 0.037 s",)


def test_an_fmi_3_unit_ends_the_simulation_with_the_step_it_has_done(in_c):
    run = simulate_system(alone(in_c["arrays"], u=0.0, t_end=0.05), 0.1, 0.01)
    assert run.columns["one.n"].tolist() == [0, 1, 2, 3, 4, 5]
    assert run.messages[-1] == "FMU one (arrays.fmu) ended the run at t = 0.05 s"


def test_a_replay_that_the_fmu_ends_is_compared_as_far_as_it_went(in_c):
    time = np.arange(11) * 0.01
    record = Record("r", time, {"u": np.cos(time), "y": np.full(11, 2.0)}, {"u": "1", "y": "1"})
    run = replay(in_c["moody"], record, parameters={"mood": 1, "t_end": 0.055, "k": 2.0})
    assert run.time.tolist() == time[:6].tolist()
    found = agreement(run.time, run.columns, record)["y"]
    errors = np.append(0.0, 2.0 * np.cos(time[1:6])) - 2.0
    assert found.rmse == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-12)


def test_a_discarded_step_without_that_request_is_a_failure(in_c):
    with pytest.raises(SimulationStopped, match=r"^FMU one \(moody\.fmu\) returned Discard from doStep at t = 0\.05 s"):
        simulate_system(alone(in_c["moody"], mood=2, t_end=0.055, u=0.0), 0.1, 0.01)


@pytest.mark.parametrize("library", ["../../../../outside", "/lib/libm", "a/b", "..", ""])
def test_a_library_from_outside_the_archive_is_refused(in_c, tmp_path, library):
    climbing = tmp_path / "climbing.fmu"
    with zipfile.ZipFile(in_c["moody"]) as old, zipfile.ZipFile(climbing, "w") as new:
        text = old.read("modelDescription.xml").decode()
        new.writestr("modelDescription.xml", text.replace('modelIdentifier="moody"', f'modelIdentifier="{library}"'))
    with pytest.raises(InputError, match=rf"has the modelIdentifier '{library}' -- expected a plain name"):
        describe(climbing)
