"""Parts of the refits of a diagnosis at their limits: freedoms, pooling, the linear step, what counts, levels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice.refits import _log_mean_square
from tsm_fmu.diagnosis.fits.amounts import explained as amounts_of
from tsm_fmu.diagnosis.fits.amounts import products
from tsm_fmu.diagnosis.fits.nuisance import offsets, other_starts, shrunk_nuisances, with_pooled_offsets
from tsm_fmu.diagnosis.fits.quantised import Levels, coarse, step_noise
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, _forgotten, effective_samples, refit
from tsm_fmu.diagnosis.fits.response import Acting
from tsm_fmu.diagnosis.fits.screening import _Bench, screen
from tsm_fmu.diagnosis.fits.significance import corrects_model_form, nearly_removed, unlike_references
from tsm_fmu.effects import sizes_of
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import rms

Rig = Callable[..., FitRun]
MODEL = kernel("LuGreFriction")
FREE = ("presliding_shape", "sensor_lag@F", "offset_drift@F")


@pytest.fixture(scope="module")
def one(rig: Rig, known: dict[str, float]) -> Fitted:
    """Friction on two runs of unlike length, which lacks a mass."""
    return refit(Task("LuGreFriction", [rig(1, inertia=0.05), rig(2, rows=1200, inertia=0.05)], ("F",), known), (), {})


@pytest.fixture(scope="module")
def loose(one: Fitted) -> Fitted:
    """The same with nuisance effects, and zeros of its runs."""
    values = {**one.values, "F.sensor_lag.tau": 0.004, "presliding_shape.dF": 0.02}
    runs = [replace(r, targets=r.targets + by) for r, by in zip(one.problem.runs, (0.03, -0.02), strict=True)]
    task = replace(one.task, runs=runs)
    return refit(task, FREE, values, fixed=["F.offset_drift.c"], per_run=["F.offset_drift.b"], steps=3)


def test_errors_are_over_the_samples_of_all_runs(one: Fitted) -> None:
    residuals = [np.array([[3.0, 1.0], [1.0, 1.0], [1.0, 1.0]]), np.array([[5.0, 2.0]])]
    assert rms(residuals) == pytest.approx([3.0, np.sqrt(7.0 / 4.0)])
    spread = [float(run.targets.var()) for run in one.problem.runs]
    assert one.spread == pytest.approx([np.sqrt(np.mean(spread))])
    joined = np.concatenate(one.residuals)
    assert one.rmse == pytest.approx([np.sqrt(np.mean(joined**2))])
    left = [run.targets - one.problem.outputs(k, one.table[k]) for k, run in enumerate(one.problem.runs)]
    assert [np.abs(a - b).max() for a, b in zip(one.residuals, left, strict=True)] == [0.0, 0.0]


def test_a_fit_that_does_not_hold_on_all_samples_is_fitted_to_more_of_them(rig: Rig, known: dict[str, float]) -> None:
    """Few samples have none of what follows a reversal: the stiffness may be anywhere there, and is seen on all."""
    whole = [rig(3), rig(4, rows=1300)]
    few = [replace(run, doubt=np.where(_presliding(run), np.inf, 0.0)) for run in whole]
    task = Task("LuGreFriction", few, ("F",), known)
    found = refit(task, (), {})
    stiffness = found.problem.fields.index("sigma0")
    wandering = found.with_values({"sigma0": 2.3 * 0.73 / 0.0067, "sigma1": 0.0})
    assert wandering.rmse == pytest.approx(found.rmse, rel=0.05)
    assert (wandering.at(whole).rmse > 2.0 * wandering.rmse).all()
    held = wandering.holding(lambda: whole, whole)
    assert held.problem.runs == wandering.problem.runs
    best = refit(replace(task, runs=whole), (), {})
    assert held.table[0, stiffness] == pytest.approx(best.table[0, stiffness], rel=0.02)
    assert held.at(whole).rmse == pytest.approx(best.rmse, rel=1e-3)
    assert best.holding(lambda: whole, whole) is best
    other = [replace(run, targets=-run.targets) for run in whole]
    assert wandering.holding(lambda: other, whole) is wandering  # what leaves more on all samples is not taken


def _presliding(run: FitRun) -> np.ndarray:
    """Samples within a few presliding distances after a reversal."""
    way, since, near = run.inputs[:, 0] * np.gradient(run.time), 0.0, np.zeros(run.targets.shape, bool)
    for k, moved in enumerate(way):
        since = abs(moved) if k == 0 or moved * way[k - 1] <= 0.0 else since + abs(moved)
        near[k] = since < 12.0 * 0.0067
    return near


def test_noise_that_forgets_slowly_is_worth_fewer_samples() -> None:
    rng = np.random.default_rng(3)
    white = [rng.normal(size=(n, 1)) for n in (4000, 2000)]
    assert effective_samples(white) == pytest.approx([6000.0], rel=0.1)
    slow = [np.repeat(y, 50, axis=0) for y in white]  # fifty times the same
    assert effective_samples(slow) == pytest.approx([6000.0], rel=0.25)
    assert effective_samples([white[0][:3]]) == pytest.approx([4.0])  # never fewer than four
    assert effective_samples([white[0][:3]] * 2) == pytest.approx([6.0])


def test_values_lent_by_another_fit_leave_those_of_the_effects(one: Fitted, loose: Fitted) -> None:
    """And stay in later refits, which move the effects alone."""
    lent = loose.lent_by(one, ())
    assert lent.values == {**loose.values, **one.values} != loose.values
    moved = loose.with_values({"F__offset_drift__c": 0.7, "sigma2": 1.9, "F__sensor_lag__tau": 0.03})
    back = moved.lent_by(loose, ("offset_drift@F",))
    assert back.values == {**loose.values, "F.offset_drift.c": 0.7}
    again = moved.lent_by(loose, ("sensor_lag@F",))
    assert again.values == {**loose.values, "F.sensor_lag.tau": 0.03}
    assert again.per_run["F.offset_drift.b"].tolist() == loose.per_run["F.offset_drift.b"].tolist()
    refitted = refit(again.task, FREE, again.values, per_run_values=again.per_run, per_run=["F.offset_drift.b"])
    assert refitted.values["F.sensor_lag.tau"] != 0.03
    for name in one.values:
        assert refitted.values[name] == loose.values[name], name
    assert set(again.problem.shared) == {"F__sensor_lag__tau"}
    free = again.not_kept(moved.task.fixed)
    assert free.values == again.values
    assert set(free.problem.shared) == set(moved.problem.shared)
    assert free.task.fixed == moved.task.fixed


def test_what_an_effect_does_is_the_change_without_it_over_the_spread(loose: Fitted) -> None:
    """An offset is a constant: its RMS over the runs is that of its values, by their samples."""
    b = loose.per_run["F.offset_drift.b"]
    samples = [r.time.size for r in loose.problem.runs]
    expected = np.sqrt(np.average(b**2, weights=samples)) / loose.spread
    assert loose.share_of("offset_drift@F") == pytest.approx(expected, rel=1e-6)
    column = loose.problem.fields.index("F__offset_drift__b")
    moved = loose.change_with({"F__offset_drift__b": 0.4})
    assert moved == pytest.approx(
        np.sqrt(np.average((loose.table[:, column] - 0.4) ** 2, weights=samples)) / loose.spread, rel=1e-6
    )


@pytest.mark.parametrize(("travel", "forgotten"), [(2.9, False), (3.1, True)])
def test_a_start_is_forgotten_after_some_presliding_distances(travel: float, forgotten: bool) -> None:
    """Z after d is exp(-d/X) of it: a twentieth of what it does in the whole run from about three X on."""
    model = kernel("TendonDrive")
    t = 0.01 * np.arange(7000)
    x = 0.01 * t
    values = {"c": 1.0, "beta": -0.5, "alpha": 10.0}
    x_pre = 1.0 / values["alpha"]
    run = FitRun("r", t, np.column_stack([x, np.ones(t.size)]), np.column_stack([x]))
    task = Task("TendonDrive", [run.compared_from(int(travel * x_pre / 1e-4))], ("x_out",), values)
    found = refit(task, (), {}, steps=1)
    names = [v.name for v in model.parameters if v.field in _forgotten(found.problem, found.problem.start())]
    base = refit(replace(task, runs=[run]), (), {}, steps=1)
    assert _forgotten(base.problem, base.problem.start()) == []
    initial = set(model.roles.initial) & {found.problem.declared[f].name for f in base.problem.per_run}
    assert initial
    kept = {found.problem.declared[f].name for f in found.problem.per_run}
    assert (kept & initial == set()) is forgotten
    assert names == []  # what is fixed already is not told again
    two = replace(task, runs=[task.runs[0], task.runs[0]])
    starts = {name: np.array([0.017, 0.031]) for name in initial}
    apart = refit(two, (), {}, per_run_values=starts, steps=1)
    j = [v.name for v in model.parameters].index(next(iter(initial)))
    assert bool(apart.table[0, j] == apart.table[1, j]) is forgotten  # a card has one value


@pytest.mark.parametrize(
    ("spec", "share", "on_reference", "form"),
    [
        ("presliding_shape", 0.029, 0.0, True), ("presliding_shape", 0.031, 0.0, False),
        ("presliding_shape", 0.129, 0.1, True), ("presliding_shape", 0.131, 0.1, False),
        ("nonlocal_memory", 0.029, 0.0, True), ("nonlocal_memory", 0.031, 0.0, False),
        ("backlash@v", 0.029, 0.0, True), ("backlash@v", 0.031, 0.0, False), ("backlash@F", 0.02, 0.0, False),
        ("offset_drift@F", 0.129, 0.1, True), ("offset_drift@F", 0.131, 0.1, False),
        ("inertia", 0.02, 0.0, False),
    ],
)  # fmt: skip
def test_nuisance_effects_are_form_up_to_what_rigs_and_reference_runs_have(
    spec: str, share: float, on_reference: float, form: bool
) -> None:
    spread = np.array([3.7, 0.2])
    removed = {spec: np.array([0.01, on_reference]) * spread}
    task: Any = SimpleNamespace(model="LuGreFriction", reference_removal=removed)
    assert corrects_model_form(spec, share, task, spread) is form


@pytest.mark.parametrize("spec", ["presliding_shape", "nonlocal_memory", "smooth_backlash@v"])
def test_without_reference_runs_more_of_a_shape_after_a_reversal_is_form(spec: str) -> None:
    task: Any = SimpleNamespace(model="LuGreFriction", reference_removal={})
    assert corrects_model_form(spec, 0.044, task, np.array([3.7, 0.2]))
    assert not corrects_model_form(spec, 0.046, task, np.array([3.7, 0.2]))
    assert not corrects_model_form("inertia", 0.02, task, np.array([3.7, 0.2]))


@pytest.mark.parametrize(
    ("left", "without", "reference", "on_reference", "unlike"),
    [
        (0.09, 0.21, 0.1, 0.01, True),
        (0.12, 0.24, 0.1, 0.09, True),
        (0.14, 0.24, 0.1, 0.01, False),  # more is left than on reference runs
        (0.09, 0.19, 0.1, 0.01, False),  # without it hardly more
        (0.09, 0.21, 0.1, 0.11, False),  # on reference runs it does half of that
    ],
)
def test_a_form_that_reference_runs_do_not_have_is_none(
    left: float, without: float, reference: float, on_reference: float, unlike: bool
) -> None:
    task = SimpleNamespace(
        discrepancy=np.array([9.0, reference]), reference_removal={"presliding_shape": np.array([9.0, on_reference])}
    )
    fitted: Any = SimpleNamespace(task=task, rmse=np.array([0.5, left]))
    found = unlike_references("presliding_shape", np.array([0.6, without]), fitted)
    assert found.tolist() == [False, unlike]
    assert not unlike_references("nonlocal_memory", np.array([0.6, without]), fitted).any(), "nobody asked of it there"


def test_next_to_nothing_is_a_tenth_of_the_mean_square() -> None:
    before = np.array([2.0, 2.0])
    assert nearly_removed(before, np.array([0.199, 0.201])).tolist() == [True, False]


def test_offsets_have_a_value_a_run_and_drifts_stay_until_they_are_released() -> None:
    task: Any = SimpleNamespace(model="LuGreFriction")
    assert offsets(task, FREE, FREE, ()) == (["F.offset_drift.b"], ["F.offset_drift.c"])
    assert offsets(task, FREE, FREE, ("offset_drift@F",)) == (["F.offset_drift.b"], [])
    assert offsets(task, FREE, FREE[:2], ()) == ([], [])  # an effect like others
    assert offsets(task, FREE[:2], FREE, ()) == ([], [])


def test_zeros_are_pooled_by_independent_samples_and_what_good_rigs_differ_by(loose: Fitted) -> None:
    bound = with_pooled_offsets(loose, FREE)
    length = sum(r.time.size for r in loose.problem.runs) / loose.effective[0]
    zero = 0.015 * loose.spread[0]
    weight = loose.rmse[0] * loose.problem.weights[0] * np.sqrt(length) / zero
    assert bound.task.pooling == pytest.approx({"F.offset_drift.b": weight})
    assert bound.problem.pooling == pytest.approx({"F__offset_drift__b": weight})
    alone = replace(loose, problem=loose.problem.with_runs(loose.problem.runs[:1]), table=loose.table[:1])
    assert with_pooled_offsets(alone, FREE) is alone
    assert with_pooled_offsets(loose, FREE[:2]) is loose


def test_freedoms_shrink_to_a_tenth_and_refits_begin_again_at_what_was_given(loose: Fitted) -> None:
    back = shrunk_nuisances(loose, FREE)
    for name in ("F.sensor_lag.tau", "presliding_shape.dF", "F.offset_drift.b"):
        assert back[name] == pytest.approx(0.1 * loose.values[name])
    assert "presliding_shape.n" not in back
    replaced = ({"sigma2": 7.3}, {})
    (given, own), last = other_starts(loose, replaced)
    assert (own, last) == ({}, replaced)
    for name, value in given.items():
        assert value == loose.task.values.get(name, loose.values[name])


def test_the_gain_of_a_candidate_is_what_one_linear_step_leaves(one: Fitted) -> None:
    """Against scipy's least squares of the same step: residual and response without what the parameters can do."""
    told: list[str] = []
    asked = [attach(MODEL, spec) for spec in ("coulomb", "inertia", "creep")]
    found = screen(one, asked, told.append)
    assert sorted(told) == ["screen 1/3: coulomb", "screen 2/3: inertia", "screen 3/3: creep"]
    assert [s.gain for s in found] == sorted((s.gain for s in found), reverse=True)
    mass = next(s for s in found if s.attached.spec == "inertia")
    assert mass.gain > 0.5
    assert 0.02 < mass.starts[0][0]["inertia.m"] < 0.06  # of 0.05, of which the fit has taken a part
    assert found[-1].attached.spec == "coulomb"  # the model has it
    assert found[-1].gain < 0.1
    assert len(mass.starts) == 1


def test_amounts_are_those_of_least_squares_with_signs_as_declared(one: Fitted) -> None:
    bench = _Bench(one)
    assert bench.residual == pytest.approx(bench.responses.outside(bench.residual), abs=1e-9)
    size = np.linalg.norm(bench.residual)
    rng = np.random.default_rng(2)
    along = bench.residual / size
    other = bench.responses.outside(rng.normal(size=along.size))
    other -= along * (along @ other)
    other /= np.linalg.norm(other)
    acting = bench.responses.acting(attach(MODEL, "direction_asymmetry"))  # both signs
    heavy = bench.responses.acting(attach(MODEL, "inertia"))  # m is not negative

    def explained(of: Acting, rows: np.ndarray) -> tuple[float, np.ndarray]:
        sizes = list(sizes_of(of.attached.module))[: len(rows)]
        signed = np.array([v.quantity.lo < 0.0 for name in sizes for v in of.effect.parameters if v.name == name])
        outside = bench.responses.outside(rows)
        gains, amounts = amounts_of(products(rows[None], outside[None], bench.residual, 1), bench.before, signed)
        return gains[0], amounts[0]

    mixed = np.stack([0.6 * along + 0.8 * other, 3.0 * (0.8 * along - 0.6 * other)])
    gain, amounts = explained(acting, -mixed)
    assert amounts @ -mixed == pytest.approx(bench.residual, abs=2e-3 * size)
    assert amounts == pytest.approx([-0.6 * size, -0.8 / 3.0 * size], rel=2e-3)
    assert gain > 10.0
    half = np.stack([np.sqrt(0.75) * along + 0.5 * other])
    gain, _ = explained(acting, half)
    assert gain == pytest.approx(np.log(1.0 / 0.25), rel=1e-3)
    gain, amounts = explained(heavy, -half)
    assert (gain, amounts.tolist()) == (pytest.approx(0.0), [0.0])
    imitated = bench.responses.basis[:, :1].T
    gain, amounts = explained(acting, half + 2000.0 * imitated)  # nearly all of it
    assert (gain, amounts.tolist()) == (pytest.approx(0.0), [0.0])
    _, amounts = explained(acting, half + 300.0 * imitated)
    damped = np.sqrt(0.75) * size / (1.0 + 1e-4 * (300.0**2 + 1.0))
    assert amounts == pytest.approx([damped], rel=1e-3)


@pytest.mark.parametrize(("part", "found"), [(0.98, False), (1.02, True)])
def test_levels_count_where_their_steps_are_as_large_as_an_effect(part: float, found: bool) -> None:
    """A step of q is noise of q over the root of twelve."""
    rng = np.random.default_rng(4)
    y = 5.0 * rng.normal(size=4000)
    q = 0.37
    stepped = q * np.round((y - 0.11) / q) + 0.11
    runs: Any = [SimpleNamespace(targets=np.column_stack([y, part_of])) for y, part_of in ((y, stepped),)]
    spread = np.array([5.0, q / np.sqrt(12.0) / 0.012 / part])
    levels = coarse(runs, ("F", "x"), spread)
    assert [one.channel for one in levels] == (["x"] if found else [])
    for one in levels:
        assert one.q == pytest.approx(q)
        assert (one.y_0 - 0.11) / q == pytest.approx(round((one.y_0 - 0.11) / q), abs=1e-6)
        assert abs(one.y_0) <= 0.5 * q
        assert one.spec == "quantisation@x"


def test_steps_are_noise_of_their_channel_alone() -> None:
    noise = step_noise([Levels("x", 0.6, 0.1)], ("F", "x"))
    assert noise == pytest.approx([0.0, 0.6 / np.sqrt(12.0)])


def test_what_a_fit_leaves_as_one_number_is_a_log_with_a_floor() -> None:
    fitted: Any = SimpleNamespace(rmse=np.array([0.02, 0.0]), spread=np.array([0.5, 3.0]))
    assert _log_mean_square(fitted) == pytest.approx(np.log(0.04**2 + 9e-6) + np.log(9e-6))
