"""The claims of a quick run of all papers: what must hold whatever the numbers are, and oracles for the numbers."""

import csv
import json
import math
import os
import re
from pathlib import Path

import pytest

from tests.browser import LARGEST
from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.reproduction import reproduce, write_reproduction
from tsm_fmu.reproduction.claims import NOTHING, Method
from tsm_fmu.reproduction.mmt2015.printed import allowed_mse
from tsm_fmu.reproduction.page import checked_by, place, source
from tsm_fmu.reproduction.published import ITEMS, PAPERS
from tsm_fmu.reproduction.verdict import (
    Condition,
    Kind,
    Span,
    Verdict,
    judge_numbers,
    judge_readings,
    judge_together,
)
from tsm_fmu.reproduction.write import COLUMNS


def again(claim):
    """The verdict that follows from the numbers which a claim shows to machines, and from nothing else."""
    n = claim.numbers
    if "readings" in n:
        readings = {name: Condition(**c) for name, c in n["readings"].items()}
        return judge_readings(claim.kind, readings, len(claim.assumed))
    if n["printed"] is None or n["ours"] is None or ("where" not in n and "free" not in n):
        return Verdict.NOT_DETERMINED
    if "free" in n:
        names = list(n["printed"])
        return judge_together(
            claim.kind, [Span(*n["printed"][k]) for k in names], [n["ours"][k] for k in names], n["free"]
        )
    return judge_numbers(claim.kind, [Span(*n["printed"])], [Span(*n["ours"])], len(claim.assumed))


def test_every_verdict_follows_from_its_numbers(done):
    for claim in done.claims:
        assert claim.verdict is again(claim), claim.key


def test_keys_are_unique_and_facts_stand_once(done):
    keys = [claim.key for claim in done.claims]
    assert len(keys) == len(set(keys))
    facts = [(claim.paper, claim.quantity) for claim in done.claims]
    assert len(facts) == len(set(facts))


def test_at_least_half_of_the_claims_are_co_simulated(done):
    assert 2 * done.co_simulated >= len(done.claims)
    assert {c.paper for c in done.claims if c.method is Method.CO_SIMULATION} == set(done.results)


def test_what_no_paper_prints_stands_under_no_print(done):
    for claim in done.claims:
        if claim.numbers.get("printed") is None and "readings" not in claim.numbers:
            assert claim.printed == NOTHING, claim.key
        else:
            assert claim.printed != NOTHING, claim.key


def test_an_internal_error_needs_the_print_alone(done):
    for claim in done.claims:
        if claim.verdict is Verdict.INTERNAL_ERROR:
            assert claim.kind is Kind.PRINT, claim.key
        if claim.kind is Kind.MEASUREMENT and claim.method is Method.MODEL:
            assert claim.assumed or claim.verdict is Verdict.NOT_DETERMINED, claim.key


def test_every_assumption_has_a_range_and_a_source(done):
    for claim in done.claims:
        for assumed in claim.assumed:
            assert all((assumed.what, assumed.values, assumed.source)), claim.key


def test_every_row_shows_the_code_that_computed_it(done):
    for claim in done.claims:
        text = source(claim.code)
        assert text.startswith("def "), claim.key
        assert re.search(r"(claim|_claim)\(", text), claim.key


def test_every_row_shows_the_tests_that_name_it(done):
    """Tests of this repository: one for every row, more for the rows that they name."""
    named = 0
    for claim in done.claims:
        tests = checked_by(claim.key)
        assert tests[-1]["name"] == "test_every_verdict_follows_from_its_numbers", claim.key
        for test in tests[:-1]:
            assert claim.key in test["text"] or "reading_unique" in claim.key, claim.key
            named += 1
        file, _, line = place(claim.code).rpartition(":")
        text = (Path(__file__).parents[2] / file).read_text(encoding="utf-8").splitlines()[int(line) - 1]
        assert text.startswith(f"def {claim.code.partition(':')[2]}("), claim.key
    assert named > 20


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
    for claim in done.claims:
        assert f'id="{claim.key.replace(".", "-")}"' in text
    drawn = sum(len(panels) for result in done.results.values() for panels in result.figures.values())
    assert text.count('class="plot"') == drawn + 1  # the proof below the headline, once more at its place
    assert paths["report"].stat().st_size < LARGEST
    shown = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert "http://" not in shown
    targets = re.findall(r'href="#([^"]+)"', shown)
    assert len(targets) > len(done.claims)
    for target in targets:
        assert f'id="{target}"' in shown, target


def test_an_unknown_paper_is_named():
    with pytest.raises(InputError, match=r"paper 'mmt' -- expected one of iftomm2013, .*ame2020"):
        reproduce(["mmt"])


def test_a_place_that_cannot_be_written_is_named(done, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file.deep.* could not be written .* -- choose another"):
        write_reproduction(tmp_path / "file" / "deep", done)


FIGURES = {"iftomm2013": 4, "icinco2013": 7, "mmt2015": 8, "mssp2015": 13, "ame2020": 20}


TABLES = {"iftomm2013": 0, "icinco2013": 1, "mmt2015": 0, "mssp2015": 2, "ame2020": 1}


SETUPS = {
    ("icinco2013", "Fig. 2"),
    ("mssp2015", "Fig. 9"),
    ("ame2020", "Fig. 2"),
    ("ame2020", "Fig. 4"),
    ("ame2020", "Fig. 9"),
    ("ame2020", "Fig. 11"),
    ("ame2020", "Fig. 12"),
}


"""Drawings, and curves without data, whose claims are on numbers of the text beside them."""


TEXTS = Path(os.environ.get("TSM_FMU_PAPERS", Path(__file__).parents[3] / "shared" / "papers"))


@pytest.mark.parametrize("paper", PAPERS)
def test_every_figure_and_table_is_listed(paper):
    labels = [item.label for item in ITEMS if item.paper == paper]
    assert len(labels) == len(set(labels))
    assert [x for x in labels if x.startswith("Fig.")] == [f"Fig. {n}" for n in range(1, FIGURES[paper] + 1)]
    assert [x for x in labels if x.startswith("Table")] == [f"Table {n}" for n in range(1, TABLES[paper] + 1)]


@pytest.mark.parametrize("paper", PAPERS)
def test_the_papers_have_no_further_figures(paper):
    path = TEXTS / f"{paper}.txt"
    if not path.exists():
        pytest.skip(f"{path} is not there: the papers' texts are not part of the repository")
    body = path.read_text(encoding="utf-8", errors="replace")
    captions = {int(n) for n in re.findall(r"^\W*Fig(?:ure|\.)\s*(\d+)[.:]", body, re.MULTILINE)}
    assert captions <= set(range(1, FIGURES[paper] + 1))
    assert max(captions) == FIGURES[paper]


def test_each_item_has_claims_or_the_reason_why_it_has_none(claims):
    covered = {(claim.paper, label) for claim in claims.values() for label in claim.items}
    known = {(item.paper, item.label) for item in ITEMS}
    assert covered <= known
    for item in ITEMS:
        has = (item.paper, item.label) in covered
        assert has != bool(item.no_claim), (item.paper, item.label)


def test_figures_of_results_are_drawn(done):
    """Every numbered figure that has a claim is drawn anew, those of setups apart."""
    for paper, result in done.results.items():
        for item in ITEMS:
            if item.paper == paper and item.label.startswith("Fig.") and not item.no_claim:
                drawn = item.label in result.figures
                assert drawn or (paper, item.label) in SETUPS, (paper, item.label)
        assert set(result.figures) <= {item.label for item in ITEMS if item.paper == paper}


def test_force_of_the_three_readings(ours):
    assert ours("iftomm2013.range") == pytest.approx([-1.701, 0.8453], abs=1e-3)


def test_sliding_level_is_positive_whatever_the_signs(reading):
    assert reading("iftomm2013.positive", "mu1 < 0") == pytest.approx(0.221, abs=1e-4)


def test_jump_at_zero_acceleration_is_its_closed_form(reading):
    # 2 mu4 exp(-kappa5 |v| / kappa6) at 1 um/s, in mm
    expected = 2 * 0.875 * 2.718281828459045 ** (-5.224 * 1e-3 / 0.0055)
    assert reading("iftomm2013.continuous", "v < 0") == pytest.approx(expected, rel=1e-6)


def test_storage_function_fits_reading_a_only(claims):
    """F v - dW/dt = |F v| r^n with W = F^2/(2k): it is never negative, and with k = 1 in all readings not."""
    margins = claims["iftomm2013.dissipative"].numbers["readings"]
    assert all(c["value"] > -5e-3 for c in margins.values())
    literal = claims["iftomm2013.storage"].numbers["readings"]
    assert literal["A (sigma, n)"]["value"] > -5e-3
    assert literal["B (k, sigma)"]["value"] < -1.0


def test_the_step_of_iftomm_composes(reading):
    assert reading("iftomm2013.exists", "step and halves") < 1e-6


def test_what_comes_back_is_counted_by_the_table(done):
    """Rows on identification count the values that their table calls recovered, and none is recovered outside it."""
    counted = 0
    for claim in done.claims:
        readings = claim.numbers.get("readings", {})
        if "recovered" in readings:
            tables = [done.results[claim.paper].tables.get(item) for item in claim.items]
            rows = [row for table in tables if table and table.heading[-1] == "recovered" for row in table.rows]
            names = int(readings["recovered"]["limit"])
            own = (
                rows
                if claim.paper != "mssp2015"
                else [r for r in rows if (r[0] in ("c", "beta", "alpha")) == (names == 3)]
            )
            assert len(own) == names, claim.key
            assert sum(row[-1] == "yes" for row in own) == readings["recovered"]["value"], claim.key
            counted += 1
    assert counted >= 6


def test_the_backlash_set_comes_back_whole(reading):
    assert reading("mssp2015.reading_unique_backlash", "recovered") == 3


def test_after_a_reversal_the_output_tension_follows_less(ours):
    """Slope k/(k + dF/dx): below 1 for any presliding stiffness that is positive."""
    assert all(0.0 < ratio < 1.0 for ratio in ours("iftomm2013.phases"))


def test_many_masses_beat_one(reading):
    for name in "ABC":
        assert reading("iftomm2013.baseline", f"{name}, many masses") < reading(
            "iftomm2013.baseline", f"{name}, one mass"
        )


def test_two_values_at_zero_acceleration_are_their_closed_form(reading):
    expected = 2 * 1.855 * math.exp(-5.549 * 1e-3 / 0.005)
    assert reading("icinco2013.two_values", "v < 0") == pytest.approx(expected, rel=1e-6)


def test_the_reach_is_the_speed_that_the_voltage_leaves_under_load(ours):
    """Without load and friction u/(k_e N); the springs at 1000 N/m take at most what they pull at that travel."""
    p = kernel("DcMotor").params(values={"gear_ratio": 134.0})
    free = p.u_max / (p.k_e * 134.0)
    current = (18.0 + 1000.0 * 0.025 + 6.0) * 0.025 / (p.k_t * p.efficiency * 134.0) + (p.tau_c + p.b * 700) / p.k_t
    (reach,) = set(ours("icinco2013.reach"))
    assert (p.u_max - p.R_a * current) / p.u_max * free < reach * math.tau / 25.0 < 1.02 * free


def test_the_range_holds_the_limit_cycles_of_the_imposed_sine(ours):
    """Models at 5 mm, 1 Hz: F in [-5.358, 4.826]; the loop follows within a few per cent."""
    low, high = ours("icinco2013.range_6")
    assert low == pytest.approx(-5.358, rel=0.06)
    assert high == pytest.approx(4.826, rel=0.06)


def test_triangle_inequality_interval():
    assert allowed_mse().span.ends == pytest.approx((1.085, 1.877), abs=1e-3)


def test_the_readings_span_the_mean_square_differences_of_other_integrators(ours):
    """Second cycle: 2.011 (Eqs (10)-(12), printed), 1.420 swapped, 1.320 (Eq. (9), swapped)."""
    low, high = ours("mmt2015.lugre_apart")
    assert low < 1.320 + 3e-3
    assert high == pytest.approx(2.011, abs=3e-3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("Eqs (10)-(12), periodic", 2.562),
        ("Eq. (9), periodic", 1.509),
        ("Eqs (10)-(12), non-periodic", 1.267),
        ("Eq. (9), non-periodic", 0.833),
    ],
)
def test_time_to_infinity_of_the_literal_print(reading, name, value):
    assert reading("mmt2015.literal", name) == pytest.approx(value, abs=2e-3)


def test_extremes_of_the_force(ours):
    low, high = ours("mmt2015.range_6")
    assert low <= -5.02 + 2e-3
    assert high >= 7.84 - 2e-3


def test_prepared_signals_are_worst_at_both_ends(claims):
    left = {name: c["value"] for name, c in claims["mmt2015.prepared_6"].numbers["readings"].items()}
    assert left["10 Hz"] < left["2 Hz"]
    assert left["10 Hz"] < left["50 Hz"]


def test_slope_after_a_reversal_and_what_law_1_leaves(reading):
    assert reading("mssp2015.monotone", "published set") == pytest.approx(-0.833, abs=2e-2)
    assert reading("mssp2015.eliminated", "law as printed") == pytest.approx(6.481, abs=2e-3)


def test_friction_as_printed(claims, ours, reading):
    assert ours("mssp2015.friction_range") == pytest.approx([-182.6, 182.6], abs=0.1)
    # 49 wires of 0.03 mm at 2241 and 2448 MPa; half of the largest |F|
    limits = [r["limit"] for r in claims["mssp2015.newton"].numbers["readings"].values()]
    assert limits == pytest.approx([77.6, 84.8], abs=0.05)
    assert reading("mssp2015.newton", "2241 MPa") == pytest.approx(81.68, abs=0.02)


def test_calibration_anew(ours):
    found = ours("ame2020.calibration")
    assert found == pytest.approx({"slope": 3.4371, "intercept": -4.5140, "pressure at 1.1 N": 1.6334}, abs=5e-5)


def test_a_bend_adds_more_to_the_heavier_load_both_ways(reading):
    assert reading("ame2020.bend_forward", "Eqs (23), (30)") > 0.0
    assert reading("ame2020.bend_reverse", "Eqs (32)-(36)") < 0.0


def test_preload_lowers_the_error_by_its_own_stretch(reading):
    assert reading("ame2020.preload_shape", "Eqs (23), (30)") == pytest.approx(-0.8 * 1.5 / 6786 * 1e3, rel=0.02)


def test_lugre_as_printed(reading):
    assert reading("ame2020.lugre", "sigma1 v at a reversal") == pytest.approx(15811.0, abs=1.0)


def test_strength_of_a_solid_fibre_bounds_the_span(ours):
    assert ours("ame2020.strength") == pytest.approx([0.7 * 199 / 9.81, 285 / 9.81], abs=0.1)
