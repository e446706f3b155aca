"""Guidance of a tendon by LeBus grooves: which pitch, groove angle and width wind it turn beside turn.

AME 2020, Section 2: with grooves of total straight length l_s and broken length l_b a turn (two segments each),
``alpha_s = 90 l_s/(pi r)`` and ``l_s + l_b = 2 pi r``, a pitch ``P_s = l_b tan(phi)`` is gained in the broken ones.

* *stacked*: several turns in one groove. The tendon does not fit beside its neighbour (P_s < d), or it leaves the
  straight groove because it comes in at a fleet angle larger than phi, which is what carries it over.
* *empty*: one turn over several grooves, P_s >= 2 d: the second layer falls between the turns of the first.
* *full*: the width holds fewer turns than half the stroke needs, in two layers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

RADIUS, TENDON = 0.0125 + 0.5 * 3.05e-4, 3.05e-4
"""To the middle of the tendon, and its diameter [m]."""
STROKE_TURNS, LAYERS = 0.785 / (2.0 * math.pi * 0.0125), 2


class Grooves(NamedTuple):
    """Pitch [m], angle of one straight groove [deg], width of the wheel [m], distance to the sheath's end [m]."""

    pitch: float
    straight_deg: float
    width: float
    distance: float

    @property
    def straight_length(self) -> float:
        """l_s of a turn [m], Eq. (3)."""
        return math.pi * RADIUS * self.straight_deg / 90.0

    @property
    def broken_length(self) -> float:
        """l_b of a turn [m]."""
        return 2.0 * math.pi * RADIUS - self.straight_length

    @property
    def groove_deg(self) -> float:
        """Angle phi of the broken grooves [deg]."""
        return math.degrees(math.atan2(self.pitch, self.broken_length))

    @property
    def turns(self) -> float:
        """n_t that the width holds in a layer."""
        return self.width / self.pitch

    @property
    def fleet_deg(self) -> float:
        """Largest fleet angle gamma [deg], Eq. (6)."""
        return math.degrees(math.atan2(0.5 * self.width, self.distance))


def faults(g: Grooves) -> list[str]:
    """What goes wrong; nothing if the tendon winds turn beside turn.

    Raises
    ------
    ValueError
        A straight angle outside 0 to 180 deg.
    """
    if not 0.0 < g.straight_deg < 180.0:
        raise ValueError(f"straight_deg = {g.straight_deg!r} deg -- expected above 0 and below 180 -- correct it")
    found = []
    if g.pitch < TENDON or g.fleet_deg > g.groove_deg:
        found.append("stacked")
    if g.pitch >= 2.0 * TENDON:
        found.append("empty")
    if g.turns * LAYERS < STROKE_TURNS - 1e-9:
        found.append("full")
    return found
