"""``identify``: a model's parameters from measured runs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..card import ModelCard, write_card
from ..identification.fit import SETTLING, Fit, FitInterrupted, fit
from ..identification.nuisance import with_limited_delays, with_nuisance
from ..identification.result import as_json, model_card, run_outputs
from ..logs.agreement import Agreement
from ..logs.display import display
from ..logs.record import Record, cutoff_note
from ..logs.repeated import without_repeated_rows
from ..models.contract import Variable
from ..regression.problem import FitRun
from ..regression.solver import Report
from ..regression.specification import fit_run, measured_channels, not_in_every_run, per_run_fields, search_space
from ..report.text import text_table
from .models import ModelLike, resolve_model
from .runs import RunLike, grouped

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure


@dataclass(frozen=True)
class IdentifyResult:
    """A model fitted to runs; see `identify`.

    Attributes
    ----------
    fit : Fit
        Parameters, intervals, errors and findings in full.
    card : ModelCard
        The same as a model card: what `diagnose`, `simulate` and `export` take.
    records : tuple of Record
        The runs, fitted ones first.
    runs : tuple of FitRun
        The same as the fit saw them.
    notes : tuple of str
        What was derived, and which options had no effect.
    """

    fit: Fit
    card: ModelCard
    records: tuple[Record, ...]
    runs: tuple[FitRun, ...]
    notes: tuple[str, ...]

    @property
    def parameters(self) -> dict[str, float]:
        """Fitted values by public name, SI; of a per-run parameter the mean."""
        return {name: p.value for name, p in self.card.parameters.items()}

    @property
    def complete(self) -> bool:
        """Whether the fit was not interrupted; else it is the best until then."""
        return self.fit.complete

    @property
    def findings(self) -> tuple[str, ...]:
        """What a user should know of the fit, in sentences."""
        return self.fit.findings

    def summary(self) -> str:
        """Parameters, errors by run, noise floor and findings as text."""
        found = self.fit
        title = f"{'+'.join((found.kernel.name, *self.card.effects))}, method {found.method}"
        heading = ("parameter", "value", "standard error", "95 % interval", "unit", "")
        lines = [*self.notes, text_table(heading, [_parameter_row(found, v) for v in found.kernel.parameters], title)]
        scores = [
            (name, run.role, channel, *_score(score))
            for name, run in found.runs.items()
            for channel, score in run.channels.items()
        ]
        pooled = (("measured", found.measured), ("holdout", found.holdout))
        scores += [("all", role, c, *_score(score)) for role, of_role in pooled for c, score in of_role.items()]
        heading = ("run", "role", "channel", "RMSE", "peak to peak of error", "RMSE/std")
        lines += ["", text_table(heading, scores)]
        if found.holdout:
            lines.append(f"Held-out runs: the first {SETTLING:g} s give offset and initial state and are not scored.")
        for channel, floor in found.noise_floor.items():
            value = display(found.measured[channel].unit)(floor, 4)
            lines.append(f"Noise floor of {channel}: {value}, the part that does not repeat from period to period.")
        lines += [f"Note: {finding}." for finding in found.findings]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Parameters by public name: value, unit, stderr, low, high (95 %), fixed, per_run, at_bound, determined."""
        import pandas as pd

        rows = {}
        for name, p in self.as_json()["parameters"].items():
            low, high = p["interval"] or (None, None)
            row = {"value": p["value"], "unit": p["unit"], "stderr": p["stderr"], "low": low, "high": high}
            rows[name] = row | {key: p[key] for key in ("fixed", "per_run", "at_bound", "determined")}
        return pd.DataFrame.from_dict(rows, orient="index")

    def errors(self) -> pd.DataFrame:
        """Errors by run and channel, SI: role, unit, rmse, peak_to_peak_error, offset, shape_rmse, nrmse, samples."""
        import pandas as pd

        rows = [
            {"run": name, "role": run.role, "channel": channel, **vars(score)}
            for name, run in self.fit.runs.items()
            for channel, score in run.channels.items()
        ]
        return pd.DataFrame(rows)

    def figure(self, run: str | None = None, channel: str | None = None) -> Figure:
        """Measured and simulated output of one run over its first input: the loop, or over time without an input.

        Parameters
        ----------
        run : str, optional
            Name of a run; the first without it.
        channel : str, optional
            A fitted output; the first without it.
        """
        from ..report.figures import Line, loop_figure, time_figure

        number = next((k for k, one in enumerate(self.runs) if one.name == run), 0)
        one, column = self.runs[number], self.fit.channels.index(channel or self.fit.channels[0])
        name = self.fit.channels[column]
        show = display(self.fit.measured[name].unit)
        sides = {"measured": one.targets[:, column], "fitted": run_outputs(self.fit, one)[:, column]}
        title = f"{name}, run {one.name}"
        if not self.fit.kernel.inputs:
            lines = [Line(side, one.time, y * show.factor, side == "measured") for side, y in sides.items()]
            return time_figure(lines, title, show.unit)
        first = self.fit.kernel.inputs[0]
        x = one.inputs[:, 0] * display(first.quantity.unit).factor
        lines = [Line(side, x, y * show.factor, side == "measured") for side, y in sides.items()]
        label = f"{first.name} [{display(first.quantity.unit).unit}]"
        return loop_figure(lines, title, label, f"{name} [{show.unit}]")

    def write_card(self, path: str | os.PathLike[str]) -> Path:
        """Write the model card (TOML) and return its path."""
        write_card(path, self.card)
        return Path(path)

    def write_report(self, path: str | os.PathLike[str]) -> Path:
        """Write a page with tables and plots and return its path."""
        from ..identification.page import write_fit_report

        return write_fit_report(Path(path), self.fit, self.runs, self.records, self.card.effects)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``identify``."""
        return as_json(self.fit)

    def _repr_html_(self) -> str:
        return self.to_frame().to_html() + self.errors().to_html(index=False)


def identify(
    model: ModelLike,
    runs: RunLike | Sequence[RunLike],
    *,
    holdout: RunLike | Sequence[RunLike] = (),
    values: Mapping[str, float] | None = None,
    fixed: Sequence[str] = (),
    shared: Sequence[str] = (),
    nuisance: Sequence[str] = (),
    method: str = "fast",
    single_start: bool = False,
    intervals: str = "linear",
    cutoff: float | None = None,
    seed: int = 0,
    progress: Report | None = None,
) -> IdentifyResult:
    """Fit a model's parameters to measured runs, and judge them on runs that were not fitted.

    Parameters
    ----------
    model : str, path, ModelCard, Kernel or result
        ``MODEL[:PRESET][+EFFECT[@CHANNEL]...]``, a model card to start from, or what has one.
    runs, holdout : path, Record, DataFrame, or a sequence of them
        Runs to fit, and runs to judge: their inputs, and any outputs of the model that all of them hold.
    values : mapping of str to float, optional
        Start values by public name, SI.
    fixed : sequence of str
        Parameters that are not fitted.
    shared : sequence of str
        Offsets and initial states that are to have one value for all runs.
    nuisance : sequence of str
        ``delay@CHANNEL`` or ``offset@CHANNEL``, fitted too.
    method : {'fast', 'paper'}
        Least squares from several starts, or a genetic search followed by a simplex.
    single_start : bool
        Refine the start values only.
    intervals : {'linear', 'profile'}
        95 % intervals from the standard errors, or from the error itself.
    cutoff : float, optional
        Cut-off [Hz] where v and a are derived from x; from the data without it.
    seed : int
        Same seed, same result.
    progress : callable, optional
        Told how far the search is, see `tsm_fmu.regression.solver.Progress`.

    Returns
    -------
    IdentifyResult
        After Ctrl-C with the best values until then, and `complete` False.

    Raises
    ------
    InputError
        Unknown names, values out of bounds, runs that cannot be read or do not fit the model.
    """
    resolved = resolve_model(model)
    extended = with_nuisance(resolved.kernel, resolved.effects, nuisance)
    kernel = extended.kernel
    per_run = per_run_fields(kernel, shared, extended.per_run)
    space = search_space(kernel, resolved.preset or None, values, [*fixed, *extended.fixed], resolved.card, per_run)
    measured, held_out = grouped(runs, holdout)
    records, repeated = without_repeated_rows([*measured, *held_out])
    channels = measured_channels(kernel, records)
    fit_runs = [fit_run(kernel, record, channels, cutoff) for record in records]
    try:
        found = fit(
            kernel,
            fit_runs[: len(measured)],
            channels,
            with_limited_delays(space, extended.delays, fit_runs),
            holdout=fit_runs[len(measured) :],
            method=method,
            single_start=single_start,
            intervals=intervals,
            seed=seed,
            progress=progress,
        )
    except FitInterrupted as stopped:  # who fits one model wants to see what there is
        found = stopped.fit
    inputs = [v.name for v in kernel.inputs]
    derived = dict.fromkeys(note for run in fit_runs for note in run.derived)
    return IdentifyResult(
        found,
        model_card(found, resolved.preset, measured, held_out, extended.effects),
        tuple(records),
        tuple(fit_runs),
        (
            *repeated,
            *not_in_every_run(kernel, records),
            *derived,
            *cutoff_note(cutoff, records, inputs),
            *_per_run_notes(found),
        ),
    )


def _per_run_notes(found: Fit) -> tuple[str, ...]:
    """What the card says of parameters that each run has of its own."""
    names = [v.name for v in found.kernel.parameters if v.field in found.per_run]
    if not names:
        return ()
    count = sum(run.role == "measured" for run in found.runs.values())
    value = f"the mean of {count} runs" if count > 1 else "that of the measured run"
    return (
        f"each run has its own {', '.join(names)}: the card holds {value} beside them, and another run has another "
        "one, so that its errors have an offset",
    )


def _parameter_row(found: Fit, variable: Variable) -> tuple[str, ...]:
    p = found.parameters[variable.field]
    error = "" if p.stderr is None else f"{p.stderr:.2g}"
    interval = " to ".join(f"{end:.4g}" for end in found.intervals.get(variable.field, ()))
    remarks = {
        "fixed": not p.vary,
        "per run, mean": variable.field in found.per_run and len(found.runs) > 1,
        "on a bound": variable.field in found.at_bound,
        "not determined": variable.field in found.undetermined,
    }
    remark = ", ".join(text for text, holds in remarks.items() if holds)
    return variable.name, f"{p.value:.6g}", error, interval, variable.quantity.unit, remark


def _score(score: Agreement) -> tuple[str, str, str]:
    show = display(score.unit)
    return show(score.rmse, 4), show(score.peak_to_peak_error, 4), f"{score.nrmse:.3g}"
