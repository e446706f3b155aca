"""What every test leaves as it was: where this process looks for modules; and which files of tests come first."""

import sys
from collections.abc import Iterator

import pytest

LONG = (
    "system_tests/test_blind_gate.py", "tests/effects/test_planted.py", "tests/test_tutorials.py",
    "system_tests/test_diagnose_papers.py", "system_tests/test_diagnose_verdicts.py", "tests/test_fresh_rigs.py",
    "tests/reproduction/test_claims.py", "system_tests/test_native_units.py",
)  # fmt: skip
"""Files of more than a minute: begun last, one of them would keep a single processor busy at the end."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The long files first, each group in its random order."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONG))


@pytest.fixture(autouse=True)
def search_path_of_modules() -> Iterator[None]:
    """PythonFMU leaves the folder of a unit on the search path; processes started later would import from there."""
    before = sys.path.copy()
    yield
    if sys.path == before:
        return
    added = tuple(f"{folder}/" for folder in sys.path if folder not in before)
    sys.path[:] = before
    for name, module in list(sys.modules.items()):
        if added and (getattr(module, "__file__", None) or "").startswith(added):
            del sys.modules[name]
