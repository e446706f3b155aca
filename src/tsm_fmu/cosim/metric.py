"""Numbers with their units: what a case of a co-simulation yields, and what a paper prints beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Metric:
    """A number and its unit: ``1`` for a pure number, ``%`` for a share in hundredths."""

    value: float
    unit: str


Reported = Mapping[str, Mapping[str, Metric | tuple[Metric, ...]]]
"""What a paper prints on cases: by case and quantity a number, or several (a range, or repeated trials)."""


@dataclass(frozen=True)
class Spread:
    """Mean, standard deviation and peak-to-peak value of a signal, in its unit."""

    mean: float
    std: float
    peak_to_peak: float
    unit: str

    def metrics(self) -> dict[str, Metric]:
        """The three numbers by name."""
        return {name: Metric(getattr(self, name), self.unit) for name in ("mean", "std", "peak_to_peak")}


def spread(values: ArrayLike, unit: str) -> Spread:
    """Mean, standard deviation and peak-to-peak value of a signal; a Boolean counts as 0 or 1."""
    x = np.asarray(values, dtype=float)
    return Spread(float(np.mean(x)), float(np.std(x)), float(np.ptp(x)), unit)


@dataclass(frozen=True)
class BondEnergy:
    """Energy through a power bond of a co-simulation [J]; see `energy`.

    Attributes
    ----------
    given, taken : float
        Work of the side that moves, and of the side that gives the force: the same but for the coupling.
    lost : float
        Their difference, which the coupling takes from the system; negative: what it makes.
    moved : float
        Sum of the magnitudes of what was given in each step.
    """

    given: float
    taken: float
    lost: float
    moved: float

    @property
    def share(self) -> float:
        """Of the energy that was moved; 0 where none was."""
        return self.lost / self.moved if self.moved > 0.0 else 0.0


@dataclass(frozen=True)
class CaseMetrics:
    """What a case yields in the window that is evaluated.

    Attributes
    ----------
    begin, end : Metric
        The window [s].
    signals : mapping of str to Spread
        Every recorded signal, by ``component.variable``.
    tracking_error : Spread or None
        Of the signal that the system names as its tracking error [deg].
    quantities : mapping of str to Metric
        What a scenario computes itself.
    bonds : mapping of str to BondEnergy
        Energy through each power bond from the start on, by ``motion ~ effort``.
    """

    begin: Metric
    end: Metric
    signals: Mapping[str, Spread]
    tracking_error: Spread | None = None
    quantities: Mapping[str, Metric] = field(default_factory=dict)
    bonds: Mapping[str, BondEnergy] = field(default_factory=dict)

    def tracked(self) -> Spread:
        """The tracking error of a system that names and records one."""
        assert self.tracking_error is not None
        return self.tracking_error

    def flat(self) -> dict[str, Metric]:
        """All numbers by name: ``tracking_error.mean``, ``quantity``, ``component.variable.mean``."""
        error = {} if self.tracking_error is None else {"tracking_error": self.tracking_error}
        return {**_flat(error), **self.quantities, **_flat(self.signals)}


def _flat(signals: Mapping[str, Spread]) -> dict[str, Metric]:
    return {f"{name}.{k}": metric for name, signal in signals.items() for k, metric in signal.metrics().items()}
