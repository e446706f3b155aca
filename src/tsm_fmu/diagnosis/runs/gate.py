"""The gate: is the log good enough to blame a model with it?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...checking import check_record
from ...kernels.kernel import Kernel
from ...logs.record import Record
from ..criteria import CLIPPED_SHARE, FEWEST_SAMPLES, LIMIT_TO_LEVEL_RATIO, STUCK_RUN_SHARE
from ..evidence import Gate


def gate(records: Sequence[Record], model: Kernel, channels: Sequence[str]) -> Gate:
    """Check the runs: clock, events, saturation, quantisation, coverage; refuse what cannot be judged.

    Parameters
    ----------
    records : sequence of Record
    model : Kernel
    channels : sequence of str
        Outputs that are compared.
    """
    notes, refused = [], []
    motion = model.motion
    moving = False
    for record in records:
        checked = check_record(record)
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
            if f.channel in channels and f.kind == "clipping" and _clipped(record.columns[f.channel]):
                refused.append(f"{record.name}: {f.text}")
    if not moving:
        refused.append(f"{motion} does not move in any run")
    return Gate(tuple(notes), tuple(refused))


def _clipped(x: np.ndarray) -> bool:
    """Whether the signal stands at its limit for long, and far longer than a coarse converter stands at each level."""
    levels = np.unique(x).size
    at_limit = max(float(np.mean(x == x.max())), float(np.mean(x == x.min())))
    return at_limit > CLIPPED_SHARE and at_limit > LIMIT_TO_LEVEL_RATIO / levels
