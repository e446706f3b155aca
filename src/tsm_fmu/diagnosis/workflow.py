"""From runs and a model to a diagnosis: check the runs, fit, search, judge, and say what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from ..card import ModelCard, RecordUsed
from ..effects import EFFECTS
from ..effects.about import Family
from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..logs.record import Record
from ..logs.repeated import without_repeated_rows
from ..models.contract import InputError
from ..regression.held_out import SETTLING
from ..regression.problem import FitRun
from .answer.candidates import candidates_of, rows_of, steps_of
from .answer.clock import clock_notes
from .answer.closest import closest_effects
from .answer.family import families_of, not_little
from .answer.gaps import errors_of, gaps
from .answer.improvement import improvement_of
from .answer.next_motion import next_motion
from .answer.parameters import bound_notes, card_of, changes_of, model_fit, per_run_values
from .answer.sentence import answer, leading_channel
from .answer.shape import located, with_position_law
from .answer.wander import offsets_of, slow_parts
from .choice.baselines import refitted_model
from .choice.hypotheses import can_leave_out
from .choice.path import way_to_a_better_model
from .criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    FAMILY_SHARE,
    NOTABLE_RATIO,
    PRESLIDING_STROKE_SHARE,
)
from .evidence import Candidate, FamilyShare, Gap, Gate, NextMotion, ParameterChange, RunComparison
from .fits.known import compared_where_known
from .fits.placing import not_applicable
from .fits.ranges import forgetting_ranges, level_ranges
from .fits.refit import Task, as_given
from .investigation import Investigation, Progress, SearchInterrupted, investigate
from .result import MISSING, Diagnosis
from .runs.beginning import beginning_note, remembers
from .runs.displacement import with_speeds_of_position
from .runs.drivers import drives_of
from .runs.gate import Modelled, gate
from .runs.motion_signals import coordinate_units
from .runs.prepared import PreparedRuns, prepared
from .runs.rest import with_quiet_rests
from .runs.thinning import thinned_for_search
from .runs.unresolved import unresolved_notes


class DiagnosisInterrupted(KeyboardInterrupt):
    """Ctrl-C during the search; `card` is the model itself, refitted."""

    def __init__(self, card: ModelCard) -> None:
        super().__init__("interrupted")
        self.card = card


def diagnose(
    model: Kernel, measured: Sequence[Record], *, values: Mapping[str, float] | None = None, preset: str | None = None,
    fixed: Sequence[str] = (), reference: Sequence[Record] = (), holdout: Sequence[Record] = (),
    cutoff: float | None = None, seed: int = 0, drive: Mapping[str, str] | None = None,
    improve: bool = False, progress: Progress = lambda _: None,
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
        Of the noise that residuals are compared with.
    drive : mapping of str to str, optional
        What a column of the runs may be for effects, instead of what its unit says: load, bend, temperature,
        position or none.
    improve : bool
        Go on, effect after effect, to the model that predicts best; see `choice.path`.
    progress : callable
        Given, before each step, what is being done.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        Runs that do not fit the model, values from which it cannot run, a held-out run that is too short; a single run
        where an improved model is asked for.
    DiagnosisInterrupted
        Ctrl-C after the model was refitted.
    """
    given, repeated = without_repeated_rows([*measured, *holdout, *reference])
    every, said = with_speeds_of_position(model, given, cutoff)
    if not said:  # a position that stands has no noise
        every, said = with_quiet_rests(model, every)
    ends = len(measured), len(measured) + len(holdout)
    measured, holdout, reference = every[: ends[0]], every[ends[0] : ends[1]], every[ends[1] :]
    runs = prepared(model, measured, reference, holdout, cutoff, drive)
    runs = replace(runs, notes=(*repeated, *runs.notes, *said))
    if improve and not can_leave_out(runs.measured):
        raise InputError(
            f"--improve with {len(measured)} measured run{'s' if len(measured) > 1 else ''} -- expected two or more, "
            f"each longer than {2 * SETTLING:g} s: steps are judged on runs left out -- give more with --measured"
        )
    progress("gate")
    task_once = cache(lambda: task_of(runs, values or {}, preset, fixed))
    checked = gate(measured, runs.model, runs.channels, _as_modelled(measured, runs, task_once))
    roles = {"measured": measured, "held out": holdout, "reference": reference}
    records = {f"{role} {r.name}": r.sha256 for role, group in roles.items() for r in group}
    if checked.refused:
        return _refused(runs, checked, records, preset, seed)
    used = [RecordUsed(r.name, r.sha256) for r in measured if r.sha256]
    used += [RecordUsed(r.name, r.sha256, "holdout") for r in holdout if r.sha256]
    runs, task = _where_known(runs, task_once(), progress)
    try:
        found = investigate(runs, task, progress)
    except SearchInterrupted as stopped:
        raise DiagnosisInterrupted(card_of(stopped.refitted, tuple(used), preset or "", seed, False)) from None
    progress("locate")
    diagnosis = _described(found, checked, measured, tuple(used), records, preset or "", seed)
    return _improved(diagnosis, found, tuple(used), progress) if improve else diagnosis


def _as_modelled(records: Sequence[Record], runs: PreparedRuns, task: Callable[[], Task]) -> Modelled:
    """What the model as given makes of a channel of a run, at the samples of its record."""
    fitted = cache(lambda: as_given(task(), runs.effects))

    def modelled(k: int, channel: str) -> FloatArray:
        c, run = runs.channels.index(channel), fitted().problem.runs[k]
        own = run.targets[:, c] - fitted().residuals[k][:, c]
        return np.interp(records[k].time, run.time, own, left=np.nan, right=np.nan)

    return modelled


def _where_known(runs: PreparedRuns, task: Task, progress: Progress) -> tuple[PreparedRuns, Task]:
    """The same, compared where neither the steps of an encoder nor the past of a run leave doubt of the friction."""
    if not remembers(runs.model, runs.channels):
        return runs, task
    progress("what the log leaves open of the motion")
    runs = compared_where_known(runs, refitted_model(task, runs.effects))
    return runs, replace(task, runs=thinned_for_search(runs.model, runs.measured, runs.channels))


def _improved(
    diagnosis: Diagnosis, found: Investigation, used: tuple[RecordUsed, ...], progress: Progress
) -> Diagnosis:
    """With the model that predicts best; Ctrl-C on the way there keeps the diagnosis."""
    try:
        way = way_to_a_better_model(found.runs, found.task, progress, found.verdict.final)
    except KeyboardInterrupt:
        note = "interrupted on the way to a better model: none is given"
        return replace(diagnosis, notes=(*diagnosis.notes, note), complete=False)
    improved = improvement_of(way, found.runs, diagnosis.effects, used, diagnosis.preset, diagnosis.seed)
    return replace(diagnosis, improved=improved)


def task_of(runs: PreparedRuns, values: Mapping[str, float], preset: str | None, fixed: Sequence[str]) -> Task:
    """What stays the same in every refit."""
    stroke = runs.stroke
    return Task(
        runs.model.name, thinned_for_search(runs.model, runs.measured, runs.channels), runs.channels,
        {"motion.x_pre": PRESLIDING_STROKE_SHARE[1] * stroke, **values}, preset, tuple(fixed),
        limits={
            "motion.x_pre": (PRESLIDING_STROKE_SHARE[0] * stroke, PRESLIDING_STROKE_SHARE[2] * stroke),
            **forgetting_ranges(runs.model, stroke, values, preset),
            **level_ranges(runs.model, runs.channels, [*runs.measured, *runs.reference], fixed, values, preset),
        },
        drives=drives_of(runs.model),
    )  # fmt: skip


def _refused(runs: PreparedRuns, checked: Gate, records: Mapping[str, str], preset: str | None, seed: int) -> Diagnosis:
    """No answer: the runs cannot be judged."""
    inapplicable = not_applicable(runs.model, runs.channels)
    found = Diagnosis(
        "not_excited", not_excited=tuple(m.NAME for m in EFFECTS if m.NAME not in inapplicable),
        not_applicable=inapplicable, channels=runs.channels, gate=checked,
        compared_from=_compared_from(runs), records=records, preset=preset or "", seed=seed,
    )  # fmt: skip
    return replace(found, answer=answer(found))


def _described(
    found: Investigation, checked: Gate, measured: Sequence[Record], used: tuple[RecordUsed, ...],
    records: Mapping[str, str], preset: str, seed: int,
) -> Diagnosis:  # fmt: skip
    """The diagnosis in numbers and words: errors at full sampling, candidates, places, formulas, card, next motion."""
    runs, verdict, before, stages = found.runs, found.verdict, found.selection.baselines, found.stages
    gap = _gaps(found)
    start = _start(found, gap)
    candidates = candidates_of(
        rows_of(found.selection.hypotheses, found.selection.choice, found.selection.floors),
        _answered(found), gap, start, before.refitted,
        before.with_nuisances, found.with_zeros.measured, (*found.not_excited, *found.not_applicable),
        unknown=found.selection.floors.without_answer,
    )  # fmt: skip
    stage = "given" if verdict.word in ("none", "parameters") else "refitted"
    missing = verdict.word in MISSING
    where, shapes = located(stages[stage], seed, formulas=missing)
    given, refitted, final = (model_fit(fitted) for fitted in stages.values())
    bounds = bound_notes(verdict.refitted, verdict.final)
    diagnosis = Diagnosis(
        verdict.word, effects=verdict.effects, equivalent=(verdict.equivalent,) if verdict.equivalent else (),
        not_excited=found.not_excited, not_applicable=found.not_applicable, candidates=candidates,
        steps=steps_of(
            found.selection.hypotheses, verdict.effects, start, before.refitted, found.with_zeros.measured,
            offsets_of(found.wanders),
        ),
        where=where, located=stage, shapes=shapes, gap=gap, channels=runs.channels, given=given,
        refitted=refitted, final=final, changes=changes_of(before.given, verdict.final),
        unlike_references=_unlike_references(found),
        model=card_of(verdict.final, used, preset, seed), next_motion=_next_motion(found, candidates), gate=checked,
        runs=_comparisons(found, measured), compared_from=_compared_from(runs), motion=runs.model.motion,
        motion_unit=coordinate_units(runs.model)[0],
        notes=(
            *bounds, *verdict.notes, *clock_notes(found.selection.choice.winner.fitted), *runs.notes,
            *beginning_note([*runs.measured, *runs.holdout]),
            *unresolved_notes([*runs.measured, *runs.holdout], runs.channels),
        ),
        records=records, preset=preset, seed=seed,
    )  # fmt: skip
    channel = leading_channel(diagnosis) or ""
    evidence, families = _families(found, diagnosis, channel)
    if missing and "position" in families:
        shapes = with_position_law(tuple(shapes), stages[stage], channel, seed)
    diagnosis = replace(
        diagnosis,
        family=families,
        family_evidence=evidence,
        shapes=shapes,
        tones=found.tones,
        limits=found.limits,
        wanders=found.wanders,
    )
    return replace(diagnosis, answer=answer(diagnosis))


def _unlike_references(found: Investigation) -> tuple[ParameterChange, ...]:
    """Values of the answer that reference runs have elsewhere, where it is other values and none serve both."""
    reference = found.selection.baselines.reference
    if found.verdict.word != "parameters" or reference is None or not found.selection.unlike_references:
        return ()
    return changes_of(reference, found.verdict.final)


def _families(
    found: Investigation, diagnosis: Diagnosis, channel: str
) -> tuple[tuple[FamilyShare, ...], tuple[Family, ...]]:
    """Of what that which the answer is about is a law, after the evidence for it; see `families_of`.

    What hums, or moves slowly and with nothing that the log holds, is a law of the time, and a limit one of the sensor.
    """
    verdict, refitted, evidence = found.verdict, found.selection.baselines.refitted.fitted, found.evidence
    if verdict.word == "not_excited":
        return evidence, ()
    if verdict.word == "unknown" and channel in found.limits:
        return evidence, ("sensor",)
    missing = verdict.word in MISSING
    telling = evidence if missing else not_little(evidence, found.selection.of_gap.fitted)
    equivalent = [e for ids in diagnosis.equivalent for e in ids]
    named = verdict.effects or equivalent
    elsewhere = channel in diagnosis.gap and diagnosis.gap[channel].elsewhere  # no candidate was fitted to it
    closest = () if named or elsewhere else closest_effects(found.selection, verdict, missing=missing)
    families = families_of(verdict.effects, equivalent, telling, channel, closest)
    if verdict.word == "unknown" and channel in found.tones:
        predicted = [e.family for e in evidence if e.channel == channel and e.share > FAMILY_SHARE]
        return evidence, ("time", *(f for f in families if f in predicted and f != "time"))
    if verdict.word == "unknown" and not families:
        slow = {(e.family, e.channel): e for e in slow_parts(refitted, found.runs)}
        evidence = (*slow.values(), *(e for e in evidence if (e.family, e.channel) not in slow))
        return evidence, families_of((), (), evidence, channel)
    return evidence, families


def _answered(found: Investigation) -> tuple[str, ...]:
    """Effects that the answer names or holds in a set, not the nuisance effects beside them."""
    verdict = found.verdict
    if not verdict.effects and not verdict.equivalent:
        return ()
    return tuple(dict.fromkeys((*verdict.effects, *found.selection.choice.winner.effects)))


def _gaps(found: Investigation) -> dict[str, Gap]:
    runs, verdict = found.runs, found.verdict
    base = found.selection.baselines.refitted.fitted
    units = {v.name: v.quantity.unit for v in base.problem.kernel.outputs}
    left = found.stages["final"].rmse
    threshold = np.maximum(CLEAN_EFFECT_SPREAD_SHARE * base.spread, np.sqrt(NOTABLE_RATIO) * left)
    compared = {"given": runs, "refitted": runs, "final": found.with_zeros}  # of the answer's model zeros may be free
    given, refitted, final = (
        errors_of(fitted, compared[stage].measured, compared[stage].holdout) for stage, fitted in found.stages.items()
    )
    return gaps(
        runs.channels, [units[c] for c in runs.channels], given, refitted, final, found.selection.floors, threshold,
        found.selection.elsewhere, with_effects=bool(verdict.effects or verdict.equivalent),
    )  # fmt: skip


def _start(found: Investigation, gap: Mapping[str, Gap]) -> dict[str, tuple[float, float | None]]:
    """What the refitted model leaves in the search, in which zeros that wander are free."""
    if not found.wanders:
        return {channel: (g.refitted, g.holdout_refitted) for channel, g in gap.items()}
    runs = found.with_zeros
    errors = errors_of(found.selection.baselines.refitted.fitted, runs.measured, runs.holdout)
    held_out = [None] * len(gap) if errors.rms_holdout is None else errors.rms_holdout.tolist()
    return dict(zip(gap, zip(errors.rms.tolist(), held_out, strict=True), strict=True))


def _next_motion(found: Investigation, candidates: Sequence[Candidate]) -> NextMotion | None:
    """The motion that separates the effects that cannot be told apart."""
    to_separate, fits = found.verdict.equivalent, {}
    rows = dict(rows_of(found.selection.hypotheses, found.selection.choice, found.selection.floors))
    for c in candidates:
        if c.effect in to_separate:
            fits.setdefault(c.effect, rows[c.spec].fitted)
    return next_motion(list(fits.values()), found.selection.floors.noise) if to_separate else None


def _comparisons(found: Investigation, measured: Sequence[Record]) -> tuple[RunComparison, ...]:
    """Each measured run beside its simulations, with all its samples."""
    runs, names = found.runs.measured, [v.name for v in found.runs.model.inputs]
    motion = found.runs.model.motion
    whole = [run.as_measured for run in runs]
    residuals = {name: fitted.at(whole).residuals for name, fitted in found.stages.items()}
    per_run = per_run_values(found.verdict.final)
    column = names.index(motion) if motion else None

    def driven(record: Record, run: FitRun) -> Record:
        """With the motion that has driven the model: between the steps of its encoder."""
        if column is None or motion not in record.columns:
            return record
        return replace(record, columns={**record.columns, motion: run.with_lead[1][:, column]})

    return tuple(
        RunComparison(
            driven(record, run), run.time, run.targets, {name: run.targets - r[k] for name, r in residuals.items()},
            None if column is None else run.inputs[:, column], per_run[k], run.unresolved,
        )
        for k, (record, run) in enumerate(zip(measured, runs, strict=True))
    )  # fmt: skip


def _compared_from(runs: PreparedRuns) -> dict[str, float]:
    def first(group: Sequence[FitRun]) -> dict[str, float]:
        return {run.name: float(run.time[0]) for run in group}

    return first(runs.measured) | first(runs.holdout)
