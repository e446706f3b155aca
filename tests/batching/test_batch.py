"""Batches over many rigs, of which one fails."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tsm_fmu as tsm
from tsm_fmu.cli.app import run
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.logs.record import write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.solver import SearchLog
from tsm_fmu.verbs import batch
from tsm_fmu.verbs.batch import RigResult, RigWork


@pytest.fixture
def rigs(tmp_path):
    one = tsm.sample("sine")
    for name, factor in (("north", 1.0), ("south", 0.93)):
        columns = {**one.columns, "x_out": factor * one.columns["x_out"]}
        write_record(tmp_path / f"{name}.csv", one.time, columns, one.units)
    table = tmp_path / "rigs.csv"
    table.write_text("rig,measured\nnorth,north.csv\nlost,nowhere.csv\nsouth,south.csv\n", encoding="utf-8")
    return table


def test_many_rigs_give_one_table_and_a_killed_batch_goes_on(rigs, tmp_path, capsys, monkeypatch):
    done = RigWork.__call__

    def interrupted(self, rig):
        if rig.name == "south":
            raise KeyboardInterrupt
        return done(self, rig)

    out = tmp_path / "out"
    command = ["batch", "identify", "PairedTsmBacklash", "--table", str(rigs), "--out", str(out), "--workers", "1"]
    monkeypatch.setattr(RigWork, "__call__", interrupted)
    assert run(command) == 130
    monkeypatch.undo()
    assert run(command) == 2
    said = capsys.readouterr().err
    assert "2 of 3 rigs kept from a batch that did not end" in said
    assert "lost: " in said
    assert "nowhere.csv does not exist" in said
    assert "tsm-fmu: 1 of 3 rigs failed -- expected none" in said
    table = pd.read_parquet(out / "rigs.parquet").set_index("rig")
    assert [bool(why) for why in table["failed"]] == [False, True, False]
    alone = tsm.identify("PairedTsmBacklash", rigs.parent / "south.csv")
    assert table.loc["south", "c [1]"] == pytest.approx(alone.parameters["c"], rel=1e-9)
    assert tsm.read_card(out / "south" / "card.toml").parameters["c"].value == table.loc["south", "c [1]"]
    errors = table["measured rmse x_out [rad]"].drop("lost")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert f"from {errors.min():.3g} to {errors.max():.3g} rad, largest at {errors.idxmax()}." in page
    assert "error by rig: measured rmse x_out [rad]" in page
    assert {p.name for p in out.iterdir()} == {"rigs.csv", "rigs.parquet", "report.html", "north", "south", "lost"}


def test_an_interrupted_fit_ends_the_batch_and_is_done_anew(rigs, tmp_path, monkeypatch):
    """A fit keeps its best until Ctrl-C; a batch that took that for the optimum would go on with the next rig."""
    offer, calls = SearchLog.offer, []

    def interrupted(log, table, error):
        offer(log, table, error)
        calls.append(error)
        if len(calls) == 2:
            raise KeyboardInterrupt

    out = tmp_path / "out"
    command = ["batch", "identify", "PairedTsmBacklash", "--table", str(rigs), "--out", str(out), "--workers", "1"]
    monkeypatch.setattr(SearchLog, "offer", interrupted)
    assert run(command) == 130
    assert not (out / "south").exists()
    assert not [*out.rglob("card.toml"), *out.glob("rigs.parquet")]
    monkeypatch.undo()
    assert run(command) == 2
    alone = tsm.identify("PairedTsmBacklash", rigs.parent / "north.csv")
    assert tsm.read_card(out / "north" / "card.toml").parameters["c"].value == alone.parameters["c"]


def test_a_diagnosis_interrupted_after_its_answer_ends_the_batch(rigs, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "tsm_fmu.verbs.diagnose.diagnose", lambda *_, **__: Diagnosis("none", answer="as before", complete=False)
    )
    with pytest.raises(KeyboardInterrupt):
        tsm.batch("diagnose", "PairedTsmBacklash", rigs, out=tmp_path / "out", workers=1, improve=True)


def test_the_picture_of_a_batch_is_of_what_it_found() -> None:
    def errors(count: int) -> list[RigResult]:
        return [RigResult(f"r{n}", {"measured rmse F [N]": 0.1 * n + 0.02}) for n in range(count)]

    failed = RigResult("lost", {"measured rmse F [N]": 9.0}, "why")
    few, many = batch._picture([*errors(3), failed]), batch._picture(errors(batch.MOST_BARS + 1))
    assert few is not None
    assert few.panels[0].bars == pytest.approx({"r0": 0.02, "r1": 0.12, "r2": 0.22})
    assert many is not None
    assert many.panels[0].steps is not None
    assert np.sum(many.panels[0].steps.counts) == batch.MOST_BARS + 1
    named = [RigResult(f"r{n}", {"effects": text}) for n, text in enumerate(("wear", "", "creep, wear"))]
    found = batch._picture([*named, failed])
    assert found is not None
    assert list(found.panels[0].bars.items()) == [("wear", 2.0), ("nothing named", 1.0), ("creep", 1.0)]
    assert batch._picture([failed]) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rig,measured\n", "has no rows -- expected columns rig"),
        ("name,measured\na,b.csv\n", "has name, measured -- expected columns rig"),
        ("rig,measured\na,b.csv\na,c.csv\n", "rig 'a' -- expected letters and digits, each rig once"),
        ("rig,measured\n../a,b.csv\n", "rig '../a' -- expected letters and digits"),
        ("rig,measured,reference\na,b.csv,c.csv\n", "expected columns rig, measured, holdout"),
    ],
)
def test_a_wrong_table_is_one_line(tmp_path, text, message):
    (tmp_path / "rigs.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as wrong:
        tsm.batch("identify", "TendonDrive", tmp_path / "rigs.csv", out=tmp_path / "out")
    assert message in str(wrong.value)
    assert not (tmp_path / "out").exists()


def test_diagnose_and_track_give_of_a_rig_what_they_give_alone(tmp_path):
    one = tsm.sample("sine")
    days = [tmp_path / f"day{number}.csv" for number in range(5)]
    for number, day in enumerate(days):
        columns = {name: values[number::40] for name, values in one.columns.items()}
        time = one.time[number::40]
        write_record(day, time - time[0], columns, one.units)
    card = tmp_path / "card.toml"
    tsm.identify("PairedTsmBacklash", days[0], single_start=True).write_card(card)
    table = tmp_path / "rigs.csv"
    table.write_text(f"rig,measured\nown,{';'.join(day.name for day in days)}\n", encoding="utf-8")
    tracked = tsm.batch("track", card, table=table, out=tmp_path / "tracked", workers=1).rigs[0].values
    alone = tsm.track(card, days)
    assert tracked == {"runs": 5.0, "moving": ", ".join(alone.moving), "answer": alone.answer}
    diagnosed = tsm.batch("diagnose", card, table=table, out=tmp_path / "diagnosed", workers=1).rigs[0].values
    found = tsm.diagnose(card, days)
    assert diagnosed == {"verdict": found.verdict, "effects": ", ".join(found.effects), "answer": found.answer}
    assert (tmp_path / "diagnosed" / "own" / "diagnosis.json").is_file()
