"""A channel that nothing explains takes no name away from another that has nothing to do with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice.explained import of_explained_channels, of_levels
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis
from tsm_fmu.diagnosis.choice.supported import Choice
from tsm_fmu.diagnosis.fits.quantised import Levels
from tsm_fmu.diagnosis.fits.refit import Fitted, Task

CHANNELS = ("x_out", "tau_in")
ACTS = {"slack@x_out": (0.2, 0.0), "wear": (0.0, 0.1), "tendon_elasticity": (0.2, 0.1), "delay@x_out": (0.03, 0.0)}
"""What the effects change, as part of the spread of each channel."""
EXPLAINED = np.array([True, False])


def made(added: Sequence[str], left: Sequence[float], held: Sequence[float] | None = None) -> Hypothesis:
    """A hypothesis that leaves these RMS values of channels that spread by 1."""

    class Left:
        task = Task("TendonDrive", [], CHANNELS, {})
        effects = tuple(added)
        spread = np.ones(2)
        rmse = np.array(left)
        residuals = (np.zeros((9, 2)),)
        problem = SimpleNamespace(channels=CHANNELS)

        def share_of(self, spec: str) -> np.ndarray:
            return np.array(ACTS[spec])

    tests: Mapping[str, Any] = {}
    square = (np.square(left), None if held is None else np.square(held), 400.0 * np.ones(2), 400.0 * np.ones(2))
    return Hypothesis(tuple(added), cast("Fitted", Left()), (), *square, nuisance_tests=lambda: tests)


REFITTED = made([], [0.17, 0.03], [0.19, 0.03])


def chosen(
    *supported: Hypothesis, known: Sequence[Hypothesis] = (), refitted: Hypothesis = REFITTED,
    reference: tuple[float, float] | None = None,
) -> Choice | None:  # fmt: skip
    fit: Any = None if reference is None else SimpleNamespace(rmse=np.array(reference))
    return of_explained_channels(Choice(supported[0], supported), refitted, EXPLAINED, [*known, *supported], [], fit)


def test_an_effect_of_the_explained_channel_is_named() -> None:
    one = made(["slack@x_out"], [0.008, 0.022], [0.007, 0.02])
    choice = chosen(one)
    assert choice is not None
    assert choice.winner is one


def test_what_acts_on_the_other_channel_is_left_out() -> None:
    both, alone = made(["slack@x_out", "wear"], [0.008, 0.02]), made(["slack@x_out"], [0.008, 0.022])
    choice = chosen(both, known=[alone])
    assert choice is not None
    assert choice.winner.effects == ("slack@x_out",)
    assert choice.winner.fitted is alone.fitted


@pytest.mark.parametrize(
    "one",
    [
        made(["tendon_elasticity"], [0.008, 0.022], [0.007, 0.02]),  # acts on what nothing explains
        made(["slack@x_out"], [0.12, 0.022], [0.007, 0.02]),  # leaves much of the measured runs
        made(["slack@x_out"], [0.008, 0.022], [0.12, 0.02]),  # and of held-out ones
        made([], [0.17, 0.03]),
    ],
)
def test_nothing_else_is(one: Hypothesis) -> None:
    assert chosen(one) is None


def test_what_reference_runs_leave_is_no_part_of_the_gap() -> None:
    one = made(["slack@x_out"], [0.008, 0.022], [0.13, 0.02])
    assert chosen(one) is None
    assert chosen(one, reference=(0.06, 0.02)) is not None
    assert chosen(one, reference=(0.02, 0.02)) is None


def test_no_gap_is_no_reason_for_a_name() -> None:
    assert chosen(made(["slack@x_out"], [0.001, 0.02]), refitted=made([], [0.005, 0.03])) is None


def test_it_must_close_the_channel_without_what_is_left_out() -> None:
    both, alone = made(["slack@x_out", "tendon_elasticity"], [0.008, 0.02]), made(["slack@x_out"], [0.09, 0.022])
    assert chosen(both, known=[alone]) is None


def test_what_these_runs_cannot_tell_apart_stays_a_set() -> None:
    first, second = made(["slack@x_out"], [0.008, 0.022]), made(["delay@x_out"], [0.008, 0.022])
    choice = chosen(first, second)
    assert choice is not None
    assert [h.effects for h in choice.supported] == [("slack@x_out",), ("delay@x_out",)]
    assert chosen(first, made(["tendon_elasticity"], [0.008, 0.022])) is None  # one of them says otherwise


@pytest.mark.parametrize(
    ("coarse", "open_", "kept"),
    [("x_out", (False, True), True), ("x_out", (True, True), False), ("tau_in", (False, True), False)],
)
def test_few_levels_of_a_channel_that_lacks_nothing_else_are_named(coarse: str, open_: tuple, kept: bool) -> None:
    plain, one = made([], [0.02, 0.03]), made(["wear"], [0.02, 0.02])
    choice = of_levels(Choice(one, (one,)), np.array(open_), [Levels(coarse, 0.07, 0.0)], [plain, one], [])
    assert (choice is not None) is kept
    if choice:
        assert choice.winner.effects == (), "what the other channel lacks has no name"
        assert choice.best is one
    assert of_levels(Choice(one, (one,)), np.array(open_), [], [plain, one], []) is None
