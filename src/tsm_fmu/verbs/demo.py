"""The whole path on shipped data: FMUs built, the paper's loop co-simulated, a log fitted, its FMU replayed, a report.

The sample log is made by ``build_scripts/make_sample_log.py`` from a plant that is none of our models; two runs
with different motions, one to fit, one to judge.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..card import ModelCard, write_card
from ..cosim.cases import run_cases, selected, statistics
from ..cosim.metric import CaseMetrics, Metric
from ..cosim.replay import agreement, replay
from ..cosim.trajectory import Trajectory
from ..fmu.build import build_fmu
from ..fmu.validate import validate_fmu
from ..identification.fit import Fit, fit
from ..identification.result import model_card
from ..kernels.kernel import Kernel, kernel
from ..logs.record import Record
from ..logs.whole_file import check_folder
from ..models import MODELS
from ..regression.specification import fit_run, per_run_fields, search_space
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from ..scenarios import mssp_feedforward
from ..scenarios.papers import MSSP_RESIDUAL_DEG, MSSP_WIDTH_DEG
from .samples import sample

MODEL = "PairedTsmBacklash"
CHANNEL = "x_out"
MEASURED, HOLDOUT = "sine", "multisine"
CASES = ("periodic.uncompensated", "periodic.law_1", "periodic.b065_law_1")
SETTLED = 2.0
"""Seconds at the start of a run that are not scored."""


def run_demo(out: Path, progress: Callable[[str], None] = lambda _: None) -> Path:
    """Run the demo and return the report's path.

    Parameters
    ----------
    out : Path
        Folder for FMUs, card, results and report.
    progress : callable
        Called with a line before each step.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    check_folder(out)
    progress(f"building {len(MODELS)} FMUs")
    fmus = {m.NAME: build_fmu(Kernel(m), out / "fmus") for m in MODELS}
    progress("co-simulating the loop of MSSP 2015 with and without compensation")
    cases = selected(mssp_feedforward.cases(fmus), CASES)
    runs = run_cases(cases, record=mssp_feedforward.RECORD)
    metrics = statistics(cases, runs)
    progress(f"fitting {MODEL} to the sample log")
    measured, holdout = (sample(name) for name in (MEASURED, HOLDOUT))
    fitted, card = _identified(measured, holdout)
    card_path = out / "card.toml"
    write_card(card_path, card)
    progress("exporting the fitted model as an FMU and replaying the log through it")
    model = card.kernel()
    starts = model.named(card.params())
    fmu = build_fmu(model, out / "fmus" / "FittedDrive.fmu", name="FittedDrive", start_values=starts)
    replays = {record.name: _replayed(fmu, card, fitted, record) for record in (measured, holdout)}
    progress("writing the report")
    return _report(out, {**fmus, "FittedDrive": fmu}, runs, metrics, fitted, replays, [measured, holdout])


def _identified(measured: Record, holdout: Record) -> tuple[Fit, ModelCard]:
    model = kernel(MODEL)
    result = fit(
        model,
        [fit_run(model, measured, [CHANNEL])],
        [CHANNEL],
        search_space(model, per_run=per_run_fields(model)),
        holdout=[fit_run(model, holdout, [CHANNEL])],
    )
    return result, model_card(result, "published", [measured], [holdout])


def _replayed(fmu: Path, card: ModelCard, fitted: Fit, record: Record) -> dict[str, Any]:
    """The record through the FMU, beside the kernel and the best straight line."""
    run_values = fitted.runs[record.name].values
    run = replay(fmu, record, parameters=dict(run_values))
    model = card.kernel()
    values = {**{name: p.value for name, p in card.parameters.items()}, **run_values}
    from_kernel = model.simulate(model.params(values=values), record.time, record.inputs_for(model))
    scored = record.time >= record.time[0] + SETTLED
    x, y = record.columns["x_in"][scored], record.columns[CHANNEL][scored]
    line = y - np.polyval(np.polyfit(x, y, 1), x)
    cut = {name: values[scored] for name, values in run.columns.items()}
    part = Record(record.name, record.time[scored], {k: v[scored] for k, v in record.columns.items()}, record.units)
    return {
        "run": run,
        "rmse": Metric(float(np.degrees(agreement(part.time, cut, part)[CHANNEL].rmse)), "deg"),
        "line": Metric(float(np.degrees(np.sqrt(np.mean(line**2)))), "deg"),
        "lost_motion": lambda angle: angle - values["c"] * record.columns["x_in"] - values["x_0"],
        "from_kernel": float(np.max(np.abs(run.columns[CHANNEL] - from_kernel[:, 0]))),
    }


def _report(
    out: Path,
    fmus: Mapping[str, Path],
    runs: Mapping[str, Trajectory],
    metrics: Mapping[str, CaseMetrics],
    fitted: Fit,
    replays: Mapping[str, Mapping[str, Any]],
    records: Sequence[Record],
) -> Path:
    first, second = (replays[r.name] for r in records)
    width, reported = metrics["periodic.uncompensated"].tracked().peak_to_peak, MSSP_WIDTH_DEG["periodic"]
    summary = (
        f"The sample log was fitted to {first['rmse'].value:.2f} deg RMSE where a straight line leaves "
        f"{first['line'].value:.2f}, another motion it had not seen to {second['rmse'].value:.2f} deg "
        f"({second['line'].value:.2f}), both replayed through the exported FMU. The co-simulated loop of MSSP 2015 has "
        f"{width:.2f} deg of hysteresis without compensation; the paper reports {reported:g}."
    )
    roles = ("fitted", "not fitted")
    sections = [
        *(_replay_section(r, replays[r.name], role) for r, role in zip(records, roles, strict=True)),
        _parameters(fitted),
        _loop_section(runs, metrics),
        _fmu_section(fmus),
    ]
    provenance = {
        "tsm-fmu": __version__,
        **{f"{r.name} (sha256)": r.sha256 for r in records},
        "seed": fitted.seed,
        "command": "tsm-fmu demo",
    }
    return write_report(out / "report.html", "tsm-fmu demo", summary, sections, provenance)


def _replay_section(record: Record, found: Mapping[str, Any], role: str) -> Section:
    x, y, simulated = record.columns["x_in"], record.columns[CHANNEL], found["run"].columns[CHANNEL]
    after_transient = record.time >= record.time[0] + SETTLED

    def loop(title: str, label: str, part: Callable[[Any], Any]) -> Any:
        sides = [("measured", y, True), ("FMU", simulated, False)]
        lines = [
            Line(n, np.degrees(x[after_transient]), np.degrees(part(angle)[after_transient]), dashed)
            for n, angle, dashed in sides
        ]
        return loop_figure(lines, title, "x_in [deg]", label)

    history = [
        Line("measured", record.time, np.degrees(y), dashed=True),
        Line("FMU", record.time, np.degrees(simulated)),
    ]
    text = (
        f"RMSE {found['rmse'].value:.3f} deg from {SETTLED:g} s on; "
        f"the best straight line {found['line'].value:.3f} deg. "
        f"The FMU differs from the kernel by at most {found['from_kernel']:.1e} rad."
    )
    return Section(
        f"{record.name} ({role}): measured and replayed through the FMU",
        text,
        figures=(
            loop("Hysteresis loop", "x_out [deg]", lambda angle: angle),
            loop("Lost motion", "x_out - c x_in - x_0 [deg]", found["lost_motion"]),
            time_figure(history, "Distal angle", "deg"),
            time_figure([Line("FMU - measured", record.time, np.degrees(simulated - y))], "Error", "deg"),
        ),
    )


def _parameters(fitted: Fit) -> Section:
    rows = []
    for v in fitted.kernel.parameters:
        p = fitted.parameters[v.field]
        rows.append((v.name, p.value, p.stderr, v.quantity.unit, v.quantity.meaning))
    text = " ".join(f"{sentence[0].upper()}{sentence[1:]}." for sentence in fitted.findings)
    table = Table(("parameter", "value", "standard error", "unit", "meaning"), rows)
    return Section(f"Fitted parameters of {fitted.kernel.name}", text, (table,))


def _loop_section(runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics]) -> Section:
    forms = mssp_feedforward.closed_forms()
    rows = []
    for name in CASES:
        variant = name.partition(".")[2]
        tracked, form = metrics[name].tracked(), forms.get(variant)
        paper = (MSSP_WIDTH_DEG if variant == "uncompensated" else MSSP_RESIDUAL_DEG)["periodic"]
        rows.append(
            (
                variant,
                tracked.peak_to_peak,
                tracked.mean,
                tracked.std,
                None if form is None else form.value,
                paper,
            )
        )
    heading = ("case", "peak to peak [deg]", "mean [deg]", "std [deg]", "closed form [deg]", "paper [deg]")
    text = (
        "Reference, compensator, PID controller, DC motor, paired tendon-sheath drive (backlash and friction) and "
        "load, each an FMU, 60 deg at 0.2 Hz; error x_r - x_out from 10 to 20 s. With the published parameters the "
        f"printed law (law_1) cannot do better than {forms['law_1'].value:.2f} deg with a perfect model; b065 is a "
        "plant of the same loop width whose output does not run backwards after a reversal."
    )
    errors = [Line(n.partition(".")[2], r.time, np.degrees(r.columns["error.y"])) for n, r in runs.items()]
    return Section(
        "Closed loop of MSSP 2015, co-simulated", text, (Table(heading, rows),), (time_figure(errors, "Error", "deg"),)
    )


def _fmu_section(fmus: Mapping[str, Path]) -> Section:
    rows = []
    for name, path in fmus.items():
        problems = validate_fmu(path)
        with zipfile.ZipFile(path) as archive:
            count = len(archive.namelist())
        rows.append(
            (name, f"{path.stat().st_size / 1024:.0f} kB", count, "valid" if not problems else "; ".join(problems))
        )
    return Section(
        "FMUs built", f"In {next(iter(fmus.values())).parent}.", (Table(("FMU", "size", "files", "check"), rows),)
    )
