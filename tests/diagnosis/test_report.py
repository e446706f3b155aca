"""The report of a real diagnosis, drawn by a browser without a network at the width of a phone."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.browser import assert_readable, needs_chromium
from tsm_fmu.card import read_card
from tsm_fmu.diagnosis.evidence import Gap
from tsm_fmu.diagnosis.report.page import _closed, _gaps
from tsm_fmu.diagnosis.report.plots import straight_line
from tsm_fmu.diagnosis.report.write import write_diagnosis
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.effects import id_of, words
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.display import display
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.draws import draw

DT, ROWS = 0.01, 1600
GIVEN = {"sigma0": 120.0, "sigma1": 0.05, "sigma2": 0.11, "F_c": 0.7, "F_s": 0.7, "v_s": 0.3}


def record(seed: int) -> Record:
    """Dahl friction, viscous friction, and a force of 0.05 dv/dt that the model lacks."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    v = np.sum(
        [a * np.sin(2 * np.pi * f * t + rng.random() * 6.0) for a, f in ((1.1, 0.13), (0.6, 0.37), (0.4, 1.3))], axis=0
    )
    z = np.zeros(ROWS)
    for k in range(1, ROWS):
        s = np.sign(v[k])
        z[k] = s + (z[k - 1] - s) * np.exp(-abs(v[k]) * DT * 120.0 / 0.7)
    force = 0.7 * z + 0.11 * v + 0.05 * np.gradient(v, DT) + 0.011 * rng.normal(size=ROWS)
    return Record(f"run <{seed}>", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"}, None, f"{seed:064d}")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    out = tmp_path_factory.mktemp("diagnosis")
    measured, held = [record(31), record(32)], [record(33)]
    found = diagnose(kernel("LuGreFriction"), measured, values=GIVEN, holdout=held)
    data = write_diagnosis(out, found)
    return out / "report.html", data


def test_the_card_holds_the_errors_of_the_fit_and_how_they_go_together(written: tuple[Path, dict]) -> None:
    """Not below the bound of white noise: its variance times the inverse of J'J, J by differences of the model."""
    card = read_card(written[1]["card"])
    model, runs = card.kernel(), (record(31), record(32))
    values = {name: p.value for name, p in card.parameters.items()}
    known = {name: p.stderr for name, p in card.parameters.items() if p.stderr is not None}

    def outputs(changed: dict[str, float]) -> np.ndarray:
        p = model.params(None, values | changed)
        inputs = [np.column_stack([r.columns[v.name] for v in model.inputs]) for r in runs]
        made = [model.simulate(p, r.time, u) for r, u in zip(runs, inputs, strict=True)]
        return np.concatenate([y[:, [v.name for v in model.outputs].index("F")] for y in made])

    free = [name for name, p in card.parameters.items() if not p.fixed and name in known]
    steps = {name: 1e-4 * abs(values[name]) for name in free}
    slopes = [(outputs({n: values[n] + h}) - outputs({n: values[n] - h})) / (2.0 * h) for n, h in steps.items()]
    jacobian = np.column_stack(slopes)
    errors = 0.011 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    for name, error in zip(free, errors, strict=True):  # the fit may have taken a part of the samples, not more
        assert 0.85 < known[name] / error < 4.0, name
    mass = card.parameters["inertia.m"]
    assert "inertia.m" in free
    assert card.correlation is not None
    assert set(card.correlation.names) <= set(known)
    drawn = draw(card, 50, 3)
    spread = dict(zip(drawn.names, drawn.values.std(axis=0), strict=True))
    assert spread["inertia.m"] == pytest.approx(mass.stderr, rel=0.4)


def test_the_report_holds_the_answer_and_its_evidence(written: tuple[Path, dict]) -> None:
    path, data = written
    text = re.sub(r"<script.*?</script>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    summary = re.search(r'<p class="summary">(.*?)</p>', text, re.DOTALL)
    assert summary is not None
    assert summary[1].replace("&gt;", ">") == data["answer"]
    headings = re.findall(r"<h2>(.*?)</h2>", text)
    assert headings[:3] == ["Gap", "Where", "Candidates"]
    assert headings[-1] == "Provenance"
    assert "Parameters" in headings
    answers = read_card(data["card"]).parameters
    for name in ("F_c", "inertia.m"):
        row = re.search(rf"<td[^>]*>{name}</td>(.*?)</tr>", text, re.DOTALL)
        assert row is not None
        assert f">{float(f'{answers[name].value:.3g}'):.5g}<" in row[1]
    assert "Run run &lt;31&gt;" in headings
    gap = data["gap"]["F"]
    for field in ("before", "refitted", "after", "holdout_before", "holdout_refitted", "holdout_after", "floor"):
        assert any(f">{float(f'{gap[field] * factor:.3g}'):.5g}<" in text for factor in (1.0, 1e3)), field
    for c in data["candidates"]:
        assert (f">{c['place']}<" in text.partition("<h2>Candidates")[2].partition("<h2>")[0]) == c["testable"]
        assert c["testable"] == (c["effect"] not in (*data["not_excited"], *data["not_applicable"]))
    answered = set(map(id_of, data["effects"])) | {e for ids in data["equivalent"] for e in ids}
    assert not answered & {*data["not_excited"], *data["not_applicable"]}
    for name in data["not_excited"]:
        assert name in json.loads((path.parent / "diagnosis.json").read_text(encoding="utf-8"))["not_excited"]
    assert f"{31:064d}" in text


def test_a_loop_is_drawn_less_its_straight_line_where_the_line_hides_it() -> None:
    x = np.sin(np.linspace(0.0, 14.0, 700))
    loop = 0.013 * np.sign(np.gradient(x))
    line = straight_line(x, 1.7 * x + 0.4 + loop)
    assert line is not None
    assert np.abs(line - 1.7 * x - 0.4).max() < 0.013
    assert straight_line(x, 0.01 * x + loop) is None  # friction is its own picture
    assert straight_line(np.full(9, 0.3), np.linspace(0.0, 1.0, 9)) is None


def test_a_quantity_has_one_number_on_the_page(written: tuple[Path, dict]) -> None:
    """The answer's error and the refit's are the same in the tables of the gap and of the candidates."""
    path, data = written
    page = html.unescape(path.read_text(encoding="utf-8"))
    gap = data["gap"]["F"]
    rows = {cells[0]: cells[1:] for cells in _rows(page)}
    assert rows["none (refit alone)"][0] == rows["refit alone"][0]
    (named,) = data["effects"]
    assert rows[words(named)][0] == rows["model of the answer"][0]
    assert rows[words(named)][2] == rows["gap closed"][-1]
    assert gap["floor_least"] <= gap["floor"] <= min(gap["refitted"], gap["after"])


def _rows(page: str) -> list[list[str]]:
    return [
        re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL)
        for row in re.findall(r"<tr[^>]*>(.*?)</tr>", page, re.DOTALL)
        if "<td" in row
    ]


def test_freedom_in_the_card_that_is_not_the_answer_is_told(written: tuple[Path, dict]) -> None:
    path, data = written
    text = path.read_text(encoding="utf-8")
    held = read_card(data["card"]).effects
    assert set(data["places"]) <= set(held)
    for spec in set(held) - set(data["places"]):
        assert f"({spec})" in text.partition("its card and its FMU also hold")[2]
    assert ("also hold" in text) == (set(held) != set(data["places"]))


def test_a_gap_has_a_row_for_each_model_and_a_caution_where_it_does_not_carry_over() -> None:
    g = Gap("N", 0.31, 0.04, 1.09, 0.21, 0.04, 0.009, 1.03, 0.96, (0.91, 1.02), 0.29, 1.1, 0.04)
    section = _gaps(Diagnosis("named", gap={"F": g}, channels=("F",)))
    assert section is not None
    assert "Caution: the error of F on the held-out runs is 5.2 times that on the measured ones" in section.text
    (table,) = section.tables
    assert tuple(table.heading) == ("error of F [N]", "measured", "held out")
    rows = {name: cells for name, *cells in table.rows}
    assert rows["model of the answer"] == [0.04, 0.21]
    assert rows["gap closed"] == ["", "96 % to all"]
    assert rows["the same, 90 % over runs"] == ["", "91 to 100 %"]
    alone = Gap("N", 0.31, 0.31, None, None, 0.04, 0.04, None, None, None, 0.29, None, None)
    section = _gaps(Diagnosis("none", gap={"F": alone}, channels=("F",)))
    assert section is not None
    assert "Caution" not in section.text
    assert [name for name, *_ in section.tables[0].rows] == [
        "model as given", "refit alone", "model of the answer", "floor", "surely noise",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0437, "rad", "2.5 deg"),
        (0.038, "kg", "0.038 kg"),
        (0.00328, "m", "3.28 mm"),
        (-0.0156, "N/m", "-0.0156 N/m"),
        (1.15, "1", "1.15"),
    ],
)
def test_parameters_have_the_units_of_people(value: float, unit: str, text: str) -> None:
    assert display(unit, value)(value) == text


@pytest.mark.parametrize(
    ("shares", "text"),
    [
        (None, ""),
        ((-2.3, -2.01), "worse"),
        ((-0.1, -0.001), "0 %"),
        ((0.66, 0.66), "66 %"),
        ((0.42, 0.44), "42 to 44 %"),
        ((0.9, 1.04), "90 % to all"),
    ],
)
def test_shares_closed_are_no_odd_percentages(shares: tuple[float, float] | None, text: str) -> None:
    assert _closed(shares) == text


def test_only_effects_without_a_place_lack_a_motion(written: tuple[Path, dict]) -> None:
    from tsm_fmu.effects import about

    path, data = written
    text = path.read_text(encoding="utf-8")
    for name in data["not_excited"]:
        assert about(name).shown_by in text or about(name).words in text
    for name, why in data["not_applicable"].items():
        assert f">{name}<" in text
        assert why in html.unescape(text)


@needs_chromium
@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_shows_every_figure_and_scrolls_nothing_sideways(written: tuple[Path, dict], dark: bool) -> None:
    assert assert_readable(written[0], dark=dark)["frames"] >= 5
