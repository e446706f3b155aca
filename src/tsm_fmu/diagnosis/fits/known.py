"""Which values of a run its log determines: where a model tells motions with the same readings apart, or pasts before
the log, what it makes of the run is no statement on its law.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ..criteria import DOUBT_DEVIATIONS, FORGOTTEN_TRAVEL_SHARE, LEFT_OUT_SHARE, UNRESOLVED_SPREAD_SHARE
from ..runs.beginning import compared_late, friction_channels
from ..runs.elsewhere import Elsewhere
from ..runs.pasts import coming_from, travel
from ..runs.prepared import PreparedRuns
from .refit import Fitted


def compared_where_known(runs: PreparedRuns, fitted: Fitted) -> PreparedRuns:
    """Runs with values of friction channels in doubt that a model tells apart for motions with the same readings.

    They begin where it no longer tells from which side the drive came before the log.

    Parameters
    ----------
    runs : PreparedRuns
    fitted : Fitted
        Their model, with values near those of the rig.
    """
    frictional = np.isin(fitted.problem.channels, list(friction_channels(runs.model)))
    if not frictional.any():
        return runs
    stroke = runs.stroke
    least = np.where(frictional, UNRESOLVED_SPREAD_SHARE * fitted.spread, np.inf)

    def known(run: FitRun, other: Elsewhere | None) -> FitRun:
        up, down = (_simulated(coming_from(runs.model, run, way, stroke), fitted) for way in (1.0, -1.0))
        early_on = travel(runs.model, run) < FORGOTTEN_TRAVEL_SHARE * stroke
        told = np.flatnonzero((np.abs(up - down) > np.sqrt(12.0) * least).any(axis=1) & early_on)
        if told.size:
            run = compared_late(run, int(told[-1]) + 1)
        if other is None:
            return run
        late, early = (_simulated(_moved(run, inputs), fitted) for inputs in (other.late, other.early))
        error = np.abs(late - early) / np.sqrt(12.0)  # evenly in between
        found = error > least
        found &= found.mean(axis=0) <= LEFT_OUT_SHARE
        return run.doubting(np.where(found, DOUBT_DEVIATIONS * error, 0.0))

    every = (*runs.measured, *runs.reference, *runs.holdout)
    every = tuple(known(run, other) for run, other in zip(every, runs.others, strict=True))
    ends = len(runs.measured), len(runs.measured) + len(runs.reference)
    return replace(runs, measured=every[: ends[0]], reference=every[ends[0] : ends[1]], holdout=every[ends[1] :])


def _moved(run: FitRun, inputs: FloatArray) -> FitRun:
    lead = run.lead_time.size
    return replace(run, inputs=inputs[lead:], lead_inputs=inputs[:lead])


def _simulated(run: FitRun, fitted: Fitted) -> FloatArray:
    whole = run.as_measured
    return fitted.problem.with_runs([whole]).outputs(0, fitted.table[0])
