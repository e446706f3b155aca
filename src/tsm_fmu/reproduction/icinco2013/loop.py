"""ICINCO 2013: the closed loop of its rig, `single_tsm_drive`, with the encoder that the paper prints."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...cosim.ssp import Case
from ...cosim.trajectory import Trajectory
from ...scenarios import single_tsm_drive as scenario
from ...scenarios.single_tsm_drive import GEAR, STEP, R, travel_mm
from ..loops import FMUS, co_simulate

__all__ = ["AMPLITUDES_MM", "ENCODER", "FREQUENCIES_HZ", "GEAR", "TOO_LARGE_MM", "R", "limit_cycle", "reach_mm", "runs"]

AMPLITUDES_MM = tuple(scenario.AMPLITUDES_MM.values())
FREQUENCIES_HZ = {"Fig. 6": 1.0, "Fig. 7": 0.8}
(TOO_LARGE_MM,) = scenario.TOO_LARGE.values()
WITH_ENCODER = {"PidController": "PidController+quantisation@y"}
ENCODER = 5e-6
"""Of the linear encoder at the drive [m], Section 2.1."""


def runs(quick: bool) -> dict[str, Trajectory]:
    """``item.amplitude`` in mm, ``reach`` at an amplitude beyond the drive, ``coarse`` with twice the step."""
    amplitudes = AMPLITUDES_MM[::2] if quick else AMPLITUDES_MM
    jobs = {f"{item}.{a:g}": _case(a, f) for item, f in FREQUENCIES_HZ.items() for a in {*amplitudes, 5.0}}
    jobs["reach"] = _case(TOO_LARGE_MM, 1.0)
    jobs["coarse"] = _case(5.0, 1.0, 2.0 * STEP)
    return co_simulate(jobs, scenario.RECORD)


def _case(amplitude_mm: float, frequency: float, step: float = STEP) -> Case:
    fmus = {model: FMUS[WITH_ENCODER.get(model, model)] for model in scenario.FMUS}
    system, experiment = scenario.case(fmus, "icinco2013", amplitude_mm, frequency, step=step)
    return system.with_values({"controller.y.quantisation.q": repr(ENCODER / R)}), experiment


def reach_mm(run: Trajectory) -> float:
    """Largest amplitude of a sine at 1 Hz whose speed the drive reaches both ways, from a run at its voltage [mm]."""
    speed = run.columns["motor.omega"][run.time > run.time[-1] / 3.0]
    return 1e3 * R * float(min(speed.max(), -speed.min())) / math.tau


def limit_cycle(run: Trajectory) -> Mapping[str, object]:
    """Time [s], travel [mm], speed [mm/s], friction [N] and the two tensions [N] after the first cycle."""
    last = run.time > run.time[-1] / 3.0
    return {
        "t": run.time[last],
        "x": travel_mm(run)[last],
        "v": 1e3 * R * run.columns["motor.omega"][last],
        "F": run.columns["plant.F"][last],
        "T_in": run.columns["plant.T_drive"][last],
        "T_out": run.columns["load.tau"][last] / R,
    }
