"""Disturbances that no effect of the vocabulary describes: the right answer is ``unknown``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .hidden import rms
from .motions import FloatArray
from .operators import lag, resonance
from .plants import Change, Signals

OUTSIDE: dict[str, Change] = {}


def _outside(change: Callable[[Signals, float], None]) -> Change:
    OUTSIDE[change.__name__] = change
    return change


def _add(s: Signals, shape: FloatArray, amount: float) -> None:
    """To the motion of a rig that has nothing else, else to the friction."""
    if s.rig.f_c:
        s.friction = s.friction + amount * s.rig.f_c * shape
    else:
        s.x_out = s.x_out + amount * s.rig.stroke * shape


@_outside
def kinked_sheath(s: Signals, amount: float) -> None:
    """Friction at one place of the stroke."""
    place = s.rig_rng.uniform(-0.3, 0.3)
    _add(s, s.z * np.exp(-(((s.x / s.rig.stroke - place) / 0.2) ** 2)), amount)


@_outside
def tendon_rings(s: Signals, amount: float) -> None:
    """A weakly damped resonance."""
    own = s.friction if s.rig.f_c else s.x_out
    ringing = resonance(own, s.step, 2.0 * np.pi * s.rig_rng.uniform(3.0, 4.5), 0.03)
    _add(s, ringing / (rms(ringing) + 1e-300), amount)


@_outside
def neighbour_sticks(s: Signals, amount: float) -> None:
    """Another cable sticks and slips: a saw of uneven teeth."""
    rng, tooth, shape, k = s.rng, 0.0, np.zeros(s.t.size), 0
    while k < s.t.size:
        n = max(2, round(rng.uniform(0.5, 2.3) / s.step))
        rise = rng.uniform(0.5, 1.5) * np.linspace(-0.5, 0.5, n)
        shape[k : k + n] = (tooth + rise)[: s.t.size - k]
        k += n
    _add(s, shape, amount)


@_outside
def gain_wanders(s: Signals, amount: float) -> None:
    """A gain in a slow random walk."""
    walk = lag(np.cumsum(s.rng.normal(0.0, np.sqrt(s.step), s.t.size)), s.step, 0.7, 0.0)
    walk -= walk.mean()
    if s.rig.f_c:
        s.friction = s.friction * (1.0 + amount * walk)
    else:
        s.x_out = s.x_out * (1.0 + amount * walk)


@_outside
def other_joint_moves(s: Signals, amount: float) -> None:
    """An unmeasured motion couples in."""
    rng = s.rng
    shape = sum(np.sin(2.0 * np.pi * rng.uniform(0.3, 1.9) * s.t + rng.uniform(0.0, 6.28)) for _ in range(3))
    _add(s, np.asarray(shape), amount)


@_outside
def loose_contact(s: Signals, amount: float) -> None:
    """Jumps between two values at random."""
    toggles = s.rng.random(s.t.size) < s.step / 1.3
    _add(s, np.where(np.cumsum(toggles) % 2 == 0, -0.5, 0.5), amount)
