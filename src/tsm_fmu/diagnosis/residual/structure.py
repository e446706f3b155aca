"""How much of a residual is a law: what a flexible regression predicts on parts of the log that it has not seen.

Coloured noise cannot be predicted from the motion, so this share needs neither repeats nor a noise model. The
regression is linear in smooth and switching functions of the coordinates; it is judged by blocks that were left
out, whole runs where there are several.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ...regression.problem import FloatArray
from ..runs.motion_signals import Coordinates

BLOCKS = 4
"""Contiguous folds of a single run."""
MOST_FOLDS = 6
DAMPING = (1e-4, 1e-2, 1.0)
"""Ridge factors tried, relative to the samples."""
ROWS = 3000
"""Rows of one run that the regression sees."""


def predictable_share(residuals: Sequence[FloatArray], places: Sequence[Coordinates]) -> FloatArray:
    """Share of each channel's residual mean square that the coordinates predict where it was not fitted, 0 to 1.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
        One array a run.
    places : sequence of Coordinates
    """
    library = [features(c, places) for c in places]
    steps = [max(1, m.shape[0] // ROWS) for m in library]
    library = [m[::s] for m, s in zip(library, steps, strict=True)]
    wanted = [r[::s] for r, s in zip(residuals, steps, strict=True)]
    fold = _folds([m.shape[0] for m in library])
    x, y = np.concatenate(library), np.concatenate(wanted)
    scale = np.sqrt(np.mean(x**2, axis=0))
    x = x[:, scale > 1e-9] / scale[scale > 1e-9]
    best = np.zeros(y.shape[1])
    for damping in DAMPING:
        left = np.zeros(y.shape[1])
        for f in np.unique(fold):
            seen = fold != f
            gram = x[seen].T @ x[seen] + damping * seen.sum() * np.eye(x.shape[1])
            left += np.sum((y[~seen] - x[~seen] @ np.linalg.solve(gram, x[seen].T @ y[seen])) ** 2, axis=0)
        best = np.maximum(best, 1.0 - left / np.maximum(np.sum(y**2, axis=0), 1e-300))
    return best


def features(c: Coordinates, all_runs: Sequence[Coordinates]) -> FloatArray:
    """Functions of the coordinates that a missing law may be made of, one column each."""
    columns = named_features(c, all_runs)
    return np.column_stack(list(columns.values()))


def named_features(c: Coordinates, all_runs: Sequence[Coordinates]) -> dict[str, FloatArray]:
    """The same by name; x, v, a and the load are in units of their size over all runs."""

    def size(name: str) -> float:
        return float(np.sqrt(np.mean(np.concatenate([getattr(r, name) for r in all_runs]) ** 2))) or 1.0

    centre = float(np.mean(np.concatenate([r.x for r in all_runs])))
    span = max(float(np.ptp(r.x)) for r in all_runs) or 1.0
    x, v, a = 2.0 * (c.x - centre) / span, c.v / size("v"), c.a / size("a")
    s = c.s
    length = max(float(r.time[-1] - r.time[0]) for r in all_runs) or 1.0
    t = (c.time - c.time[0]) / length
    found = {
        "1": np.ones(x.size), "x": x, "x^2": x**2, "x^3": x**3, "v": v, "|v|": np.abs(v), "v|v|": v * np.abs(v), "a": a,
        "a s": a * s, "s": s, "s x": s * x, "s x^2": s * x**2, "x v": x * v, "sqrt|v| s": np.sqrt(np.abs(v)) * s,
        "t": t, "s t": s * t, "s exp(-5t)": s * np.exp(-5.0 * t), "x t": x * t, "s sign(a)": s * np.sign(a),
        "sign(a)": np.sign(a),
    }  # fmt: skip
    for share in (0.01, 0.03, 0.1, 0.3):
        found[f"s exp(-d/{share:g})"] = s * np.exp(-c.since_reversal / (share * span))
    for share in (0.1, 0.3, 0.8):
        found[f"s exp(-|v|/{share:g})"] = s * np.exp(-np.abs(v) / share)
    if float(np.ptp(np.concatenate([r.x for r in all_runs]))) > 2.0:  # rad of drum
        for k in (1, 2, 3):
            found[f"cos {k}x"], found[f"sin {k}x"] = np.cos(k * c.x), np.sin(k * c.x)
    for lag in (0.003, 0.01, 0.03, 0.1):
        keep = np.exp(-1.0 / max(lag * c.time.size, 1e-9))
        slow, _ = lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])
        found[f"x lagged {lag:g}"] = x - slow
        slow, _ = lfilter([1.0 - keep], [1.0, -keep], s, zi=[keep * s[0]])
        found[f"s lagged {lag:g}"] = s - slow
    if any(np.ptp(r.dwell) > 0.0 for r in all_runs):
        found["s exp(-d) ln(hold)"] = s * np.exp(-c.since_reversal / (0.05 * span)) * np.log1p(c.dwell)
    if c.load is not None:
        w = c.load / size("load")
        found |= {"L": w, "|L|": np.abs(w), "s L": s * w, "s|L|": s * np.abs(w), "x L": x * w, "v L": v * w}
        found |= {"s L^2": s * w**2, "L^2": w**2}
    return found


def _folds(sizes: Sequence[int]) -> NDArray[np.int_]:
    if len(sizes) >= 3:
        return np.repeat(np.arange(len(sizes)) % MOST_FOLDS, sizes)
    return np.concatenate([(np.arange(n) * BLOCKS // n) + 10 * k for k, n in enumerate(sizes)])
