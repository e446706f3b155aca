"""AME 2020: the LeBus transmission, and users whose model has neither its layers, nor its slack, nor its elasticity.

The rig is `LebusTransmission` with the published parameters (bends 180 deg). Its tension follows the capstan law along
the sheath, its slack is a length of tendon, its radii change by layer: none of the forms in `effects/`. The layer step
of the published tendon of 0.305 mm is 1 % of the motion, at the edge of what a diagnosis calls material; a tendon of
1 mm on the same wheel makes it 3 %. The other part of ``winding_crossover``, two bursts a turn, cannot come from these
models: the fleet angle changes the wheel's friction by 3e-5; ``benchmarks.blind`` hides such bursts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tsm_fmu.kernels.arrays import FloatArray
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios.papers import WEIGHT_N

from .case import Case, carded, logged

RADIUS = 0.0125
SAMPLE, LENGTH = 0.02, 60.0
ENCODER = 2e-4
"""RMS noise of the follower's angle [rad]."""
TURN = 2.0 * np.pi
Load = Callable[[FloatArray, int], FloatArray]


def wandering(t: FloatArray, seed: int, low: float, high: float) -> FloatArray:
    """Six sines between two frequencies [Hz], from 0, at most 1."""
    rng = np.random.default_rng(seed)
    f = np.exp(rng.uniform(np.log(low), np.log(high), 6))
    y = np.sum(np.sin(TURN * np.outer(t, f) + rng.uniform(0.0, TURN, 6)) * np.sqrt(low / f), axis=1)
    return (y - y[0]) / np.abs(y - y[0]).max()


def weight(t: FloatArray, seed: int) -> FloatArray:
    """The 0.5 kg of the paper, hanging."""
    return np.full(t.size, WEIGHT_N["m05_180"] * RADIUS)


def pulling(t: FloatArray, seed: int) -> FloatArray:
    """3 to 11 N on tendon a."""
    return RADIUS * (7.0 + 4.0 * wandering(t, seed + 50, 0.05, 0.8))


def either_way(t: FloatArray, seed: int) -> FloatArray:
    """Up to 8 N on either tendon, not in step with the motion."""
    return RADIUS * 8.0 * wandering(t, seed + 50, 0.05, 0.8)


@dataclass(frozen=True)
class Rig:
    """What is hidden, the user's model, the rig's parameters, its load, its first and last turn.

    The user's model passes the motion on without hysteresis (beta is nearly 0); what is in ``held`` no refit changes.
    """

    hidden: str
    model: str
    expected: str
    values: Mapping[str, float]
    load: Load
    turns: tuple[float, float]
    held: tuple[str, ...] = ()


RATIO_ONLY = ("beta", "alpha")
RIGS = {
    "layers_1mm": Rig(
        "layers, tendon 1 mm", "PairedTsmBacklash", "winding_crossover", {"layers": 1, "d": 1e-3}, weight, (0.0, 9.9),
        RATIO_ONLY,
    ),
    "layers": Rig(
        "layers, tendon 0.305 mm", "PairedTsmBacklash", "winding_crossover", {"layers": 1}, weight, (0.0, 9.9),
        RATIO_ONLY,
    ),
    "elastic": Rig("elastic tendon", "TendonDrive", "tendon_elasticity", {}, pulling, (0.0, 0.5)),
    "slack": Rig("slack of 154 mm", "TendonDrive", "slack", {}, either_way, (2.0, 8.0)),
}  # fmt: skip


def case(name: str, folder: Path) -> Case:
    """One of `RIGS`, with its logs in a folder: two measured, one held out."""
    rig = RIGS[name]
    logs = [_log(folder / f"run_{seed}.csv", seed, rig) for seed in (1, 2, 9)]
    card = carded(folder / "model.toml", rig.model, {"beta": -1e-3, "alpha": 10.1062}, rig.held)
    return Case("AME 2020", rig.hidden, str(card), rig.expected, logs[:2], logs[2:])


def _log(path: Path, seed: int, rig: Rig) -> Path:
    transmission = kernel("LebusTransmission")
    t = np.arange(0.0, LENGTH, SAMPLE)
    x = wandering(t, seed, 0.03, 0.3)
    x = TURN * np.interp(x, (x.min(), x.max()), rig.turns)
    tau = rig.load(t, seed)
    outputs = transmission.simulate(transmission.params("published", rig.values), t, np.column_stack([x, tau]))
    theta = outputs[:, [v.name for v in transmission.outputs].index("theta_out")]
    columns = {"x_in": (x, "rad", 0.0), "x_out": (theta, "rad", ENCODER), "tau_out": (tau, "N.m", 0.0)}
    return logged(path, t, columns, seed + 100)
