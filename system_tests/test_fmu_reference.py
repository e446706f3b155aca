"""Every FMU reproduces the reference results that it carries, in a process that has FMPy and not our package."""

import json
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import MODELS

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"

REPLAY = """
import json, sys
sys.path.insert(0, sys.argv[1])             # FMPy and what it needs, from a folder without our package
import tempfile, zipfile
from xml.etree import ElementTree
import fmpy, numpy as np
try:
    import tsm_fmu
except ImportError:
    pass
else:
    sys.exit("tsm_fmu is on the path: this replay would prove nothing")

def experiments(folder):
    for related in ElementTree.parse(f"{folder}/fmi-ls-manifest.xml").getroot():
        if related.get("role").startswith("experiment/"):
            yield from ElementTree.parse(f"{folder}/{related.get('source')}").getroot().iter("Experiment")

def replay(fmu, folder, experiment):
    source = {child.tag: f"{folder}/{child.get('source')}" for child in experiment}
    stop, step, tolerance = (float(experiment.get(a)) for a in ("stopTime", "stepSize", "tolerance"))
    expected = fmpy.read_csv(source["References"])
    expected = expected[expected["time"] <= stop]
    parameters = ElementTree.parse(source["Parameters"]).getroot().findall(".//{*}Parameter")
    result = fmpy.simulate_fmu(
        fmu, stop_time=stop, step_size=step, output_interval=step, output=expected.dtype.names[1:],
        start_values={p.get("name"): p[0].get("value") for p in parameters},
        input=fmpy.read_csv(source["Stimuli"]) if "Stimuli" in source else None,
    )
    if len(result) != len(expected):
        return {"rows": [len(result), len(expected)]}
    return {
        name: float(np.abs(result[name] - expected[name]).max() / np.abs(expected[name]).max())
        for name in expected.dtype.names
        if not np.abs(result[name] - expected[name]).max() <= tolerance * np.abs(expected[name]).max()
    }

fmu = sys.argv[2]
with tempfile.TemporaryDirectory() as unpacked:
    zipfile.ZipFile(fmu).extractall(unpacked)
    folder = f"{unpacked}/extra/org.fmi-standard.fmi-ls-ref"
    found = {e.get("name"): replay(fmu, folder, e) for e in experiments(folder)}
assert "tsm_fmu" not in sys.modules
print(json.dumps(found))
"""


@pytest.fixture(scope="session")
def deviations(bare_packages) -> Callable[[Path], dict[str, dict[str, float]]]:
    """``deviations(path)``: by experiment, the columns that are off by more than the tolerance."""

    def replayed(path: Path) -> dict[str, dict[str, float]]:
        command = ["-I", "-S", "-c", REPLAY, str(bare_packages), str(path)]
        python = sys._base_executable  # type: ignore[attr-defined]
        done = subprocess.run([python, *command], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return replayed


def changed(fmu: Path, target: Path, name: str, change: Callable[[str], str]) -> Path:
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(target, "w") as new:
        for member in archive.namelist():
            data = archive.read(member)
            if member.endswith(name):
                text = change(data.decode())
                assert text != data.decode()
                data = text.encode()
            new.writestr(member, data)
    return target


@pytest.mark.parametrize("name", [module.NAME for module in MODELS])
def test_an_fmu_reproduces_its_reference(fmus, deviations, name):
    assert deviations(fmus(name)) == {"smoke-test": {}, "validation": {}}


def test_a_fitted_model_with_an_effect_carries_its_own_reference(deviations, tmp_path):
    fmu = build_fmu(
        chain("TendonDrive", ("backlash", "load_dependence")),
        tmp_path,
        name="Wrist",
        start_values={"x_out.backlash.w": 0.071, "load_dependence.k": 0.23, "alpha": 9.75},
    )
    assert deviations(fmu) == {"smoke-test": {}, "validation": {}}


def test_one_changed_number_in_the_results_is_found(fmus, deviations, tmp_path):
    def change(text: str) -> str:
        lines = text.splitlines()
        time, x_out, x_h = lines[200].split(",")
        lines[200] = ",".join((time, repr(float(x_out) + 3e-7), x_h))
        return "\n".join(lines) + "\n"

    damaged = changed(fmus("PairedTsmBacklash"), tmp_path / "a.fmu", "PairedTsmBacklash_out.csv", change)
    found = deviations(damaged)
    assert found["smoke-test"] == {}
    assert found["validation"].keys() == {"x_out"}
    assert found["validation"]["x_out"] == pytest.approx(3e-7 / 1.51, rel=0.01)


def test_other_equations_are_found(fmus, deviations, tmp_path):
    other = changed(
        fmus("PairedTsmBacklash"),
        tmp_path / "a.fmu",
        "coleman_hodgdon.py",
        lambda text: text.replace("math.exp(", "1.000001 * math.exp("),
    )
    assert deviations(other)["validation"].keys() == {"x_out", "x_h"}


@pytest.mark.parametrize("name", ["LebusTransmission", "ReferenceSignal"])
def test_the_parameter_set_is_valid_ssp(fmus, name):
    schema = etree.XMLSchema(etree.parse(Path(fmpy.__file__).parent / "ssp/schema/SystemStructureParameterValues.xsd"))
    with zipfile.ZipFile(fmus(name)) as archive:
        root = etree.fromstring(archive.read(f"{FOLDER}/parameters.ssv"))
    schema.assertValid(root)
    assert [p.get("name") for p in root[0]] == [v.name for v in kernel(name).parameters]
