"""MSSP 2015: the paired drive and its compensator on imposed motions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...kernels.kernel import kernel
from ...scenarios.mssp_feedforward import plant
from ..motions import FloatArray, Motion

FROM = 10.0
"""Scored from here on [s]; runs last 20 s."""


def backlash(x: FloatArray, parameters: Mapping[str, float]) -> FloatArray:
    """Output [rad] of the backlash-like hysteresis."""
    k = kernel("PairedTsmBacklash")
    return k.simulate(k.params("published", parameters), np.arange(x.size, dtype=float), x[:, None])[:, 0]


def compensated(x_r: FloatArray, law: int, parameters: Mapping[str, float]) -> FloatArray:
    """Command [rad] of the feedforward law."""
    k = kernel("FeedforwardCompensator")
    p = k.params("published", {**parameters, "law": law})
    return k.simulate(p, np.arange(x_r.size, dtype=float), x_r[:, None])[:, 0]


def numbers_of(b: float | None = None) -> dict[str, float]:
    """Parameters: the published ones, or with slope ``b`` after a reversal and the published width."""
    return {name: float(value) for name, value in plant(b).items()}


def error_deg(motion: Motion, drive: FloatArray, parameters: Mapping[str, float]) -> FloatArray:
    """Reference minus output [deg] from `FROM` on."""
    return np.degrees(motion.x - backlash(drive, parameters))[motion.time >= FROM]
