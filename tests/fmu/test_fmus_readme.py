"""The folder ``fmus/``: the table of its README is that of the models."""

import importlib.util
from pathlib import Path

import pytest

from tsm_fmu.models import MODELS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def build_fmus():
    spec = importlib.util.spec_from_file_location("build_fmus", ROOT / "build_scripts" / "build_fmus.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_of_the_readme_is_current(build_fmus):
    readme = (ROOT / "fmus" / "README.md").read_text()
    assert build_fmus.with_table(readme) == readme, "run 'make fmus'"
    assert all(f"| {module.NAME} |" in readme for module in MODELS)
