"""Candidates as a user sees them: one row for each effect that was refitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.chain import id_of
from ...regression.problem import FloatArray
from ..fits.refit import Fitted
from .floors import Floors
from .hypotheses import Hypothesis
from .supported import Choice, left

DECIBEL = 10.0 / np.log(10.0)


@dataclass(frozen=True)
class Candidate:
    """A candidate after its refit.

    Attributes
    ----------
    spec : str
        Effect and place, ``id`` or ``id@channel``.
    fitted : Fitted
    score : float
        What it removes, beyond the refitted baseline with its nuisance freedom [dB of the mean square, all channels
        together, the mean of measured and held-out runs].
    closure_measured, closure_holdout : float or None
        Share of the removable gap that it closes, from the refitted baseline on.
    parameters : dict of str to float
        Values of its own parameters.
    """

    spec: str
    fitted: Fitted
    score: float
    closure_measured: float | None
    closure_holdout: float | None
    parameters: dict[str, float]

    @property
    def effect(self) -> str:
        return id_of(self.spec)


def candidates_of(
    hypotheses: Sequence[Hypothesis], choice: Choice, plain: Hypothesis, floors: Floors
) -> tuple[Candidate, ...]:
    """Best candidates first: each effect alone, and those of the answer; without one, above what is surely noise."""
    start, found = hypotheses[0], {}
    answered = not floors.unexplained.any()
    noise = floors.noise if answered else floors.least
    rows = [(spec, choice.winner) for spec in choice.winner.effects if answered]
    rows += [(spec, start) for spec in start.material]
    rows += [(h.added[0], h) for h in sorted(hypotheses, key=left) if len(h.added) == 1]
    for spec, one in rows:
        if spec in found:
            continue
        held = None
        if one.held is not None and plain.held is not None:
            held = closure(plain.held, one.held, noise)
        compared = plain if spec in one.material else start
        score = DECIBEL * (left(compared) - left(one))
        measured = closure(plain.measured, one.measured, noise)
        found[spec] = Candidate(spec, one.fitted, score, measured, held, one.parameters(spec))
    return tuple(sorted(found.values(), key=lambda c: -c.score))


def closure(before: FloatArray, after: FloatArray, noise: FloatArray) -> float | None:
    """Share of the removable mean square that is gone, over the channels that had any; None without a gap.

    Parameters
    ----------
    before, after : ndarray, shape (channels,)
        Mean squares.
    noise : ndarray, shape (channels,)
        Floors [RMS].
    """
    removable = before - noise**2
    open_ = removable > 0.02 * noise**2
    if not open_.any():
        return None
    weight = 1.0 / noise[open_] ** 2
    return float(1.0 - np.sum(weight * (after[open_] - noise[open_] ** 2)) / np.sum(weight * removable[open_]))
