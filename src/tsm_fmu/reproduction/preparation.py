"""Signals as the papers prepare them: an encoder's counts, zero-phase filtering, numerical differentiation.

MMT 2015, Section 4.2, prints the method ("numerical differentiation", "zero-phase digital filtering with filtfilt") and
no cut-off; the friction models switch branches with the sign of the acceleration, which is the second derivative of
counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.signal import butter, filtfilt

from ..kernels.arrays import BoolArray, FloatArray
from ..kernels.kernel import kernel
from .claims import Open

CUTOFFS_HZ = (2.0, 5.0, 10.0, 20.0, 50.0)
CUTOFF = Open("cut-off of the filter", "2 to 50 Hz", "not printed")
ORDER = 2


def filtered(signal: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Butterworth low-pass forth and back; ``cutoff`` in Hz."""
    filter_: Any = butter(ORDER, cutoff * 2.0 * step)
    return np.asarray(filtfilt(filter_[0], filter_[1], signal))


def prepared(time: FloatArray, position: FloatArray, cutoff: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, speed and acceleration from the counts of an encoder."""
    step = float(time[1] - time[0])
    x = filtered(position, step, cutoff)
    v = np.gradient(x, step)
    return x, v, np.gradient(v, step)


def predicted(model: str, preset: str, time: FloatArray, position: FloatArray, cutoff: float) -> FloatArray:
    """Friction [N] that a model gives for the prepared signals."""
    k = kernel(model)
    columns: dict[str, FloatArray] = dict(zip(("x", "v", "a"), prepared(time, position, cutoff), strict=True))
    rows = np.column_stack([columns.get(i.name, np.zeros(time.size)) for i in k.inputs])
    return k.simulate(k.params(preset), time, rows)[:, [o.name for o in k.outputs].index("F")]


def left(
    model: str,
    preset: str,
    time: FloatArray,
    position: FloatArray,
    force: FloatArray,
    *,
    scored: BoolArray,
    cutoffs: Sequence[float] = CUTOFFS_HZ,
) -> dict[float, float]:
    """Mean square difference [N2] that the preparation alone makes, by cut-off [Hz], where ``scored``."""
    off = {f: predicted(model, preset, time, position, f) - force for f in cutoffs}
    return {f: float(np.mean(difference[scored] ** 2)) for f, difference in off.items()}
