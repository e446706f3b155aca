"""What every test leaves as it was: where this process looks for modules."""

import sys
from collections.abc import Iterator

import pytest


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
