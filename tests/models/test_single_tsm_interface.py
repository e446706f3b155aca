"""Single-tendon models: branch rules, tensions, published numbers, and what is refused with which words."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.units import unit_to_si

MODELS = ["SingleTsmDahl", "SingleTsmBoucWen", "SingleTsmLuGre"]
LEVEL = {"SingleTsmDahl": "sliding_force", "SingleTsmBoucWen": "sliding_force", "SingleTsmLuGre": "sliding_level"}
each_model = pytest.mark.parametrize("model", MODELS)


def level(model: str, v: float, a: float, sgn_a: float, preset: str | None = None) -> float:
    k = kernel(model)
    return getattr(k.module, LEVEL[model])(k.params(preset), v, a, sgn_a)


def unit(model: str) -> float:
    """Rough size of a speed in the model's unit."""
    return 1.3 if model == "SingleTsmLuGre" else 7e-3


@each_model
@pytest.mark.parametrize("direction", [1, -1])
def test_a_sample_of_zero_acceleration_keeps_the_branch(model, direction):
    k = kernel(model)
    p = k.params()
    v = direction * unit(model)
    signs = []
    s, _ = k.module.start(p, k.module.Inputs(v, 0.0, 0.0, 0.0))
    for a in (0.0, 2.3, 0.0, -1.7, 0.0, 0.0, 0.4):
        s, _ = k.module.step(p, s, k.module.Inputs(v, a * unit(model), 0.0, 0.0), 1e-3)
        signs.append(s.sgn_a)
    assert signs == [0.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0]
    tiny = 1e-13 * unit(model)
    for sign in (1.0, -1.0):
        assert level(model, v, 0.0, sign) == pytest.approx(level(model, v, sign * tiny, sign), rel=1e-6)


@each_model
def test_pull_branches_meet_at_zero_acceleration_and_release_branches_do_not(model):
    v = unit(model) * 1e-4
    assert level(model, v, 0.0, 1.0) == level(model, v, 0.0, -1.0)
    up, down, mean = (level(model, -v, 0.0, s) for s in (1.0, -1.0, 0.0))
    p = kernel(model).params()
    if model == "SingleTsmDahl":
        jump = 2 * abs(p.mu3) * math.exp(-p.kappa4 * v / p.kappa5)
    elif model == "SingleTsmBoucWen":
        jump = 2 * abs(p.mu4) * math.exp(-p.kappa5 * v / p.kappa6)
    else:
        jump = 2 * p.rho2  # of |S| in the reading |S|; S itself jumps by 2 mu3
    assert abs(up - down) == pytest.approx(jump, rel=1e-9)
    assert mean == pytest.approx(p.rho2 if model != "SingleTsmBoucWen" else (up + down) / 2)


@each_model
def test_standstill_keeps_the_friction(model):
    k = kernel(model)
    v, a = np.zeros((2, 60))
    v[:20], a[:20] = unit(model), -0.9 * unit(model)
    rows = np.column_stack([v, a, 0 * v, 0 * v])
    force = k.simulate(k.params(), np.arange(60) * 0.1, rows)[:, 0]
    assert force[19] > 0.5
    assert (force[20:] == force[19]).all()


@each_model
def test_tensions_follow_the_friction_without_a_clip(model):
    k = kernel(model)
    p = k.params()
    radius = p.R if model == "SingleTsmLuGre" else 1.0
    rng = np.random.default_rng(9)
    v, a = unit(model) * rng.normal(size=(2, 400))
    T_in, T_load = rng.uniform(0, 3, (2, 400))
    y = k.simulate(p, np.cumsum(rng.uniform(1e-3, 0.05, 400)), np.column_stack([v, a, T_in, T_load]))
    force, T_out, T_drive, loss = y.T
    np.testing.assert_array_equal(T_out, T_in - force)
    np.testing.assert_array_equal(T_drive, T_load + force)
    np.testing.assert_allclose(loss, radius * force * v, rtol=1e-15)
    assert T_out.min() < -0.3
    assert [o.name for o in k.outputs] == ["F", "T_out", "T_drive", "P_loss"]


@each_model
def test_compiled_and_plain_forms_give_the_same_bits(model):
    k = kernel(model)
    rng = np.random.default_rng(4)
    rows = np.column_stack([unit(model) * rng.normal(size=(500, 2)), rng.uniform(0, 9, (500, 2))])
    time = np.cumsum(10 ** rng.uniform(-5, 0, 500))
    for preset in k.presets:
        p = k.params(preset)
        np.testing.assert_array_equal(k.simulate(p, time, rows), k.simulate(p, time, rows, compiled=False))


@each_model
def test_start_value_of_the_state_is_a_parameter(model):
    k = kernel(model)
    p = k.params(None, {"zeta_0": -0.000_031})
    stiffness = {"SingleTsmDahl": 17570.0, "SingleTsmBoucWen": 1.0, "SingleTsmLuGre": 5.038}[model]
    state, out = k.module.start(p, k.module.Inputs(0.0, -1.0, 2.0, 1.0))
    assert (state.zeta, state.sgn_a) == (-0.000_031, -1.0)
    assert out.F == pytest.approx(-0.000_031 * stiffness)
    assert out.T_out == 2.0 - out.F


@each_model
def test_presets_are_the_printed_numbers_in_si(model):
    k = kernel(model)
    unit_of = {v.name: v.quantity.unit for v in k.parameters}
    for name, preset in k.presets.items():
        p = k.params(name)
        for symbol, (value, printed_unit) in preset.printed.items():
            si = unit_to_si(printed_unit)
            field = "lambda_" if symbol == "lambda" else symbol
            assert getattr(p, field) == pytest.approx(value * si.factor, rel=1e-12), (name, symbol)
            assert si.base == unit_to_si(unit_of[symbol]).base, symbol
    assert (
        len(k.presets["published"].printed)
        == {"SingleTsmDahl": 11, "SingleTsmBoucWen": 14, "SingleTsmLuGre": 13}[model]
    )


@pytest.mark.parametrize(
    ("model", "values", "message"),
    [
        (
            "SingleTsmDahl",
            {"rho2": 1.855},
            r"rho2 = 1\.855 with mu3 = -1\.855 .* fall to 0\.0 -- expected rho2 - \|mu3\| > 0",
        ),
        ("SingleTsmDahl", {"mu1": -2.1}, r"mu1 = -2\.1 .* v >= 0 fall to -0\.00\d+ -- expected rho1 \+ min"),
        ("SingleTsmDahl", {"mu1": -1.3, "mu2": -0.8}, r"mu1 = -1\.3 and mu2 = -0\.8 .* -- raise rho1"),
        ("SingleTsmDahl", {"sigma": 0.0}, r"parameter sigma = 0\.0 N/m .* expected a value in \(0, inf\)"),
        ("SingleTsmDahl", {"kappa5": 0.0}, r"parameter kappa5 = 0\.0 m/s2"),
        ("SingleTsmDahl", {"kappa1": -172.0}, r"parameter kappa1 = -172\.0 s/m"),
        ("SingleTsmDahl", {"kappa4": math.nan}, r"parameter kappa4 = nan -- expected a number"),
        (
            "SingleTsmBoucWen",
            {"mu4": 1.6},
            r"rho2 = 1\.548 with mu3 = 0\.452 and mu4 = 1\.6 lets .* v <= 0 fall to -0\.05",
        ),
        (
            "SingleTsmBoucWen",
            {"mu3": -0.7},
            r"mu3 = -0\.7 and mu4 = 0\.875 .* expected rho2 \+ min\(mu3, 0\) - \|mu4\|",
        ),
        ("SingleTsmBoucWen", {"mu1": -0.8855}, r"mu1 = -0\.8855 .* fall to 0\.0"),
        ("SingleTsmBoucWen", {"sigma": 0.49}, r"parameter sigma = 0\.49 .* expected a value in \[0\.5, inf\)"),
        ("SingleTsmBoucWen", {"n": 0.99}, r"parameter n = 0\.99 .* expected a value in \[1, inf\)"),
        ("SingleTsmBoucWen", {"k": 0.0}, r"parameter k = 0\.0 N/m"),
        ("SingleTsmLuGre", {"rho1": 1.7}, r"rho1 = 1\.7 with mu1 = -1\.772 .* v >= 0 fall to -0\.07"),
        ("SingleTsmLuGre", {"rho2": 0.9991}, r"rho2 = 0\.9991 with mu3 = 0\.9991 makes S = 0 at every reversal"),
        ("SingleTsmLuGre", {"rho": 0.0}, r"parameter rho = 0\.0 1/rad"),
        ("SingleTsmLuGre", {"sigma0": -5.038}, r"parameter sigma0 = -5\.038 N"),
        ("SingleTsmLuGre", {"swap_branches": 2}, r"parameter swap_branches = 2 .* 0 \(as_in_Eq_8\) or 1"),
        ("SingleTsmLuGre", {"swap_branches": 0.5}, r"parameter swap_branches = 0\.5 -- expected an integer"),
        ("SingleTsmLuGre", {"kappa1": -0.341}, r"parameter kappa1 = -0\.341 s/rad"),
    ],
)
def test_unbounded_sets_are_refused_with_value_and_reason(model, values, message):
    with pytest.raises(InputError, match=message) as refused:
        kernel(model).params(None, values)
    assert "\n" not in str(refused.value)


@each_model
def test_published_sets_are_accepted(model):
    k = kernel(model)
    for preset in k.presets:
        k.check(k.params(preset))
    assert k.params("published") == k.params()
