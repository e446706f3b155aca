"""Motions that the papers impose: as samples for the models themselves, and as systems of FMUs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..cosim.ssp import Case
from ..cosim.system import Component, Connection, Experiment, System, Value
from ..kernels.arrays import FloatArray
from ..kernels.kernel import kernel
from .loops import FMUS

SECOND = 0.25 * math.sqrt(3.0)
"""Second frequency of the non-periodic motions of MMT 2015 and MSSP 2015 [Hz]."""

Sines = Sequence[tuple[float, float]]
"""Amplitude and frequency [Hz] of up to three sines."""


class ImposedMotion(NamedTuple):
    """Time [s], position and its derivatives, in the unit of the amplitudes."""

    time: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray


def signal(parts: Sines) -> dict[str, Value]:
    """Parameters of ReferenceSignal for a sum of sines."""
    values: dict[str, Value] = {"kind": 1}
    for k, (amplitude, frequency) in enumerate((*parts, *((0.0, 0.0),) * (3 - len(parts))), 1):
        values |= {f"amplitude_{k}": amplitude, f"frequency_{k}": frequency}
    return values


def sines(parts: Sines, stop: float, step: float) -> ImposedMotion:
    """Sum of up to three sines over 0 <= t < stop."""
    reference = kernel("ReferenceSignal")
    time = np.arange(0.0, stop - 0.5 * step, step)
    values = {name: float(value) for name, value in signal(parts).items()}
    y = reference.simulate(reference.params(values=values), time, np.empty((time.size, 0)))
    return ImposedMotion(time, y[:, 0], y[:, 1], y[:, 2])


def friction(model: str, motion: ImposedMotion, preset: str = "published", **values: float) -> FloatArray:
    """Friction force [N] of a single-tendon model under a motion, in the units that the model takes."""
    k = kernel(model)
    columns = {"x": motion.x, "v": motion.v, "a": motion.a}
    rows = np.column_stack([columns.get(v.name, np.zeros(motion.time.size)) for v in k.inputs])
    names = [v.name for v in k.outputs]
    return k.simulate(k.params(preset, values), motion.time, rows)[:, names.index("F")]


def driven(
    model: str,
    motion: Mapping[str, Value],
    experiment: Experiment,
    preset: str,
    values: Mapping[str, Value] | None = None,
) -> Case:
    """A motion (parameters of ReferenceSignal) imposed on a friction FMU: reference -> ``plant``."""
    k = kernel(model)
    inputs = {v.name for v in k.inputs}
    start = {**k.presets[preset].si, **(values or {}), **{n: 0.0 for n in inputs - {"v", "a"}}}
    wires = [
        Connection(f"reference.{source}", f"plant.{target}", convert_units=False)
        for source, target in (("dy", "v"), ("ddy", "a"))
        if target in inputs
    ]
    parts_ = (Component("reference", FMUS["ReferenceSignal"], motion), Component("plant", FMUS[model], start))
    return System(parts_, tuple(wires), model), experiment
