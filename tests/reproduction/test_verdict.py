"""The rules that turn prints and numbers into verdicts, and the reasons that go with them."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tsm_fmu.reproduction.claims import (
    Open,
    number_claim,
    open_claim,
    statement_claim,
    together_claim,
)
from tsm_fmu.reproduction.printed import Printed, printed, trials, value
from tsm_fmu.reproduction.verdict import (
    FAILED,
    Condition,
    Kind,
    Span,
    Verdict,
    judge_numbers,
    judge_readings,
    judge_together,
)

PRINT = printed("3.7", "mm", "Fig. 7")
FREE = Open("stiffness", "3 to 9 N", "assumed")


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("10.5", 10.45, 10.55),
        ("around 3", 2.5, 3.5),
        ("-4.514", -4.5145, -4.5135),
        ("approximately 2/3", 0.5, 5 / 6),
        ("1.14 to 1.24", 1.135, 1.245),
        ("0.0150", 0.01495, 0.01505),
        ("205.99", 205.985, 205.995),
    ],
)
def test_a_print_is_all_that_rounds_to_it(text, low, high):
    found = printed(text, "mm", "Fig. 3")
    assert found.text == text
    assert found.span.ends == pytest.approx((low, high), abs=1e-12)


@settings(deadline=None, derandomize=True, database=None)
@given(st.floats(-50, 50), st.integers(0, 4))
def test_what_was_rounded_lies_in_its_print(number, digits):
    text = f"{number:.{digits}f}"
    span = printed(text, "1", "Table 1").span
    assert span.lo - 1e-9 <= number <= span.hi + 1e-9
    assert span.width == pytest.approx(10.0**-digits)


@pytest.mark.parametrize("text", ["many", "1 and 2 to 3", "", "3.1 and 2.2"])
def test_what_is_no_number_is_refused(text):
    with pytest.raises(ValueError, match="expected one number"):
        printed(text, "mm", "Fig. 3")


def test_one_more_trial_lies_in_the_span_of_five_in_95_of_100():
    """By simulation: the prediction interval is about a further trial, not about the mean."""
    rng = __import__("numpy").random.default_rng(7)
    inside = 0
    for _ in range(2000):
        *five, sixth = rng.normal(0.59, 0.01, 6)
        inside += trials(tuple(f"{v:.5f}" for v in five), "deg", "Table 1").span.meets(Span.of(sixth))
    assert 0.93 < inside / 2000 < 0.97


def test_trials_show_lowest_and_highest():
    assert trials(("0.0150", "-0.0036", "0.0168"), "deg", "Table 1").text == "-0.0036 to 0.0168"
    assert value("around 3") == 3.0


@pytest.mark.parametrize("kind", Kind)
@pytest.mark.parametrize(
    ("ours", "free", "verdict"),
    [
        (Span(3.66, 3.66), 0, Verdict.REPRODUCED),
        (Span(3.66, 3.74), 2, Verdict.CONSISTENT),
        (Span(3.1, 3.7), 1, Verdict.NOT_DETERMINED),
        (Span(3.1, 9.7), 1, Verdict.NOT_DETERMINED),
        (Span(3.1, 3.64), 1, None),
        (Span(-3.7, -3.7), 0, None),
    ],
)
def test_numbers(kind, ours, free, verdict):
    assert judge_numbers(kind, [PRINT.span], [ours], free) is (verdict or FAILED[kind])


@settings(deadline=None, derandomize=True, database=None)
@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.01, 5), st.integers(0, 3), st.sampled_from(list(Kind)))
def test_a_number_fails_exactly_where_no_value_of_ours_is_printed(at, low, width, free, kind):
    span, ours = Span(at - 0.5, at + 0.5), Span(low, low + width)
    failed = judge_numbers(kind, [span], [ours], free) is FAILED[kind]
    assert failed == (ours.lo > span.hi or ours.hi < span.lo)


@settings(deadline=None, derandomize=True, database=None)
@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=6), st.integers(0, 8))
def test_a_set_of_values_tests_only_more_numbers_than_it_has(pairs, free):
    prints, best = [Span(a - 1.0, a + 1.0) for a, _ in pairs], [b for _, b in pairs]
    verdict = judge_together(Kind.MEASUREMENT, prints, best, free)
    if any(abs(a - b) > 1.0 + 1e-9 for a, b in pairs):
        assert verdict is Verdict.NOT_EXPLAINED
    elif all(abs(a - b) < 1.0 - 1e-9 for a, b in pairs):
        expected = Verdict.CONSISTENT if len(pairs) > free else Verdict.NOT_DETERMINED
        assert verdict is (Verdict.REPRODUCED if free == 0 else expected)


@pytest.mark.parametrize("kind", Kind)
@pytest.mark.parametrize("held", [[True, True], [True, False], [False, False], [False], [True]])
@pytest.mark.parametrize("free", [0, 1, 3])
def test_statements_are_judged_over_their_readings(kind, held, free):
    readings = {f"reading {k}": Condition(0.3 if holds else 0.9, "<=", 0.7) for k, holds in enumerate(held)}
    best = Verdict.CONSISTENT if kind is Kind.READING or free else Verdict.REPRODUCED
    expected = best if all(held) else Verdict.NOT_DETERMINED if any(held) else FAILED[kind]
    assert judge_readings(kind, readings, free) is expected


@pytest.mark.parametrize(("value_", "relation", "holds"), [(0.7, "<=", True), (0.71, "<=", False), (0.7, ">=", True)])
def test_a_condition_holds_on_its_limit(value_, relation, holds):
    assert Condition(value_, relation, 0.7).holds is holds


@pytest.mark.parametrize("make", [lambda: Span.of(1.3, math.nan), lambda: Condition(math.nan, "<=", 0.7), Span.of])
def test_nan_never_becomes_a_verdict(make):
    with pytest.raises(ValueError, match="expected"):
        make()


def test_an_explanation_is_given_for_its_own_verdict_only():
    why = {Verdict.REPRODUCED: "because it fits"}
    fits = number_claim("p.a", "Fig. 7", "width", PRINT, 3.68, why=why)
    misses = number_claim("p.a", "Fig. 7", "width", PRINT, 4.9, why=why)
    assert fits.reason == "3.68 is what is printed as 3.7; because it fits"
    assert misses.reason == "4.9 misses 3.7 by 1.15 mm"
    assert misses.verdict is Verdict.NOT_EXPLAINED


def test_rows_show_the_print_as_printed_and_say_what_is_open():
    around = printed("around 3", "deg", "Fig. 10")
    claim = number_claim("p.b", ("Fig. 10", "Fig. 7"), "residual", around, Span(1.2, 7.7), assumed=(FREE,))
    assert (claim.printed, claim.ours, claim.verdict) == ("around 3", "1.2 to 7.7", Verdict.NOT_DETERMINED)
    assert str(claim.assumed[0]) == "stiffness 3 to 9 N (assumed)"
    nothing = open_claim("p.c", "Fig. 9", "range", "no axis", ours=Span(1.0, 2.0), unit="N")
    assert (nothing.printed, nothing.numbers["printed"]) == ("-", None)
    known = open_claim("p.d", "Fig. 9", "error", "no raw data", prints=[printed("0.027", "N2", "Section 5")])
    assert (known.printed, known.ours, known.unit) == ("0.027", "-", "N2")


def test_together_names_what_is_missed():
    prints = {"width": PRINT, "depth": printed("12", "mm", "Fig. 8")}
    claim = together_claim("p.e", "Fig. 7", "both", prints, {"width": 3.71, "depth": 13.1}, assumed=(FREE,))
    assert claim.reason == "1 of 2 numbers are met at once; missed: depth (13.1 for 12)"
    assert claim.verdict is Verdict.NOT_EXPLAINED
    met = together_claim("p.e", "Fig. 7", "both", prints, {"width": 3.71, "depth": 12.1}, assumed=(FREE,))
    assert met.verdict is Verdict.CONSISTENT


def test_a_claim_names_the_function_that_made_it():
    claim = statement_claim("p.f", "Eq. (3)", "slope", "1", "'it rises'", {"print": Condition(-0.8, ">=", 0.0)})
    assert claim.code.endswith(":test_a_claim_names_the_function_that_made_it")
    assert isinstance(PRINT, Printed)
