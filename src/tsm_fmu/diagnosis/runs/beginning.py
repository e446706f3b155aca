"""The beginning of a run and the end of a gap: what the rig did before is not in the log, and friction remembers it.

A presliding state forgets where it began as exp(-travel / x_pre), whatever its law. Until the drive has moved by a few
presliding distances, its friction belongs to that unknown past; a run whose friction is measured is compared from there
on, and simulated from its first sample. Once a fit knows how long its model remembers that counts too: see `pasts`. A
gap of the log is such a past too, unless it is of a few rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel, kernel
from ...logs.differentiate import after_gaps
from ...regression.problem import FitRun
from ..criteria import FORGOTTEN_STROKE_SHARE, LEFT_OUT_SHARE
from .motion_signals import position_of


def compared_after_start(model: Kernel, run: FitRun, channels: Sequence[str]) -> FitRun:
    """The run, compared from where the drive has forgotten its past.

    Parameters
    ----------
    model : Kernel
    run : FitRun
    channels : sequence of str
        Measured ones.
    """
    if not remembers(model, channels):
        return run
    return compared_late(run, _forgotten(position_of(model, run.time, run.inputs), 0))


def remembers(model: Kernel, channels: Sequence[str]) -> bool:
    """Whether what a model makes of some channels depends on where its drive was before."""
    return bool(model.motion) and bool(friction_channels(model) & set(channels))


def compared_late(run: FitRun, first: int) -> FitRun:
    """The run without its compared samples before ``first``; at most `LEFT_OUT_SHARE` of its log is left out."""
    lead = run.lead_time.size
    return run.compared_from(min(first, max(int(LEFT_OUT_SHARE * (lead + run.time.size)) - lead, 0)))


def compared_after_gaps(model: Kernel, run: FitRun) -> FitRun:
    """The run, not compared from a gap until the drive has forgotten what it did there.

    Parameters
    ----------
    model : Kernel
    run : FitRun
        From its first sample.
    """
    begins = after_gaps(run.time)
    if not model.motion or not begins.size:
        return run
    x, unknown = position_of(model, run.time, run.inputs), np.zeros(run.time.size, bool)
    for begin in begins:
        unknown[begin : _forgotten(x, int(begin))] = True
    unknown &= unknown.mean() <= LEFT_OUT_SHARE  # else there is nothing to compare
    doubt = np.where(unknown, np.inf, 0.0)
    return run.doubting(np.repeat(doubt[:, None], run.targets.shape[1], axis=1))


def _forgotten(x: FloatArray, since: int) -> int:
    """The sample at which a drive has moved by enough of its stroke since another one; their number if it never has."""
    low, high = np.quantile(x, [0.05, 0.95])
    after = x[since:]
    moved = np.maximum.accumulate(after) - np.minimum.accumulate(after)
    return since + int(np.searchsorted(moved, FORGOTTEN_STROKE_SHARE * (high - low)))


def friction_channels(model: Kernel) -> set[str]:
    """Outputs of a model that its friction is in."""
    port = model.roles.friction
    if port is None:
        return set()
    module = kernel(model.name).module
    p, u = module.Params(), module.Inputs(*(1.0 for _ in module.Inputs._fields))
    _, o = module.start(p, u)
    other = port.write(p, u, o, port.read(p, u, o) + 1.0)
    return {v.name for v, one, two in zip(kernel(model.name).outputs, o, other, strict=True) if one != two}


def beginning_note(runs: Sequence[FitRun]) -> tuple[str, ...]:
    """What a user should know of it, one sentence; nothing where all runs are compared from their first sample."""
    left_out = [run.time[0] - run.lead_time[0] if run.lead_time.size else 0.0 for run in runs]
    if not any(left_out):
        return ()
    low, high = f"{min(left_out):.2g}", f"{max(left_out):.2g}"
    share = f"{100.0 * FORGOTTEN_STROKE_SHARE:.0f} %"
    return (
        f"each run is compared from {low if low == high else f'{low} to {high}'} s after its start, once the drive has "
        f"moved by {share} of its stroke and the model has forgotten from which side it came: before, its friction is "
        "that of a past which is not in the log",
    )
