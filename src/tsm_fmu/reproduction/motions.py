"""Motions that the papers impose, and the friction that a model answers with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.kernel import kernel

FloatArray = NDArray[np.float64]
SECOND = 0.25 * math.sqrt(3.0)
"""Second frequency of the non-periodic motions of MMT 2015 and MSSP 2015 [Hz]."""


class Motion(NamedTuple):
    """Time [s], position and its derivatives, in the unit of the amplitudes."""

    time: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray


def sines(parts: Sequence[tuple[float, float]], stop: float, step: float) -> Motion:
    """Sum of up to three sines from (amplitude, frequency [Hz]) over 0 <= t < stop."""
    values = {f"{name}_{k}": 0.0 for k in (1, 2, 3) for name in ("amplitude", "frequency")}
    for k, (amplitude, frequency) in enumerate(parts, 1):
        values |= {f"amplitude_{k}": amplitude, f"frequency_{k}": frequency}
    signal = kernel("ReferenceSignal")
    time = np.arange(0.0, stop - 0.5 * step, step)
    y = signal.simulate(signal.params(values={"kind": 1, **values}), time, np.empty((time.size, 0)))
    return Motion(time, y[:, 0], y[:, 1], y[:, 2])


def friction(model: str, motion: Motion, preset: str = "published", **values: float) -> FloatArray:
    """Friction force [N] of a single-tendon model under a motion, in the units that the model takes."""
    k = kernel(model)
    columns = {"x": motion.x, "v": motion.v, "a": motion.a}
    rows = np.column_stack([columns.get(v.name, np.zeros(motion.time.size)) for v in k.inputs])
    names = [v.name for v in k.outputs]
    return k.simulate(k.params(preset, values), motion.time, rows)[:, names.index("F")]
