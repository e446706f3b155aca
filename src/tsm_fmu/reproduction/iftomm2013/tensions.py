"""IFToMM 2013, Fig. 1: output tension over input tension, from loops of FMUs with a spring at the far end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...cosim.trajectory import Trajectory
from ...report import Figure, Line
from ...scenarios import single_tsm_force
from ...scenarios.single_tsm_force import R
from ..claims import Claim, Method, Open, open_claim
from ..draw import plot
from ..loops import FMUS, co_simulate
from ..verdict import Span
from .properties import MOTION, READINGS, SYMBOLS

FIG_1_SPRING = Open("spring and pretension", "1000 N/m, 18 N", "not printed; both ends stay taut")


def tension_runs() -> dict[str, Trajectory]:
    """The loop of `single_tsm_force` with each reading of the two unnamed numbers."""
    fmus = {model: FMUS[model] for model in single_tsm_force.FMUS}
    sheath = single_tsm_force.SHEATHS["bouc_wen"]
    motion = sheath.motions["multi_periodic"]
    experiment = replace(single_tsm_force.EXPERIMENT, stop=20.0)
    cases = {
        name: (
            single_tsm_force.loop(fmus, "tensions", replace(sheath, preset=preset), motion, "same", driven=True),
            experiment,
        )
        for name, preset in READINGS.items()
    }
    return co_simulate(cases, single_tsm_force.RECORD)


def tension_claim(runs: Mapping[str, Trajectory]) -> Claim:
    """Row on phases 1 and 3, where the output rests, against 2 and 4, where it follows the input."""
    return open_claim(
        "iftomm2013.phases",
        "Fig. 1",
        "dT_out/dT_in just after a reversal over that at the highest speed of the same stroke, three readings",
        "'the tendon tension for the output side will remain nearly constant before starting to increase with the "
        "input tendon': below 1 the output follows less, as the input has to change friction first; how nearly "
        "constant it is hangs on the spring, which is not printed",
        ours=Span.of(*(_slopes(run) for run in runs.values())),
        unit="1",
        assumed=(MOTION, SYMBOLS, FIG_1_SPRING),
        method=Method.CO_SIMULATION,
    )


def _slopes(run: Trajectory) -> float:
    """Largest ratio over the strokes after the first period; while the motor sticks at a turn nothing changes."""
    moves = run.columns["motor.omega"] != 0.0
    speed, T_in, T_out = (run.columns[c][moves] for c in ("motor.omega", "plant.T_drive", "load.tau"))
    slope = np.diff(T_out / R) / np.diff(T_in)
    turns = np.flatnonzero(np.diff(np.sign(speed)) != 0.0) + 1
    turns = turns[run.time[moves][turns] > single_tsm_force.EXPERIMENT.evaluate_from]
    ratios = []
    for begin, end in pairwise(turns):
        fastest = begin + int(np.argmax(np.abs(speed[begin:end])))
        ratios.append(slope[begin + 1] / slope[fastest])
    return float(max(ratios))


def tension_figures(runs: Mapping[str, Trajectory]) -> tuple[Figure, ...]:
    """Output over input tension, and both over time."""
    first = next(iter(runs.values()))
    later = first.time >= 10.0
    loops = [Line(n, r.columns["plant.T_drive"][later], r.columns["load.tau"][later] / R) for n, r in runs.items()]
    ends = [
        Line(name, first.time[later], force[later])
        for name, force in (("T_in", first.columns["plant.T_drive"]), ("T_out", first.columns["load.tau"] / R))
    ]
    return (
        plot(loops, "Output over input tension", "T_in [N]", "T_out [N]"),
        plot(ends, "Tensions, reading A", "time [s]", "T [N]"),
    )
