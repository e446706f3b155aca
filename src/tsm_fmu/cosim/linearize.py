"""A unit or a loop, linearised about a working point: what a small impulse at an input changes at an output.

The system runs twice with the same values but for an impulse of one communication step at the working point, once up
and once down; the difference is the impulse response of the linear system at the communication points. Where the loop
is opened, the input gets in both runs what the closed loop gave it: the working point stays that of the loop. The
response becomes a state space by the eigensystem realisation algorithm (Juang and Pappa, J. Guidance 8 (1985) 620;
`control.eigensys_realization`), of the lowest order that leaves nothing of it.

No FMU needs derivatives or a saved state for this, and what a discrete controller and the exchange cost is in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..models.contract import InputError
from .master import number_of_steps, simulate_system
from .order import schedule
from .program import Stimulus
from .ssp import Case
from .system import check_system
from .trajectory import Trajectory

Array = NDArray[np.float64]

MOST_ORDER = 20
"""Higher orders than this are rounding."""
UNEXPLAINED = 1e-6
"""Share of the response that a realisation may leave, as a root mean square."""


@dataclass(frozen=True)
class Margins:
    """Of a loop with the open-loop response L; infinite where nothing crosses.

    Attributes
    ----------
    crossover : float
        Where the gain is 1 [rad/s]; NaN where that is nowhere.
    gain_margin_db, phase_margin_deg : float
        Least of each.
    delay_margin_s : float
        Delay that the loop stands [s].
    """

    crossover: float
    gain_margin_db: float
    phase_margin_deg: float
    delay_margin_s: float


def margins(response: NDArray[np.complex128], omega: Array) -> Margins:
    """Margins of the loop with an open-loop frequency response at frequencies [rad/s]."""
    import control

    found: Any = control.stability_margins(control.frd(response, omega))
    gain, phase, _, _, crossover, _ = (math.nan if value is None else float(value) for value in found)
    crossed = math.isfinite(crossover) and crossover > 0.0
    return Margins(
        crossover if crossed else math.nan,
        20.0 * math.log10(gain) if math.isfinite(gain) and gain > 0.0 else math.inf,
        phase,
        math.radians(phase) / crossover if crossed else math.inf,
    )


@dataclass(frozen=True)
class Linear:
    """A linear system at the communication points.

    Attributes
    ----------
    model : control.StateSpace
        From input to output, discrete, with the communication step; where the loop is open, of the open loop: 1 + L = 0
        is its characteristic equation.
    response : ndarray, shape (n,)
        Measured impulse response, `unit` per step.
    unexplained : float
        Share of the response that the model does not give (root mean square); 0 is all given.
    asymmetry : float
        Difference of the responses to the impulses up and down, as a share (root mean square): 0 for a linear system.
    unit : str
        Of the output over that of the input.
    opened : bool
        Whether the loop was open at the input.
    at : float
        The working point [s].
    """

    model: Any
    response: Array
    unexplained: float
    asymmetry: float
    unit: str
    opened: bool
    at: float

    @property
    def step(self) -> float:
        """Communication step [s]."""
        return float(self.model.dt)

    @property
    def range(self) -> tuple[float, float]:
        """Frequencies that the response tells of [rad/s]: one period within it, up to the Nyquist frequency."""
        return 2.0 * math.pi / ((self.response.size - 1) * self.step), math.pi / self.step

    def margins(self) -> Margins:
        """Margins of the open loop within `range`."""
        omega = np.geomspace(*self.range, 2000)[:-1]
        return margins(self.frequency_response(omega), omega)

    def frequency_response(self, omega: Array) -> NDArray[np.complex128]:
        """The response at frequencies [rad/s] below the Nyquist frequency."""
        return np.asarray(self.model(np.exp(1j * omega * self.step)))


def linearize(
    case: Case,
    source: str,
    output: str,
    at: float,
    *,
    opened: bool,
    amplitude: float | None = None,
    horizon: float | None = None,
    order: int | None = None,
    simulate: Callable[..., Trajectory] = simulate_system,
) -> Linear:
    """Linearise a system from an input to an output.

    Parameters
    ----------
    case : (System, Experiment)
    source, output : str
        ``component.variable``: the input that gets the impulse, and what is looked at.
    at : float
        When [s].
    opened : bool
        Cut what is connected to the input: the response is that of the open loop, with the sign of its return.
    amplitude : float, optional
        Of the impulse, in the unit of the input; without it 1e-7 of the input's largest value (of 1 if that is zero).
    horizon : float, optional
        How long the response is looked at [s]; 1000 steps without it.
    order : int, optional
        Of the model; found without it.
    simulate : callable
        `simulate_system`, here or elsewhere.

    Raises
    ------
    InputError
        No such port, a time outside the run, or a response that is zero or not finite.
    """
    system, experiment = case
    step = experiment.step
    wiring = check_system(system)
    (component, variable), (owner, channel) = _address(source), _address(output)
    ports = wiring.descriptions[component].ports if component in wiring.descriptions else {}
    if variable not in ports or ports[variable].causality != "input" or ports[variable].kind != "Real":
        known = [f"{n}.{p.name}" for n, d in wiring.descriptions.items() for p in d.inputs if p.kind == "Real"]
        raise InputError(f"input {source!r} -- expected one of {', '.join(known)} -- correct the name")
    outputs = wiring.descriptions[owner].ports if owner in wiring.descriptions else {}
    if channel not in outputs or outputs[channel].causality != "output" or outputs[channel].kind != "Real":
        known = [f"{n}.{p.name}" for n, d in wiring.descriptions.items() for p in d.outputs if p.kind == "Real"]
        raise InputError(f"output {output!r} -- expected one of {', '.join(known)} -- correct the name")
    link = next((link for link in wiring.links if link.target == (component, variable)), None)
    if opened and link is None:
        raise InputError(f"input {source} is not connected -- expected one in a loop -- leave it closed")
    before = round((at - experiment.start) / step)
    length = 1000 if horizon is None else round(horizon / step)
    if not (math.isfinite(at) and before >= 1 and length >= 10):
        raise InputError(
            f"working point {at!r} s with horizon {length * step:g} s -- expected one after the start "
            f"({experiment.start:g} s) and 10 steps of {step:g} s or more -- correct it"
        )
    steps = number_of_steps(experiment.start, experiment.start + (before + length) * step, step)
    delayed = link is None or experiment.method == "jacobi" or link in schedule(wiring, experiment.loops).delayed
    record = list(dict.fromkeys([output, *([] if link is None else [".".join(link.source)])]))

    def run(*stimuli: Stimulus) -> Trajectory:
        return simulate(
            system, experiment.start + steps * step, step, start=experiment.start, method=experiment.method,
            loops=experiment.loops, record=record, stimuli=stimuli, compiled=True,
        )  # fmt: skip

    base = run()
    if link is None:
        start = dict(next(c for c in wiring.system.components if c.name == component).parameters)
        values: Array = np.full(steps, float(start[variable]))
    else:
        column = base.columns[".".join(link.source)]
        values = link.gain * (column[:-1] if delayed else column[1:]) + link.offset
    size = amplitude if amplitude is not None else 1e-7 * (float(np.max(np.abs(values))) or 1.0)
    if not (math.isfinite(size) and size > 0.0):
        raise InputError(f"amplitude {size!r} -- expected a positive number -- correct it")

    def response(height: float) -> Array:
        impulse = np.zeros(steps)
        impulse[before] = height
        stimulus = Stimulus(component, variable, values + impulse if opened or link is None else impulse, not (
            opened or link is None
        ))  # fmt: skip
        first = before if delayed else before + 1
        return (run(stimulus).columns[output] - base.columns[output])[first:] / height

    up, down = response(size), response(-size)
    mean = 0.5 * (up + down)
    norm = float(np.sqrt(np.mean(mean**2)))
    if not (math.isfinite(norm) and norm > 0.0):
        raise InputError(
            f"{output} does not answer to {source} within {length * step:g} s -- expected a response -- take another "
            "output, a longer --horizon or a larger --amplitude"
        )
    asymmetry = float(np.sqrt(np.mean((up - down) ** 2))) / norm
    model, unexplained = realised(-mean if opened else mean, step, order)
    unit = f"({outputs[channel].unit or '1'})/({ports[variable].unit or '1'})"
    return Linear(model, mean, unexplained, asymmetry, unit, opened, at)


def realised(response: Array, step: float, order: int | None = None) -> tuple[Any, float]:
    """State space of an impulse response, and the share that it leaves (root mean square).

    Parameters
    ----------
    response : ndarray, shape (n,)
        At the communication points from the impulse on.
    step : float
        Communication step [s].
    order : int, optional
        Without it the lowest that leaves less than `UNEXPLAINED`, or the best.
    """
    import control

    size = (response.size - 1) // 2
    tried: list[tuple[float, int, Any]] = []
    for number in range(1, min(MOST_ORDER, size - 1) + 1) if order is None else [order]:
        found, _ = control.eigensys_realization(response, number, m=size, n=size, dt=True)
        model: Any = control.ss(found.A, found.B, found.C, found.D, step)
        left = float(np.sqrt(np.mean((_markov(model, response.size) - response) ** 2) / np.mean(response**2)))
        if math.isfinite(left):
            tried.append((left, number, model))
        if left <= UNEXPLAINED:
            break
    if not tried:
        raise InputError(f"order {order!r} -- expected one whose model is finite -- choose another")
    left, _, model = tried[-1] if tried[-1][0] <= UNEXPLAINED else min(tried, key=lambda item: item[0])
    return model, left


def _markov(model: Any, number: int) -> Array:
    a, b, c = (np.asarray(m) for m in (model.A, model.B, model.C))
    found = np.empty(number)
    found[0] = float(np.asarray(model.D)[0, 0])
    state = b
    for k in range(1, number):
        found[k] = float((c @ state)[0, 0])
        state = a @ state
    return found


def _address(name: str) -> tuple[str, str]:
    component, _, variable = name.partition(".")
    return component, variable
