"""FMUs share nothing with each other or with the package that built them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

import tsm_fmu
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS

from .python_hosts import host_run, hosts

HOSTS = hosts()
THIS = sys.version_info[:3]


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


@pytest.fixture(scope="module")
def here(fmus, tmp_path_factory):
    """All FMUs in one process of this Python."""
    return host_run(HOSTS[THIS], [fmus(m.NAME) for m in MODELS], tmp_path_factory.mktemp("here"))


def test_all_fmus_in_one_process_load_the_standard_library_and_themselves_only(here):
    tops = {module.partition(".")[0] for module in here["modules"]} - set(sys.stdlib_module_names)
    assert len(here["values"]) == len(MODELS)
    assert {top.rpartition("_")[0] for top in tops} == {"tsm_fmu", *(m.NAME for m in MODELS)}


@pytest.mark.parametrize(
    "version", [v for v in HOSTS if v >= (3, 10) and v != THIS], ids=lambda v: ".".join(map(str, v))
)
def test_all_fmus_in_one_process_of_another_python(fmus, here, version, tmp_path):
    other = host_run(HOSTS[version], [fmus(m.NAME) for m in MODELS], tmp_path)
    assert tuple(map(int, other["python"].split("."))) == version
    assert other["values"] == here["values"]


def test_there_is_another_python_to_try():
    if len(HOSTS) < 2:
        pytest.skip(f"only Python {sys.version.split()[0]} is here: install the distribution's python3 to try that")


def test_the_loop_of_the_demo_on_the_other_patch_release(tmp_path):
    """Build, validate and run on the distribution's Python, with the packages of this one."""
    others = [v for v in HOSTS if v[:2] == THIS[:2] and v != THIS]
    if not others:
        pytest.skip(f"no other release of Python {THIS[0]}.{THIS[1]} here: /usr/bin/python3 is not one")
    paths = [str(Path(tsm_fmu.__file__).parents[1]), str(Path(fmpy.__file__).parents[1])]
    command = ["run", "mssp_feedforward", "--case", "periodic.law_1", "--stop", "0.5", "--json", "--out", str(tmp_path)]
    done = subprocess.run(
        [HOSTS[others[0]], "-m", "tsm_fmu", *command],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["metrics"]
