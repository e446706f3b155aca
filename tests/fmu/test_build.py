"""The archive: what is in it, that equal content gives equal bytes, and what is refused."""

import ast
import os
import shutil
import stat
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import pythonfmu

from tsm_fmu import InputError
from tsm_fmu.fmu import build, slave
from tsm_fmu.fmu.build import LOWEST_PYTHON, build_fmu, needed_sources
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import MODELS

NAME = "PairedTsmBacklash"
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory) -> Path:
    return build_fmu(kernel=kernel(NAME), out=tmp_path_factory.mktemp("build"))


def files_of(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def guid_of(path: Path) -> str:
    return files_of(path)["modelDescription.xml"].decode().partition('guid="')[2].partition('"')[0]


@pytest.mark.parametrize("seed", ["0", "731"])
def test_a_build_in_another_process_gives_the_same_bytes(fmu, tmp_path, seed):
    code = (
        "import sys, pathlib; from tsm_fmu.kernels.kernel import kernel; from tsm_fmu.fmu.build import build_fmu;"
        f"build_fmu(kernel({NAME!r}), pathlib.Path(sys.argv[1]))"
    )
    sources = os.environ.get("PYTHONPATH", "")  # where it names the sources, both builds are of the same
    environment = {"PYTHONHASHSEED": seed, "TZ": "Asia/Kathmandu", "PATH": "", "PYTHONPATH": sources}
    subprocess.run([sys.executable, "-c", code, tmp_path], check=True, env=environment, cwd=tmp_path)
    assert (tmp_path / f"{NAME}.fmu").read_bytes() == fmu.read_bytes()


def test_the_file_name_does_not_change_the_content(fmu, tmp_path):
    assert build_fmu(kernel(NAME), tmp_path / "another.fmu").read_bytes() == fmu.read_bytes()


def test_start_values_and_name_change_the_guid(fmu, tmp_path):
    fitted = build_fmu(kernel(NAME), tmp_path / "a.fmu", start_values={"alpha": 9.75})
    renamed = build_fmu(kernel(NAME), tmp_path / "b.fmu", name="Wrist")
    assert len({guid_of(fmu), guid_of(fitted), guid_of(renamed)}) == 3
    assert 'modelName="Wrist"' in files_of(renamed)["modelDescription.xml"].decode()
    assert "binaries/linux64/Wrist.so" in files_of(renamed)


def test_start_values_equal_to_the_defaults_are_the_same_fmu(fmu, tmp_path):
    same = build_fmu(kernel(NAME), tmp_path, start_values={"alpha": 10.1062, "c": 1.00056})
    assert same.read_bytes() == fmu.read_bytes()


@pytest.mark.parametrize("part", [0.9, 1.05])
def test_values_above_and_below_the_defaults_are_written_and_no_others(part):
    model = kernel(NAME)
    given = {name: model.named(model.params())[name] * part for name in ("alpha", "beta")}
    assert build._changed(model, model.params(values=given)) == given
    assert build._changed(model, model.params()) == {}


def test_archive_is_deflated_and_undated(fmu):
    with zipfile.ZipFile(fmu) as archive:
        for info in archive.infolist():
            assert info.date_time == (1980, 1, 1, 0, 0, 0)
            assert info.compress_type == zipfile.ZIP_DEFLATED
    assert fmu.stat().st_size < 0.5 * sum(map(len, files_of(fmu).values()))


def test_an_archive_is_the_same_from_any_system_sorted_and_its_libraries_may_run(fmu):
    with zipfile.ZipFile(fmu) as archive:
        listed = archive.infolist()
    assert [info.filename for info in listed] == sorted(info.filename for info in listed)
    for info in listed:
        runs = info.filename.startswith("binaries/")
        assert stat.filemode(info.external_attr >> 16) == ("?rwxr-xr-x" if runs else "?rw-r--r--")
        assert info.external_attr & 0xFFFF == 0
        assert info.create_system == 3  # Unix, where these modes count
    assert any(info.filename.startswith("binaries/") for info in listed)


def test_module_names_carry_the_tag_of_the_content(fmu):
    tag = guid_of(fmu).replace("-", "")[:12]
    assert files_of(fmu)["resources/slavemodule.txt"].decode() == f"{NAME}_{tag}"
    tops = {name.split("/")[1] for name in files_of(fmu) if name.startswith("resources/")}
    assert tops == {"slavemodule.txt", f"{NAME}_{tag}.py", f"tsm_fmu_{tag}"}


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_kernel_files_import_the_standard_library_and_each_other_only(module):
    for name, text in needed_sources(module).items():
        assert name.startswith(("tsm_fmu.models.", "tsm_fmu.effects."))
        absolute = {n.module for n in ast.walk(ast.parse(text)) if isinstance(n, ast.ImportFrom) and not n.level}
        plain = {a.name for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Import) for a in n.names}
        assert absolute | plain <= {"math", "typing"}, name


def test_what_the_fmu_needs_stands_where_a_host_reads_it(fmu):
    files, tag = files_of(fmu), guid_of(fmu).replace("-", "")[:12]
    needs = "Needs Python 3.10 or later in the process of the host (libpython), on Linux also glibc 2.32"
    assert f"mechanism. {needs}" in files["modelDescription.xml"].decode()
    assert needs in files[f"resources/{NAME}_{tag}.py"].decode()
    assert needs in files[f"resources/tsm_fmu_{tag}/__init__.py"].decode()


def test_an_older_python_is_refused_with_what_is_needed(fmu, monkeypatch):
    text = files_of(fmu)[f"resources/tsm_fmu_{guid_of(fmu).replace('-', '')[:12]}/__init__.py"].decode()
    exec(text, {})  # noqa: S102  from the archive that was built above
    monkeypatch.setattr(sys, "version_info", (3, 9, 18, "final", 0))
    with pytest.raises(ImportError, match=rf"^{NAME} in Python 3\.9\.18 -- Needs Python 3\.10 or later"):
        exec(text, {})  # noqa: S102


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_what_is_packed_is_written_for_the_lowest_python(module):
    for name, text in needed_sources(module, slave).items():
        ast.parse(text, name, feature_version=LOWEST_PYTHON)


def test_only_the_needed_files_are_packed(fmu):
    packed = {Path(n).name for n in files_of(fmu) if "/models/" in n}
    assert packed == {"__init__.py", "contract.py", "roles.py", "coleman_hodgdon.py", "paired_tsm_backlash.py"}


def test_licences_and_icon_are_inside(fmu):
    files = files_of(fmu)
    assert files["documentation/licenses/license.txt"] == (ROOT / "LICENSE").read_bytes()
    assert b"MIT License" in files["documentation/licenses/PythonFMU.txt"]
    signature, width, height = struct.unpack(">8s8xII", files["model.png"][:24])
    assert (signature, width, height) == (b"\x89PNG\r\n\x1a\n", 128, 128)


def test_no_path_of_this_machine_is_packed(fmu):
    home = str(ROOT).encode()
    assert not [name for name, data in files_of(fmu).items() if home in data]


@pytest.mark.parametrize("name", ["a b", "1st", "x-y", "größe", "class", "../x"])
def test_a_name_that_is_no_identifier_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"^FMU name '.*' -- expected letters, digits and underscores"):
        build_fmu(kernel(NAME), tmp_path, name=name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gain": 1.0}, "parameter 'gain' of PairedTsmBacklash -- expected one of c, beta"),
        ({"alpha": -2.5}, r"parameter alpha = -2\.5 1/rad"),
        ({"beta": -1.75}, r"beta = -1\.75 with c"),
    ],
)
def test_start_values_are_checked(tmp_path, values, message):
    with pytest.raises(InputError, match=message):
        build_fmu(kernel(NAME), tmp_path, start_values=values)


def test_a_file_in_the_way_is_reported(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(InputError, match=r"taken/x\.fmu could not be written \(.*\) -- expected a writable place"):
        build_fmu(kernel(NAME), tmp_path / "taken" / "x.fmu")


def test_the_copy_of_pythonfmu_that_a_unit_has_left_is_not_built_from(tmp_path):
    package = tmp_path / "resources" / "pythonfmu"
    shutil.copytree(Path(pythonfmu.__file__).parent, package, ignore=shutil.ignore_patterns("resources", "tests"))
    code = "import sys; sys.path.insert(0, sys.argv[1]); from tsm_fmu.cli import main; main(sys.argv[2:])"
    words = [sys.executable, "-c", code, str(package.parent), "build", NAME, "--out", str(tmp_path / "out")]
    run = subprocess.run(words, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert f"pythonfmu of {package} -- expected the installed one" in run.stderr
