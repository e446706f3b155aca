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
LAWS_OF_THE_LOAD = {"load_dependence", "drive_direction"}
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


def said(diagnosis: dict) -> set[str]:
    """Effects that are named, alone or in a set."""
    return {*diagnosis["effects"], *(e for group in diagnosis["equivalent"] for e in group)}


def test_friction_that_grows_with_the_load_is_what_is_missing(diagnosis: dict) -> None:
    """The runs differ in their load, so that is known of this drive; what else its friction lacks nobody knows.

    With `load_dependence` the friction grows, with `drive_direction`, which holds that law, by another factor for each
    side that drives: they leave so nearly the same that the last digits of a machine choose between them, and say
    whether a further law is named beside.
    """
    assert diagnosis["verdict"] in ("named", "ambiguous")
    assert said(diagnosis) & LAWS_OF_THE_LOAD
    assert "load" in diagnosis["family"]
    evidence = max(diagnosis["family_evidence"], key=lambda e: e["share"])
    assert (evidence["family"], evidence["channel"]) == ("load", "tau_in")


def test_a_law_of_the_load_closes_most_of_the_gap_and_none_that_is_not_said_does(diagnosis: dict) -> None:
    judged = [c for c in diagnosis["candidates"] if c["gap_closure_holdout"] is not None]
    closes = {c["effect"]: c["gap_closure_holdout"] for c in judged}
    others = [closed for effect, closed in closes.items() if effect not in LAWS_OF_THE_LOAD | said(diagnosis)]
    assert closes["load_dependence"] > 0.7
    assert others
    assert max(others) < closes["load_dependence"]


def test_the_held_out_gap_shrinks_beyond_a_refit(diagnosis: dict) -> None:
    gap = diagnosis["gap"]["tau_in"]
    assert gap["holdout_after"] < 0.6 * gap["holdout_refitted"]
    assert gap["holdout_refitted"] < gap["holdout_before"]


def test_what_one_stroke_of_sixty_degrees_hides_is_listed(diagnosis: dict) -> None:
    assert {"drum_periodic", "winding_crossover"} <= set(diagnosis["not_excited"])
