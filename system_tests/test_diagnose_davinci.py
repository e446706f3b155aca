"""Real logs: a drive identified at the lowest load meets higher ones; friction that grows with the load is named."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tsm_fmu.cli.app import run

ROOT = Path(os.environ.get("TSM_FMU_DATA") or Path(__file__).parents[2] / "shared" / "data")
T4L4 = ROOT / "davinci" / "T4L4"
pytestmark = pytest.mark.skipif(
    not T4L4.is_dir(), reason=f"no davinci/T4L4 in {ROOT}: set TSM_FMU_DATA to the folder that contains davinci/"
)
LOWEST = ("00", "40")  # 0.1 A; 0.1 and 0.5 Hz
HIGHER = ("03", "26", "49")  # 0.4 A at 0.1 Hz, 0.7 A at 0.3 Hz, 1.0 A at 0.5 Hz
HELD = ("15", "38")  # 0.6 A at 0.2 Hz, 0.9 A at 0.4 Hz: neither load nor frequency is among those above


def given(option: str, names: tuple[str, ...]) -> list[str]:
    return [word for name in names for word in (option, str(T4L4 / f"{name}.csv.gz"))]


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory: pytest.TempPathFactory) -> dict:
    folder = tmp_path_factory.mktemp("davinci")
    card, settled = folder / "lowest.toml", ["--from", "2.5"]
    start = ["--set", "tau_v=0.02", "--fix", "tau_v"]
    assert run(["identify", "TendonDrive", *given("--measured", LOWEST), *settled, *start, "--out", str(card)]) == 0
    runs = [*given("--measured", HIGHER), *given("--reference", LOWEST), *given("--holdout", HELD)]
    out = folder / "diagnosis"
    words = ["diagnose", str(card), *runs, *settled, "--map", "x_out=jaw", "--out", str(out), "--json"]
    assert run(words) == 0
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))


def test_friction_that_grows_with_the_load_is_what_is_missing(diagnosis: dict) -> None:
    """Alone, or in a set with the law that grows with it by another factor for each side that drives."""
    answer = {*diagnosis["effects"], *(e for group in diagnosis["equivalent"] for e in group)}
    assert diagnosis["verdict"] in ("named", "ambiguous")
    assert {"load_dependence"} <= answer <= {"load_dependence", "drive_direction"}
    assert diagnosis["family"] == ["load"]
    closes = {c["effect"]: c["gap_closure_holdout"] for c in diagnosis["candidates"]}
    assert closes["load_dependence"] > 0.7


def test_the_held_out_gap_shrinks_beyond_a_refit(diagnosis: dict) -> None:
    gap = diagnosis["gap"]["tau_in"]
    assert gap["holdout_after"] < 0.6 * gap["holdout_refitted"]
    assert gap["holdout_refitted"] < gap["holdout_before"]


def test_what_one_stroke_of_sixty_degrees_hides_is_listed(diagnosis: dict) -> None:
    assert {"drum_periodic", "winding_crossover"} <= set(diagnosis["not_excited"])
