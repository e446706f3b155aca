"""Two tendons between two wheels: the quasi-static equilibrium of the loop, for `lebus_transmission` and its inverse.

Jia et al., Adv. Mech. Eng. 2020, Eqs (22)-(36), corrected. Tendon a is pulled by the driver when theta_in grows,
tendon b when it falls. With S the length of tendon that a wheel has wound or paid out::

    delta_a = delta_0 + S_a,in - S_a,out - x_a                 (25) with delta = int T/EA dl, delta_0 = T_0 L/EA
    delta_b = delta_0 - slack - S_b,in + S_b,out - x_b         (25),(34); below 0 it is loose by -delta_b
    T_ae r_a - T_be r_b = tau_load                             balance at the follower
    dx      = (T_wound - T_paid)/EA |dS_out|                   winding strain (ours), 0 if switched off

A step has two parts: the load jumps at rest (the follower gives way), then the driver moves under constant load. In
each part all tendon moves one way, so `capstan` solves both tendons exactly; what remains is one unknown, the
follower's travel, in a balance that only falls with it.

Winding strain: unstretched length is conserved, so a wheel that winds tendon at tension T_wound and another that pays
it out as it was wound (T_paid; at first the preload) change the free path. What lies on a wheel beyond the reference
is taken as evenly strained, and the term counts while the tendon slides along its whole length (in the transition it is
of second order in the strain).
"""

import math
from typing import NamedTuple

from ..laws.capstan import (
    Profile,
    cut_level,
    cut_profile,
    cut_work,
    line_profile,
    tension_integral,
    uniform_profile,
)
from .geometry import layers_below
from .rig import Rig, follower_of, paid, wound


class Wound(NamedTuple):
    """Winding strain: travel range of the follower [rad], mean tensions of what it moved [N], x_a and x_b [m].

    ``below`` is what forward motion wound, from ``low`` to the follower's angle; ``above`` what backward motion wound,
    from there to ``high``.
    """

    low: float
    high: float
    a_below: float
    a_above: float
    b_below: float
    b_above: float
    x_a: float
    x_b: float


class Loop(NamedTuple):
    """State of the loop: both tension profiles, both angles [rad], winding strain."""

    a: Profile
    b: Profile
    theta_in: float
    theta_out: float
    wound: Wound


class Pull(NamedTuple):
    """One tendon while its driver end moves: the driver's cut is done, the follower's is open.

    ``slides_from`` is EA times the follower travel [N m] beyond which the whole tendon slides, -1 if it does already;
    ``stretch`` is delta [m] with the follower at rest; ``path`` the int T dl of a sliding tendon with 1 N at the
    follower [m]; ``at_wheel`` the tension at the wheel that winds it, per T_e.
    """

    way: float
    near: float
    slides_from: float
    stretch: float
    path: float
    at_wheel: float


def reference_loop(g: Rig, theta_in: float) -> Loop:
    """Tendon a at preload everywhere; b at what the slack leaves of it."""
    theta_out = follower_of(g, theta_in)
    strain = Wound(theta_out, theta_out, g.T_0, g.T_0, g.T_0, g.T_0, 0.0, 0.0)
    stretch_b = g.delta_0 - g.slack - paid(g, theta_in) + wound(g, theta_out)
    T_b = g.EA * max(stretch_b, 0.0) / g.length
    return Loop(uniform_profile(g.sheath, g.T_0), uniform_profile(g.sheath, T_b), theta_in, theta_out, strain)


def stretch_a(g: Rig, loop: Loop, theta_in: float) -> float:
    """delta_a [m], Eq (25), with the follower where ``loop`` has it."""
    return g.delta_0 + wound(g, theta_in) - paid(g, loop.theta_out) - loop.wound.x_a


def stretch_b(g: Rig, loop: Loop, theta_in: float) -> float:
    """delta_b [m], Eqs (25) and (34); below 0 tendon b is loose."""
    return g.delta_0 - g.slack - paid(g, theta_in) + wound(g, loop.theta_out) - loop.wound.x_b


def _pull(g: Rig, profile: Profile, way: float, travel: float, stretch: float) -> Pull:
    sheath = g.sheath
    near = 0.0
    slides_from = -1.0
    if profile.T[0] > 0.0:
        near, all_of_it = cut_level(sheath, profile, way, 1.0, g.EA * travel)
        if not all_of_it:
            slides_from, _ = cut_work(sheath, profile, way, -1.0, near)
    gain = math.exp(way * sheath.lam)
    path = tension_integral(sheath, 0.0, sheath.lam, gain, -way)
    return Pull(way, near, slides_from, stretch, path, gain if way > 0.0 else 1.0)


def _paid_work(g: Rig, loop: Loop, way: float, y: float, ds: float, below: float, above: float) -> float:
    """Sum of T_paid dS [N m] when the follower goes on by ``y``: first what lies beyond it, then preload tendon."""
    room = loop.wound.high - loop.theta_out if way > 0.0 else loop.theta_out - loop.wound.low
    held = min(room / y, 1.0) if y > 0.0 else 0.0
    return g.winding * ds * (held * (above if way > 0.0 else below) + (1.0 - held) * g.T_0)


def _sliding_tension(g: Rig, pull: Pull, drawn: float, ds: float, paid_work: float) -> float:
    """T_e of a tendon that slides along its whole length, Eq (S); below 0: loose by that over EA."""
    return (g.EA * (pull.stretch + drawn) + paid_work) / (pull.path + g.winding * ds * pull.at_wheel)


def _end_tension(g: Rig, profile: Profile, pull: Pull, drawn: float, ds: float, paid_work: float) -> float:
    """T_e after the follower's wheel moved its end by ``ds``; ``drawn`` is what that adds to the stretch."""
    work = g.EA * ds
    if work > pull.slides_from:
        return _sliding_tension(g, pull, drawn, ds, paid_work)
    level, _ = cut_level(g.sheath, profile, pull.way, -1.0, work)
    return level * math.exp(-pull.way * g.sheath.lam)


def _new_profile(g: Rig, profile: Profile, pull: Pull, ds: float, T_e: float) -> Profile:
    work = g.EA * ds
    if work > pull.slides_from:
        if T_e <= 0.0:
            return uniform_profile(g.sheath, 0.0)
        return line_profile(g.sheath, T_e, pull.way)
    far, _ = cut_level(g.sheath, profile, pull.way, -1.0, work)
    return cut_profile(g.sheath, profile, pull.way, pull.near, far)


def _balance(
    g: Rig, loop: Loop, a: Pull, b: Pull, way: float, tau: float, y: float, filled: int
) -> tuple[float, float, float]:
    """What drives the follower on [N m], with T_ae and T_be [N], when it has moved by ``y`` >= 0."""
    ds_a, ds_b = _travel(g, loop.theta_out, way, y)
    w = loop.wound
    paid_a = _paid_work(g, loop, way, y, ds_a, w.a_below, w.a_above)
    paid_b = _paid_work(g, loop, way, y, ds_b, w.b_below, w.b_above)
    T_a = _end_tension(g, loop.a, a, -way * ds_a, ds_a, paid_a)
    T_b = _end_tension(g, loop.b, b, way * ds_b, ds_b, paid_b)
    r_a = g.r_1 + (g.n_layers - 1 - filled) * g.rise
    r_b = g.r_1 + filled * g.rise
    drive = way * (max(T_a, 0.0) * r_a - max(T_b, 0.0) * r_b - tau)
    if tau == 0.0 and T_a <= 0.0 and T_b <= 0.0:  # both loose, no load: stop where the second went loose
        drive = min(T_a if way > 0.0 else T_b, 0.0) * g.r_1
    return drive, max(T_a, 0.0), max(T_b, 0.0)


def _travel(g: Rig, theta: float, way: float, y: float) -> tuple[float, float]:
    """Tendon lengths [m] that the follower's sides a and b exchange when it goes on by ``y``."""
    more = 0.0
    for k in range(1, g.n_layers):
        edge = k * g.layer_angle
        more += abs(max(theta + way * y - edge, 0.0) - max(theta - edge, 0.0)) * g.rise
    return y * (g.r_1 + (g.n_layers - 1) * g.rise) - more, y * g.r_1 + more


def advance(g: Rig, loop: Loop, way: float, theta_in: float, tau: float) -> Loop:
    """Loop after the driver moved monotonically to ``theta_in`` (``way`` +1: up) or, at rest, the load let it go.

    Parameters
    ----------
    g : Rig
        Parameters.
    loop : Loop
        State before.
    way : float
        +1 or -1: direction of the driver, or of the follower if the driver rests.
    theta_in : float
        Driver angle at the end [rad].
    tau : float
        Load torque [N m], constant.
    """
    driven_a = abs(wound(g, theta_in) - wound(g, loop.theta_in))
    driven_b = abs(paid(g, theta_in) - paid(g, loop.theta_in))
    a = _pull(g, loop.a, way, driven_a, stretch_a(g, loop, theta_in))
    b = _pull(g, loop.b, -way, driven_b, stretch_b(g, loop, theta_in))
    filled = layers_below(loop.theta_out, g.layer_angle, g.n_layers, way)
    drive, T_a, T_b = _balance(g, loop, a, b, way, tau, 0.0, filled)
    close = 1e-12 * (abs(tau) + (loop.a.T[loop.a.n] + loop.b.T[loop.b.n] + g.T_0) * g.r_1)
    y = 0.0
    theta_out = loop.theta_out
    if drive > close:
        lo = 0.0
        g_lo = drive
        hi = max(driven_a, driven_b, drive * g.length / (g.EA * g.r_1)) / g.r_1
        g_hi = drive
        edge = math.inf
        while True:  # layer by layer, each time twice as far, until the follower stops
            k = filled + 1 if way > 0.0 else filled
            edge = way * (k * g.layer_angle - loop.theta_out) if 1 <= k < g.n_layers else math.inf
            hi = min(hi, edge)
            g_hi, T_a, T_b = _balance(g, loop, a, b, way, tau, hi, filled)
            if g_hi <= 0.0:
                break
            lo = hi
            g_lo = g_hi
            if hi == edge:
                filled = k if way > 0.0 else k - 1
                theta_out = k * g.layer_angle
                g_hi, T_a, T_b = _balance(g, loop, a, b, way, tau, hi, filled)
                if g_hi <= 0.0:  # the radius jumps here: the follower waits until the tension has followed
                    break
                g_lo = g_hi
            hi = max(2.0 * hi, 1e-12)
            if hi > 1e12:
                raise ValueError(
                    "tau_load is not finite -- expected a torque that the tendons can hold -- check the load"
                )
        y = hi
        if lo < hi:
            y, T_a, T_b = _stop(g, loop, a, b, way, tau, filled, lo, g_lo, hi, g_hi, close)
            theta_out = loop.theta_out + way * y
    ds_a, ds_b = _travel(g, loop.theta_out, way, y)
    return Loop(
        _new_profile(g, loop.a, a, ds_a, T_a),
        _new_profile(g, loop.b, b, ds_b, T_b),
        theta_in,
        theta_out,
        _wind(g, loop, a, b, way, y, theta_out, ds_a, ds_b, T_a, T_b),
    )


def _stop(
    g: Rig,
    loop: Loop,
    a: Pull,
    b: Pull,
    way: float,
    tau: float,
    filled: int,
    lo: float,
    g_lo: float,
    hi: float,
    g_hi: float,
    close: float,
) -> tuple[float, float, float]:
    """Travel at which the follower stops, with T_ae and T_be: regula falsi (Illinois), exact where it is linear."""
    y = hi
    T_a = 0.0
    T_b = 0.0
    side = 0
    for turn in range(300):
        y = hi - g_hi * (hi - lo) / (g_hi - g_lo)
        if not lo < y < hi or turn % 20 == 19:
            y = 0.5 * (lo + hi)
        if not lo < y < hi:
            y = hi
        excess, T_a, T_b = _balance(g, loop, a, b, way, tau, y, filled)
        if abs(excess) <= 0.1 * close or y == hi:
            break
        if excess > 0.0:
            lo = y
            g_lo = excess
            if side > 0:
                g_hi *= 0.5
            side = 1
        else:
            hi = y
            g_hi = excess
            if side < 0:
                g_lo *= 0.5
            side = -1
    return y, T_a, T_b


def _wind(
    g: Rig,
    loop: Loop,
    a: Pull,
    b: Pull,
    way: float,
    y: float,
    theta_out: float,
    ds_a: float,
    ds_b: float,
    T_a: float,
    T_b: float,
) -> Wound:
    """Winding strain after the follower went on by ``y``."""
    w = loop.wound
    if y == 0.0 or g.winding == 0.0:
        return w
    x_a = w.x_a
    x_b = w.x_b
    wound_a = w.a_below if way > 0.0 else w.a_above
    wound_b = w.b_below if way > 0.0 else w.b_above
    before = loop.theta_out - w.low if way > 0.0 else w.high - loop.theta_out
    if g.EA * ds_a > a.slides_from:
        on_wheel = T_a * a.at_wheel
        x_a += (on_wheel * ds_a - _paid_work(g, loop, way, y, ds_a, w.a_below, w.a_above)) / g.EA
        wound_a = (wound_a * before + on_wheel * y) / (before + y)
    if g.EA * ds_b > b.slides_from:
        on_wheel = T_b * b.at_wheel
        x_b += (on_wheel * ds_b - _paid_work(g, loop, way, y, ds_b, w.b_below, w.b_above)) / g.EA
        wound_b = (wound_b * before + on_wheel * y) / (before + y)
    if way > 0.0:
        return Wound(w.low, max(w.high, theta_out), wound_a, w.a_above, wound_b, w.b_above, x_a, x_b)
    return Wound(min(w.low, theta_out), w.high, w.a_below, wound_a, w.b_below, wound_b, x_a, x_b)


def settle(g: Rig, loop: Loop, tau: float) -> Loop:
    """Loop after the load changed to ``tau`` with the driver at rest."""
    T_a = loop.a.T[loop.a.n]
    T_b = loop.b.T[loop.b.n]
    for way in (1.0, -1.0):
        filled = layers_below(loop.theta_out, g.layer_angle, g.n_layers, way)
        r_a = g.r_1 + (g.n_layers - 1 - filled) * g.rise
        r_b = g.r_1 + filled * g.rise
        if way * (T_a * r_a - T_b * r_b - tau) > 1e-12 * (abs(tau) + (T_a + T_b) * g.r_1):
            return advance(g, loop, way, loop.theta_in, tau)
    return loop
