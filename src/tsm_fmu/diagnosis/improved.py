"""The improved model as plain data: what predicts better, named or not. Quantities are in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..card import ModelCard


@dataclass(frozen=True)
class ImprovementStep:
    """The model after one step of the way.

    Attributes
    ----------
    added : str
        Effect as ``id`` or ``id@channel``, ``parameter = value`` of a choice of the model, or ``without`` an effect;
        empty at the start.
    measured, left_out, holdout : mapping of str to float
        RMS by channel: on all samples of the measured runs, on runs left out of the fit in turn, on held-out runs
        (empty without).
    """

    added: str
    measured: Mapping[str, float]
    left_out: Mapping[str, float]
    holdout: Mapping[str, float]


@dataclass(frozen=True)
class RunZeros:
    """How far the zero of one channel moves from run to run, beside the improved model.

    Attributes
    ----------
    channel, unit : str
    by_run : mapping of str to float
        The constant of each measured run: what is on average measured beyond the model without offsets of runs.
    scatter : float
        Standard deviation of these constants.
    beside : float
        RMS that is left beside them.
    holdout_common, holdout_own : float or None
        RMS on held-out runs after their first 2 s: with the mean zero, and with the zero of those 2 s.
    """

    channel: str
    unit: str
    by_run: Mapping[str, float]
    scatter: float
    beside: float
    holdout_common: float | None = None
    holdout_own: float | None = None


@dataclass(frozen=True)
class ImprovedModel:
    """The end of the way from the plain model to one that predicts.

    Attributes
    ----------
    text : str
        What it holds, what it is worth and what its zeros do, in sentences.
    effects : tuple of str
        All that was added, as ``id`` or ``id@channel``.
    not_named : tuple of str
        Those that the diagnosis does not name: useful, but other laws might do as well.
    steps : tuple of ImprovementStep
    zeros : tuple of RunZeros
        Channels whose zero moves notably.
    model : ModelCard
    """

    text: str
    effects: tuple[str, ...]
    not_named: tuple[str, ...]
    steps: tuple[ImprovementStep, ...]
    zeros: tuple[RunZeros, ...]
    model: ModelCard
