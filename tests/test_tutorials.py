"""The tutorials print what their pages say."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def script():
    spec = importlib.util.spec_from_file_location("tutorials", ROOT / "build_scripts" / "tutorials.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules["tutorials"] = module
    spec.loader.exec_module(module)
    return module


TUTORIALS = script()
PAGES = sorted(page for page in TUTORIALS.PAGES.glob("*.md") if any(TUTORIALS.steps(page.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_a_tutorial_prints_what_its_page_says(page, tmp_path):
    for step in TUTORIALS.steps(page.read_text(encoding="utf-8")):
        printed = TUTORIALS.ran(step.command, tmp_path)
        assert TUTORIALS.difference(step.expected, printed) == "", f"$ {step.command}"


@pytest.mark.parametrize(
    ("expected", "printed", "same"),
    [
        ("x 1.000 rad\n", "x 1.004 rad\n", True),
        ("x 1.000 rad\n", "x 1.04 rad\n", False),
        ("x 1.000 rad\n", "y 1.000 rad\n", False),
        ("x 1\n", "x 1\ny 2\n", False),
        ("...\nend 3\n", "any\nthing\nend 3\n", True),
        ("...\nend 3\n", "any\nthing\nend 4\n", False),
        ("took ... s\n", "took 2.31 s\n", True),
        ("a  ---  b\n", "a  -----  b\n", True),
    ],
)
def test_outputs_are_compared_by_words_and_numbers(expected, printed, same):
    assert (TUTORIALS.difference(expected, printed) == "") is same
