"""Parameters of an answer: values, what moved by how much and to what effect, what each run has, and the card."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.card import RecordUsed
from tsm_fmu.diagnosis.answer.parameters import bound_notes, card_of, changes_of, model_fit, per_run_values
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

MODEL = kernel("TendonDrive")
DRIVE = {
    "c": 0.97, "beta": -0.9, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.3, "sigma1": 0.0, "sigma2": 0.0031,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip
ZEROS = (0.31, -0.17, 0.05)


@pytest.fixture(scope="module")
def one() -> Fitted:
    """A drive on three runs, each with a zero of its own."""
    t, runs, rng = 0.01 * np.arange(400), [], np.random.default_rng(3)
    columns = [[v.name for v in MODEL.outputs].index(c) for c in ("x_out", "tau_in")]
    for k, zero in enumerate(ZEROS):
        inputs = np.column_stack([0.7 * np.sin(2.1 * t + k), 0.2 + 0.1 * np.cos(3.0 * t)])
        y = MODEL.simulate(MODEL.params(values={**DRIVE, "x_0": zero}), t, inputs)[:, columns]
        runs.append(FitRun(f"r{k}", t, inputs, y + [3e-4, 2e-4] * rng.normal(size=y.shape)))
    return refit(Task("TendonDrive", runs, ("x_out", "tau_in"), DRIVE, fixed=("v_s",)), (), {})


def with_values(one: Fitted, **values: float) -> Fitted:
    table = one.table.copy()
    for field, value in values.items():
        table[:, one.problem.fields.index(field)] = value
    return replace(one, table=table)


def undone(after: Fitted, name: str, value: float) -> float:
    """Largest change of a channel over its spread within runs, from the model itself."""
    changes, spread = [], []
    columns = [[v.name for v in MODEL.outputs].index(c) for c in ("x_out", "tau_in")]
    for row, run in zip(after.table, after.problem.runs, strict=True):
        values = dict(zip(after.problem.fields, row.tolist(), strict=True))
        now, old = (
            MODEL.simulate(MODEL.params(values=v), run.time, run.inputs)[:, columns]
            for v in (values, {**values, name: value})
        )
        changes.append(now - old)
        spread.append(run.targets.var(axis=0))
    rms = np.sqrt(np.mean(np.concatenate(changes) ** 2, axis=0))
    return float(np.max(rms / np.sqrt(np.mean(spread, axis=0))))


def test_a_fit_as_data_has_every_parameter_with_its_unit_and_the_mean_over_runs(one: Fitted) -> None:
    found = model_fit(one)
    assert (found.model, found.effects) == ("TendonDrive", ())
    assert [p.name for p in found.parameters] == [v.name for v in MODEL.parameters]
    assert [(p.unit, p.meaning) for p in found.parameters] == [
        (v.quantity.unit, v.quantity.meaning) for v in MODEL.parameters
    ]
    column = one.problem.fields.index("x_0")
    assert found.values["x_0"] == pytest.approx(one.table[:, column].mean(), rel=1e-12)
    assert found.values["tau_c"] == one.table[0, one.problem.fields.index("tau_c")]
    assert found.values["x_0"] == pytest.approx(np.mean(ZEROS), abs=0.01)


@pytest.mark.parametrize(("factor", "moved"), [(1.0199, False), (1.0206, True), (0.9801, False), (0.9799, True)])
def test_a_parameter_has_moved_from_two_per_cent_of_the_larger_value_on(one: Fitted, factor, moved) -> None:
    """Nor has any but it."""
    before = with_values(one, ratio=1.1)
    found = changes_of(before, with_values(one, ratio=1.1 * factor))
    assert [c.name for c in found] == (["ratio"] if moved else [])
    for c in found:
        assert (c.unit, c.before, c.after) == ("1", pytest.approx(1.1), pytest.approx(1.1 * factor))
        assert c.effect == pytest.approx(undone(with_values(one, ratio=1.1 * factor), "ratio", 1.1), rel=1e-9)


def test_changes_are_told_by_what_they_do_and_small_ones_not(one: Fitted) -> None:
    before = with_values(one, tau_c=0.08, ratio=1.0, sigma2=0.05, c=0.97, v_s=0.9)
    after = with_values(before, tau_c=0.13, ratio=1.09, sigma2=0.07, v_s=0.3, x_0=5.0)
    effects = {n: undone(after, n, old) for n, old in (("tau_c", 0.08), ("ratio", 1.0), ("sigma2", 0.05))}
    names = sorted(effects, key=lambda n: -effects[n])
    found = changes_of(before, after)  # v_s is fixed, and x_0 each run's own
    assert [c.name for c in found] == names
    assert [c.effect for c in found] == pytest.approx([effects[n] for n in names], rel=1e-9)
    assert found[0].unit == dict((v.name, v.quantity.unit) for v in MODEL.parameters)[names[0]]
    least = 0.1 * effects[names[0]]
    slope = effects["sigma2"] / 0.02  # linear in it
    for share, told in ((0.98, False), (1.02, True)):
        sigma2 = 0.05 - share * least / slope
        seen = changes_of(before, with_values(after, sigma2=sigma2))
        assert ("sigma2" in [c.name for c in seen]) is told


def test_a_move_that_the_others_forbid_to_undo_comes_first_and_sets_no_scale(one: Fitted) -> None:
    """With such a rate of the hysteresis the model overflows."""
    before = with_values(one, alpha=-1e6, ratio=1.0)
    found = changes_of(before, with_values(one, alpha=9.3, ratio=1.09))
    assert [c.name for c in found] == ["alpha", "ratio"]
    assert found[0].effect == np.inf


def test_values_of_runs_are_told_by_name(one: Fitted) -> None:
    found = per_run_values(one)
    assert [set(values) for values in found] == [set(one.per_run)] * 3
    for k, values in enumerate(found):
        assert values["x_0"] == one.table[k, one.problem.fields.index("x_0")]
        assert values["x_0"] == pytest.approx(ZEROS[k], abs=0.02)


def test_the_card_has_what_was_fitted_from_what_and_how_sure_it_is(one: Fitted) -> None:
    used = (RecordUsed("r0", "aa"), RecordUsed("h", "bb", "holdout"))
    card = card_of(one, used, "mssp_2015", 11)
    assert (card.model, card.preset, card.effects) == ("TendonDrive", "mssp_2015", ())
    assert card.provenance.records == used
    assert (card.provenance.seed, card.provenance.method) == (11, "diagnose")
    assert list(card.per_run) == ["r0", "r1", "r2"]
    assert card.per_run["r1"] == per_run_values(one)[1]
    for v in MODEL.parameters:
        p, space = card.parameters[v.name], one.problem.space[v.field]
        assert (p.value, p.unit, p.fixed) == (one.values[v.name], v.quantity.unit, not space.free)
        assert (p.lo, p.hi) == (space.lo, space.hi)
        assert p.stderr is None or (p.stderr > 0.0 and not p.fixed)
    assert card.parameters["v_s"].fixed
    ratio = card.parameters["ratio"]
    load = np.concatenate([run.inputs[:, 1] for run in one.problem.runs])
    least = 2e-4 / np.linalg.norm(load)  # if all else were known
    assert ratio.stderr is not None
    assert 0.7 * least < ratio.stderr < 20.0 * least  # it may have taken a part of the noise
    assert card.correlation is not None
    assert "ratio" in card.correlation.names
    plain = card_of(one, used, "", 11, errors=False)
    assert plain.correlation is None
    assert {p.stderr for p in plain.parameters.values()} == {None}


def test_a_value_a_hair_beyond_its_bound_is_the_bound_in_the_card(one: Fitted) -> None:
    alone = replace(one, problem=one.problem.with_runs(one.problem.runs[:1]), table=one.table[:1].copy())
    column, space = one.problem.fields.index("sigma2"), one.problem.space["sigma2"]
    alone.table[0, column] = space.lo - 1e-12
    assert card_of(alone, (), "", 0, errors=False).parameters["sigma2"].value == space.lo


@pytest.mark.parametrize(("part", "told"), [(0.9e-4, True), (1.1e-4, False)])
@pytest.mark.parametrize("end", ["lo", "hi"])
def test_a_fit_stands_at_a_bound_within_a_ten_thousandth_of_its_range(one: Fitted, end, part, told) -> None:
    space = one.problem.space.with_bounds("ratio", lo=0.4, hi=1.9)
    near = 0.4 + 1.5 * part if end == "lo" else 1.9 - 1.5 * part
    bounded = replace(one, problem=one.problem.over(space))
    at, off = with_values(bounded, ratio=near), with_values(bounded, ratio=1.1)
    others = {note for note in bound_notes(off, off)}
    said = set(bound_notes(at, off)) - others
    assert said == ({f"the refit stopped at a bound of ratio ({near:g})"} if told else set())
    said = set(bound_notes(off, at)) - others
    assert said == ({f"the answer's fit stopped at a bound of ratio ({near:g})"} if told else set())
    assert set(bound_notes(at, at)) - others == set(bound_notes(at, off)) - others  # once


@pytest.mark.parametrize(("off", "told"), [(0.9e-6, True), (1.1e-6, False)])
@pytest.mark.parametrize("size", [0.3, 7.0])
def test_where_the_range_has_no_end_a_millionth_of_the_value_is_near(one: Fitted, size, off, told) -> None:
    space = one.problem.space.with_bounds("ratio", lo=size, hi=np.inf)
    at = with_values(replace(one, problem=one.problem.over(space)), ratio=size + off * max(1.0, size))
    assert any("of ratio (" in note for note in bound_notes(at, at)) is told
