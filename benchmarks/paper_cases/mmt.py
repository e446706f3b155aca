"""MMT 2015: friction of the modified LuGre model, and a user who fits plain LuGre, the comparison of the paper.

The rig is `SingleTsmLuGre` with the published parameters: levels that differ between speeding up and slowing down
(Eqs (7)-(11)) and between pull and release, a quadratic presliding curve (Eq (5)), a reversal that leads. The user's
model has none of these; ``acceleration_branches`` is what the paper adds. The answer holds others beside it, since the
rig differs in more: direction and presliding curve do, and a lag of 0.05 s stands for the deflection that follows its
level within S/(2 rho), 0.07 s at 1 rad/s, while the library's branches act at once.
Motion is in rad, as in the paper; the preset ``mmt2015`` of `LuGreFriction` reads its m as rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tsm_fmu.kernels.arrays import FloatArray
from tsm_fmu.kernels.kernel import kernel

from .case import Case, logged

SAMPLE, LENGTH, FINER = 0.02, 24.0, 20
NOISE = 0.05
"""RMS noise of the friction force [N], 1 % of it."""
MOTIONS: tuple[Sequence[tuple[float, float, float]], ...] = (
    ((1.0, 0.2, 0.0),),
    ((0.5, 0.2, 0.3), (0.5, 0.25 * 3**0.5, 1.1)),
    ((0.7, 0.11, 0.3), (0.3, 0.61, 1.7)),
    ((0.6, 0.16, 0.5), (0.45, 0.37, 2.1)),
)
"""Amplitude [rad], frequency [Hz] and phase of the sines of each run: periodic and non-periodic as in Section 3.2, one
more, and the held-out one."""


def case(folder: Path) -> Case:
    """The logs in a folder, and what to ask."""
    logs = [_log(folder / f"run_{n}.csv", parts, n) for n, parts in enumerate(MOTIONS)]
    hidden = "acceleration branches"
    return Case("MMT 2015", hidden, "LuGreFriction:mmt2015", "acceleration_branches", logs[:3], logs[3:])


def _log(path: Path, parts: Sequence[tuple[float, float, float]], seed: int) -> Path:
    rig = kernel("SingleTsmLuGre")
    t: FloatArray = np.arange(round(LENGTH / SAMPLE) * FINER, dtype=float) * (SAMPLE / FINER)
    v, a = np.zeros(t.size), np.zeros(t.size)
    for size, f, phase in parts:
        w = 2.0 * np.pi * f
        v += size * w * np.cos(w * t + phase)
        a -= size * w**2 * np.sin(w * t + phase)
    given = {"v": v, "a": a, "T_in": np.full(t.size, 20.0), "T_load": np.zeros(t.size)}
    outputs = rig.simulate(rig.params("published"), t, np.column_stack([given[i.name] for i in rig.inputs]))
    force = outputs[:, [o.name for o in rig.outputs].index("F")]
    return logged(path, t[::FINER], {"v": (v[::FINER], "m/s", 0.0), "F": (force[::FINER], "N", NOISE)}, seed)
