"""The site of ``make docs``: it builds without a warning, needs no network, and works in a browser."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tsm_fmu.effects import EFFECTS
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import variables

ROOT = Path(__file__).parents[1]
BROWSER = shutil.which("chromium")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --virtual-time-budget=8000"
).split()
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


def shown(address, tmp_path, *flags):
    command = [BROWSER, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", *flags, "--dump-dom", address]
    return subprocess.run(command, capture_output=True, text=True, timeout=120).stdout


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed (Debian package chromium)")
def test_the_search_finds_words_of_equations_pages(site, tmp_path):
    page = shown(f"file://{site}/search.html?q=capstan", tmp_path)
    assert "effects/load_dependence.html" in page


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed (Debian package chromium)")
@pytest.mark.parametrize("name", ["index.html", "models/TendonDrive.html", "effects/stribeck.html", "api.html"])
def test_a_page_fits_a_phone(site, name, tmp_path):
    frame = tmp_path / "frame.html"
    frame.write_text(
        f"""<iframe id=f width=400 height=800 src="file://{site}/{name}"></iframe><p id=w></p><script>
        f.onload = () => {{ w.textContent = "width " + f.contentDocument.documentElement.scrollWidth }}</script>"""
    )
    page = shown(f"file://{frame}", tmp_path, "--allow-file-access-from-files")
    width = re.search(r"width (\d+)", page.partition('id="w"')[2])
    assert width is not None
    assert int(width.group(1)) <= 400
