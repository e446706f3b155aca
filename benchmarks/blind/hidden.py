"""Effects of the vocabulary in other functional forms than those of `tsm_fmu.effects`.

Each changes the signals of a rig in place by an amount that `generate` scales to a stated size; amount 0 changes
nothing. Scales of speed, acceleration and load are the rig's, not the motion's: a slow motion excites less.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .motions import FloatArray
from .operators import even_slip, hold_time, lag, play, two_temperatures
from .plants import Change, Signals

FORMS: dict[str, tuple[str, Change]] = {}
"""Name of the form: id of the effect, change."""


def _form(effect: str) -> Callable[[Change], Change]:
    def keep(change: Change) -> Change:
        FORMS[change.__name__] = (effect, change)
        return change

    return keep


def rms(x: FloatArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(x**2)))


def late(y: FloatArray, t: FloatArray, delay: FloatArray | float) -> FloatArray:
    """The signal some time ago."""
    return np.interp(t - delay, t, y)


def filtered(y: FloatArray, step: float, tau: float) -> FloatArray:
    """The signal after two lags in series, one much shorter."""
    once = lag(y, step, max(tau, 1e-6), y[0])
    return lag(once, step, max(0.15 * tau, 1e-6), once[0])


# -- friction


@_form("viscous")
def eyring_film(s: Signals, amount: float) -> None:
    """Sheared lubricant: inverse hyperbolic sine of the speed."""
    s.friction += amount * s.rig.f_c * np.arcsinh(s.v / (0.25 * s.rig.speed))


@_form("stribeck")
def logarithmic_weakening(s: Signals, amount: float) -> None:
    """Steady state of rate-and-state friction: falls with the logarithm of the speed, cut off at both ends."""
    low, high = 0.02 * s.rig.speed, 0.5 * s.rig.speed
    s.friction += amount * s.rig.f_c * s.z * np.log1p(high / (np.abs(s.v) + low))


@_form("acceleration_branches")
def wedge_of_lubricant(s: Signals, amount: float) -> None:
    """Friction of speeding up over that of slowing down, by a smooth switch in the power of the acceleration."""
    power = s.a * np.tanh(s.v / (0.02 * s.rig.speed))
    s.friction += amount * s.rig.f_c * s.z * 0.5 * (1.0 + np.tanh(3.0 * power / s.rig.acceleration))


@_form("inertia")
def carried_mass(s: Signals, amount: float) -> None:
    """A mass behind a stiff coupling: its force comes 3 ms late."""
    s.friction += amount * s.rig.f_c * lag(s.a / s.rig.acceleration, s.step, 0.003, 0.0)


@_form("friction_lag")
def late_stribeck(s: Signals, amount: float) -> None:
    """Hess-Soom: the Stribeck curve of the speed some time ago (pure delay)."""
    extra, v_s = s.rig.f_s - s.rig.f_c, s.rig.v_s
    past = late(s.v, s.t, amount)
    s.friction += extra * s.z * (np.exp(-((past / v_s) ** 2)) - np.exp(-((s.v / v_s) ** 2)))


@_form("presliding_shape")
def straight_presliding(s: Signals, amount: float) -> None:
    """Part of the friction rises straight to its slip limit, over a longer travel."""
    s.friction += amount * s.rig.f_c * (even_slip(s.x, np.array([2.6 * s.rig.x_pre]), np.array([1.0])) - s.z)


@_form("nonlocal_memory")
def maxwell_of_long_reach(s: Signals, amount: float) -> None:
    """Stop elements whose reach is a good part of the stroke."""
    reach = s.rig.stroke * np.array([0.05, 0.11, 0.2, 0.33])
    s.friction += amount * s.rig.f_c * even_slip(s.x, reach, np.array([0.3, 0.3, 0.2, 0.2]))


@_form("breakaway_ageing")
def kato_ageing(s: Signals, amount: float) -> None:
    """Kato: strength saturates with a stretched exponential of the hold, forgotten over a travel."""
    held, travel = hold_time(s.v, s.step, 1e-3 * s.rig.speed)
    strength = 1.0 - np.exp(-((held / 1.2) ** 0.6))
    peak = np.exp(-travel / (0.1 * s.rig.stroke)) - np.exp(-travel / (0.7 * s.rig.x_pre))
    s.friction += amount * s.rig.f_c * s.z * strength * peak


@_form("load_dependence")
def capstan(s: Signals, amount: float) -> None:
    """Exact capstan; in a drive on both tendons, which share a pretension and do not push."""
    up, down = np.expm1(amount * s.z), np.expm1(-amount * s.z)
    if s.rig.model == "SingleTsmDahl":
        s.friction += s.load * up
        return
    pretension = 0.12 * s.rig.pull
    pull = pretension + 0.5 * s.load, pretension - 0.5 * s.load
    a, b = (0.5 * (q + np.sqrt(q**2 + (0.4 * pretension) ** 2)) for q in pull)
    s.friction += a * up - b * down


@_form("drive_direction")
def back_driving(s: Signals, amount: float) -> None:
    """Friction from the load only while the load drives."""
    driven = 0.5 * (1.0 - np.tanh(20.0 * s.load * s.v / (s.rig.pull * s.rig.speed)))
    s.friction += amount * np.abs(s.load) * s.z * driven


@_form("direction_asymmetry")
def rough_in_pull(s: Signals, amount: float) -> None:
    """More friction in pull, also more that grows with speed."""
    s.friction += amount * s.rig.f_c * 0.5 * (1.0 + s.z) * (1.0 + 0.6 * np.abs(s.v) / s.rig.speed)


@_form("offset_drift")
def settling_bias(s: Signals, amount: float) -> None:
    """An amplifier that warms up: a bias that settles."""
    s.friction += amount * s.rig.f_c * (0.5 - 1.3 * np.expm1(-s.t / (0.6 * s.t[-1])))


@_form("thermal")
def two_bodies_warm(s: Signals, amount: float) -> None:
    """Tendon and sheath warm up by the friction power: viscosity falls, and comes back at rest."""
    power = np.abs(s.friction * s.v)
    warm = two_temperatures(power / power.mean(), s.step, 0.07 * s.t[-1], 0.2 * s.t[-1])
    s.friction = s.friction + amount * s.friction * np.exp(-1.6 * warm)


@_form("wear")
def running_in(s: Signals, amount: float) -> None:
    """Hyperbolic running-in over the work done."""
    work = np.cumsum(np.abs(s.friction * s.v))
    s.friction = s.friction * (1.0 + amount / (1.0 + 6.0 * work / work[-1]))


@_form("drum_periodic")
def eccentric_bearing(s: Signals, amount: float) -> None:
    """Drag of an eccentric drum: a peaked function of its angle."""
    angle = s.x + s.rig_rng.uniform(0.0, 6.28)
    s.friction += amount * s.rig.f_c * np.cos(angle) / (1.0 - 0.3 * np.cos(angle))


@_form("stiffness_hardening")
def stiffening_return_spring(s: Signals, amount: float) -> None:
    """Hyperbolic sine of the deflection."""
    s.friction += amount * s.rig.f_c * np.sinh(2.2 * s.x / s.rig.stroke)


@_form("creep")
def relaxing_sheath(s: Signals, amount: float) -> None:
    """Two Maxwell elements of different relaxation time."""
    fast, slow = (s.x - lag(s.x, s.step, tau, s.x[0]) for tau in (0.9, 3.2))
    s.friction += amount * s.rig.f_c / s.rig.stroke * (0.65 * fast + 0.35 * slow)


@_form("sensor_lag")
def filtered_load_cell(s: Signals, amount: float) -> None:
    """A load cell behind two lags in series, one much shorter."""
    s.friction = filtered(s.friction, s.step, amount)


@_form("delay")
def late_load_cell(s: Signals, amount: float) -> None:
    """A delay that wanders a little, as over a bus."""
    s.friction = late(s.friction, s.t, amount * (1.0 + 0.1 * np.sin(9.1 * s.t)))


@_form("quantisation")
def short_converter(s: Signals, amount: float) -> None:
    """A converter of few bits that truncates."""
    s.levels["F" if s.rig.model != "TendonDrive" else "tau_in"] = amount * s.rig.f_c


# -- motion


@_form("backlash")
def worn_gaps(s: Signals, amount: float) -> None:
    """Several gaps of slightly different width share the motion."""
    widths = amount * s.rig.stroke * np.array([0.85, 0.95, 1.05, 1.15])
    s.x_out = np.mean([play(s.x_out, w) for w in widths], axis=0)


@_form("tendon_elasticity")
def soft_toe(s: Signals, amount: float) -> None:
    """Stretch with a soft toe: a wound rope stiffens as its wires close up."""
    s.x_out = s.x_out - amount * s.rig.stroke * np.arcsinh(s.load / (1.2 * s.rig.pull))


@_form("slack")
def limp_side(s: Signals, amount: float) -> None:
    """Free travel that is taken up evenly while the load is small."""
    s.x_out = s.x_out - amount * s.rig.stroke * np.clip(s.load / (0.15 * s.rig.pull), -1.0, 1.0)


@_form("creep")
def kelvin_voigt(s: Signals, amount: float) -> None:
    """Generalised Kelvin-Voigt: two retarded parts of the motion."""
    fast, slow = (s.x - lag(s.x, s.step, tau, s.x[0]) for tau in (0.8, 3.5))
    s.x_out = s.x_out - amount * (0.65 * fast + 0.35 * slow)


@_form("drum_periodic")
def eccentric_pulley(s: Signals, amount: float) -> None:
    """Exact kinematics of an eccentric pulley."""
    reach = np.clip(0.5 * amount * s.rig.stroke, -0.95, 0.95)
    phase = s.rig_rng.uniform(0.0, 6.28)
    s.x_out = s.x_out + np.arcsin(reach * np.sin(s.x + phase)) - np.arcsin(reach * np.sin(s.x[0] + phase))


@_form("winding_crossover")
def lay_change(s: Signals, amount: float) -> None:
    """Raised cosine at two angles of each turn."""
    phase = s.rig_rng.uniform(0.0, np.pi)
    d = (s.x - phase + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    s.x_out = s.x_out + amount * s.rig.stroke * np.where(np.abs(d) < 0.5, 0.5 + 0.5 * np.cos(2.0 * np.pi * d), 0.0)


@_form("delay")
def late_encoder(s: Signals, amount: float) -> None:
    """A delay that wanders a little."""
    s.x_out = late(s.x_out, s.t, amount * (1.0 + 0.1 * np.sin(7.7 * s.t)))


@_form("sensor_lag")
def filtered_encoder(s: Signals, amount: float) -> None:
    """An encoder behind two lags in series, one much shorter."""
    s.x_out = filtered(s.x_out, s.step, amount)


@_form("quantisation")
def coarse_encoder(s: Signals, amount: float) -> None:
    """An encoder of few lines that truncates."""
    s.levels["x_out"] = amount * s.rig.stroke


@_form("offset_drift")
def slipping_zero(s: Signals, amount: float) -> None:
    """A clamp that slips, more at first."""
    s.x_out = s.x_out + amount * s.rig.stroke * (s.t / (0.7 * s.t[-1] + s.t))
