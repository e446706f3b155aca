"""Ranges of the model's own parameters in a diagnosis: those that a rig can have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...kernels.chain_source import friction_unit
from ...kernels.kernel import Kernel, kernel
from ...regression.problem import FitRun
from ..criteria import FORGOTTEN_LENGTHS, FRICTION_LEVEL_RATIO
from ..runs.beginning import friction_channels
from ..runs.motion_signals import coordinate_units


def level_ranges(
    model: Kernel, channels: Sequence[str], runs: Sequence[FitRun], fixed: Sequence[str],
    values: Mapping[str, float] | None = None, preset: str | None = None,
) -> dict[str, tuple[float, float]]:  # fmt: skip
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
    values : mapping of str to float, optional
        Given parameters, for the factor that a model may have on its levels.
    preset : str, optional
        Parameter set for the others.
    """
    base, taken = kernel(model.name), friction_channels(model)
    columns = [j for j, channel in enumerate(channels) if channel in taken]
    if not columns:
        return {}
    inputs = [v.name for v in base.inputs]
    if base.roles.load not in inputs and base.roles.drive in inputs:  # an estimator takes the friction out of the drive
        signals = [run.inputs[:, inputs.index(base.roles.drive)] for run in runs]
    else:
        signals = [run.targets[:, j] for run in runs for j in columns]
    # with zero: where a motion goes one way alone its friction hardly changes
    most = FRICTION_LEVEL_RATIO * max(float(np.ptp(np.append(signal, 0.0))) for signal in signals)
    scale = base.roles.friction.scale if base.roles.friction else ""
    if scale:
        most /= model.named(model.params(preset, dict(values or {})))[scale]
    unit = friction_unit(base)
    return {v.name: (-most, most) for v in base.parameters if v.quantity.unit == unit and v.name not in fixed}


def forgetting_ranges(
    model: Kernel, stroke: float, values: Mapping[str, float] | None = None, preset: str | None = None
) -> dict[str, tuple[float, float]]:
    """Ranges of the inverse lengths over which a model forgets a reversal, by public name: `FORGOTTEN_LENGTHS`.

    A hysteresis longer than the motion never closes: from its start it drifts into place, and takes up a drift.

    Parameters
    ----------
    model : Kernel
    stroke : float
        Longest of the measured runs, in the unit of the motion.
    values : mapping of str to float, optional
        Given parameters; a range reaches to what is given.
    preset : str, optional
        Parameter set for the others.
    """
    given, inverse = model.named(model.params(preset, dict(values or {}))), f"1/{coordinate_units(model)[0]}"
    least = FORGOTTEN_LENGTHS / stroke
    own = [v.name for v in kernel(model.name).parameters if v.quantity.unit == inverse]
    return {name: (min(least, given[name]), np.inf) for name in own}
