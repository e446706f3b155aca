"""The family of what is missing, also where it has no name: over what the residual is a law."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import make_interp_spline

from ...effects import about
from ...effects.about import Family
from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ...regression.sensitivity import output_jacobian
from ..criteria import FAMILY_SHARE, FAMILY_TIE_SHARE
from ..evidence import FamilyShare
from ..fits.refit import Fitted
from ..fits.response import normalised, places_of
from ..residual.families import family_shares


def family_evidence(fitted: Fitted, runs: Sequence[FitRun]) -> tuple[FamilyShare, ...]:
    """What the laws of each family predict of what a fit leaves of each channel, most first.

    Parameters
    ----------
    fitted : Fitted
        The refitted model without any effect of the answer.
    runs : sequence of FitRun
        All samples of the measured runs.
    """
    whole = fitted.at(runs)
    problem, places = whole.problem, places_of(whole)
    moves, found = _moves(fitted, problem.runs), []
    for c, channel in enumerate(problem.channels):
        residuals = [r[:, c] for r in whole.residuals]
        outputs = [run.targets[:, c] - r for run, r in zip(problem.runs, residuals, strict=True)]
        shares = family_shares(residuals, outputs, places, normalised(moves[:, c]))
        found += [FamilyShare(family, channel, share) for family, share in shares.items()]
    return tuple(sorted(found, key=lambda f: -f.share))


def _moves(fitted: Fitted, runs: Sequence[FitRun]) -> FloatArray:
    """What the parameters do at the samples of runs, shape (samples, channels, parameters).

    They are moved on the samples of the fit, which may be fewer: between these it is what lies on a line.
    """
    problem = fitted.problem
    channels = len(problem.channels)
    moves = output_jacobian(problem, fitted.table, np.ones(channels))
    moves = moves.reshape(moves.shape[0] // channels, channels, moves.shape[1])  # no column where all is fixed
    parts = np.split(moves, np.cumsum([few.time.size for few in problem.runs])[:-1])
    return np.concatenate([
        make_interp_spline(few.time, part, k=1)(np.clip(run.time, few.time[0], few.time[-1])) if part.size
        else np.empty((run.time.size, *part.shape[1:]))
        for few, run, part in zip(problem.runs, runs, parts, strict=True)
    ])  # fmt: skip


def families_of(
    verdict: str, effects: Sequence[str], equivalent: Sequence[str], evidence: Sequence[FamilyShare], channel: str,
    closest: Sequence[str] = (),
) -> tuple[Family, ...]:  # fmt: skip
    """Families of what is missing, most telling first; empty where nothing is, or nothing can be said.

    Of named effects and of those that cannot be told apart it is what their files say; of an unknown one the family
    whose laws predict most of the residual, those whose laws predict nearly as much, and those of the effects that come
    closest, refitted with the model: what follows a parameter of the model the residual alone may not show.

    Parameters
    ----------
    verdict : str
    effects, equivalent : sequence of str
        Named effects, and those of a set that these runs cannot tell apart.
    evidence : sequence of FamilyShare
        Most first.
    channel : str
        The one that the answer is about.
    closest : sequence of str
        Effects that close much of an unknown gap.
    """
    if effects or equivalent:
        return tuple(dict.fromkeys(about(spec).family for spec in (*effects, *equivalent)))
    shown = [e for e in evidence if e.channel == channel and e.share > FAMILY_SHARE] if verdict == "unknown" else []
    of_residual: list[Family] = [e.family for e in shown if e.share >= FAMILY_TIE_SHARE * shown[0].share]
    of_effects: list[Family] = [about(spec).family for spec in closest] if verdict == "unknown" else []
    return tuple(dict.fromkeys((*of_residual, *of_effects)))
