"""``tsm-fmu diagnose`` as users call it, on rigs simulated with other functional forms than the library's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run

DT, ROWS = 0.01, 2400
GIVEN = ["sigma0=120", "sigma1=0.05", "sigma2=0.11", "F_c=0.7", "F_s=0.7", "v_s=0.3"]
KEYS = {
    "verdict", "effects", "equivalent", "not_excited", "candidates", "where", "gap", "card", "fmu", "report",
    "next_experiment",
}  # fmt: skip


def log(path: Path, seed: int, viscous: float = 0.11, inertia: float = 0.0, still: bool = False) -> Path:
    """Friction 0.7 z (Dahl, dz/dt = 120/0.7 (v - |v| z)) + viscous v + inertia dv/dt, with white noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    phases = rng.random(3) * 6.0
    v = sum(
        a * np.sin(2 * np.pi * f * t + p) for a, f, p in zip((1.1, 0.6, 0.4), (0.13, 0.37, 1.3), phases, strict=True)
    )
    v = np.zeros(ROWS) if still else np.asarray(v)
    z = np.zeros(ROWS)
    for k in range(1, ROWS):
        s = np.sign(v[k])
        z[k] = s + (z[k - 1] - s) * np.exp(-abs(v[k]) * DT * 120.0 / 0.7)
    force = 0.7 * z + viscous * v + inertia * np.gradient(v, DT) + 0.011 * rng.normal(size=ROWS)
    rows = np.column_stack([t, v, force])
    np.savetxt(path, rows, delimiter=",", header="time [s],v [m/s],F [N]", comments="", fmt="%.10g")
    return path


def diagnosed(folder: Path, measured: list[Path], *more: str) -> dict:
    runs = [text for path in measured for text in ("--measured", str(path))]
    given = [text for pair in GIVEN for text in ("--set", pair)]
    assert run(["diagnose", "LuGreFriction", *runs, *given, *more, "--out", str(folder), "--json"]) == 0
    return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))


def test_nothing_missing_is_said(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "d", [log(tmp_path / "a.csv", 1), log(tmp_path / "b.csv", 2)])
    assert said["verdict"] == "none"
    assert said["effects"] == []
    assert set(said) >= KEYS


def test_wrong_parameters_are_not_an_effect(tmp_path: Path) -> None:
    runs = [log(tmp_path / "a.csv", 3, viscous=0.29), log(tmp_path / "b.csv", 4, viscous=0.29)]
    said = diagnosed(tmp_path / "d", runs)
    assert said["verdict"] == "parameters"
    assert said["effects"] == []
    assert said["gap"]["F"]["after"] < 0.3 * said["gap"]["F"]["before"]
    text = Path(said["report"]).read_text(encoding="utf-8")
    assert "other parameter values close the gap (sigma2 " in text  # what matters first, not what moved most


def test_hidden_inertia_is_named_and_the_fmu_has_the_same_gap(tmp_path: Path) -> None:
    runs = [log(tmp_path / "a.csv", 5, inertia=0.043), log(tmp_path / "b.csv", 6, inertia=0.043)]
    held = log(tmp_path / "c.csv", 7, inertia=0.043)
    said = diagnosed(tmp_path / "d", runs, "--holdout", str(held))
    assert said["verdict"] == "named"
    assert said["effects"] == ["inertia"]
    gap = said["gap"]["F"]
    assert gap["holdout_after"] < 0.5 * gap["holdout_before"]
    assert gap["fmu"] == pytest.approx(gap["after"], rel=1e-6)
    card = read_card(said["card"])
    assert card.parameters["inertia.m"].value == pytest.approx(0.043, rel=0.2)
    assert "inertia" in Path(said["report"]).read_text(encoding="utf-8")


def test_a_drive_that_stands_still_gives_no_answer(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "d", [log(tmp_path / "a.csv", 8, still=True)])
    assert said["verdict"] == "not_excited"
    assert "inertia" in said["not_excited"]
    assert said["card"] is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["NoModel"], "model 'NoModel' -- expected one of"),
        (["LuGreFriction", "--set", "F_c=much"], "--set F_c=much -- expected a finite number"),
        (["LuGreFriction", "--set", "F_c=-2"], "parameter F_c = -2.0"),
        (["LuGreFriction", "--map", "F=force"], "no output of LuGreFriction"),
        (["LuGreFriction", "--holdout", "none.csv"], "none.csv"),
        (["LuGreFriction", "--reference", "none.csv"], "none.csv"),
    ],
)
def test_wrong_use_is_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measured = log(tmp_path / "a.csv", 9)
    code = run(["diagnose", *arguments, "--measured", str(measured), "--out", str(tmp_path / "d")])
    said = capsys.readouterr()
    assert code == 2
    assert message in said.err
    assert said.err.count("\n") == 1
    assert not (tmp_path / "d").exists()
