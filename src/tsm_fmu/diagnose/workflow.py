"""From runs and a model to a diagnosis: gate, floors, baseline, locate, name, add."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..effects import EFFECTS
from ..identify.problem import BoolArray, FitRun, FloatArray
from ..identify.specification import fit_run, measured_channels
from ..kernel import Kernel, kernel
from ..record import Record
from .candidates import Screened, places_of, possible, screen
from .floors import repeats_floor, white_floor
from .gate import Gate, gate
from .locate import Place, locate
from .name import EVIDENCE, Named, closure, confirmed, likelihood_gain, name, rivals
from .structure import predictable_share
from .study import Fitted, as_given, motion_channel, refit, rms, thinned

MOST_EFFECTS = 3
STRUCTURE = 0.08
"""Share of a residual that must be predictable to call it a law and not noise."""
MATERIAL = 0.015
"""A gap below this part of a channel's spread is within the form of any friction model, not a missing effect."""
EXPLAINED = 0.7
"""Share of the removable gap that named effects must close together; less, and the answer is unknown."""
ALIKE = {"thermal": ("wear",), "wear": ("thermal",)}
"""Effects that only a repeat after a rest tells apart, which this workflow does not look for yet: always a set."""
WORTH = 0.15
"""Share of the remaining gap that one more effect must close."""


@dataclass(frozen=True)
class Diagnosis:
    """What was found; see `diagnose`.

    Attributes
    ----------
    verdict : str
        ``named``, ``ambiguous``, ``unknown``, ``none``, ``parameters`` or ``not_excited``.
    effects : tuple of str
        Named effects as ``id`` or ``id@channel``, in the order added.
    equivalent : tuple of tuple of str
        Sets of ids that these runs cannot tell apart.
    not_excited : tuple of str
        Ids of effects that these runs could not show.
    candidates : tuple of Named
        After their joint refit with the baseline, best first.
    where : tuple of Place
        Of the refitted baseline's residual (of the given model's where the refit closes the gap).
    gate : Gate
    given, baseline, final : Fitted or None
        The model as given, refitted, and with the effects of the answer; on thinned runs.
    floor : ndarray, shape (channels,)
    reference_floor : ndarray or None
        Gap on reference runs, after the same refit.
    share : ndarray, shape (channels,)
        Share of the refitted baseline's residual that is a law of the coordinates.
    runs, holdout : list of FitRun
        All samples.
    notes : tuple of str
        What else a user should know.
    """

    verdict: str
    effects: tuple[str, ...]
    equivalent: tuple[tuple[str, ...], ...]
    not_excited: tuple[str, ...]
    candidates: tuple[Named, ...]
    where: tuple[Place, ...]
    gate: Gate
    channels: tuple[str, ...]
    given: Fitted | None = None
    baseline: Fitted | None = None
    final: Fitted | None = None
    floor: FloatArray = field(default_factory=lambda: np.empty(0))
    reference_floor: FloatArray | None = None
    share: FloatArray = field(default_factory=lambda: np.empty(0))
    runs: Sequence[FitRun] = ()
    holdout: Sequence[FitRun] = ()
    notes: tuple[str, ...] = ()


def diagnose(
    model: Kernel, measured: Sequence[Record], *, values: Mapping[str, float] | None = None, preset: str | None = None,
    fixed: Sequence[str] = (), reference: Sequence[Record] = (), holdout: Sequence[Record] = (),
    cutoff: float | None = None, seed: int = 0, said: Callable[[str], None] = lambda _: None,
) -> Diagnosis:  # fmt: skip
    """Find where model and measurement disagree, and which effect is missing.

    Parameters
    ----------
    model : Kernel
        Of `kernel` or `chain`.
    measured, reference, holdout : sequence of Record
        Runs with the gap; runs of the same rig without the missing effect; runs that confirm a name.
    values : mapping of str to float, optional
        Parameters by public name, SI.
    preset : str, optional
        Parameter set for the others.
    fixed : sequence of str
        Parameters that a refit keeps.
    cutoff : float, optional
        Of the differentiator [Hz], where v and a are derived.
    seed : int
    said : callable
        Told what is being done.

    Raises
    ------
    InputError
        Runs that do not fit the model, values from which it cannot run, a held-out run that is too short.
    """
    records = [*measured, *reference, *holdout]
    channels = measured_channels(model, records)
    everything = [fit_run(model, record, channels, cutoff) for record in records]
    runs, held = everything[: len(measured)], everything[len(measured) + len(reference) :]
    references = everything[len(measured) : len(measured) + len(reference)]
    said("gate")
    passed = gate(measured, model, channels)
    effects = tuple(getattr(model.module, "EFFECTS", ()))
    if passed.refused:
        ids = tuple(m.NAME for m in EFFECTS)
        return Diagnosis("not_excited", (), (), ids, (), (), passed, channels, runs=runs, holdout=held)
    work = _Work(model, effects, channels, dict(values or {}), preset, tuple(fixed), seed, said)
    return work.on(passed, runs, references, held)


@dataclass(frozen=True)
class _Work:
    model: Kernel
    effects: tuple[str, ...]
    channels: tuple[str, ...]
    values: dict[str, float]
    preset: str | None
    fixed: tuple[str, ...]
    seed: int
    said: Callable[[str], None]

    def on(self, passed: Gate, runs: list[FitRun], references: list[FitRun], held: list[FitRun]) -> Diagnosis:
        few, few_held = thinned(runs), thinned(held) if held else []
        self.said("model as given")
        given = as_given(self.model.name, self.effects, few, self.channels, self.values, self.preset)
        self.said("refit of the baseline")
        base = self._baseline(few, given)
        share = predictable_share(base.residuals, places_of(base))
        repeats = repeats_floor(runs)
        floor = self._floor(base, share, repeats, runs)
        reference_floor, reference_gain, calm = None, {}, None
        if references:
            self.said("reference runs")
            calm = self._baseline(thinned(references), given)
            reference_floor = calm.rmse
            floor = np.maximum(floor, reference_floor)
        counted = self._open(base, floor, share, repeats)
        candidates = possible(self.model.name, self.channels, self.effects, [v.name for v in self.model.inputs])
        screened = screen(base, candidates, floor, counted, self.said)
        not_excited = self._not_excited(screened)
        if calm is not None and counted.any():
            gains = screen(calm, candidates, calm.rmse, counted, self.said)
            reference_gain = {s.attached.spec: max(0.0, s.gain) for s in gains}
        result = Diagnosis(
            "none", (), (), not_excited, (), (), passed, self.channels, given, base, base, floor, reference_floor,
            share, runs, held, self._notes(base),
        )  # fmt: skip
        if not counted.any():
            everywhere = np.ones(len(self.channels), bool)
            moved = np.sqrt(np.maximum(given.rmse**2 - base.rmse**2, 0.0)) > 0.5 * MATERIAL * base.spread
            gain = likelihood_gain(given, base, everywhere) - len(base.problem.shared) * np.log(base.effective.sum())
            if moved.any() and gain > EVIDENCE:
                return replace(result, verdict="parameters", where=self._where(given))
            return replace(result, final=given)
        where = self._where(base)
        found = self._named(base, screened, few_held, floor, counted, reference_gain)
        return self._answer(replace(result, where=where), found, floor, counted)

    def _baseline(self, runs: list[FitRun], given: Fitted) -> Fitted:
        own = None
        if len(runs) == given.table.shape[0]:
            own = given.table[:, [given.problem.fields.index(f) for f in given.problem.own]]
        first = refit(
            self.model.name, self.effects, runs, self.channels, values=self.values, preset=self.preset,
            fixed=self.fixed, starts=own,
        )  # fmt: skip
        if len(self.channels) < 2:
            return first
        weights = 1.0 / np.maximum(first.rmse, 1e-6 * first.spread)
        own = first.table[:, [first.problem.fields.index(f) for f in first.problem.own]]
        return refit(
            self.model.name, self.effects, runs, self.channels, values=first.values, preset=self.preset,
            fixed=self.fixed, weights=weights, starts=own,
        )  # fmt: skip

    def _floor(self, base: Fitted, share: FloatArray, repeats: FloatArray | None, runs: list[FitRun]) -> FloatArray:
        """From repeats; without any, what the coordinates cannot predict, and never less than white noise."""
        unpredicted = base.rmse * np.sqrt(np.clip(1.0 - share, 0.0, 1.0))
        if repeats is not None:
            return np.maximum(np.minimum(repeats, base.rmse), 1e-9 * base.spread)
        return np.clip(unpredicted, np.minimum(white_floor(runs), base.rmse), base.rmse)

    def _open(self, base: Fitted, floor: FloatArray, share: FloatArray, repeats: FloatArray | None) -> BoolArray:
        """Channels with a gap that is above the floor, large enough to matter, and a law."""
        gap = np.sqrt(np.maximum(base.rmse**2 - floor**2, 0.0))
        lawful = (share > STRUCTURE) | ((gap > base.rmse * 0.7) if repeats is not None else False)
        return (gap > MATERIAL * base.spread) & lawful

    def _named(
        self, base: Fitted, screened: list[Screened], held: list[FitRun], floor: FloatArray, counted: BoolArray,
        reference_gain: dict[str, float],
    ) -> _Found:  # fmt: skip
        current, added, first = base, [], []
        candidates = possible(self.model.name, self.channels, self.effects, [v.name for v in self.model.inputs])
        for round_ in range(MOST_EFFECTS):
            if round_:
                left = [c for c in candidates if c.spec not in current.effects]
                screened = screen(current, left, floor, counted, self.said)
            results = name(current, screened, held, floor, counted, reference_gain, self.said)
            first = first or results
            if not results or not confirmed(results[0]) or (results[0].closure_measured or 0.0) < WORTH:
                break
            ids = (results[0].effect, *(r.effect for r in rivals(results)))
            ids += tuple(e for e in ALIKE.get(ids[0], ()) if e not in ids)
            if len(ids) > 1:
                return _Found(current, added, first, ids, results[0])
            added.append(results[0])
            current = results[0].fitted
            remaining = predictable_share(current.residuals, places_of(current))
            if not self._open(current, floor, remaining, None).any():
                break
        return _Found(current, added, first, (), None)

    def _answer(self, result: Diagnosis, found: _Found, floor: FloatArray, counted: BoolArray) -> Diagnosis:
        base = result.baseline
        assert base is not None
        reached = np.minimum(floor, found.current.rmse)  # the floor cannot be above what was reached
        result = replace(result, candidates=tuple(found.candidates), final=found.current, floor=reached)
        kept = [a for a in found.added if not a.nuisance]
        closed = closure(base.rmse, found.current.rmse, floor, counted) or 0.0
        if found.equivalent and found.best is not None:
            whole = closure(base.rmse, found.best.fitted.rmse, floor, counted) or 0.0
            verdict = "ambiguous" if whole >= EXPLAINED else "unknown"
            equivalent = (tuple(found.equivalent),)
            return replace(result, verdict=verdict, equivalent=equivalent, final=found.best.fitted)
        if found.added and not kept and closed >= EXPLAINED:
            return replace(result, verdict="parameters")
        if kept and closed >= EXPLAINED:
            kept = [a for a in kept if self._needed(found.current, a, counted)]
            if kept:
                return replace(result, verdict="named", effects=tuple(a.spec for a in kept))
        return replace(result, verdict="unknown", final=base)

    def _needed(self, final: Fitted, one: Named, counted: BoolArray) -> bool:
        """Whether the model is worse without an effect that was added, after a refit."""
        others = [e for e in final.effects if e != one.spec]
        if len(others) == len(self.effects):
            return True  # it was tested when it was added
        self.said(f"refit without {one.spec}")
        own = final.table[:, [final.problem.fields.index(f) for f in final.problem.own]]
        without = refit(
            self.model.name, others, final.problem.runs, self.channels, values=final.values,
            fixed=self.fixed, weights=final.problem.weights, starts=own,
        )  # fmt: skip
        return likelihood_gain(without, final, counted) > EVIDENCE

    def _where(self, fitted: Fitted) -> tuple[Place, ...]:
        self.said("locate")
        base = kernel(self.model.name)
        units = {v.name: v.quantity.unit for v in (*base.inputs, *base.outputs)}
        unit = units.get(motion_channel(base), "1").removesuffix("/s")
        load = units.get(getattr(base.module, "LOAD", ""), "1")
        return tuple(locate(fitted.residuals, places_of(fitted), self.channels, unit, load, self.seed))

    def _not_excited(self, screened: Sequence[Screened]) -> tuple[str, ...]:
        visible: dict[str, bool] = {m.NAME: False for m in EFFECTS}
        for s in screened:
            visible[s.attached.module.NAME] |= s.excited
        already = {e.partition("@")[0] for e in self.effects}
        return tuple(n for n, seen in visible.items() if not seen and n not in already)

    def _notes(self, base: Fitted) -> tuple[str, ...]:
        notes = []
        for field_ in base.problem.shared:
            p, value = base.problem.parameters[field_], base.table[0, base.problem.fields.index(field_)]
            width = p.max - p.min
            near = 1e-4 * width if np.isfinite(width) else 1e-6 * max(1.0, abs(value))
            if value - p.min < near or p.max - value < near:
                notes.append(f"the refit stopped at a bound of {base.problem.declared[field_].name} ({value:g})")
        return tuple(notes)


@dataclass(frozen=True)
class _Found:
    current: Fitted
    added: list[Named]
    candidates: list[Named]
    equivalent: Sequence[str]
    best: Any


def held_out_rmse(fitted: Fitted, runs: Sequence[FitRun]) -> FloatArray | None:
    """Pooled RMSE on held-out runs, by channel; None without any."""
    return rms(fitted.judged_on(runs)) if runs else None
