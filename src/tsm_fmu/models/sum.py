"""Weighted sum of three signals.

Elementary signal block (no paper)::

    y = k_1 u_1 + k_2 u_2 + k_3 u_3                                                     (1)

Source: definition. Validity: any finite input; without memory, so the step size does not matter.
y has the unit of k_j u_j, whatever that is: an FMU declares none for u_j and y.
"""

from typing import Annotated, NamedTuple

from .contract import DefaultExperiment, Preset, Quantity, Roles

NAME = "Sum"
ROLES = Roles(any_unit=True, experiment=DefaultExperiment(20.0, 0.01))


class Params(NamedTuple):
    k1: Annotated[float, Quantity("1", "gain of u1, Eq (1)")] = 1.0
    k2: Annotated[float, Quantity("1", "gain of u2, Eq (1)")] = 1.0
    k3: Annotated[float, Quantity("1", "gain of u3, Eq (1)")] = 1.0


class State(NamedTuple):
    y: Annotated[float, Quantity("1", "sum at the end of the last step")]


class Inputs(NamedTuple):
    u1: Annotated[float, Quantity("1", "first signal")]
    u2: Annotated[float, Quantity("1", "second signal")]
    u3: Annotated[float, Quantity("1", "third signal")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("1", "weighted sum, Eq (1)")]


PRESETS = {
    "add": Preset(source="definition", printed={"k1": (1.0, "1"), "k2": (1.0, "1"), "k3": (1.0, "1")}, si={}),
    "difference": Preset(
        source="definition: u1 - u2, an error signal",
        printed={"k1": (1.0, "1"), "k2": (-1.0, "1"), "k3": (0.0, "1")},
        si={"k2": -1.0, "k3": 0.0},
    ),
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    y = p.k1 * u.u1 + p.k2 * u.u2 + p.k3 * u.u3  # (1)
    return State(y), Outputs(y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return start(p, u)
