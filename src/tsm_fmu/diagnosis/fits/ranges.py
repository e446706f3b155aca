"""Ranges of the model's own parameters in a diagnosis: those that a rig can have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.chain_source import friction_unit
from ...kernels.kernel import Kernel, kernel
from ...regression.problem import FitRun
from ..criteria import FRICTION_LEVEL_RATIO
from ..runs.beginning import friction_channels


def level_ranges(
    model: Kernel, channels: Sequence[str], runs: Sequence[FitRun], fixed: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Ranges of the levels of a model's friction, by public name: `FRICTION_LEVEL_RATIO`.

    A break-away of thousands of newtons at a speed that no run has is a curve at the speeds that they have: no rig has
    it, and a refit can end there.

    Parameters
    ----------
    model : Kernel
    channels : sequence of str
        Measured ones.
    runs : sequence of FitRun
    fixed : sequence of str
        Public names that keep their value.
    """
    base, taken = kernel(model.name), friction_channels(model)
    columns = [j for j, channel in enumerate(channels) if channel in taken]
    if not columns:
        return {}
    most = FRICTION_LEVEL_RATIO * max(float(np.ptp(run.targets[:, j])) for run in runs for j in columns)
    unit = friction_unit(base)
    return {v.name: (-most, most) for v in base.parameters if v.quantity.unit == unit and v.name not in fixed}
