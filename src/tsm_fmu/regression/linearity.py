"""Which parameters a model is linear in, found by probing it.

A set of parameters is eliminated from the search (variable projection) when the outputs are affine in it.
No model declares this: second differences of the simulated outputs, of every parameter and of every pair,
vanish or they do not.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ..kernels.arrays import FloatArray
from .problem import Problem
from .thinning import thinned

PROBE_ROWS = 4000
TOLERANCE = 1e-9
"""Largest second difference, relative to the first ones, that counts as rounding."""
IDLE = 1e-6
"""A parameter that moves the outputs by less than this part shows nothing about its form: it is searched."""


def linear_parameters(problem: Problem, seed: int = 0) -> frozenset[str]:
    """The largest set, greedily, of free parameters in which the channels are jointly affine.

    Parameters
    ----------
    problem : Problem
    seed : int
        Seed of the probing steps.

    Returns
    -------
    frozenset of str
        Fields of the kernel's ``Params``.
    """
    rng = np.random.default_rng(seed)
    free = problem.space.free
    run = max(range(len(problem.runs)), key=lambda k: float(np.ptp(problem.runs[k].inputs, axis=0).sum()))
    probe = problem.with_runs(thinned(problem.kernel, [problem.runs[run]], PROBE_ROWS))
    base = probe.start()[0]
    affine = {name: True for name in free}
    joint = {pair: True for pair in combinations(free, 2)}
    for _ in range(3):
        row = base * np.exp(rng.uniform(-0.4, 0.4, base.size))
        row = np.where([probe.space[f].free for f in probe.fields], row, base)
        if probe.refused(row[None]):
            row = base.copy()
        steps = {f: _step(probe, f, row, rng) for f in free}
        y0 = probe.outputs(0, row)
        moved = {f: probe.outputs(0, _moved(probe, row, {f: steps[f]})) for f in free}
        for name in free:
            twice = probe.outputs(0, _moved(probe, row, {name: 2.0 * steps[name]}))
            affine[name] &= bool(np.max(abs(moved[name] - y0)) > IDLE * np.max(abs(y0)))
            affine[name] &= _vanishes(twice - 2.0 * moved[name] + y0, moved[name] - y0, y0)
        for a, b in joint:
            if affine[a] and affine[b] and joint[a, b]:
                both = probe.outputs(0, _moved(probe, row, {a: steps[a], b: steps[b]}))
                first = np.maximum(abs(moved[a] - y0), abs(moved[b] - y0))
                joint[a, b] = _vanishes(both - moved[a] - moved[b] + y0, first, y0)
    linear: list[str] = []
    for name in sorted((f for f in free if affine[f]), key=lambda f: -sum(joint[p] for p in joint if f in p)):
        if all(joint[a, b] for a, b in joint if name in (a, b) and (a in linear or b in linear)):
            linear.append(name)
    return frozenset(linear)


def _step(problem: Problem, name: str, row: FloatArray, rng: np.random.Generator) -> float:
    value, parameter = row[problem.fields.index(name)], problem.space[name]
    size = float(rng.uniform(0.1, 0.3)) * (abs(value) or 1.0)
    size = min(size, 0.4 * (parameter.hi - parameter.lo))
    return -size if value + 2.0 * size > parameter.hi or value < 0.0 <= value + 2.0 * size else size


def _moved(problem: Problem, row: FloatArray, changes: dict[str, float]) -> FloatArray:
    row = row.copy()
    for name, change in changes.items():
        row[problem.fields.index(name)] += change
    return row


def _vanishes(second: FloatArray, first: FloatArray, level: FloatArray) -> bool:
    size = np.max(abs(first)) + IDLE * np.max(abs(level))
    return bool(np.isfinite(second).all() and np.max(abs(second)) <= TOLERANCE * size)
