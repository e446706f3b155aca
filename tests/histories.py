"""Random histories of a kernel: which outputs move with which inputs within a step, and which at once."""

from __future__ import annotations

import math

import numpy as np

SIZES = {
    "rad": 2.0, "rad/s": 3.0, "rad/s2": 20.0, "N": 5.0, "N.m": 0.3, "V": 8.0, "m/s": 0.1, "m/s2": 1.0, "K": 290.0,
    "1": 1.0,
}  # fmt: skip
MOVES = (1e-3, -0.1, 0.7, -1.5)
VALUES = {"LebusWinding": {"s_w": 1, "mu": 0.12}}
"""Parameters that switch a part on."""
SHORT = (1e-9, 1e-12)
"""Steps [s] in which a state does not move, but an output may."""


def history(model, p, random, factor):
    """States, inputs and steps of a random motion with reversals; empty where the model refuses it."""
    sizes = [factor * SIZES[v.quantity.unit] for v in model.inputs]
    # forces pull, temperatures are absolute, and wheels wind from zero
    positive = [v.quantity.unit in ("N", "K") or v.name.startswith("theta") for v in model.inputs]
    levels = [size if p else 0.0 for size, p in zip(sizes, positive, strict=True)]
    frequency, phase = random.uniform(0.2, 1.5, len(sizes)), random.uniform(0.0, 6.0, len(sizes))

    def at(time):
        waves = 0.9 * np.sin(2.0 * np.pi * frequency * time + phase)
        return model.module.Inputs(*(float(a + s * w) for a, s, w in zip(levels, sizes, waves, strict=True)))

    rows, time = [], 0.0
    try:
        state, _ = model.module.start(p, at(0.0))
        for _ in range(60):
            dt = float(random.choice([1e-3, 0.01, 0.05]))
            time += dt
            after, outputs = model.module.step(p, state, at(time), dt)
            rows.append((state, at(time), dt, outputs))
            state = after
    except ValueError:
        pass
    return rows, sizes


def moved(model, seed, values=None):
    """Pairs (output, input): those that move within a step, and those that move at once, however short it is."""
    random = np.random.default_rng(seed)
    within, at_once = set(), set()
    for preset in (None, *model.presets):
        p = model.params(preset, VALUES.get(model.name) if values is None else values)
        for factor in (0.1, 1.0, 10.0):
            rows, sizes = history(model, p, random, factor)
            largest = np.max(np.abs([outputs for *_, outputs in rows]), axis=0) if rows else ()
            for state, inputs, dt, _ in rows[:: 12 if len(model.parameters) > 20 else 3]:
                for i, v in enumerate(model.inputs):
                    for move in MOVES:
                        other = inputs._replace(**{v.field: inputs[i] + move * sizes[i]})
                        change = [difference(model, p, state, inputs, other, h) for h in (dt, *SHORT)]
                        for j, w in enumerate(model.outputs):
                            step, short, shorter = (c[j] for c in change)
                            if step != 0.0:
                                within.add((w.name, v.name))
                            if abs(shorter) > max(0.5 * abs(short), 1e-6 * largest[j]):
                                at_once.add((w.name, v.name))
    return within, at_once


def difference(model, p, state, inputs, other, dt):
    try:
        a, b = (model.module.step(p, state, u, dt)[1] for u in (inputs, other))
    except (ValueError, ArithmeticError):
        return [0.0] * len(model.outputs)
    return [y - x if math.isfinite(y - x) else 0.0 for x, y in zip(a, b, strict=True)]
