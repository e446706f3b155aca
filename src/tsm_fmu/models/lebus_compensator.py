"""Feedforward for the LeBus transmission: the driver angle that puts the follower where it is wanted.

Jia et al., Adv. Mech. Eng. 2020, Eqs (39) and (40). The printed (39) adds the elongation angle and, after a reversal,
the hysteresis angle theta_b (its theta_aw^- is a misprint of theta_bw^-)::

    theta_ff = theta_r + theta_aw+                       pulling                                             (39a)
    theta_ff = theta_r + theta_bw- + theta_b             turned back, theta_b = lost motion / r       (39b),(28)

Both are what the transmission itself needs, so here they are not a formula beside it: the compensator carries the
equations and the state of `lebus_transmission` and solves them for the driver angle that brings the follower to
theta_r. Forward after inverse is the identity, for inner loops too. Inverse after forward is the identity while the
follower runs; during the lost motion many driver angles give one follower angle, and the driver rests.

Reversal detection: the reference has turned when it has come back by more than ``reversal_band``; until then the driver
rests. At a turn theta_ff jumps by theta_b (up to 2.5 turns with the published slack): let the drive limit its rate.
The load never turns the driver: it moves in the direction of the reference only.

Load. ``tension_at`` = 0: T_measured is the net tension T_ae - T_be that the load asks for at the follower,
tau_load/(D/2): m g for a hanging weight, negative if it hangs on tendon b. ``tension_at`` = 1: T_measured is that of
tendon a at the driver wheel, as `LebusTransmission` gives T_a with s_w = 0; the load then follows from it while
tendon a slides along its whole length (T_ae = T_a0 exp(-+lam)), and is held in the transition and for ``settle_angle``
after it. At the start T_measured above T_0 is read as a load hung on with the driver at rest (T_ae = T_a0 exp(lam)),
else as no load.

LuGre option (``lugre`` = 1), Eq (40) as corrected in `lugre`: friction f at the wanted tendon speed stretches the
tendon by f L/EA more, theta_ff += f L/(EA r); F_c = mu T, F_s = mu_s T with T the load tension (f_c and f_s are not
published). That is 0.12 to 0.36 mm in steady motion: it cannot be what removed 156 to 206 mm, which is theta_b.
sigma1 is 316 N s/m; the printed N s/mm would give 15.8 kN at 0.05 m/s.

Validity: that of `lebus_transmission`, with the same parameters as the real drive.
"""

import math
from typing import Annotated, Any, NamedTuple

from .contract import DefaultExperiment, Preset, Quantity, Roles
from .joined import Part, joined
from .laws.lugre import bristle_after, friction, stribeck
from .laws.signs import sign
from .lebus.loop import Loop, advance, reference_loop, settle
from .lebus.rig import Rig, rig, stay_in_grooves
from .lebus.state import State as LoopState
from .lebus.state import loop_of, state_of
from .lebus_transmission import CONDITIONS as CONDITIONS
from .lebus_transmission import PRESETS as TRANSMISSION_PRESETS
from .lebus_transmission import Params as TransmissionParams

NAME = "LebusCompensator"
ROLES = Roles(experiment=DefaultExperiment(31.4, 0.02))


class Options(NamedTuple):
    lugre: Annotated[
        int, Quantity("1", "1: add the LuGre friction of Eq (40), 0: not", lo=0, hi=1, choices=("off", "on"))
    ] = 0
    mu_s: Annotated[float, Quantity("1", "static friction coefficient, F_s = mu_s T, Eq (40)", lo=0.0)] = 0.16
    sigma0: Annotated[float, Quantity("N/m", "bristle stiffness, Eq (40)", lo=0.0, open_lo=True)] = 1e5
    sigma1: Annotated[float, Quantity("N.s/m", "micro-damping of the bristles, Eq (40)", lo=0.0)] = 10**2.5
    sigma2: Annotated[float, Quantity("N.s/m", "viscous friction, Eq (40)", lo=0.0)] = 4.3
    v_s: Annotated[float, Quantity("m/s", "Stribeck speed, Eq (40)", lo=0.0, open_lo=True)] = 1e-5
    tension_at: Annotated[
        int,
        Quantity(
            "1",
            "T_measured is 0: the load tension at the follower, 1: tendon a at the driver",
            lo=0,
            hi=1,
            choices=("follower", "driver"),
        ),
    ] = 0
    reversal_band: Annotated[
        float, Quantity("rad", "way back of the reference that counts as a reversal (ours)", lo=0.0, display="deg")
    ] = 0.0
    settle_angle: Annotated[
        float, Quantity("rad", "way after a reversal before T_measured counts (ours)", lo=0.0, display="deg")
    ] = 0.05


class Memory(NamedTuple):
    theta_r: Annotated[float, Quantity("rad", "reference at the end of the last step")]
    wanted: Annotated[float, Quantity("rad", "reference that the driver follows, behind the reversal band")]
    since: Annotated[float, Quantity("rad", "way of the reference since it turned")]
    z: Annotated[float, Quantity("m", "bristle deflection, Eq (40)")]


class Inputs(NamedTuple):
    theta_r: Annotated[float, Quantity("rad", "wanted follower angle", display="deg")]
    T_measured: Annotated[float, Quantity("N", "measured tension, see tension_at")]


class Outputs(NamedTuple):
    theta_ff: Annotated[float, Quantity("rad", "driver angle, Eq (39)", display="deg")]


Params = joined(
    __name__, "Params", Part("", TransmissionParams, TransmissionParams(), {}), Part("", Options, Options(), {})
)
State = joined(__name__, "State", Part("", LoopState, None, {}), Part("", Memory, None, {}))

LUGRE = {"mu_s": (0.16, "1"), "sigma0": (1e5, "N/m"), "sigma1": (10**2.5, "N*s/m"), "sigma2": (4.3, "N*s/m")}
PRESETS = {
    name: Preset(
        preset.source + "; LuGre set below Eq (40), sigma1 in N.s/m (the printed N.s/mm is a unit error)",
        {**preset.printed, **LUGRE, "v_s": (1e-5, "m/s")},
        preset.si,
    )
    for name, preset in TRANSMISSION_PRESETS.items()
}


def start(p: Any, u: Inputs) -> tuple[Any, Outputs]:
    g = rig(p)
    stay_in_grooves(g, u.theta_r)
    tau = u.T_measured * 0.5 * p.D
    if p.tension_at == 1:
        _pulls(u.T_measured)
        tau = u.T_measured * math.exp(g.sheath.lam) * 0.5 * p.D if u.T_measured > p.T_0 * (1.0 + 1e-9) else 0.0
    loop = settle(g, reference_loop(g, u.theta_r), tau)
    s = _state(state_of(loop, tau, 0.0, 0.0), u.theta_r, u.theta_r, 0.0, 0.0)
    return s, _outputs(p, g, s, 0.0)


def step(p: Any, s: Any, u: Inputs, dt: float) -> tuple[Any, Outputs]:
    g = rig(p)
    loop = loop_of(g, s)
    tau = _load(p, g, s, loop, u.T_measured)
    if tau != s.tau_load:
        loop = settle(g, loop, tau)
    moved = u.theta_r - s.theta_r
    turned = sign(u.theta_r - s.wanted)
    way = s.way
    wanted = s.wanted
    since = s.since + abs(moved)
    if turned == way or abs(u.theta_r - s.wanted) > p.reversal_band:
        wanted = u.theta_r
        if turned != 0.0 and turned != way:
            way = turned
            since = 0.0
    if way * (wanted - loop.theta_out) > 0.0:
        loop = _bring(g, loop, way, wanted, tau)
        stay_in_grooves(g, loop.theta_in)
    v = 0.5 * p.D * moved / dt
    T = abs(tau) / (0.5 * p.D)
    z = s.z
    if p.lugre == 1 and p.mu * T > 0.0:
        z = bristle_after(s.z, v, dt, stribeck(v, p.mu * T, p.mu_s * T, p.v_s) / p.sigma0)  # (40)
    after = _state(state_of(loop, tau, way, 0.0), u.theta_r, wanted, since, z)
    return after, _outputs(p, g, after, v)


def _outputs(p: Any, g: Rig, s: Any, v: float) -> Outputs:
    theta_ff = s.theta_in
    T = abs(s.tau_load) / (0.5 * p.D)
    if p.lugre == 1 and p.mu * T > 0.0:
        steady = stribeck(v, p.mu * T, p.mu_s * T, p.v_s) / p.sigma0
        theta_ff += friction(s.z, v, steady, p.sigma0, p.sigma1, p.sigma2) * g.length / (p.EA * 0.5 * p.D)  # (40)
    return Outputs(theta_ff)


def _pulls(T: float) -> None:
    if T < 0.0:
        raise ValueError("T_measured is negative -- expected 0 or more at the driver -- a tendon cannot push")


def _load(p: Any, g: Rig, s: Any, loop: Loop, T_measured: float) -> float:
    """Load torque [N m] from the measured tension; the reading belongs to the state before the step."""
    if p.tension_at == 0:
        return T_measured * 0.5 * p.D
    _pulls(T_measured)
    T_0 = loop.a.T[0]
    T_e = loop.a.T[loop.a.n]
    if T_e <= 0.0 or s.since < p.settle_angle:
        return s.tau_load
    gain = math.exp(s.way * g.sheath.lam)
    if abs(T_0 - T_e * gain) > 1e-9 * T_0:  # not yet sliding along the whole length
        return s.tau_load
    return s.tau_load + (T_measured - T_0) / gain * 0.5 * p.D


def _bring(g: Rig, loop: Loop, way: float, wanted: float, tau: float) -> Loop:
    """Loop after the driver turned until the follower reached ``wanted``: Eq (39) by the transmission's own equations.

    The follower rests during the lost motion and then runs with a slope near 1, so the search starts from the far end.
    """
    lo = 0.0
    g_lo = way * (loop.theta_out - wanted)
    close = 1e-15 * (abs(wanted) + abs(loop.theta_in))
    hi = -g_lo
    found = advance(g, loop, way, loop.theta_in + way * hi, tau)
    g_hi = way * (found.theta_out - wanted)
    rests = True  # the follower has not moved at lo
    for _ in range(60):  # far enough
        if g_hi >= -close:
            break
        rests = found.theta_out == loop.theta_out
        lo = hi
        g_lo = g_hi
        hi = 2.0 * hi if rests else hi - 1.05 * g_hi
        found = advance(g, loop, way, loop.theta_in + way * hi, tau)
        g_hi = way * (found.theta_out - wanted)
    side = 0
    for turn in range(200):
        if abs(g_hi) <= close:
            break
        x = hi - g_hi if rests else hi - g_hi * (hi - lo) / (g_hi - g_lo)
        if not lo < x < hi or turn % 10 == 9:
            x = 0.5 * (lo + hi)
        if not lo < x < hi:
            break
        tried = advance(g, loop, way, loop.theta_in + way * x, tau)
        excess = way * (tried.theta_out - wanted)
        if excess < -close:
            rests = tried.theta_out == loop.theta_out
            lo = x
            g_lo = excess
            if side < 0:
                g_hi *= 0.5
            side = -1
        else:
            hi = x
            g_hi = excess
            found = tried
            if side > 0:
                g_lo *= 0.5
            side = 1
            if abs(excess) <= close:
                break
    return found


def _state(s: LoopState, theta_r: float, wanted: float, since: float, z: float) -> Any:
    return State(
        s.theta_in, s.theta_out, s.tau_load, s.way, s.stage,
        s.a_n, s.a_lam, s.a_T, s.b_n, s.b_lam, s.b_T,
        s.low, s.high, s.a_below, s.a_above, s.b_below, s.b_above, s.x_a, s.x_b,
        theta_r, wanted, since, z,
    )  # fmt: skip
