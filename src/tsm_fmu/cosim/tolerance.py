"""What the uncertainty of fitted parameters does to a loop: bands of a signal over time, and what drives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..logs.display import display
from ..report import Band, Figure, Line, Section, Table
from ..report.panel import Panel
from .sweep import Point
from .sweep_report import SweepTable, distributions, worst_tables

QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
"""Of the draws at each time: two bands and the median."""
CONFIDENCE = 0.95
LEAST_DRAWS = 2


@dataclass(frozen=True)
class Bands:
    """A signal over time under uncertain parameters.

    Attributes
    ----------
    time : ndarray, shape (n,)
        [s].
    nominal : ndarray, shape (n,)
        With the values of the card.
    quantiles : ndarray, shape (5, n)
        Of the draws, `QUANTILES`.
    unit : str
    """

    time: NDArray[np.float64]
    nominal: NDArray[np.float64]
    quantiles: NDArray[np.float64]
    unit: str


def bands(case: str, time: NDArray[np.float64], unit: str, nominal: Point, draws: Sequence[Point]) -> Bands | None:
    """The bands of a case; None where it has no such signal or nothing was drawn that ran."""
    traces = [point.trace[case] for point in draws if case in point.trace]
    if len(traces) < LEAST_DRAWS:
        return None
    own = np.array(nominal.trace.get(case, np.full(len(traces[0]), np.nan)))
    return Bands(time, own, np.quantile(np.array(traces), QUANTILES, axis=0), unit)


def bands_figure(found: Bands, title: str, signal: str) -> Figure:
    """The bands as a picture: the signal, and below how far the draws are from the card's own values."""
    show = display(found.unit)
    low, lower, median, upper, high = show.factor * found.quantiles
    drawn = (
        Band("95 % of the draws", found.time, median, low, high, marked=False),
        Band("50 % of the draws", found.time, median, lower, upper, marked=False),
    )
    line = Line("values of the card", found.time, show.factor * found.nominal, dashed=True, colour=5)
    centre = show.factor * found.nominal
    about = tuple(
        Band(band.name, found.time, median - centre, below - centre, above - centre, marked=False)
        for band, below, above in zip(drawn, (low, lower), (high, upper), strict=True)
    )
    panels = (
        Panel("time [s]", f"{signal} [{show.unit}]", lines=(line,), bands=drawn, height=340),
        Panel("time [s]", f"less that of the card [{show.unit}]", bands=about, height=260),
    )
    return Figure(title, panels, common_x=True)


def covered(draws: int) -> float:
    """Share of all drives that, with `CONFIDENCE`, is not worse than the worst of so many draws (Wilks 1941)."""
    return (1.0 - CONFIDENCE) ** (1.0 / draws)


def tolerance_answer(table: SweepTable, nominal: Mapping[str, float], draws: int) -> str:
    """The chief number in a sentence: with the card's values, over the draws, and what the worst draw covers."""
    name, values = next(iter(table.numbers.items()))
    good = values[np.isfinite(values)]
    unit = table.units[name]
    low, high = np.quantile(good, [QUANTILES[0], QUANTILES[-1]])
    worst = good[np.argmax(np.abs(good))]
    return (
        f"{name}: {nominal.get(name, np.nan):.4g} {unit} with the values of the card; 95 % of {good.size} draws lie "
        f"from {low:.4g} to {high:.4g} {unit}. The worst, {worst:.4g} {unit}, is not exceeded by "
        f"{100 * covered(good.size):.3g} % of such drives, with 95 % confidence. {draws - good.size} draws failed."
    )


def tolerance_sections(
    table: SweepTable, drawn: Sequence[str], figures: Sequence[Figure], notes: Sequence[str]
) -> list[Section]:
    """Bands, spread, what drives it, distributions."""
    text = (
        "Rank correlation (Spearman) over the draws of each number with each parameter: near 1 or -1, the parameter "
        "alone decides it."
    )
    return [
        Section(
            "Bands over time",
            "Shaded: where 95 % and 50 % of the draws are at each time, and their median; dashed: the values of the "
            "card. Below, the same less that of the card.",
            (),
            figures,
        ),
        Section("Spread of the numbers", "\n\n".join(notes), worst_tables(table), distributions(table)),
        Section("What drives it", text, (_drivers(table, drawn),)),
    ]


def rank_correlation(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Spearman's correlation of two samples that are not constant."""
    from scipy.stats import rankdata  # a second, which those who only sweep need not pay

    return float(np.corrcoef(rankdata(x), rankdata(y))[0, 1])


def _drivers(table: SweepTable, drawn: Sequence[str]) -> Table:
    columns = {name: np.array([float(at[name]) for at in table.at]) for name in drawn}
    rows: list[list[Any]] = []
    for number, values in table.numbers.items():
        good = np.isfinite(values)
        row: list[Any] = [number]
        for column in columns.values():
            alike = good.sum() < 3 or np.ptp(values[good]) == 0.0 or np.ptp(column[good]) == 0.0
            row.append("" if alike else f"{rank_correlation(column[good], values[good]):.2f}")
        rows.append(row)
    return Table(("number", *drawn), rows)
