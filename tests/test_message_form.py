"""Every error for a user has three parts: ``what (value) -- expected -- what to do``."""

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "tsm_fmu"
PASSED_ON = ("{str(failure)}", "{reason}", "{message}", "{wrong}", "{failure}{advice}", "{points[0].failed}")
"""What a message may end with instead: a message that has the parts itself."""
TOLD = {"InputError", "FmuFailure", "SimulationStopped"}


def text_of(node: ast.expr) -> str:
    """A string expression with its placeholders as written."""
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of(part) for part in node.values)
    if isinstance(node, ast.Constant):
        return str(node.value)
    return "{" + ast.unparse(node.value if isinstance(node, ast.FormattedValue) else node) + "}"


def messages(path: Path) -> list[tuple[int, str]]:
    calls = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call)]
    named = [n for n in calls if isinstance(n.func, ast.Name) and n.func.id in TOLD and n.args]
    return [(n.lineno, text_of(n.args[0])) for n in named]


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=lambda p: str(p.relative_to(SOURCE)))
def test_every_error_says_what_was_expected_and_what_to_do(path):
    for line, text in messages(path):
        helper = text.startswith("{") and text.endswith("}") and text.count("{") == 1
        complete = text.count(" -- ") >= 2 or text.endswith(PASSED_ON) or helper or "self._reason(" in text
        assert complete or "_keep(" in text, f"{path.name}:{line}: {text}"
