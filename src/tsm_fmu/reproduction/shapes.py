"""Independence of the sheath's shape, which IFToMM 2013 and MMT 2015 show by experiment."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from ..models.laws.capstan import sheath_of
from ..report import Line
from .claims import Claim, Condition, Verdict, statement_claim
from .draw import panels, plot

MU, LENGTH, TOTAL = 0.16, 1.2, 3.0 * math.pi
"""Friction coefficient as in AME 2020; sheath of 1.2 m (MMT 2015) bent by 540 deg in all."""
ROUTES = {
    "one even bend": (TOTAL,),
    "three bends": (0.7, 1.9, TOTAL - 2.6),
    "four bends": (2.9, 0.1, 0.3, TOTAL - 3.3),
}
"""Angles [rad] of bends of the same length, from the driver."""


def _lam(bends: Sequence[float]) -> float:
    lengths = [LENGTH / len(bends)] * len(bends) + [0.0] * (8 - len(bends))
    radii = [length / bend for length, bend in zip(lengths, bends, strict=False)] + [0.0] * (8 - len(bends))
    return sheath_of(MU, len(bends), tuple(lengths), tuple(radii)).lam  # pyright: ignore[reportArgumentType]


def configuration_claim(key: str, item: str) -> Claim:
    """Two routes of the same total bend transmit alike, by the capstan law behind all five papers."""
    one, *others = (_lam(bends) for bends in ROUTES.values())
    difference = max(abs(math.exp(other - one) - 1.0) for other in others)
    changed = 1.0 - math.exp(_lam((TOTAL - math.pi / 2.0,)) - one)
    return statement_claim(
        key,
        item,
        "relative change of T_in/T_out, other route of the same 540 deg",
        "1",
        "no change while the accumulated angle is kept",
        {"capstan law": Condition(difference, "<=", 1e-12)},
        {
            Verdict.REPRODUCED: "the capstan law knows the total angle only; 90 deg less would change the ratio by "
            f"{100.0 * changed:.0f} % (mu = {MU:g})"
        },
    )


def configuration_figure() -> go.Figure:
    """Tension along three routes that end alike."""
    lines = []
    for name, bends in ROUTES.items():
        places = np.linspace(0.0, LENGTH, len(bends) + 1)
        along = np.linspace(0.0, LENGTH, 200)
        lam = MU * np.interp(along, places, np.concatenate([[0.0], np.cumsum(bends)]))
        lines.append(Line(name, along, np.exp(-lam)))
    return panels([plot(lines, "Pull: tension along the sheath", "length [m]", "T/T_in")], columns=1)
