"""What a step study makes of runs, and what it says of the order of exchange, with runs in closed form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim import step_study
from tsm_fmu.cosim.step_study import compared, order_sentence
from tsm_fmu.cosim.system import Experiment
from tsm_fmu.cosim.trajectory import SimulationStopped, Trajectory

TWO: Any = SimpleNamespace(components=("a", "b"))


class Runs:
    """Signals that depend on method and step in a known way; notes what it is asked for."""

    def __init__(self, offset: float = 0.0, stops: str = "") -> None:
        self.asked: list[dict[str, Any]] = []
        self.offset, self.stops = offset, stops

    def __call__(self, system: Any, stop: float, step: float, **options: Any) -> Trajectory:
        self.asked.append({"stop": stop, "step": step, **options})
        every = options.get("decimation", 1)
        steps = round((stop - options["start"]) / step)
        time = options["start"] + step * np.arange(steps + 1)[::every]
        late = self.offset if options["method"] == "jacobi" else 0.0
        columns = {"a.x": time + 3.0 * step**2 + late, "b.still": np.full(time.size, 7.0), "b.n": (time > 1.5)}
        found = Trajectory(time, columns, {"a.x": "m", "b.still": "N", "b.n": "1"})
        if self.stops == options["method"]:
            raise SimulationStopped("it broke", Trajectory(time[:3], {}, {}))
        return found


def test_differences_are_of_each_step_and_its_half_and_of_both_methods() -> None:
    """X = t + 3 h^2, with Jacobi 0.125 more: halving changes 3 h^2 3/4; the order is 2."""
    runs, case = Runs(0.125), (TWO, Experiment(2.0, 0.1, start=1.0, evaluate_from=1.5, loops="delay"))
    x, still, count = step_study.step_study(case, 3, record=["a.x"], simulate=runs)
    assert [(a["method"], a["step"], a["decimation"]) for a in runs.asked] == [
        (m, pytest.approx(0.1 / 2**k), 2**k) for m in ("gauss-seidel", "jacobi") for k in range(4)
    ]
    assert all((a["stop"], a["start"], a["loops"], a["record"]) == (2.0, 1.0, "delay", ["a.x"]) for a in runs.asked)
    for method in ("gauss-seidel", "jacobi"):
        assert x.halved[method] == pytest.approx([2.25 * 0.01 / 4**k for k in range(3)])
        assert x.order(method) == pytest.approx(2.0)
        assert still.halved[method] == (0.0,) * 3
    assert x.exchange == pytest.approx([0.125] * 4)
    assert (x.unit, x.size) == ("m", pytest.approx(0.5))  # of the window
    assert x.share == pytest.approx(0.25)
    assert (still.size, still.share, count.size) == (0.0, 0.0, 1.0)
    once, *_ = step_study.step_study(case, 1, simulate=Runs())
    assert np.isnan(once.order("jacobi"))


@pytest.mark.parametrize(("share", "matters"), [(0.00999, False), (0.01001, True)])
def test_the_order_matters_from_a_hundredth_on(share: float, matters: bool) -> None:
    said = order_sentence({"a": 0.5 * share, "b": share, "c": 0.0}, 0.25, 3.5)
    if matters:
        assert said.startswith("The order of exchange matters: with Jacobi b differs by 1 % of its size from ")
        assert "at 0.25 s, until 3.5 s" in said
    else:
        assert said == "The order of exchange does not matter: at most 1 % (b) until 3.5 s."


@pytest.mark.parametrize(("steps", "end"), [(999, 1.0 + 99.9), (1000, 101.0), (5000, 101.0)])
def test_orders_are_compared_over_the_first_thousand_steps(steps: int, end: float) -> None:
    runs = Runs(0.5)
    case = (TWO, Experiment(1.0 + 0.1 * steps, 0.1, start=1.0))
    said = compared(case, record=["a.x"], simulate=runs)
    assert [(a["method"], a["stop"]) for a in runs.asked] == [
        (m, pytest.approx(end)) for m in ("gauss-seidel", "jacobi")
    ]
    share = 0.5 / (end - 1.0)
    assert ("does not matter" in said) is (share < 0.01)
    assert f"until {end:g} s" in said
    assert "a.x" in said


def test_there_is_nothing_to_compare_with_one_component_or_iterated_loops() -> None:
    experiment = Experiment(2.0, 0.1)
    one: Any = SimpleNamespace(components=("a",))
    runs = Runs()
    assert compared((one, experiment), simulate=runs) == ""
    assert compared((TWO, Experiment(2.0, 0.1, loops="iterate")), simulate=runs) == ""
    assert runs.asked == []
    said = compared((TWO, experiment), simulate=Runs(stops="jacobi"))
    assert said == "The order of exchange matters: with jacobi the system stops at 0.2 s."
    nothing = Trajectory(np.arange(3.0), {}, {})
    assert compared((TWO, experiment), simulate=lambda *_, **__: nothing) == ""


def test_a_difference_is_a_share_of_the_larger_of_both_sizes() -> None:
    """With one method the signal stays at zero: rounding there does not make the share infinite."""

    def simulate(system: Any, stop: float, step: float, *, method: str, **_: Any) -> Trajectory:
        x = np.array([0.0, 0.5, 2.0]) if method == "jacobi" else np.zeros(3)
        return Trajectory(np.arange(3.0), {"e.y": x}, {"e.y": "rad"})

    said = compared((TWO, Experiment(2.0, 1.0)), simulate=simulate)
    assert f"differs by {100 * np.sqrt(4.25 / 3) / 2:.3g} % of its size" in said
