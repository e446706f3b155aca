"""The strength of friction follows the speed with a delay: a loop in F over v.

What is there at low speed only, and what grows with the speed, comes and goes late, the direction does not (a lag of
the whole friction is one of the sensor)::

    g = exp(-(v/v_s)^2),   tau df/dt + f = g,   tau dw/dt + w = |v|                     (1)
    F <- F (1 + d (f - g)) + d_v (w - |v|) s                                            (2)

g and |v| are taken as linear over the step, which (1) then solves exactly. Limits: d = d_v = 0 and tau = 0 change
nothing; at constant speed nothing is left after a few tau; what acts at once, the Stribeck curve and the viscous
friction themselves, is the model's or that of `stribeck` and `viscous`.
Source: Hess and Soom (J. Tribology 1990); Armstrong-Helouvry, frictional memory (1991).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size
from .lag import lagged
from .stribeck import excess

NAME = "friction_lag"
ABOUT = Effect(
    words="a lag of the friction behind the speed",
    signature="loop in F over v",
    shown_by="fast changes of speed without a reversal",
    places=("friction",),
    family="history",
)


class Params(NamedTuple):
    d: Annotated[
        float, Quantity("1", "share of the friction that comes late, Eq (2)", lo=0.0, hi=1.0), Size(first=1e-3)
    ] = 0.0
    d_v: Annotated[float, Quantity("{F}/({x}/s)", "viscous coefficient of what comes late, Eq (2)", lo=0.0), Size()] = (
        0.0
    )
    # friction lags where the motion is slow, within a small part of a run
    v_s: Annotated[float, Quantity("{x}/s", "its speed, Eq (1)", lo=0.0, open_lo=True), Shape("speed", 0.025, 0.5)] = (
        0.1
    )
    tau: Annotated[float, Quantity("s", "lag, Eq (1)", lo=0.0), Shape("time", 0.0001, 0.032)] = 0.05


NEUTRAL = Params()


class State(NamedTuple):
    g: Annotated[float, Quantity("1", "what is there at this speed, Eq (1)")]
    f: Annotated[float, Quantity("1", "the same late, Eq (1)")]
    v: Annotated[float, Quantity("{x}/s", "size of the speed")]
    w: Annotated[float, Quantity("{x}/s", "the same late, Eq (1)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    v: Annotated[float, Quantity("{x}/s", "speed")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    g = excess(u.v, p.v_s, 2.0)
    return State(g, g, abs(u.v), abs(u.v)), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    g = excess(u.v, p.v_s, 2.0)
    f = lagged(s.f, s.g, g, dt, p.tau)  # (1)
    w = lagged(s.w, s.v, abs(u.v), dt, p.tau)
    return State(g, f, abs(u.v), w), Outputs(u.y + p.d * (f - g) * u.y + p.d_v * (w - abs(u.v)) * u.s)  # (2)
