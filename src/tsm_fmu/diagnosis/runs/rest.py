"""A measured speed at rest: its noise is no motion.

A model of friction that is driven by its speed takes noise about zero for tiny motions to and fro, which let its
presliding state slip until nothing is left of the force of a hold. So where a speed is not told from zero it is zero.
A slow reversal passes through zero within the noise too, and what it moves there can be a presliding distance: a speed
that changes steadily is no rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation, correlate1d, maximum_filter1d, uniform_filter1d

from ...kernels.arrays import BoolArray, FloatArray
from ...kernels.kernel import Kernel
from ...logs.record import Record
from ...regression.residuals import white_noise
from ..criteria import REST_DEVIATIONS, REST_WINDOW_S

SPEED = "v"
FEWEST = 8
"""Samples of a window at least."""


def with_quiet_rests(model: Kernel, records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Records whose measured speed is zero where it is not told from zero, and what is said of them.

    Parameters
    ----------
    model : Kernel
        Those of one that is not driven by its speed stay as they are.
    records : sequence of Record
        As do those without that speed, or without noise in it.
    """
    if model.motion != SPEED:
        return list(records), []
    found, said = [], []
    for record in records:
        if SPEED in record.columns:
            speed = record.columns[SPEED]
            rests = at_rest(record.time, speed) & (speed != 0.0)
            if rests.any():
                share = f"{100.0 * rests.mean():.2g} % of its samples"
                said.append(f"{record.name}: {SPEED} counts as zero in {share}, where it is not told from zero")
                record = replace(record, columns={**record.columns, SPEED: np.where(rests, 0.0, speed)})
        found.append(record)
    return found, said


def at_rest(time: FloatArray, speed: FloatArray) -> BoolArray:
    """Where a speed is not told from zero: within its noise, and over `REST_WINDOW_S` on average and in its slope too.

    Parameters
    ----------
    time, speed : ndarray, shape (n,)

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    count = _window(time)
    if speed.size < 2 * count:
        return np.zeros(speed.size, bool)
    noise = float(white_noise(speed))
    small = maximum_filter1d(np.abs(speed), count) < 1.5 * REST_DEVIATIONS * noise  # the largest of many
    still = np.abs(uniform_filter1d(speed, count)) < REST_DEVIATIONS * noise / np.sqrt(count)
    ramp = np.arange(count) - 0.5 * (count - 1)
    even = np.abs(correlate1d(speed, ramp)) < REST_DEVIATIONS * noise * np.sqrt(np.sum(ramp**2))
    return np.asarray(binary_dilation(small & still & even, np.ones(count, bool)), bool)


def _window(time: FloatArray) -> int:
    """Samples of `REST_WINDOW_S`, an odd number."""
    return max(FEWEST, round(REST_WINDOW_S / float(np.median(np.diff(time))))) | 1
