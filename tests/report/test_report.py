"""The report page: self-contained, escaped, drawn by a real browser without a network."""

import base64
import gzip
import io
import json
import re

import numpy as np
import pytest
from bokeh.models import Range1d
from PIL import Image

from tests.browser import LARGEST, assert_readable, needs_chromium, opened
from tsm_fmu import InputError
from tsm_fmu.report import Line, Section, Table, bar_figure, loop_figure, time_figure, write_report
from tsm_fmu.report.draw import _plot, thinned
from tsm_fmu.report.panel import Panel, legend


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
    assert re.search(r'<td[^>]* class="number">0.12346</td>', text)


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
    shown_t, shown = thinned(t, y, 2000)
    assert len(shown_t) == len(shown) <= 2000
    assert max(shown) == 40.0
    assert (shown_t[0], shown_t[-1]) == (t[0], t[-1])


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file.report\.html could not be written .its folder is a file."):
        write_report(tmp_path / "file" / "report.html", "t", "s", [])


def _items(page):
    """The plots of a page as the plot library gets them."""
    packed = re.search(r'id="plot-items">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)[1]
    return json.loads(gzip.decompress(base64.b64decode(packed)))


def _arrays(tree):
    if isinstance(tree, dict) and tree.get("type") == "ndarray":
        yield tree
    for value in tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ():
        yield from _arrays(value)


def test_the_answer_and_the_picture_that_proves_it_stand_first(page, tmp_path):
    text = page.read_text(encoding="utf-8")
    assert text.index('class="summary"') < text.index("<figcaption>x</figcaption>") < text.index("<h2>Loop</h2>")
    assert text.count("<figcaption>x</figcaption>") == 1
    proof = loop_figure([Line("p", [0.0, 1.0], [0.0, 2.0])], "proof", "", "")
    other = write_report(tmp_path / "other.html", "t", "s", [Section("a", "b", figures=[proof, proof])], proof=proof)
    assert other.read_text(encoding="utf-8").count("<figcaption>proof</figcaption>") == 1


def test_a_plot_says_what_it_shows_and_its_legend_is_text(page):
    text = page.read_text(encoding="utf-8")
    assert 'role="img" aria-label="x; deg over time [s]: measured, model"' in text
    assert re.findall(r'data-shows="(.*?)"', text) == ["measured", "model"]  # a single line needs no legend


def test_panels_that_show_the_same_things_have_one_legend():
    t = [0.0, 1.0]
    ours, design = Line("co-simulation", t, t, colour=0), Line("design", t, t, dashed=True, colour=1)
    gain, phase = Panel("w", "gain", lines=(ours, design)), Panel("w", "phase", lines=(ours, design))
    assert [(name, stroke) for name, _, stroke in legend((gain, phase))] == [
        ("co-simulation", "line"),
        ("design", "dash"),
    ]
    apart = [Panel("t", name, lines=(Line(name, t, t, colour=k),)) for k, name in enumerate("xy")]
    assert legend(apart) == []  # each is told by its axis


def test_a_page_of_very_many_lines_stays_small(tmp_path):
    rng = np.random.default_rng(7)
    t = np.linspace(0.0, 7.3, 5001)
    figures = [
        time_figure([Line(f"{k}", t, rng.normal(size=t.size)) for k in range(4)], f"{j}", "N") for j in range(50)
    ]
    path = write_report(tmp_path / "many.html", "t", "s", [Section("all", figures=figures)])
    assert path.stat().st_size < LARGEST


@pytest.mark.parametrize("offset", [0.0, 1.7e9])
def test_what_is_drawn_is_what_was_given_to_a_pixel(tmp_path, offset):
    """Time stamps of an epoch too, which single precision would lump together."""
    t = offset + np.linspace(0.0, 9.1, 700)
    figure = time_figure([Line("y", t, t)], "y", "")
    path = write_report(tmp_path / "p.html", "t", "s", [Section("a", figures=[figure])])
    drawn = [
        np.frombuffer(gzip.decompress(base64.b64decode(array["array"]["data"])), array["dtype"])
        for array in _arrays(_items(path))
    ]
    assert len(drawn) == 2
    for values in drawn:
        assert np.max(np.abs(values - t)) < 1e-3 * 9.1


@needs_chromium
@pytest.mark.parametrize("dark", [False, True])
def test_a_browser_draws_every_figure_offline_on_a_phone_and_in_the_dark(page, dark):
    seen = assert_readable(page, dark=dark)
    assert seen["frames"] == 2


@needs_chromium
def test_numbers_at_bars_are_as_light_as_the_text_in_the_dark(tmp_path):
    """Nothing else inside the frame of bars is lighter than the axes."""
    path = bar_figure({"F": {"as given": 0.137, "refitted": 0.0713}}, "Error (RMS)").write(tmp_path / "bars.html")
    with opened(path, dark=True) as window:
        window.wait_for_function("document.querySelector('[data-plot]').dataset.drawn")
        window.wait_for_timeout(500)
        shot = window.locator("[data-plot]").screenshot()
    lightest = np.asarray(Image.open(io.BytesIO(shot)).convert("L")).max()
    assert lightest > 215, "the text is e3e8ed, the axes a3afba"


@pytest.mark.parametrize(("values", "shown"), [((-3.2, -3.2 + 1e-7), 1.0), ((2.0, 2.0), 1.0), ((-40.0, 20.0), None)])
def test_an_axis_does_not_blow_up_rounding_noise(values, shown):
    axis = _plot(Panel(lines=[Line("gain", (1.0, 2.0), values)], y_span=1.0), 1000).y_range
    if shown is None:
        assert not isinstance(axis, Range1d)
    else:
        assert axis.end - axis.start == pytest.approx(shown)
        assert axis.start < min(values) <= max(values) < axis.end
