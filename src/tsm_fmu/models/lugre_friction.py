"""LuGre friction of a tendon in its sheath, on the speed alone.

Jia et al., Adv. Mech. Eng. 12 (2020), Eq (40), as corrected in `lugre`::

    dz/dt = v - sigma0 |v| z/g(v),    g = F_c + (F_s - F_c) exp(-(v/v_s)^2)             (40a, 40b)
    F     = sigma0 z + sigma1 dz/dt + sigma2 v                                          (40c)

and the baseline that MMT 2015 compares with (its Eqs (2)-(4), preset ``mmt2015``).
The step is exact while v holds. |sigma0 z| <= max(sigma0 |z0|, F_c, F_s); the start is relaxed (z = 0), so
that a start at speed shows the micro-damping sigma1 v once.

Validity: constant tension (F_c, F_s do not follow it); rate dependent.

Print defects: sigma1 = 10^2.5 is printed in N s/mm, which would make 15.8 kN at 0.05 m/s: N s/m is
meant (square root of 1e5, the textbook value of Canudas de Wit et al. 1995). F_c and F_s are not published.
"""

from typing import Annotated, NamedTuple

from .contract import Condition, FrictionPort, Preset, Quantity, Roles
from .laws.lugre import bristle_after, friction, passive_damping, stribeck

NAME = "LuGreFriction"


class Params(NamedTuple):
    sigma0: Annotated[float, Quantity("N/m", "bristle stiffness, Eq (40)", lo=0.0, open_lo=True)] = 1e5
    sigma1: Annotated[float, Quantity("N.s/m", "micro-damping of the bristles, Eq (40)", lo=0.0)] = 10**2.5
    sigma2: Annotated[float, Quantity("N.s/m", "viscous friction, Eq (40)", lo=0.0)] = 4.3
    F_c: Annotated[float, Quantity("N", "Coulomb level of g(v), Eq (40)", lo=0.0, open_lo=True)] = 0.16 * 0.5 * 9.81
    F_s: Annotated[float, Quantity("N", "static level of g(v), Eq (40)", lo=0.0, open_lo=True)] = 0.16 * 0.5 * 9.81
    v_s: Annotated[float, Quantity("m/s", "Stribeck speed, Eq (40)", lo=0.0, open_lo=True)] = 1e-5


class State(NamedTuple):
    z: Annotated[float, Quantity("m", "mean bristle deflection, Eq (40a)")]


class Inputs(NamedTuple):
    v: Annotated[float, Quantity("m/s", "speed of the tendon, positive is pull", display="mm/s")]


class Outputs(NamedTuple):
    F: Annotated[float, Quantity("N", "friction force against the motion, Eq (40c)")]
    P_loss: Annotated[float, Quantity("W", "power taken from the motion, F v")]


PRESETS = {
    "published": Preset(
        source=(
            "AME 2020, below Eq (40); sigma1 in N.s/m (the printed N.s/mm is a unit error). F_c and F_s are not "
            "published: both are mu_s = 0.16 times a hanging load of 0.5 kg: no Stribeck peak, v_s is idle"
        ),
        printed={"sigma0": (1e5, "N/m"), "sigma1": (10**2.5, "N*s/m"), "sigma2": (4.3, "N*s/m"), "v_s": (1e-5, "m/s")},
        si={},
    ),
    "mmt2015": Preset(
        source="MMT 2015, Section 3.2, fitted to motion in radians: feed v in rad/s, read m as rad and W as N.rad/s",
        printed={
            "sigma0": (58.574, "N/rad"),
            "sigma1": (0.841, "N*s/rad"),
            "sigma2": (0.872, "N*s/rad"),
            "F_c": (4.0, "N"),
            "F_s": (5.94, "N"),
            "v_s": (0.66, "rad/s"),
        },
        si={"sigma0": 58.574, "sigma1": 0.841, "sigma2": 0.872, "F_c": 4.0, "F_s": 5.94, "v_s": 0.66},
    ),
}


def needed_damping(p: Params) -> float:
    """Least sigma2 with which the friction gains no energy [N.s/m]."""
    return passive_damping(p.F_c, p.F_s, p.sigma1)


def spare_damping(p: Params) -> float:
    """What sigma2 is above that."""
    return p.sigma2 - needed_damping(p)


CONDITIONS = (
    Condition(
        "sigma2 >= sigma1 (F_s - F_c)/F_c",
        spare_damping,
        "sigma2 = {sigma2:g} N.s/m is below sigma1 (F_s - F_c)/F_c = {needed:g} N.s/m",
        "lower sigma1",
        closed=True,
        numbers={"needed": needed_damping},
        consequence="the friction is not passive near v_s",
    ),
)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(0.0), _outputs(p, 0.0, u.v, _steady(p, u.v))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    steady = _steady(p, u.v)
    z = bristle_after(s.z, u.v, dt, steady)  # (40d)
    return State(z), _outputs(p, z, u.v, steady)


def _steady(p: Params, v: float) -> float:
    """Steady magnitude S(v) of the deflection, Eq (40b)."""
    return stribeck(v, p.F_c, p.F_s, p.v_s) / p.sigma0


def _outputs(p: Params, z: float, v: float, steady: float) -> Outputs:
    f = friction(z, v, steady, p.sigma0, p.sigma1, p.sigma2)  # (40c)
    return Outputs(f, f * v)


def friction_in(p: Params, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for the effects that change it."""
    return o.F


def with_friction(p: Params, u: Inputs, o: Outputs, f: float) -> Outputs:
    """The outputs with friction ``f`` instead."""
    return Outputs(f, f * u.v)


ROLES = Roles(has={"stribeck": ("F_s", "v_s")}, friction=FrictionPort("F", friction_in, with_friction))
