"""Set-up promises: supported Pythons are named, others refused, pins name no place to fetch from."""

import importlib.util
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def setup_venv():
    spec = importlib.util.spec_from_file_location("setup_venv", ROOT / "build_scripts" / "setup_venv.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_unsupported_python_is_refused_with_those_that_are(setup_venv, monkeypatch):
    monkeypatch.setattr(setup_venv, "version_of", lambda _python: "3.9")
    with pytest.raises(
        SystemExit, match=r"expected one of 3\.11, 3\.12, 3\.13 -- install one, or name it: make PYTHON="
    ):
        setup_venv.main("")


def test_another_supported_python_on_the_path_is_taken(setup_venv, monkeypatch):
    monkeypatch.setattr(setup_venv.shutil, "which", lambda name: f"/opt/{name}")
    monkeypatch.setattr(setup_venv, "version_of", lambda python: "3.12" if python == "/opt/python3.12" else "3.9")
    assert setup_venv.supported_python() == "/opt/python3.12"


def test_a_python_that_does_not_run_has_no_version(setup_venv, tmp_path):
    assert setup_venv.version_of(str(tmp_path / "python3")) is None
    assert setup_venv.version_of(sys.executable) == f"{sys.version_info[0]}.{sys.version_info[1]}"


def test_set_up_and_project_support_the_same_versions(setup_venv):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lowest, highest = setup_venv.SUPPORTED[0], setup_venv.SUPPORTED[-1]
    above = f"3.{int(highest.partition('.')[2]) + 1}"
    assert project["requires-python"] == f">={lowest},<{above}"
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(version in readme for version in setup_venv.SUPPORTED)


def test_every_dependency_is_pinned_and_no_pin_carries_an_address():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if line and not line.startswith("#")]
    assert all(re.fullmatch(r"[\w.\-]+==[\w.+!]+", line) for line in lines)
    pinned = {line.partition("==")[0].lower().replace("_", "-") for line in lines}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    names = {re.split(r"[=<>\[;~!]", name)[0].strip().lower().replace("_", "-") for name in wanted}
    assert names <= pinned
