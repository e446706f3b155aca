"""Drift at a hold: a spring whose rest point follows, or a tendon that goes on stretching under its load.

::

    y <- y + k (x - x_c) - C l_c,   tau dx_c/dt = x - x_c,   tau dl_c/dt = load - l_c   (1)

x and the load are taken as linear over the step, which (1) then solves exactly. At the start x_c = x, and l_c = l_0
load: a load that acted long before has l_0 = 1, one that is put on as a run begins l_0 = 0. Limits: k = C = 0 changes
nothing; fast motion sees a spring k, a long hold none; of a load that stays the tendon has the stretch C load beyond
that of `tendon_elasticity`, which comes at once. The second part is at a measured position; without a load there is
none. Source: Maxwell element (a spring and a damper in series) for the first part, Kelvin-Voigt element (side by side)
for the second.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size
from .lag import lagged

NAME = "creep"
ABOUT = Effect(
    words="creep",
    signature="drift at hold",
    shown_by="steps of load or position, held for several times the time constant",
    places=("friction", "output"),
    family="history",
    looks_like=("inertia", "stiffness_hardening", "tendon_elasticity"),
    motion_only=True,
    at_outputs=("load",),
)


class Params(NamedTuple):
    k: Annotated[float, Quantity("{y}/({x})", "relaxing stiffness, Eq (1)"), Size(first=1e-3)] = 0.0
    C: Annotated[float, Quantity("{y}/({load})", "delayed stretch per load, Eq (1)", lo=0.0), Size(first=1e-3)] = 0.0
    tau: Annotated[
        float, Quantity("s", "relaxation time, Eq (1)", lo=0.0, open_lo=True), Shape("time", 0.0032, 1.0)
    ] = 1.0
    l_0: Annotated[
        float, Quantity("1", "part of the load that it has stretched for at the start", lo=0.0, hi=1.0),
        Shape("share", 0.0, 1.0),
    ] = 1.0  # fmt: skip


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    x_c: Annotated[float, Quantity("{x}", "rest point")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]
    l_c: Annotated[float, Quantity("{load}", "load that the tendon has stretched for")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    l_c = p.l_0 * u.load
    return State(u.x, u.x, u.load, l_c), Outputs(u.y - p.C * l_c)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    x_c = lagged(s.x_c, s.x, u.x, dt, p.tau)
    l_c = lagged(s.l_c, s.load, u.load, dt, p.tau)
    return State(u.x, x_c, u.load, l_c), Outputs(u.y + p.k * (u.x - x_c) - p.C * l_c)  # (1)
