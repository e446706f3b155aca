"""What every effect promises, whatever it is."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models.contract import SIGNALS, flat, packed

IDS = (
    "coulomb viscous stribeck acceleration_branches inertia friction_lag presliding_shape nonlocal_memory "
    "breakaway_ageing load_dependence bend_angle temperature_dependence drive_direction direction_asymmetry "
    "offset_drift gain_error backlash smooth_backlash tendon_elasticity stiffness_hardening slack creep thermal "
    "wear drum_periodic winding_crossover delay sensor_lag quantisation"
).split()
"""The first public ids, in the order of the vocabulary: cards and logs of users hold them."""

UGLY = {"T_d": 0.0173, "n": 1.37, "q": 0.0137, "p": 0.73, "eps": 0.31, "beta": -0.37, "d": 0.43, "g": 0.137}
"""Values for parameters whose neutral value is 0 or 1; the others get 0.317."""

each = pytest.mark.parametrize("module", EFFECTS, ids=lambda m: m.NAME)


def wandering(effect: Kernel, seed: int, rows: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Smooth random signals that turn often, and an uneven clock."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.8e-3, 1.2e-3, rows))
    knots = rng.normal(size=(40, len(effect.inputs)))
    grid = np.linspace(0.0, 39.0, rows)
    signals = np.column_stack([np.interp(grid, np.arange(40), column) for column in knots.T])
    for column, variable in enumerate(effect.inputs):
        if variable.name in ("s", "z"):
            signals[:, column] = np.clip(signals[:, column], -1.0, 1.0)
    return time, signals


def strong(effect: Kernel):
    """Parameters with which the effect does something."""
    values = {v.name: UGLY.get(v.name, 0.317) if v.start in (0.0, 1.0) else v.start * 1.37 for v in effect.parameters}
    return effect.params(None, values)


def test_no_public_id_goes_or_moves():
    assert [module.NAME for module in EFFECTS][: len(IDS)] == IDS


@each
def test_neutral_parameters_change_nothing_bit_for_bit(module):
    effect = Kernel(module)
    time, signals = wandering(effect, seed=3)
    assert np.array_equal(effect.simulate(module.NEUTRAL, time, signals)[:, 0], signals[:, 0])


@each
def test_strong_parameters_change_something(module):
    effect = Kernel(module)
    time, signals = wandering(effect, seed=4)
    assert not np.allclose(effect.simulate(strong(effect), time, signals)[:, 0], signals[:, 0])


@each
def test_compiled_and_plain_agree_bit_for_bit(module):
    effect = Kernel(module)
    time, signals = wandering(effect, seed=5)
    p = strong(effect)
    compiled = effect.simulate(p, time, signals)
    assert np.array_equal(compiled, effect.simulate(p, time, signals, compiled=False))


@each
def test_state_survives_json(module):
    effect = Kernel(module)
    time, signals = wandering(effect, seed=6, rows=400)
    p = strong(effect)
    s, _ = module.start(p, module.Inputs(*signals[0]))
    for k in range(1, 200):
        s, _ = module.step(p, s, module.Inputs(*signals[k]), time[k] - time[k - 1])
    back = packed(module.State, json.loads(json.dumps(flat(s))))
    for k in range(200, 400):
        u, dt = module.Inputs(*signals[k]), time[k] - time[k - 1]
        s, o = module.step(p, s, u, dt)
        back, other = module.step(p, back, u, dt)
        assert o == other


@each
def test_declarations_are_complete(module):
    effect = Kernel(module)
    assert [v.name for v in effect.outputs] == ["y"]
    assert {v.name for v in effect.inputs} <= set(SIGNALS)
    assert effect.inputs[0].name == "y"
    effect.check(module.NEUTRAL)
    assert "(1)" in module.__doc__
    assert "Source:" in module.__doc__
    assert "Limits:" in module.__doc__
    for v in (*effect.parameters, *effect.inputs):
        assert v.quantity.unit
        assert v.quantity.meaning


@each
def test_only_math_typing_and_each_other_are_imported(module):
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert {alias.name for alias in node.names} <= {"math"}
        if isinstance(node, ast.ImportFrom):
            assert node.level > 0 or node.module == "typing"
