"""The gate: is the log good enough to blame a model with it?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.stats import iqr

from ...checking import check_record
from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...logs.quantisation import quantisation_step
from ...logs.record import Record
from ...regression.threads import together
from ..criteria import CLIPPED_SHARE, FEWEST_SAMPLES, LIMIT_TO_LEVEL_RATIO, STUCK_RUN_SHARE
from ..evidence import Gate

Modelled = Callable[[int, str], FloatArray]


def _unknown(run: int, channel: str) -> FloatArray:
    return np.empty(0)


def gate(records: Sequence[Record], model: Kernel, channels: Sequence[str], modelled: Modelled = _unknown) -> Gate:
    """Check the runs: clock, events, saturation, quantisation, coverage; refuse what cannot be judged.

    Parameters
    ----------
    records : sequence of Record
    model : Kernel
    channels : sequence of str
        Outputs that are compared.
    modelled : callable, optional
        Given the number of a run and a channel, what the model as given makes of it, one value a sample, NaN where it
        is not compared; only called where a channel stands at its limit.
    """
    notes, refused = [], []
    motion = model.motion
    moving = False
    for k, (record, checked) in enumerate(zip(records, together(check_record, records), strict=True)):
        shown = [f for f in checked.findings if f.kind != "coverage" or len(records) == 1]
        notes += [f"{record.name}: {f.text}" for f in shown]
        if record.time.size < FEWEST_SAMPLES:
            refused.append(f"{record.name} has {record.time.size} samples, {FEWEST_SAMPLES} or more are needed")
        drive = record.columns.get(motion)
        moving |= drive is None or float(np.ptp(drive)) > 0.0
        for f in checked.findings:
            part = (f.rows[1] - f.rows[0] + 1) / record.time.size
            if f.channel in channels and f.kind == "stuck" and part > STUCK_RUN_SHARE:
                refused.append(f"{record.name}: {f.text}")
            if f.channel in channels and f.kind == "clipping" and _clipped(record, f.channel, partial(modelled, k)):
                refused.append(f"{record.name}: {f.text}")
    if not moving:
        refused.append(f"{motion} does not move in any run")
    return Gate(tuple(notes), tuple(refused))


def _clipped(record: Record, channel: str, modelled: Callable[[str], FloatArray]) -> bool:
    """Whether the signal stands at a limit for long, far longer than a coarse converter stands at each level.

    Where the model moves by less than a step of the converter meanwhile, it is one level: a friction of one size.
    """
    x = record.columns[channel]
    least = max(CLIPPED_SHARE, LIMIT_TO_LEVEL_RATIO / np.unique(x).size)
    limits = [at for at in (x == x.max(), x == x.min()) if at.mean() > least]
    if not limits:
        return False
    step, own = quantisation_step(x), modelled(channel)
    return not own.size or any(_moves(own[at]) >= step for at in limits)


def _moves(own: FloatArray) -> float:
    """Range of a signal but for its rarest values; without end where it is not known."""
    own = own[np.isfinite(own)]
    return float(iqr(own, rng=(5, 95))) if own.size else np.inf
