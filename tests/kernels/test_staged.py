"""A chain simulated piece by piece: the bits of its own text in plain Python, and nothing of it is compiled."""

from contextlib import suppress

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels import chain as module
from tsm_fmu.kernels.chain import Chain, attach, chain
from tsm_fmu.kernels.chain_source import Writer
from tsm_fmu.kernels.drives import ANGLE, Drive
from tsm_fmu.kernels.kernel import compiled_loops, kernel, plain_run
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import flat

SPANS = np.array([[0, 33, 0], [9, 47, 33], [0, 47, 71], [0, 33, 118], [9, 47, 151]])
SAMPLES, ROWS = 47, 189
STAGED = [m.NAME for m in MODELS]


def specs(model: str) -> list[str]:
    """Every effect at every place of a model where it can be simulated in stages."""
    base, found = kernel(model), []
    for effect in EFFECTS:
        for channel in ("", *(f"@{v.name}" for v in (*base.outputs, *base.inputs))):
            with suppress(InputError):
                attached = attach(base, effect.NAME + channel)
                if not Writer(base, [attached]).feeds_back:
                    found.append(attached.spec)
    return list(dict.fromkeys(found))


def table(k: Chain, rng: np.random.Generator) -> np.ndarray:
    """Values of five simulations within their bounds: the fourth is the first, the fifth differs in the last effect."""
    rows = []
    for _ in range(3):
        row = []
        for v in k.parameters:
            moved = v.start * (1.0 + 0.1 * rng.random()) if v.start else 0.05 * rng.random()
            inside = v.kind is float and v.quantity.lo <= moved <= v.quantity.hi
            row.append(moved if inside else v.start)
        rows.append(row)
    return np.array([*rows, rows[0], [*rows[1][:-1], 1.01 * rows[1][-1]]], dtype=float)


def by_its_text(k: Chain, values: np.ndarray, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    y, at = np.empty((ROWS, len(k.outputs))), np.zeros(1, dtype=np.int64)
    while at[0] < len(values):
        try:
            plain_run(k.module)(values, SPANS, t, u, y, at)
            break
        except (ValueError, ArithmeticError):
            first, end, to = SPANS[at[0]]
            y[to : to + end - first] = np.nan
            at[0] += 1
    return y


def compare(model: str, effects: tuple[str, ...], seed: int, drives: tuple[Drive, ...] = ()) -> np.ndarray:
    k, rng = chain(model, effects, drives), np.random.default_rng(seed)
    assert isinstance(k, Chain)
    assert k.staged
    t = np.cumsum(rng.uniform(5e-4, 2e-3, SAMPLES))
    scale = 1e-3 if k.motion == "v" else 1.0
    u = np.empty((t.size, len(k.inputs)))
    for j in range(len(k.inputs)):
        u[:, j] = scale * np.interp(t, np.linspace(t[0], t[-1], 13), rng.normal(size=13))
    values, y = table(k, rng), np.empty((ROWS, len(k.outputs)))
    alive = k.staged.fill(values, SPANS, t, u, y)
    np.testing.assert_array_equal(y, by_its_text(k, values, t, u))
    for (first, end, to), lives in zip(SPANS, alive, strict=True):
        assert lives or np.isnan(y[to : to + end - first]).all()
    return y


@pytest.mark.parametrize("model", STAGED)
def test_random_chains_at_random_places_give_the_bits_of_their_text(model: str) -> None:
    every = specs(model)
    left = list(np.random.default_rng(31).permutation(every))
    while left:  # each place once
        compare(model, tuple(str(spec) for spec in left[:9]), len(left))
        left = left[9:]
    compare(model, tuple(every[:2]), 5, (ANGLE,))


def test_a_simulation_that_stops_leaves_the_others_and_says_why() -> None:
    effects = ("delay@F", "coulomb")
    y = compare("LuGreFriction", effects, 3)
    k = chain("LuGreFriction", effects)
    t = np.arange(200) * 1e-4
    p = k.params(None, {"F.delay.T_d": 0.05})
    with pytest.raises(InputError, match=r"stopped: T_d over dt -- expected at most the \d+ steps kept"):
        k.simulate(p, t, np.zeros((200, len(k.inputs))))
    assert np.isfinite(y).any()


def test_nothing_of_a_chain_is_compiled_before_it_is_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    k = chain("TendonDrive", ("stiffness_hardening", "thermal@x_out", "creep"))
    assert isinstance(k, Chain)
    monkeypatch.setattr(module, "is_kept", lambda _: False)
    t, u = np.arange(90) * 1.7e-3, np.zeros((90, 2))
    u[:, 0] = np.sin(17.0 * t)
    first = k.simulate(k.params(), t, u)
    assert not compiled_loops(k.module).signatures
    monkeypatch.setattr(module, "WORTH_COMPILING", 90)
    whole = k.simulate(k.params(), t, u)
    assert compiled_loops(k.module).signatures
    np.testing.assert_array_equal(first, whole)


def test_an_effect_that_reads_the_load_estimated_from_its_friction_is_compiled_whole() -> None:
    k = chain("DistalEstimator", ("load_dependence",))
    assert isinstance(k, Chain)
    assert k.staged is None
    driven = chain("DistalEstimator", ("load_dependence~F_t[N]",))
    assert isinstance(driven, Chain)
    assert driven.staged


@pytest.mark.parametrize("effect", ["coulomb", "sensor_lag@tau_in"])
def test_a_load_that_is_held_through_effects_on_the_friction_is_simulated_as_a_whole(
    effect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "is_kept", lambda _: False)
    k, found = chain("DistalEstimator", (effect,)), []
    assert isinstance(k, Chain)
    t = np.arange(2100) * 1e-3
    u = np.column_stack([0.5 * np.sin(3.1 * t), 0.07 + 0.04 * np.sign(np.cos(3.1 * t))])
    for hold in (0, 1):
        p = k.params(None, {"tau_c": 0.044, "tau_s": 0.044, "hold": hold, k.parameters[-1].name: 0.07})
        assert bool(k.in_stages(np.array([flat(p)]))) == (not hold or "@" in effect)
        found.append(k.simulate(p, t, u))
        np.testing.assert_array_equal(found[-1], k.simulate(p, t, u, compiled=False))
    assert (found[0] != found[1]).any()


@pytest.mark.filterwarnings("ignore:(overflow|invalid value) encountered:RuntimeWarning")
def test_where_the_estimated_load_is_not_finite_it_stops_as_its_text_does() -> None:
    k = chain("DistalEstimator", ("coulomb", "viscous"))
    assert isinstance(k, Chain)
    assert k.staged
    t = np.cumsum(np.full(SAMPLES, 1.3e-3))
    u = np.column_stack([np.sin(9.0 * t), 0.2 * np.cos(3.0 * t)])
    sizes = [{}, {"coulomb.F_c": 1.7e308}, {"coulomb.F_c": 3.1}, {}, {"viscous.f_v": 0.3}]
    values = np.array([flat(k.params(None, {"ratio": 0.71, **size})) for size in sizes])
    y = np.empty((ROWS, len(k.outputs)))
    assert k.staged.fill(values, SPANS, t, u, y) == [True, False, True, True, True]
    np.testing.assert_array_equal(y, by_its_text(k, values, t, u))
