"""Translated kernels against the plain Python ones: every bit of state and output, and every sentence of a failure."""

import math
import random
import struct

import pytest

from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import InputError

from .translated import Translated, random_inputs, random_parameters

RUNS, STEPS = 12, 40


def bits(values):
    """Numbers by their bits: 0.0 is not -0.0, and NaN is itself."""
    return [tuple(bits(v)) if isinstance(v, tuple) else struct.pack("<d", v) for v in values]


def outcome(function, *arguments):
    """State and outputs, or the sentence of the failure."""
    try:
        state, outputs = function(*arguments)
    except (ValueError, ArithmeticError, IndexError) as failure:
        return None, str(failure)
    return state, (bits(state), bits(outputs))


def compare(k: Kernel, in_c: Translated, seed: int) -> tuple[int, int]:
    """Run both side by side; the number of steps that went well and that failed."""
    source = random.Random(seed)
    p = random_parameters(k, source)
    inputs = list(random_inputs(k, source, STEPS))
    s, expected = outcome(k.module.start, p, inputs[0])
    _, found = outcome(in_c.start, p, inputs[0])
    assert found == expected, (p, inputs[0])
    well = failed = 0
    for u in inputs[1:]:
        if s is None:
            break
        dt = 10.0 ** source.uniform(-4.0, -0.5)
        after, expected = outcome(k.module.step, p, s, u, dt)
        _, found = outcome(in_c.step, p, s, u, dt)
        assert found == expected, (p, s, u, dt)
        well, failed = well + (after is not None), failed + (after is None)
        s = after if after is not None and all(map(math.isfinite, flat(after))) else s
    return well, failed


def flat(values):
    for v in values:
        if isinstance(v, tuple):
            yield from flat(v)
        else:
            yield v


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_every_model_is_the_same_to_the_last_bit(module, tmp_path):
    k = Kernel(module)
    in_c = Translated(k, tmp_path)
    assert sum(compare(k, in_c, seed)[0] for seed in range(RUNS)) > RUNS * STEPS // 3


def places(effect):
    """A model that can carry the effect."""
    for name in ("TendonDrive", "DistalEstimator", "PairedTsmFriction"):
        try:
            return chain(name, (effect,))
        except InputError:
            continue
    raise AssertionError(effect)


@pytest.mark.parametrize("module", EFFECTS, ids=lambda m: m.NAME)
def test_every_effect_in_a_chain_is_the_same_to_the_last_bit(module, tmp_path):
    k = places(module.NAME)
    in_c = Translated(k, tmp_path)
    assert sum(compare(k, in_c, seed)[0] for seed in range(RUNS)) > RUNS * STEPS // 3


def test_a_chain_whose_load_is_solved_for(tmp_path):
    k = chain("DistalEstimator", ("load_dependence", "coulomb", "backlash@x_out", "sensor_lag@x_in"))
    in_c = Translated(k, tmp_path)
    assert sum(compare(k, in_c, seed)[0] for seed in range(RUNS)) > RUNS * STEPS // 3
