"""The effects, not as their files have them: what each makes of a signal ``y`` of a run, by an amount."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from .motions import DT, Array
from .rigs import Signals, slip

Formula = Callable[[Array, Signals, float], Array]

FORMULAS: dict[str, Formula] = {}


def _of(effect: str) -> Callable[[Formula], Formula]:
    def keep(formula: Formula) -> Formula:
        FORMULAS[effect] = formula
        return formula

    return keep


def _late(y: Array, tau: float) -> Array:
    """First-order lag by the trapezoidal rule, at rest at its first value."""
    r = DT / (2.0 * max(tau, 1e-9))
    return y[0] + lfilter([r / (1.0 + r), r / (1.0 + r)], [1.0, (r - 1.0) / (1.0 + r)], y - y[0])


def _play(y: Array, half: float) -> Array:
    out = y.copy()
    for k in range(1, y.size):
        out[k] = min(max(out[k - 1], y[k] - half), y[k] + half)
    return out


@_of("coulomb")
def _coulomb(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * s.z


@_of("viscous")
def _sheared_film(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * np.arcsinh(s.v / (0.2 * s.rms("v")))


@_of("stribeck")
def _bo_pavelescu(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * s.z / (1.0 + (s.v / (0.3 * s.rms("v"))) ** 2)


@_of("acceleration_branches")
def _wedge(y: Array, s: Signals, amount: float) -> Array:
    """A rational rise with the acceleration, of speeding up alone."""
    power = (s.a / (0.5 * s.rms("a"))) ** 2
    return y + amount * s.z * np.where(s.a * s.v > 0.0, power / (1.0 + power), 0.0)


@_of("inertia")
def _mass(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * np.gradient(s.v, s.t)


@_of("friction_lag")
def _hess_soom(y: Array, s: Signals, amount: float) -> Array:
    v_s = 0.3 / 0.41 * s.stroke
    past = np.interp(s.t - amount, s.t, s.v)
    return y + 0.32 * s.z * (np.exp(-((past / v_s) ** 2)) - np.exp(-((s.v / v_s) ** 2)))


@_of("presliding_shape")
def _eyring(y: Array, s: Signals, amount: float) -> Array:
    """After a reversal the rest r relaxes as sinh(2 r), as thermally activated slip does: tanh(r) is exponential."""
    z, reach = np.zeros(s.x.size), 0.3 * s.stroke
    for k in range(1, s.x.size):
        d = s.x[k] - s.x[k - 1]
        side = np.sign(d) if d else 1.0
        z[k] = side * (1.0 - np.arctanh(np.tanh(1.0 - side * z[k - 1]) * np.exp(-abs(d) / reach)))
    return y + amount * (z - s.z)


@_of("nonlocal_memory")
def _maxwell(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * sum(slip(s.x, part * s.stroke) for part in (0.06, 0.12, 0.22, 0.35))


@_of("breakaway_ageing")
def _aged(y: Array, s: Signals, amount: float) -> Array:
    """Strength by the logarithm of the last hold, worn away by travel."""
    peak, hold, gone = np.zeros(s.t.size), 0.0, np.inf
    for k in range(1, s.t.size):
        moved = abs(s.x[k] - s.x[k - 1])
        if moved < 1e-5 * s.stroke:
            hold, gone = (hold if gone == 0.0 else 0.0) + DT, 0.0
        else:
            gone += moved
        peak[k] = np.log1p(hold / 0.05) * np.exp(-gone / (0.15 * s.stroke)) * -np.expm1(-gone / (0.017 * s.stroke))
    return y + amount * peak * s.z


@_of("load_dependence")
def _capstan(y: Array, s: Signals, amount: float) -> Array:
    return y + np.abs(s.load) * np.where(s.z > 0.0, np.expm1(amount * s.z), -np.expm1(-amount * s.z))


@_of("bend_angle")
def _bent(y: Array, s: Signals, amount: float) -> Array:
    wrapped = np.hypot(s.theta, 0.3)  # a sheath that is never quite straight
    return y + np.abs(s.load) * np.expm1(amount * wrapped) * s.z


@_of("temperature_dependence")
def _thinned(y: Array, s: Signals, amount: float) -> Array:
    return y * np.exp(-amount * (s.temperature - 296.0))


@_of("drive_direction")
def _back_driven(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * np.abs(s.load) * s.z * 0.5 * (1.0 - np.tanh(20.0 * s.load * s.z / s.pull))


@_of("direction_asymmetry")
def _rough_one_way(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * 0.5 * (1.0 + s.z) * (0.3 + np.abs(s.v) / s.rms("v"))


@_of("offset_drift")
def _settling(y: Array, s: Signals, amount: float) -> Array:
    return y - amount * np.expm1(-s.t / (0.8 * s.t[-1]))


@_of("gain_error")
def _gain(y: Array, s: Signals, amount: float) -> Array:
    return y / (1.0 - amount)


@_of("backlash")
def _gaps(y: Array, s: Signals, amount: float) -> Array:
    return np.mean([_play(y, amount * part) for part in (0.95, 1.0, 1.05)], axis=0)


@_of("smooth_backlash")
def _rounded(y: Array, s: Signals, amount: float) -> Array:
    """Many threads that stretch and slip in turn, each after its own travel."""
    return y - amount * np.mean([slip(y, part * s.stroke) for part in np.linspace(0.05, 0.65, 7)], axis=0)


@_of("tendon_elasticity")
def _toe(y: Array, s: Signals, amount: float) -> Array:
    return y - amount * np.arcsinh(s.load / (1.5 * s.pull))


@_of("stiffness_hardening")
def _rubber(y: Array, s: Signals, amount: float) -> Array:
    middle = 0.5 * (s.x.max() + s.x.min()) - 0.3 * s.stroke
    return y + amount * np.sinh(2.0 * (s.x - middle) / s.stroke)


@_of("slack")
def _limp(y: Array, s: Signals, amount: float) -> Array:
    return y - amount * np.clip(s.load / (0.08 * s.pull), -1.0, 1.0)


@_of("creep")
def _relaxing(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * (0.7 * (s.x - _late(s.x, 0.9)) + 0.3 * (s.x - _late(s.x, 2.1)))


@_of("thermal")
def _warm(y: Array, s: Signals, amount: float) -> Array:
    """A tendon heated by its speed in a sheath that takes the heat up; friction falls exponentially with its warmth."""
    heat, (tendon, sheath) = np.abs(s.v) / s.rms("v"), (0.05 * s.t[-1], 0.2 * s.t[-1])
    warm = around = 0.0
    factor = np.ones(s.t.size)
    for k in range(1, s.t.size):
        lost = warm - around
        warm, around = warm + DT / tendon * (0.5 * heat[k] - lost), around + DT / sheath * (lost - around)
        factor[k] = np.exp(-amount * warm)
    return y * factor


@_of("wear")
def _run_in(y: Array, s: Signals, amount: float) -> Array:
    work = np.cumsum(np.abs(s.v))
    return y * (1.0 + amount / (1.0 + 8.0 * work / work[-1]))


@_of("drum_periodic")
def _eccentric(y: Array, s: Signals, amount: float) -> Array:
    return y + amount * np.cos(s.x - 0.7) / (1.0 - 0.3 * np.cos(s.x - 0.7))


@_of("winding_crossover")
def _lay(y: Array, s: Signals, amount: float) -> Array:
    d = (s.x - 0.9 + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return y + amount * np.where(np.abs(d) < 0.45, np.cos(np.pi * d / 0.9) ** 2, 0.0)


@_of("delay")
def _later(y: Array, s: Signals, amount: float) -> Array:
    return np.interp(s.t - amount, s.t, y)


@_of("sensor_lag")
def _filtered(y: Array, s: Signals, amount: float) -> Array:
    return _late(y, amount)


@_of("quantisation")
def _mid_riser(y: Array, s: Signals, amount: float) -> Array:
    """A converter without a level at zero, its thresholds not quite even; one that truncates has an offset besides."""
    counts = y / amount
    return amount * (np.floor(counts + 0.1 * np.sin(2.3 * counts)) + 0.5)
