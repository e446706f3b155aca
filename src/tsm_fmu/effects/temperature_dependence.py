"""Friction that follows a measured temperature, an input of the chain, `temperature` where no other column is named.

::

    F <- F max(1 - beta (T - T_ref), 0),   T_ref = 293.15 K                             (1)

Limits: beta = 0 changes nothing; a constant temperature is another level of friction. The linear form of Reynolds' law
of viscosity, exp(-beta (T - T_ref)). Where nothing measures it, warmth that the work itself makes is `thermal`.
Source: Bittencourt and Gunnarsson (J. Dyn. Syst. Meas. Control 134, 2012), friction of a robot joint linear in its
temperature.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "temperature_dependence"
ABOUT = Effect(
    words="temperature-dependent friction",
    words_on_motion="lost motion that changes with temperature",
    signature="follows a recorded temperature",
    shown_by="the same motion cold and warm, the temperature recorded",
    places=("friction", "lost motion"),
    family="time",
    looks_like=("thermal", "wear"),
)
T_REF = 293.15


class Params(NamedTuple):
    beta: Annotated[float, Quantity("1/K", "relative decrease per degree, Eq (1)"), Size(first=1e-3)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    temperature: Annotated[float, Quantity("K", "measured temperature")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y * max(1.0 - p.beta * (u.temperature - T_REF), 0.0))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y * max(1.0 - p.beta * (u.temperature - T_REF), 0.0))  # (1)
