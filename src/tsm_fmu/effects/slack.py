"""One side goes free: the motion shifts by the free travel where the load changes its sign.

::

    y <- y - w load/(|load| + F_0)                                                      (1)

F_0 is the load at which half of the free travel w is taken up (a tendon that leaves its curved rest
gradually). Limits: w = 0 changes nothing; |load| >> F_0 shifts by +-w: backlash driven by the load, not by the motion.
Source: Kaneko et al. (1991), tendon on one side free; AME 2020 Eq (25).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "slack"
ABOUT = Effect(
    words="slack",
    signature="one side goes free",
    shown_by="low pretension, with the load taken off within the run",
    places=("output",),
    family="load",
    motion_only=True,
)


class Params(NamedTuple):
    w: Annotated[float, Quantity("{y}", "half the free travel, Eq (1)", lo=0.0), Size(first=1e-3)] = 0.0
    # a small part of the load takes up the free travel: what takes all of it is a spring
    F_0: Annotated[
        float,
        Quantity("{load}", "load that takes up half of it, Eq (1)", lo=0.0, open_lo=True),
        Shape("load", 0.0032, 0.1),
    ] = 0.01


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y - p.w * u.load / (abs(u.load) + p.F_0))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y - p.w * u.load / (abs(u.load) + p.F_0))  # (1)
