"""Limits of what counts as left to explain, each alone and from either side; noise of signals whose noise is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import floors as module
from tsm_fmu.diagnosis.choice.floors import _repeats, floors_of, mostly_explained, open_channels, white_noise
from tsm_fmu.diagnosis.fits.refit import Task
from tsm_fmu.regression.problem import FitRun

SPREAD = 3.7
EFFECT, WANDERING, LAW_FORM, REFERENCE = 0.012, 0.02, 0.03, 1.3
"""As docs/diagnosis.md lists them: numbers of this test, not of the code under test."""


def fit(rmse: float, share: float = 0.0, white: float | None = None, other: float = 0.01) -> Any:
    """What leaves ``rmse`` of the spread on the first of two channels, of which ``share`` of the square is predictable
    and ``white`` changes from sample to sample (all of it by default). The second channel is noise alone.
    """
    size = np.array([rmse, other]) * SPREAD
    return SimpleNamespace(
        rmse=size, spread=np.full(2, SPREAD), share=np.array([share, 0.0]),
        white=np.array([rmse if white is None else white, other]) * SPREAD,
        problem=SimpleNamespace(channels=("F", "x")), task=Task("", (), (), {}),
    )  # fmt: skip


def one(fitted: Any, *effects: str, held_out: float | None = None, other: float = 0.01) -> Any:
    out = None if held_out is None else (np.array([held_out, other]) * SPREAD) ** 2
    return SimpleNamespace(fitted=fitted, effects=effects, measured=fitted.rmse**2, held_out=out)


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is predictable, white and repeated is what the fit says here."""
    monkeypatch.setattr(module, "_predictable", lambda fitted: fitted.share)
    monkeypatch.setattr(module, "white_noise", lambda fitted: fitted.white)
    monkeypatch.setattr(module, "_repeats", lambda fitted: getattr(fitted, "repeats", None))


def open_(fitted: Any, base: Any = None, reference: Any = None, steps: tuple[float, float] = (0.0, 0.0)) -> bool:
    """With steps of converters that make these parts of the spread of the two channels."""
    fitted.task = Task("", (), (), {}, steps=np.array(steps) * SPREAD)
    first, second = open_channels(one(fitted), base or fitted, reference)
    assert not second
    return bool(first)


@pytest.mark.parametrize(
    ("rmse", "share", "lawful"),
    [
        (0.5, 0.099, False), (0.5, 0.101, True),  # a tenth is predictable
        (EFFECT / 0.6 * 0.99, 0.36, False), (EFFECT / 0.6 * 1.01, 0.36, True),  # and as much as an effect
    ],
)  # fmt: skip
def test_a_law_is_a_tenth_of_what_is_left_and_as_large_as_an_effect(rmse, share, lawful) -> None:
    assert open_(fit(rmse, share)) is lawful


@pytest.mark.parametrize(("rmse", "share"), [(0.02, 0.6), (0.05, 0.2)])
@pytest.mark.parametrize(("part", "lawful"), [(0.99, True), (1.01, False)])
def test_part_of_what_was_removed_may_be_left_as_a_law(rmse, share, part, lawful) -> None:
    """Three hundredths of what the fit leaves less than the baseline."""
    removed = share * rmse**2 / LAW_FORM * part
    base = fit(float(np.sqrt(rmse**2 + removed)))
    assert open_(fit(rmse, share), base) is lawful


@pytest.mark.parametrize(
    ("rmse", "white", "wanders"),
    [
        (0.1, 0.0705, True), (0.1, 0.0709, False),  # half of the square
        (WANDERING / 0.8 * 1.01, 0.6 * WANDERING / 0.8, True), (WANDERING / 0.8 * 0.99, 0.6 * WANDERING / 0.8, False),
        (0.015, 0.015 / 6.05, True), (0.015, 0.015 / 5.95, False),  # slow: six times its white part
        (EFFECT * 1.001, 1e-6, True), (EFFECT * 0.999, 1e-6, False),
    ],
)  # fmt: skip
def test_what_wanders_is_open_where_it_is_slow_or_large(rmse, white, wanders) -> None:
    fitted = fit(rmse, 0.0, white)
    assert open_(fitted) is wanders
    assert not open_(fitted, steps=(rmse, 0.0))  # between two levels
    assert open_(fitted, steps=(0.0, rmse)) is wanders


@pytest.mark.parametrize(("part", "wanders"), [(0.99, True), (1.01, False)])
def test_part_of_what_was_removed_may_wander(part: float, wanders: bool) -> None:
    coloured = 0.1**2 - 0.05**2
    base = fit(float(np.sqrt(0.1**2 + part * coloured / LAW_FORM)))
    assert open_(fit(0.1, 0.0, 0.05), base) is wanders


@pytest.mark.parametrize(
    ("rmse", "share", "left_there", "is_open"),
    [
        (0.1, 0.5, 0.1 / REFERENCE * 1.001, False), (0.1, 0.5, 0.1 / REFERENCE * 0.999, True),
        (0.02, 0.0, (0.02**2 - EFFECT**2 * 0.98) ** 0.5 / REFERENCE, False),  # no law, and not much more
        (0.02, 0.0, (0.02**2 - EFFECT**2 * 1.02) ** 0.5 / REFERENCE, True),
    ],
)  # fmt: skip
def test_a_gap_beside_reference_runs_is_what_is_1_3_times_theirs(rmse, share, left_there, is_open) -> None:
    assert open_(fit(rmse, share), reference=fit(left_there)) is is_open


def test_of_what_was_removed_part_may_be_more_than_on_reference_runs() -> None:
    above = 0.1**2 - (REFERENCE * 0.05) ** 2
    for part, is_open in ((0.99, True), (1.01, False)):
        base = fit(float(np.sqrt(0.1**2 + part * above / LAW_FORM)))
        assert open_(fit(0.1), base, fit(0.05)) is is_open


@pytest.mark.parametrize(("made", "is_open"), [(0.0768, True), (0.0771, False)])
def test_steps_of_a_converter_explain_as_much_as_they_make(made: float, is_open: bool) -> None:
    """And what a fit to stairs is off: 1.3 times that."""
    fitted = fit(0.1, 0.5)
    assert open_(fitted, steps=(made, 0.0)) is is_open
    assert open_(fitted)


@pytest.mark.parametrize(
    ("made", "left_there", "is_open"),
    [
        (0.07, 0.0317, True), (0.07, 0.0321, False),  # squares add: 0.1^2 = (1.3 * 0.07)^2 + (1.3 * 0.0319)^2
        (0.0768, 0.07691, True), (0.0768, 0.07694, False),  # what leaves as much there as the steps make has them too
    ],
)  # fmt: skip
def test_beside_steps_a_channel_leaves_what_reference_runs_leave(made: float, left_there: float, is_open: bool) -> None:
    assert open_(fit(0.1, 0.5), reference=fit(left_there), steps=(made, 0.0)) is is_open


@pytest.mark.parametrize(("left", "mostly"), [(0.99, True), (1.01, False)])
@pytest.mark.parametrize("beside", [False, True])
def test_four_fifths_of_the_square_above_noise_are_nearly_all(left: float, mostly: bool, beside: bool) -> None:
    noise, gap = 0.05, 0.5**2 - 0.05**2
    rmse = float(np.sqrt(noise**2 + left * 0.2 * gap))
    fitted = fit(rmse, white=0.3 if beside else noise)
    reference = fit(noise) if beside else None
    assert bool(mostly_explained(one(fitted, "wear"), one(fit(0.5)), reference)[0]) is mostly
    assert not mostly_explained(one(fitted), one(fit(0.5)), reference)[0]


@pytest.mark.parametrize(("left", "mostly"), [(0.99, True), (1.01, False)])
def test_measured_and_held_out_runs_count_together(left: float, mostly: bool) -> None:
    noise = 0.05
    gap = 0.3**2 - noise**2 + 0.6**2 - noise**2
    rest = left * 0.2 * gap  # a third of it on the measured runs
    fitted = fit(float(np.sqrt(noise**2 + rest / 3.0)), white=noise)
    out = float(np.sqrt(noise**2 + rest / 1.5))
    before = one(fit(0.3), held_out=0.6)
    assert bool(mostly_explained(one(fitted, "wear", held_out=out), before, None)[0]) is mostly
    alone = one(fitted, "wear")  # without it on either side the measured ones do
    by_measured = rest / 3.0 < 0.2 * (0.3**2 - noise**2)
    assert bool(mostly_explained(alone, before, None)[0]) is by_measured


def floors(best: Any, winner: Any = None, reference: Any = None) -> Any:
    choice: Any = SimpleNamespace(best=one(best), winner=one(winner or best, "wear"))
    return floors_of(choice, one(fit(0.3)), reference)


def test_noise_is_what_no_coordinate_predicts_and_no_period_repeats() -> None:
    best = fit(0.1, 0.36, white=0.02)
    assert floors(best).noise[0] == pytest.approx(0.08 * SPREAD)
    assert floors(best).least[0] == pytest.approx(0.02 * SPREAD)
    best.repeats = np.array([0.03, 1.0]) * SPREAD
    assert floors(best).noise[0] == pytest.approx(0.03 * SPREAD)
    assert floors(best).least[0] == pytest.approx(0.03 * SPREAD)  # what repeats is surely no noise, and the rest is
    best.repeats = np.array([0.01, 1.0]) * SPREAD
    assert floors(best).noise[0] == pytest.approx(0.02 * SPREAD)  # not less than what is white
    best.repeats, best.white = np.zeros(2), np.zeros(2)
    assert floors(best).noise == pytest.approx(np.full(2, 1e-9 * SPREAD))
    assert floors(fit(0.1, 0.36, white=0.5)).least[0] == pytest.approx(0.1 * SPREAD)  # nor more than is left
    assert floors(fit(0.1, 1.7, white=0.02)).noise[0] == pytest.approx(0.02 * SPREAD)
    assert floors(fit(0.1, -0.4, white=0.02)).noise[0] == pytest.approx(0.1 * SPREAD)
    smaller = floors(fit(0.1, 0.0, white=0.07), fit(0.05, 0.0, white=0.02))  # all channels together are best
    assert smaller.noise[0] == smaller.least[0] == pytest.approx(0.05 * SPREAD)


def test_no_floor_is_below_what_reference_runs_leave() -> None:
    best = fit(0.1, 0.36, white=0.02)
    low, between, high = (floors(best, reference=fit(x)) for x in (0.01, 0.05, 0.3))
    assert (low.noise[0], low.least[0]) == (pytest.approx(0.08 * SPREAD), pytest.approx(0.02 * SPREAD))
    assert (between.noise[0], between.least[0]) == (pytest.approx(0.08 * SPREAD), pytest.approx(0.05 * SPREAD))
    assert (high.noise[0], high.least[0]) == (pytest.approx(0.3 * SPREAD), pytest.approx(0.3 * SPREAD))
    assert high.reference == pytest.approx(np.array([0.3, 0.01]) * SPREAD)
    assert floors(best).reference is None


def test_unexplained_is_what_is_open_and_not_mostly_closed() -> None:
    lawful = fit(0.1, 0.5, white=0.01)
    found = floors(lawful)
    assert (list(found.open_), list(found.unexplained)) == ([True, False], [False, False])
    choice: Any = SimpleNamespace(best=one(lawful), winner=one(lawful, "wear"))
    found = floors_of(choice, one(fit(0.15)), None)
    assert (list(found.open_), list(found.unexplained)) == ([True, False], [True, False])


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """The functions themselves, for the tests of what they measure."""
    monkeypatch.undo()


@pytest.mark.usefixtures("real")
def test_third_differences_leave_the_noise_of_a_smooth_signal() -> None:
    """White noise of two runs by its variance, beside a parabola, which they do not see, and one jump."""
    rng = np.random.default_rng(17)
    t = np.linspace(0.0, 1.0, 20_000)
    smooth = (40.0 * t**2 - 3.0 * t + 7.0)[:, None] + np.where(t > 0.3, 5.0, 0.0)[:, None]
    sizes = np.array([[0.3, 0.02], [0.1, 0.06]])
    runs = [smooth + size * rng.normal(size=(t.size, 2)) for size in sizes]
    found = white_noise(SimpleNamespace(residuals=runs))  # pyright: ignore[reportArgumentType]
    assert found == pytest.approx(np.sqrt(np.mean(sizes**2, axis=0)), rel=0.02)


@pytest.mark.usefixtures("real")
def test_what_does_not_repeat_is_pooled_over_the_samples_of_the_runs() -> None:
    rng, runs = np.random.default_rng(4), []
    for count, size in ((3000, 0.05), (1000, 0.3)):
        t = 0.01 * np.arange(count)
        x = np.sin(2.0 * np.pi * t / 2.0)
        runs.append(FitRun("r", t, x[:, None], (x**3 + size * rng.normal(size=count))[:, None]))
    fitted: Any = SimpleNamespace(problem=SimpleNamespace(runs=runs))
    assert _repeats(fitted) == pytest.approx([np.sqrt((3.0 * 0.05**2 + 0.3**2) / 4.0)], rel=0.05)
    wandering = np.cumsum(rng.normal(size=(900, 1)), axis=0)
    runs.append(FitRun("w", 0.01 * np.arange(900), wandering, wandering))
    assert _repeats(fitted) is None
