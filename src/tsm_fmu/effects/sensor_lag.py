"""The sensor follows with a first-order lag.

::

    tau dy/dt + y = u                                                                   (1)

u is taken as linear over the step, which (1) then solves exactly. Limits: tau = 0 changes nothing; a ramp
comes out late by tau. Source: Astrom and Murray, Feedback Systems (2008), first-order lag.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size
from .lag import lagged

NAME = "sensor_lag"
ABOUT = Effect(
    words="a lag of the sensor",
    signature="first-order phase",
    shown_by="a frequency sweep up to the sensor's bandwidth",
    places=("output", "input"),
    family="sensor",
    looks_like=("delay",),
    role="nuisance",
)


class Params(NamedTuple):
    tau: Annotated[float, Quantity("s", "time constant, Eq (1)", lo=0.0), Size()] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    u: Annotated[float, Quantity("{y}", "signal before this effect")]
    y: Annotated[float, Quantity("{y}", "signal with this effect")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.y, u.y), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    y = lagged(s.y, s.u, u.y, dt, p.tau)  # (1)
    return State(u.y, y), Outputs(y)
