"""A live run: verdicts that do not hang on a tolerance, and numbers against an independent reading of the papers."""

import csv
import json

import pytest

from tsm_fmu import InputError
from tsm_fmu.reproduction import reproduce, write_reproduction
from tsm_fmu.reproduction.verdict import Verdict
from tsm_fmu.reproduction.write import COLUMNS

R, C, N, X = Verdict.REPRODUCED, Verdict.CONSISTENT, Verdict.NOT_DETERMINED, Verdict.CONTRADICTS

VERDICTS = {
    R: "iftomm2013.positive iftomm2013.bibo iftomm2013.dissipative_matched icinco2013.positive mmt2015.fig4_decay "
    "mmt2015.fig4_joined mmt2015.configuration mssp2015.width mssp2015.smooth_periodic ame2020.slope "
    "ame2020.intercept ame2020.pressure ame2020.optimum",
    C: "mmt2015.reading_swapped_eq10 mmt2015.reading_swapped_eq9 mssp2015.periodic_residual_milder mssp2015.newton_mm "
    "mssp2015.periodic_std_milder ame2020.strength ame2020.stiffness_winding ame2020.peak",
    N: "iftomm2013.force_high iftomm2013.sign iftomm2013.dissipative icinco2013.fig6_high icinco2013.fig7_low "
    "mmt2015.mse_periodic mssp2015.friction_error ame2020.slack_m05_180 ame2020.residual_reverse_m10_540 "
    "ame2020.optimum_resolved ame2020.wheel_friction_unit",
    X: "iftomm2013.continuous icinco2013.balance icinco2013.steady mmt2015.reading_printed_eq10 "
    "mmt2015.reading_clamped mmt2015.literal mmt2015.eq9 mmt2015.at_rest mmt2015.smooth mmt2015.fig4_printed "
    "mssp2015.monotone mssp2015.eliminated mssp2015.parameters mssp2015.width_non_periodic "
    "mssp2015.periodic_residual mssp2015.periodic_std mssp2015.newton mssp2015.smooth_non_periodic "
    "ame2020.winding ame2020.wheel_friction_sign ame2020.forward_m05_180 ame2020.forward_m10_540 "
    "ame2020.stiffness_path ame2020.load_exponent_180 ame2020.shape ame2020.reverse_m05_180 "
    "ame2020.reverse_m10_540 ame2020.lugre_m05_180 ame2020.sigma1_unit ame2020.lugre_state",
}


@pytest.mark.parametrize(
    ("key", "verdict"), [(key, verdict) for verdict, keys in VERDICTS.items() for key in keys.split()]
)
def test_verdict(claims, key, verdict):
    assert claims[key].verdict is verdict, claims[key].reason


@pytest.mark.parametrize(
    ("key", "lo", "hi", "tolerance"),
    [
        ("iftomm2013.force_high", 0.8446, 0.8453, 2e-4),
        ("iftomm2013.force_low", -1.701, -1.548, 1e-3),
        ("icinco2013.fig6_high", 3.494, 5.008, 2e-3),
        ("icinco2013.fig6_low", -5.482, -4.858, 2e-3),
        ("mmt2015.reading_printed_eq10", 2.011, 2.011, 2e-3),
        ("mmt2015.reading_printed_eq9", 1.8777, 1.8777, 2e-3),
        ("mmt2015.reading_swapped_eq10", 1.420, 1.420, 2e-3),
        ("mmt2015.reading_swapped_eq9", 1.320, 1.320, 2e-3),
        ("mssp2015.width", 10.406, 10.406, 1e-3),
        ("mssp2015.periodic_residual", 6.481, 6.481, 2e-3),
        ("mssp2015.periodic_residual_milder", 2.51, 3.62, 1e-2),
        ("mssp2015.periodic_std", 1.017, 1.017, 1e-3),
        ("mssp2015.periodic_std_milder", 0.491, 0.748, 1e-3),
        ("mssp2015.friction_range", -162.84, 163.35, 1e-2),
        ("mssp2015.friction_range_non_periodic", -182.6, 182.6, 0.1),
        ("ame2020.slope", 3.4371, 3.4371, 5e-5),
        ("ame2020.intercept", -4.5140, -4.5140, 5e-5),
        ("ame2020.pressure", 1.6334, 1.6334, 5e-5),
        ("ame2020.forward_m05_180", 0.793, 1.275, 1e-3),
        ("ame2020.forward_m10_540", 3.276, 5.164, 1e-3),
        ("ame2020.reverse_m05_180", 0.38, 2.44, 5e-3),
        ("ame2020.reverse_m10_540", 2.68, 10.08, 5e-3),
        ("ame2020.stiffness_path", 3444.0, 3444.0, 1.0),
        ("ame2020.strength", 199.0, 285.0, 0.6),
        ("ame2020.wheel_friction_unit", 0.1038, 0.1198, 5e-5),
    ],
)
def test_number(claims, key, lo, hi, tolerance):
    """Against the careful reading of the papers that the models were specified by."""
    assert claims[key].numbers["ours"] == pytest.approx([lo, hi], abs=tolerance)


@pytest.mark.parametrize(
    ("key", "reading", "value", "tolerance"),
    [
        ("mmt2015.literal", "Eqs (10)-(12), periodic", 2.562, 2e-3),
        ("mmt2015.literal", "Eq. (9), periodic", 1.509, 2e-3),
        ("mmt2015.literal", "Eqs (10)-(12), non-periodic", 1.267, 2e-3),
        ("mmt2015.literal", "Eq. (9), non-periodic", 0.833, 2e-3),
        ("mssp2015.monotone", "published set", -0.833, 1e-3),
        ("mssp2015.smooth_non_periodic", "run", 7.8, 0.1),
        ("iftomm2013.positive", "mu1 < 0", 0.221, 1e-4),
        ("ame2020.sigma1_unit", "as printed", 15811.0, 1.0),
    ],
)
def test_reading(claims, key, reading, value, tolerance):
    assert claims[key].numbers["readings"][reading]["value"] == pytest.approx(value, abs=tolerance)


def test_triangle_inequality_interval(claims):
    assert claims["mmt2015.reading_swapped_eq9"].numbers["reported"] == pytest.approx([1.085, 1.877], abs=1e-3)


def test_keys_are_unique_and_every_contradiction_rests_on_a_computation(done):
    keys = [claim.key for claim in done.claims]
    assert len(keys) == len(set(keys))
    for claim in done.claims:
        if claim.verdict is X:
            assert claim.numbers.get("ours") or claim.numbers.get("readings"), claim.key


def test_the_table_is_written_as_csv_and_json(done, tmp_path):
    paths = write_reproduction(tmp_path / "deep" / "er", done)
    with paths["csv"].open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [row["id"] for row in rows] == [claim.key for claim in done.claims]
    written = json.loads(paths["json"].read_text(encoding="utf-8"))
    assert sum(written["counts"].values()) == len(written["claims"]) == len(rows)
    assert all(item["reason"] for item in written["without_claim"])
    text = paths["report"].read_text(encoding="utf-8")
    assert "contradicts the paper" in text
    assert text.count("plotly-graph-div") >= sum(len(result.figures) for result in done.results.values())


def test_an_unknown_paper_is_named():
    with pytest.raises(InputError, match=r"paper 'mmt' -- expected one of iftomm2013, .*ame2020"):
        reproduce(["mmt"])


def test_a_place_that_cannot_be_written_is_named(done, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"--out .*file.deep -- could not be written .* -- choose another folder"):
        write_reproduction(tmp_path / "file" / "deep", done)
