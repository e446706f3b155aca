"""Native units on each platform: the size of every library, a host in C, Windows under wine, ARM under qemu."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import GLIBC, LIMIT
from tsm_fmu.kernels.kernel import Kernel, kernel

NAMES = ("TendonDrive", "PairedTsmFriction")
SOURCE = Path(__file__).with_name("unit_host.c")
STEPS, STEP = 600, 2.0**-9
UCRT = [f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("stdio", "runtime", "private", "string")]
ARM_C_LIBRARY = Path("/usr/aarch64-linux-gnu")
VERSIONS = pytest.mark.parametrize("fmi", [2, 3])


def expected(k: Kernel) -> list[float]:
    """The first output every 100 steps, by plain Python; inputs but the first rest at 0."""
    rest = [v.start for v in k.inputs][1:]
    s, _ = k.module.start(k.params(), k.module.Inputs(*(v.start for v in k.inputs)))
    rows = []
    for n in range(STEPS):
        s, o = k.module.step(k.params(), s, k.module.Inputs((n * 37 % 200) / 400.0 - 0.2, *rest), STEP)
        rows.append(o[0])
    return rows[99::100]


def host_of(path: Path, library: Path, fmi: int, compiler: list[str], program: Path, **more: int) -> Path:
    """Compile the host for one unit."""
    described = fmpy.read_model_description(str(path))
    references = {v.name: v.valueReference for v in described.modelVariables}
    k = kernel(str(described.modelName))
    given = {
        "FMI": fmi,
        "LIBRARY": f'"{library.name}"' if library.suffix == ".dll" else f'"{library}"',
        "TOKEN": f'"{described.guid}"',
        "VR_IN": references[k.inputs[0].name] if k.inputs else 0,
        "INPUTS": min(len(k.inputs), 1),
        "VR_OUT": references[k.outputs[0].name],
        "STEPS": STEPS,
        "STEP": STEP,
    } | more
    flags = [f"-D{name}={value}" for name, value in given.items()]
    done = subprocess.run([*compiler, *flags, str(SOURCE), "-o", str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def built(name: str, fmi: int, platform: str, folder: Path) -> tuple[Path, Path]:
    """An FMU for one platform, and its library unpacked."""
    path = build_fmu(kernel(name), folder / "unit.fmu", name=name, flavour="native", fmi=fmi, platforms=[platform])
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return path, next((folder / "binaries" / platform).iterdir())


@VERSIONS
@pytest.mark.parametrize("name", NAMES)
def test_a_host_in_c_gets_the_numbers_of_plain_python(tmp_path, name, fmi):
    if not shutil.which("gcc"):
        pytest.skip("no gcc here: install it")
    path, library = built(name, fmi, {2: "linux64", 3: "x86_64-linux"}[fmi], tmp_path)
    program = host_of(path, library, fmi, ["gcc", "-ldl"], tmp_path / "host")
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert [float(line) for line in done.stdout.split()] == expected(kernel(name))


@VERSIONS
def test_a_million_lives_and_ten_million_steps_without_growth(tmp_path, fmi):
    if not shutil.which("gcc"):
        pytest.skip("no gcc here: install it")
    path, library = built("TendonDrive", fmi, {2: "linux64", 3: "x86_64-linux"}[fmi], tmp_path)
    soak = {"LIVES": 1_000_000, "STEPS": 10_000_000}
    program = host_of(path, library, fmi, ["gcc", "-O1", "-ldl"], tmp_path / "host", **soak)
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(done.stdout) < 100  # kB; one byte a life would be 900


@pytest.fixture(scope="module")
def wine_prefix(tmp_path_factory) -> Path:
    """Where wine keeps its Windows; made at the first run."""
    return tmp_path_factory.mktemp("wine")


@VERSIONS
@pytest.mark.parametrize("name", NAMES)
def test_the_windows_library_under_wine_agrees_to_1e_12(tmp_path, wine_prefix, name, fmi):
    debian = Path("/usr/lib/wine/wine64")
    wine = shutil.which("wine64") or shutil.which("wine") or (str(debian) if debian.exists() else None)
    if wine is None:
        pytest.skip("no wine here: install Debian's wine64")
    path, library = built(name, fmi, {2: "win64", 3: "x86_64-windows"}[fmi], tmp_path)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"]
    compiled = host_of(path, library, fmi, [*zig, "-O1", "-fno-sanitize=all", "-c"], tmp_path / "host.o")
    program = library.parent / "host.exe"  # beside the library, where Windows looks for it
    linking = [*zig, "-nostdlib", str(compiled), "-lkernel32", *UCRT, "-o", str(program)]
    done = subprocess.run(linking, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    environment = {**os.environ, "WINEPREFIX": str(wine_prefix), "WINEDEBUG": "-all", "DISPLAY": ""}
    done = subprocess.run([wine, str(program)], capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    np.testing.assert_allclose([float(line) for line in done.stdout.split()], expected(kernel(name)), rtol=1e-12)


@pytest.mark.parametrize("name", ["LebusCompensator", "DcMotor"])
def test_every_library_of_the_largest_models_is_small(tmp_path, name):
    """FMI 3.0: more functions and platforms than 2.0. `python -m benchmarks.library_sizes` measures all models."""
    path = build_fmu(kernel(name), tmp_path / "unit.fmu", flavour="native", fmi=3)
    with zipfile.ZipFile(path) as archive:
        sizes = {i.filename: i.file_size for i in archive.infolist() if i.filename.startswith("binaries/")}
    assert len(sizes) == 5
    assert max(sizes.values()) < LIMIT, sizes


@pytest.mark.parametrize("name", NAMES)
def test_the_arm_library_under_qemu_agrees_to_1e_12(tmp_path, name):
    emulator = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    if emulator is None:
        pytest.skip("no qemu-aarch64 here: install qemu-user-static")
    if not (ARM_C_LIBRARY / "lib/ld-linux-aarch64.so.1").exists():
        pytest.skip("no C library of ARM here: install Debian's libc6-arm64-cross")
    path, library = built(name, 3, "aarch64-linux", tmp_path)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", f"aarch64-linux-gnu.{GLIBC}", "-O1", "-ldl"]
    program = host_of(path, library, 3, zig, tmp_path / "host")
    done = subprocess.run([emulator, "-L", str(ARM_C_LIBRARY), str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    np.testing.assert_allclose([float(line) for line in done.stdout.split()], expected(kernel(name)), rtol=1e-12)
