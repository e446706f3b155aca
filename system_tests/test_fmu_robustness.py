"""Through the C interface: state to the last bit, failures that are told and survived, long runs."""

import json
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import MODELS

from .conftest import Instance, wandering_inputs

STEP = 0.01


def drive(fmu: Instance, k: Kernel, u: np.ndarray, first: int, last: int) -> list[float]:
    names = [v.name for v in k.inputs]
    reals = [v.name for v in k.outputs if v.kind is float]
    found: list[float] = []
    for n in range(first, last):
        fmu.set(**dict(zip(names, u[n], strict=True)))
        fmu.step(STEP * n, STEP)
        found += fmu.get(*reals)
    return found


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_state_saved_in_mid_motion_repeats_to_the_last_bit(fmus, instance, module):
    k = Kernel(module)
    u = wandering_inputs(k, STEP * np.arange(160))
    with instance(fmus(k.name)) as fmu:
        fmu.initialise(**{v.name: x for v, x in zip(k.inputs, u[0], strict=True)})
        drive(fmu, k, u, 0, 73)
        state = fmu.slave.getFMUstate()
        serialised = fmu.slave.serializeFMUstate(state)
        onward = drive(fmu, k, u, 73, 160)
        fmu.slave.setFMUstate(state)
        assert drive(fmu, k, u, 73, 160) == onward
        fmu.slave.freeFMUstate(state)
        with instance(fmus(k.name)) as other:
            other.initialise()
            other.slave.setFMUstate(other.slave.deSerializeFMUstate(serialised))
            assert drive(other, k, u, 73, 160) == onward


def test_a_refused_step_is_a_discard_with_its_reason_and_the_run_goes_on(fmus, instance):
    with instance(fmus("PairedTsmBacklash")) as fmu:
        fmu.initialise()
        fmu.set(x_in=float("nan"))
        with pytest.raises(FMICallException) as refused:
            fmu.step(0.0, 0.1)
        assert refused.value.status == 2  # fmi2Discard
        assert "input x_in = nan at t = 0.0 s -- expected a finite number" in fmu.log[-1]
        fmu.set(x_in=0.2)
        fmu.step(0.0, 0.1)
        assert fmu.get("x_out")[0] > 0


def test_wrong_parameters_are_told_and_a_reset_recovers(fmus, instance):
    with instance(fmus("PairedTsmBacklash")) as fmu:
        fmu.initialise(alpha=-2.5)
        assert "parameter alpha = -2.5 1/rad" in fmu.log[-1]
        with pytest.raises(FMICallException):
            fmu.step(0.0, 0.1)
        fmu.slave.reset()
        fmu.initialise(alpha=2.5, x_in=0.25)
        fmu.step(0.0, 0.1)
        assert fmu.get("x_out") == [1.00056 * 0.25]


def test_a_refused_step_shows_in_the_rows_of_simulate_fmu(fmus):
    """FMPy stops at a discarded step without an error; the number of rows is the only sign."""
    signal = np.array([(0.0, 0.0), (0.05, np.nan), (0.1, np.nan)], dtype=[("time", float), ("x_in", float)])
    path = str(fmus("PairedTsmBacklash"))
    result = fmpy.simulate_fmu(
        path, stop_time=0.1, step_size=0.01, output_interval=0.01, input=signal, debug_logging=True
    )
    assert len(result) < 11


SOAK = """
import ctypes, gc, json, sys
import fmpy, fmpy.fmi2
folder, description = sys.argv[1], fmpy.read_model_description(sys.argv[1])
references = {v.name: v.valueReference for v in description.modelVariables}
FAIL = [("x_in", float("nan")), ("alpha", -1.0), ("x_out", 1.0), ("beta", float("inf"))]
def instance(n):
    fmu = fmpy.fmi2.FMU2Slave(guid=description.guid, unzipDirectory=folder,
                              modelIdentifier=description.coSimulation.modelIdentifier, instanceName=f"i{n}")
    fmu.instantiate(loggingOn=False)
    fmu.setupExperiment(startTime=0.0)
    return fmu
def start(fmu):
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
discards = 0
for n in range(100):                       # each fails in its own way, and is freed
    fmu = instance(n)
    name, value = FAIL[n % len(FAIL)]
    fmu.setReal([references[name]], [value])
    start(fmu)
    try:
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.1)
    except Exception:
        discards += 1
    if n % 3 == 0:
        fmu.reset()
    fmu.freeInstance()
    gc.collect()
fmu = instance(100)
start(fmu)
library, component = fmu.dll, ctypes.c_void_p(fmu.component)
x = (ctypes.c_double * 1)()
y = (ctypes.c_double * 1)()
x_in, x_out = (ctypes.c_uint * 1)(references["x_in"]), (ctypes.c_uint * 1)(references["x_out"])
do_step = library.fmi2DoStep
do_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
step, worst, one = 2.0 ** -10, 0, ctypes.c_size_t(1)
for n in range(300_000):
    x[0] = 0.5 * ((n % 2000) - 1000) / 1000
    worst = max(worst, library.fmi2SetReal(component, x_in, one, x), do_step(component, n * step, step, 1),
                library.fmi2GetReal(component, x_out, one, y))
print(json.dumps([discards, worst, y[0]]))
fmu.terminate()
fmu.freeInstance()
"""


def test_a_hundred_failing_instances_and_300_000_steps(fmus, tmp_path):
    folder = fmpy.extract(str(fmus("PairedTsmBacklash")), str(tmp_path / "unpacked"))
    done = subprocess.run([sys.executable, "-c", SOAK, str(folder)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    discards, worst, last = json.loads(done.stdout.splitlines()[-1])
    assert (discards, worst) == (100, 0)
    k = Kernel(next(m for m in MODELS if m.NAME == "PairedTsmBacklash"))
    n = np.arange(300_000)
    inputs = np.concatenate([[0.0], 0.5 * ((n % 2000) - 1000) / 1000])
    expected = k.simulate(k.params(), 2.0**-10 * np.arange(300_001), inputs[:, None])
    assert last == pytest.approx(expected[-1, 0], rel=1e-12)


ENDING = """
import atexit, ctypes, os, sys
import fmpy, fmpy.fmi2
folder, description = sys.argv[1], fmpy.read_model_description(sys.argv[1])
model = description.coSimulation.modelIdentifier

def held():
    # finalizePythonInterpreter begins by loading the control block of the library's static shared_ptr
    library = ctypes.CDLL(f"{folder}/binaries/linux64/{model}.so", mode=os.RTLD_NOLOAD | os.RTLD_NOW)
    code = ctypes.cast(library.finalizePythonInterpreter, ctypes.c_void_p).value + 14
    instruction = ctypes.string_at(code, 7)
    assert instruction[:3] == b"\\x48\\x8b\\x2d", instruction
    return ctypes.c_void_p.from_address(code + 7 + int.from_bytes(instruction[3:], "little", signed=True)).value

atexit.register(lambda: print("at exit", held()))  # registered first: runs last
for n in range(3):
    fmu = fmpy.fmi2.FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=model, instanceName=f"i{n}")
    fmu.instantiate()
    print("loaded", held() is not None)
    fmu.freeInstance()
"""


@pytest.mark.skipif(fmpy.platform_tuple != "x86_64-linux", reason="reads the x86-64 Linux library")
def test_the_library_lets_the_interpreter_go_before_the_process_ends(fmus, tmp_path):
    """Otherwise it releases its state twice at exit, the second time in freed memory."""
    folder = fmpy.extract(str(fmus("PairedTsmBacklash")), str(tmp_path / "unpacked"))
    done = subprocess.run([sys.executable, "-c", ENDING, str(folder)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["loaded True"] * 3 + ["at exit None"]
