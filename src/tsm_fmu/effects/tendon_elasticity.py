"""Lost motion proportional to the tension: the tendon stretches under its load.

::

    x_e = x - load/k,   written with the compliance C = 1/k so that 0 changes nothing:  y <- y - C load   (1)

Limits: C = 0 is a rigid tendon. Source: Hooke; AME 2020 Eqs (20)-(24); effects.md 1, `tendon_elasticity`.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity

NAME = "tendon_elasticity"
PLACES = ("output",)
MOTION_ONLY = True  # among outputs, it makes sense on a position
SIGNATURE = "lost motion proportional to tension"


class Params(NamedTuple):
    compliance: Annotated[float, Quantity("{y}/({load})", "lost motion per load, Eq (1)", lo=0.0)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "motion before this effect")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "motion with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y - p.compliance * u.load)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y - p.compliance * u.load)  # (1)
