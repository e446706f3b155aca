"""What a residual without a name looks like: its dependence on the coordinates, and a short formula. Never a name.

A formula says which functions of the motion predict the residual on parts of the log that it has not seen. Many laws
have the same formula, and it holds within the range of these runs only.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.arrays import FloatArray, IntArray
from ...logs.display import display
from ...models.unit_text import simplified
from ..criteria import FORMULA_P, FORMULA_SHARE, FORMULA_TERMS
from ..evidence import Formula, Place, ResidualShape
from ..runs.motion_signals import Coordinates
from .dependence import dependence
from .library import folds, library
from .sparse import (
    Sums,
    best_subsets,
    coefficients_of,
    cross_validated_share,
    cross_validated_shares,
    fewest_terms,
    sums,
)
from .surrogates import SMALLEST, surrogates, tail

LEADING = 2
"""Coordinates shown for a channel."""
ROWS = 4000
FEW_NULLS, NULLS = 13, 39
"""Noises that a formula is compared with; so few where these leave no doubt."""


def shapes(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], channels: Sequence[str], units: Sequence[str],
    where: Sequence[Place], motion_unit: str, load_unit: str, seed: int = 0, formulas: bool = True,
) -> list[ResidualShape]:  # fmt: skip
    """Dependences and formula of each channel.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
    places : sequence of Coordinates
        At the same samples.
    channels, units : sequence of str
        SI units of the channels.
    where : sequence of Place
        Of `locate`; the leading coordinates of a channel are taken from it.
    motion_unit, load_unit : str
    seed : int
    formulas : bool
        Without, formulae stay empty.
    """
    found = []
    for c, (channel, unit) in enumerate(zip(channels, units, strict=True)):
        parts = [r[:, c] for r in residuals]
        of_channel = [p for p in where if p.channel == channel and p.unit != "Hz"]
        leading = [p.coordinate for p in of_channel if p.significant][:LEADING]
        dependences = [d for name in leading for d in dependence(parts, places, name, motion_unit, load_unit, seed)]
        law = formula(parts, places, unit, motion_unit, load_unit, seed) if formulas else Formula()
        found.append(ResidualShape(channel, unit, tuple(dependences), law))
    return found


def formula(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], unit: str, motion_unit: str, load_unit: str,
    seed: int = 0,
) -> Formula:  # fmt: skip
    """The shortest sum of functions of the coordinates that predicts a residual; empty text if none does.

    Terms, coefficients and their number are found without the fold on which they are judged; folds are runs, or
    blocks of a run where there are fewer than three. It stays empty unless the share predicted is worth it and noise
    of the residual's colour, put through the same, hardly ever reaches it. With PySINDy
    installed its STLSQ competes by the same measure.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n,)
        One channel, one array a run.
    places : sequence of Coordinates
    unit, motion_unit, load_unit : str
        SI units of the channel, of x, of the load.
    seed : int
    """
    step = max(1, sum(r.size for r in residuals) // ROWS)
    offered = library([c.part(slice(None, None, step)) for c in places], motion_unit, load_unit)
    parts = [r[::step] for r in residuals]
    matrix = np.column_stack([np.concatenate(term.values) for term in offered])
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    matrix /= scale
    fold = folds([p.size for p in parts])
    data = sums(matrix, np.concatenate(parts), fold)
    shares = cross_validated_shares(data)
    share = float(shares.max())
    if share < FORMULA_SHARE:
        return Formula(share=max(share, 0.0))
    rng = np.random.default_rng(seed)
    noise = np.concatenate([surrogates(p, NULLS, rng) for p in parts])
    by_chance = [_of_noise(data, matrix, noise[:, k], fold) for k in range(FEW_NULLS)]
    p = tail(share, np.array(by_chance))
    if p > SMALLEST:
        by_chance += [_of_noise(data, matrix, noise[:, k], fold) for k in range(FEW_NULLS, NULLS)]
        p = tail(share, np.array(by_chance))
    if p > FORMULA_P:
        return Formula(share=share, p=p)
    count = fewest_terms(shares)
    terms, optimiser = best_subsets(*data.whole, most=count)[-1], Formula.optimiser
    share = float(shares[count - 1])
    other = _by_sindy(matrix, np.concatenate(parts), count)
    if other and cross_validated_share(data, other) > cross_validated_share(data, terms):
        terms, optimiser = other, "PySINDy STLSQ"
    values = coefficients_of(*data.whole, terms) / scale[terms]
    found = tuple(
        (offered[j].text, float(value), simplified(f"{unit}/({offered[j].unit})"))
        for j, value in sorted(zip(terms, values, strict=True), key=lambda jv: -abs(jv[1]) * scale[jv[0]])
    )
    return Formula(found, text_of(found), share, p, optimiser)


def text_of(terms: Sequence[tuple[str, float, str]]) -> str:
    """A formula as people read it, with the unit of each coefficient."""
    size, out = max(abs(value) for _, value, _ in terms), ""
    for text, value, unit in terms:
        number = display(unit, size)(abs(value), 2)
        sign = ("-" if value < 0.0 else "") if not out else (" - " if value < 0.0 else " + ")
        out += sign + " ".join(filter(None, (number, text)))
    return out


def _of_noise(data: Sums, matrix: FloatArray, noise: FloatArray, fold: IntArray) -> float:
    cross = np.array([matrix[fold == f].T @ noise[fold == f] for f in range(data.power.size)])
    power = np.array([float(noise[fold == f] @ noise[fold == f]) for f in range(data.power.size)])
    return float(cross_validated_shares(Sums(data.gram, cross, power)).max())


def _by_sindy(matrix: FloatArray, residual: FloatArray, count: int) -> list[int]:
    """Terms of PySINDy's sequentially thresholded least squares, the threshold raised until so few are left."""
    try:
        from pysindy import STLSQ  # pyright: ignore[reportMissingImports]  optional extra `sindy`
    except ImportError:
        return []
    size = float(np.sqrt(np.mean(residual**2)))
    for threshold in np.geomspace(0.02, 1.0, 25):
        coefficients = STLSQ(threshold=threshold, alpha=1e-3).fit(matrix, residual[:, None] / size).coef_[0]
        selected = np.flatnonzero(coefficients)
        if selected.size <= min(count, FORMULA_TERMS):
            return selected.tolist()
    return []
