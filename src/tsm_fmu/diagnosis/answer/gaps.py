"""The gap of each channel before and after, at the full sampling of the runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.arrays import BoolArray, FloatArray
from ...regression.problem import FitRun
from ...regression.residuals import rms
from ..choice.floors import Floors
from ..criteria import GAP_FLOOR_SHARE
from ..evidence import Gap
from ..fits.refit import Fitted

RESAMPLES = 500


@dataclass(frozen=True)
class Errors:
    """A fit's residuals at full sampling.

    Attributes
    ----------
    measured, holdout : tuple of ndarray, shape (n, channels)
        One array a run; ``holdout`` is empty without held-out runs.
    """

    measured: tuple[FloatArray, ...]
    holdout: tuple[FloatArray, ...]

    @property
    def validation(self) -> tuple[FloatArray, ...]:
        """On held-out runs, if there are any."""
        return self.holdout or self.measured

    @property
    def rms(self) -> FloatArray:
        """On measured runs, shape (channels,)."""
        return rms(self.measured)

    @property
    def rms_holdout(self) -> FloatArray | None:
        """On held-out runs, shape (channels,)."""
        return rms(self.holdout) if self.holdout else None


def errors_of(fitted: Fitted, runs: Sequence[FitRun], holdout: Sequence[FitRun]) -> Errors:
    """Residuals of a fit on all samples of the runs."""
    return Errors(tuple(fitted.at(runs).residuals), tuple(fitted.held_out_errors(holdout)) if holdout else ())


def gaps(
    channels: Sequence[str], units: Sequence[str], given: Errors, refitted: Errors, final: Errors, floors: Floors,
    threshold: FloatArray, elsewhere: BoolArray, *, with_effects: bool,
) -> dict[str, Gap]:  # fmt: skip
    """Gap of each channel.

    Parameters
    ----------
    channels, units : sequence of str
    given, refitted, final : Errors
        Of the model as given, with other parameter values, and of the answer.
    floors : Floors
    threshold : ndarray, shape (channels,)
        RMS that an effect must remove to be named.
    elsewhere : ndarray of bool, shape (channels,)
        Where only held-out runs show a gap.
    with_effects : bool
        Whether the answer adds effects: what they close is counted from the refit, which is not theirs.
    """
    start, found = (refitted if with_effects else given), {}
    stages = [(e.rms, e.rms_holdout) for e in (given, refitted, final)]
    for c, channel in enumerate(channels):
        (before, out_before), (by_refit, out_by_refit), (after, out_after) = (
            (float(m[c]), None if h is None else float(h[c])) for m, h in stages
        )
        reference = None if floors.reference is None else float(floors.reference[c])
        # thinned runs gave the floors; of all samples noise is no more than what a fit leaves of them
        most = min(by_refit, after) if reference is None else np.inf
        floor, least = min(float(floors.noise[c]), most), min(float(floors.least[c]), most)
        one, two = ([r[:, c] for r in e.validation] for e in (start, final))
        found[channel] = Gap(
            unit=units[c], before=before, after=after, holdout_before=out_before, holdout_after=out_after,
            floor=floor, floor_least=least, closure=_closure(one, two, floor), closure_least=_closure(one, two, least),
            closure_interval=_interval(one, two, floor), refitted=by_refit, holdout_refitted=out_by_refit,
            threshold=float(threshold[c]), reference=reference, unexplained=bool(floors.unexplained[c]),
            elsewhere=bool(elsewhere[c]),
        )  # fmt: skip
    return found


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
    open_ = removable > GAP_FLOOR_SHARE * noise**2
    if not open_.any():
        return None
    weight = 1.0 / np.maximum(noise[open_] ** 2, 1e-12 * before[open_])  # few levels may leave no noise at all
    return float(1.0 - np.sum(weight * (after[open_] - noise[open_] ** 2)) / np.sum(weight * removable[open_]))


def _closure(before: Sequence[FloatArray], after: Sequence[FloatArray], floor: float) -> float | None:
    one, two = (np.array([float(np.mean(np.concatenate(r) ** 2))]) for r in (before, after))
    return closure(one, two, np.array([floor]))


def _interval(before: Sequence[FloatArray], after: Sequence[FloatArray], floor: float) -> tuple[float, float] | None:
    """90 % bootstrap interval over runs; None with fewer than three."""
    if len(before) < 3 or _closure(before, after, floor) is None:
        return None
    rng = np.random.default_rng(0)
    sums = np.array([[np.sum(a**2), np.sum(b**2), a.size] for a, b in zip(before, after, strict=True)])
    resampled = sums[rng.integers(0, len(before), (RESAMPLES, len(before)))].sum(axis=1)
    gap, remaining = resampled[:, 0] / resampled[:, 2] - floor**2, resampled[:, 1] / resampled[:, 2] - floor**2
    low, high = np.quantile(1.0 - remaining[gap > 0.0] / gap[gap > 0.0], [0.05, 0.95])
    return float(low), float(high)
