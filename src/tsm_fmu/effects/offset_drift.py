"""A constant or slowly moving bias.

::

    y <- y + b + c t,   t since the start                                               (1)

Limits: b = c = 0 changes nothing. Source: zero and drift of a sensor, as in its data sheet.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "offset_drift"
ABOUT = Effect(
    words="an offset or drift",
    signature="constant or slowly moving bias",
    shown_by="a long run with a return to the same place, or rests in between",
    places=("output", "input", "friction"),
    family="time",
    looks_like=("direction_asymmetry",),
    role="nuisance",
    searched=("output",),  # at the friction it is the same as on the channel
    fitted_as="offset",
)


class Params(NamedTuple):
    b: Annotated[float, Quantity("{y}", "bias at the start, Eq (1)"), Size(as_nuisance="per run")] = 0.0
    c: Annotated[float, Quantity("{y}/s", "drift, Eq (1)"), Size(as_nuisance="zero")] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    t: Annotated[float, Quantity("s", "time since the start")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(0.0), Outputs(u.y + p.b)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    t = s.t + dt
    return State(t), Outputs(u.y + p.b + p.c * t)  # (1)
