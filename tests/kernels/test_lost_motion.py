"""Effects that change what friction takes of a distal motion: closed forms, neutral to the last bit, and in an FMU."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.cosim.replay import replay
from tsm_fmu.effects import EFFECTS
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

CARRIERS = ("PairedTsmBacklash", "TendonDrive", "DistalEstimator")
ON_MOTION = [m for m in EFFECTS if "lost motion" in m.ABOUT.places]
T = np.arange(900) * 0.0107


def inputs_of(names: list[str]) -> np.ndarray:
    signals = {"x_in": 1.9 * np.sin(2.3 * T), "f": 0.31 + 0.17 * np.cos(0.7 * T), "q": 2.1 + 0.4 * np.sin(0.3 * T)}
    signals["w"] = 295.0 + np.cos(0.2 * T)
    signals["tau_out"] = signals["f"]
    signals["tau_in"] = 1.1 * signals["f"] + 0.07 * np.sign(np.cos(2.3 * T))
    return np.column_stack([signals[n] for n in names])


COLUMNS = {"load": "f[N.m]", "bend": "q[rad]", "temperature": "w[K]"}


def spec(module, columns: dict[str, str] = COLUMNS) -> str:
    drives = [text for signal, text in columns.items() if signal in module.Inputs._fields]
    return f"{module.NAME}@x_out" + (f"~{','.join(drives)}" if drives else "")


@pytest.mark.parametrize("model", CARRIERS)
def test_neutral_effects_leave_the_motion_bit_for_bit(model: str) -> None:
    found = chain(model, tuple(spec(m) for m in ON_MOTION))
    inputs = inputs_of([v.name for v in found.inputs])
    alone = kernel(model)
    own = alone.simulate(alone.params(), T, inputs[:, : len(alone.inputs)])
    assert np.array_equal(found.simulate(found.params(), T, inputs, compiled=False), own)
    assert np.array_equal(found.simulate(found.params(), T, inputs), own)


@pytest.mark.parametrize("model", CARRIERS)
def test_a_share_of_the_lost_motion_is_that_share_in_each_direction(model: str) -> None:
    """eps: the lag behind c x_in + x_0 grows by eps forth and shrinks by it back, whatever the lag is."""
    found, alone = chain(model, ("direction_asymmetry@x_out",)), kernel(model)
    inputs = inputs_of([v.name for v in alone.inputs])
    values = {"c": 0.93, "x_0": 0.11}
    before = alone.simulate(alone.params(None, values), T, inputs)[:, 0]
    after = found.simulate(found.params(None, {**values, "x_out.direction_asymmetry.eps": 0.27}), T, inputs)[:, 0]
    lag = 0.93 * inputs[:, 0] + 0.11 - before
    side = np.sign(np.diff(inputs[:, 0], prepend=inputs[0, 0]))
    assert np.allclose(before - after, 0.27 * side * lag, atol=1e-12)


@pytest.mark.parametrize("model", ["TendonDrive", "DistalEstimator"])
def test_a_load_widens_the_loop_by_as_much(model: str) -> None:
    """The load, measured or estimated, adds k |load| beyond presliding, on either way: the output lags so much more."""
    found, alone = chain(model, ("load_dependence@x_out",)), kernel(model)
    inputs = inputs_of([v.name for v in alone.inputs])
    values = {"x_out.load_dependence.k": 0.21, "motion.x_pre": 1e-3}
    before = alone.simulate(alone.params(), T, inputs)
    load = inputs[:, 1] if model == "TendonDrive" else before[:, 1]
    lag = (before - found.simulate(found.params(None, values), T, inputs))[:, 0] * np.sign(np.gradient(inputs[:, 0]))
    sliding = (np.abs(np.cos(2.3 * T)) > 0.3) & (T > 0.0)  # at the start nothing has slid yet
    assert np.allclose(lag[sliding], 0.21 * np.abs(load)[sliding], rtol=1e-6)


@pytest.mark.parametrize("module", ON_MOTION, ids=lambda m: m.NAME)
def test_the_estimator_takes_the_drive_s_effects_back_to_the_same_angle(module) -> None:
    """From x_in and the drive's tau_in it finds tau_out, Eq (D2), and so the load of an effect: one set serves both."""
    effect = spec(module, {signal: text for signal, text in COLUMNS.items() if signal != "load"})
    drive, estimator = (chain(model, (effect,)) for model in ("TendonDrive", "DistalEstimator"))
    sizes = [v.name for v in drive.parameters if v.name.startswith(f"x_out.{module.NAME}.")]
    values = {name: 0.137 for name in sizes} | {"c": 0.93, "x_0": 0.11, "ratio": 1.07}
    inputs = inputs_of([v.name for v in drive.inputs])
    forward = drive.simulate(drive.params(None, values), T, inputs)
    columns = dict(zip((v.name for v in (*drive.inputs, *drive.outputs)), (*inputs.T, *forward.T), strict=True))
    back = estimator.simulate(
        estimator.params(None, values), T, np.column_stack([columns[v.name] for v in estimator.inputs])
    )
    assert np.ptp(columns["x_out"]) > 1.0
    assert np.allclose(back[:, 0], columns["x_out"], rtol=0.0, atol=1e-12)
    assert np.allclose(back[:, 1], columns["tau_out"], rtol=0.0, atol=1e-12)


def test_two_effects_of_one_motion_add_up_from_what_the_first_has_left() -> None:
    first, both = "stiffness_hardening@x_out", ("stiffness_hardening@x_out", "direction_asymmetry@x_out")
    one, two = chain("PairedTsmBacklash", (first,)), chain("PairedTsmBacklash", both)
    inputs = inputs_of(["x_in"])
    values = {"x_out.stiffness_hardening.k_3": 0.031}
    lag = one.params().c * inputs[:, 0] - one.simulate(one.params(None, values), T, inputs)[:, 0]
    more = two.simulate(two.params(None, {**values, "x_out.direction_asymmetry.eps": 0.4}), T, inputs)[:, 0]
    side = np.sign(np.diff(inputs[:, 0], prepend=inputs[0, 0]))
    assert np.allclose(two.params().c * inputs[:, 0] - more, (1.0 + 0.4 * side) * lag, atol=1e-12)


def test_units_are_those_of_the_motion() -> None:
    found = chain("PairedTsmBacklash", ("load_dependence@x_out~f[N]", "stiffness_hardening@x_out"))
    units = {v.name: v.quantity.unit for v in found.parameters}
    assert units["x_out.load_dependence.k"] == "rad/N"
    assert units["x_out.stiffness_hardening.k_3"] == "1/rad2"
    assert attach(kernel("PairedTsmBacklash"), "wear").spec == "wear@x_out"


@pytest.mark.parametrize("flavour", ["native", "python"])
def test_the_fmu_does_the_same(tmp_path: Path, flavour: str) -> None:
    found = chain("PairedTsmBacklash", ("load_dependence@x_out~f[N]", "thermal@x_out"))
    names, values = [v.name for v in found.inputs], {"x_out.load_dependence.k": 0.07, "x_out.thermal.d": 0.4}
    inputs = inputs_of(names)
    fmu = build_fmu(found, tmp_path / "f.fmu", flavour=flavour, start_values=values, platforms=loaded_here())
    columns = {**dict(zip(names, inputs.T, strict=True)), "x_out": 0.0 * T, "x_h": 0.0 * T}
    units = {v.name: v.quantity.unit for v in (*found.inputs, *found.outputs)}
    run = replay(fmu, Record("r", T, columns, units), parameters=values)
    expected = found.simulate(found.params(None, values), T, inputs)
    assert np.allclose(run.columns["x_out"], expected[:, 0], rtol=0.0, atol=1e-12)
