"""Units in fmu-manipulation-toolbox, each flavour and FMI version: in a container FMU, and with remoting added."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmu_manipulation_toolbox.assembly import Assembly

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel

NAME = "TendonDrive"
STEP, STEPS = 2.0**-7, 160
OUTPUTS = [v.name for v in kernel(NAME).outputs]
SINE = 0.3 * np.sin(4.1 * STEP * np.arange(STEPS + 1)) + 0.04
FLAVOURS = pytest.mark.parametrize(("flavour", "fmi"), [("native", 2), ("native", 3), ("python", 2)])


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """``unit(flavour, fmi)``: an FMU, built at its first use."""
    folder = tmp_path_factory.mktemp("units")

    def built(flavour: str, fmi: int, *platforms: str) -> Path:
        path = folder / f"{flavour}_{fmi}_{'_'.join(platforms)}.fmu"
        if not path.exists():
            build_fmu(kernel(NAME), path, name=NAME, flavour=flavour, fmi=fmi, platforms=platforms)
        return path

    return built


def expected() -> np.ndarray:
    """Outputs where FMPy sets row k and steps from t_k: by plain Python."""
    m, p = kernel(NAME).module, kernel(NAME).params()
    s, o = m.start(p, m.Inputs(float(SINE[0]), 0.0))
    rows = [list(o)]
    for n in range(STEPS):
        s, o = m.step(p, s, m.Inputs(float(SINE[n]), 0.0), STEP)
        rows.append(list(o))
    return np.array(rows)


def simulated(path: Path) -> np.ndarray:
    """The same through FMPy."""
    time = STEP * np.arange(STEPS + 1)
    signal = np.array(list(zip(time, SINE, strict=True)), dtype=[("time", float), ("x_in", float)])
    rows = fmpy.simulate_fmu(
        str(path), stop_time=STEPS * STEP, step_size=STEP, output_interval=STEP, input=signal, output=OUTPUTS
    )
    return np.array([[row[name] for name in OUTPUTS] for row in rows])


@FLAVOURS
@pytest.mark.parametrize("container", [2, 3])
def test_a_container_gives_the_same_last_digits(unit, tmp_path, flavour, fmi, container):
    platforms = ["x86_64-linux" if fmi == 3 else "linux64"] if flavour == "native" else []
    shutil.copy(unit(flavour, fmi, *platforms), tmp_path / "unit.fmu")
    plan = {
        "name": "system", "step_size": STEP, "fmu": ["unit.fmu"], "input": [["x_in", "unit.fmu", "x_in"]],
        "output": [["unit.fmu", name, name] for name in OUTPUTS],
    } | {f"auto_{what}": False for what in ("link", "input", "output", "parameter", "local")}  # fmt: skip
    (tmp_path / "system.json").write_text(json.dumps(plan), encoding="utf-8")
    Assembly("system.json", fmu_directory=tmp_path).make_fmu(filename="system.fmu", fmi_version=container)
    found = simulated(tmp_path / "system.fmu")
    assert found.shape == (STEPS + 1, len(OUTPUTS))
    np.testing.assert_allclose(found[1:], expected()[1:], rtol=1e-12, atol=0)
    assert np.ptp(found, axis=0)[:2].min() > 0.01


@FLAVOURS
def test_a_unit_with_remoting_stays_what_it_was(unit, tmp_path, flavour, fmi):
    """The toolbox puts a server beside the 64-bit library for Windows, and a 32-bit one that calls it."""
    if fmi == 3:
        pytest.skip("the toolbox adds remoting to FMI 2.0 alone")
    path = unit(flavour, fmi, *(["linux64", "win64"] if flavour == "native" else []))
    command = [sys.executable, "-m", "fmu_manipulation_toolbox", "-input", str(path), "-add-remoting-win32", "-output"]
    done = subprocess.run([*command, str(tmp_path / "remote.fmu")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(path) as before, zipfile.ZipFile(tmp_path / "remote.fmu") as after:
        added = set(after.namelist()) - set(before.namelist())
        assert {f"binaries/win32/{NAME}.dll", "binaries/win64/server_sm.exe"} <= added
        for name in before.namelist():
            if name.startswith(("binaries/", "resources/")) and not name.endswith("/"):
                assert after.read(name) == before.read(name)
    np.testing.assert_array_equal(simulated(tmp_path / "remote.fmu"), simulated(path))
