"""An FMU gives what its kernel gives, in independent importers."""

import ctypes
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.validate import validate_fmu
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS

from .conftest import wandering_inputs

TIME = np.arange(0.0, 2.0001, 0.01)


def stepped(instance, path: Path, k: Kernel, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
    """Outputs of FMU and kernel for the same inputs: row 0 at the start, then row k+1 set and step k done."""
    u = wandering_inputs(k, TIME)
    inputs, outputs = [v.name for v in k.inputs], [v.name for v in k.outputs]
    rows = []
    with instance(path) as fmu:
        integers = {v.name for v in k.outputs if v.kind is int}

        def row() -> list[float]:
            get = {True: fmu.slave.getInteger, False: fmu.slave.getReal}
            return [get[n in integers]([fmu.references[n]])[0] for n in outputs]

        fmu.initialise(**dict(zip(inputs, u[0], strict=True)), **parameters)
        rows.append(row())
        for n in range(1, TIME.size):
            fmu.set(**dict(zip(inputs, u[n], strict=True)))
            fmu.step(TIME[n - 1], TIME[n] - TIME[n - 1])
            rows.append(row())
        assert not [line for line in fmu.log if "-- expected" in line]
    return np.array(rows), k.simulate(k.params(values=parameters), TIME, u, compiled=False)


@pytest.mark.parametrize("name", [module.NAME for module in MODELS])
def test_fmu_equals_kernel(fmus, instance, name):
    fmu, expected = stepped(instance, fmus(name), kernel(name))
    assert np.ptp(expected, axis=0).max() > 0
    np.testing.assert_allclose(fmu, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("model", "effect", "parameter", "value"),
    [
        ("LuGreFriction", "coulomb", "coulomb.F_c", 0.31),
        ("TendonDrive", "backlash", "x_out.backlash.w", 0.071),
        ("TendonDrive", "load_dependence", "load_dependence.k", 0.23),
        ("LuGreFriction", "backlash@v", "v.backlash.w", 0.00137),
    ],
)
def test_a_model_with_an_effect_is_an_fmu_with_its_fitted_values(instance, tmp_path, model, effect, parameter, value):
    k = chain(model, (effect,))
    path = build_fmu(k, tmp_path, name=f"{model}_{effect.replace('@', '_')}", start_values={parameter: value})
    assert validate_fmu(path) == []
    fmu, neutral = stepped(instance, path, k)
    params = k.params(values={parameter: value})
    expected = k.simulate(params, TIME, wandering_inputs(k, TIME), compiled=False)
    np.testing.assert_allclose(fmu, expected, rtol=1e-12, atol=0)
    assert np.abs(fmu - neutral).max() > 1e-3


def test_parameters_set_by_the_host_are_used(fmus, instance):
    changed = {"alpha": 6.1, "c": 0.93, "x_0": 0.011}
    fmu, expected = stepped(instance, fmus("PairedTsmBacklash"), kernel("PairedTsmBacklash"), **changed)
    plain, _ = stepped(instance, fmus("PairedTsmBacklash"), kernel("PairedTsmBacklash"))
    np.testing.assert_allclose(fmu, expected, rtol=1e-12, atol=0)
    assert np.abs(fmu - plain).max() > 0.01


def test_simulate_fmu_gives_every_row_and_holds_the_row_before(fmus):
    k = kernel("PairedTsmBacklash")
    u = wandering_inputs(k, TIME)
    signal = np.array(list(zip(TIME, u[:, 0], strict=True)), dtype=[("time", float), ("x_in", float)])
    result = fmpy.simulate_fmu(
        str(fmus(k.name)), stop_time=2.0, step_size=0.01, output_interval=0.01, input=signal, output=["x_out"]
    )
    assert len(result) == TIME.size
    held = np.vstack([u[:1], u[:-1]])  # FMPy sets row k before the step from k to k+1
    expected = k.simulate(k.params(), TIME, held, compiled=False)
    np.testing.assert_allclose(result["x_out"], expected[:, 0], rtol=1e-9, atol=1e-15)


def last_in_fmpy(path: Path, steps: int) -> float:
    result = fmpy.simulate_fmu(str(path), stop_time=0.01 * steps, step_size=0.01, output_interval=0.01)
    return float(result["y"][-1])


def test_libcosim_gives_the_same_last_digit(fmus):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    path, steps = fmus("ReferenceSignal"), 400
    execution = CosimExecution.from_step_size(step_size=1e7)  # ns
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(path), instance_name="reference"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    execution.step(step_count=steps)
    reference = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}["y"]
    (value,) = observer.last_real_values(slave_index=slave, variable_references=[reference])
    assert value == last_in_fmpy(path, steps)
    assert value != 0.0


def test_ecos_gives_the_same_last_digit(fmus):
    try:
        ctypes.CDLL("libtbb.so.12")
    except OSError as missing:
        pytest.skip(f"ecospy needs Debian's libtbb12: {missing}")
    from ecospy import EcosSimulation, EcosSimulationStructure

    path, steps = fmus("ReferenceSignal"), 400
    with EcosSimulationStructure() as structure:
        structure.add_model("reference", str(path))
        with EcosSimulation(structure=structure, step_size=0.01) as simulation:
            simulation.init()
            simulation.step(steps)
            value = simulation.get_real("reference::y")
            simulation.terminate()
    assert value == last_in_fmpy(path, steps)
