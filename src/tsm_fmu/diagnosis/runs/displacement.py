"""Motions of a measured position: speeds whose steps are its steps, and positions without those of an encoder.

A model that is driven by its speed takes v dt for what the drive has moved, and its presliding state lives on that. A
differentiator rounds each reversal off, and a measured speed at a few samples a reversal misses it: then the model is
blamed for what the speed has lost. So where a log holds the position, and this has no noise but the steps of its
encoder, the speed of a step is what the position has moved in it. Between the encoder's steps the position is the
smoothest that they allow, where it drives a model too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...logs.differentiate import differentiate
from ...logs.quantisation import quantisation_step
from ...logs.record import Record
from ...logs.within_steps import smoothest_within_steps
from ...regression.problem import FitRun
from ...regression.residuals import white_noise
from ..criteria import DITHER_SHARE, POSITION_NOISE_SHARE
from .drivers import position_column

SPEED, ACCELERATION = "v", "a"
FEWEST = 8
"""Samples of a position of which it can be said whether it has noise."""


def with_speeds_of_position(
    model: Kernel, records: Sequence[Record], cutoff: float | None
) -> tuple[list[Record], tuple[str, ...]]:
    """Records whose speed is that of the steps between their positions, and what is said of them.

    Parameters
    ----------
    model : Kernel
        Those of one that is not driven by its speed stay as they are.
    records : sequence of Record
        As do those without a position, or with one that has noise.
    cutoff : float or None
        Of the differentiator [Hz], if the user chose one: then the speed is derived with it.
    """
    if model.motion != SPEED or cutoff is not None:
        return list(records), ()
    name = position_column(model, records)
    if name is None or not all(_clean(record.columns[name]) for record in records if name in record.columns):
        return list(records), ()
    found = [_with_speed_of(model, r, name) if name in r.columns else r for r in records]
    return found, (f"{SPEED} is what {name} has moved in each sample: reversals are not rounded off",)


def _with_speed_of(model: Kernel, record: Record, name: str) -> Record:
    """A record with the speed of a position, and its acceleration where the model takes one that is not there."""
    x, unit, time = record.columns[name], record.units[name], record.time
    smooth = between_steps(time, x)
    columns = {**record.columns, SPEED: np.append(0.0, np.diff(smooth) / np.diff(time))}
    units = {**record.units, SPEED: f"{unit}/s"}
    if ACCELERATION in [v.name for v in model.inputs] and ACCELERATION not in record.columns:
        columns[ACCELERATION] = (
            differentiate(time, x, 2, first_row=record.first_row).values if smooth is x
            else np.gradient(np.gradient(smooth, time), time)
        )  # fmt: skip
        units[ACCELERATION] = f"{unit}/s2"
    return replace(record, columns=columns, units=units)


def with_position_between_steps(model: Kernel, run: FitRun) -> FitRun:
    """A run of a model that is driven by a position, which is as smooth as the steps of its encoder allow."""
    column, step = _read_in_steps(model, run)
    if step == 0.0:
        return run
    inputs = run.inputs.copy()
    inputs[:, column] = smoothest_within_steps(run.time, inputs[:, column], step)
    return replace(run, inputs=inputs)


def position_notes(model: Kernel, runs: Sequence[FitRun]) -> Iterator[str]:
    """What a user should know of it."""
    if any(_read_in_steps(model, run)[1] for run in runs):
        yield f"{model.motion} is taken for the smoothest motion within the steps of its encoder"


def _read_in_steps(model: Kernel, run: FitRun) -> tuple[int, float]:
    """Column of the position that drives a model, and the steps it is read in; 0 without any, or with noise besides."""
    if not model.motion or model.motion == SPEED:
        return 0, 0.0
    column = [v.name for v in model.inputs].index(model.motion)
    x = run.inputs[:, column]
    return column, quantisation_step(x) if x.size >= FEWEST and _clean(x) else 0.0


def between_steps(time: FloatArray, x: FloatArray) -> FloatArray:
    """A position as smooth as the steps of its encoder allow; as it is where it has none."""
    step = quantisation_step(x)
    return smoothest_within_steps(time, x, step) if step > 0.0 else x


def _clean(x: FloatArray) -> bool:
    """Whether a position has no noise but the steps of its encoder: it does not dither, and its steps are smooth."""
    moved = np.diff(x)
    back = moved[1:] * moved[:-1] < 0.0
    coarse = max(quantisation_step(x), POSITION_NOISE_SHARE * float(np.sqrt(np.mean(moved**2))))
    return float(np.mean(back[1:] & back[:-1])) < DITHER_SHARE and bool(white_noise(x) <= coarse)
