"""Brushed DC motor with gearhead and load inertia, Coulomb and viscous friction, exact in time.

MSSP 2015, Section 4, drives the tendon pair with a FAULHABER 2642W024CR and bounds its voltage (Section 6,
0-24 V; here +-u_max). omega is the speed of the gearhead output, N omega that of the motor shaft, s = sgn(omega)::

    L_a di/dt = u - R_a i - k_e N omega,   |u| <= u_max                                  (1)
    tau_m     = k_t i - b N omega - tau_c s - J_rotor N domega/dt                        (2)
    J_load domega/dt = e N tau_m - tau_load                                              (3)
    e = efficiency where tau_m omega > 0, 1/efficiency where the load drives the motor   (4)
    dphi/dt   = omega                                                                    (5)

tau_m is the torque that the motor gives to the gear, b and tau_c act on the motor shaft. By (4) the gear always
takes power: of tau_m N omega it passes on the part `efficiency`, and the same part of the load's power
when that flows back. The sign of tau_m is that of g = J_load (k_t i - b N omega - tau_c s) + J_rotor N tau_load, in
both cases, and (2)-(3) agree where g = 0, so the motion is continuous through the change of flow.

At omega = 0 friction holds the shaft, exactly, as long as::

    i_- <= i <= i_+,   i_+- = (+-tau_c + tau_load e_+-/N)/k_t                            (6)
    e_+- = 1/efficiency if +-tau_load > 0, efficiency otherwise

and only the current moves, L_a di/dt = u - R_a i. While omega keeps its sign and e its value, (1)-(3) are linear::

    a_1 = R_a/L_a + e N^2 b/J,  a_0 = e N^2 (R_a b + k_t k_e)/(L_a J),  J = J_load + e N^2 J_rotor    (7)

u and tau_load hold over the step, so each such stretch is solved in closed form, and the times at which omega, g or
the held current reach their limits are located inside the step: there is no chatter. A step with more than
MOST_EVENTS such times is refused: a motor that rings at hundreds of kilohertz, almost without loss, for seconds.

Validity: one winding temperature, no commutation ripple, no backlash or compliance of the gearhead (the tendon's is
far larger), b, tau_c, R_a constant.
"""

import math
from typing import Annotated, NamedTuple

from .contract import DefaultExperiment, Preset, Quantity, Roles
from .laws.linear_second_order import first_fall_below_zero, slope_response

NAME = "DcMotor"

MOST_EVENTS = 100000  # in one step: only an absurdly long step reaches it
ROUNDING = 1e-14  # relative: a current this close to the holding limit is at it, a torque this small is none
NO_CURRENT = 1e-30  # A, an electron in five thousand years: without friction, ringing would go on below it for ever


class Params(NamedTuple):
    R_a: Annotated[float, Quantity("ohm", "armature resistance, Eq (1); assumed", lo=0.0, open_lo=True)] = 5.78
    L_a: Annotated[float, Quantity("H", "armature inductance, Eq (1); assumed", lo=0.0, open_lo=True, display="mH")] = (
        550e-6
    )
    k_t: Annotated[float, Quantity("N.m/A", "torque constant, Eq (2); assumed", lo=0.0, open_lo=True)] = 0.0349
    k_e: Annotated[float, Quantity("V.s/rad", "back-EMF constant, Eq (1); assumed", lo=0.0, open_lo=True)] = 0.0349
    J_rotor: Annotated[float, Quantity("kg.m2", "rotor inertia, Eq (2); assumed", lo=0.0, open_lo=True)] = 1.1e-6
    b: Annotated[float, Quantity("N.m.s/rad", "viscous friction at the motor shaft, Eq (2); assumed", lo=0.0)] = 2.5e-6
    tau_c: Annotated[float, Quantity("N.m", "Coulomb friction at the motor shaft, Eq (2); assumed", lo=0.0)] = 0.002
    gear_ratio: Annotated[float, Quantity("1", "motor speed over output speed N; assumed", lo=0.0, open_lo=True)] = 14.0
    efficiency: Annotated[
        float, Quantity("1", "part of the power that the gear passes on, Eq (4); assumed", lo=0.0, hi=1.0, open_lo=True)
    ] = 0.8
    J_load: Annotated[
        float, Quantity("kg.m2", "inertia at the gearhead output, the load's included, Eq (3); assumed", lo=0.0)
    ] = 2.5e-4
    u_max: Annotated[
        float, Quantity("V", "bound of the voltage; MSSP 2015 Section 6 prints 24 V", lo=0.0, open_lo=True)
    ] = 24.0
    phi_0: Annotated[float, Quantity("rad", "output angle at the start", display="deg")] = 0.0


class State(NamedTuple):
    phi: Annotated[float, Quantity("rad", "output angle")]
    omega: Annotated[float, Quantity("rad/s", "output speed; exactly 0 at rest")]
    i: Annotated[float, Quantity("A", "armature current")]


class Inputs(NamedTuple):
    u: Annotated[float, Quantity("V", "armature voltage")]
    tau_load: Annotated[float, Quantity("N.m", "load torque at the gearhead output, opposes omega > 0")]


class Outputs(NamedTuple):
    phi: Annotated[float, Quantity("rad", "angle of the gearhead output", display="deg")]
    omega: Annotated[float, Quantity("rad/s", "speed of the gearhead output", display="deg/s")]
    domega: Annotated[float, Quantity("rad/s2", "acceleration of the gearhead output", display="deg/s2")]
    i: Annotated[float, Quantity("A", "armature current")]


ROLES = Roles(
    # the states do not follow at once, and the voltage moves the current first
    depends={"phi": (), "omega": (), "domega": ("tau_load",), "i": ()},
    experiment=DefaultExperiment(2.0, 1e-3),
)

PRESETS = {
    "datasheet": Preset(
        source=(
            "MSSP 2015 names the motor (FAULHABER 2642W024CR, Section 4) and 24 V (Section 6). All else is assumed: "
            "R_a, L_a, k_t, k_e, J_rotor catalogue values of the series as quoted by others, not checked against the "
            "maker's sheet; tau_c and b split the friction of the 6400 rpm no-load speed; a 14:1 planetary gearhead of "
            "efficiency 0.8; J_load of two 50 mm pulleys and a second such motor as load"
        ),
        printed={
            "R_a": (5.78, "ohm"),
            "L_a": (550.0, "uH"),
            "k_t": (34.9, "mN.m/A"),
            "k_e": (34.9, "mV.s/rad"),
            "J_rotor": (11.0, "g.cm2"),
            "tau_c": (2.0, "mN.m"),
            "gear_ratio": (14.0, "1"),
            "efficiency": (80.0, "%"),
            "u_max": (24.0, "V"),
        },
        si={},
    )
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    s = State(p.phi_0, 0.0, 0.0)
    return s, _outputs(p, s, _voltage(p, u), u.tau_load)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    voltage, tau_load = _voltage(p, u), u.tau_load
    tau_c, efficiency = p.tau_c, p.efficiency
    phi, omega, i = s
    left = dt
    e = 0.0  # the flow of power is known from the second stretch on
    for _ in range(MOST_EVENTS):
        direction = math.copysign(1.0, omega) if omega != 0.0 else _breakaway(p, voltage, tau_load, i)
        if direction == 0.0:
            i, left = _held(p, voltage, tau_load, i, left)
            omega, e = 0.0, 0.0
        else:
            e, torque, rise, di, domega, ddi, ddomega, a_1, a_0 = _sliding(p, voltage, tau_load, omega, i, direction, e)
            E, G = slope_response(a_1, a_0, left)
            to_rest, to_change = math.inf, math.inf
            if tau_c > 0.0 or efficiency < 1.0:
                to_rest = first_fall_below_zero(
                    direction * omega, direction * domega, direction * ddomega, a_1, a_0, left, E, G
                )
            if efficiency < 1.0:
                dddomega = -a_1 * ddomega - a_0 * domega  # (L1)
                to_change = first_fall_below_zero(torque, rise * ddomega, rise * dddomega, a_1, a_0, left, E, G)
            t = to_rest if to_rest < to_change else to_change
            if t < left:
                E, G = slope_response(a_1, a_0, t)
            else:
                t = left
            lean = ddomega + a_1 * domega
            phi += omega * t + domega * G + lean * (t - E - a_1 * G) / a_0  # (5)
            omega += domega * E + lean * G
            i += di * E + (ddi + a_1 * di) * G
            if t == to_rest:
                omega, e = 0.0, 0.0
            elif t == to_change:
                e = 1.0 / e
            elif omega * direction > 0.0:  # no event in what was left: the ordinary end of a step
                domega = domega * (1.0 - a_1 * E - a_0 * G) + lean * E
                return State(phi, omega, i), Outputs(phi, omega, domega, i)
            left -= t
        if left <= 0.0:
            reached = State(phi, omega, i)
            return reached, _outputs(p, reached, voltage, tau_load)
    raise ValueError(
        "DcMotor reverses more than 100000 times in one step -- expected fewer -- make the communication step shorter"
    )


def _voltage(p: Params, u: Inputs) -> float:
    return u.u if abs(u.u) <= p.u_max else math.copysign(p.u_max, u.u)  # (1)


def _outputs(p: Params, s: State, voltage: float, tau_load: float) -> Outputs:
    direction = math.copysign(1.0, s.omega) if s.omega != 0.0 else _breakaway(p, voltage, tau_load, s.i)
    domega = 0.0
    if direction != 0.0:
        _, _, _, _, domega, _, _, _, _ = _sliding(p, voltage, tau_load, s.omega, s.i, direction, 0.0)
    return Outputs(s.phi, s.omega, domega, s.i)


def _holding_current(p: Params, tau_load: float, direction: float) -> float:
    e = p.efficiency if tau_load * direction < 0.0 else 1.0 / p.efficiency
    return (direction * p.tau_c + tau_load * e / p.gear_ratio) / p.k_t  # (6)


def _breakaway(p: Params, voltage: float, tau_load: float, i: float) -> float:
    """Sign of the motion that starts from rest, 0 where friction holds."""
    upper, lower = _holding_current(p, tau_load, 1.0), _holding_current(p, tau_load, -1.0)
    rounding = ROUNDING * (abs(i) + abs(upper) + abs(lower)) + NO_CURRENT
    final = voltage / p.R_a
    if i > upper + rounding or (i >= upper - rounding and final > upper + NO_CURRENT):
        return 1.0
    if i < lower - rounding or (i <= lower + rounding and final < lower - NO_CURRENT):
        return -1.0
    return 0.0


def _held(p: Params, voltage: float, tau_load: float, i: float, left: float) -> tuple[float, float]:
    """Current after the shaft was held for as long as it is, and the time that is left then."""
    final = voltage / p.R_a
    limit = _holding_current(p, tau_load, 1.0 if final > i else -1.0)
    rate = p.R_a / p.L_a
    if (final - limit) * (final - i) > 0.0:  # the limit is passed on the way to the final current
        t = math.log((i - final) / (limit - final)) / rate
        if 0.0 < t < left:
            return limit, left - t
    return final + (i - final) * math.exp(-rate * left), 0.0


def _sliding(
    p: Params, voltage: float, tau_load: float, omega: float, i: float, direction: float, e: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """What (1)-(4) give while the shaft turns, or begins to turn, in one direction.

    Returns e, found where it is given as 0; the torque e N tau_m at the gearhead output in the direction that this e
    is for, a rounding added, and its rise with domega; the first derivatives of i and omega, their second ones; a_1
    and a_0.
    """
    R_a, L_a, k_t, k_e, J_rotor, b, tau_c, n, efficiency, J_load, _, _ = p  # a look-up each would double the cost
    b_n, k_n = b * n, k_e * n
    di = (voltage - R_a * i - k_n * omega) / L_a  # (1)
    shaft = k_t * i - b_n * omega - direction * tau_c
    if e == 0.0:
        g = J_load * shaft + J_rotor * n * tau_load
        if g == 0.0:  # its rate, as domega = -tau_load/J_load with either e
            g = J_load * k_t * di + b_n * tau_load
        e = efficiency if direction * g >= 0.0 else 1.0 / efficiency  # (4)
    inertia = J_load + e * n * n * J_rotor
    gain = e * n / inertia
    domega = gain * shaft - tau_load / inertia  # (2), (3)
    if omega == 0.0 and domega * direction < 0.0:
        domega = 0.0  # starts at the holding limit, where rounding may have put it behind
    flow = direction if e < 1.0 else -direction
    # the torque of free running is zero: its rounding, a part of the stall torque, must not change the flow
    spare = ROUNDING * (e * n * (k_t * abs(voltage) / R_a + tau_c) + abs(tau_load))
    torque = flow * (J_load * domega + tau_load) + spare
    ddi = -(R_a * di + k_n * domega) / L_a
    ddomega = gain * (k_t * di - b_n * domega)
    a_1 = R_a / L_a + gain * b_n  # (7)
    a_0 = gain * (R_a * b_n + k_t * k_n) / L_a
    return e, torque, flow * J_load, di, domega, ddi, ddomega, a_1, a_0
