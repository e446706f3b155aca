"""From runs and a model to a diagnosis: gate, floors, baseline, locate, name, add."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..effects import EFFECTS
from ..effects.coordinates import ANGLE
from ..kernels.chain import id_of
from ..kernels.chain_source import Attached
from ..kernels.kernel import Kernel, kernel
from ..logs.record import Record
from ..regression.problem import FitRun, FloatArray
from ..regression.specification import fit_run, measured_channels
from ..regression.threads import together
from .choice.floors import Floors, floors_of, open_channels
from .choice.hypotheses import (
    Hypothesis,
    foldable,
    folded,
    hypothesis,
    interleaved,
    probed,
    rivals_again,
    tried,
    with_fit,
)
from .choice.passivity import sign_notes
from .choice.patches import without_patches
from .choice.summary import Candidate, candidates_of
from .choice.supported import MATERIAL, Choice, chosen, fewer_again, indistinct, leading, left
from .choice.visibility import unexcited
from .fits.nuisance import Start, earned, freed, freedoms, untied, without
from .fits.quantised import Levels, coarse, step_noise, with_levels
from .fits.refit import Fitted, Task, as_given, refit
from .fits.response import places_of
from .fits.screening import possible, screen
from .residual.locate import Place, locate
from .runs.beginning import beginning_note, compared
from .runs.gate import Gate, gate
from .runs.motion_signals import coordinates_of
from .runs.sheath_angle import listening
from .runs.thinning import motion_channel, searched

MOST_EFFECTS = 3
SECOND = 4
"""Candidates refitted on top of each effect that is there."""
FOLDED = 6
"""Best hypotheses that are judged by runs left out in turn."""
SWAPPED = 4
"""First effects tried again beside a second one: the best alone need not be one of two."""
PRESLIDING = (3e-4, 0.02, 0.1)
"""Shortest, usual and longest presliding distance that the effects see, as part of the longest stroke."""
NEGLIGIBLE = 0.002
"""A nuisance freedom that does less than this part of a channel's spread is left out of the answer's model."""


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
    candidates : tuple of Candidate
        After their joint refit with the baseline, best first.
    where : tuple of Place
        Of the refitted baseline's residual (of the given model's where the refit closes the gap).
    gate : Gate
    given, baseline, final : Fitted or None
        The model as given, refitted, and with the effects of the answer; on thinned runs.
    floor, floor_least : ndarray, shape (channels,)
        See `floors.Floors`.
    reference_floor : ndarray or None
        Gap on reference runs, after the same refit.
    runs, holdout : list of FitRun
        All samples.
    notes : tuple of str
        What else a user should know.
    """

    verdict: str
    effects: tuple[str, ...]
    equivalent: tuple[tuple[str, ...], ...]
    not_excited: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    where: tuple[Place, ...]
    gate: Gate
    channels: tuple[str, ...]
    given: Fitted | None = None
    baseline: Fitted | None = None
    final: Fitted | None = None
    floor: FloatArray = field(default_factory=lambda: np.empty(0))
    floor_least: FloatArray = field(default_factory=lambda: np.empty(0))
    reference_floor: FloatArray | None = None
    runs: Sequence[FitRun] = ()
    holdout: Sequence[FitRun] = ()
    notes: tuple[str, ...] = ()

    @property
    def ids(self) -> list[str]:
        """Ids of the named effects, in the order added."""
        return [id_of(spec) for spec in self.effects]

    @cached_property
    def unplaced(self) -> tuple[str, ...]:
        """Those not excited that have no place in the model with these channels: nothing can be said of them."""
        if self.given is None:
            return ()
        inputs = [v.name for v in self.given.problem.kernel.inputs]
        placed = {a.module.NAME for a in possible(self.given.model, self.channels, (), inputs)}
        return tuple(e for e in self.not_excited if e not in placed)

    @property
    def hidden(self) -> tuple[str, ...]:
        """The others of them: these runs could not show them."""
        return tuple(e for e in self.not_excited if e not in self.unplaced)

    @property
    def answered(self) -> set[str]:
        """Ids that the answer holds: named, or in a set."""
        return {*self.ids}.union(*self.equivalent)


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
    model, said_of_angle = listening(model, records)
    channels = measured_channels(model, records)
    everything = [compared(model, fit_run(model, record, channels, cutoff), channels) for record in records]
    runs, held = everything[: len(measured)], everything[len(measured) + len(reference) :]
    references = everything[len(measured) : len(measured) + len(reference)]
    said("gate")
    passed = gate(measured, model, channels)
    effects = tuple(getattr(model.module, "EFFECTS", ()))
    if passed.refused:
        ids = tuple(m.NAME for m in EFFECTS)
        return Diagnosis("not_excited", (), (), ids, (), (), passed, channels, runs=runs, holdout=held)
    work = _Work(model, tuple(effects), channels, runs, searched(model, held), seed, said)
    span = max(float(np.ptp(coordinates_of(model, run, None).x)) for run in runs) or 1.0
    start = {"motion.x_pre": PRESLIDING[1] * span} | dict(values or {})
    limits = {"motion.x_pre": (PRESLIDING[0] * span, PRESLIDING[2] * span)}
    bend = ANGLE in [v.name for v in model.inputs]
    task = Task(model.name, searched(model, runs), channels, start, preset, tuple(fixed), limits=limits, bend=bend)
    found = work.on(task, searched(model, references))
    notes = (*found.notes, *said_of_angle, *beginning_note([*runs, *held]))
    return replace(found, gate=passed, runs=runs, holdout=held, notes=notes)


@dataclass(frozen=True)
class _Work:
    model: Kernel
    effects: tuple[str, ...]
    channels: tuple[str, ...]
    runs: list[FitRun]
    held: list[FitRun]
    seed: int
    said: Callable[[str], None]

    def on(self, task: Task, references: list[FitRun]) -> Diagnosis:
        self.said("model as given")
        given = as_given(task, self.effects)
        self.said("refit of the baseline")
        base = self._baseline(task, given)
        free = freedoms(task.model, self.channels, self.effects)
        calm = None
        if references:
            self.said("reference runs")
            calm = freed(self._baseline(replace(task, runs=references)), free)
            base = replace(base, task=replace(base.task, form=calm.rmse, earned=earned(calm, free)))
        levels = coarse(self.runs, self.channels, base.spread)
        form = np.maximum(base.task.form, step_noise(levels, self.channels))
        base = replace(base, task=replace(base.task, gap=base.rmse, form=form))
        plain = hypothesis((), base, (), self.held)
        start = hypothesis((), freed(base, free), free, self.held)
        hypotheses = self._hypotheses(start, plain, calm)
        if not self.held and foldable(task.runs):
            self.said("runs left out in turn")
            best = sorted(hypotheses[1:], key=left)[:FOLDED]
            plain, *hypotheses = together(folded, [plain, start, *best])
        choice = chosen(hypotheses, plain)
        floors = floors_of(choice, base, calm, [one.channel for one in levels])
        if floors.open_.any() and not floors.unexplained.any():
            self.said("patches")
            fewer = without_patches(choice, hypotheses, floors.open_, self.held)
            if fewer is None:
                floors = replace(floors, unexplained=floors.open_)
            else:
                choice = fewer
        there = {id_of(spec) for spec in self.effects}
        absent = [m.NAME for m in EFFECTS if m.NAME not in there]
        unseen = unexcited(base, self._possible(()), choice.best, absent)
        candidates = candidates_of(hypotheses, choice, plain, floors)
        result = Diagnosis(
            "none", (), (), unseen, candidates, (), Gate((), ()), self.channels, given, base, base, floors.noise,
            floors.least, floors.reference, notes=self._notes(base),
        )  # fmt: skip
        return self._answer(result, choice, plain, floors, levels)

    def _baseline(self, task: Task, given: Fitted | None = None) -> Fitted:
        """The model refitted, channels weighed by what it leaves of them."""
        first = refit(task, self.effects, {}, own=given.own if given else None)
        if len(self.channels) < 2:
            return first
        weighed = replace(task, weights=1.0 / np.maximum(first.rmse, 1e-6 * first.spread))
        return refit(weighed, self.effects, first.values, own=first.own)

    def _possible(
        self, attached: Sequence[str], released: Sequence[str] = (), travel: float = np.inf
    ) -> list[Attached]:
        """Candidates; a nuisance offset that is there can still be released to drift."""
        inputs = [v.name for v in self.model.inputs]
        return [
            c for c in possible(self.model.name, self.channels, self.effects, inputs, travel)
            if c.spec not in attached or (c.module.NAME == "offset_drift" and c.spec not in released)
        ]  # fmt: skip

    def _hypotheses(self, start: Hypothesis, plain: Hypothesis, calm: Fitted | None) -> list[Hypothesis]:
        """The baseline with its freedom, with each of the best candidates, with two effects and with three."""
        everywhere = np.ones(len(self.channels), bool)
        travel = max(float(np.ptp(c.x)) for c in places_of(plain.fitted))
        found, singles, now = [start], [], start
        for _ in range(MOST_EFFECTS):
            left_over = [
                c for c in self._possible(now.fitted.effects, now.fitted.released, travel)
                if not plain.fitted.has(c.module.NAME)  # it would only correct the form of what is there
            ]  # fmt: skip
            screened = screen(now.fitted, left_over, everywhere, self.said)
            before = plain.fitted if not now.added else now.bare
            starts = {}
            if before is not now.fitted:
                instead = screen(before, left_over, everywhere, self.said)
                starts = {s.attached.spec: Start(before, s.starts[0]) for s in instead}
                screened = interleaved(screened, instead)
                gains = {s.attached.spec: s.gain for s in instead}
                screened = [replace(s, gain=max(s.gain, gains[s.attached.spec])) for s in screened]
            if now.added:
                self.said("probe of a further effect")
                screened = probed(now.fitted, screened, now.free)
                screened = [s for s in screened if _promises(s.gain, before)][: len(now.material) + SECOND]
            more = tried(now, screened, self.held, calm if now is start else None, starts, self.said)
            if not more:
                break
            more = rivals_again(more, self.held)
            found += more
            best = leading(more)
            if len(now.added) == 1:
                second = [s for s in screened if s.attached.spec == best.added[-1]]
                others = [h for h in sorted(singles, key=left) if h is not now]
                for other in others[:SWAPPED]:
                    if best.added[-1] not in other.fitted.effects:
                        found += tried(other, second, self.held, said=self.said)
                pairs = rivals_again([h for h in found if len(h.added) == 2], self.held)
                found = [h for h in found if len(h.added) != 2] + pairs
                best = leading(pairs)
            found = fewer_again(best, found, plain, self.held)
            if left(best) >= left(now):
                break
            singles = singles or more
            now = best
            choice = chosen(found, plain)
            if len(choice.winner.effects) < len(now.added):
                break  # one more did not help
            if not choice.winner.bends and not open_channels(choice.winner, plain.fitted, calm).any():
                break  # nothing is left to explain, and nothing explained by what is rather a nuisance
        return found

    def _answer(
        self, result: Diagnosis, choice: Choice, plain: Hypothesis, floors: Floors, levels: list[Levels]
    ) -> Diagnosis:
        winner = choice.winner
        result = replace(result, final=self._kept(winner), where=self._where(plain.fitted))
        if floors.unexplained.any():
            shown = {c.effect for c in result.candidates} - set(result.not_excited)
            verdict = "unknown" if shown or not result.candidates else "not_excited"
            return replace(result, verdict=verdict, final=plain.fitted)
        if levels:
            assert result.final is not None
            result = replace(result, final=with_levels(result.final, levels))
        if not winner.effects and not levels:
            return self._without_effect(result, winner, plain)
        sets = [_ids(h) for h in choice.supported]
        common = [e for e in sets[0] if all(e in ids for ids in sets)]
        rest = tuple(dict.fromkeys(e for ids in sets for e in ids if e not in common))
        unseen = tuple(e for e in result.not_excited if all(e not in ids for ids in sets))
        assert result.final is not None
        notes = (*result.notes, *sign_notes(result.final), *self._left_notes(floors))
        result = replace(result, not_excited=unseen, equivalent=(rest,) if rest else (), notes=notes)
        common += [id_of(one.spec) for one in levels]
        if not common:
            return replace(result, verdict="ambiguous")
        every = (*winner.effects, *(one.spec for one in levels))
        named = tuple(spec for spec in every if id_of(spec) in common)
        return replace(result, verdict="named", effects=named)

    def _without_effect(self, result: Diagnosis, winner: Hypothesis, plain: Hypothesis) -> Diagnosis:
        """Nothing is missing: were other parameters needed?"""
        given = result.given
        assert given is not None
        used = plain if indistinct(plain, winner, plain) else winner
        removed = np.maximum(given.rmse**2 - used.fitted.rmse**2, 0.0)
        if (removed <= (MATERIAL * used.fitted.spread) ** 2).all():
            return replace(result, verdict="none", final=given)
        final = used.fitted if used is plain else result.final
        return replace(result, verdict="parameters", final=final, where=self._where(given))

    def _kept(self, winner: Hypothesis) -> Fitted:
        """The winner's fit without the nuisance freedom that does nothing; zeros of runs that are named may be free.

        They are if that does not cost on runs that were not fitted: there they could have taken what is a law.
        """
        fitted = winner.fitted
        if any(spec.startswith("offset_drift") for spec in winner.material):
            self.said("refit with free zeros")
            loose = with_fit(winner, untied(fitted, winner.free), self.held)
            if not self.held and winner.held is not None:
                loose = folded(loose)
            if left(loose) < left(winner):
                fitted = loose.fitted
        for spec in winner.free:
            if spec not in winner.effects and float(fitted.share_of(spec).max()) < NEGLIGIBLE:
                self.said(f"refit without {spec}")
                fitted = without(fitted, spec, winner.free)
        return fitted

    def _where(self, fitted: Fitted) -> tuple[Place, ...]:
        self.said("locate")
        base = kernel(self.model.name)
        units = {v.name: v.quantity.unit for v in (*base.inputs, *base.outputs)}
        unit = units.get(motion_channel(base), "1").removesuffix("/s")
        load = units.get(base.roles.load, "1")
        return tuple(locate(fitted.residuals, places_of(fitted), self.channels, unit, load, self.seed))

    def _left_notes(self, floors: Floors) -> tuple[str, ...]:
        return tuple(
            f"what is left of {channel} is no noise: the law of the rig is not quite that of the answer"
            for channel, is_open in zip(self.channels, floors.open_, strict=True) if is_open
        )  # fmt: skip

    def _notes(self, base: Fitted) -> tuple[str, ...]:
        notes = []
        for field_ in base.problem.shared:
            p, value = base.problem.parameters[field_], base.table[0, base.problem.fields.index(field_)]
            width = p.max - p.min
            near = 1e-4 * width if np.isfinite(width) else 1e-6 * max(1.0, abs(value))
            if value - p.min < near or p.max - value < near:
                notes.append(f"the refit stopped at a bound of {base.problem.declared[field_].name} ({value:g})")
        return tuple(notes)


def _ids(one: Hypothesis) -> tuple[str, ...]:
    return tuple(dict.fromkeys(id_of(spec) for spec in one.effects))


def _promises(gain: float, fitted: Fitted) -> bool:
    """Whether a candidate takes enough of what is left to matter, by its linear step or its probe."""
    return bool((np.sqrt(-np.expm1(-gain)) * fitted.rmse > MATERIAL * fitted.spread).any())
