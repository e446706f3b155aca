"""Speeds whose steps are those of a measured position.

A model that is driven by its speed takes v dt for what the drive has moved, and its presliding state lives on that. A
differentiator rounds each reversal off, and a measured speed at a few samples a reversal misses it: then the model is
blamed for what the speed has lost. So where a log holds the position, and this has no noise but the steps of its
encoder, the speed of a step is what the position has moved in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...logs.differentiate import differentiate
from ...logs.quantisation import quantisation_step
from ...logs.record import Record
from ...regression.residuals import white_noise
from ..criteria import DITHER_SHARE, POSITION_NOISE_SHARE
from .drivers import position_column

SPEED, ACCELERATION = "v", "a"
SLOW_STEPS = 3.5
"""Steps of the encoder in a sample up to which the instants of its edges say more than its readings."""
FINE_STEPS = (10.0, 30.0)
"""Steps of the encoder in a sample, from where to where one of them ceases to be noise of the speed."""


def with_speeds_of_position(
    model: Kernel, records: Sequence[Record], cutoff: float | None
) -> tuple[list[Record], tuple[str, ...]]:
    """Records whose speed is that of the steps between their positions, and what is said of them.

    Parameters
    ----------
    model : Kernel
        Those of one that is not driven by its speed stay as they are.
    records : sequence of Record
        As do those without a position, or with one that has noise.
    cutoff : float or None
        Of the differentiator [Hz], if the user chose one: then the speed is derived with it.
    """
    if model.motion != SPEED or cutoff is not None:
        return list(records), ()
    name = position_column(model, records)
    if name is None or not all(_clean(record.columns[name]) for record in records if name in record.columns):
        return list(records), ()
    found, accelerated = [], ACCELERATION in [v.name for v in model.inputs]
    for record in records:
        if name in record.columns:
            x, unit = record.columns[name], record.units[name]
            columns = {**record.columns, SPEED: speed_of_steps(record.time, x)}
            units = {**record.units, SPEED: f"{unit}/s"}
            if accelerated and ACCELERATION not in record.columns:  # from the position: steps of a speed are rough
                columns[ACCELERATION] = differentiate(record.time, x, 2, first_row=record.first_row).values
                units[ACCELERATION] = f"{unit}/s2"
            record = replace(record, columns=columns, units=units)
        found.append(record)
    return found, (f"{SPEED} is what {name} has moved in each sample: reversals are not rounded off",)


def speed_of_steps(time: FloatArray, x: FloatArray) -> FloatArray:
    """Mean speed of each sample since the one before it, of a position that an encoder reads; 0 at the first.

    Parameters
    ----------
    time, x : ndarray, shape (n,)
    """
    smooth, q = x, quantisation_step(x)
    if q > 0.0:
        moved = np.abs(np.diff(x))
        fast = moved > SLOW_STEPS * q
        edges = np.flatnonzero((moved > 0.2 * q) & ~fast)
        readings = np.append(fast, False) | np.append(False, fast)
        at = np.concatenate([[time[0]], 0.5 * (time[edges] + time[edges + 1]), time[readings], [time[-1]]])
        value = np.concatenate([[x[0]], 0.5 * (x[edges] + x[edges + 1]), x[readings], [x[-1]]])
        at, first = np.unique(at, return_index=True)
        smooth = np.asarray(PchipInterpolator(at, value[first])(time))
        steps = gaussian_filter1d(np.append(moved, moved[-1]) / q, 2.0)
        fine = np.clip((steps - FINE_STEPS[0]) / (FINE_STEPS[1] - FINE_STEPS[0]), 0.0, 1.0)
        smooth = fine * smooth + (1.0 - fine) * gaussian_filter1d(smooth, 1.0, mode="nearest")
    return np.append(0.0, np.diff(smooth) / np.diff(time))


def _clean(x: FloatArray) -> bool:
    """Whether a position has no noise but the steps of its encoder: it does not dither, and its steps are smooth."""
    moved = np.diff(x)
    back = moved[1:] * moved[:-1] < 0.0
    coarse = max(quantisation_step(x), POSITION_NOISE_SHARE * float(np.sqrt(np.mean(moved**2))))
    return float(np.mean(back[1:] & back[:-1])) < DITHER_SHARE and bool(white_noise(x) <= coarse)
