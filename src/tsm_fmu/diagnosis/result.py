"""What a diagnosis found, as plain immutable data: nothing here fits, simulates or writes.

Quantities are in SI; ``unit`` says which. Arrays are not to be changed.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import pandas as pd

from ..card import ModelCard
from ..effects import id_of
from ..effects.about import Family
from ..logs.display import display
from ..report import Figure, bar_figure
from .evidence import (
    AnswerStep,
    Candidate,
    FamilyShare,
    Gap,
    Gate,
    Limit,
    ModelFit,
    NextMotion,
    ParameterChange,
    Place,
    ResidualShape,
    RunComparison,
    Tone,
    Wander,
)
from .improved import ImprovedModel

MISSING = ("named", "ambiguous", "unknown")
"""Verdicts that say that something is missing."""
MOST_DRAWN = 3
"""Other effects, each alone, in the picture of the gap: the best ones."""


@dataclass(frozen=True)
class Diagnosis:
    """Where a model and measurements disagree, and which effect is missing.

    Attributes
    ----------
    verdict : str
        ``named``, ``ambiguous``, ``unknown``, ``none``, ``parameters`` or ``not_excited``.
    answer : str
        The same in a few sentences, with numbers.
    effects : tuple of str
        Named effects as ``id`` or ``id@channel``, in the order added.
    equivalent : tuple of tuple of str
        Sets of ids that these runs cannot tell apart.
    not_excited : tuple of str
        Ids of effects that have a place and that these runs could not show: they could be there unseen.
    not_applicable : mapping of str to str
        Ids of effects of which nothing can be said, and why: no place in the model with these channels, nothing in the
        log that drives them, or in the model already.
    family : tuple of str
        Families of what the model lacks, one for each kind of law: of the effects named or not told apart; of what has
        no name the one whose laws predict most of the residual, and that of the effect that comes closest. With
        ``none`` and ``parameters`` of what a refit of the model's own parameters leaves, too little for a name, and of
        the nuisance parameter of the answer that removes most. Empty where nothing can be said.
    family_evidence : tuple of FamilyShare
        What the laws of each family predict of the residual of each channel, most first; of that of held-out runs where
        only these show it.
    tones : mapping of str to Tone
        Tones in what the best model of the search leaves, by channel: of mains or a pump, and no law of the motion.
    limits : mapping of str to Limit
        Limits at which channels stand where the model goes on, by channel: of a sensor that saturates.
    wanders : mapping of str to Wander
        Zeros that wander within runs, by channel: they are free in what the answer's model is compared with.
    candidates : tuple of Candidate
        Best first.
    steps : tuple of AnswerStep
        What the first effects of an answer of several left; empty for one effect.
    where : tuple of Place
        Of the residual of ``located``, most telling first.
    located : str
        Stage whose residual that is: ``given`` or ``refitted``.
    shapes : tuple of ResidualShape
        Of the same residual.
    gap : mapping of str to Gap
        By channel; empty where nothing could be compared.
    channels : tuple of str
        Measured outputs that are compared.
    given, refitted, final : ModelFit or None
        The model as given, with other parameter values only, and that of the answer.
    changes : tuple of ParameterChange
        Parameters that the answer's fit moved, first whose move does most.
    unlike_references : tuple of ParameterChange
        With ``parameters``, where no values serve both measured and reference runs: those that reference runs have
        elsewhere, there first.
    model : ModelCard or None
        The answer's model.
    next_motion : NextMotion or None
        What to measure next where effects cannot be told apart.
    gate : Gate
    runs : tuple of RunComparison
    compared_from : mapping of str to float
        Time [s] from which each measured and held-out run is compared, by name.
    motion : str
        Input that drives the model, ``v`` for a speed; empty without.
    motion_unit : str
    improved : ImprovedModel or None
        The model that predicts best, with effects that may be useful and not named; None unless it was asked for.
    notes : tuple of str
        What else a user should know.
    records : mapping of str to str
        SHA-256 of each run, by role and name.
    preset : str
        Parameter set that the model started from; empty without.
    seed : int
    complete : bool
        False if it was interrupted on the way to a better model: the answer stands, ``improved`` is None.
    """

    verdict: str
    answer: str = ""
    effects: tuple[str, ...] = ()
    equivalent: tuple[tuple[str, ...], ...] = ()
    not_excited: tuple[str, ...] = ()
    not_applicable: Mapping[str, str] = field(default_factory=dict)
    family: tuple[Family, ...] = ()
    family_evidence: tuple[FamilyShare, ...] = ()
    tones: Mapping[str, Tone] = field(default_factory=dict)
    limits: Mapping[str, Limit] = field(default_factory=dict)
    wanders: Mapping[str, Wander] = field(default_factory=dict)
    candidates: tuple[Candidate, ...] = ()
    steps: tuple[AnswerStep, ...] = ()
    where: tuple[Place, ...] = ()
    located: str = "refitted"
    shapes: tuple[ResidualShape, ...] = ()
    gap: Mapping[str, Gap] = field(default_factory=dict)
    channels: tuple[str, ...] = ()
    given: ModelFit | None = None
    refitted: ModelFit | None = None
    final: ModelFit | None = None
    changes: tuple[ParameterChange, ...] = ()
    unlike_references: tuple[ParameterChange, ...] = ()
    model: ModelCard | None = None
    next_motion: NextMotion | None = None
    gate: Gate = field(default_factory=Gate)
    runs: tuple[RunComparison, ...] = ()
    compared_from: Mapping[str, float] = field(default_factory=dict)
    motion: str = ""
    motion_unit: str = "1"
    improved: ImprovedModel | None = None
    notes: tuple[str, ...] = ()
    records: Mapping[str, str] = field(default_factory=dict)
    preset: str = ""
    seed: int = 0
    complete: bool = True

    @property
    def card(self) -> ModelCard | None:
        """The answer's model."""
        return self.model

    @property
    def ids(self) -> list[str]:
        """Ids of the named effects, in the order added."""
        return [id_of(spec) for spec in self.effects]

    @property
    def answered(self) -> set[str]:
        """Ids that the answer holds: named, or in a set."""
        return {*self.ids}.union(*self.equivalent)

    @property
    def also_in_model(self) -> tuple[str, ...]:
        """Effects of the answer's model that are neither of the model as given nor named: nuisance parameters."""
        if self.final is None or self.given is None:
            return ()
        in_given = (*self.given.effects, *self.effects)
        return tuple(e for e in self.final.effects if e not in in_given and id_of(e) not in self.answered)

    def summary(self) -> str:
        """The answer, the gaps, the candidates and the notes as text."""
        parts = [self.answer]
        if self.gap:
            table = self.gap_frame().to_string(na_rep="", float_format="%.4g")
            parts.append(_indented("Error (RMS) by channel", table))
        if self.candidates:
            table = self.to_frame().to_string(na_rep="", float_format="%.3g")
            parts.append(_indented("Each effect refitted together with the model", table))
        if self.not_excited:
            parts.append(f"These runs could not show: {', '.join(self.not_excited)}.")
        if self.not_applicable:
            parts.append(f"Nothing is said of (not applicable): {', '.join(self.not_applicable)}.")
        if self.improved is not None:
            table = self.improved_frame().to_string(na_rep="", float_format="%.4g")
            parts += [self.improved.text, _indented("The way to the improved model: error (RMS)", table)]
        parts += [f"Note: {note}." for note in self.notes]
        return "\n\n".join(parts)

    def to_frame(self) -> pd.DataFrame:
        """Candidates, best first: score, what each closes of the gap, and whether these runs could have shown it."""
        columns = ["score [dB]", "closes, measured", "closes, held out", "testable"]
        rows = [(c.score, c.closure_measured, c.closure_holdout, c.testable) for c in self.candidates]
        index = pd.Index([c.spec for c in self.candidates], name="effect")
        return pd.DataFrame(rows, index, columns)

    def gap_frame(self) -> pd.DataFrame:
        """Errors of each channel [SI, RMS]: as given, refitted, with the answer, floor; measured and held out."""
        rows = {
            f"{channel} [{g.unit}]": {
                "given": g.before, "refitted": g.refitted, "answer": g.after,
                "given, held out": g.holdout_before, "refitted, held out": g.holdout_refitted,
                "answer, held out": g.holdout_after, "floor": g.floor,
            }
            for channel, g in self.gap.items()
        }  # fmt: skip
        return pd.DataFrame.from_dict(rows, orient="index").dropna(axis="columns", how="all").rename_axis("channel")

    def improved_frame(self) -> pd.DataFrame:
        """Steps of the way to the improved model [SI, RMS]: on measured runs, on runs left out in turn, held out."""
        rows = [
            {
                f"{channel} [{self.gap[channel].unit}], {side}": error
                for channel in self.channels
                for side, errors in (("measured", s.measured), ("left out", s.left_out), ("held out", s.holdout))
                if (error := errors.get(channel)) is not None
            }
            for s in self.improved.steps
        ] if self.improved else []  # fmt: skip
        names = [s.added or "refitted" for s in self.improved.steps] if self.improved else []
        return pd.DataFrame(rows, pd.Index(names, name="added"))

    def figure(self) -> Figure:
        """The gap as it shrinks, measured and held out: as given, refitted, other effects, the answer's, floor."""
        bars: dict[str, dict[str, float]] = {}
        for channel, g in self.gap.items():
            shown = display(g.unit, max(g.before, g.floor))
            for side, errors in (("measured", self._measured(channel)), ("held out", self._held_out(channel))):
                if errors:
                    bars[f"{channel} [{shown.unit}], {side}"] = {n: shown.factor * e for n, e in errors.items()}
        answers = {bar for c in self.gap for bar in (*self._step_bars(c), self._answer_bar(c))}
        return bar_figure(bars, "Error (RMS)", answers)

    def _measured(self, channel: str) -> dict[str, float]:
        """Errors on measured runs by the name of their bar."""
        g = self.gap[channel]
        others = {self._other_bar(c.spec, channel): c.channels[channel].measured for c in self._others(channel)}
        steps = {bar: s.measured[channel] for bar, s in self._step_bars(channel).items()}
        answer = {self._answer_bar(channel): g.after}
        return {"as given": g.before, "refitted": g.refitted, **_falling(others), **steps, **answer, "floor": g.floor}

    def _held_out(self, channel: str) -> dict[str, float]:
        """The same on held-out runs; empty without."""
        g = self.gap[channel]
        if g.holdout_before is None:
            return {}
        others = {self._other_bar(c.spec, channel): c.channels[channel].holdout for c in self._others(channel)}
        steps = {bar: s.holdout.get(channel) for bar, s in self._step_bars(channel).items()}
        errors = {
            "as given": g.holdout_before, "refitted": g.holdout_refitted,
            **_falling({n: e for n, e in others.items() if e is not None}), **steps,
            self._answer_bar(channel): g.holdout_after, "floor": g.floor,
        }  # fmt: skip
        return {name: e for name, e in errors.items() if e is not None}

    def _others(self, channel: str) -> list[Candidate]:
        """The best effects that are not in the answer's model."""
        there = (*self.effects, *(self.final.effects if self.final else ()))
        return [c for c in self.candidates if c.testable and c.spec not in there and channel in c.channels][:MOST_DRAWN]

    def _other_bar(self, spec: str, channel: str) -> str:
        """Bar of an effect that is not in the answer; its place is said where it is another channel."""
        return f"{spec.removesuffix('@' + channel)}{', zeros free' if self.wanders else ' alone'}"

    def _step_bars(self, channel: str) -> dict[str, AnswerStep]:
        return {_added(s.effects, channel): s for s in self.steps}

    def _answer_bar(self, channel: str) -> str:
        either = " or ".join(next(iter(self.equivalent), ()))
        return _added(self.effects, channel) or either or "answer"

    def _repr_html_(self) -> str:
        tables = "".join(
            f.to_html(na_rep="") for f in (self.gap_frame(), self.to_frame(), self.improved_frame()) if len(f)
        )
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.notes)
        return f"<p><b>{html.escape(self.answer)}</b></p>{tables}<ul>{notes}</ul>"


def _added(specs: Sequence[str], channel: str) -> str:
    """Bar of effects of the answer."""
    return " ".join(f"+ {spec.removesuffix('@' + channel)}" for spec in specs)


def _falling(errors: Mapping[str, float]) -> dict[str, float]:
    return dict(sorted(errors.items(), key=lambda item: -item[1]))


def _indented(title: str, text: str) -> str:
    return "\n".join([title, *(f"  {line}" for line in text.splitlines())])
