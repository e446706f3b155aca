"""What an effect would change: against the chain that holds it, and the sizes and shapes that are tried of it."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.extent import Extent
from tsm_fmu.diagnosis.fits.placing import possible
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.response import Responses, _largest, normalised, places_of, public
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates
from tsm_fmu.effects import shapes_of, sizes_of
from tsm_fmu.effects.about import Scale, Shape
from tsm_fmu.kernels.attached import Attached
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.drives import ANGLE
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.regression.problem import FitRun

DT, ROWS, CHANNELS = 0.01, 700, ("x_out", "tau_in")
WEIGHTS = np.array([3.1, 0.7])
DRIVE = {
    "c": 0.97, "beta": -0.4, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.3, "sigma1": 0.0, "sigma2": 0.0031,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip
ROUGH = {"inertia": 0.15, "stribeck": 0.15, "acceleration_branches": 0.15}
"""Laws of the speed where it changes fast, and of the acceleration: that is smoothed over a few samples."""
TRIED = possible("TendonDrive", CHANNELS, (), (ANGLE,))


@pytest.fixture(scope="module")
def one() -> Fitted:
    """A drive on two runs, with a bent sheath; what is measured has noise and a law of the speed besides."""
    t, runs, rng = DT * np.arange(ROWS), [], np.random.default_rng(3)
    model = kernel("TendonDrive")
    columns = [[v.name for v in model.outputs].index(c) for c in CHANNELS]
    for k in range(2):
        x = 4.7 * np.sin(1.9 * t + k) + 0.3 * np.sin(5.3 * t)
        x -= x[0]
        inputs = np.column_stack([x, 0.2 + 0.1 * np.cos(3.0 * t + k)])
        y = model.simulate(model.params(values=DRIVE), t, inputs)[:, columns]
        y = y + [0.002, 0.001] * rng.normal(size=y.shape) + 0.003 * np.tanh(np.gradient(x, t))[:, None]
        runs.append(FitRun(f"r{k}", t, np.column_stack([inputs, 1.5 + 0.5 * np.sin(0.7 * t)]), y))
    return refit(Task("TendonDrive", runs, CHANNELS, DRIVE, drives=(ANGLE,)), (), {}, steps=1)


@pytest.fixture(scope="module")
def responses(one: Fitted) -> Responses:
    return Responses(one, WEIGHTS)


def middle_of(responses: Responses, attached: Attached) -> dict[str, float]:
    """Shapes in the middle of their range, sizes that are small: a change that is plain."""
    shapes = {n: responses.extent.at_quantile(s, 0.5) for n, s in shapes_of(attached.module).items()}
    sizes = {n: 0.3 * size.first for n, size in sizes_of(attached.module).items()}
    return {**shapes, **sizes}


def by_chain(one: Fitted, attached: Attached, values: dict[str, float], x_pre: float) -> np.ndarray:
    """Change of the channels, weighted, by the model that holds the effect, run by run."""
    model = chain("TendonDrive", (attached.spec,), (ANGLE,))
    named, found = {v.field: v.name for v in one.problem.kernel.parameters}, []
    for k, run in enumerate(one.problem.runs):
        base = dict(zip([named[f] for f in one.problem.fields], one.table[k].tolist(), strict=True))
        given = base | {public(attached, n): x for n, x in values.items()}
        if "motion.x_pre" in {v.name for v in model.parameters}:
            given["motion.x_pre"] = x_pre
        outputs = [v.name for v in model.outputs]
        y = model.simulate(model.params(values=given), run.time, run.inputs)
        before = one.problem.outputs(k, one.table[k])
        found.append((y[:, [outputs.index(c) for c in CHANNELS]] - before) * WEIGHTS)
    return np.concatenate(found).ravel()


@pytest.mark.parametrize("attached", [a for a in TRIED if a.spec != "friction_lag"], ids=lambda a: a.spec)
def test_a_response_is_the_change_of_the_model_that_holds_the_effect(
    one: Fitted, responses: Responses, attached: Attached
) -> None:
    """The presliding distance is that of each run, 2 % of its stroke; the chain takes a speed that is not smoothed, and
    a start at full speed as a jump: both count once that is forgotten.
    """
    span = [float(np.ptp(run.inputs[:, 0])) for run in one.problem.runs]
    values = middle_of(responses, attached)
    found = responses.acting(attached).responses_to([values])[0].reshape(2, ROWS, 2)
    for k in range(2):
        expected = by_chain(one, attached, values, 0.02 * span[k]).reshape(2, ROWS, 2)[k, 60:]
        size = np.linalg.norm(expected)
        assert size > 0.0
        assert np.linalg.norm(found[k, 60:] - expected) < ROUGH.get(attached.spec, 0.05) * size, k


def test_the_response_of_a_model_that_holds_its_load_is_that_of_the_whole_chain() -> None:
    """What is held comes back to the next sample: the friction alone does not say what the load becomes."""
    time, runs = DT * np.arange(ROWS), []
    values = {"tau_c": 0.044, "tau_s": 0.044, "sigma2": 0.0, "sigma0": 60.0, "ratio": 0.92, "hold": 1.0}
    for k in range(2):
        x, load = 0.5 * np.sin(np.pi * time + k), -0.08 + 0.03 * np.sin(0.9 * time + k)
        tau_in = 0.92 * load + np.sign(np.cos(np.pi * time + k)) * (0.044 + 0.2 * np.abs(load))
        runs.append(FitRun(f"r{k}", time, np.column_stack([x, tau_in]), load[:, None]))
    task = Task("DistalEstimator", runs, ("tau_out",), {**values, "motion.x_pre": 0.01})
    attached = attach(kernel("DistalEstimator"), "load_dependence")
    model, expected = chain("DistalEstimator", (attached.spec,)), {}
    for hold in (0.0, 1.0):
        fitted = refit(replace(task, values={**task.values, "hold": hold}), (), {}, steps=0)
        found = Responses(fitted, np.ones(1)).acting(attached).responses_to([{"k": 0.05}])[0].reshape(2, ROWS)
        for k, run in enumerate(runs):
            own = fitted.values
            with_effect = model.simulate(model.params(None, own | {"load_dependence.k": 0.05}), time, run.inputs)[:, 1]
            expected[hold] = with_effect - fitted.problem.outputs(k, fitted.table[k])[:, 0]
            error = np.linalg.norm(found[k] - expected[hold]) / np.linalg.norm(expected[hold])
            assert error < (1e-9 if hold else 0.2), (hold, k)


def test_there_are_effects_at_the_friction_at_outputs_and_at_lost_motion() -> None:
    kinds = {(one.channel, one.on_lost_motion) for one in TRIED}
    assert {(None, False), ("x_out", False), ("x_out", True)} <= {(c or None, bool(lost)) for c, lost in kinds}


def test_a_step_makes_a_response_of_the_size_of_the_residual(one: Fitted, responses: Responses) -> None:
    residual = np.linalg.norm(np.concatenate([(r * WEIGHTS).ravel() for r in one.residuals]))
    acting = responses.acting(attach(kernel("TendonDrive"), "inertia"))
    ((column,),), ((step,),) = acting.columns([{}])
    assert np.linalg.norm(column) == pytest.approx(residual, rel=1e-6)
    assert column == pytest.approx(acting.responses_to([{"m": step}])[0])
    ((column,),), ((same,),) = acting.columns([{}], np.array([[0.037]]))
    assert same == 0.037
    assert column == pytest.approx(acting.responses_to([{"m": 0.037}])[0])
    expected = 0.037 * np.concatenate([p.a for p in responses.signals]) * WEIGHTS[1]
    assert column.reshape(-1, 2)[:, 1] == pytest.approx(expected)
    assert not column.reshape(-1, 2)[:, 0].any()


def test_a_step_has_the_sense_of_its_first_and_stays_within_its_bounds(one: Fitted) -> None:
    far = [replace(run, targets=run.targets + 50.0) for run in one.problem.runs]
    responses = Responses(one.at(far), WEIGHTS)
    attached = attach(kernel("TendonDrive"), "smooth_backlash@x_out")
    shape = {n: responses.extent.at_quantile(s, 0.5) for n, s in shapes_of(attached.module).items()}
    _, steps = responses.acting(attached).columns([shape])
    assert steps.tolist() == [[-0.5]]  # half of the way to -1
    _, steps = responses.acting(attach(kernel("TendonDrive"), "gain_error@x_out")).columns([{}])
    assert steps == pytest.approx(np.array([[4.5]]))  # half of the way to 9
    still = Responses(replace(one, table=one.table.copy()), np.array([0.0, 1e-30]))
    _, steps = still.acting(attach(kernel("TendonDrive"), "inertia")).columns([{}])
    assert 0.0 < steps[0, 0] < 1.0


def test_what_the_parameters_can_do_is_not_outside(one: Fitted, responses: Responses) -> None:
    """Viscous friction is sigma2, but for its speed, which is smoothed here; of an inertia most is left."""
    viscous = responses.acting(attach(kernel("TendonDrive"), "viscous")).columns([{}])[0][0, 0]
    assert np.linalg.norm(responses.outside(viscous)) < 0.06 * np.linalg.norm(viscous)
    mass = responses.acting(attach(kernel("TendonDrive"), "inertia")).columns([{}])[0][0, 0]
    left = responses.outside(mass)
    assert np.linalg.norm(left) > 0.3 * np.linalg.norm(mass)
    assert responses.outside(left) == pytest.approx(left, abs=1e-9 * np.linalg.norm(mass))
    assert np.abs(responses.basis.T @ left).max() < 1e-9 * np.linalg.norm(mass)
    assert responses.outside(np.stack([mass, viscous]))[0] == pytest.approx(left)


def coordinates(x: np.ndarray, load: np.ndarray | None = None, dt: float = 0.01) -> Coordinates:
    t, zero = 3.0 + dt * np.arange(x.size), np.zeros(x.size)
    v = np.gradient(x, t)
    return Coordinates(x, v, np.gradient(v, t), np.sign(v), zero, zero, zero, zero, load, t)


def extent() -> tuple[Extent, dict[Scale, float]]:
    """Two runs: sizes that belong to one, to the longest, or to both."""
    t = 0.01 * np.arange(600)
    runs = [
        coordinates(0.2 + 0.5 * np.sin(3.0 * t), 1.0 + t),
        coordinates(-0.4 * np.cos(5.0 * t[:300]), -9.0 + t[:300]),
    ]
    v, a = (np.concatenate([getattr(c, n) for c in runs]) for n in ("v", "a"))
    sizes: dict[Scale, float] = {
        "stroke": 1.0, "per stroke": 1.0, "travel": 0.5 * (12.0 + math.sin(3.0 * 5.99)),
        "speed": float(np.sqrt(np.mean(v**2))), "acceleration": float(np.sqrt(np.mean(a**2))),
        "time": 5.99, "load": 9.0, "number": 1.0,
    }  # fmt: skip
    return Extent(runs), sizes


@pytest.mark.parametrize("scale", ["stroke", "per stroke", "travel", "speed", "acceleration", "time", "load", "number"])
def test_shapes_are_spread_over_the_logarithm_of_what_the_runs_show(scale: Scale) -> None:
    one, sizes = extent()
    shape = Shape(scale, 0.02, 8.0)
    for q in (0.0, 0.25, 1.0):
        size = 0.02 ** (1.0 - q) * 8.0**q * sizes[scale]
        assert one.at_quantile(shape, q) == pytest.approx(size, rel=1e-3), q
    low, high = 0.02 * sizes[scale], 8.0 * sizes[scale]
    expected = None if scale == "number" else pytest.approx((0.5 * low, 2.0 * high), rel=1e-3)
    assert one.limits(shape) == expected


def test_positions_angles_and_turns_are_spread_evenly() -> None:
    one, _ = extent()
    assert (one.lowest, one.highest) == (pytest.approx(-0.4, abs=1e-3), pytest.approx(0.7, abs=1e-3))
    place, angle, turns = Shape("position", 0.1, 0.7), Shape("angle", -1.0, 2.0), Shape("turns", 1.5, 12.0)
    assert one.at_quantile(place, 0.5) == pytest.approx(-0.4 + 1.1 * 0.4, abs=2e-3)
    assert one.limits(place) == pytest.approx((-0.4 + 1.1 * (0.4 - 0.6), -0.4 + 1.1 * (0.4 + 0.6)), abs=3e-3)
    assert one.at_quantile(angle, 0.25) == pytest.approx(-0.25)
    assert one.limits(angle) is None
    width = Shape("width", 0.2, 0.6)
    assert one.at_quantile(width, 0.25) == pytest.approx(0.3)
    assert one.limits(width) == pytest.approx((0.2 / 1.3, 0.6 * 1.3))
    per_radian = 1.1 / (2.0 * math.pi)
    assert one.at_quantile(turns, 0.5) == pytest.approx(per_radian / 6.75, rel=2e-3)
    assert one.limits(turns) == pytest.approx((per_radian / 12.0, per_radian / 1.5), rel=2e-3)


def test_sizes_of_a_drive_that_stands_still_are_one() -> None:
    one = Extent([coordinates(np.full(50, 0.3))])
    for scale in ("stroke", "per stroke", "travel", "speed", "acceleration", "load"):
        assert one.scales[scale] == 1.0, scale
    assert one.at_quantile(Shape("turns", 2.0, 2.0), 0.3) == pytest.approx(1.0 / (4.0 * math.pi))


@pytest.mark.parametrize(
    ("effect", "count"), [("inertia", 1), ("stribeck", 14), ("drum_periodic@x_out", 192), ("nonlocal_memory", 21)]
)
def test_so_many_shapes_are_tried_all_within_their_ranges(responses: Responses, effect: str, count: int) -> None:
    attached = attach(kernel("TendonDrive"), effect)
    found, shapes = responses.extent.shapes(attached.module), shapes_of(attached.module)
    assert len(found) == count
    assert all(set(one) == set(shapes) for one in found)
    for name, shape in shapes.items():
        low, high = sorted(responses.extent.at_quantile(shape, q) for q in (0.0, 1.0))
        values = np.array([one[name] for one in found])
        assert ((values >= low) & (values <= high)).all()
        below = np.mean(values < responses.extent.at_quantile(shape, 0.5))
        assert below == pytest.approx(0.5, abs=0.11)  # spread, as a low-discrepancy sequence does
        assert len(set(values)) == count
    limits = responses.limits(responses.acting(attached))
    bounded = {n for n, s in shapes.items() if s.scale not in ("number", "angle", "share")}
    assert limits == {public(attached, n): responses.extent.limits(shapes[n]) for n in bounded}


def test_a_size_may_be_bounded_by_what_the_effect_changes(one: Fitted, responses: Responses) -> None:
    """Break-away that would grow by more than the friction itself in each e-fold is another law in disguise."""
    acting = responses.acting(attach(kernel("TendonDrive"), "breakaway_ageing"))
    friction = np.sqrt(np.mean(np.concatenate(acting.before) ** 2))
    assert responses.limits(acting)["breakaway_ageing.B"] == pytest.approx((-friction, friction))
    assert "inertia.m" not in responses.limits(responses.acting(attach(kernel("TendonDrive"), "inertia")))


def test_other_runs_may_say_how_far_shapes_go(one: Fitted, responses: Responses) -> None:
    wide = [replace(c, x=3.0 * c.x) for c in places_of(one)]
    shape = Shape("stroke", 0.1, 0.1)
    by_these = Responses(one, WEIGHTS, wide).extent.at_quantile(shape, 0.5)
    assert by_these == pytest.approx(3.0 * responses.extent.at_quantile(shape, 0.5))


def test_columns_of_length_one_and_none_of_zero() -> None:
    found = normalised(np.array([[3.0, 0.0, 1.0], [4.0, 0.0, 0.0]]))
    assert found == pytest.approx(np.array([[0.6, 1.0], [0.8, 0.0]]))


@pytest.mark.parametrize(
    ("effect", "name", "most"),
    [("smooth_backlash", "beta", 0.5), ("gain_error", "g", 4.5), ("friction_lag", "chi", 0.5), ("inertia", "m", 1e9)],
)
def test_a_size_goes_half_of_the_way_to_its_bound(effect: str, name: str, most: float) -> None:
    module = attach(kernel("TendonDrive"), f"{effect}@x_out" if effect in ("smooth_backlash", "gain_error") else effect)
    sizes = sizes_of(module.module)
    assert _largest(Kernel(module.module), name if name in sizes else next(iter(sizes))) == most


@pytest.mark.parametrize("attached", TRIED, ids=lambda a: a.spec)
def test_what_grows_with_its_size_at_one_shape_does_at_all(responses: Responses, attached: Attached) -> None:
    acting = responses.acting(attached)
    for shape in responses.extent.shapes(attached.module)[:21]:
        found, steps = acting.columns([shape])
        alone, of_its_own = responses.acting(attached).columns([shape])  # which has seen no shape before
        assert (steps == of_its_own).all()
        for one, other in zip(found[0], alone[0], strict=True):
            assert one == pytest.approx(other, abs=1e-8 * max(float(np.abs(other).max()), 1e-300))


@pytest.mark.parametrize("attached", TRIED, ids=lambda a: a.spec)
def test_shapes_looked_at_together_are_those_looked_at_one_by_one(responses: Responses, attached: Attached) -> None:
    acting, shapes = responses.acting(attached), responses.extent.shapes(attached.module)[:7]
    together, steps = acting.columns(shapes)
    assert together.shape[:2] == steps.shape == (len(shapes), len(sizes_of(attached.module)))
    for shape, found, step in zip(shapes, together, steps, strict=True):
        (alone,), (own,) = acting.columns([shape])
        assert step == pytest.approx(own, rel=1e-12)
        assert found == pytest.approx(alone, abs=1e-12 * max(float(np.abs(alone).max()), 1e-300))


def test_of_long_runs_the_samples_drawn_are_compared_and_all_are_simulated(one: Fitted, monkeypatch) -> None:
    """An effect with memory gives there what it gives when all samples are compared; one without is run there alone."""
    whole = Responses(one, WEIGHTS)
    monkeypatch.setattr("tsm_fmu.diagnosis.fits.response.COMPARED_ROWS", ROWS // 3)
    few = Responses(one, WEIGHTS)
    rows = np.concatenate([k * ROWS + rows for k, rows in enumerate(few.rows)])
    assert ROWS // 3 <= rows.size <= ROWS // 3 + 2
    assert few.flat(one.residuals) == pytest.approx(whole.flat(one.residuals).reshape(-1, 2)[rows].ravel())
    for spec in ("creep", "inertia", "drum_periodic", "sensor_lag@x_out", "thermal@x_out"):
        attached = attach(kernel("TendonDrive"), spec)
        values = middle_of(whole, attached)
        every, drawn = (r.acting(attached).responses_to([values])[0].reshape(-1, 2) for r in (whole, few))
        assert np.abs(every).max() > 0.0
        assert drawn == pytest.approx(every[rows], rel=1e-9, abs=1e-12 * float(np.abs(every).max()))
    memory, none = (few.acting(attach(kernel("TendonDrive"), spec)) for spec in ("creep", "inertia"))
    assert memory.time.size == 2 * ROWS
    assert none.time.size == rows.size


def test_at_fewer_samples_the_same_is_compared_and_imitated(one: Fitted, responses: Responses) -> None:
    few = responses.at_fewer(331)
    assert [set(a) <= set(b) for a, b in zip(few.rows, responses.rows, strict=True)] == [True, True]
    assert 331 <= few.edges[-1] / 2 <= 333
    assert few.basis.T @ few.basis == pytest.approx(np.eye(few.basis.shape[1]), abs=1e-12)
    assert few.basis.shape[1] == responses.basis.shape[1]
    kept = np.concatenate([
        first / 2 + np.flatnonzero(np.isin(rows, own))
        for first, rows, own in zip(responses.edges, responses.rows, few.rows, strict=False)
    ]).astype(int)  # fmt: skip
    imitated = responses.basis @ np.random.default_rng(5).normal(size=responses.basis.shape[1])
    assert few.outside(imitated.reshape(-1, 2)[kept].ravel()) == pytest.approx(0.0, abs=1e-12)
    attached = attach(kernel("TendonDrive"), "sensor_lag@x_out")
    values = [middle_of(responses, attached)]
    every, drawn = (r.acting(attached).responses_to(values)[0].reshape(-1, 2) for r in (responses, few))
    assert drawn == pytest.approx(every[kept], rel=1e-12)
    assert responses.at_fewer(10**6).flat(one.residuals) == pytest.approx(responses.flat(one.residuals))


def test_at_fewer_samples_nothing_is_imitated_where_nothing_is_free(responses: Responses) -> None:
    fixed = copy(responses)
    fixed.basis = responses.basis[:, :0]
    few = fixed.at_fewer(97)
    column = np.linspace(-1.0, 2.0, int(few.edges[-1]))
    assert few.outside(column.copy()).tolist() == column.tolist()
