"""A fit as a report page: what was found, how well it is known, and what the model leaves unexplained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from .. import __version__
from ..kernels.arrays import FloatArray
from ..logs.display import display
from ..logs.record import Record
from ..models.contract import Variable
from ..regression.problem import FitRun
from ..report import Figure, Line, Section, Table, loop_figure, time_figure, write_report
from ..report.panel import Panel
from .fit import SETTLING, Fit
from .result import run_outputs

MOST_RUNS = 3
"""Runs drawn of each role; the tables hold them all."""


def write_fit_report(
    path: Path, fit: Fit, runs: Sequence[FitRun], records: Sequence[Record], effects: Sequence[str] = ()
) -> Path:
    """Write the page and return its path.

    Parameters
    ----------
    path : Path
    fit : Fit
    runs : sequence of FitRun
        All runs of the fit, measured ones first.
    records : sequence of Record
        Where they come from, in the same order.
    effects : sequence of str
        Effects of the model, for the title.
    """
    title = " + ".join([fit.kernel.name, *effects])
    plotted = [run for role in ("measured", "holdout") for run in _of_role(fit, runs, role)[:MOST_RUNS]]
    sections = [
        Section("What to know", "\n\n".join(f"{text[0].upper()}{text[1:]}." for text in fit.findings))
        if fit.findings
        else Section("What to know", "No bound holds the fit, and these runs determine every parameter."),
        Section("Parameters", _parameter_text(fit), _parameter_tables(fit)),
        Section("Errors", _error_text(fit), _error_tables(fit)),
        *(section for channel in fit.channels for section in _channel_sections(fit, channel, plotted, len(runs))),
    ]
    provenance = {
        "tsm-fmu": __version__,
        "method": f"{fit.method}, seed {fit.seed}" + ("" if fit.complete else ", interrupted"),
        "cost": f"{fit.evaluations} simulations of one run, {fit.wall_s:.2f} s",
        **{f"{fit.runs[r.name].role} run {r.name}": f"{r.source or 'in memory'}, SHA-256 {r.sha256}" for r in records},
    }
    return write_report(path, f"Identification of {title}", _summary(fit), sections, provenance, _proof(fit, plotted))


def _proof(fit: Fit, plotted: Sequence[FitRun]) -> Figure:
    """Output and error of a run that the fit did not see, else of a measured one."""
    run, channel = plotted[-1], fit.channels[0]
    show, unit = _plotted_axis(_output(fit, channel))
    measured, simulated = show(run.targets[:, 0]), show(run_outputs(fit, run)[:, 0])
    lines = [Line("measured", run.time, measured, dashed=True), Line(fit.kernel.name, run.time, simulated)]
    role = "held-out" if fit.runs[run.name].role == "holdout" else "measured"
    return Figure(
        f"{channel} of the {role} run {run.name}: measured (dotted) and {fit.kernel.name}, and the difference",
        (
            Panel("", f"{channel} [{unit}]", lines=lines, height=280),
            Panel(
                "time [s]",
                f"error [{unit}]",
                lines=[Line("error", run.time, simulated - measured, colour=5)],
                height=210,
            ),
        ),
        common_x=True,
    )


def _of_role(fit: Fit, runs: Sequence[FitRun], role: str) -> list[FitRun]:
    return [run for run in runs if fit.runs[run.name].role == role]


def _summary(fit: Fit) -> str:
    sentences = []
    for channel in fit.channels:
        show, unit = _plotted_axis(_output(fit, channel))
        text = f"{channel}: RMSE {show(fit.measured[channel].rmse):.4g} {unit} on the measured runs"
        if channel in fit.holdout:
            text += f", {show(fit.holdout[channel].rmse):.4g} {unit} on held-out ones"
        if channel in fit.noise_floor:
            text += f"; what does not repeat from period to period is {show(fit.noise_floor[channel]):.4g} {unit}"
        sentences.append(text + ".")
    return " ".join(sentences)


def _parameter_text(fit: Fit) -> str:
    intervals = {
        "linear": "95 % intervals are 1.96 standard errors to each side.",
        "profile": "95 % intervals end where the error, the others fitted anew, has risen as far as 1.96 standard "
        "errors of a linear parameter raise it; those of values per run are linear.",
    }[fit.interval_method]
    return (
        "Standard errors take the autocorrelation of the residual into account; "
        f"the residuals are worth {fit.uncertainty.effective_samples:.0f} independent samples. {intervals} "
        f"Condition number of the normalised sensitivities: {fit.uncertainty.condition_number:.4g}."
    )


def _parameter_tables(fit: Fit) -> list[Table]:
    rows = []
    for variable in fit.kernel.parameters:
        p = fit.parameters[variable.field]
        interval = " to ".join(f"{end:.5g}" for end in fit.intervals.get(variable.field, ()))
        remark = ", ".join(
            text
            for text, holds in {
                "fixed": not p.vary,
                "per run, mean": variable.field in fit.per_run,
                "on a bound": variable.field in fit.at_bound,
                "not determined": variable.field in fit.undetermined,
            }.items()
            if holds
        )
        about = variable.quantity.meaning
        rows.append((variable.name, p.value, p.stderr, interval, variable.quantity.unit, remark, about))
    heading = ("parameter", "value", "standard error", "95 % interval", "unit", "", "meaning")
    tables = [Table(heading, rows)]
    per_run = [v for v in fit.kernel.parameters if v.field in fit.per_run]
    if per_run:
        values = [(name, run.role, *(run.values[v.name] for v in per_run)) for name, run in fit.runs.items()]
        heading = ("run", "role", *(f"{v.name} [{v.quantity.unit}]" for v in per_run))
        tables.append(Table(heading, values, "One value for each run"))
    known = fit.uncertainty
    if len(known.names) > 1:
        names = [_parameter(fit, f).name for f in known.names]
        cells = [(name, *(f"{r:.3f}" for r in row)) for name, row in zip(names, known.correlation, strict=True)]
        tables.append(Table(("", *names), cells, "Correlation of the shared parameters"))
    return tables


def _error_text(fit: Fit) -> str:
    text = "RMSE/std is over the standard deviation of the measured channel."
    if fit.holdout:
        text += f" Of a held-out run the first {SETTLING:g} s give offset and initial state and are not scored."
    return text


def _error_tables(fit: Fit) -> list[Table]:
    rows = []
    pooled = [("all", role, scores) for role, scores in (("measured", fit.measured), ("holdout", fit.holdout))]
    for name, role, scores in [*((n, r.role, r.channels) for n, r in fit.runs.items()), *pooled]:
        for channel, score in scores.items():
            show, unit = _plotted_axis(_output(fit, channel))
            rows.append((name, role, channel, show(score.rmse), show(score.peak_to_peak_error), unit, score.nrmse))
    tests = [
        (channel, t.correlation_time_s, t.durbin_watson, t.ljung_box_p, t.jarque_bera_p)
        for channel, t in fit.residuals.items()
    ]
    return [
        Table(("run", "role", "channel", "RMSE", "peak to peak of error", "unit", "RMSE/std"), rows),
        Table(
            ("channel", "correlation time [s]", "Durbin-Watson", "p, white (Ljung-Box)", "p, normal (Jarque-Bera)"),
            tests,
            "Residual of the measured runs: a small p says that the model leaves something that is not noise",
        ),
    ]


def _channel_sections(fit: Fit, channel: str, plotted: Sequence[FitRun], total: int) -> list[Section]:
    output = _output(fit, channel)
    show, unit = _plotted_axis(output)
    column = fit.channels.index(channel)
    over = _abscissas(fit)
    fits: list[Figure] = []
    errors: list[Figure] = []
    lines: dict[str, list[Line]] = {name: [] for name in ("time [s]", *over)}
    for run in plotted:
        measured = show(run.targets[:, column])
        simulated = show(run_outputs(fit, run)[:, column])
        title = f"{channel}, run {run.name} ({fit.runs[run.name].role})"
        sides = {"measured": measured, fit.kernel.name: simulated}
        fits.append(
            time_figure([Line(name, run.time, y, name == "measured") for name, y in sides.items()], title, unit)
        )
        first = next(iter(over), None)
        if first is not None:
            x = over[first](run)
            loop = [Line(name, x, y, name == "measured") for name, y in sides.items()]
            fits.append(loop_figure(loop, f"Loop of {title}", first, f"{channel} [{unit}]"))
        lines["time [s]"].append(Line(run.name, run.time, simulated - measured))
        for name, of in over.items():
            lines[name].append(Line(run.name, of(run), simulated - measured))
    for name, several in lines.items():
        title = f"Model minus measured, over {name.partition(' [')[0]}"
        errors.append(loop_figure(several, title, name, f"error of {channel} [{unit}]"))
    few = (
        "" if len(plotted) == total else f"{len(plotted)} of {total} runs are drawn, at most {MOST_RUNS} of each role."
    )
    return [
        Section(f"{channel}: fit", few, figures=fits),
        Section(f"{channel}: residual", "A shape that all runs share is physics that the model lacks.", figures=errors),
    ]


def _abscissas(fit: Fit) -> dict[str, Callable[[FitRun], FloatArray]]:
    """What a residual is drawn over: the position and the speed that drive the model, as far as it has them."""
    names = [v.name for v in fit.kernel.inputs]
    found: dict[str, Callable[[FitRun], FloatArray]] = {}
    position = fit.kernel.roles.motion or next((n for n in names if n.startswith("x")), "")
    if position:
        j = names.index(position)
        show, unit = _plotted_axis(fit.kernel.inputs[j])
        found[f"{position} [{unit}]"] = lambda run: show(run.inputs[:, j])
        found[f"speed of {position} [{unit}/s]"] = lambda run: show(np.gradient(run.inputs[:, j], run.time))
    if "v" in names:
        k = names.index("v")
        show_v, unit_v = _plotted_axis(fit.kernel.inputs[k])
        if position:
            found.pop(f"speed of {position} [{_plotted_axis(fit.kernel.inputs[names.index(position)])[1]}/s]")
        else:
            travel = unit_v.removesuffix("/s")
            found[f"travel [{travel}]"] = lambda run: show_v(_integral(run.time, run.inputs[:, k]))
        found[f"v [{unit_v}]"] = lambda run: show_v(run.inputs[:, k])
    return found


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])


def _output(fit: Fit, channel: str) -> Variable:
    return next(v for v in fit.kernel.outputs if v.name == channel)


def _parameter(fit: Fit, field: str) -> Variable:
    return next(v for v in fit.kernel.parameters if v.field == field)


def _plotted_axis(variable: Variable) -> tuple[Callable[..., FloatArray], str]:
    """Conversion from SI to the unit that people read, and that unit."""
    axis = display(variable.quantity.unit)
    return (lambda values: axis.factor * np.asarray(values)), axis.unit
