"""``tsm-fmu report DIR``: every kind of result is on the page with its numbers; what is damaged is named."""

import json

import numpy as np
import pytest

from tsm_fmu.card import CardParameter, ModelCard, write_card
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.metric import Metric
from tsm_fmu.cosim.sweep import Axis, Point, write_sweep
from tsm_fmu.logs.record import write_record


def card():
    values = {"c": 0.8713, "beta": -0.2391, "alpha": 11.37, "x_0": 0.0173, "x_h_0": 0.0}
    units = {"alpha": "1/rad", "x_0": "rad", "x_h_0": "rad"}
    parameters = {n: CardParameter(v, units.get(n, "1"), 0.00317 if n == "c" else None) for n, v in values.items()}
    return ModelCard("PairedTsmBacklash", "published", (), parameters)


def test_the_page_has_the_numbers_of_every_kind(tmp_path, capsys):
    write_card(tmp_path / "fit.toml", card())
    time = np.arange(51) * 0.02
    write_record(tmp_path / "result.incomplete.csv", time, {"x_out": 3.719 * time}, {"x_out": "rad"})
    points = [
        Point({"load.k": 0.25}, {"x.mean": Metric(6.1853, "rad")}),
        Point({"load.k": 0.75}, {}, "the belt slipped"),
    ]
    write_sweep(tmp_path, "belt", [Axis("load.k", "N.m/rad", (0.25, 0.75))], points)
    gap = {"verdict": "named", "effects": ["creep"], "gap": {"x_out": {"unit": "rad", "before": 0.4127}}}
    (tmp_path / "diagnosis.json").write_text(json.dumps(gap), encoding="utf-8")
    (tmp_path / "note.txt").write_text("x")
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    for _ in range(2):  # its own page is no result
        assert run(["report", str(tmp_path), "--json"]) == 0
        assert json.loads(capsys.readouterr().out) == {"report": str(tmp_path / "index.html")}
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    shown = ("Model card fit.toml", "0.8713", "0.00317", "3.719", "The run stopped early", "6.1853", "the belt slipped")
    for text in (*shown, "Verdict named: creep", "0.4127", "note.txt"):
        assert text in page, text
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.name != "index.html"} == before


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (None, "", "has no results -- expected a card, a run, sweep.json or diagnosis.json"),
        ("sweep.json", "{", "sweep.json: JSONDecodeError"),
        ("sweep.json", "{}", "sweep.json: KeyError('vary') -- expected the file as the verb wrote it"),
        ("diagnosis.json", "[]", "diagnosis.json: TypeError"),
        ("c.toml", "format = 99", "c.toml: format = 99 -- expected format 1"),
        ("r.csv", "time [s],x [rad]\n0,1\n1,nan\n", "NaN or empty cell in row 3, column 'x'"),
        ("r.csv", "", "r.csv is empty -- expected a header row"),
    ],
)
def test_what_cannot_be_reported_is_one_line(tmp_path, capsys, name, content, message):
    if name:
        (tmp_path / name).write_text(content)
    assert run(["report", str(tmp_path)]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.err.count(" -- ") >= 2
    assert not (tmp_path / "index.html").exists()


def test_a_missing_folder_and_a_file_are_named(tmp_path, capsys):
    (tmp_path / "file").write_text("x")
    for name in ("none", "file"):
        assert run(["report", str(tmp_path / name)]) == 2
        assert f"{name} -- expected a folder of results -- give" in capsys.readouterr().err
