"""The main job on a real log: identify, export, replay through FMPy (issue: 0.20 deg on T4L4/00 from 2.5 s on)."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.replay import replay
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import read_record

ROOT = Path(os.environ.get("TSM_FMU_DATA") or Path(__file__).parents[2] / "shared" / "data")
T4L4 = ROOT / "davinci" / "T4L4"
pytestmark = pytest.mark.skipif(
    not T4L4.is_dir(), reason=f"no davinci/T4L4 in {ROOT}: set TSM_FMU_DATA to the folder that contains davinci/"
)


def log(number: int) -> str:
    return str(T4L4 / f"{number:02d}.csv.gz")


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Card and JSON of run 00, run 03 held out, by the command line."""
    card = tmp_path_factory.mktemp("identified") / "card.toml"
    written = card.with_suffix(".json")
    with pytest.MonkeyPatch.context() as patch, written.open("w", encoding="utf-8") as stdout:
        patch.setattr("sys.stdout", stdout)
        code = run(
            [
                *("identify", "PairedTsmBacklash", "--measured", log(0), "--holdout", log(3)),
                *("--from", "2.5", "--out", str(card), "--json"),
            ]
        )
    assert code == 0
    return card, json.loads(written.read_text(encoding="utf-8"))


def test_json_has_the_contract(identified: tuple[Path, dict]) -> None:
    _, said = identified
    assert set(said["parameters"]) == {"c", "beta", "alpha", "x_0", "x_h_0"}
    for value in said["parameters"].values():
        assert {"value", "unit", "stderr", "at_bound"} <= set(value)
    assert {"rmse", "peak_to_peak_error", "nrmse", "unit"} <= set(said["measured"]["x_out"])
    assert set(said["holdout"]) == {"x_out"}
    assert {name: entry["role"] for name, entry in said["per_run"].items()} == {"00": "measured", "03": "holdout"}
    assert said["condition_number"] > 1.0
    assert said["evaluations"] > 0
    assert said["wall_s"] > 0.0


def test_exported_fmu_replays_the_log_within_a_fifth_of_a_degree(identified: tuple[Path, dict], tmp_path: Path) -> None:
    card_path, said = identified
    fmu = tmp_path / "Drive.fmu"
    assert run(["export", str(card_path), "--out", str(fmu)]) == 0
    record = read_record(Path(log(0)), start=2.5)
    x_out = replay(fmu, record).columns["x_out"]
    error = x_out - record.columns["x_out"]
    rmse = np.degrees(np.sqrt(np.mean(error**2)))
    line = np.polynomial.Polynomial.fit(record.columns["x_in"], record.columns["x_out"], 1)
    straight = np.degrees(np.std(line(record.columns["x_in"]) - record.columns["x_out"]))
    assert rmse <= 0.20
    assert straight > 1.2
    assert rmse == pytest.approx(np.degrees(said["measured"]["x_out"]["rmse"]), rel=1e-9)
    card = read_card(card_path)
    model = kernel("PairedTsmBacklash")
    simulated = model.simulate(card.params("00"), record.time, record.inputs_for(model))[:, 0]
    assert x_out == pytest.approx(simulated, rel=1e-12)


def test_card_names_the_records_by_their_hash(identified: tuple[Path, dict]) -> None:
    card = read_card(identified[0])
    used = {r.name: (r.sha256, r.role) for r in card.provenance.records}
    assert used == {
        "00": (read_record(Path(log(0))).sha256, "measured"),
        "03": (read_record(Path(log(3))).sha256, "holdout"),
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["PairedTsm", "--measured", log(0)], "model 'PairedTsm' -- expected one of"),
        (["PairedTsmBacklash:best", "--measured", log(0)], "preset 'best' of PairedTsmBacklash -- expected one of"),
        (["PairedTsmBacklash", "--measured", "none.csv"], "none.csv"),
        (
            ["PairedTsmBacklash", "--measured", log(0), "--set", "alpha=fast"],
            "--set alpha=fast -- expected a finite number",
        ),
        (["PairedTsmBacklash", "--measured", log(0), "--set", "alpha=-3"], "parameter alpha = -3.0 1/rad"),
        (["PairedTsmBacklash", "--measured", log(0), "--set", "gain=1"], "parameter 'gain' of PairedTsmBacklash"),
        (["PairedTsmBacklash", "--measured", log(0), "--fix", "gain"], "--fix gain of PairedTsmBacklash"),
        (["PairedTsmBacklash", "--measured", log(0), "--map", "x_in=drive"], "has no channel 'x_in'"),
        (["PairedTsmBacklash", "--measured", log(0), "--map", "x_out=jaw"], "no output of PairedTsmBacklash"),
        (["PairedTsmBacklash", "--measured", log(0), "--method", "slow"], "'slow'"),
        (["none.toml", "--measured", log(0)], "card none.toml -- expected a readable file"),
    ],
)
def test_wrong_use_is_one_line_and_writes_nothing(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "card.toml"
    assert run(["identify", *arguments, "--out", str(card)]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
    assert not card.exists()


def test_out_in_a_missing_folder_is_refused_before_the_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "no" / "card.toml")
    assert run(["identify", "PairedTsmBacklash", "--measured", log(0), "--out", out]) == 2
    assert "expected a folder that exists" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.toml", "--out", "X.fmu"], "card none.toml -- expected a readable file"),
        (["CARD", "--out", "X.zip"], "--out X.zip -- expected a name that ends in .fmu"),
        (["CARD", "--out", "X.fmu", "--fmi", "3", "--flavour", "python"], "--flavour python with --fmi 3"),
    ],
)
def test_export_wrong_use_is_one_line(
    arguments: list[str],
    message: str,
    identified: tuple[Path, dict],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["export", *(str(identified[0]) if a == "CARD" else a for a in arguments)]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
