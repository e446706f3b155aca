"""Native FMUs in hosts that are not Python: in C, libcosim and ecos; under valgrind and sanitizers."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel

from . import c_host

NAME = "TendonDrive"
STEPS = 200
STEP = 2.0**-7
START = ("instantiate", "setup", "enter", "exit")
WARNINGS = ("-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="module")
def fmu(native_fmus) -> Path:
    return native_fmus(NAME)


@pytest.fixture(scope="module")
def folder(fmu, tmp_path_factory) -> Path:
    return Path(fmpy.extract(str(fmu), str(tmp_path_factory.mktemp("unpacked") / "here # (+%20)")))


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    try:
        return c_host.compiled(tmp_path_factory.mktemp("c_host"))
    except c_host.Missing as missing:
        pytest.skip(str(missing))


def expected(steps: int = STEPS) -> list[list[float]]:
    """Outputs of the kernel with its inputs held at what the hosts set: x_in = 0.3 from the first step on."""
    k = kernel(NAME)
    s, _ = k.module.start(k.params(), k.module.Inputs(0.0, 0.0))
    rows = []
    for _ in range(steps):
        s, o = k.module.step(k.params(), s, k.module.Inputs(0.3, 0.0), STEP)
        rows.append(list(o))
    return rows


def reference(name: str, folder: Path) -> int:
    described = fmpy.read_model_description(str(folder))
    return next(v.valueReference for v in described.modelVariables if v.name == name)


def test_a_c_host_without_python_and_a_path_with_odd_characters(program, folder):
    x_in, x_out = reference("x_in", folder), reference("x_out", folder)
    done = c_host.run(program, folder, *START, f"set={x_in},0.3", f"step=0,{STEP}", f"get={x_out}", "terminate", "free",
                      python="-")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert f"get={x_out} 0 {expected(1)[0][0]!r}" in done.stdout or repr(expected(1)[0][0])[:15] in done.stdout
    wrong = c_host.run(program, folder, "step=0,0.1", python="-")
    assert wrong.returncode != 0 or "3" in wrong.stdout


def test_threads_and_forty_thousand_refused_steps_keep_nothing(program, folder):
    x_in, x_out = reference("x_in", folder), reference("x_out", folder)
    lines = c_host.run(program, folder, f"threads=4,20000,{x_in},{x_out}", python="-").stdout.splitlines()
    assert len({line.split()[-1] for line in lines}) == 1
    refused = c_host.run(program, folder, *START, "refused=40000", python="-").stdout.splitlines()[-1]
    assert refused.split()[1] == "3"
    assert int(refused.split()[2]) < 24  # a text is 200


def test_valgrind_finds_nothing_in_the_c_host(program, folder):
    if not shutil.which("valgrind"):
        pytest.skip("no valgrind here: install it")
    x_in, x_out = reference("x_in", folder), reference("x_out", folder)
    library, guid = folder / f"binaries/linux64/{NAME}.so", fmpy.read_model_description(str(folder)).guid
    calls = (*START, f"set={x_in},0.3", f"step=0,{STEP}", f"get={x_out}", "step=7,0.1", "reset", "terminate", "free")
    command = [
        "valgrind",
        "-q",
        "--error-exitcode=9",
        "--leak-check=full",
        str(program),
        "-",
        str(library),
        str(guid),
        "",
        *calls,
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_sources_inside_compile_alone_without_a_warning(native_fmus, tmp_path, compiler, fmi):
    command = [compiler] if shutil.which(compiler) else [sys.executable, "-m", "ziglang", "cc"]
    if compiler == "gcc" and not shutil.which("gcc"):
        pytest.skip("no gcc here: install it")
    with zipfile.ZipFile(native_fmus("DistalEstimator", fmi)) as archive:
        archive.extractall(tmp_path)
    sources = tmp_path / "sources"
    done = subprocess.run([*command, *WARNINGS, "-fPIC", "-c", "all.c"], cwd=sources, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


MAIN = r"""
#include <stdio.h>
#include "slave.h"

int main(void)
{
    Values v = model_start_values;
    State s, after;
    Outputs y;
    Fault fault = {false, ""};
    int k, j;
    model_start(&v.p, &v.u, &s, &y, &fault);
    for (k = 0; k < 2000 && !fault.raised; k++) {
        for (j = FIRST_INPUT; j < FIRST_OUTPUT; j++) {
            value_put(&v, j, (1.0 + 0.1 * j) * (1.0 + ((k * 37 + 11 * j) % 200) / 400.0));
        }
        model_step(&v.p, &s, &v.u, STEP, &after, &y, &fault);
        s = after;
        if (k % 400 == 399) {
            printf("%.17g\n", *(double *)(void *)&y);
        }
    }
    puts(fault.text);
    return 0;
}
"""


def with_main(path: Path, folder: Path) -> Path:
    """Sources of a model with a program that steps it."""
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    (folder / "sources/main.c").write_text(MAIN.replace("STEP", repr(STEP)))
    return folder / "sources"


def stepped(name: str) -> list[float]:
    """What that program prints, by plain Python."""
    k = kernel(name)
    first = len(k.parameters)
    starts = [v.start for v in k.inputs]
    s, _ = k.module.start(k.params(), k.module.Inputs(*starts))
    found = []
    for n in range(2000):
        u = [(1.0 + 0.1 * j) * (1.0 + ((n * 37 + 11 * j) % 200) / 400.0) for j in range(first, first + len(starts))]
        s, o = k.module.step(k.params(), s, k.module.Inputs(*u), STEP)
        if n % 400 == 399:
            found.append(o[0])
    return found


@pytest.mark.parametrize("name", ["TendonDrive", "DcMotor", "PairedTsmFriction", "LebusTransmission"])
def test_sanitizers_find_nothing(native_fmus, tmp_path, name):
    if not shutil.which("gcc"):
        pytest.skip("no gcc here: install it")
    sources = with_main(native_fmus(name), tmp_path)
    flags = [*WARNINGS, "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run(["gcc", *flags, "all.c", "main.c", "-lm", "-o", "checked"], cwd=sources, check=True)
    done = subprocess.run([sources / "checked"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert [float(x) for x in done.stdout.split()] == stepped(name)


def test_libcosim_gives_the_same_last_digit(fmu):
    from libcosimpy.CosimEnums import CosimVariableType  # noqa: F401  fails here where the library cannot load
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=round(STEP * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(fmu), instance_name="drive"))
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    execution.add_observer(observer)
    execution.add_manipulator(manipulator)
    described = fmpy.read_model_description(str(fmu))
    references = {v.name: v.valueReference for v in described.modelVariables}
    manipulator.slave_real_values(slave, [references["x_in"]], [0.3])
    assert execution.step(STEPS)
    names = [v.name for v in kernel(NAME).outputs]
    values = observer.last_real_values(slave, [references[n] for n in names])
    np.testing.assert_allclose(values, expected()[-1], rtol=1e-12)


def test_libcosim_knows_no_fmi_3(native_fmus):
    """As `fmus/README.md` says; once it does, the test above is for both versions."""
    from libcosimpy.CosimSlave import CosimLocalSlave

    assert not CosimLocalSlave(fmu_path=str(native_fmus(NAME, 3)), instance_name="drive").ptr()


@pytest.mark.parametrize("fmi", [2, 3])
def test_ecos_gives_the_same_last_digit(native_fmus, tmp_path, fmi):
    fmu = native_fmus(NAME, fmi)
    script = (
        "import json, sys\nfrom ecospy import EcosSimulation, EcosSimulationStructure\n"
        "structure = EcosSimulationStructure()\nstructure.add_model('drive', sys.argv[1])\n"
        f"sim = EcosSimulation(structure=structure, step_size={STEP})\nsim.init()\n"
        f"sim.set_real('drive::x_in', 0.3)\nsim.step({STEPS})\n"
        # to a file: ecos writes to stdout from a thread of its own, now and then after our last line
        "json.dump([sim.get_real('drive::' + n) for n in sys.argv[2:]], open('end.json', 'w'))\nsim.terminate()\n"
    )
    names = [v.name for v in kernel(NAME).outputs]
    done = subprocess.run(
        [sys.executable, "-c", script, str(fmu), *names], capture_output=True, text=True, cwd=tmp_path
    )
    if "libtbb" in done.stderr:
        pytest.skip("ecos needs Debian's libtbb12: install it")
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(json.loads((tmp_path / "end.json").read_text()), expected()[-1], rtol=1e-12)
