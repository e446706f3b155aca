"""A unit that gives the derivatives of its states, linearised by its own directional derivatives: exact, continuous.

FMI 2.0 and 3.0 let a unit for co-simulation list its state derivatives for just that (``ModelStructure``) and answer
for the partial derivatives of those and of its outputs at a communication point.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..batching.stopping import interruptible
from .description import Description, describe
from .fmu_instance import FmuInstance
from .fmu_process import Processes
from .linearize import Linear, named
from .master import number_of_steps
from .ssp import Case
from .system import check_system
from .unpack import unpacked


def has_derivatives(description: Description) -> bool:
    """Whether a unit lists state derivatives and answers for their partial derivatives."""
    model = description.model
    return bool(model.coSimulation.providesDirectionalDerivative and model.derivatives)


def of_derivatives(
    case: Case, inputs: Sequence[str], outputs: Sequence[str], at: float, processes: Processes | None = None
) -> Linear:
    """Linearise the only unit of a system, which `has_derivatives`, from inputs to outputs (``component.variable``).

    Raises
    ------
    InputError
        As `simulate_system`; also where the unit refuses a derivative.
    """
    import control

    system, experiment = case
    wiring = check_system(system)
    (component,) = wiring.system.components
    description = describe(component.fmu)
    steps = number_of_steps(experiment.start, at, experiment.step)
    ports = description.ports
    driven, seen = ([name.partition(".")[2] for name in names] for names in (inputs, outputs))
    rates = [unknown.variable for unknown in description.model.derivatives]
    states = [rate.derivative for rate in rates]
    known = [int(v.valueReference) for v in states] + [ports[name].reference for name in driven]
    unknown = [int(v.valueReference) for v in rates] + [ports[name].reference for name in seen]
    with (
        interruptible() as asked,
        unpacked(component.fmu) as directory,
        FmuInstance(component.name, description, directory, [], seen, processes) as instance,
    ):
        instance.enter_initialization(experiment.start, None, component.parameters)
        instance.exit_initialization(experiment.start)
        for k in range(steps):
            instance.step(experiment.start + k * experiment.step, experiment.step)
            if asked:
                raise KeyboardInterrupt
        columns = [instance.derivative(unknown, [reference], at) for reference in known]
    matrix: Any = np.array(columns).T
    n = len(states)
    model = control.ss(matrix[:n, :n], matrix[:n, n:], matrix[n:, :n], matrix[n:, n:])
    units = tuple(tuple(f"({ports[y].unit or '1'})/({ports[u].unit or '1'})" for u in driven) for y in seen)
    empty = np.empty((len(seen), len(driven), 0))
    return Linear(named(model, inputs, outputs), empty, 0.0, 0.0, units, False, at)
