"""FMUs share nothing with each other or with the package that built them."""

import json
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS


def test_two_builds_of_one_fmu_side_by_side_give_two_answers(fmus, instance, tmp_path):
    fitted = build_fmu(kernel("PairedTsmBacklash"), tmp_path, start_values={"c": 0.87, "beta": -0.5})
    with instance(fmus("PairedTsmBacklash")) as published, instance(fitted) as other:
        for fmu in (published, other):
            fmu.initialise(x_in=0.5)
        assert published.get("x_out") == [1.00056 * 0.5]
        assert other.get("x_out") == [0.87 * 0.5]


def test_a_changed_kernel_is_not_served_by_the_old_code(fmus, instance, tmp_path):
    """The trap of shared module names: code, not start values, differs."""
    from types import ModuleType

    from tsm_fmu.models import paired_tsm_backlash

    old_text = Path(str(paired_tsm_backlash.__file__)).read_text()
    new_text = old_text.replace("p.c * u.x_in", "2.0 * p.c * u.x_in")
    assert new_text != old_text
    module = ModuleType(paired_tsm_backlash.__name__)
    module.__dict__.update(__package__=paired_tsm_backlash.__package__, SOURCE_TEXT=new_text)
    exec(compile(new_text, "changed", "exec"), module.__dict__)  # noqa: S102  our own file
    changed = build_fmu(Kernel(module), tmp_path)
    with instance(fmus("PairedTsmBacklash")) as first, instance(changed) as second:
        first.initialise(x_in=0.5)
        second.initialise(x_in=0.5)
        assert second.get("x_out") == [2.0 * first.get("x_out")[0]]


HOST = """
import json, sys
sys.path.insert(0, sys.argv[1])             # FMPy and what it needs, from a folder without our package
import fmpy.fmi2
before = set(sys.modules)
folder, guid, model, references = json.loads(sys.argv[2])
fmu = fmpy.fmi2.FMU2Slave(guid=guid, unzipDirectory=folder, modelIdentifier=model, instanceName="bare")
fmu.instantiate(loggingOn=True)
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.exitInitializationMode()
for n in range(5):
    fmu.doStep(currentCommunicationPoint=n * 0.01, communicationStepSize=0.01)
values = fmu.getReal(references)
loaded = sorted({m.partition(".")[0] for m in set(sys.modules) - before} - set(sys.stdlib_module_names))
fmu.terminate()
fmu.freeInstance()
print(json.dumps([values, loaded]))
"""


@pytest.mark.parametrize("name", [module.NAME for module in MODELS])
def test_a_host_with_python_only(fmus, bare_packages, name, tmp_path):
    folder = fmpy.extract(str(fmus(name)), str(tmp_path / "unpacked"))
    md = fmpy.read_model_description(folder)
    outputs = [v.valueReference for v in md.modelVariables if v.causality == "output" and v.type == "Real"]
    given = json.dumps([str(folder), md.guid, md.coSimulation.modelIdentifier, outputs])
    host = [sys._base_executable, "-I", "-S", "-c", HOST, str(bare_packages), given]  # type: ignore[attr-defined]
    done = subprocess.run(host, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    values, loaded = json.loads(done.stdout.splitlines()[-1])
    assert len(values) == len(outputs)
    tag = md.guid.replace("-", "")[:12]
    assert loaded == sorted([f"{name}_{tag}", f"tsm_fmu_{tag}"]), done.stdout
