"""Signs: friction takes energy out of the motion; an answer whose friction gives energy is not physical."""

from __future__ import annotations

import numpy as np

from ...kernels.chain import model_part
from ...kernels.kernel import kernel
from ..criteria import RETURNED_WORK_SHARE
from ..fits.refit import Fitted
from ..fits.response import places_of


def returned_share(fitted: Fitted) -> float | None:
    """Energy that the friction of a fit gives back over what it takes; None for a model without friction of its own.

    Elastic parts that the effects add (stiffness, inertia, creep) give back what they took, so a closed motion is
    judged as a whole: the share is that of the net work if it is negative, else 0.

    Parameters
    ----------
    fitted : Fitted
    """
    problem = fitted.problem
    port = kernel(fitted.model).roles.friction
    if port is None:
        return None
    taken = net = 0.0
    for k, (run, place) in enumerate(zip(problem.runs, places_of(fitted), strict=True)):
        row = fitted.table[k]
        part = model_part(problem.kernel, problem.params(row), run.inputs, problem.every_output(k, row))
        friction = np.broadcast_to(port.read(part.parameters, part.inputs, part.outputs), run.time.shape)
        work = 0.5 * (friction[1:] + friction[:-1]) * np.diff(place.x)
        taken += float(np.sum(np.maximum(work, 0.0)))
        net += float(np.sum(work))
    return max(0.0, -net) / taken if taken > 0.0 else 0.0


def sign_notes(fitted: Fitted) -> tuple[str, ...]:
    """What a user should know about the signs of an answer, one sentence each."""
    share = returned_share(fitted)
    if share is None or share <= RETURNED_WORK_SHARE:
        return ()
    return (
        f"the friction of the answer gives energy, {100.0 * share:.0f} % of what it takes in between: not physical, "
        "look at the signs of the load and of the motion",
    )
