"""What is left to explain: laws and wandering against noise of instruments, reference runs, few levels, clipping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tsm_fmu.diagnosis.choice.floors import floors_of, mostly_explained, open_channels
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis, hypothesis
from tsm_fmu.diagnosis.choice.patches import without_patches
from tsm_fmu.diagnosis.choice.supported import Choice
from tsm_fmu.diagnosis.fits.quantised import coarse, with_levels, without_blur
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, as_given
from tsm_fmu.diagnosis.runs.gate import gate
from tsm_fmu.kernels.arrays import FloatArray
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

DT = 0.01
REFERENCE_RATIO = 1.3
"""As docs/diagnosis.md lists it."""
MODEL = {"sigma0": 109.0, "sigma1": 0.0, "sigma2": 0.117, "F_c": 0.73, "F_s": 0.73, "v_s": 0.3}

Rig = Callable[..., FitRun]
Left = Callable[[FitRun, np.random.Generator], FloatArray]


def coloured(n: int, colour: float, rng: np.random.Generator) -> FloatArray:
    """First-order noise of unit RMS."""
    return np.asarray(lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], rng.normal(size=n + 300)))[300:]


def white(size: float) -> Left:
    return lambda run, rng: size * rng.normal(size=run.time.size)


@pytest.fixture(scope="session")
def leaving(rig: Rig) -> Callable[[Left], Fitted]:
    """A fit whose residual is what is asked for, in parts of the spread: a model plus that is the measurement."""
    base = as_given(Task("LuGreFriction", [rig(61), rig(62)], ("F",), MODEL), ())

    def fit(left: Left) -> Fitted:
        rng = np.random.default_rng(63)
        runs = [
            replace(run, targets=run.targets - r + base.spread * left(run, rng)[:, None])
            for run, r in zip(base.problem.runs, base.residuals, strict=True)
        ]
        return base.at(runs)

    return fit


def bare(fitted: Fitted, *added: str) -> Hypothesis:
    return hypothesis(added, fitted, (), [])


def open_(fitted: Fitted, base: Fitted | None = None, reference_fit: Fitted | None = None) -> bool:
    return bool(open_channels(bare(fitted), base or fitted, reference_fit)[0])


def dip(size: float) -> Left:
    """An excess at low speed, with noise of 2 %."""
    return lambda run, rng: (
        size * np.sign(run.inputs[:, 0]) * np.exp(-((run.inputs[:, 0] / 0.29) ** 2)) + white(0.02)(run, rng)
    )


def test_a_law_is_open_where_it_matters(leaving: Callable[[Left], Fitted]) -> None:
    assert open_(leaving(dip(0.07)))
    assert not open_(leaving(dip(0.012)))


def test_part_of_what_was_removed_may_be_left_as_a_law(leaving: Callable[[Left], Fitted]) -> None:
    left = leaving(dip(0.07))
    assert not open_(left, base=leaving(white(0.41)))


@pytest.mark.parametrize(("size", "colour"), [(0.05, 0.0), (0.02, 0.6), (0.011, 0.95)])
def test_noise_of_instruments_is_not_open(leaving: Callable[[Left], Fitted], size: float, colour: float) -> None:
    assert not open_(leaving(lambda run, rng: size * coloured(run.time.size, colour, rng)))


def test_what_wanders_far_is_no_noise_of_an_instrument(leaving: Callable[[Left], Fitted]) -> None:
    def wandering(run: FitRun, rng: np.random.Generator) -> FloatArray:
        return 0.05 * coloured(run.time.size, 0.97, rng)

    far = leaving(wandering)
    assert open_(far)
    stepped = replace(far, task=replace(far.task, steps=0.2 * far.rmse))
    assert not open_(stepped)  # between two levels anything wanders


def test_a_gap_as_on_reference_runs_is_the_form_of_the_model(leaving: Callable[[Left], Fitted]) -> None:
    left = leaving(dip(0.07))
    assert not open_(left, reference_fit=leaving(dip(0.07)))
    assert not open_(left, reference_fit=leaving(white(float(left.rmse[0] / left.spread[0]) / REFERENCE_RATIO * 1.02)))
    assert open_(left, reference_fit=leaving(dip(0.02)))
    assert open_(leaving(white(0.09)), reference_fit=leaving(white(0.02)))  # more than there, though it is no law


def test_floors_are_the_noise_below_a_law(leaving: Callable[[Left], Fitted]) -> None:
    left, quiet = leaving(dip(0.07)), leaving(dip(0.001))
    floors = floors_of(Choice(bare(left), (bare(left),)), bare(left), quiet)
    assert floors.noise[0] / left.spread[0] == pytest.approx(0.02, rel=0.15)
    assert floors.noise[0] < 0.8 * left.rmse[0]
    assert floors.reference == pytest.approx(quiet.rmse)
    assert floors.unexplained.all()
    mostly = floors_of(Choice(bare(left, "inertia"), (bare(left, "inertia"),)), bare(leaving(white(0.15))), None)
    assert not mostly.unexplained.any()
    hardly = floors_of(Choice(bare(left, "inertia"), (bare(left, "inertia"),)), bare(leaving(dip(0.08))), None)
    assert hardly.unexplained.all()


@pytest.mark.parametrize(
    ("removed", "left"), [((5.0,), 1), ((5.0, 4.0), 2), ((5.0, 4.0, 0.1), 2), ((5.0, 4.0, 3.0), None), ((0.1,), None)]
)
def test_where_something_is_left_two_effects_are_named_that_each_remove_more_than_that(
    leaving: Callable[[Left], Fitted], removed: tuple[float, ...], left: int | None
) -> None:
    effects = ("inertia", "viscous", "creep")[: len(removed)]
    one = bare(leaving(dip(0.07)), *effects)
    others = [
        replace(bare(one.fitted, *(e for e in effects if e != spec)), measured=one.measured * (1.0 + ratio))
        for spec, ratio in zip(effects, removed, strict=True)
    ]
    choice = without_patches(Choice(one, (one,)), [one, *others], np.array([True]), [])
    assert (choice and choice.winner.effects) == (None if left is None else effects[:left])


@pytest.mark.parametrize(("before", "mostly"), [(1.25, False), (1.6, True)])
def test_nearly_all_of_a_gap_counts_from_what_reference_runs_leave(
    leaving: Callable[[Left], Fitted], before: float, mostly: bool
) -> None:
    """Reference runs leave 0.9 of what is left: four fifths above that are closed where the gap was 1.33 of it."""
    left = leaving(dip(0.07))
    size = float(left.rmse[0] / left.spread[0])
    base, reference = bare(leaving(white(before * size))), leaving(white(0.9 * size))
    assert mostly_explained(bare(left, "inertia"), base, reference)[0] == mostly
    assert not mostly_explained(bare(left), base, reference)[0]  # without an effect nothing is explained
    assert not mostly_explained(bare(left, "inertia"), base, None)[0]  # from white noise on it was 2.2 of it


def test_what_repeats_from_period_to_period_is_no_noise(rig: Rig) -> None:
    """A law that no coordinate predicts, but which comes back each period, is above the floor; its noise is not."""
    first, rng = rig(72, rows=400), np.random.default_rng(5)
    law = np.tile(np.convolve(np.tile(rng.normal(size=400), 3), np.hanning(81) / 6.0, "same")[400:800], 5)
    law *= 0.07 / law.std()
    v = np.tile(first.inputs[:, 0] - first.inputs[:, 0].mean(), 5)
    still = replace(first, time=DT * np.arange(2000), inputs=v[:, None], targets=np.zeros((2000, 1)))
    given = as_given(Task("LuGreFriction", [replace(still, targets=np.random.default_rng(1).normal(size=(2000, 1)))],
                          ("F",), MODEL), ())  # fmt: skip
    outputs = given.problem.outputs(0, given.table[0])
    repeated = {}
    for name, times in (("whole", 5), ("not even twice", 1)):
        rows = 400 * times
        added = outputs.std() * (law + 0.02 * np.random.default_rng(6).normal(size=2000))[:, None]
        fitted = given.at(
            [replace(still, time=still.time[:rows], inputs=v[:rows, None], targets=(outputs - added)[:rows])]
        )
        floors = floors_of(Choice(bare(fitted), (bare(fitted),)), bare(fitted), None)
        repeated[name] = floors.noise[0] / outputs.std()
    assert repeated["whole"] == pytest.approx(0.02, rel=0.2)  # the bristles start at rest in the first period only
    assert repeated["not even twice"] > 0.03  # a law as far as nobody knows


def test_the_gap_is_that_of_the_held_out_runs_too(leaving: Callable[[Left], Fitted]) -> None:
    """Measured runs that show little of an effect do not make it unexplained: 0.08 to 0.07, held out 0.3 to 0.07."""
    left, before = bare(leaving(dip(0.07)), "inertia"), bare(leaving(dip(0.08)))
    spread: FloatArray = left.fitted.spread
    for held_out, unexplained in ((0.3, False), (0.08, True)):
        one = replace(left, held_out=np.square(0.07 * spread))
        vars(one)["acts"] = np.array([True])
        refitted = replace(before, held_out=np.square(held_out * spread))
        assert floors_of(Choice(one, (one,)), refitted, None).unexplained.all() == unexplained


def rounded(q: float) -> Callable[[FloatArray], FloatArray]:
    return lambda y: q * np.round(y / q)


def truncated(q: float) -> Callable[[FloatArray], FloatArray]:
    return lambda y: q * (np.floor(y / q) + 0.5)


def converted(run: FitRun, converter: Callable[[FloatArray], FloatArray], digits: int = 17) -> FitRun:
    """The log of a converter, as text with so many digits."""
    y = converter(run.targets)
    return replace(run, targets=np.array([[float(f"{value:.{digits}g}")] for value in y[:, 0]]))


@pytest.mark.parametrize("digits", [17, 8, 6])
@pytest.mark.parametrize(("converter", "offset"), [(rounded, 0.0), (truncated, 0.5)])
def test_levels_are_read_from_the_log(rig: Rig, converter: Callable, offset: float, digits: int) -> None:
    q = 0.0731
    runs = [converted(rig(seed), converter(q), digits) for seed in (64, 65)]
    (found,) = coarse(runs, ["F"], np.array([0.7]))
    assert found.q == pytest.approx(q, rel=1e-4)
    level = (found.y_0 / found.q - offset + 0.5) % 1.0 - 0.5
    assert level == pytest.approx(0.0, abs=1e-3)
    assert found.spec == "quantisation@F"


def test_no_levels_where_there_are_none_or_they_do_no_harm(rig: Rig) -> None:
    plain = [rig(66), rig(67)]
    assert coarse(plain, ["F"], np.array([0.7])) == []
    assert coarse([converted(run, lambda y: y, 5) for run in plain], ["F"], np.array([0.7])) == []
    assert coarse([converted(run, rounded(0.0031)) for run in plain], ["F"], np.array([0.7])) == []


@pytest.mark.parametrize(("blur", "spikes"), [(1e-6, 0), (3e-3, 0), (0.015, 0), (0.0, 3), (3e-3, 3)])
def test_levels_are_read_through_noise_behind_the_converter(rig: Rig, blur: float, spikes: int) -> None:
    """As an analog line adds, or the interpolation of a logger."""
    q, rng = 0.0731, np.random.default_rng(5113)
    runs = [converted(rig(seed), rounded(q)) for seed in (64, 65)]
    runs = [replace(run, targets=run.targets + blur * q * rng.normal(size=run.targets.shape)) for run in runs]
    for k in range(spikes):
        runs[0].targets[137 + 211 * k] += 0.4321 + 0.3 * k
    (found,) = coarse(runs, ["F"], np.array([0.7]))
    assert found.q == pytest.approx(q, rel=1e-3)
    assert (found.y_0 / found.q + 0.5) % 1.0 - 0.5 == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("held", [1, 7, 40])
def test_noise_behind_the_converter_may_stand_still_or_repeat_in_few_digits(rig: Rig, held: int) -> None:
    """A slow line: of the values of one level many are equal, and no two of them tell how far levels are apart."""
    q, rng = 0.0731, np.random.default_rng(5117)
    runs = [rig(seed) for seed in (64, 65)]
    slow = [np.repeat(rng.normal(size=(run.time.size // held + 1, 1)), held, axis=0)[: run.time.size] for run in runs]
    runs = [
        replace(run, targets=np.round(q * np.round(run.targets / q) + 4e-3 * q * noise, 4))
        for run, noise in zip(runs, slow, strict=True)
    ]
    assert len(np.unique([run.targets for run in runs])) < 0.1 * sum(run.time.size for run in runs)
    (found,) = coarse(runs, ["F"], np.array([0.7]))
    assert found.q == pytest.approx(q, rel=1e-3)


def test_one_run_that_blurs_its_levels_more_does_not_hide_those_of_others(rig: Rig) -> None:
    """As a logger that interpolates: some values lie between two levels, and no gap between levels stands apart."""
    q, rng = 0.0731, np.random.default_rng(5116)
    sharp, blurred = (converted(rig(seed), rounded(q)) for seed in (64, 65))
    shift = 0.012 * q * rng.normal(size=blurred.targets.shape)
    shift[::137, 0] = q * rng.uniform(0.06, 0.4, size=shift[::137, 0].shape)
    blurred = replace(blurred, targets=blurred.targets + shift)
    assert coarse([blurred], ["F"], np.array([0.7])) == []
    (found,) = coarse([sharp, blurred], ["F"], np.array([0.7]))
    assert found.q == pytest.approx(q, rel=1e-3)
    assert (found.y_0 / found.q + 0.5) % 1.0 - 0.5 == pytest.approx(0.0, abs=2e-3)


def test_levels_that_noise_hides_are_none(rig: Rig) -> None:
    q, rng = 0.0731, np.random.default_rng(5114)
    runs = [converted(rig(seed), rounded(q)) for seed in (64, 65)]
    for blur in (0.08, 0.2, 0.5):
        blurred = [replace(run, targets=run.targets + blur * q * rng.normal(size=run.targets.shape)) for run in runs]
        assert coarse(blurred, ["F"], np.array([0.7])) == []


@pytest.mark.parametrize("size", [0, 1, 2, 19, 30, 400])
def test_values_that_do_not_gather_round_levels_stay_as_they_are(size: int) -> None:
    rng = np.random.default_rng(5115 + size)
    for y in (rng.normal(size=size), np.sin(np.arange(size) * 0.037), np.full(size, 0.37)):
        np.testing.assert_array_equal(without_blur(y), y)
    two = np.where(np.arange(size) % 2 == 0, -1.3, 0.7) + 1e-4 * rng.normal(size=size)  # a pair is no scale
    np.testing.assert_array_equal(without_blur(two), two)


def test_a_fit_with_levels_stands_on_them_and_changes_nothing_else(rig: Rig) -> None:
    runs = [converted(rig(seed, noise=0.0), truncated(0.0731)) for seed in (68, 69)]
    before = as_given(Task("LuGreFriction", runs, ("F",), MODEL), ())
    after = with_levels(before, coarse(runs, ["F"], before.spread))
    assert after.effects == ("quantisation@F",)
    assert {n: after.values[n] for n in before.values} == before.values
    for k, row in enumerate(after.table):
        steps = (after.problem.outputs(k, row)[:, 0] - after.values["F.quantisation.y_0"]) / after.values[
            "F.quantisation.q"
        ]
        assert np.abs(steps - np.round(steps)).max() < 1e-9
    assert after.rmse[0] < 0.75 * before.rmse[0]


def said(y: FloatArray, run: FitRun) -> tuple[str, ...]:
    record = Record("one", run.time, {"v": run.inputs[:, 0], "F": y}, {"v": "m/s", "F": "N"})
    return gate([record], kernel("LuGreFriction"), ["F"]).refused


def test_clipping_is_refused_and_a_coarse_converter_is_not(rig: Rig) -> None:
    run = rig(70)
    y = run.targets[:, 0]
    assert said(y, run) == ()
    assert said(rounded(0.37)(y), run) == ()
    limit = 0.6 * np.abs(y).max()
    why = said(np.clip(y, -limit, limit), run)
    assert why
    assert all(text.startswith("one: F") and "limit" in text for text in why)
    stuck = np.where(run.time > 0.05 * run.time[-1], y[10], y)
    assert said(stuck, run)


def test_a_run_of_a_few_samples_is_refused(rig: Rig) -> None:
    run = rig(71, rows=150)
    assert "one has 150 samples, 200 or more are needed" in said(run.targets[:, 0], run)


def test_what_one_run_does_not_cover_is_noted_where_it_is_the_only_one() -> None:
    """Several runs may show together, at two frequencies or loads, what none shows alone."""

    def notes(*frequencies: float) -> tuple[str, ...]:
        t = np.arange(2000) * DT
        records = []
        for f in frequencies:
            x = 0.83 * np.sin(2.0 * np.pi * f * t)
            columns = {"x_in": x, "x_out": 0.9 * x}
            records.append(Record(f"at {f}", t, columns, dict.fromkeys(columns, "rad")))
        return gate(records, kernel("PairedTsmBacklash"), ["x_out"]).notes

    assert any("one frequency only" in text for text in notes(0.31))
    assert not any("one frequency only" in text for text in notes(0.31, 0.93))
