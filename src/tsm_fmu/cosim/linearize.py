"""A unit or a loop, linearised about a working point: what small impulses at inputs change at outputs.

For each input the system runs twice with the same values but for an impulse of one communication step at the working
point, once up and once down; the difference is the impulse response of the linear system at the communication points.
Where a loop is opened, the input gets in both runs what the closed loop gave it: the working point stays that of the
loop. The responses become a state space by the eigensystem realisation algorithm (Juang and Pappa, J. Guidance 8 (1985)
620; `control.eigensys_realization`), of the lowest order that leaves nothing of them.

No FMU needs derivatives or a saved state for this, and what a discrete controller and the exchange cost is in it. A
unit that gives the derivatives of its states is linearised by those: `derivatives`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..models.contract import InputError
from .master import number_of_steps, simulate_system
from .order import schedule
from .program import Stimulus
from .ssp import Case
from .system import Link, Wiring, check_system
from .trajectory import Trajectory

Array = NDArray[np.float64]

MOST_ORDER = 20
"""Higher orders than this are rounding."""
LARGEST_HANKEL = 600
"""Rows of the largest matrix that responses are realised from."""
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
    """A linear system about a working point.

    Attributes
    ----------
    model : control.StateSpace
        From inputs to outputs, which it names, with ``_`` for a dot; discrete, with the communication step, or
        continuous where it is of derivatives. Where loops are open, of the open loops: for one, 1 + L = 0 is the
        characteristic equation.
    response : ndarray, shape (outputs, inputs, n)
        Measured impulse responses, unit of the output over that of the input per step; empty where it is of
        derivatives.
    unexplained : float
        Share of the responses that the model does not give (root mean square); 0 is all given.
    asymmetry : float
        Difference of the responses to the impulses up and down, as a share (root mean square): 0 for a linear system.
    units : tuple of tuple of str
        Of each output over each input.
    opened : bool
        Whether loops were open at the inputs.
    at : float
        The working point [s].
    returns : tuple of float
        Where loops are open and each output is what its input got, in the same order: the factors on the way from
        output to input. Else empty.
    """

    model: Any
    response: Array
    unexplained: float
    asymmetry: float
    units: tuple[tuple[str, ...], ...]
    opened: bool
    at: float
    returns: tuple[float, ...] = ()

    @property
    def step(self) -> float:
        """Communication step [s]; 0 for a continuous model."""
        return float(self.model.dt)

    @property
    def single(self) -> bool:
        """Whether it is of one input and one output."""
        return self.model.ninputs == self.model.noutputs == 1

    @property
    def range(self) -> tuple[float, float]:
        """Frequencies that it tells of [rad/s].

        One period within the response, up to the Nyquist frequency; of a continuous model two decades about its poles.
        """
        if self.step > 0.0:
            return 2.0 * math.pi / ((self.response.shape[-1] - 1) * self.step), math.pi / self.step
        poles = [size for size in np.abs(self.model.poles()) if size > 0.0] or [1.0]
        return 0.01 * min(poles), 100.0 * max(poles)

    def margins(self, loop: int = 0) -> Margins:
        """Margins of an open loop within `range`.

        With L the response of one input and output, times what the loop's return is scaled by, those of L. With
        several loops open, those of this one while the others are closed: their inputs u_o eliminated from
        (1 + L) u = 0, L the matrix of all open loops,

            L_k = L_kk - L_ko (1 + L_oo)^-1 L_ok

        Raises
        ------
        ValueError
            Several inputs or outputs that are not those of open loops (`returns` is empty).
        """
        omega = np.geomspace(*self.range, 2000)[:-1]
        response = self.frequency_response(omega)
        if self.single:
            return margins(response * (self.returns or (1.0,))[0], omega)
        if not self.returns:
            raise ValueError("expected loops that are open where their outputs return")
        matrix = np.moveaxis(response * np.array(self.returns)[:, None, None], -1, 0)
        others = [k for k in range(len(self.returns)) if k != loop]
        return_difference = np.eye(len(others)) + matrix[:, others][:, :, others]
        through = np.linalg.solve(return_difference, matrix[:, others, loop][:, :, None])
        around = (matrix[:, loop, others][:, None, :] @ through)[:, 0, 0]
        return margins(matrix[:, loop, loop] - around, omega)

    def frequency_response(self, omega: Array) -> NDArray[np.complex128]:
        """The response at frequencies below the Nyquist frequency.

        Parameters
        ----------
        omega : ndarray, shape (n,)
            [rad/s].

        Returns
        -------
        ndarray
            Shape (n,) for one input and output, else (outputs, inputs, n).
        """
        return np.asarray(self.model(np.exp(1j * omega * self.step) if self.step > 0.0 else 1j * omega))


@dataclass(frozen=True)
class _Input:
    component: str
    variable: str
    unit: str
    link: Link | None
    cut: bool
    delayed: bool

    def stimulus(self, values: Array, impulse: Array | None) -> Stimulus | None:
        """What it gets in a run; None for what it gets anyway."""
        if self.cut or (self.link is None and impulse is not None):
            return Stimulus(self.component, self.variable, values if impulse is None else values + impulse)
        return None if impulse is None else Stimulus(self.component, self.variable, impulse, add=True)


def linearize(
    case: Case,
    sources: str | Sequence[str],
    outputs: str | Sequence[str],
    at: float,
    *,
    opened: bool,
    amplitude: float | None = None,
    horizon: float | None = None,
    order: int | None = None,
    simulate: Callable[..., Trajectory] = simulate_system,
) -> Linear:
    """Linearise a system from inputs to outputs.

    Parameters
    ----------
    case : (System, Experiment)
    sources, outputs : str or sequence of str
        ``component.variable``: the inputs that get the impulses one after the other, and what is looked at.
    at : float
        When [s].
    opened : bool
        Cut what is connected to the inputs, to all of them at once: the response is that of the open loops, with the
        sign of their return.
    amplitude : float, optional
        Of the impulses, in the unit of each input; without it 1e-7 of the input's largest value (of 1 if that is zero).
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
    found = [_input(wiring, case, name, opened) for name in _several(sources, "input")]
    looked_at = _several(outputs, "output")
    output_units = [_port(wiring, name, "output").unit or "1" for name in looked_at]
    if opened and not any(one.cut for one in found):
        names = ", ".join(_several(sources, "input"))
        raise InputError(f"input {names} is not connected -- expected one in a loop -- leave it closed")
    before = round((at - experiment.start) / step)
    length = 1000 if horizon is None else round(horizon / step)
    if not (math.isfinite(at) and before >= 1 and length >= 10):
        raise InputError(
            f"working point {at!r} s with horizon {length * step:g} s -- expected one after the start "
            f"({experiment.start:g} s) and 10 steps of {step:g} s or more -- correct it"
        )
    steps = number_of_steps(experiment.start, experiment.start + (before + length) * step, step)
    record = list(dict.fromkeys([*looked_at, *(".".join(one.link.source) for one in found if one.link is not None)]))

    def run(*stimuli: Stimulus | None) -> Trajectory:
        return simulate(
            system, experiment.start + steps * step, step, start=experiment.start, method=experiment.method,
            loops=experiment.loops, record=record, stimuli=[s for s in stimuli if s is not None], compiled=True,
        )  # fmt: skip

    base = run()
    values = [_values(wiring, one, base, steps) for one in found]

    def response(number: int, height: float) -> Array:
        impulse = np.zeros(steps)
        impulse[before] = height
        given = zip(found, values, strict=True)
        moved = run(*(one.stimulus(own, impulse if k == number else None) for k, (one, own) in enumerate(given)))
        first = before if found[number].delayed else before + 1
        rows = [(moved.columns[name] - base.columns[name])[first : first + length] / height for name in looked_at]
        return np.array(rows)

    means, apart = [], []
    for number, own in enumerate(values):
        size = amplitude if amplitude is not None else 1e-7 * (float(np.max(np.abs(own))) or 1.0)
        if not (math.isfinite(size) and size > 0.0):
            raise InputError(f"amplitude {size!r} -- expected a positive number -- correct it")
        up, down = response(number, size), response(number, -size)
        means.append(0.5 * (up + down) * (-1.0 if found[number].cut else 1.0))
        apart.append(up - down)
    mean, difference = np.stack(means, axis=1), np.stack(apart, axis=1)
    _answers(mean, [f"{one.component}.{one.variable}" for one in found], looked_at, length * step)
    left, right = _scales(mean)
    asymmetry = _rms(difference / left / right) / _rms(mean / left / right)
    model, unexplained = realised(mean, step, order)
    model = named(model, [f"{one.component}.{one.variable}" for one in found], looked_at)
    units = tuple(tuple(f"({y})/({one.unit})" for one in found) for y in output_units)
    fed = [".".join(one.link.source) if one.link is not None and one.cut else None for one in found]
    returns = tuple(one.link.gain for one in found if one.link is not None) if fed == looked_at else ()
    return Linear(model, mean, unexplained, asymmetry, units, any(one.cut for one in found), at, returns)


def named(model: Any, inputs: Sequence[str], outputs: Sequence[str]) -> Any:
    """The model with names of its inputs and outputs; python-control allows no dot in them."""
    import control

    plain = [[name.replace(".", "_") for name in names] for names in (inputs, outputs)]
    return control.ss(model.A, model.B, model.C, model.D, model.dt, inputs=plain[0], outputs=plain[1])


def _several(names: str | Sequence[str], what: str) -> list[str]:
    found = [names] if isinstance(names, str) else list(names)
    if not found or len(set(found)) < len(found):
        raise InputError(f"{what} {', '.join(found) or '(none)'} -- expected one or more, each once -- correct them")
    return found


def _port(wiring: Wiring, name: str, causality: str) -> Any:
    """The Real input or output of this name."""
    component, _, variable = name.partition(".")
    ports = wiring.descriptions[component].ports if component in wiring.descriptions else {}
    if variable not in ports or ports[variable].causality != causality or ports[variable].kind != "Real":
        known = [
            f"{owner}.{port.name}"
            for owner, d in wiring.descriptions.items()
            for port in (d.inputs if causality == "input" else d.outputs)
            if port.kind == "Real"
        ]
        raise InputError(f"{causality} {name!r} -- expected one of {', '.join(known)} -- correct the name")
    return ports[variable]


def _input(wiring: Wiring, case: Case, name: str, opened: bool) -> _Input:
    port = _port(wiring, name, "input")
    component, _, variable = name.partition(".")
    link = next((link for link in wiring.links if link.target == (component, variable)), None)
    method, loops = case[1].method, case[1].loops
    delayed = link is None or method == "jacobi" or link in schedule(wiring, loops).delayed
    return _Input(component, variable, port.unit or "1", link, opened and link is not None, delayed)


def _values(wiring: Wiring, one: _Input, base: Trajectory, steps: int) -> Array:
    """What an input got in each step."""
    if one.link is None:
        start = dict(next(c for c in wiring.system.components if c.name == one.component).parameters)
        return np.full(steps, float(start[one.variable]))
    column = base.columns[".".join(one.link.source)]
    return one.link.gain * (column[:-1] if one.delayed else column[1:]) + one.link.offset


def _answers(mean: Array, inputs: Sequence[str], outputs: Sequence[str], horizon: float) -> None:
    """Refuse an input or an output without any response."""
    size = np.sqrt(np.mean(mean**2, axis=2))
    for names, others, total in (
        (outputs, inputs, size.sum(axis=1)),
        (inputs, outputs, size.sum(axis=0)),
    ):
        for name, norm in zip(names, total, strict=True):
            if not (math.isfinite(norm) and norm > 0.0):
                there, here = (others, [name]) if names is outputs else ([name], others)
                raise InputError(
                    f"{', '.join(here)} does not answer to {', '.join(there)} within {horizon:g} s -- expected a "
                    "response -- take another output, a longer --horizon or a larger --amplitude"
                )


def _scales(response: Array) -> tuple[Array, Array]:
    """Sizes of outputs, shape (q, 1, 1), and inputs, (1, p, 1), whose products are those of the responses."""
    size = np.sqrt(np.mean(response**2, axis=2))
    left, right = np.ones(size.shape[0]), np.ones(size.shape[1])
    for _ in range(20):
        left = np.sqrt(np.mean((size / right) ** 2, axis=1))
        right = np.sqrt(np.mean((size / left[:, None]) ** 2, axis=0))
    return left[:, None, None], right[None, :, None]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def realised(response: Array, step: float, order: int | None = None) -> tuple[Any, float]:
    """State space of impulse responses, and the share that it leaves (root mean square).

    Parameters
    ----------
    response : ndarray, shape (n,) or (outputs, inputs, n)
        At the communication points from the impulse on.
    step : float
        Communication step [s].
    order : int, optional
        Without it the lowest that leaves less than `UNEXPLAINED`, or the best.
    """
    import control

    response = np.array(response, ndmin=3)
    left, right = _scales(response)
    scaled = response / left / right
    if not scaled[:, :, 1:].any():  # it answers at once or not at all: no state, and a Hankel matrix of zeros
        return control.ss([], [], [], response[:, :, 0], step), 0.0
    size = min((scaled.shape[2] - 1) // 2, LARGEST_HANKEL // max(scaled.shape[:2]))
    tried: list[tuple[float, int, Any]] = []
    for number in range(1, min(MOST_ORDER, size - 1) + 1) if order is None else [order]:
        found, _ = control.eigensys_realization(scaled, number, m=size, n=size, dt=True)
        b, c = found.B * right[0, :, 0], left[:, 0, :] * found.C
        model: Any = control.ss(found.A, b, c, response[:, :, 0], step)
        rest = _rms((_markov(model, response.shape[2]) - response) / left / right) / _rms(scaled)
        if math.isfinite(rest):
            tried.append((rest, number, model))
        if rest <= UNEXPLAINED:
            break
    if not tried:
        raise InputError(f"order {order!r} -- expected one whose model is finite -- choose another")
    rest, _, model = tried[-1] if tried[-1][0] <= UNEXPLAINED else min(tried, key=lambda item: item[0])
    return model, rest


def _markov(model: Any, number: int) -> Array:
    a, b, c, d = (np.asarray(m) for m in (model.A, model.B, model.C, model.D))
    found = np.empty((*d.shape, number))
    found[:, :, 0] = d
    state = b
    for k in range(1, number):
        found[:, :, k] = c @ state
        state = a @ state
    return found
