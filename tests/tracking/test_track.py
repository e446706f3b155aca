"""``track``: lives whose truth is no model of ours, what must be found in them, and what must not."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import lives
import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.cli.app import run

DATA = Path(os.environ.get("TSM_FMU_DATA", "no data")) / "davinci"


@pytest.fixture(scope="module")
def card() -> tsm.ModelCard:
    new = lives.life([1.0, 1.0], seed=91)
    start = {"sigma0": 2000.0, "sigma1": 1.0}
    return tsm.identify("LuGreFriction", new, values=start, fixed=["F_s", "v_s"], single_start=True).card


@pytest.fixture(scope="module")
def worn(card: tsm.ModelCard) -> tsm.TrackResult:
    return tsm.track(card, lives.life(1.0 + 0.0117 * np.arange(14)))


def of(result: tsm.TrackResult, name: str):
    return next(one for one in result.series if one.name == name)


def test_wear_is_a_trend_of_the_friction_alone(worn: tsm.TrackResult) -> None:
    assert "F_c" in worn.tracked
    assert "sigma1" not in worn.tracked, "the card says that it is not determined"
    assert worn.moving == ("F_c",)
    drift = of(worn, "F_c").drift
    assert drift is not None
    assert drift.form == "trend"
    low, high = drift.slope_interval
    assert low < 0.0117 * lives.LEVELS.sum() < high
    assert drift.jumps == ()
    assert "wear" in of(worn, "F_c").text
    assert "Coulomb" in of(worn, "F_c").text


def test_a_jump_is_a_jump_at_its_place(card: tsm.ModelCard) -> None:
    found = of(tsm.track(card, lives.life([1.0] * 7 + [1.083] * 5, seed=17)), "F_c").drift
    assert found is not None
    assert found.form == "jump"
    (jump,) = found.jumps
    assert jump.between == (6, 7)
    low, high = jump.interval
    assert low < 0.083 * lives.LEVELS.sum() < high


def test_wear_with_a_repair_is_both(card: tsm.ModelCard) -> None:
    levels = [*(1.0 + 0.021 * np.arange(7)), *(1.0 + 0.021 * np.arange(7))]
    found = of(tsm.track(card, lives.life(levels, seed=5), free=["F_c"]), "F_c").drift
    assert found is not None
    assert found.form == "trend and jump"
    (jump,) = found.jumps
    assert jump.size < 0.0 < found.slope
    assert jump.between == (6, 7)


def test_wear_with_two_repairs(card: tsm.ModelCard) -> None:
    """No single jump beside a line explains a saw: each hides the other."""
    once = 1.0 + 0.019 * np.arange(7)
    found = of(tsm.track(card, lives.life([*once, *once, *once], seed=11), free=["F_c"]), "F_c").drift
    assert found is not None
    assert found.form == "trend and jump"
    assert [jump.between for jump in found.jumps] == [(6, 7), (13, 14)]
    assert all(jump.interval[0] < -0.133 * lives.LEVELS.sum() < jump.interval[1] for jump in found.jumps)


def test_a_change_that_is_undone_is_two_jumps(card: tsm.ModelCard) -> None:
    result = tsm.track(card, lives.life([1.0] * 5 + [1.127] * 4 + [1.0] * 5, seed=29), free=["F_c"])
    found = of(result, "F_c").drift
    assert found is not None
    assert [jump.between for jump in found.jumps] == [(4, 5), (8, 9)]
    assert found.jumps[0].size > 0.0 > found.jumps[1].size
    assert "between day_05 and day_06" in result.answer
    assert "between day_09 and day_10" in result.answer


def test_a_fray_is_a_stiffness_that_falls_strand_by_strand(card: tsm.ModelCard) -> None:
    hold = [1.0] * 5 + [0.81] * 5 + [0.57] * 5
    result = tsm.track(card, lives.life([1.0] * 15, seed=83, stiff=hold), free=["sigma0", "F_c"])
    assert "F_c" not in result.moving
    series = of(result, "sigma0")
    assert series.drift is not None
    assert [jump.between for jump in series.drift.jumps] == [(4, 5), (9, 10)]
    assert all(jump.size < 0.0 for jump in series.drift.jumps)
    assert "broken strand" in series.text


def test_nothing_drifts_where_nothing_does(card: tsm.ModelCard) -> None:
    for seed in (3, 41, 58, 607):
        result = tsm.track(card, lives.life([1.0] * 11, seed=seed))
        assert result.moving == (), result.answer
        drift = of(result, "F_c").drift
        assert drift is not None
        assert drift.unseen_slope > 0.0
        assert "would not be seen" in of(result, "F_c").text


def test_what_would_be_seen_is_seen(card: tsm.ModelCard) -> None:
    """A drift of twice what a quiet life says would go unseen, in the same life."""
    quiet = of(tsm.track(card, lives.life([1.0] * 11, seed=58), free=["F_c"]), "F_c").drift
    assert quiet is not None
    slope = 2.0 * quiet.unseen_slope / lives.LEVELS.sum()
    assert tsm.track(card, lives.life(1.0 + slope * np.arange(11), seed=58), free=["F_c"]).moving == ("F_c",)


def test_a_drift_of_a_fixed_parameter_is_not_lost(card: tsm.ModelCard) -> None:
    """What the chosen parameters cannot take up stands in the errors."""
    runs = lives.life(1.0 + 0.04 * np.arange(10), between=0.0)
    assert "error of F" in tsm.track(card, runs, free=["sigma2"]).moving


def test_an_effect_of_the_card_is_followed_in_its_own_words() -> None:
    new = lives.life([1.0, 1.0], seed=23)
    values = {"sigma0": 2000.0, "sigma1": 1.0, "sigma2": 0.0}
    fixed = ["F_s", "v_s", "sigma1", "sigma2", "viscous.q", "viscous.p"]
    model = tsm.identify("LuGreFriction+viscous", new, values=values, fixed=fixed, single_start=True).card
    runs = [one for k in range(8) for one in lives.life([1.0], seed=60 + k, viscous=4.7 + 1.9 * k)]
    named = [replace(one, name=f"week {k}") for k, one in enumerate(runs, 1)]
    result = tsm.track(model, named)
    assert "viscous.f_v" in result.moving
    assert "speed-dependent friction" in of(result, "viscous.f_v").text


def test_files_and_page(worn: tsm.TrackResult, tmp_path: Path) -> None:
    folder = worn.write(tmp_path / "a" / "b")
    held = json.loads((folder / "track.json").read_text())
    assert set(held) == {"model", "tracked", "by", "moving", "answer", "series", "runs", "sources", "notes"}
    assert held["series"]["F_c"]["drift"]["form"] == "trend"
    assert len(held["runs"]) == 14
    page = folder / "report.html"
    assert page.stat().st_size < 1.5e6
    assert "wear" in page.read_text(encoding="utf-8")
    frame = worn.to_frame()
    assert len((folder / "track.csv").read_text().splitlines()) == len(frame) + 1
    rows = frame[frame.name == "F_c"]
    assert rows.number.tolist() == list(range(1, 15))
    assert (rows.low < rows.value).all()
    assert (rows.value < rows.high).all()
    assert "iframe" in worn._repr_html_()
    with pytest.raises(tsm.InputError, match=r"'ghost' -- expected one of .*F_c"):
        worn.figure("ghost")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("card.toml 1.csv 2.csv 3.csv --out d", "3 runs to track -- expected 5 or more"),
        ("card.toml 1.csv 2.csv 3.csv 4.csv 5.csv --out d --free ghost", "--free ghost of LuGreFriction -- expected"),
        ("card.toml 1.csv 2.csv 3.csv 4.csv 1.csv --out d", "given 2 times"),
        ("card.toml 1.csv 2.csv 3.csv 4.csv 5.csv --out 1.csv", "is a file -- expected a folder"),
        ("LuGreFriction 1.csv 2.csv 3.csv 4.csv 5.csv --out d", "without a card -- expected a fitted model"),
        ("card.toml 1.csv 2.csv 3.csv 4.csv rest.csv --out d", "no input of LuGreFriction moves in rest"),
        (
            "card.toml 1.csv 2.csv 3.csv 4.csv 5.csv --out d --by ghost",
            "--by ghost: 1.csv has no such column -- expected",
        ),
        ("card.toml 1.csv 2.csv 3.csv 4.csv 5.csv --out d --by start", "--by start: the times of 1.csv are no dates"),
        ("none.toml 1.csv --out d", "none.toml -- expected a readable file"),
    ],
)
def test_bad_input_in_one_line(card, tmp_path, monkeypatch, capsys, words: str, complaint: str) -> None:
    monkeypatch.chdir(tmp_path)
    tsm.write_card("card.toml", card)
    for number, one in enumerate(lives.life([1.0] * 5, seconds=3.0), 1):
        tsm.write_record(f"{number}.csv", one.time, one.columns, one.units)
    still = {name: np.zeros_like(column) for name, column in one.columns.items()} | {"F": one.columns["F"]}
    tsm.write_record("rest.csv", one.time, still, one.units)
    assert run(["track", *words.split()]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert complaint in lines[-1]
    assert len(lines) == 1


def test_davinci_runs_in_the_order_they_were_taken() -> None:
    """T4L4/00 to 09: ten loads, one after the other; the zero moves with them from -1.26 to -1.11 rad: wind-up."""
    if not (DATA / "T4L4").is_dir():
        pytest.skip(f"no davinci/T4L4 in {DATA.parent}: set TSM_FMU_DATA to the folder that contains davinci/")
    runs = [thinned(tsm.read_record(DATA / "T4L4" / f"{k:02d}.csv.gz", start=2.5)) for k in range(10)]
    model = tsm.identify("PairedTsmBacklash", runs[:2], single_start=True)
    result = tsm.track(model, runs, free=["c"])
    zero = of(result, "x_0")
    assert "x_0" in result.moving
    assert zero.drift is not None
    assert zero.kind == "offset"
    assert 0.08 < abs(zero.drift.end - zero.drift.begin) < 0.22
    alone = tsm.identify(model.card, runs[4], fixed=["beta", "alpha"], single_start=True)
    tracked = result.runs[4].values["c"]
    assert tracked.value == pytest.approx(alone.parameters["c"], abs=0.1 * tracked.stderr)


def test_davinci_runs_of_five_loads_in_turn_are_a_saw() -> None:
    """All fifty: the load rises ten times and begins anew, and the zero with it."""
    if not (DATA / "T4L4").is_dir():
        pytest.skip(f"no davinci/T4L4 in {DATA.parent}: set TSM_FMU_DATA to the folder that contains davinci/")
    runs = [thinned(tsm.read_record(DATA / "T4L4" / f"{k:02d}.csv.gz", start=2.5)) for k in range(50)]
    model = tsm.identify("PairedTsmBacklash", runs[:2], single_start=True)
    drift = of(tsm.track(model, runs, free=["c"]), "x_0").drift
    assert drift is not None
    assert drift.form == "trend and jump"
    large = [jump for jump in drift.jumps if abs(jump.size) > 0.1]
    assert [jump.between for jump in large] == [(9, 10), (19, 20), (29, 30), (39, 40)]
    assert all(jump.size == pytest.approx(-10.0 * drift.slope, rel=0.15) for jump in large)


def thinned(record: tsm.Record) -> tsm.Record:
    columns = {name: record.columns[name][::10] for name in ("x_in", "x_out")}
    return tsm.Record(record.name, record.time[::10], columns, {name: record.units[name] for name in columns})
