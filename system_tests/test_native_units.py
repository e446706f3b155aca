"""Native FMUs through FMPy, FMI 2.0 and 3.0: the numbers of plain Python, to the last digit, and its sentences."""

import ctypes
import math
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.validate import validate_fmu
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS

from .conftest import wandering_inputs
from .native_units import Unit, opened
from .test_native_platforms import host_of

STEP = 0.01
LINUX = {2: "linux64", 3: "x86_64-linux"}
VERSIONS = pytest.mark.parametrize("fmi", [2, 3])
DISCARD, ERROR = 2, 3


def driven(unit: Unit, k: Kernel, u: np.ndarray, first: int, last: int) -> list[list[float]]:
    rows = []
    for n in range(first, last):
        unit.set(**dict(zip((v.name for v in k.inputs), u[n], strict=True)))
        unit.step(STEP * (n - 1), STEP)
        rows.append(unit.get(*(v.name for v in k.outputs)))
    return rows


@VERSIONS
@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_the_numbers_are_those_of_plain_python(native_fmus, module, fmi):
    k = Kernel(module)
    time = STEP * np.arange(120)
    u = wandering_inputs(k, time)
    dt = np.full(time.size - 1, STEP)
    p = k.params()
    s, o = module.start(p, module.Inputs(*map(float, u[0])))
    expected = []
    for n in range(1, time.size):
        s, o = module.step(p, s, module.Inputs(*map(float, u[n])), float(dt[n - 1]))
        expected.append(list(o))
    with opened(native_fmus(k.name, fmi)) as unit:
        unit.initialise(**dict(zip((v.name for v in k.inputs), u[0], strict=True)))
        assert driven(unit, k, u, 1, time.size) == expected


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_no_model_keeps_memory_of_its_lives(native_fmus, tmp_path, module):
    """`python -m benchmarks.soak` does this a million times, with ten million steps."""
    if not shutil.which("gcc"):
        pytest.skip("no gcc here: install it")
    path = native_fmus(module.NAME, 2)
    with zipfile.ZipFile(path) as archive:
        library = Path(archive.extract(f"binaries/linux64/{module.NAME}.so", tmp_path))
    soak = {"LIVES": 40_000, "STEPS": 40_000}
    program = host_of(path, library, 2, ["gcc", "-O1", "-ldl"], tmp_path / "host", **soak)
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(done.stdout) < 100  # kB; four bytes a life would be 140


@VERSIONS
def test_states_saved_serialised_and_restored_repeat_to_the_last_bit(native_fmus, fmi):
    k = kernel("LebusTransmission")
    u = wandering_inputs(k, STEP * np.arange(120))
    with opened(native_fmus(k.name, fmi)) as unit, opened(native_fmus(k.name, fmi), name="two") as other:
        unit.initialise(**dict(zip((v.name for v in k.inputs), u[0], strict=True)))
        driven(unit, k, u, 1, 60)
        state = unit.save()
        serialised = (unit.slave.serializeFMUstate if fmi == 2 else unit.slave.serializeFMUState)(state)
        onward = driven(unit, k, u, 60, 120)
        unit.restore(state)
        assert driven(unit, k, u, 60, 120) == onward
        other.initialise()
        read = other.slave.deSerializeFMUstate if fmi == 2 else other.slave.deserializeFMUState
        other.restore(read(serialised))
        assert driven(other, k, u, 60, 120) == onward
        with pytest.raises(FMICallException):
            read(serialised[:-8])
        damaged = bytes(serialised).replace(struct.pack("d", k.params().EA), bytes(8))
        assert damaged != bytes(serialised)
        with pytest.raises(FMICallException):
            read(damaged)


@VERSIONS
@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"alpha": -2.5}, "parameter alpha = -2.5 1/rad (inverse of the travel that forgets a reversal, Eq (10)) -- "),
        ({"beta": -1.7}, "beta = -1.7 with c = 1.00056 gives B = c + beta = -0.6994400000000001 -- expected B > 0"),
        ({"x_in": math.nan}, "input x_in = nan at the start -- expected a finite number"),
    ],
)
def test_wrong_values_are_an_error_with_pythons_sentence_and_a_reset_recovers(native_fmus, values, sentence, fmi):
    with opened(native_fmus("PairedTsmBacklash", fmi)) as unit:
        with pytest.raises(FMICallException) as refused:
            unit.initialise(**values)
        assert refused.value.status == ERROR
        assert sentence in unit.log[-1]
        parameters = {k: v for k, v in values.items() if k != "x_in"}
        if parameters:
            with pytest.raises(ValueError, match=r" -- ") as expected:
                kernel("PairedTsmBacklash").params(values=parameters)
            assert unit.log[-1] == f"PairedTsmBacklash: initialisation failed: {expected.value}"
        with pytest.raises(FMICallException):
            unit.step(0.0, 0.1)
        unit.slave.reset()
        unit.initialise(alpha=2.5, x_in=0.25)
        unit.step(0.0, 0.1)
        assert unit.get("x_out") == [1.00056 * 0.25]


@VERSIONS
def test_a_step_is_a_discard_only_where_a_smaller_one_helps(native_fmus, fmi):
    with opened(native_fmus("LebusWinding", fmi)) as unit:
        unit.initialise(theta=1.0, T=2.0)
        unit.set(theta=-1.0)
        with pytest.raises(FMICallException) as refused:
            unit.step(0.0, 0.1)
        assert refused.value.status == ERROR
        assert "theta is negative -- the grooves begin at 0" in unit.log[-1]
    with opened(native_fmus("ReferenceSignal", fmi)) as unit:  # w t overflows, and its sine is no number
        unit.initialise()
        with pytest.raises(FMICallException) as refused:
            unit.step(0.0, 1.7e308)
        assert refused.value.status == DISCARD
        assert "step at t = 0.0 s with Inputs() failed: math domain error" in unit.log[-1]
        unit.step(0.0, 1e-3)
        assert all(map(math.isfinite, unit.get("y", "dy", "ddy")))


@VERSIONS
def test_calls_out_of_order_and_wrong_variables_are_errors_that_leave_the_rest_as_it_was(native_fmus, fmi):
    with opened(native_fmus("PairedTsmBacklash", fmi)) as unit:
        for call in (lambda: unit.step(0.0, 0.1), lambda: unit.get("x_out"), unit.slave.terminate):
            with pytest.raises(FMICallException) as refused:
                call()
            assert refused.value.status == ERROR
            assert "it is not allowed before initialisation mode" in unit.log[-1]
        unit.initialise(x_in=0.5)
        for name, sentence in (("c", "it is fixed after initialisation"), ("x_out", "expected an input or parameter")):
            with pytest.raises(FMICallException):
                unit.set(**{name: 1.0})
            assert sentence in unit.log[-1]
        with pytest.raises(FMICallException):
            unit.step(0.7, 0.1)
        assert "step from t = 0.7 s -- expected t = 0.0 s" in unit.log[-1]
        unit.step(0.0, 0.1)
        assert unit.get("x_out") == [1.00056 * 0.5]
        unit.slave.terminate()
        assert unit.get("x_out") == [1.00056 * 0.5]


@VERSIONS
@pytest.mark.parametrize("name", ["TendonDrive", "LebusTransmission", "DcMotor"])
def test_terminals_are_valid_and_name_variables_of_the_unit(native_fmus, name, fmi):
    schema = etree.XMLSchema(etree.parse(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    with zipfile.ZipFile(native_fmus(name, fmi)) as archive:
        root = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        assert archive.read("terminalsAndIcons/icon.png").startswith(b"\x89PNG")
        assert ("model.png" in archive.namelist()) == (fmi == 2)
    schema.assertValid(root)
    members = [member.get("variableName") for member in root.iter("TerminalMemberVariable")]
    described = fmpy.read_model_description(str(native_fmus(name, fmi)))
    assert members
    assert set(members) <= {v.name for v in described.modelVariables if v.causality in ("input", "output")}


@VERSIONS
def test_a_foreign_guid_is_refused(native_fmus, fmi):
    with pytest.raises(Exception, match=r"[Ii]nstantiate"), opened(native_fmus("Sum", fmi), guid="{foreign}"):
        pass


@VERSIONS
def test_two_versions_side_by_side_and_many_instances_share_nothing(native_fmus, tmp_path, fmi):
    other = build_fmu(
        kernel("PairedTsmBacklash"),
        tmp_path / "other.fmu",
        name="PairedTsmBacklash",
        start_values={"c": 0.87, "beta": -0.5},
        flavour="native",
        fmi=fmi,
        platforms=[LINUX[fmi]],
    )
    with opened(native_fmus("PairedTsmBacklash", fmi)) as one, opened(other) as two:
        for unit in (one, two):
            unit.initialise(x_in=0.5)
        assert one.get("x_out") == [1.00056 * 0.5]
        assert two.get("x_out") == [0.87 * 0.5]


@VERSIONS
@pytest.mark.parametrize("name", ["TendonDrive", "PairedTsmFriction", "DcMotor", "LebusTransmission"])
def test_directional_derivatives_are_the_slope_of_the_last_step(native_fmus, name, fmi):
    k = kernel(name)
    u = wandering_inputs(k, STEP * np.arange(40))
    reals = [v.name for v in k.outputs if v.kind is float]
    inputs = [v.name for v in k.inputs]
    with opened(native_fmus(name, fmi)) as unit:
        unit.initialise(**dict(zip(inputs, u[0], strict=True)))
        driven(unit, k, u, 1, 39)
        state = unit.save()

        def outputs(row) -> np.ndarray:
            unit.restore(state)
            unit.set(**dict(zip(inputs, row, strict=True)))
            unit.step(STEP * 38, STEP)
            return np.array(unit.get(*reals))

        for column, known in enumerate(inputs):
            size = 1e-5 * max(1e-3, abs(u[39, column]))
            moved = [outputs(u[39] + size * n * np.eye(len(inputs))[column]) for n in (-2, -1, 1, 2)]
            slope = (moved[0] - 8.0 * moved[1] + 8.0 * moved[2] - moved[3]) / (12.0 * size)
            outputs(u[39])
            exact = unit.derivative(reals, [known], [1.0])
            scale = np.abs(slope).max() + np.abs(np.array(moved)).max()
            np.testing.assert_allclose(exact, slope, rtol=1e-5, atol=1e-6 * scale)


@pytest.mark.parametrize("array", ["L", "R"])
def test_derivatives_along_arrays_of_fmi_3(native_fmus, array):
    k = kernel("LebusTransmission")
    p, u = k.params(), k.module.Inputs(theta_in=2.0, tau_load=0.3)
    seed = [0.7, -1.3, 0.21, 0.4, -0.33, 0.9, 0.15, -0.6]
    outputs = [v.name for v in k.outputs if v.kind is float]

    def moved(size: float) -> np.ndarray:
        changed = tuple(a + size * b for a, b in zip(getattr(p, array), seed, strict=True))
        o = k.module.start(p._replace(**{array: changed}), u)[1]
        return np.array([getattr(o, name) for name in outputs])

    slope = (moved(1e-5) - moved(-1e-5)) / 2e-5
    with opened(native_fmus(k.name, 3)) as unit:
        unit.set(theta_in=2.0, tau_load=0.3)
        unit.slave.enterInitializationMode()
        found = unit.derivative(outputs, [array], seed)
        np.testing.assert_allclose(found, slope, rtol=1e-6, atol=1e-8)
        assert np.abs(found).max() > 1.0
        both = unit.derivative(outputs, [array, "mu"], [*seed, 0.37])
        alone = unit.derivative(outputs, ["mu"], [0.37])
        np.testing.assert_allclose(both, np.add(found, alone), rtol=1e-12)
        for knowns, numbers in (([array], seed[:2]), ([array, "mu"], seed)):
            with pytest.raises(FMICallException):
                unit.derivative(outputs, knowns, numbers)
            assert "expected one for each element of each variable" in unit.log[-1]
        with pytest.raises(FMICallException):  # an element has no value reference of its own
            unit.slave.getDirectionalDerivative([unit.references["T_a"]], [unit.references[array] + 1], seed[:1])


@VERSIONS
def test_an_unknown_derivative_is_refused(native_fmus, fmi):
    with opened(native_fmus("PairedTsmBacklash", fmi)) as unit:
        unit.initialise(x_in=0.5)
        for unknown, known in (("x_in", "x_in"), ("x_out", "c"), ("x_out", "x_h")):
            with pytest.raises(FMICallException):
                unit.derivative([unknown], [known], [1.0])


@VERSIONS
def test_a_chain_with_effects_is_exported_and_warnings_reach_the_log(tmp_path, fmi):
    k = chain("TendonDrive", ("stribeck", "backlash@x_out"))
    path = build_fmu(k, tmp_path / "Drive.fmu", start_values={"stribeck.dF": 0.03}, flavour="native", fmi=fmi,
                     platforms=[LINUX[fmi]])  # fmt: skip
    assert validate_fmu(path) == []
    with opened(path) as unit:
        unit.initialise(x_in=0.1, sigma1=2.0)
        assert any("the friction is not passive near v_s" in line for line in unit.log)


@VERSIONS
def test_every_platform_is_inside_stripped_and_the_bytes_are_the_same_at_each_build(tmp_path, fmi):
    first = build_fmu(kernel("Sum"), tmp_path / "one.fmu", name="Sum", flavour="native", fmi=fmi)
    second = build_fmu(kernel("Sum"), tmp_path / "two.fmu", name="Sum", flavour="native", fmi=fmi)
    assert first.read_bytes() == second.read_bytes()
    assert validate_fmu(first) == []
    expected = {
        2: ["darwin64/Sum.dylib", "linux64/Sum.so", "win64/Sum.dll"],
        3: ["aarch64-darwin/Sum.dylib", "aarch64-linux/Sum.so", "x86_64-darwin/Sum.dylib", "x86_64-linux/Sum.so",
            "x86_64-windows/Sum.dll"],
    }  # fmt: skip
    with zipfile.ZipFile(first) as archive:
        names = sorted(n for n in archive.namelist() if n.startswith("binaries/"))
        assert names == [f"binaries/{name}" for name in expected[fmi]]
        for name in names:
            assert archive.getinfo(name).file_size < 100_000, name


@VERSIONS
def test_a_changed_binary_is_found(native_fmus, tmp_path, fmi):
    path = tmp_path / "Sum.fmu"
    with zipfile.ZipFile(native_fmus("Sum", fmi)) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data[::-1] if name.startswith("binaries/") else data)
    assert any("is not of this build" in line for line in validate_fmu(path))


def test_the_library_needs_the_c_library_alone(native_fmus):
    with opened(native_fmus("TendonDrive", 2)) as unit:
        assert isinstance(unit.slave.dll, ctypes.CDLL)
    with zipfile.ZipFile(native_fmus("TendonDrive", 2)) as archive:
        library = archive.read("binaries/linux64/TendonDrive.so")
    import re

    needed = set(re.findall(rb"lib[\w.-]+\.so\.\d+", library))
    assert needed <= {b"libc.so.6", b"libm.so.6"}
    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_([\d.]+)", library)}
    assert max(versions) <= (2, 17)
