"""What the papers set out to beat: lumped masses with Coulomb friction, at their best against the papers' own models.

* *one mass*: a level of friction each way, at the sign of the speed.
* *many masses*: springs between masses that rub with the tension at their place (Kaneko et al. 1991). Without inertia
  their limit is the elastic tendon under capstan friction, whose two numbers are mu Theta and EA/L; it is played by the
  model LebusTransmission, with the far tension and the motion of the rig.

Both get their best values for the very force that they are judged by: what is left is the least that they can leave.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..kernels.arrays import BoolArray, FloatArray
from ..kernels.kernel import kernel

MANY = "LebusTransmission"
ONE_MASS, MANY_MASSES = "one mass", "many masses"
LENGTH, ANGLE = 1.5, math.pi
"""Of the sheath of the model [m, rad]; its friction and stiffness are fitted."""
STARTS = ((0.02, 2e3), (0.2, 2e4))
"""Start values of mu Theta and EA/L [N/m]."""
BOUNDS = ((1e-3, 50.0), (3.0, 1e6))
ROWS = 500


class Rubbed(NamedTuple):
    """A force to be explained: time [s], travel [m], speed, far tension [N], friction [N], and the scored rows."""

    time: FloatArray
    x: FloatArray
    v: FloatArray
    T_out: FloatArray
    F: FloatArray
    scored: BoolArray


def left(rubbed: Rubbed) -> dict[str, FloatArray]:
    """Friction that one mass and many masses leave unexplained [N], scored rows only."""
    r = _thinned(rubbed)
    return {ONE_MASS: _one_mass(r), MANY_MASSES: _many_masses(r)}


def _thinned(r: Rubbed) -> Rubbed:
    kept = slice(None, None, max(1, r.time.size // ROWS))
    return Rubbed(r.time[kept], r.x[kept], r.v[kept], r.T_out[kept], r.F[kept], r.scored[kept])


def _one_mass(r: Rubbed) -> FloatArray:
    force, way = r.F[r.scored], np.sign(r.v[r.scored])
    level = np.zeros(force.size)
    for side in (-1.0, 1.0):
        level[way == side] = np.mean(force[way == side])
    return force - level


def _many_masses(r: Rubbed) -> FloatArray:
    k = kernel(MANY)
    radius = k.params().D / 2.0
    columns = {"theta_in": (r.x - r.x[0]) / radius, "tau_load": r.T_out * radius}
    rows = np.column_stack([columns[v.name] for v in k.inputs])
    place = [v.name for v in k.outputs].index("T_a")
    fixed = {"L_1": LENGTH, "R_1": LENGTH / ANGLE, "slack": 1.0, "winding_strain": 0.0, "T_0": float(r.T_out[0])}

    def residual(logs: FloatArray) -> FloatArray:
        friction, stiffness = np.exp(logs)
        p = k.params(values={**fixed, "mu": friction / ANGLE, "EA": stiffness * LENGTH})
        return (r.F - (k.simulate(p, r.time, rows)[:, place] - r.T_out))[r.scored]

    options: dict[str, Any] = {"bounds": np.log(BOUNDS), "x_scale": 0.3, "diff_step": 1e-4, "max_nfev": 25}
    fits = [least_squares(residual, np.log(start), **options) for start in STARTS]
    return residual(min(fits, key=lambda fit: fit.cost).x)
