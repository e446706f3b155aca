"""Input signals of the reference experiment: one motion with reversals, a nested loop and holds, for every kernel.

The motion goes from knot to knot in half cosine waves, so that speed and acceleration are its exact derivatives.
What a kernel calls v or a are those derivatives; each other input follows the same motion at a pace of its own,
so that no two inputs turn at the same time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..kernels.kernel import Kernel
from ..models.contract import Variable

STEP = 1.0 / 64.0
"""Communication step [s]: a power of two, so that every host's clock gives the same times."""

KNOTS = (
    (0.06, 0.0),  # rest: the first two rows are equal, see `reference`
    (0.37, 0.83),
    (0.53, -0.91),
    (0.41, 0.47),
    (0.23, -0.19),  # a nested loop, back to where it began
    (0.19, 0.47),
    (0.31, 0.47),  # rest under load
    (0.47, -0.62),
    (0.11, -0.41),  # a small one at the other end
    (0.13, -0.62),
    (0.17, -0.62),
    (0.61, 1.0),
    (0.43, 0.071),
    (0.23, 0.071),
)
"""Duration of each move [s] and where it ends."""

DURATION = sum(duration for duration, _ in KNOTS)
ROWS = 1 + math.floor(DURATION / STEP)

SCALES = {
    "m": (0.0031, 0.0173),
    "rad": (0.31, 1.27),
    "N": (6.3, 3.7),
    "N.m": (0.037, 0.083),
    "V": (0.7, 11.3),
    "K": (297.0, 7.3),
}
"""Offset and amplitude by unit; for v and a by the unit of the way."""
OTHER = (0.13, 1.9)

SCALES_OF = {
    ("LebusWinding", "theta"): (31.3, 29.7),  # over both layers of the wheel
    ("LebusTransmission", "theta_in"): (0.31, 23.7),  # more than the lost motion of the published slack, both ways
    ("LebusTransmission", "tau_load"): (0.021, 0.057),  # up to 0.5 kg on the wheel, then the other tendon pulls
    ("LebusCompensator", "theta_r"): (0.31, 23.7),
    ("LebusCompensator", "T_measured"): (4.9, 2.9),
    ("HangingLoad", "s"): (0.0, 1.0),  # from one cord to the other
}
"""Where a model needs another range than its units suggest."""

_ORDER = {"v": 1, "a": 2}


def motion(time: float) -> tuple[float, float, float]:
    """Place, within -1 to 1, and its first and second derivative [1/s, 1/s2]."""
    begin, place = 0.0, 0.0
    for duration, goal in KNOTS:
        if time < begin + duration:
            rate, half = math.pi / duration, 0.5 * (goal - place)
            phase = rate * (time - begin)
            return (
                place + half * (1.0 - math.cos(phase)),
                half * rate * math.sin(phase),
                half * rate**2 * math.cos(phase),
            )
        begin, place = begin + duration, goal
    return place, 0.0, 0.0


def stimuli(kernel: Kernel, size: float = 1.0, step: float = STEP) -> list[list[float]]:
    """Input rows of a kernel, SI, at multiples of ``step``; at the default step the first two are equal.

    Parameters
    ----------
    kernel : Kernel
        Inputs called ``v`` and ``a`` are derivatives of its motion.
    size : float
        Makes every signal smaller, offset included.
    step : float
        Time from row to row [s].
    """
    times = [row * step for row in range(1 + math.floor(DURATION / step))]
    signals = [list(_signal(kernel.name, j, v, times)) for j, v in enumerate(kernel.inputs)]
    return [[size * signal[row] for signal in signals] for row in range(len(times))]


def _signal(model: str, position: int, variable: Variable, times: list[float]) -> Iterator[float]:
    order = _ORDER.get(variable.name, 0)
    quantity = variable.quantity
    unit = quantity.unit.partition("/")[0] if order else quantity.unit
    offset, amplitude = SCALES_OF.get((model, variable.name), SCALES.get(unit, OTHER))
    if order:
        offset = 0.0
    elif math.isfinite(quantity.lo):
        offset = max(offset, quantity.lo + amplitude)
    pace = 1.0 if order else 0.83**position
    for time in times:
        yield offset + amplitude * motion(pace * time)[order]
