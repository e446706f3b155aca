"""Which values of a run its readings determine: where a model tells motions with the same readings apart, what it makes
of the run is no statement on its law.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ..criteria import LEFT_OUT_SHARE, UNRESOLVED_SPREAD_SHARE
from ..runs.beginning import friction_channels
from ..runs.elsewhere import Elsewhere
from ..runs.prepared import PreparedRuns
from .refit import Fitted


def compared_where_known(runs: PreparedRuns, fitted: Fitted) -> PreparedRuns:
    """Runs without the values of friction channels that a model tells apart for motions with the same readings.

    Parameters
    ----------
    runs : PreparedRuns
    fitted : Fitted
        Their model, with values near those of the rig.
    """
    frictional = np.isin(fitted.problem.channels, list(friction_channels(runs.model)))
    if not frictional.any():
        return runs
    apart = np.where(frictional, np.sqrt(12.0) * UNRESOLVED_SPREAD_SHARE * fitted.spread, np.inf)  # evenly in between

    def known(run: FitRun, other: Elsewhere | None) -> FitRun:
        if other is None:
            return run
        found = np.abs(_simulated(run, other.late, fitted) - _simulated(run, other.early, fitted)) > apart
        return run.leaving_out(found & (found.mean(axis=0) <= LEFT_OUT_SHARE))

    every = (*runs.measured, *runs.reference, *runs.holdout)
    every = tuple(known(run, other) for run, other in zip(every, runs.others, strict=True))
    ends = len(runs.measured), len(runs.measured) + len(runs.reference)
    return replace(runs, measured=every[: ends[0]], reference=every[ends[0] : ends[1]], holdout=every[ends[1] :])


def _simulated(run: FitRun, inputs: FloatArray, fitted: Fitted) -> FloatArray:
    lead = run.lead_time.size
    moved = replace(run, inputs=inputs[lead:], lead_inputs=inputs[:lead], unresolved=np.empty((0, 0), bool))
    return fitted.problem.with_runs([moved]).outputs(0, fitted.table[0])
