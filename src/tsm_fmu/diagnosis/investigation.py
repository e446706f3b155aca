"""The search of a diagnosis: fits, hypotheses, what instruments do to them, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

from ..effects import EFFECTS, id_of
from ..regression.problem import FitRun
from .answer.candidates import rows_of
from .answer.clock import clock_runs_slow
from .answer.family import contradicted, family_evidence
from .answer.limit import limits_met, with_limits
from .answer.tone import sizes_on, taken_out, tones_left, with_tones, without_tones
from .answer.verdict import Verdict, verdict_of
from .answer.wander import explained_by_zeros, offsets_of, with_free_zeros, with_sizes, zeros_that_wander
from .choice.baselines import Baselines, baselines
from .choice.search import Search, candidate_places
from .choice.selection import Selection, select, with_rivals, without_names
from .choice.visibility import Unseen, unexcited
from .criteria import FEW_SAMPLES_RATIO, MORE_SAMPLES_RATIO
from .evidence import FamilyShare, Limit, Tone, Wander
from .fits.placing import not_applicable
from .fits.refit import Fitted, Task
from .runs.prepared import PreparedRuns
from .runs.thinning import thinned_for_search

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Investigation:
    """What the search found, with its fits: from it a `Diagnosis` is made.

    Attributes
    ----------
    runs : PreparedRuns
        Less the tones that the model itself leaves.
    with_zeros : PreparedRuns
        The same, compared but for the zeros that wander.
    task : Task
        With samples of `runs`.
    given : Fitted
        The model as given.
    selection : Selection
        Of fits to `with_zeros`.
    verdict : Verdict
    evidence : tuple of FamilyShare
        Of what the refitted model leaves: of held-out runs in channels of which only these show a gap.
    tones : mapping of str to Tone
        In what the model, or the best one, leaves, by channel.
    limits : mapping of str to Limit
        At which channels stand, by channel.
    wanders : mapping of str to Wander
        Zeros that wander, by channel.
    not_excited : tuple of str
        Ids of effects that have a place and that these runs could not show.
    not_applicable : mapping of str to str
        Why the others cannot be asked about, by id.
    """

    runs: PreparedRuns
    with_zeros: PreparedRuns
    task: Task
    given: Fitted
    selection: Selection
    verdict: Verdict
    evidence: tuple[FamilyShare, ...]
    tones: Mapping[str, Tone]
    limits: Mapping[str, Limit]
    wanders: Mapping[str, Wander]
    not_excited: tuple[str, ...]
    not_applicable: Mapping[str, str]

    @property
    def stages(self) -> dict[str, Fitted]:
        """The model as given, refitted, and that of the answer."""
        return {"given": self.given, "refitted": self.verdict.refitted, "final": self.verdict.final}


class SearchInterrupted(KeyboardInterrupt):
    """Ctrl-C during the search; `refitted` is the fit of the model itself."""

    def __init__(self, refitted: Fitted) -> None:
        super().__init__("interrupted")
        self.refitted = refitted


def investigate(runs: PreparedRuns, task: Task, progress: Progress = lambda _: None) -> Investigation:
    """Fit the baselines, search for hypotheses, judge them and find the verdict.

    Parameters
    ----------
    runs : PreparedRuns
    task : Task
    progress : callable

    Raises
    ------
    SearchInterrupted
        Ctrl-C after the baselines were fitted.
    """
    times, holdout, fitted, whole = _on_enough_samples(runs, task, progress)
    refitted = fitted.refitted.fitted
    task = replace(task, runs=refitted.task.runs)
    heard, on_reference = tones_left(whole), {}
    if heard:
        reference = fitted.reference.at(runs.reference) if fitted.reference else None
        on_reference = sizes_on(reference, heard) if reference else {}
        progress(f"less what hums at {' and '.join(f'{tone.frequency:.4g} Hz' for tone in heard.values())}")
        held_out = refitted.on(runs.holdout) if runs.holdout else None
        runs = _less_tones(runs, whole, held_out, reference, heard)
        task = replace(task, runs=thinned_for_search(runs.model, runs.measured, runs.channels, times))
        holdout, fitted = _baselines(runs, task, progress, times)
    try:
        plain = _searched(runs, fitted, holdout, progress)
        now, wanders = _with_zeros_that_wander(plain, task, times, progress)
        result, without_fault = now.selection, now.selection.baselines.reference
        winner = result.choice.winner.fitted.at(now.runs.measured)
        more = {c: tone for c, tone in tones_left(winner).items() if c not in heard}
        if more and without_fault:
            on_reference |= sizes_on(without_fault.at(now.runs.reference), more)
        heard = more | {c: taken_out(tone, winner, c) for c, tone in heard.items()}
        if heard:
            result = with_tones(result, heard, on_reference)
        before = result.baselines
        met = limits_met([before.refitted.fitted, before.given], now.runs.measured, now.runs.holdout)
        if met:
            result = with_limits(result, met)
        unseen, inapplicable = _not_excited(runs, result)
        verdict = verdict_of(
            result.baselines,
            result.choice,
            result.floors,
            now.evidence,
            [id_of(spec) for spec, _ in rows_of(result.hypotheses, result.choice, result.floors)],
            unseen.unmoved,
            inapplicable.keys(),
            now.holdout,
            _holding(now.runs, times),
            offsets_of(wanders),
            [h for h in result.hypotheses if not h.added],
            progress,
        )
        if wanders:  # the model itself has no zeros that are free
            refitted = _holding(runs, times)(plain.selection.baselines.refitted.fitted)
            verdict = replace(verdict, refitted=refitted)
    except KeyboardInterrupt:
        raise SearchInterrupted(fitted.refitted.fitted) from None
    answered = {*map(id_of, verdict.effects), *verdict.equivalent}
    return Investigation(
        runs,
        now.runs,
        task,
        plain.selection.baselines.given,
        result,
        verdict,
        now.evidence,
        heard,
        met,
        wanders,
        not_excited=tuple(e for e in unseen.hidden if e not in answered),
        not_applicable={e: why for e, why in inapplicable.items() if e not in answered},
    )


@dataclass(frozen=True)
class _Searched:
    """A search and what was chosen of it.

    Attributes
    ----------
    runs : PreparedRuns
    holdout : list of FitRun
        As the search works on them.
    selection : Selection
    evidence : tuple of FamilyShare
        As in `Investigation`.
    """

    runs: PreparedRuns
    holdout: list[FitRun]
    selection: Selection
    evidence: tuple[FamilyShare, ...]


def _searched(runs: PreparedRuns, fitted: Baselines, holdout: list[FitRun], progress: Progress) -> _Searched:
    """Hypotheses, and of these what the runs support; no names where laws of another kind explain more."""
    hypotheses = Search(runs.model, fitted, holdout, progress).hypotheses()
    result = select(hypotheses, fitted, holdout, progress)
    progress("families")
    base = result.of_gap
    evidence = family_evidence(base.fitted, runs.measured)

    @cache
    def elsewhere() -> tuple[FamilyShare, ...]:
        return family_evidence(base.fitted.on(holdout), runs.holdout) if holdout else ()

    if contradicted(result.choice, base, evidence, elsewhere) or clock_runs_slow(result.choice):
        result = without_names(result)
    if result.elsewhere.any():
        there = dict(zip(base.fitted.problem.channels, result.elsewhere, strict=True))
        known = (*(e for e in elsewhere() if there[e.channel]), *(e for e in evidence if not there[e.channel]))
        evidence = tuple(sorted(known, key=lambda e: -e.share))
    return _Searched(runs, holdout, with_rivals(result), evidence)


def _with_zeros_that_wander(
    plain: _Searched, task: Task, times: int, progress: Progress
) -> tuple[_Searched, dict[str, Wander]]:
    """The same search, or another with the zeros free that wander in what this leaves, if that explains the rest."""
    floors = plain.selection.floors
    wanders = zeros_that_wander(plain.selection, plain.runs) if (floors.open_ | floors.unexplained).any() else {}
    if not wanders:
        return plain, {}
    progress(f"the zero of {' and '.join(wanders)} wanders: once more with it free")
    runs = with_free_zeros(plain.runs, wanders)
    task = replace(task, runs=thinned_for_search(runs.model, runs.measured, runs.channels, times))
    holdout, fitted = _baselines(runs, task, progress, times)
    free = _searched(runs, fitted, holdout, progress)
    chosen = explained_by_zeros(free.selection, plain.selection, wanders)
    if chosen is None:
        return plain, {}
    return replace(free, selection=chosen), with_sizes(wanders, chosen, plain.runs)


def _holding(runs: PreparedRuns, times: int) -> Callable[[Fitted], Fitted]:
    """`Fitted.holding` on these runs."""

    @cache
    def more() -> list[FitRun]:
        return thinned_for_search(runs.model, runs.measured, runs.channels, times * MORE_SAMPLES_RATIO)

    return lambda fitted: fitted.holding(more, runs.measured)


def _on_enough_samples(
    runs: PreparedRuns, task: Task, progress: Progress
) -> tuple[int, list[FitRun], Baselines, Fitted]:
    """How many times the usual samples the search works on, `_baselines` on these, and the refitted model on all.

    A fit to few samples that leaves far more on all of them has fitted what lies between them: there are too few.
    """
    times = 1
    while True:
        holdout, fitted = _baselines(runs, task, progress, times)
        few = fitted.refitted.fitted
        whole = few.at(runs.measured)
        if (whole.rmse <= FEW_SAMPLES_RATIO * few.rmse).all():
            return times, holdout, fitted, whole
        more = thinned_for_search(runs.model, runs.measured, runs.channels, times * MORE_SAMPLES_RATIO)
        if all(now.time.size == then.time.size for now, then in zip(more, task.runs, strict=True)):
            return times, holdout, fitted, whole
        times, task = times * MORE_SAMPLES_RATIO, replace(task, runs=more)
        progress(f"{times} times the samples: the fit to fewer of them does not hold on all")


def _baselines(runs: PreparedRuns, task: Task, progress: Progress, times: int) -> tuple[list[FitRun], Baselines]:
    """Held-out runs as the search works on them, and the fits before it."""
    holdout, references = (
        thinned_for_search(runs.model, group, runs.channels, times) for group in (runs.holdout, runs.reference)
    )
    return holdout, baselines(task, runs.effects, runs.measured, references, holdout, progress)


def _less_tones(
    runs: PreparedRuns, measured: Fitted, holdout: Fitted | None, reference: Fitted | None, heard: Mapping[str, Tone]
) -> PreparedRuns:  # fmt: skip
    """The same without what hums, by fits on all samples of each kind of runs that there are."""
    return replace(
        runs,
        measured=without_tones(measured, heard),
        holdout=without_tones(holdout, heard) if holdout else (),
        reference=without_tones(reference, heard) if reference else (),
    )


def _not_excited(runs: PreparedRuns, result: Selection) -> tuple[Unseen, dict[str, str]]:
    """Effects that have a place and that the runs could not show, and why the others cannot be asked about, by id."""
    base = result.baselines.refitted.fitted
    unseen = unexcited(base, candidate_places(runs.model, base), result.choice.best)
    used = set(map(id_of, result.choice.best.effects))
    why = {e: f"the parameters of {base.model} do what it does" for e in unseen.contained if e not in used}
    why |= {m.NAME: f"the law of {base.model} holds it" for m in EFFECTS if base.has(m.NAME)}
    here = unseen._replace(hidden=tuple(e for e in unseen.hidden if e not in why))
    return here, why | not_applicable(runs.model, runs.channels)
