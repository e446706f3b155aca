"""MMT 2015: its models as FMUs on the motions of Section 5, in all readings at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product

import numpy as np

from ...cosim.ssp import Case
from ...cosim.system import Component, Connection, Experiment, System
from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...scenarios import single_tsm_force
from ..loops import FMUS, co_simulate
from ..motions import SECOND, signal
from ..recovery import Motion, Trial
from .printed import MSE
from .readings import EQUATIONS, MODEL, PRESETS

PERIODIC = ((1.0, 0.2),)
NON_PERIODIC = ((0.5, 0.2), (0.6, SECOND))
"""[rad, Hz], Section 5."""
MOTIONS = {"Fig. 6": PERIODIC, "Fig. 7": NON_PERIODIC}
EXPERIMENT = Experiment(stop=10.0, step=1e-3, evaluate_from=5.0)
COUNT = 2.0 * np.pi / (4.0 * 3600.0)
"""Of the encoder E6D-CWZ1E 3600P/R at the drive (Section 4.1), all edges [rad]."""
SENSOR = "Sum+quantisation@y"
NAMES = (
    "rho1", "rho2", "mu1", "mu2", "mu3", "kappa1", "kappa2", "kappa3", "kappa4", "kappa5", "lambda", "rho", "sigma0"
)  # fmt: skip
"""Identified parameters, Section 3.3."""
LUGRE_NAMES = ("sigma0", "sigma1", "sigma2", "F_c", "F_s", "v_s")
"""Identified parameters of the LuGre model, Section 3.2."""
WINDOWS = {"0-5 s": (0.0, 5.0), "5-10 s": (5.0, 10.0), "0-10 s": (0.0, 10.0)}


def plant(branches: str, equation: str) -> str:
    """Name of the component of one reading."""
    return f"{branches}_{'eq9' if equation == 'Eq. (9)' else 'eq10'}"


def runs() -> dict[str, Trajectory]:
    """Both motions: all readings, LuGre and the encoder; and the force loop of `single_tsm_force` for the tensions."""
    jobs: dict[str, Case] = {item: (_system(item), EXPERIMENT) for item in MOTIONS}
    loops = single_tsm_force.cases({model: FMUS[model] for model in single_tsm_force.FMUS})
    for motion in ("periodic", "non_periodic"):
        for estimator in ("same", "levels_110", "lugre"):
            name = f"modified_lugre.{single_tsm_force.DRIVEN}{motion}.{estimator}"
            system, _ = loops[name]
            jobs[name] = (system, Experiment(stop=10.0, step=2e-3, evaluate_from=5.0))
    return co_simulate(jobs)


def _system(item: str) -> System:
    parts = [
        Component("reference", FMUS["ReferenceSignal"], signal(MOTIONS[item])),
        Component("lugre", FMUS["LuGreFriction"], kernel("LuGreFriction").presets["mmt2015"].si),
        Component("encoder", FMUS[SENSOR], {"u2": 0.0, "u3": 0.0, "y.quantisation.q": COUNT}),
    ]
    wires = [("reference.dy", "lugre.v"), ("reference.y", "encoder.u1")]
    for (branches, preset), (equation, sign) in product(PRESETS.items(), EQUATIONS.items()):
        values = {"mu3": sign * kernel(MODEL).params("published").mu3, "T_in": 0.0, "T_load": 0.0}
        name = plant(branches, equation)
        parts.append(Component(name, FMUS[MODEL], {**kernel(MODEL).presets[preset].si, **values}))
        wires += [("reference.dy", f"{name}.v"), ("reference.ddy", f"{name}.a")]
    return System(tuple(parts), tuple(Connection(*wire, convert_units=False) for wire in wires), item)


def mse(a: FloatArray, b: FloatArray, time: FloatArray, window: str) -> float:
    """Mean square difference in a window [N2]."""
    start, stop = WINDOWS[window]
    kept = (time >= start) & (time <= stop)
    return float(np.mean((a - b)[kept] ** 2))


def trials(found: Mapping[str, Trajectory]) -> dict[str, Trial]:
    """Both published sets with the noise that the reported MSE leaves room for; LuGre on the periodic motion only."""
    inputs = {"x": ("reference.y", 1.0), "v": ("reference.dy", 1.0), "a": ("reference.ddy", 1.0)}
    output = f"{plant('printed', 'Eqs (10)-(12)')}.F"
    motions = tuple(Motion(found[item], inputs, output, (0.0, 10.0)) for item in MOTIONS)
    periodic = (Motion(found["Fig. 6"], {"v": inputs["v"]}, "lugre.F", (0.0, 10.0)),)
    noise = math.sqrt(MSE["Fig. 6"].span.middle)
    return {
        "set": Trial(MODEL, "published", "F", motions, NAMES, noise, 4e-3, encoder=COUNT),
        "LuGre": Trial("LuGreFriction", "mmt2015", "F", periodic, LUGRE_NAMES, noise, 2e-3),
    }
