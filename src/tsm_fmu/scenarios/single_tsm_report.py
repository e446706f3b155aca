"""Report of the single-tendon force estimate: friction as in the figures of the papers, estimated and true tension."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from pathlib import Path
from typing import Any

from .. import __version__
from ..cosim.metric import Metric, Reported
from ..cosim.trajectory import Trajectory
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from .papers import MMT_MSE_LUGRE, MMT_MSE_PERIODIC

R = 0.025
WINDOWS = {"dahl": 2.0}
"""Last seconds shown; 10 s for the slow motions."""
FIGURES = {
    "dahl.1_hz": "ICINCO 2013, Fig. 6",
    "dahl.08_hz": "ICINCO 2013, Fig. 7",
    "bouc_wen.multi_periodic": "IFToMM 2013, Figs 3 and 4",
    "modified_lugre.periodic": "MMT 2015, Fig. 6",
    "modified_lugre.non_periodic": "MMT 2015, Fig. 7",
    "modified_lugre.driven_periodic": "MMT 2015, Fig. 6, behind a motor",
    "modified_lugre.driven_non_periodic": "MMT 2015, Fig. 7, behind a motor",
    "swapped_lugre.periodic": "MMT 2015, Fig. 6, pull branches swapped",
    "swapped_lugre.non_periodic": "MMT 2015, Fig. 7, pull branches swapped",
}


def write_single_tsm_report(
    path: Path,
    runs: Mapping[str, Trajectory],
    found: Mapping[str, Mapping[str, Metric]],
    beside: Mapping[str, Any],
) -> Path:
    """Write the report of `single_tsm_force`; ``found`` are its quantities by case, ``beside`` what stands beside."""
    groups: dict[str, dict[str, Trajectory]] = {}
    for name, run in runs.items():
        group, _, estimator = name.rpartition(".")
        groups.setdefault(group, {})[estimator] = run
    wrong = {n: q["error_over_friction"].value for n, q in found.items() if n.endswith(".lugre")}
    summary = "Distal tension of a single tendon-sheath mechanism, estimated from the drive side alone."
    if wrong:
        least, most = min(wrong.values()), max(wrong.values())
        summary += (
            f" A symmetric friction law of the speed is wrong by {least:.0f} to {most:.0f} % of the friction (rms): "
            "that much of it lies in asymmetry and acceleration."
        )
    groups_shown = (_group(name, group) for name, group in groups.items())
    sections = [_table(found, beside["reported"]), *groups_shown, *beside["ending"]]
    return write_report(path, "Distal tension from proximal signals", summary, sections, {"tsm-fmu": __version__})


def _table(found: Mapping[str, Mapping[str, Metric]], reported: Reported) -> Section:
    columns = ("error_mean", "error_std", "error_peak_to_peak", "error_mse", "error_over_friction")
    heading = ("case", "mean", "std", "peak to peak", "MSE", "rms, % of F")
    rows = [(name, *(_rounded(q[column].value) for column in columns)) for name, q in found.items()]
    beside = [
        (name, f"{quantity} [{printed.unit}]", printed.value, _rounded(found[name][quantity].value))
        for name, numbers in reported.items()
        if name in found
        for quantity, printed in numbers.items()
        if isinstance(printed, Metric)
    ]
    text = (
        "Error T_out - T_load from 5 s on. With the plant's own model and parameters the estimate is exact: sign and "
        "timing of the chain are right. The papers' errors are those of a fit to measurements that are not published, "
        "so they have no counterpart here; a wrong sliding level (levels_110) shows what a change of the bend by 10 % "
        "costs.\n\n"
    )
    tables = [Table(heading, rows, "[N], MSE in N2"), Table(("case", "quantity", "paper", "here"), beside)]
    return Section("Error of the distal tension", text + _published_lugre(found), tables)


def _rounded(value: float) -> float:
    return round(value, 6) + 0.0  # no -0


def _published_lugre(found: Mapping[str, Mapping[str, Metric]]) -> str:
    """Whether the two MSE of MMT 2015 can be about one measurement: triangle inequality of the rms values."""
    law, model = sqrt(MMT_MSE_LUGRE), sqrt(MMT_MSE_PERIODIC)
    least, most = (law - model) ** 2, (law + model) ** 2
    words = [
        f"{order} gives {mse:.3f}, {'inside' if least <= mse <= most else 'outside'}"
        for order, name in (("the printed order of the pull branches", "modified"), ("the swapped one", "swapped"))
        if (metric := found.get(f"{name}_lugre.periodic.lugre", {}).get("error_mse")) is not None
        for mse in [metric.value]
    ]
    if not words:
        return ""
    return (
        "The published LuGre set of MMT 2015 can be compared: if both reported MSE are about one measurement, its MSE "
        f"against the modified model lies between {least:.3f} and {most:.3f} (triangle rule); {'; '.join(words)}."
    )


def _group(name: str, runs: Mapping[str, Trajectory]) -> Section:
    first = next(iter(runs.values()))
    shown = first.time >= first.time[-1] - WINDOWS.get(name.partition(".")[0], 10.0)
    time = first.time[shown]

    def column(run: Trajectory, address: str) -> Any:
        return run.columns[address][shown]

    tension = column(first, "load.tau") / R
    tensions = [Line("T_in", time, column(first, "plant.T_drive")), Line("T_out", time, tension, dashed=True)]
    frictions = [Line("plant", time, column(first, "plant.F"))]
    angle, speed = ("motor.phi", "motor.omega") if "motor.phi" in first.columns else ("reference.y", "reference.dy")
    over_speed = [Line("plant", column(first, speed), column(first, "plant.F"))]
    over_angle = [Line("plant", column(first, angle), column(first, "plant.F"))]
    for estimator, run in runs.items():
        if estimator == "same":
            continue
        force = column(run, "estimator.F")
        tensions.append(Line(f"T_out, {estimator}", time, tension + column(run, "error.y")))
        frictions.append(Line(estimator, time, force))
        over_speed.append(Line(estimator, column(run, speed), force))
        over_angle.append(Line(estimator, column(run, angle), force))
    figures = (
        time_figure(frictions, "Friction", "F [N]"),
        loop_figure(over_speed, "Friction over speed", "v [rad/s on the pulley]", "F [N]"),
        loop_figure(over_angle, "Friction over position", "x [rad on the pulley]", "F [N]"),
        time_figure(tensions, "Tension at the drive, at the load, and as estimated", "T [N]"),
    )
    return Section(f"{name}: {FIGURES.get(name, 'signals')}", "", (), figures)
