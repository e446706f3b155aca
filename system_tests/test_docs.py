"""The site of ``make docs``: it builds without a warning, needs no network, and works in a browser."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser import needs_chromium, opened
from tsm_fmu.effects import EFFECTS
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import variables

ROOT = Path(__file__).parents[1]
RESOURCE = re.compile(r"<(?:script|link|img|iframe|source)\b[^>]*?\b(?:src|href)=[\"\']([^\"\']+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    source, out = tmp_path_factory.mktemp("docs") / "docs", tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "docs", source, ignore=shutil.ignore_patterns("_build", "models", "effects"))
    shutil.copy(ROOT / "CONTRIBUTING.md", source.parent)
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", source, out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.parametrize(("folder", "modules"), [("models", MODELS), ("effects", EFFECTS)])
def test_every_model_and_effect_has_a_page_with_its_numbered_equations(site, folder, modules):
    for module in modules:
        page = (site / folder / f"{module.NAME}.html").read_text(encoding="utf-8")
        numbers = re.findall(r"^ {4}\S.*\s{3,}(\([A-Z]?\d+[a-z]?\))$", module.__doc__, re.MULTILINE)
        for number in numbers:
            assert number in page, (module.NAME, number)
        for name in (v.name for v in variables(module.Params)):
            assert re.search(rf">{re.escape(name)}<", page), (module.NAME, name)


def test_nothing_comes_from_a_network(site):
    for page in site.rglob("*.html"):
        for address in RESOURCE.findall(page.read_text(encoding="utf-8")):
            assert not re.match(r"(?:https?:)?//", address), (page.name, address)


@needs_chromium
def test_the_search_finds_words_of_equations_pages(site):
    with opened(site / "search.html", query="?q=capstan") as window:
        window.locator("#search-results a[href*='effects/load_dependence.html']").first.wait_for()


@needs_chromium
@pytest.mark.parametrize("name", ["index.html", "models/TendonDrive.html", "effects/stribeck.html", "api.html"])
def test_a_page_fits_a_phone(site, name):
    with opened(site / name, width=400) as window:
        assert window.evaluate("document.documentElement.scrollWidth") <= 400
