"""Zeros that move slowly within a run, free in what a simulation is compared with.

A zero that wanders is no law of anything that a log holds. Left in, it hides what a law of the motion does, and other
laws bend to it; taken out as a few slow functions of time, which every residual is orthogonal to, it does neither: the
same as fitting their amplitudes in every fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray

RESOLVED = 0.1
"""RMS of a combination of the slow functions, over that of one alone, below which a part of a run does not hold it."""


@dataclass(frozen=True)
class SlowZero:
    """Channels of a run whose zero moves slowly.

    Attributes
    ----------
    channels : tuple of int
        Columns of the targets.
    start, end : float
        Of the whole run [s]; a part of it holds the same functions.
    functions : int
        Cosines of 1, 2, ... half periods from start to end.
    constant : bool
        Whether the zero itself is free too; else it is the run's offset, and the functions have none.
    """

    channels: tuple[int, ...]
    start: float
    end: float
    functions: int
    constant: bool = False

    def basis(self, time: FloatArray) -> FloatArray:
        """Orthonormal functions at times [s], shape (n, up to `functions`, and the constant)."""
        if not time.size:
            return np.empty((0, 0))
        phase = np.pi * (time - self.start) / (self.end - self.start)
        waves = np.cos(np.outer(phase, np.arange(self.functions + 1)))
        if not self.constant:
            waves = waves[:, 1:] - waves[:, 1:].mean(axis=0)
        left, sizes, _ = np.linalg.svd(waves, full_matrices=False)
        return np.ascontiguousarray(left[:, sizes > RESOLVED * np.sqrt(0.5 * time.size)])
