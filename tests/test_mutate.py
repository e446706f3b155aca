"""The mutation run finds the tests that mirror a source file."""

import ast
import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def mutate():
    spec = importlib.util.spec_from_file_location("mutate", ROOT / "build_scripts" / "mutate.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutate"] = module  # its dataclasses look there
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("file", "tests"),
    [
        ("models/unit_text.py", ["tests/models"]),
        ("checking/power.py", ["tests/checking"]),
        ("checking", ["tests/checking"]),
        ("batching/cluster.py", ["tests/batching", "tests/cosim/test_cluster.py"]),
        ("card.py", ["tests/test_card.py"]),
        ("__main__.py", []),
    ],
)
def test_tests_are_those_of_the_folder_else_those_called_after_the_file(mutate, file, tests):
    found = mutate.mirrored(mutate.PACKAGE / file, ROOT)
    assert found[: len(tests)] == tests  # then files elsewhere that import what the folder's own do not
    assert bool(found) == bool(tests)
    assert len(set(found)) == len(found)


TEXT = '''"""Text."""
LIMIT = 3.7


def clipped(x: float | None, low: float = -1.0) -> float:
    if x is None:
        return low
    y = min(
        x,
        LIMIT,
    )
    return y
'''


def test_what_no_test_can_see_is_not_drawn(mutate, tmp_path):
    pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed (pip install tsm-fmu[mutation])")
    place = tmp_path / "made_up.py"
    place.write_text(
        "from functools import cache\n\n\n@cache\ndef f(x: int | None) -> float | None:\n    return x + 1\n"
    )
    found = list(mutate.mutants_of(tmp_path, Path(place.name)))
    assert {m.line for m in found} == {6}
    assert {m.operator.rpartition("/")[2] for m in found} > {"NumberReplacer", "ReplaceBinaryOperator_Add_Sub"}


@pytest.mark.parametrize(("line", "statement"), [(2, (2, 2)), (5, (5, 5)), (6, (6, 6)), (7, (7, 7)), (10, (8, 11))])
def test_a_line_belongs_to_its_innermost_statement(mutate, line, statement):
    assert mutate._statement(ast.parse(TEXT), line) == statement


def test_tests_of_a_line_are_those_that_run_it_cheapest_first_within_the_budget(mutate, tmp_path):
    (tmp_path / "f.py").write_text(TEXT)
    lines = {"f.py": {2: [""], 5: [""], 6: ["t::a", "t::b", "t::c"], 7: ["t::b"], 8: ["t::c", "t::a", "t::d"]}}
    covered = mutate.Covered(lines, {"t::a": 2.0, "t::b": 1.0, "t::c": 0.5, "t::d": 100.0})

    def asked(line: int) -> list[str]:
        return covered.tests_of(tmp_path, mutate.Mutant(Path("f.py"), line, "", 0))[0]

    assert asked(7) == ["t::b"]
    assert asked(10) == ["t::c", "t::a"]  # and d is too dear
    assert asked(2) == ["t::c", "t::a"]  # a constant: who runs a line with its name
    assert asked(5) == ["t::c", "t::b", "t::a"]  # a default: who runs the function
    for line in (2, 5):
        covered.lines["f.py"][line] = ["t::e"]  # which imports the file: others use it too
    assert asked(2) == ["t::e", "t::c", "t::a"]
    assert asked(5) == ["t::e", "t::c", "t::b", "t::a"]
