"""Runs of the LeBus drive of AME 2020 through its model, and the tendon data they rest on."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from ...kernels.kernel import kernel
from ...models.laws.capstan import tension_integral
from ...models.lebus.rig import rig
from ...scenarios.papers import CASES, FORWARD_MM, WEIGHT_N
from ..motions import FloatArray

MODEL = "LebusTransmission"
STROKE = 0.785
"""[m]"""
MODULUS_N_TEX = (91.0, 140.0)
STRENGTH_N_TEX = (2.8, 4.0)
DENSITY_KG_M3 = 975.0
"""Tendon: ranges as printed, the density in the middle of 0.97 to 0.98 g/cm3."""


def tex() -> float:
    """Mass per length of the tendon as a solid cylinder [g/km]."""
    d = kernel(MODEL).params("published").d
    return math.pi / 4.0 * d**2 * DENSITY_KG_M3 * 1e6


def stiffness_band() -> tuple[float, float]:
    """EA [N] of the fibre's modulus range."""
    low, high = (modulus * tex() for modulus in MODULUS_N_TEX)
    return low, high


def parameters(case: str, **values: float) -> Any:
    """Parameters of the transmission in one case; path strain only unless ``winding_strain`` is set."""
    return kernel(MODEL).params(case, {"winding_strain": 0, **values})


def drive(p: Any, s_in: ArrayLike, load: ArrayLike) -> dict[str, FloatArray]:
    """Outputs of the transmission for driver travel [m] and load force [N]; ``s_out`` [m] besides."""
    k = kernel(MODEL)
    s = np.asarray(s_in, dtype=float)
    torque = np.broadcast_to(np.asarray(load, dtype=float), s.shape) * p.D / 2.0
    rows = k.simulate(p, 0.02 * np.arange(s.size), np.column_stack([s / (p.D / 2.0), torque]), compiled=False)
    found = {v.name: rows[:, j] for j, v in enumerate(k.outputs)}
    return {**found, "s_out": found["theta_out"] * p.D / 2.0}


def forward_error(case: str, rows: int = 2, **values: float) -> FloatArray:
    """Error [mm] over the forward stroke."""
    s = np.linspace(0.0, STROKE, rows)
    return 1e3 * (s - drive(parameters(case, **values), s, WEIGHT_N[case])["s_out"])


def cycle(case: str, *, changes_sides: bool, rows: int = 150, **values: float) -> tuple[FloatArray, FloatArray]:
    """Driver and follower travel [m] there and back; the weight stays on tendon a or changes to b at the turn."""
    s = np.concatenate([np.linspace(0.0, STROKE, rows), np.linspace(STROKE, 0.3, rows)[1:]])
    load = np.where(np.arange(s.size) < rows, 1.0, -1.0 if changes_sides else 1.0) * WEIGHT_N[case]
    return s, drive(parameters(case, **values), s, load)["s_out"]


def there_back_there(case: str, rows: int = 200) -> tuple[FloatArray, FloatArray]:
    """Driver and follower travel [m] over a whole cycle and the next stroke, with the slack of the case.

    The weight is set down at each turn while the driver takes up the slack, then hangs on the other tendon.
    """
    p = parameters(case, winding_strain=1)
    leg = np.linspace(0.0, STROKE, rows)
    s = np.concatenate([leg, STROKE - leg[1:], leg[1:]])
    hangs = np.where(leg[1:] >= p.slack, 1.0, 0.0)
    load = np.concatenate([np.ones(rows), -hangs, hangs]) * WEIGHT_N[case]
    return s, drive(p, s, load)["s_out"]


def lost_motion(case: str, *, changes_sides: bool, **values: float) -> float:
    """Driver travel [mm] at the turn before the follower moves."""
    s, out = cycle(case, changes_sides=changes_sides, rows=4, **values)
    error = 1e3 * (s - out)
    return float(error[3] - error[-1])


def tension_at_driver(case: str) -> float:
    """T_a0 [N] while pulling."""
    return float(drive(parameters(case), [0.0, STROKE], WEIGHT_N[case])["T_a"][-1])


def profile_integral(case: str) -> float:
    """I = int exp(-lam(l)) dl [m], Eq (21) with the running lam."""
    sheath = rig(parameters(case)).sheath
    return tension_integral(sheath, 0.0, sheath.lam, 1.0, -1.0)


def printed_error(case: str, EA: float, wheel_friction: float = 0.0) -> float:
    """Delta L_aw of Eq (24) [mm]: (T_a0 - T_0 - F) I/EA."""
    preload = parameters(case).T_0
    return 1e3 * (tension_at_driver(case) - preload - wheel_friction) * profile_integral(case) / EA


@cache
def fitted_stiffness(winding_strain: int) -> tuple[float, float]:
    """EA [N] that fits the four forward errors best, and the rms [mm] that stays."""

    def rms(EA: float) -> float:
        misses = [forward_error(c, EA=EA, winding_strain=winding_strain)[-1] - FORWARD_MM[c] for c in CASES]
        return float(np.sqrt(np.mean(np.square(misses))))

    best: Any = minimize_scalar(rms, bounds=(1500.0, 20000.0), method="bounded", options={"xatol": 0.1})
    return float(best.x), float(best.fun)


def compensated_error(case: str, rows: int = 40, **values: float) -> tuple[FloatArray, FloatArray]:
    """Wanted travel [m] there and back and the error [mm] with compensation.

    ``values`` change the compensator's parameters; without any it has those of the transmission. The weight changes
    sides at the turn, as the compensator is told.
    """
    p = kernel(MODEL).params(case)
    k = kernel("LebusCompensator")
    radius = p.D / 2.0
    wanted = np.concatenate([np.linspace(0.0, STROKE, rows), np.linspace(STROKE, 0.2, rows)[1:]])
    force = np.where(np.arange(wanted.size) < rows, 1.0, -1.0) * WEIGHT_N[case]
    time = 0.02 * np.arange(wanted.size)
    inputs = np.column_stack([wanted / radius, force])
    commanded = k.simulate(k.params(case, values), time, inputs, compiled=False)[:, 0]
    return wanted, 1e3 * (wanted - drive(p, commanded * radius, force)["s_out"])
