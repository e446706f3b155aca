"""One communication step: values handed from outputs to inputs, and algebraic loops iterated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..models.contract import InputError
from .fmu_instance import FmuFailure, FmuInstance
from .order import AlgebraicLoop
from .system import Link, Wiring
from .value_table import ValueTable

Transfer = tuple[Any, int, Any, int, float, float, ValueTable | None]
"""Target buffer and index, source buffer and index, gain, offset, what becomes of single values before."""
Part = tuple[FmuInstance, list[Transfer]]
"""A component with what its inputs get."""
Advance = Callable[[float, float], None]
"""Advance from a time by a step [s]."""

MOST_PASSES = 60
_MEMORY = 4


def transfers_to(name: str, wiring: Wiring, instances: Mapping[str, FmuInstance]) -> list[Transfer]:
    """What the inputs of a component get."""
    return [_transfer(link, instances) for link in wiring.links if link.target[0] == name]


def _transfer(link: Link, instances: Mapping[str, FmuInstance]) -> Transfer:
    target = instances[link.target[0]].port(link.target[1], "inputs")
    source = instances[link.source[0]].port(link.source[1], "outputs")
    return (*target, *source, link.gain, link.offset, link.values)


def move(transfers: Sequence[Transfer], time: float, *, settled: bool = True) -> None:
    """Hand values on; one that an input does not take is an error as soon as values have ``settled``."""
    for target, i, source, j, gain, offset, values in transfers:
        value = source[j]
        if values is not None:
            if not values.takes(value):
                if settled:
                    raise FmuFailure(values.refusal(value, time))
                continue
            value = values.of(value)
        target[i] = value if gain == 1.0 and offset == 0.0 else gain * value + offset


def gauss_seidel(parts: Sequence[Part]) -> Advance:
    """Components one after the other, each with the newest values."""

    def advance(time: float, step: float) -> None:
        for instance, transfers in parts:
            move(transfers, time)
            instance.set_inputs(time)
            instance.step(time, step)
            instance.get_outputs(time + step)

    return advance


def jacobi(parts: Sequence[Part]) -> Advance:
    """All components with the values of the previous communication point."""

    def advance(time: float, step: float) -> None:
        for instance, transfers in parts:
            move(transfers, time)
            instance.set_inputs(time)
        for instance, _ in parts:
            instance.step(time, step)
        for instance, _ in parts:
            instance.get_outputs(time + step)

    return advance


def in_sequence(advances: Sequence[Advance]) -> Advance:
    """One after the other."""

    def advance(time: float, step: float) -> None:
        for one in advances:
            one(time, step)

    return advance


def iterated(
    loop: AlgebraicLoop, parts: Sequence[Part], instances: Mapping[str, FmuInstance], tolerance: float
) -> Advance:
    """The components of an algebraic loop, repeated from the same state until its values agree.

    Parameters
    ----------
    loop : AlgebraicLoop
        The loop.
    parts : sequence of Part
        Its components, in order.
    instances : mapping of str to FmuInstance
        By name.
    tolerance : float
        Largest change of a value between passes, relative to the value or to 1.

    Raises
    ------
    InputError
        If a component cannot save its state. The step raises `FmuFailure` where the values do not agree.
    """
    if unable := [i.name for i, _ in parts if not i.description.model.coSimulation.canGetAndSetFMUstate]:
        raise InputError(
            f"{loop} cannot be iterated: {', '.join(unable)} cannot save its state -- expected FMUs that can "
            "-- choose --loops delay"
        )
    late = [_transfer(link, instances) for link in loop.late]
    for instance, _ in parts:
        instance.do_step.goes_back = True

    def advance(time: float, step: float) -> None:
        states = [instance.save_state() for instance, _ in parts]

        def one_pass(values: NDArray[np.float64]) -> NDArray[np.float64]:
            for instance, transfers in parts:
                move(transfers, time)
                put(late, values)
                instance.set_inputs(time)
                instance.step(time, step)
                instance.get_outputs(time + step)
            return taken(late)

        def again() -> None:
            for (instance, _), state in zip(parts, states, strict=True):
                instance.restore_state(state)

        try:
            solve(loop, one_pass, again, taken(late), tolerance, time)
        finally:
            for (instance, _), state in zip(parts, states, strict=True):
                instance.free_state(state)

    return advance


def settle(parts: Sequence[Part], time: float) -> None:
    """Outputs that follow inputs in initialisation mode."""
    for instance, transfers in parts:
        move(transfers, time, settled=False)
        instance.set_inputs(time)
        instance.get_outputs(time)


def settle_loop(
    loop: AlgebraicLoop, parts: Sequence[Part], instances: Mapping[str, FmuInstance], tolerance: float, time: float
) -> None:
    """As `settle`, until the values of an algebraic loop agree."""
    late = [_transfer(link, instances) for link in loop.late]

    def one_pass(values: NDArray[np.float64]) -> NDArray[np.float64]:
        for instance, transfers in parts:
            move(transfers, time, settled=False)
            put(late, values)
            instance.set_inputs(time)
            instance.get_outputs(time)
        return taken(late)

    solve(loop, one_pass, lambda: None, taken(late), tolerance, time)


def taken(transfers: Sequence[Transfer]) -> NDArray[np.float64]:
    """The values that these inputs would get now."""
    return np.array(
        [
            gain * float(source[j] if values is None else values.of(source[j])) + offset
            for _, _, source, j, gain, offset, values in transfers
        ]
    )


def put(transfers: Sequence[Transfer], values: NDArray[np.float64]) -> None:
    """Give these inputs other values than their sources have."""
    for (target, i, *_), value in zip(transfers, values.tolist(), strict=True):
        target[i] = type(target[i])(value)


def solve(
    loop: AlgebraicLoop,
    one_pass: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    again: Callable[[], None],
    values: NDArray[np.float64],
    tolerance: float,
    time: float,
) -> None:
    """Find values that a pass gives back: Anderson's mixing, for one value the secant method.

    Raises
    ------
    FmuFailure
        If `MOST_PASSES` passes do not.
    """
    tried: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    change = np.inf
    for _ in range(MOST_PASSES):
        residual = one_pass(values) - values
        change = float(np.max(np.abs(residual) / (1.0 + np.abs(values)), initial=0.0))
        if change <= tolerance:
            return
        if not np.isfinite(change):
            break
        tried = [*tried[-_MEMORY:], (values, residual)]
        values = _mixed(tried)
        again()
    raise FmuFailure(
        f"{loop} at t = {time:g} s: after {MOST_PASSES} passes its values still change by {change:.3g} -- expected at "
        f"most {tolerance:g} -- take a smaller step, a larger tolerance, or --loops delay"
    )


def _mixed(tried: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> NDArray[np.float64]:
    values, residual = tried[-1]
    if len(tried) < 2:
        return values + residual
    moves = np.array([values - x for x, _ in tried[:-1]]).T
    changes = np.array([residual - r for _, r in tried[:-1]]).T
    # elsewhere the quotient is rounding
    informative = np.linalg.norm(changes, axis=0) > 1e-10 * np.linalg.norm(moves, axis=0)
    if not informative.any():
        return values + residual
    moves, changes = moves[:, informative], changes[:, informative]
    weights, *_ = np.linalg.lstsq(changes, residual, rcond=None)
    return values + residual - (moves + changes) @ weights
