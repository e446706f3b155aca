"""Power bonds of wirings made up here: which motions and forces belong together, and energies by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim import energy as of
from tsm_fmu.cosim.energy import Bond, bond_rows, bonds, energy
from tsm_fmu.cosim.metric import BondEnergy, CaseMetrics, Metric
from tsm_fmu.cosim.system import Experiment, Link
from tsm_fmu.cosim.trajectory import Trajectory


def wiring(*links: tuple[str, str, float], sums: dict[str, dict[str, float]] | None = None, **units: str) -> Any:
    """Ports ``component__variable`` with their units; a Sum of ours has its gains."""
    ports: dict[str, dict[str, Any]] = {}
    for name, unit in units.items():
        component, _, variable = name.partition("__")
        ports.setdefault(component, {})[variable] = SimpleNamespace(unit=unit, start="0.5")
    ours = sums or {}
    descriptions = {
        name: SimpleNamespace(ports=own, model=SimpleNamespace(
            modelName="Sum" if name in ours else name, generationTool="tsm-fmu 1" if name in ours else "other"))
        for name, own in ports.items()
    }  # fmt: skip
    made = [Link(tuple(a.split("__")), tuple(b.split("__")), "Real", g, 0.25) for a, b, g in links]  # pyright: ignore
    parts = [SimpleNamespace(name=n, parameters=ours.get(n, {})) for n in ports]
    return SimpleNamespace(links=made, descriptions=descriptions, system=SimpleNamespace(components=parts))


BOTH = (("a__x", "b__x", 1.0), ("b__f", "a__f", 1.0))


@pytest.mark.parametrize(
    ("motion", "force", "speed", "bonded"),
    [
        ("rad", "N.m", False, True), ("m", "N", False, True), ("rad/s", "N.m", True, True), ("m/s", "N", True, True),
        ("deg", "N.m", False, False), ("rad", "N", False, False), ("m", "N.m", False, False), ("", "N", False, False),
        ("m", "", False, False), ("1", "N", False, False),
    ],
)  # fmt: skip
def test_a_bond_is_a_motion_and_a_force_that_works_on_it(motion: str, force: str, speed: bool, bonded: bool) -> None:
    found = bonds(wiring(*BOTH, a__x=motion, b__x=motion, b__f=force, a__f=force))
    if motion == "deg":  # an angle of any unit is one, where both ends have it
        assert [b.name for b in found] == ["a.x ~ b.f"]
        assert found[0].scales == pytest.approx((np.pi / 180.0,) * 2)
        return
    assert [b.name for b in found] == (["a.x ~ b.f"] if bonded else [])
    if bonded:
        assert (found[0].speed, found[0].scales, found[0].signals) == (speed, (1.0, 1.0), ("a.x", "b.f"))


def test_scales_are_of_the_side_that_works_and_a_lever_must_be_the_same_both_ways() -> None:
    """KN at the source of the force, mm at the source of the motion; the factors convert."""
    units = {"a__x": "mm", "b__x": "m", "b__f": "kN", "a__f": "N"}
    (bond,) = bonds(wiring(("a__x", "b__x", 1e-3), ("b__f", "a__f", 1e3), **units))
    assert bond.scales == pytest.approx((1e-3, 1e3))
    (lever,) = bonds(wiring(("a__x", "b__x", 0.4e-3), ("b__f", "a__f", 0.4e3), **units))
    assert lever.motion.gain == 0.4e-3
    assert bonds(wiring(("a__x", "b__x", 0.4e-3), ("b__f", "a__f", 1e3), **units)) == []


def test_of_several_of_a_kind_none_is_named_and_a_distance_goes_before_a_speed() -> None:
    units = {"a__x": "m", "a__v": "m/s", "b__x": "m", "b__v": "m/s", "b__f": "N", "a__f": "N", "b__g": "N", "a__g": "N"}
    links = (*BOTH, ("a__v", "b__v", 1.0))
    (bond,) = bonds(wiring(*links, **units))
    assert (bond.speed, bond.signals) == (False, ("a.x", "b.f"))
    assert bonds(wiring(*links, ("b__g", "a__g", 1.0), **units)) == []
    assert bonds(wiring(("a__x", "a__x2", 1.0), ("a__f2", "a__f", 1.0), a__x="m", a__x2="m", a__f2="N", a__f="N")) == []


def test_a_force_through_a_sum_of_ours_has_the_gain_of_its_summand() -> None:
    units = {"a__x": "m", "b__x": "m", "b__f": "N", "a__f": "N", "s__u2": "N", "s__y": "N", "s__k2": "1"}
    links = (("a__x", "b__x", 3.0), ("b__f", "s__u2", 2.0), ("s__y", "a__f", 0.5))
    (bond,) = bonds(wiring(*links, sums={"s": {"k2": 3.0}}, **units))
    assert bond.effort.gain == pytest.approx(3.0 * 2.0 * 0.5)
    assert bond.effort.offset == pytest.approx(3.0 * 0.5 * 0.25)
    (start,) = bonds(wiring(("a__x", "b__x", 0.5), *links[1:], sums={"s": {}}, **units))
    assert start.effort.gain == pytest.approx(0.5)
    assert bonds(wiring(*links, **units)) == []  # another tool's unit: nothing is known of it


def straight(speed: bool, gain: float = 1.0) -> Bond:
    return Bond(Link(("a", "x"), ("b", "x"), "Real", gain, 0.5), Link(("b", "f"), ("a", "f"), "Real", gain, 0.25),
                speed, (2.0, 3.0))  # fmt: skip


@pytest.mark.parametrize("late", [(0, 0), (1, 0), (0, 1), (1, 1), (2, 1), (0, 2)])
def test_works_are_sums_over_the_steps_of_what_arrived(late: tuple[int, int]) -> None:
    time = np.array([0.0, 0.5, 1.5, 2.0, 3.0])
    x, f = np.array([1.0, 2.0, -1.0, 0.5, 4.0]), np.array([3.0, 5.0, 7.0, -2.0, 6.0])
    given = taken = moved = by_speed = back = 0.0
    for k in range(1, 5):
        dt, force = time[k] - time[k - 1], 0.4 * f[max(k - late[1], 0)] + 0.25
        given += 2.0 * force * (x[k] - x[k - 1])
        moved += abs(2.0 * force * (x[k] - x[k - 1]))
        at = k - late[0]
        taken += 3.0 * 0.5 * (f[k] + f[k - 1]) * 0.4 * (x[at] - x[at - 1] if at >= 1 else 0.0)
        by_speed += 2.0 * force * 0.5 * (x[k] + x[k - 1]) * dt
        back += 3.0 * 0.5 * (f[k] + f[k - 1]) * (0.4 * x[max(at, 0)] + 0.5) * dt
    found = energy(straight(False, 0.4), time, x, f, late)
    assert (found.given, found.taken, found.moved) == pytest.approx((given, taken, moved))
    assert found.lost == pytest.approx(given - taken)
    found = energy(straight(True, 0.4), time, x, f, late)
    assert (found.given, found.taken) == pytest.approx((by_speed, back))


@pytest.mark.parametrize(
    ("method", "loops", "late"),
    [("gauss-seidel", "delay", (0, 1)), ("jacobi", "delay", (1, 1)), ("gauss-seidel", "iterate", (0, 0))],
)
def test_a_balance_knows_what_the_order_of_exchange_delays(
    method: str, loops: str, late: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = wiring(*BOTH, a__x="m", b__x="m", b__f="N", a__f="N")
    back = made.links[1]
    loop = SimpleNamespace(late=(back,))
    monkeypatch.setattr(of, "check_system", lambda _: made)
    monkeypatch.setattr(of, "schedule", lambda *_: SimpleNamespace(delayed=(back,), loops=(loop,)))
    time = np.arange(5.0)
    run = Trajectory(time, {"a.x": time**2, "b.f": 3.0 - time}, {"a.x": "m", "b.f": "N"})
    case: Any = ("system", Experiment(4.0, 1.0, method=method, loops=loops))
    (bond,) = bonds(made)
    assert of.balance(case, run) == {"a.x ~ b.f": energy(bond, time, time**2, 3.0 - time, late)}
    varied: Any = ("system", Experiment(4.0, 1.0, step_error=1e-3))
    assert of.balance(varied, run) == {}
    assert of.recorded_too([case], ["c.y", "a.x"]) == ["c.y", "a.x", "b.f"]
    assert of.recorded_too([case], None) is None


def test_rows_of_bonds_say_joules_and_percent() -> None:
    found = {"a.x ~ b.f": BondEnergy(4.0, 3.0, 1.0, 8.0), "none": BondEnergy(0.0, 0.0, 0.0, 0.0)}
    own = CaseMetrics(Metric(0.0, "s"), Metric(1.0, "s"), {}, bonds=found)
    assert bond_rows({"one": own}) == [("one", "a.x ~ b.f", 4.0, 3.0, 1.0, 12.5), ("one", "none", 0.0, 0.0, 0.0, 0.0)]
