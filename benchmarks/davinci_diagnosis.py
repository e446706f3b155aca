"""Diagnosis of the da Vinci logs: a drive identified at the lowest load meets the higher ones.

``python -m benchmarks.davinci_diagnosis`` (or one of torque, motion, 'one offset', loads).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tsm_fmu.diagnosis.fits.refit import Task, as_given
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.identification.fit import fit
from tsm_fmu.kernels.chain import chain
from tsm_fmu.logs.record import Record, read_record
from tsm_fmu.regression.residuals import rms
from tsm_fmu.regression.specification import fit_run, per_run_fields, search_space

from .davinci_data import SETTLED, data_folder, values_of

LOWEST = ("00", "20", "40")
"""T4L4 at 0.1 A: 0.1, 0.3 and 0.5 Hz. The model is identified on them; they are the reference."""
HIGHER = ("03", "23", "43", "06", "26", "46", "09", "29", "49")
"""0.4, 0.7 and 1.0 A at the same frequencies: measured."""
HELD = {"T4L4, 0.3, 0.6, 0.9 A at 0.2 Hz": ("12", "15", "18"), "T4L4, 0.3, 0.6, 0.9 A at 0.4 Hz": ("32", "35", "38")}
"""Other loads at other frequencies."""
OTHER_TOOL = {"T4L2, 0.2 A at 0.2 Hz, 0.4 A at 0.4 Hz": ("11", "33")}
SPEED_FILTER = {"tau_v": 0.02}
CHANNELS = ("x_out", "tau_in")


@dataclass(frozen=True)
class Question:
    """What is asked of the logs: a channel, the effects that the model has already, and the runs."""

    channel: str
    known: tuple[str, ...] = ()
    identified: Sequence[str] = LOWEST
    measured: Sequence[str] = HIGHER
    reference: Sequence[str] = LOWEST
    fixed: tuple[str, ...] = ()


QUESTIONS = {
    "torque": Question("tau_in"),
    "motion": Question("x_out"),
    "one offset": Question("x_out", fixed=("x_0",)),
    "loads": Question("tau_in", ("load_dependence",), (*LOWEST, *HIGHER), (*LOWEST, *HIGHER), ()),
}


def run(name: str, channels: Sequence[str], tool: str = "T4L4") -> Record:
    """A run from the end of its start-up on, without the channels that are not asked for."""
    unused = {c: f"unused_{c}" for c in CHANNELS if c not in channels}
    return read_record(data_folder() / tool / f"{name}.csv.gz", start=SETTLED, mapping=unused, name=f"{tool}/{name}")


def identified(known: Sequence[str], names: Sequence[str]) -> Mapping[str, float]:
    """Parameters of a tendon drive, with the effects known, identified on runs in both channels."""
    model = chain("TendonDrive", tuple(known))
    runs = [fit_run(model, run(n, CHANNELS), CHANNELS) for n in names]
    space = search_space(model, None, SPEED_FILTER, list(SPEED_FILTER), per_run=per_run_fields(model))
    return values_of(fit(model, runs, CHANNELS, space))


def found(question: Question, held: Sequence[str] | None = None) -> Diagnosis:
    """The diagnosis."""
    names = [n for group in HELD.values() for n in group] if held is None else held
    one = [question.channel]
    return diagnose(
        chain("TendonDrive", question.known), [run(n, one) for n in question.measured],
        values=identified(question.known, question.identified), fixed=[*SPEED_FILTER, *question.fixed],
        reference=[run(n, one) for n in question.reference], holdout=[run(n, one) for n in names],
    )  # fmt: skip


def errors(diagnosis: Diagnosis, question: Question, names: Sequence[str], tool: str = "T4L4") -> list[float]:
    """RMSE on runs that were not fitted: the model as given, refitted, and with the answer's effects.

    Each run has its own offset and initial state from its first seconds.
    """
    runs, found = [run(n, diagnosis.channels, tool) for n in names], []
    for fit_ in (diagnosis.given, diagnosis.refitted, diagnosis.final):
        if fit_ is None:
            continue
        model = chain(fit_.model, fit_.effects)
        measured = [fit_run(model, r, diagnosis.channels) for r in runs]
        task = Task(fit_.model, measured, diagnosis.channels, fit_.values, fixed=(*SPEED_FILTER, *question.fixed))
        found.append(float(rms(as_given(task, fit_.effects).held_out_errors(measured))[0]))
    return found


def table(name: str) -> Iterator[str]:
    """The answer and the gaps of one question."""
    question = QUESTIONS[name]
    diagnosis = found(question)
    gap = diagnosis.gap[question.channel]
    factor, unit = (180.0 / np.pi, "deg") if question.channel == "x_out" else (1e3, "mN.m")
    yield f"{name}: {diagnosis.verdict} {', '.join(diagnosis.effects)}"
    yield diagnosis.answer
    if diagnosis.equivalent:
        yield f"not told apart: {diagnosis.equivalent}"
    yield f"| {question.channel}, RMSE [{unit}] | as identified | refitted | with the answer's effects |"
    yield "| --- | ---: | ---: | ---: |"
    rows = [("measured", [gap.before, gap.refitted, gap.after])]
    rows += [(f"held out: {k}", errors(diagnosis, question, names)) for k, names in HELD.items()]
    rows += [(f"held out: {k}", errors(diagnosis, question, names, "T4L2")) for k, names in OTHER_TOOL.items()]
    for what, values in rows:
        yield f"| {what} | {' | '.join(f'{factor * v:.3g}' for v in values)} |"
    yield f"noise floor {factor * gap.floor:.3g} {unit}"
    if gap.reference is not None:
        rest = factor * gap.reference
        yield f"what the same refit, with its nuisance parameters, leaves on the reference runs {rest:.3g} {unit}"
    interval = " to ".join(f"{x:.2f}" for x in gap.closure_interval or ())
    yield f"closure of the held-out gap {gap.closure or 0.0:.2f} ({interval})"
    for c in diagnosis.candidates[:8]:
        yield f"    {c.spec}: {c.score:.1f} dB, closes {c.closure_measured} measured, {c.closure_holdout} held out"
    yield f"these runs could not show: {', '.join(diagnosis.not_excited)}"


def main(words: Sequence[str]) -> int:
    """Print the tables wanted."""
    if not Path(data_folder()).is_dir():
        print(f"no {data_folder()} -- set TSM_FMU_DATA to the folder that contains davinci/", file=sys.stderr)
        return 2
    for name in words or QUESTIONS:
        print(*table(name), "", sep="\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
