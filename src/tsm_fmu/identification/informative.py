"""Whether measured runs can determine anything at all, before a search that would fit to nothing."""

from __future__ import annotations

import numpy as np

from ..models.contract import InputError
from ..regression.problem import Problem

__all__ = ["check_informative"]


def check_informative(problem: Problem) -> None:
    """Refuse runs from which no fit can follow.

    Raises
    ------
    InputError
        No more measured values than free parameters, a measured channel or all inputs without any change.
    """
    runs, model = problem.runs, problem.kernel
    names = ", ".join(run.name for run in runs)
    free = len(problem.space.free)
    values = sum(run.targets.size for run in runs)
    if values <= free:
        raise InputError(
            f"{values} measured values in {names} for {free} free parameters of {model.name} -- expected more, by far "
            "-- give longer runs"
        )
    for k, channel in enumerate(problem.channels):
        if all(np.ptp(run.targets[:, k]) == 0.0 for run in runs):
            raise InputError(
                f"channel {channel!r} is {runs[0].targets[0, k]:g} in every row of {names} -- expected one that moves "
                f"-- correct the log, or leave it out with --map {channel}=NAME"
            )
    if model.inputs and all(np.ptp(run.inputs, axis=0).max() == 0.0 for run in runs):
        raise InputError(
            f"no input of {model.name} moves in {names} ({', '.join(v.name for v in model.inputs)}) -- expected motion "
            "-- give a run in which the drive moves"
        )
