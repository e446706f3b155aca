"""The signal comes late by a fixed time.

::

    y <- y(t - T_d)                                                                     (1)

The last 64 steps are kept; between two of them the signal is a straight line, before the start it is its first
value. T_d may be at most 63 steps; more is refused, not shortened. Limits: T_d = 0 changes nothing.
Steps of equal length are assumed inside the buffer. Source: dead time of control engineering.
"""

from typing import Annotated, Any, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "delay"
ABOUT = Effect(
    words="a delay",
    signature="phase proportional to frequency",
    shown_by="a frequency sweep, or fast motion with sharp corners",
    places=("output", "input"),
    family="sensor",
    looks_like=("backlash", "sensor_lag"),
    fitted_as="delay",
)


KEPT = 64
"""Steps of the signal that are kept."""


class Params(NamedTuple):
    T_d: Annotated[float, Quantity("s", "delay, Eq (1)", lo=0.0), Size(most_steps=KEPT - 1)] = 0.0


NEUTRAL = Params()


Line: Any = tuple[(float,) * KEPT]


class State(NamedTuple):
    line: Annotated[Line, Quantity("{y}", "signal at the last steps, the latest first")]  # pyright: ignore


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    four = (u.y, u.y, u.y, u.y)
    sixteen = four + four + four + four
    return State(sixteen + sixteen + sixteen + sixteen), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    steps = p.T_d / dt
    if steps > 63.0:
        raise ValueError("T_d over dt -- expected at most the 63 steps kept -- shorten T_d or lengthen the step")
    line = (u.y, *s.line[:-1])
    k = int(steps)
    late = line[k]
    if steps > k:
        late += (steps - k) * (line[k + 1] - late)  # (1)
    return State(line), Outputs(late)
