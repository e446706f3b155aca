"""Values handed on, one step in each order, and loops of units in plain Python that are known in closed form."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim.exchange import (
    gauss_seidel,
    in_sequence,
    iterated,
    jacobi,
    move,
    put,
    settle,
    settle_loop,
    taken,
    transfers_to,
)
from tsm_fmu.cosim.fmu_instance import FmuFailure
from tsm_fmu.cosim.order import AlgebraicLoop
from tsm_fmu.cosim.system import Link
from tsm_fmu.cosim.value_table import ValueTable
from tsm_fmu.models.contract import InputError

from .units import Unit


def gain(name: str, k: float, more: float = 0.0) -> Unit:
    """Y = k u + more, at once, also within a step."""
    return Unit(name, ["u"], gives=lambda x, u, t: [k * u[0] + more])


def link(source: str, target: str, factor: float = 1.0, offset: float = 0.0, values: ValueTable | None = None) -> Link:
    return Link((source, "y"), (target, "u"), "Real", factor, offset, values)


def wired(*links: Link) -> Any:
    class Wiring:
        pass

    made: Any = Wiring()
    made.links = links
    return made


def parts(units: dict[str, Unit], *links: Link) -> Any:
    instances: Any = units
    return [(unit, transfers_to(name, wired(*links), instances)) for name, unit in units.items()]


@pytest.mark.parametrize(
    ("factor", "offset", "expected"), [(1.0, 0.0, 3.5), (1.0, 0.25, 3.75), (2.0, 0.0, 7.0), (-2.0, 0.25, -6.75)]
)
def test_a_value_is_scaled_and_shifted_on_its_way(factor: float, offset: float, expected: float) -> None:
    units = {"a": gain("a", 1.0, 3.5), "b": gain("b", 1.0), "c": gain("c", 1.0)}
    units["a"].get_outputs(0.0)
    (_, none), (_, own), (_, other) = parts(units, link("a", "b", factor, offset))
    assert none == other == []
    move(own, 0.0)
    assert units["b"].inputs[0].values[0] == expected
    assert taken(own) == pytest.approx([expected])
    put(own, np.array([0.125]))
    assert units["b"].inputs[0].values[0] == 0.125


def test_whole_numbers_become_others_and_one_that_is_not_taken_is_an_error_once_values_have_settled() -> None:
    source = Unit("n", kind=ctypes.c_int32, gives=lambda x, u, t: [int(x)], state=1.0)
    target = Unit("m", ["u"])
    table = ValueTable("connection n.y -> m.u", {1: 7}, {7, 2}, "7 or 2")
    units = {"n": source, "m": target}
    ((_, _), (_, own)) = parts(units, link("n", "m", 2.0, 0.5, table))
    for state, expected in ((1.0, 14.5), (2.0, 4.5)):
        source.state = state
        source.get_outputs(0.0)
        move(own, 0.0)
        assert target.inputs[0].values[0] == expected
        assert taken(own) == pytest.approx([expected])
    source.state = 3.0
    source.get_outputs(0.0)
    move(own, 0.25, settled=False)
    assert target.inputs[0].values[0] == 4.5  # as it was
    with pytest.raises(FmuFailure, match=r"connection n.y -> m.u hands on 3 at t = 0.25 s -- expected 7 or 2"):
        move(own, 0.25)


def chain() -> tuple[dict[str, Unit], Any]:
    units = {
        "x": Unit("x", ["u"], rate=lambda x, u, t: u[0], state=1.0),
        "g": gain("g", -2.0),
    }
    for unit in units.values():
        unit.get_outputs(0.0)
    return units, parts(units, link("x", "g"), link("g", "x"))


def test_gauss_seidel_hands_on_the_newest_and_jacobi_the_last_values() -> None:
    """X' = u, u = -2 x: Euler with h = 0.1, and where the gain sees x a step late as well."""
    h = 0.1
    units, both = chain()
    units["g"].inputs[0].values[0] = 1.0
    units["g"].get_outputs(0.0)
    step = gauss_seidel(both)
    for k in range(5):
        step(h * k, h)
    assert units["x"].state == pytest.approx((1.0 - 2.0 * h) ** 5)
    assert units["g"].outputs[0].values[0] == pytest.approx(-2.0 * units["x"].state)
    assert units["x"].calls[-3:] == ["set", "step", "get"]
    units, both = chain()
    units["g"].inputs[0].values[0] = 1.0
    units["g"].get_outputs(0.0)
    step = jacobi(both)
    x, u = 1.0, -2.0
    for k in range(5):
        step(h * k, h)
        x, u = x + h * u, -2.0 * x
    assert units["x"].state == pytest.approx(x)
    assert units["g"].outputs[0].values[0] == pytest.approx(u)
    units, both = chain()
    one_by_one = in_sequence([gauss_seidel([part]) for part in both])
    units["g"].get_outputs(0.0)
    one_by_one(0.0, h)
    assert [len(unit.calls) for unit in units.values()] == [4, 5]


@pytest.mark.parametrize(("k", "more"), [(-0.4, 1.0), (3.0, -2.0), (0.5, 0.25)])
def test_an_algebraic_loop_of_two_gains_is_at_its_solution_after_a_step(k: float, more: float) -> None:
    """A = k b + m, b = k a + m: both m / (1 - k), also where a plain repetition would run away."""
    units = {n: gain(n, k, more) for n in "ab"}
    late = link("b", "a")
    loop = AlgebraicLoop((("a", "y"), ("b", "u"), ("a", "y")), ("a", "b"), (late,))
    both = parts(units, link("a", "b"), late)
    instances: Any = units
    for unit in units.values():
        unit.get_outputs(0.0)
    advance = iterated(loop, both, instances, 1e-10)
    advance(0.0, 0.1)
    solution = more / (1.0 - k)
    assert [u.outputs[0].values[0] for u in units.values()] == pytest.approx([solution] * 2, rel=1e-8)
    for unit in units.values():
        assert unit.states == 0
        assert unit.do_step.goes_back
        assert unit.calls.count("step") == unit.calls.count("restore") + 1
    settled = {n: gain(n, k, more) for n in "ab"}
    instances = settled
    settle_loop(loop, parts(settled, link("a", "b"), late), instances, 1e-10, 0.0)
    assert [u.outputs[0].values[0] for u in settled.values()] == pytest.approx([solution] * 2, rel=1e-8)
    assert "step" not in settled["a"].calls


def test_a_loop_whose_units_cannot_save_their_state_is_refused_by_name() -> None:
    units = {"a": gain("a", 1.0), "b": Unit("b", ["u"], saves=False), "c": Unit("c", ["u"], saves=False)}
    loop = AlgebraicLoop((("a", "y"), ("b", "u"), ("a", "y")), ("a", "b", "c"), ())
    instances: Any = units
    with pytest.raises(InputError, match=r"-> a\.y cannot be iterated: b, c cannot save its state"):
        iterated(loop, parts(units), instances, 1e-6)


def test_outputs_settle_after_their_inputs_without_a_step() -> None:
    units = {"a": gain("a", 1.0, 2.0), "b": gain("b", 3.0)}
    both = parts(units, link("a", "b"))
    settle(both, 0.5)
    assert units["b"].outputs[0].values[0] == 6.0
    assert units["b"].calls == ["set", "get"]
