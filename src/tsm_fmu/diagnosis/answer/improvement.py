"""The way to a better model in numbers and words: its steps, the zeros of the runs, and the card at its end."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ...card import RecordUsed
from ...effects import words
from ...kernels.arrays import FloatArray
from ...logs.display import display
from ...regression.held_out import SETTLING, is_settling, settled
from ...regression.problem import FitRun
from ...regression.residuals import rms
from ..choice.path import Stop
from ..criteria import ZERO_SHARE
from ..fits.refit import Fitted
from ..improved import ImprovedModel, ImprovementStep, RunZeros
from ..runs.prepared import PreparedRuns
from .parameters import card_of


def improvement_of(
    way: Sequence[Stop], runs: PreparedRuns, named: Collection[str], records: tuple[RecordUsed, ...], preset: str,
    seed: int,
) -> ImprovedModel:  # fmt: skip
    """The improved model.

    Parameters
    ----------
    way : sequence of Stop
    runs : PreparedRuns
    named : collection of str
        Effects that the diagnosis names, as ``id`` or ``id@channel``.
    records : tuple of RecordUsed
    preset : str
    seed : int
    """
    last = way[-1].fitted
    effects = tuple(e for e in last.effects if e not in runs.effects)
    steps = tuple(_step(stop, runs) for stop in way)
    zeros = tuple(z for z in _zeros(last, runs) if z is not None)
    not_named = tuple(e for e in effects if e not in named)
    text = " ".join([_gains_text(steps, last, not_named), *map(_zeros_text, zeros)])
    return ImprovedModel(text, effects, not_named, steps, zeros, card_of(last, records, preset, seed))


def _step(stop: Stop, runs: PreparedRuns) -> ImprovementStep:
    def by_channel(errors: FloatArray) -> Mapping[str, float]:
        return dict(zip(runs.channels, errors.tolist(), strict=True))

    held_out = by_channel(rms(stop.fitted.held_out_errors(runs.holdout))) if runs.holdout else {}
    return ImprovementStep(stop.added, by_channel(stop.whole), by_channel(stop.left_out_rms), held_out)


def _zeros(fitted: Fitted, runs: PreparedRuns) -> list[RunZeros | None]:
    """How far the zero of each channel moves; None where it hardly does."""
    problem = fitted.problem
    units = {v.name: v.quantity.unit for v in problem.kernel.outputs}
    offsets = [f for f in problem.per_run if problem.declared[f].name in problem.kernel.roles.offsets]
    residuals = fitted.at(runs.measured).residuals
    found: list[RunZeros | None] = []
    for c, channel in enumerate(runs.channels):
        constants = np.array([r[:, c].mean() for r in residuals])
        beside = float(np.sqrt(np.mean(np.concatenate([r[:, c] - r[:, c].mean() for r in residuals]) ** 2)))
        for f in offsets:
            if problem.declared[f].quantity.unit == units[channel]:
                own = fitted.table[:, problem.fields.index(f)]
                constants = constants + own - own.mean()
        scatter = float(np.std(constants, ddof=1))
        if scatter**2 < ZERO_SHARE * (scatter**2 + beside**2):
            found.append(None)
            continue
        common, own_zero = _held_out(fitted, runs.holdout, offsets, c) if runs.holdout else (None, None)
        by_run = dict(zip((run.name for run in runs.measured), constants.tolist(), strict=True))
        found.append(RunZeros(channel, units[channel], by_run, scatter, beside, common, own_zero))
    return found


def _held_out(fitted: Fitted, runs: Sequence[FitRun], offsets: Collection[str], column: int) -> tuple[float, float]:
    """RMS of held-out runs with the mean zero, and with that of their own first seconds."""
    problem = fitted.problem
    common, own = [], []
    for run in runs:
        early = is_settling(run)
        for found, fields in ((common, [f for f in problem.per_run if f not in offsets]), (own, problem.per_run)):
            row = settled(problem, fitted.table, run, fields)
            residual = (run.targets - problem.with_runs([run]).outputs(0, row))[:, column]
            found.append(residual[~early] - (residual[early].mean() if found is own else 0.0))
    return float(rms(common)), float(rms(own))


def _gains_text(steps: Sequence[ImprovementStep], fitted: Fitted, not_named: Sequence[str]) -> str:
    """What the improved model holds and what it is worth."""
    names = [name for s in steps[1:] for name in s.added.split(" and ")]
    added = [name for name in names if name in fitted.effects or " = " in name]  # a choice of the model is no effect
    if not added:
        return "For prediction: no effect makes runs that are left out of the fit come out better."
    units = {v.name: v.quantity.unit for v in fitted.problem.kernel.outputs}
    first, last = steps[0], steps[-1]
    held_out = bool(last.holdout)
    before, after = (first.holdout, last.holdout) if held_out else (first.left_out, last.left_out)
    numbers = []
    for channel, error in after.items():
        show = display(units[channel], before[channel])
        numbers.append(f"{channel} {show(before[channel]).removesuffix(f' {show.unit}')} -> {show(error)}")
    where = "on held-out runs" if held_out else "on runs left out in turn"
    text = f"For prediction: {', '.join(added)}; error {where}: {', '.join(numbers)}."
    if not_named:
        text += (
            f" Useful, not named: {', '.join(words(e) for e in not_named)}. They make runs that were not fitted come "
            "out better, which is no evidence that the rig has them."
        )
    return text


def _zeros_text(zeros: RunZeros) -> str:
    show = display(zeros.unit, zeros.scatter)
    text = (
        f"The zero of {zeros.channel} moves from run to run by {show(zeros.scatter, 2)} (standard deviation over "
        f"{len(zeros.by_run)} runs: re-engagement, or slip); {show(zeros.beside)} remain beside it."
    )
    if zeros.holdout_common is not None and zeros.holdout_own is not None:
        text += (
            f" A held-out run: {show(zeros.holdout_common)} where its zero is not known, {show(zeros.holdout_own)} "
            f"with the zero of its first {SETTLING:g} s."
        )
    return text
