"""Thresholds stand in one file for each question, with their reasons, and the docs show those values."""

from __future__ import annotations

import ast
import importlib.util
import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


FINENESS = {
    "rows and samples": ("REACH", "ROWS", "SIMULATED_ROWS", "COMPARED_ROWS", "PROBE_ROWS", "ROUGH_ROWS", "LONG_ROWS",
                         "COLUMNS", "REPLAYED", "STEP", "LENGTH", "ROUNDED", "FEWEST", "PAST_SAMPLES"),
    "bins": ("FEWEST_BINS", "BINS", "HALF_WIDTH", "ANGLES"),
    "draws": ("NULLS", "SURROGATES", "RESAMPLES", "SMALLEST", "LEVEL"),
    "numerics": ("STEPS", "RIDGE", "DAMPING", "DECIBEL", "SHAPES", "SHRUNK", "FIRST_STEPS", "FIRST_ROWS",
                 "RIVALS", "CHANGED_VALUES",
                 "EARLY_STEPS", "PROBE_STEPS", "FOLD_STEPS", "FURTHER_STEPS", "LAST_STEPS", "REFINED_STEPS",
                 "LEAST_CHANGE", "REFINED_GAIN", "UNDER_WAY_GAIN", "INDEPENDENT", "AT_AN_END", "PROPORTIONAL", "SWEEPS",
                 "NO_GAIN", "ALONE_GAIN",
                 "NUISANCE_STARTS", "STARTS", "OVERTAKINGS", "UNREACHED", "CLOSED", "NOISE_DEVIATIONS", "PAST_STROKES",
                 "PADDING", "PARTS", "TURNS", "HIGHEST", "MORE_STEPS", "UNSEEN_CHANGE"),
    "the library of functions": ("DISTANCES", "SPEEDS", "WIDTHS", "LAGS", "CENTRED", "HOLD", "TURNING_RAD", "ALIKE",
                                 "BLOCKS", "MOST_FOLDS", "HARMONICS", "SINGLE", "HATS", "LAGGED"),
    "what a page holds": ("LEADING", "MOST_PLACES", "MOST_RUNS", "MOST_DRAWN", "DISTINCT"),
}  # fmt: skip
"""Constants that decide nothing: how finely something is computed, what is offered, how much is drawn."""


def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("write_criteria", ROOT / "build_scripts" / "write_criteria.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def constants(path: Path) -> dict[str, ast.expr]:
    """Upper-case names that a module sets to numbers."""
    found = {}
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            parts = [n for n in ast.walk(statement.value) if isinstance(n, ast.Constant)]
            if parts and all(isinstance(n.value, (int, float)) for n in parts):
                found[statement.targets[0].id] = statement.value
    return found


@pytest.mark.parametrize(("module", "page"), list(script().PAGES.items()))
def test_the_docs_have_the_values_and_reasons_of_the_code(module: str, page: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert script().updated(text, module) == text, "run python build_scripts/write_criteria.py"
    for name, value in vars(import_module(module)).items():
        if name.isupper() and isinstance(value, float) and name.endswith("_SHARE"):
            assert re.search(rf"`{name}` \| {re.escape(f'{100 * value:.12g}')} % \| [A-Z]", text), name


@pytest.mark.parametrize("module", list(script().PAGES))
def test_every_criterion_is_used_and_none_stands_elsewhere(module: str) -> None:
    home = Path(str(import_module(module).__file__))
    others = {path: path.read_text(encoding="utf-8") for path in home.parent.rglob("*.py") if path != home}
    for name in constants(home):
        assert any(re.search(rf"\b{name}\b", text) for text in others.values()), f"{name} decides nothing"
    elsewhere = {name: path for path in others for name in constants(path)}
    for name in set(elsewhere) - {name for names in FINENESS.values() for name in names}:
        raise AssertionError(f"{name} of {elsewhere[name].name} -- expected in {home.name}, or in FINENESS")


def test_a_criterion_without_a_reason_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "some_criteria.py").write_text('"""Doc."""\n\n# One\n\nLEAST_SHARE = 0.02\n\nMOST = 3.0\n"""Why."""\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match="LEAST_SHARE -- expected a sentence"):
        script().criteria("some_criteria")


def test_values_are_shown_with_their_units() -> None:
    shown = script().shown
    assert shown("A_SHARE", 0.012) == "1.2 %"
    assert shown("A_S", 2.0) == "2 s"
    assert shown("A_TURNS", 1.25) == "1.25 turns"
    assert shown("A_SHARE", (3e-4, 0.02)) == "0.03 %, 2 %"
    assert shown("A_RATIO", 1.3) == "1.3"
