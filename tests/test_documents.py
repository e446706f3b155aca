"""Files that the pages name are there: a page is read long after the file was renamed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "fmus" / "README.md"]
FOLDERS = ("src", "tests", "system_tests", "benchmarks", "build_scripts", "examples")
EXAMPLES = re.compile(r"(^|/)(my_\w+|a/b)\.py$")
"""Names of CONTRIBUTING.md that stand for files to come."""
GENERATED = ("models", "effects")
"""Folders of pages that the site's build writes."""


def named(text: str) -> list[str]:
    return [name for name in re.findall(r"`([\w/]+\.py)`", text) if not EXAMPLES.search(name)]


def linked(text: str) -> list[str]:
    return re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_named_files_and_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    files = [f"/{path.relative_to(ROOT).as_posix()}" for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    assert [name for name in named(text) if not any(file.endswith(f"/{name}") for file in files)] == []
    links = [link for link in linked(text) if not link.startswith(GENERATED)]
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_a_name_and_a_link_that_lead_nowhere_are_seen() -> None:
    assert named("see `choice/judged.py`, `my_model.py` and `src/tsm_fmu/a/b.py`") == ["choice/judged.py"]
    assert linked("[a](docs/a.md), [b](b.md#part), [c](https://example.org/c.md), [d](#part)") == ["docs/a.md", "b.md"]
