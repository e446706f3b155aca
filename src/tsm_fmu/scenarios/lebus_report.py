"""Report of the LeBus drive: errors there and back, beside the numbers of AME 2020."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..cosim.metric import Metric, Reported
from ..cosim.trajectory import Trajectory
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from .papers import NAMES

MM = 12.5
"""Tendon per radian of a wheel."""
Errors = Mapping[str, NDArray[np.float64]]
Found = Mapping[str, Mapping[str, Metric]]


def write_lebus_report(
    path: Path,
    runs: Mapping[str, Trajectory],
    found: Found,
    errors: Errors,
    beside: Mapping[str, Any],
    contradictions: Sequence[tuple[str, float, str]],
) -> Path:
    """Write the report of `lebus_drive`; ``found`` are its quantities by case, ``errors`` in mm."""
    summary = (
        "A LeBus wheel drive moves a weight 785 mm there and back through 1.5 m of sheath. The elastic part of the "
        "error is what the equations give; the 156 to 206 mm of lost motion at the reversal are slack, a parameter."
    )
    sections = [
        _table(found, beside["reported"]),
        _contradictions(contradictions),
        *(_condition(c, runs, errors) for c in NAMES if any(name.startswith(c) for name in runs)),
        *beside["ending"],
    ]
    return write_report(
        path, "LeBus double tendon-sheath drive (AME 2020)", summary, sections, {"tsm-fmu": __version__}
    )


def _table(found: Found, reported: Reported) -> Section:
    def rounded(q: Mapping[str, Metric], column: str) -> float | None:
        return round(q[column].value, 3) + 0.0 if column in q else None  # no -0

    beside = [
        (
            name,
            rounded(q, "forward_max"),
            _text(r["forward_max"]),
            rounded(q, back := "reverse_settled" if "reverse_settled" in r else "reverse_max"),
            _text(r[back]),
        )
        for name, q in found.items()
        if (r := reported.get(name)) is not None
    ]
    columns = ("forward_max", "forward_max_at", "forward_end", "reverse_max", "reverse_settled", "lost_motion")
    every = [(name, *(rounded(q, column) for column in columns)) for name, q in found.items()]
    driven = [
        (name, *(rounded(q, column) for column in ("motor_torque_max", "wheel_friction_max")))
        for name, q in found.items()
        if "motor_torque_max" in q
    ]
    text = (
        "Errors in mm of tendon, reference minus follower. The way back is a consequence of the parameter slack, "
        "chosen per case from the reported values; elastic strain adds the rest.\n\nA weight that hangs on one tendon "
        "(hanging) turns the follower back by itself and shows no slack. With the layers of the winding the error "
        "peaks near 2/3 of the stroke and falls again, the shape that the paper describes, without any friction.\n\nA "
        "compensator with the right parameters leaves what the stepper gives way under its load, so the reported "
        "residuals (ranges) say how well the real drive repeats, which no equation of the paper predicts; right after "
        "the turn the follower waits until the motor has taken up the slack. compensated_path_only leaves the winding "
        "strain, which the paper's equations do not have; compensated_lugre shows how little the LuGre term moves the "
        "follower: it cannot be what removed the lost motion. compensated_jump has a motion card without a "
        "highest speed: asked for the slack in one step the stepper falls out of step, and the slack stays."
    )
    tables = [
        Table(("case", "there", "paper", "back", "paper"), beside, "Largest error [mm]." + _fit(found, reported)),
        Table(
            ("case", "there", "at travel", "at the turn", "back", "back, slack taken up", "lost motion"),
            every,
            "Largest error [mm]",
        ),
        Table(("case", "torque on the motor [N.m]", "friction on its wheel [N]"), driven, "Largest values"),
    ]
    return Section("Errors there and back", text, tables)


def _fit(found: Found, reported: Reported) -> str:
    """How well one EA serves the four loads and bends."""
    pairs = [
        (found[name]["forward_max"].value, printed.value)
        for name, r in reported.items()
        if isinstance(printed := r["forward_max"], Metric) and "forward_max" in found.get(name, {})
    ]
    if len(pairs) < len(NAMES):
        return ""
    rms = float(np.sqrt(np.mean([(ours - theirs) ** 2 for ours, theirs in pairs])))
    return (
        f" One EA inside the range of the fibre serves all four cases of the way there to {rms:.2f} mm rms: "
        "the measured errors grow faster with the load than those of any linear elastic tendon."
    )


def _contradictions(contradictions: Sequence[tuple[str, float, str]]) -> Section:
    table = Table(("elsewhere in the paper", "value [mm]", "against"), contradictions)
    return Section("Numbers of the paper that do not agree with each other", "", (table,))


def _text(printed: Metric | tuple[Metric, ...]) -> float | str:
    return printed.value if isinstance(printed, Metric) else " to ".join(f"{m.value:g}" for m in printed)


def _condition(condition: str, runs: Mapping[str, Trajectory], errors: Errors) -> Section:
    own = {name.partition(".")[2]: run for name, run in runs.items() if name.startswith(condition)}
    first = next(iter(own.values()))
    turn = int(np.argmax(first.columns["reference.y"]))
    loops, forward, back, residual = [], [], [], []
    for variant, run in own.items():
        travel, error = MM * run.columns["reference.y"], errors[f"{condition}.{variant}"]
        dashed = variant == "hanging"
        if variant.startswith("compensated"):
            residual.append(Line(variant, run.time[1:], error[1:]))
        else:
            forward.append(Line(variant, travel[1 : turn + 1], error[1 : turn + 1], dashed))
            back.append(Line(variant, travel[turn + 1 :], error[turn + 1 :], dashed))
        if variant in ("uncompensated", "compensated", "hanging"):
            loops.append(Line(variant, travel, MM * run.columns["transmission.theta_out"], dashed))
    tensions = [
        Line(
            f"{tendon}, {variant}",
            own[variant].time,
            own[variant].columns[f"transmission.{tendon}"],
            variant == "hanging",
        )
        for variant in ("uncompensated", "hanging")
        if variant in own
        for tendon in ("T_a", "T_b")
    ]
    figures = [
        figure
        for lines, figure in (
            (
                loops,
                loop_figure(loops, "Displacement over one cycle (Figs 15, 19, 20)", "reference [mm]", "follower [mm]"),
            ),
            (forward, loop_figure(forward, "Error on the way there (Fig. 16)", "reference [mm]", "error [mm]")),
            (back, loop_figure(back, "Error on the way back (Fig. 17)", "reference [mm]", "error [mm]")),
            (residual, time_figure(residual, "Error with compensation", "error [mm]")),
            (tensions, time_figure(tensions, "Tensions at the driver wheel", "T [N]")),
        )
        if lines
    ]
    return Section(f"{condition}: {NAMES[condition]}", "", (), figures)
