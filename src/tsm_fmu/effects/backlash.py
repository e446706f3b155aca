"""Play: the output stands still after a reversal until the gap is crossed.

::

    y <- clip(y_last, y - w, y + w)                                                     (1)

w is half the gap; the start is in the middle of it. Limits: w = 0 changes nothing; a stroke inside the gap
moves nothing; the lost motion is 2 w at any speed and load.
Source: Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "backlash"
ABOUT = Effect(
    words="backlash",
    signature="flat after reversal, width speed-independent",
    shown_by="slow strokes wider than the gap, and some within it",
    places=("output", "input"),
    family="history",
    looks_like=("presliding_shape", "tendon_elasticity", "delay"),
    play=True,
    motion_only=True,
)


class Params(NamedTuple):
    w: Annotated[float, Quantity("{y}", "half the gap, Eq (1)", lo=0.0), Size(first=1e-3, tries=(0.01, 0.03, 0.1))] = (
        0.0
    )


NEUTRAL = Params()


class State(NamedTuple):
    y: Annotated[float, Quantity("{y}", "output of the play")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.y), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    y = min(max(s.y, u.y - p.w), u.y + p.w)  # (1)
    return State(y), Outputs(y)
