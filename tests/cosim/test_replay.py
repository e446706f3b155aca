"""Replay of a record through an FMU that is not ours."""

import re

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim.replay import agreement, replay
from tsm_fmu.cosim.trajectory import SimulationStopped
from tsm_fmu.logs.record import Record


def run(time, **columns):
    units = {name: unit for name, (unit, _) in columns.items()}
    return Record("run", np.asarray(time), {n: values for n, (_, values) in columns.items()}, units)


def test_row_k_of_the_inputs_gives_row_k_of_the_outputs(foreign):
    time = np.array([0.5, 0.6, 0.75, 0.8, 1.1])
    u = np.array([0.3, -0.7, 1.9, 0.2, -1.1])
    result = replay(foreign["gain"], run(time, u=("1", u)), parameters={"k": 2.5, "u_2": 0.25})
    assert result.time.tolist() == time.tolist()
    assert result.columns["y"] == pytest.approx(2.5 * u + 0.25, rel=1e-15)


def test_uneven_steps_are_handed_on_as_they_are(foreign):
    time = np.array([0.5, 0.6, 0.75, 0.8, 1.1])
    u = np.array([0.3, -0.7, 1.9, 0.2, -1.1])
    result = replay(foreign["integrator"], run(time, u=("1", u)), parameters={"x_0": 4.2})
    assert result.columns["x"] == pytest.approx(4.2 + np.append(0.0, np.cumsum(u[1:] * np.diff(time))), rel=1e-14)


def test_si_values_reach_the_fmu_in_its_own_units(foreign):
    time = np.linspace(0.0, 0.4, 5)
    record = run(
        time,
        angle=("rad", np.linspace(0.1, 0.9, 5)),
        speed=("rad/s", np.full(5, 10.471975511965978)),
        kelvin=("K", np.full(5, 300.0)),
    )
    result = replay(foreign["units"], record)
    assert result.columns["angle_seen"] == pytest.approx(np.degrees(record.columns["angle"]), rel=1e-14)
    assert result.columns["speed_seen"] == pytest.approx([100.0] * 5, rel=1e-14)
    assert result.columns["temperature"] == pytest.approx([293.65] * 5, rel=1e-14)
    assert result.units["temperature"] == "K"


def test_a_missing_input_is_named(foreign):
    record = run([0.0, 0.1, 0.2], u=("1", np.zeros(3)))
    with pytest.raises(InputError, match=r"run has no channel 'u_2' -- it has u"):
        replay(foreign["gain"], record)


def test_an_input_in_another_quantity_is_named(foreign):
    zeros = np.zeros(3)
    record = run([0.0, 0.1, 0.2], angle=("N", zeros), speed=("rad/s", zeros), kelvin=("K", zeros))
    with pytest.raises(InputError, match=r"channel 'angle' in N -- expected a unit such as deg"):
        replay(foreign["units"], record)


def test_a_measured_output_in_another_quantity_is_found_before_the_fmu_is_loaded(foreign, monkeypatch):
    monkeypatch.setattr("tsm_fmu.cosim.replay.FmuInstance", None)
    time = np.arange(31) * 0.01
    inputs = {"angle": ("deg", time), "speed": ("rad/s", time), "kelvin": ("K", time)}
    with pytest.raises(InputError, match=r"channel 'temperature' in m -- expected a unit such as K"):
        replay(foreign["units"], run(time, **inputs, temperature=("m", time)))


def test_what_is_derived_and_a_cutoff_without_use_are_said(foreign):
    time = np.arange(200) * 0.01
    plain = replay(foreign["gain"], run(time, u=("1", time), u_2=("1", time)), cutoff=7.0)
    assert plain.messages == ("--cutoff 7 Hz is not used: the log has u, u_2 itself, nothing is derived",)


def test_inputs_that_are_not_real_need_a_constant(foreign):
    record = run([0.0, 0.1, 0.2], n=("1", np.zeros(3)))
    with pytest.raises(InputError, match=r"input n of Typed\.fmu is Integer -- expected Real .* --set n="):
        replay(foreign["typed"], record)


def test_an_fmu_with_fixed_steps_refuses_uneven_rows(foreign):
    given = {"n": 1, "flag": False, "text": "x"}
    even = replay(foreign["typed"], run(np.arange(4) * 0.1, other=("1", np.zeros(4))), parameters=given)
    assert even.columns["n_next"].tolist() == [0, 2, 2, 2]
    uneven = run([0.0, 0.1, 0.25, 0.3], other=("1", np.zeros(4)))
    with pytest.raises(InputError, match=re.escape("Typed.fmu needs equal steps, run has 0.15 s at t = 0.1 s")):
        replay(foreign["typed"], uneven, parameters=given)


def test_a_failing_replay_keeps_its_rows(foreign):
    record = run(np.arange(101) * 0.01, other=("1", np.zeros(101)))
    with pytest.raises(
        SimulationStopped, match=r"returned Discard from doStep at t = 0\.5 s: the belt slipped"
    ) as caught:
        replay(foreign["failing"], record, parameters={"mode": 1})
    assert caught.value.trajectory.columns["count"].tolist() == list(range(51))


def test_agreement_is_computed_as_defined():
    time = np.arange(4) * 0.1
    measured = np.array([0.1, 0.5, -0.3, 0.9])
    record = run(time, x_out=("rad", measured), tau=("N.m", np.full(4, 2.0)))
    error = np.array([0.02, -0.05, 0.01, 0.03])
    found = agreement(time, {"x_out": measured + error, "tau": np.full(4, 2.5), "other": measured}, record)
    assert set(found) == {"x_out", "tau"}
    assert found["x_out"].rmse == pytest.approx(np.sqrt((0.02**2 + 0.05**2 + 0.01**2 + 0.03**2) / 4.0))
    assert found["x_out"].peak_to_peak_error == pytest.approx(0.08)
    assert found["x_out"].nrmse == pytest.approx(found["x_out"].rmse / np.std([0.1, 0.5, -0.3, 0.9]))
    assert found["tau"].nrmse == np.inf


def test_a_channel_that_does_not_move_has_no_relative_error():
    time, still = np.arange(11) * 0.1, np.full(11, 0.37)
    assert np.std(still) > 0.0  # of equal values, by rounding
    found = agreement(time, {"tau": still + 0.01}, run(time, tau=("N.m", still)))
    assert found["tau"].nrmse == np.inf
