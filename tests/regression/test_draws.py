"""Draws from a card against the distribution that it says, and inside its bounds."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.stats import kstest, norm

from tsm_fmu.card import CardParameter, Correlation, ModelCard
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.draws import TRIES, draw

RHO = -0.62
MANY = 4000


def card(hi: float = math.inf, rho: float = RHO, logarithm: tuple[str, ...] = ("alpha",)) -> ModelCard:
    """Backlash whose c is known as it is and whose alpha by its logarithm."""
    return ModelCard(
        "PairedTsmBacklash",
        parameters={
            "c": CardParameter(0.93, "1", 0.031, 0.0, hi),
            "alpha": CardParameter(7.1, "1/rad", 1.9, 0.0, math.inf),
            "beta": CardParameter(-0.41, "1", None, -math.inf, 0.0, fixed=True),
            "x_0": CardParameter(0.2, "rad"),
        },
        correlation=Correlation(("c", "alpha"), ((1.0, rho), (rho, 1.0)), logarithm),
    )


def test_draws_have_the_mean_the_errors_and_the_correlation_of_the_card() -> None:
    found = draw(card(), MANY, 5)
    assert found.names == ("c", "alpha")
    assert found.values.shape == (MANY, 2)
    c = (found.values[:, 0] - 0.93) / 0.031
    alpha = np.log(found.values[:, 1] / 7.1) / (1.9 / 7.1)
    for x in (c, alpha):
        assert kstest(x, norm.cdf).pvalue > 1e-3
    assert np.corrcoef(c, alpha)[0, 1] == pytest.approx(RHO, abs=4.0 * (1.0 - RHO**2) / math.sqrt(MANY))
    assert found.held == ("x_0",)  # free, and nobody knows its error
    assert found.refused == 0


def test_without_the_logarithm_errors_are_normal_themselves() -> None:
    alpha = draw(card(logarithm=()), MANY, 5).values[:, 1]
    assert kstest((alpha - 7.1) / 1.9, norm.cdf).pvalue > 1e-3


@pytest.mark.parametrize("rho", [1.0, -1.0])
def test_errors_that_are_one_are_drawn_as_one(rho: float) -> None:
    values = draw(card(rho=rho, logarithm=()), 50, 2).values
    assert (values[:, 1] - 7.1) / 1.9 == pytest.approx(rho * (values[:, 0] - 0.93) / 0.031, abs=1e-6)


def test_what_bounds_refuse_is_drawn_again() -> None:
    """Half of a normal distribution: its mean is sqrt(2/pi) deviations below."""
    found = draw(card(hi=0.93), MANY, 7)
    c = found.values[:, 0]
    assert c.max() <= 0.93
    assert (0.93 - c.mean()) / 0.031 == pytest.approx(math.sqrt(2.0 / math.pi), abs=0.05)
    assert found.refused == pytest.approx(MANY, rel=0.1)


def test_bounds_that_leave_no_room_are_said() -> None:
    far = card(hi=0.93 - 20.0 * 0.031)
    message = f"card of PairedTsmBacklash: 0 of {10 * TRIES + 1} draws were allowed, the last was draw ["
    with pytest.raises(InputError, match=re.escape(message)):
        draw(far, 3, 1)
    with pytest.raises(InputError, match=re.escape(f"0 of {20 * TRIES + 1} draws were allowed")):
        draw(far, 20, 1)


def test_a_seed_is_a_result() -> None:
    one, same, other = draw(card(), 9, 4), draw(card(), 9, 4), draw(card(), 9, (4, 1))
    assert np.array_equal(one.values, same.values)
    assert not np.array_equal(one.values, other.values)
    assert np.array_equal(draw(card(), 5, 4).values, one.values[:5])


def test_a_card_without_correlation_is_refused() -> None:
    with pytest.raises(InputError, match=r"card of PairedTsmBacklash does not say how the errors .* are correlated"):
        draw(ModelCard("PairedTsmBacklash", parameters={"c": CardParameter(0.9, "1", 0.1)}), 3, 0)
