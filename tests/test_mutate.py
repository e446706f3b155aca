"""The mutation run finds the tests that mirror a source file."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def mutate():
    spec = importlib.util.spec_from_file_location("mutate", ROOT / "build_scripts" / "mutate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("file", "tests"),
    [
        ("models/unit_text.py", ["tests/models/test_unit_text.py"]),
        ("checking/power.py", ["tests/checking"]),
        ("card.py", ["tests/test_card.py"]),
        ("__main__.py", []),
    ],
)
def test_tests_are_those_called_after_the_file_else_its_folder(mutate, file, tests):
    assert mutate.mirrored(mutate.PACKAGE / file, ROOT) == tests
