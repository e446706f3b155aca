"""Steps chosen by their error, on motions whose error is known in closed form."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from tsm_fmu.cosim.fmu_instance import FmuFailure
from tsm_fmu.cosim.variable_step import VariableStep

from .units import Unit


def varied(advance: Callable[[Unit, float, float], None], tolerance: float, *units: tuple[Unit, str]) -> VariableStep:
    """Step control of units whose only output is in a unit of measurement."""

    def whole(time: float, step: float) -> None:
        for unit, _ in units:
            advance(unit, time, step)
            unit.get_outputs(time + step)

    descriptions = {u.name: SimpleNamespace(ports={n: SimpleNamespace(unit=unit) for n in u.outputs[0].names})
                    for u, unit in units}  # fmt: skip
    for unit, _ in units:
        unit.get_outputs(0.0)
    wiring: Any = SimpleNamespace(links=(), descriptions=descriptions)
    instances: Any = [unit for unit, _ in units]
    return VariableStep(whole, instances, wiring, tolerance)


def euler(rate: Callable[[float, float], float]) -> Callable[[Unit, float, float], None]:
    def advance(unit: Unit, time: float, step: float) -> None:
        unit.state += step * rate(unit.state, time)

    return advance


@pytest.mark.parametrize("tolerance", [0.3, 1e-2, 1e-4])
def test_growth_is_divided_until_the_difference_of_halves_and_whole_is_allowed(tolerance: float) -> None:
    """X' = x, by Euler: 1 + h against (1 + h/2)^2, which is h^2/4 more; each halving makes it a quarter."""

    def error(h: float) -> float:
        return 0.25 * h * h / (1.0 + 0.5 * h) ** 2

    h = 0.8
    level = next(k for k in range(11) if error(h / 2**k) <= tolerance)
    unit = Unit("x", state=1.0)
    steps = varied(euler(lambda x, t: x), tolerance, (unit, "N"))
    steps(3.0, h)
    assert (steps.accepted, steps.rolled_back, steps.limited) == (2**level, level, 0)
    assert (steps.shortest, steps.longest) == pytest.approx((h / 2**level, h / 2**level))
    assert unit.state == pytest.approx((1.0 + 0.5 * h / 2**level) ** (2 * 2**level), rel=1e-12)
    assert unit.states == 0
    assert unit.do_step.goes_back
    assert steps.reversals == []
    steps(3.0 + h, h)
    assert steps.accepted == 2 * 2**level  # the next step begins with the length that was right
    assert steps.rolled_back == level


def test_steps_grow_again_where_nothing_happens_and_meet_every_communication_point() -> None:
    """V = 1 until 0.1 s: parts of 1/8, 1/8, 1/4 and 1/2; the whole, a half and a quarter are undone first."""
    unit = Unit("x")
    begun: list[float] = []

    def advance(unit: Unit, time: float, step: float) -> None:
        begun.append(time)
        unit.state += step * (1.0 if time < 0.1 else 0.0)

    steps = varied(advance, 1e-3, (unit, "N"))
    steps(0.0, 1.0)
    assert (steps.accepted, steps.rolled_back) == (4, 3)
    assert (steps.shortest, steps.longest) == (0.125, 0.5)
    assert unit.state == 0.125
    assert sorted(set(begun)) == [0.0, 0.0625, 0.125, 0.1875, 0.25, 0.375, 0.5, 0.75]
    assert steps.notes() == ["variable step: 4 steps of 0.125 to 0.5 s, 3 rolled back"]
    steps(1.0, 1.0)
    assert (steps.accepted, steps.longest) == (5, 1.0)


def test_what_always_differs_is_kept_at_the_shortest_step_and_counted() -> None:
    """A unit that adds 1 whatever the step: two halves differ from the whole by 1."""
    unit = Unit("x")
    steps = varied(lambda u, t, h: setattr(u, "state", u.state + 1.0), 1e-6, (unit, "N"))
    steps(0.0, 1.024)
    assert (steps.accepted, steps.rolled_back, steps.limited) == (1024, 10, 1024)
    assert steps.shortest == pytest.approx(1e-3)
    assert unit.state == 2048.0
    assert steps.notes() == [
        "variable step: 1024 steps of 0.001 to 0.001 s, 10 rolled back; 1024 of the shortest keep a larger error"
    ]


def parabola(unit: Unit, time: float, step: float) -> None:
    """Exact motion that turns back at 1/3 s: a third, or two, into the part that holds it, however short the parts."""
    unit.state = -((time + step - 1.0 / 3.0) ** 2)


def test_a_reversal_is_followed_to_the_shortest_step_and_located() -> None:
    """The mean speed of a parabola is that of the middle: a line through two of them is exact."""
    unit = Unit("x", state=-((1.0 / 3.0) ** 2))
    steps = varied(parabola, 0.9, (unit, "m"))
    for k in range(10):
        steps(0.1 * k, 0.1)
    ((name, at),) = steps.reversals
    assert (name, at) == ("x.y", pytest.approx(1.0 / 3.0, abs=1e-9))
    assert steps.shortest == pytest.approx(0.1 / 1024)
    assert steps.limited == 0
    assert steps.notes()[1] == "reversals: x.y at 0.333333 s"
    force = varied(parabola, 0.9, (Unit("x", state=-((1.0 / 3.0) ** 2)), "N"))
    for k in range(10):
        force(0.1 * k, 0.1)
    assert force.reversals == []  # a force has no direction to lose


def test_of_many_reversals_twelve_are_named() -> None:
    unit = Unit("x")

    def wave(unit: Unit, time: float, step: float) -> None:
        unit.state = math.sin(2.0 * math.pi * (time + step))

    steps = varied(wave, 0.9, (unit, "rad"))
    for k in range(75):
        steps(0.1 * k, 0.1)
    assert [at for _, at in steps.reversals] == pytest.approx([0.25 + 0.5 * k for k in range(15)], abs=1e-4)
    assert steps.notes()[1].endswith(" and 3 more")
    assert steps.notes()[1].count("x.y at ") == 12
    unit.state, few = 0.0, varied(wave, 0.9, (Unit("x"), "rad"))
    for k in range(60):
        few(0.1 * k, 0.1)
    assert len(few.reversals) == 12
    assert "more" not in few.notes()[1]


def test_a_step_that_is_refused_is_tried_with_a_shorter_one_unless_the_unit_is_gone() -> None:
    unit = Unit("x")

    def advance(unit: Unit, time: float, step: float) -> None:
        unit.state += step
        if step > 0.13:
            raise FmuFailure("too long")

    steps = varied(advance, 0.5, (unit, "N"))
    steps(0.0, 0.4)
    assert unit.state == pytest.approx(0.4)
    assert (steps.accepted, steps.rolled_back, unit.states) == (4, 3, 0)  # once more where it would have grown
    unit.lost = True
    with pytest.raises(FmuFailure, match="too long"):
        varied(advance, 0.5, (unit, "N"))(0.0, 0.4)
    assert unit.states == 0

    def never(unit: Unit, time: float, step: float) -> None:
        raise FmuFailure("no")

    stuck = varied(never, 0.5, (Unit("x"), "N"))
    with pytest.raises(FmuFailure, match="no"):
        stuck(0.0, 0.4)
    assert stuck.rolled_back == 10
    assert stuck.notes() == []


def test_outputs_of_every_type_are_as_before_where_a_step_is_undone() -> None:
    """A counter of integers counts the steps that stayed; it has no error of its own."""
    real, count = Unit("x", state=1.0), Unit("n", kind=ctypes.c_int32, gives=lambda x, u, t: [int(x)])
    seen: list[int] = []

    def advance(unit: Unit, time: float, step: float) -> None:
        if unit is real:
            seen.append(count.outputs[0].values[0])
            unit.state += step * unit.state
        else:
            unit.state = count.outputs[0].values[0] + 1

    steps = varied(advance, 1e-2, (real, "N"), (count, "1"))
    steps(0.0, 0.8)
    assert (steps.accepted, steps.rolled_back) == (4, 2)
    assert count.outputs[0].values[0] == 8  # two halves each
    assert seen[:6] == [0, 0, 1, 0, 0, 1]


def test_only_what_is_handed_on_is_judged_and_an_end_stops_the_step() -> None:
    smooth, rough = Unit("a"), Unit("b")

    def advance(unit: Unit, time: float, step: float) -> None:
        unit.state += step if unit is smooth else 1.0
        if unit is smooth and time + step > 0.55:
            unit.ended_at = 0.5

    descriptions = {n: SimpleNamespace(ports={"y": SimpleNamespace(unit="")}) for n in "ab"}

    def whole(time: float, step: float) -> None:
        for unit in (smooth, rough):
            advance(unit, time, step)
            unit.get_outputs(time + step)

    wiring: Any = SimpleNamespace(links=(SimpleNamespace(source=("a", "y")),), descriptions=descriptions)
    instances: Any = [smooth, rough]
    steps = VariableStep(whole, instances, wiring, 1e-6)
    steps(0.0, 0.5)
    assert (steps.accepted, steps.rolled_back) == (1, 0)
    steps(0.5, 0.5)
    assert steps.accepted == 2
    assert smooth.ended_at == 0.5


def test_a_difference_that_is_no_number_is_undone() -> None:
    unit = Unit("x", state=1.0)

    def advance(unit: Unit, time: float, step: float) -> None:
        unit.state = math.nan if step > 0.3 else unit.state + step

    steps = varied(advance, 0.5, (unit, "N"))
    steps(0.0, 0.8)
    assert unit.state == pytest.approx(1.8)
    assert (steps.accepted, steps.rolled_back) == (4, 3)
