"""MMT 2015: its models as FMUs on the motions of Section 5, in all readings at once."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from scipy.signal import butter, filtfilt

from ...cosim.ssp import Case
from ...cosim.system import Component, Connection, Experiment, System
from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...scenarios import single_tsm_force
from ..loops import FMUS, co_simulate
from ..motions import SECOND, signal
from .readings import EQUATIONS, MODEL, PRESETS

PERIODIC = ((1.0, 0.2),)
NON_PERIODIC = ((0.5, 0.2), (0.6, SECOND))
"""[rad, Hz], Section 5."""
MOTIONS = {"Fig. 6": PERIODIC, "Fig. 7": NON_PERIODIC}
EXPERIMENT = Experiment(stop=10.0, step=1e-3, evaluate_from=5.0)
COUNT = 2.0 * np.pi / (4.0 * 3600.0)
"""Of the encoder E6D-CWZ1E 3600P/R at the drive (Section 4.1), all edges [rad]."""
SENSOR = "Sum+quantisation@y"
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
            name = f"modified_lugre.{motion}.{estimator}"
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


def prepared(run: Trajectory, cutoff: float) -> tuple[FloatArray, FloatArray]:
    """Speed and acceleration from the encoder as the papers do it: filtfilt, numerical differentiation."""
    step = float(run.time[1] - run.time[0])
    filter_: Any = butter(2, cutoff * 2.0 * step)
    x = filtfilt(filter_[0], filter_[1], run.columns["encoder.y"])
    v = np.gradient(x, step)
    return v, np.gradient(v, step)


def from_prepared(run: Trajectory, cutoff: float) -> FloatArray:
    """Friction of the identified model on prepared signals [N]."""
    v, a = prepared(run, cutoff)
    k = kernel(MODEL)
    rows = np.column_stack([{"v": v, "a": a}.get(i.name, np.zeros(v.size)) for i in k.inputs])
    return k.simulate(k.params("published"), run.time, rows)[:, [o.name for o in k.outputs].index("F")]
