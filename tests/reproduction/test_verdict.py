"""The rules that turn numbers into verdicts, and the reasons that go with them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tsm_fmu.reproduction.claims import number_claim, open_claim, statement_claim
from tsm_fmu.reproduction.verdict import Condition, Reported, Span, Verdict, judge_number, judge_readings


def reported(lo, hi, accuracy):
    return Reported(Span(lo, hi), "mm", "Fig. 7", accuracy, "a reason")


@pytest.mark.parametrize(
    ("printed", "ours", "verdict"),
    [
        (reported(3.7, 3.7, 0.1), Span(3.61, 3.61), Verdict.REPRODUCED),
        (reported(3.7, 3.7, 0.1), Span(3.59, 3.59), Verdict.CONTRADICTS),
        (reported(-3.7, -3.7, 0.1), Span(3.7, 3.7), Verdict.CONTRADICTS),
        (reported(3.7, 3.7, 0.1), Span(2.9, 4.3), Verdict.CONSISTENT),
        (reported(3.7, 3.7, 0.1), Span(2.1, 3.65), Verdict.CONSISTENT),
        (reported(3.7, 3.7, 0.1), Span(2.1, 3.5), Verdict.CONTRADICTS),
        (reported(3.7, 3.7, 0.1), Span(0.2, 3.95), Verdict.NOT_DETERMINED),
        (reported(3.7, 3.7, 0.1), Span(0.0, 3.7), Verdict.NOT_DETERMINED),
        (reported(0.58, 0.61, 0.01), Span(0.59, 0.59), Verdict.CONSISTENT),
        (reported(0.58, 0.61, 0.01), Span(0.64, 0.64), Verdict.CONTRADICTS),
        (None, Span(1.3, 1.3), Verdict.NOT_DETERMINED),
        (reported(3.7, 3.7, 0.1), None, Verdict.NOT_DETERMINED),
    ],
)
def test_numbers(printed, ours, verdict):
    assert judge_number(printed, ours) is verdict


def test_a_comparison_that_lacks_something_is_not_determined_even_if_the_numbers_agree():
    assert judge_number(reported(3.7, 3.7, 0.1), Span(3.7, 3.7), "the amplitude") is Verdict.NOT_DETERMINED


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.01, 5))
def test_a_number_contradicts_exactly_where_the_distance_exceeds_the_accuracy(value, ours, accuracy):
    verdict = judge_number(reported(value, value, accuracy), Span(ours, ours))
    assert (verdict is Verdict.CONTRADICTS) == (abs(value - ours) > accuracy)


@pytest.mark.parametrize(
    ("held", "verdict"),
    [
        ([True, True], Verdict.REPRODUCED),
        ([True, False], Verdict.NOT_DETERMINED),
        ([False, False], Verdict.CONTRADICTS),
        ([False], Verdict.CONTRADICTS),
    ],
)
def test_statements_are_judged_over_their_readings(held, verdict):
    readings = {f"reading {k}": Condition(0.3 if holds else 0.9, "<=", 0.7) for k, holds in enumerate(held)}
    assert judge_readings(readings) is verdict


@pytest.mark.parametrize(("value", "relation", "holds"), [(0.7, "<=", True), (0.71, "<=", False), (0.7, ">=", True)])
def test_a_condition_holds_on_its_limit(value, relation, holds):
    assert Condition(value, relation, 0.7).holds is holds


@pytest.mark.parametrize("make", [lambda: Span.of(1.3, math.nan), lambda: Condition(math.nan, "<=", 0.7)])
def test_nan_never_becomes_a_verdict(make):
    with pytest.raises(ValueError, match="expected"):
        make()


def test_an_explanation_is_given_for_its_own_verdict_only():
    why = {Verdict.REPRODUCED: "because it fits"}
    fits = number_claim("p.a", "Fig. 7", "width", reported(3.7, 3.7, 0.1), 3.64, why)
    misses = number_claim("p.a", "Fig. 7", "width", reported(3.7, 3.7, 0.1), 4.9, why)
    assert fits.reason == "3.64 is within 0.1 mm of 3.7; because it fits"
    assert misses.reason == "4.9 misses 3.7 by 1.2, more than 0.1 mm"
    assert "a reason" in fits.rule


def test_rows_say_what_was_compared():
    statement = statement_claim(
        "p.b", "Eq. (3)", "slope", "1", "it rises", {"as printed": Condition(-0.8, ">=", 0.0)}, {}
    )
    assert (statement.reported, statement.ours) == ("it rises", "-0.8")
    assert statement.reason == "as printed: -0.8 (violates >= 0)"
    unknown = open_claim("p.c", "Fig. 9", "error", None, "no raw data", reported=reported(0.027, 0.027, 5e-4))
    assert (unknown.reported, unknown.ours, unknown.reason) == ("0.027", "not computable", "no raw data")
    assert unknown.numbers["ours"] is None
