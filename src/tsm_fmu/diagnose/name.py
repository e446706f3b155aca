"""Naming: candidates refitted with the baseline, ranked by their gain, confirmed where they were not fitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..identify.problem import BoolArray, FitRun, FloatArray
from ..models.contract import InputError
from .candidates import Screened
from .study import Fitted, refit, rms

REFITTED = 5
"""Candidates of the linear step that are refitted."""
PLACES_EACH = 2
"""Places of one effect among these."""
EVIDENCE = 12.0
"""Score that a name needs."""
SAME = 0.1
"""Candidates that close the gap within this of the best cannot be told from it by this log."""
NUISANCE = ("presliding_shape", "offset_drift", "delay", "sensor_lag", "quantisation", "smooth_backlash")
"""What a baseline may have a little of without anything missing: shape after reversal, bias, latency, encoder steps."""
SMALL = 0.025
"""A nuisance effect is named if what it removes is more than this part of the channel's spread."""


@dataclass(frozen=True)
class Named:
    """A candidate after its refit.

    Attributes
    ----------
    spec : str
        Effect and place.
    fitted : Fitted
    score : float
        Twice the log likelihood gained over the baseline with effective samples, less the information criterion's
        cost of its parameters, less the gain on reference runs.
    closure_measured, closure_holdout : float or None
        Share of the removable gap that it closes.
    removed : float
        RMS of what it explains, as part of the channel's spread, largest over the channels.
    """

    spec: str
    fitted: Fitted
    score: float
    closure_measured: float | None
    closure_holdout: float | None
    removed: float

    @property
    def effect(self) -> str:
        return self.spec.partition("@")[0]

    @property
    def nuisance(self) -> bool:
        """Whether it is no more than a baseline's freedom."""
        return self.effect in NUISANCE and self.removed < SMALL

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the effect's own parameters."""
        name, _, channel = self.spec.partition("@")
        prefix = f"{channel}.{name}." if channel else f"{name}."
        return {n.removeprefix(prefix): v for n, v in self.fitted.values.items() if n.startswith(prefix)}


def likelihood_gain(before: Fitted, after: Fitted, counted: BoolArray) -> float:
    """Twice the log likelihood gained in the channels that count, each with the samples its residual is worth."""
    gain = before.effective * np.log(before.rmse**2 / np.maximum(after.rmse**2, 1e-300))
    return float(np.sum(gain[counted]))


def closure(before: FloatArray, after: FloatArray, floor: FloatArray, counted: BoolArray) -> float | None:
    """Share of the removable mean square that is gone, over the channels that had any; None without a gap."""
    removable = before**2 - floor**2
    open_ = counted & (removable > 0.02 * floor**2)
    if not open_.any():
        return None
    weight = 1.0 / floor[open_] ** 2
    return float(1.0 - np.sum(weight * (after[open_] ** 2 - floor[open_] ** 2)) / np.sum(weight * removable[open_]))


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """Best of the screened candidates, with no effect at more than a few places."""
    taken: dict[str, int] = {}
    found = []
    for s in screened:
        name = s.attached.module.NAME
        if s.excited and s.gain > 0.0 and taken.get(name, 0) < PLACES_EACH:
            taken[name] = taken.get(name, 0) + 1
            found.append(s)
    return found[:REFITTED]


def name(
    base: Fitted, screened: Sequence[Screened], holdout: Sequence[FitRun], floor: FloatArray,
    counted: BoolArray, reference_gain: Mapping[str, float], said: Callable[[str], None] = lambda _: None,
) -> list[Named]:  # fmt: skip
    """Refit the best of the screened candidates; best score first.

    Parameters
    ----------
    base : Fitted
    screened : sequence of Screened
        Best first.
    holdout : sequence of FitRun
    floor : ndarray, shape (channels,)
    counted : ndarray of bool, shape (channels,)
        Channels whose gap counts.
    reference_gain : mapping of str to float
        What each candidate gains on runs without any missing effect.
    said : callable
        Told what is being done.
    """
    results = []
    held = rms(base.judged_on(holdout)) if holdout else None
    own = base.table[:, [base.problem.fields.index(f) for f in base.problem.own]]
    fixed = [v.name for v in base.problem.kernel.parameters if v.name not in base.free]
    for s in shortlist(screened):
        said(f"refit with {s.attached.spec}")
        try:
            fitted = refit(
                base.model, [*base.effects, s.attached.spec], base.problem.runs, base.problem.channels,
                values={**base.values, **s.values}, fixed=fixed, weights=base.problem.weights, starts=own,
            )  # fmt: skip
        except InputError:
            continue  # the values of the linear step are not allowed in the chain
        cost = len(s.values) * float(np.log(np.sum(base.effective)))
        score = likelihood_gain(base, fitted, counted) - cost - reference_gain.get(s.attached.spec, 0.0)
        removed = np.sqrt(np.maximum(base.rmse**2 - fitted.rmse**2, 0.0)) / np.maximum(base.spread, 1e-300)
        held_after = closure(held, rms(fitted.judged_on(holdout)), floor, counted) if held is not None else None
        measured = closure(base.rmse, fitted.rmse, floor, counted)
        results.append(Named(s.attached.spec, fitted, score, measured, held_after, float(removed[counted].max())))
    return arbitrated(sorted(results, key=lambda r: -r.score))


def arbitrated(results: list[Named]) -> list[Named]:
    """The same with held-out runs as arbiter: of candidates that fit alike, the one that clearly predicts better leads.

    Parameters
    ----------
    results : list of Named
        Best score first.
    """
    lead = results[0] if results else None
    for other in results[1:]:
        if lead is None or lead.closure_holdout is None or other.closure_holdout is None or not confirmed(other):
            continue
        alike = (lead.closure_measured or 0.0) - (other.closure_measured or 0.0) < SAME
        if alike and other.closure_holdout > lead.closure_holdout + SAME:
            lead = other
    return [lead, *(r for r in results if r is not lead)] if lead is not None else results


def confirmed(one: Named) -> bool:
    """Whether a candidate has the evidence that a name takes, on the measured and on the held-out runs."""
    return one.score > EVIDENCE and (one.closure_holdout is None or one.closure_holdout > 0.0)


def rivals(results: Sequence[Named]) -> list[Named]:
    """Candidates of another name that this log cannot tell from the best one."""
    best = results[0]
    found: list[Named] = []
    for other in results[1:]:
        if _reduces(other, best):
            continue
        if other.effect in {best.effect, *(f.effect for f in found)} or not confirmed(other) or other.nuisance:
            continue
        near = [
            (a or 0.0) - (b or 0.0) < SAME
            for a, b in (
                (best.closure_measured, other.closure_measured),
                (best.closure_holdout, other.closure_holdout),
            )
        ]
        if all(near):
            found.append(other)
    return found


def _reduces(other: Named, best: Named) -> bool:
    """Whether a wider law has shrunk to the best one: drive_direction without its drive part is load_dependence."""
    if (best.effect, other.effect) != ("load_dependence", "drive_direction"):
        return False
    return abs(other.parameters["k_m"]) < 0.2 * abs(other.parameters["k_e"])
