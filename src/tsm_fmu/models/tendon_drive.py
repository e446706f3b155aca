"""A tendon-sheath drive: hysteretic motion from the drive to the distal side, friction torque back onto the drive.

Motion: MSSP 2015 Eqs (9), (10). Friction: LuGre, AME 2020 Eq (40), as a torque over the drive speed. Together (ours)::

    x_out  = c x_in + x_h + x_0                                                         (T1)
    tau_in = ratio tau_out + g_LuGre(v_in)                                              (T2)

with v_in from x_in by the causal filter of `velocity_filter`. All three parts step exactly. With power into
the drive tau_in v_in >= 0 in mean, ratio is the quasi-static torque ratio (c for a lossless drive).

Validity: 0 < B = c + beta; then |x_h| <= max(|x_h_0|, |beta|/alpha), and |sigma0 z| <= max(tau_c, tau_s).
"""

from typing import Annotated, NamedTuple

from .contract import Condition, FrictionPort, Preset, Quantity, Roles
from .laws.coleman_hodgdon import RISING, START_NEAR_LOOP, hysteresis_after
from .laws.lugre import bristle_after, friction, passive_damping, stribeck
from .laws.velocity_filter import filtered_slope

NAME = "TendonDrive"


class Params(NamedTuple):
    c: Annotated[float, Quantity("1", "ratio of output to input motion", lo=0.0, open_lo=True)] = 1.00056
    beta: Annotated[float, Quantity("1", "slope change at a reversal, B - c", hi=0.0, open_hi=True)] = -0.91693
    alpha: Annotated[
        float, Quantity("1/rad", "inverse of the travel that forgets a reversal", lo=0.0, open_lo=True)
    ] = 10.1062
    x_0: Annotated[float, Quantity("rad", "output offset", display="deg")] = 0.0
    x_h_0: Annotated[float, Quantity("rad", "hysteresis part at the start", display="deg")] = 0.0
    ratio: Annotated[float, Quantity("1", "drive torque per distal torque", lo=0.0, open_lo=True)] = 1.0
    sigma0: Annotated[float, Quantity("N.m/rad", "bristle stiffness", lo=0.0, open_lo=True)] = 1.46435
    sigma1: Annotated[float, Quantity("N.m.s/rad", "micro-damping of the bristles", lo=0.0)] = 0.021025
    sigma2: Annotated[float, Quantity("N.m.s/rad", "viscous friction", lo=0.0)] = 0.0218
    tau_c: Annotated[float, Quantity("N.m", "Coulomb level", lo=0.0, open_lo=True)] = 0.1
    tau_s: Annotated[float, Quantity("N.m", "static level", lo=0.0, open_lo=True)] = 0.1485
    v_s: Annotated[float, Quantity("rad/s", "Stribeck speed", lo=0.0, open_lo=True)] = 0.66
    tau_v: Annotated[float, Quantity("s", "time constant of the speed filter, 0: difference quotient", lo=0.0)] = 0.005


class State(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "input at the end of the last step")]
    x_h: Annotated[float, Quantity("rad", "hysteresis part")]
    v_in: Annotated[float, Quantity("rad/s", "filtered drive speed")]
    z: Annotated[float, Quantity("rad", "mean bristle deflection")]


class Inputs(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "drive-side angle", display="deg")]
    tau_out: Annotated[float, Quantity("N.m", "torque on the distal side")]


class Outputs(NamedTuple):
    x_out: Annotated[float, Quantity("rad", "distal angle, Eq (T1)", display="deg")]
    v_in: Annotated[float, Quantity("rad/s", "filtered drive speed", display="deg/s")]
    tau_in: Annotated[float, Quantity("N.m", "drive torque, Eq (T2)")]


PRESETS = {
    "published": Preset(
        source=(
            "motion: MSSP 2015, Section 7; friction: LuGre baseline of MMT 2015, Section 3.2, as a torque over the "
            "25 mm pulley of MSSP 2015 (the MMT pulley is not given); ratio and tau_v are assumed"
        ),
        printed={
            "c": (1.00056, "1"),
            "beta": (-0.91693, "1"),
            "alpha": (10.1062, "1/rad"),
            "sigma0": (58.574 * 25.0, "N*mm/rad"),
            "sigma1": (0.841 * 25.0, "N*mm*s/rad"),
            "sigma2": (0.872 * 25.0, "N*mm*s/rad"),
            "tau_c": (4.0 * 25.0, "N*mm"),
            "tau_s": (5.94 * 25.0, "N*mm"),
            "v_s": (0.66, "rad/s"),
        },
        si={},
    )
}


def needed_damping(p: Params) -> float:
    """Least sigma2 with which the friction gains no energy [N.m.s/rad]."""
    return passive_damping(p.tau_c, p.tau_s, p.sigma1)


def spare_damping(p: Params) -> float:
    """What sigma2 is above that."""
    return p.sigma2 - needed_damping(p)


CONDITIONS = (
    RISING,
    Condition(
        "sigma2 >= sigma1 (tau_s - tau_c)/tau_c",
        spare_damping,
        "sigma2 = {sigma2:g} N.m.s/rad is below sigma1 (tau_s - tau_c)/tau_c = {needed:g} N.m.s/rad",
        "lower sigma1",
        closed=True,
        numbers={"needed": needed_damping},
        consequence="the friction is not passive near v_s",
    ),
)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    s = rest(p, u.x_in)
    return s, Outputs(distal_angle(p, s), s.v_in, p.ratio * u.tau_out + friction_torque(p, s))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    after = moved(p, s, u.x_in, dt)
    return after, Outputs(distal_angle(p, after), after.v_in, p.ratio * u.tau_out + friction_torque(p, after))


def rest(p: Params, x_in: float) -> State:
    """State of a drive at rest at ``x_in``, bristles relaxed."""
    return State(x_in, p.x_h_0, 0.0, 0.0)


def moved(p: Params, s: State, x_in: float, dt: float) -> State:
    """State after the drive side went evenly to ``x_in`` within ``dt``."""
    x_h = hysteresis_after(s.x_h, x_in - s.x_in, p.beta, p.alpha)
    v_in = filtered_slope(s.v_in, s.x_in, x_in, dt, p.tau_v)
    z = bristle_after(s.z, v_in, dt, stribeck(v_in, p.tau_c, p.tau_s, p.v_s) / p.sigma0)
    return State(x_in, x_h, v_in, z)


def distal_angle(p: Params, s: State) -> float:
    """x_out, Eq (T1)."""
    return p.c * s.x_in + s.x_h + p.x_0  # (T1)


def friction_torque(p: Params, s: State) -> float:
    """Friction part of the drive torque, second term of Eq (T2)."""
    steady = stribeck(s.v_in, p.tau_c, p.tau_s, p.v_s) / p.sigma0
    return friction(s.z, s.v_in, steady, p.sigma0, p.sigma1, p.sigma2)  # (T2)


def friction_in(p: Params, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for a chain with effects."""
    return o.tau_in - p.ratio * u.tau_out


def with_friction(p: Params, u: Inputs, o: Outputs, f: float) -> Outputs:
    """Outputs with the friction ``f`` instead, Eq (T2)."""
    return Outputs(o.x_out, o.v_in, p.ratio * u.tau_out + f)


def lost_motion(p: Params, u: Inputs, o: Outputs) -> float:
    """How far the distal angle lags behind the drive, for the effects that change it."""
    return p.c * u.x_in + p.x_0 - o.x_out


ROLES = Roles(
    motion="x_in",
    load="tau_out",
    drive="tau_in",
    offsets=("x_0",),
    initial=("x_h_0",),
    has={"stribeck": ("tau_s", "v_s")},
    depends={"x_out": ("x_in",), "v_in": ("x_in",)},
    friction=FrictionPort("tau_in", friction_in, with_friction),
    lost_motion={"x_out": lost_motion},
    plausible=(START_NEAR_LOOP,),
)
