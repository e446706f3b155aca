"""The report page: self-contained, escaped, drawn by a real browser without a network."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.report import Line, Section, Table, loop_figure, time_figure, write_report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture
def page(tmp_path):
    t = np.linspace(0.0, 7.3, 5001)
    section = Section(
        "Loop",
        "First paragraph.\n\nSecond <b>paragraph</b>.",
        [Table(["name", "value"], [["alpha <1>", 0.1234567], ["runs", 3], ["nothing", None]], "caption")],
        [
            time_figure([Line("measured", t, np.sin(t), dashed=True), Line("model", t, np.sin(t - 0.1))], "x", "deg"),
            loop_figure([Line("loop", np.sin(t), np.sin(t - 0.2))], "loop", "x_in [deg]", "x_out [deg]"),
        ],
    )
    return write_report(tmp_path / "deep" / "report.html", "A & B", "It fits.", [section], {"seed": 7})


def test_text_is_escaped_and_numbers_are_rounded(page):
    text = page.read_text(encoding="utf-8")
    assert "<h1>A &amp; B</h1>" in text
    assert "Second &lt;b&gt;paragraph&lt;/b&gt;." in text
    assert "alpha &lt;1&gt;" in text
    assert '<td class="number">0.12346</td>' in text


def test_nothing_is_loaded_from_elsewhere(page):
    text = page.read_text(encoding="utf-8")
    body = re.sub(
        r"<script>.*?</script>", "", text, flags=re.DOTALL
    )  # the plot library mentions addresses, unused here
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!#)""", body)
    assert "@import" not in body


def test_without_figures_the_plot_library_is_left_out(tmp_path):
    path = write_report(tmp_path / "small.html", "t", "s", [Section("only text", "words")])
    assert path.stat().st_size < 10_000


def test_spikes_survive_thinning():
    t = np.linspace(0.0, 20.0, 20_001)
    y = np.sin(t)
    y[17_350] = 40.0
    drawn = time_figure([Line("x", t, y)], "x", "deg").data[0]
    assert len(drawn.x) <= 2002
    assert max(drawn.y) == 40.0


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file.report\.html -- could not be written"):
        write_report(tmp_path / "file" / "report.html", "t", "s", [])


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
def test_a_browser_draws_every_figure_offline(page, tmp_path):
    command = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
        "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={tmp_path / 'profile'}", "--window-size=390,844", "--virtual-time-budget=8000",
        "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    body = re.sub(r"<script.*?</script>", "", dom, flags=re.DOTALL)
    assert len(re.findall(r'class="main-svg"', body)) >= 2
    assert len(re.findall(r'class="scatterlayer', body)) == 2
