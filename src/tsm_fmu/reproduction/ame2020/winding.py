"""AME 2020 Eq (4): the place of the tendon on the wheel, as printed and as the model reads it."""

from __future__ import annotations

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel


def rows_of_eq4(alpha_deg: float, P_s: float, alpha_s_deg: float, L_d0: float) -> list[float]:
    """Every z_p that Eq (4) as printed allows at an angle: its four ranges for all n."""
    found = []
    alpha_b = 180.0 - alpha_s_deg
    for n in range(12):
        first, second = 360.0 * n, 360.0 * (n + 1)
        if first < alpha_deg < first + alpha_s_deg:
            found.append(L_d0 - n * P_s)
        if first + alpha_s_deg < alpha_deg < second:
            found.append(L_d0 - n * P_s - P_s / (2.0 * alpha_b) * (alpha_deg - 360.0 * n - alpha_s_deg))
        if second < alpha_deg < second + alpha_s_deg:
            found.append(L_d0 - 0.5 * P_s * (2 * n + 1))
        if second + alpha_s_deg < alpha_deg < second + 360.0:
            drop = P_s / (2.0 * alpha_b) * (alpha_deg - 360.0 * n - 180.0 - alpha_s_deg)
            found.append(L_d0 - 0.5 * P_s * (2 * n + 1) - drop)
    return found


def winding_position(angles_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Wheel angles [deg] and z_p [m] of the model."""
    k = kernel("LebusWinding")
    rows = np.column_stack([np.radians(angles_deg), np.full(angles_deg.size, 1.0)])
    y = k.simulate(k.params("published"), np.arange(angles_deg.size, dtype=float), rows, compiled=False)
    return angles_deg, y[:, [v.name for v in k.outputs].index("z_p")]
