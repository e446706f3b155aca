"""Columns beyond the model's variables: what each may drive, and why it drives nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.next_motion import menu
from tsm_fmu.diagnosis.fits.placing import not_applicable, possible
from tsm_fmu.diagnosis.fits.refit import Task, refit
from tsm_fmu.diagnosis.runs.drivers import drives_of, with_drives
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError

T = np.arange(9) * 0.1
WITH = Record("with", T, {"x_in": T, "Theta": T}, {"x_in": "rad", "Theta": "rad"})
WITHOUT = Record("without", T, {"x_in": T}, {"x_in": "rad"})
GIVEN = {"sigma0": 120.0, "sigma1": 0.05, "sigma2": 0.11, "F_c": 0.7, "F_s": 0.7, "v_s": 0.3}
DT, ROWS = 0.01, 1800


def rig(seed: int, k: float) -> Record:
    """Dahl friction that grows by k of a tension, in a log with much else: nothing of the package makes it."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    waves = ((1.1, 0.13), (0.6, 0.37), (0.4, 1.3))
    v = np.sum([a * np.sin(2 * np.pi * f * t + rng.random() * 6.0) for a, f in waves], axis=0)
    tension = 2.3 + 1.1 * np.sin(2 * np.pi * 0.071 * t + 6.0 * rng.random())
    z = np.zeros(ROWS)
    for j in range(1, ROWS):
        s = np.sign(v[j])
        z[j] = s + (z[j - 1] - s) * np.exp(-abs(v[j]) * DT * 120.0 / 0.7)
    force = (0.7 + k * (tension - 2.3)) * z + 0.11 * v + 0.011 * rng.normal(size=ROWS)
    columns = {
        "v": v, "x": 0.31 + np.cumsum(v) * DT, "F": force, "T_in": tension,
        "F_lateral": 0.4 * np.sin(2 * np.pi * 0.23 * t + 6.0 * rng.random()) + 0.05 * rng.normal(size=ROWS),
        "i_motor": 0.31 * force + 0.01 * rng.normal(size=ROWS),
        "temperature": 295.0 + np.sin(0.05 * t), "voltage": 24.0 + rng.normal(size=ROWS),
    }  # fmt: skip
    units = {"v": "m/s", "x": "m", "F": "N", "T_in": "N", "F_lateral": "N", "i_motor": "A", "temperature": "K"}
    return Record(f"run {seed}", t, columns, {**units, "voltage": "V"})


def roles(records: list[Record], said: Mapping[str, str] | None = None) -> dict[str, str]:
    return {d.column: d.role for d in drives_of(with_drives(kernel("LuGreFriction"), records, ("F",), said)[0])}


def test_a_model_listens_only_if_every_run_has_the_column() -> None:
    drive = kernel("TendonDrive")
    model, (said,) = with_drives(drive, [WITH, WITH], ("x_out",))
    assert [v.name for v in model.inputs] == ["x_in", "tau_out", "Theta"]
    assert "Theta [rad] as bend" in said
    assert with_drives(drive, [WITHOUT], ("x_out",)) == (drive, ())
    assert with_drives(drive, [WITH, WITHOUT], ("x_out",)) == (
        drive, ("Theta drives no effect: it is not in without",),
    )  # fmt: skip


def test_a_model_keeps_its_effects() -> None:
    model, _ = with_drives(chain("TendonDrive", ("inertia",)), [WITH], ("tau_in",))
    assert "Theta" in [v.name for v in model.inputs]
    assert model.module.EFFECTS == ("inertia",)


def test_units_say_what_a_column_may_be_and_a_measurement_of_the_channel_is_no_cause() -> None:
    records = [rig(1, 0.05), rig(2, 0.05)]
    assert roles(records) == {"x": "position", "T_in": "load", "F_lateral": "load", "temperature": "temperature"}
    _, notes = with_drives(kernel("LuGreFriction"), records, ("F",))
    assert any(n.startswith("i_motor drives no effect: it follows F") for n in notes)


def test_what_is_said_of_a_column_counts_before_its_unit() -> None:
    said = {"voltage": "load", "i_motor": "load", "T_in": "none", "temperature": "bend"}
    found = roles([rig(3, 0.0)], said)
    assert found == {"x": "position", "F_lateral": "load", "i_motor": "load", "temperature": "bend", "voltage": "load"}


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ({"T_in": "tension"}, "--drive T_in=tension -- expected a role of load, bend, temperature, position, none"),
        ({"T_inn": "load"}, "--drive T_inn=load -- expected a column of the runs"),
        ({"F": "load"}, "--drive F=load -- expected no variable of LuGreFriction"),
    ],
)
def test_a_wrong_role_is_one_line(said: dict[str, str], line: str) -> None:
    with pytest.raises(InputError, match=r" -- .+ -- ") as caught:
        roles([rig(4, 0.0)], said)
    assert line in str(caught.value)


def test_a_copy_of_the_load_and_a_name_that_is_none_drive_nothing() -> None:
    one = rig(5, 0.0)
    more = {"copy": 3.0 * one.columns["T_in"] + 1.0, "my load": np.sin(one.time)}
    record = Record("r", one.time, {**one.columns, **more}, {**one.units, "copy": "N", "my load": "N"})
    assert set(roles([record])) == {"x", "T_in", "F_lateral", "temperature"}


def test_a_temperature_is_in_kelvin_and_a_second_thermometer_that_says_the_same_drives_nothing() -> None:
    one = rig(8, 0.0)
    more = {"t_2": 0.5 * one.columns["temperature"] + 146.0, "t_3": np.cos(0.9 * one.time) + 300.0}
    record = Record("r", one.time, {**one.columns, **more}, {**one.units, "t_2": "K", "t_3": "K"})
    assert {c for c, role in roles([record]).items() if role == "temperature"} == {"temperature", "t_3"}
    model, notes = with_drives(kernel("LuGreFriction"), [record], ("F",), {"voltage": "temperature"})
    assert "voltage" not in [v.name for v in model.inputs]
    assert any(n.startswith("voltage drives no effect: it is in V") for n in notes)


def test_load_effects_have_a_place_once_a_column_is_a_load() -> None:
    records = [rig(6, 0.0)]
    silent, listening = kernel("LuGreFriction"), with_drives(kernel("LuGreFriction"), records, ("F",))[0]
    assert {"load_dependence", "drive_direction"} <= set(not_applicable(silent, ("F",)))
    assert "load_dependence" not in not_applicable(listening, ("F",))
    assert "drive_direction" in not_applicable(listening, ("F",))  # a friction alone has no drive's side
    specs = {a.spec for a in possible("LuGreFriction", ("F",), (), drives_of(listening))}
    assert {"load_dependence~T_in[N]", "load_dependence~F_lateral[N]", "stiffness_hardening~x[m]"} <= specs
    assert not any(s.startswith("bend_angle") for s in specs)
    assert {s for s in specs if s.startswith("temperature")} == {"temperature_dependence"}  # the column of that name


def test_a_position_counts_from_its_own_origin_and_the_next_motion_moves_it() -> None:
    runs = prepared(kernel("LuGreFriction"), [rig(7, 0.0)], (), (), None)
    task = Task("LuGreFriction", runs.measured, runs.channels, GIVEN, drives=drives_of(runs.model))
    names = [v.name for v in runs.model.inputs]
    for name, _, inputs in menu(refit(task, (), {}))[:4]:
        assert np.ptp(inputs[:, names.index("x")]) > 0.0, name
        assert abs(np.corrcoef(np.gradient(inputs[:, names.index("x")]), inputs[:, names.index("v")])[0, 1]) > 0.99


@pytest.mark.parametrize("k", [0.09, 0.0])
def test_the_tension_that_drives_friction_is_named_and_nothing_else_is(k: float) -> None:
    found = diagnose(
        kernel("LuGreFriction"), [rig(11, k), rig(12, k)], values=GIVEN, holdout=[rig(13, k)]
    )  # four distractors in each log
    if k:
        assert found.effects == ("load_dependence~T_in[N]",)
        assert found.family == ("load",)
        assert found.model is not None
        assert [v.name for v in found.model.kernel().inputs] == ["v", "T_in"]
        assert found.model.parameters["load_dependence.k"].value == pytest.approx(k, rel=0.1)
    else:
        assert found.verdict in ("none", "parameters")
        assert found.effects == ()


def warmed(seed: int, beta: float) -> Record:
    """A rig in a room whose heating goes on and off: its grease thins as exp(-beta (T - 295 K)), felt 0.2 s late."""
    one = rig(seed, 0.0)
    rng, t = np.random.default_rng(seed), one.time
    room = 295.0 + 9.0 * np.sin(2 * np.pi * t / (0.61 * t[-1]) + 6.0 * rng.random())
    felt = np.interp(t - 0.2, t, room)
    force = one.columns["F"] * np.exp(-beta * (felt - 295.0)) + 0.01 * rng.normal(size=t.size)
    read = np.round(room + 0.05 * rng.normal(size=t.size), 1)
    return replace(one, name=f"warmed {seed}", columns={**one.columns, "F": force, "temperature": read})


@pytest.mark.parametrize("beta", [0.023, 0.0])
def test_the_temperature_that_friction_follows_is_named_and_is_not_where_it_does_nothing(beta: float) -> None:
    found = diagnose(
        kernel("LuGreFriction"), [warmed(21, beta), warmed(22, beta)], values=GIVEN, holdout=[warmed(23, beta)]
    )
    if beta:
        assert found.effects == ("temperature_dependence",)
        assert found.family == ("time",)
        assert found.model is not None
        assert [(v.name, v.quantity.unit) for v in found.model.kernel().inputs] == [("v", "m/s"), ("temperature", "K")]
        over = np.linspace(-9.0, 9.0, 99)
        slope, level = np.polyfit(over + 1.85, np.exp(-beta * over), 1)  # the line that is nearest, from 293.15 K on
        assert found.model.parameters["temperature_dependence.beta"].value == pytest.approx(-slope / level, rel=0.1)
    else:
        assert found.verdict in ("none", "parameters")
        assert found.effects == ()
