"""Energy through power bonds against closed forms: what holding a value over a step costs."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cosim.energy import Bond, balance, bonds, energy
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.step_study import compared
from tsm_fmu.cosim.system import Component, Connection, Experiment, Link, System, check_system
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels.kernel import kernel

STIFFNESS, POINTS = 37.3, 83


def bond(gain: float, speed: bool) -> Bond:
    """A lever between the two sides: force times its length there, speed times its length back."""
    return Bond(
        Link(("a", "x"), ("b", "x"), "Real", gain, 0.0), Link(("b", "f"), ("a", "f"), "Real", gain, 0.0), speed, (1, 1)
    )


@pytest.mark.parametrize("gain", [1.0, 0.37])
def test_a_spring_that_follows_a_sine_late_costs_what_the_closed_form_says(gain):
    # f[k+1] = K x[k]: the spring takes nothing over a period; a held force gives N/2 K (cos 2t - cos t), t = 2 pi / N
    angle = 2.0 * math.pi / POINTS
    time = np.arange(POINTS + 3, dtype=float)
    x = np.sin(angle * (time + 0.3))
    f = STIFFNESS * gain * np.concatenate(([math.sin(angle * -0.7)], x[:-1]))
    # the window [1, N + 1) of the steps is one period
    whole, part = (energy(bond(gain, False), time[:n], x[:n], f[:n], (1, 1)) for n in (POINTS + 2, 2))
    expected = 0.5 * POINTS * STIFFNESS * gain**2 * (math.cos(2.0 * angle) - math.cos(angle))
    assert whole.given - part.given == pytest.approx(expected, rel=1e-9)
    assert expected < 0.0  # the mover is driven by its own spring: a late force makes energy
    assert whole.lost == pytest.approx(whole.given - whole.taken, rel=1e-12)


@pytest.mark.parametrize("held", [(False, False), (True, False), (False, True), (True, True)])
def test_what_the_coupling_loses_vanishes_with_the_step(held):
    def share(points: int) -> float:
        time = np.linspace(0.0, 2.3, points)
        v, f = np.cos(3.1 * time), 2.2 * np.sin(3.1 * time + 0.4)
        return abs(energy(bond(1.0, True), time, v, f, held).share)

    coarse, fine = share(501), share(1001)
    assert math.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bond")
    models = ("DcMotor", "RotationalLoad")
    fmus = {m: build_fmu(kernel(m), folder, flavour="native", platforms=loaded_here()) for m in models}
    load = {"k": 0.31, "d": 0.0}
    return System(
        (Component("motor", fmus["DcMotor"], {"u": 3.7}), Component("load", fmus["RotationalLoad"], load)),
        (Connection("motor.phi", "load.phi"), Connection("load.tau", "motor.tau_load")),
    )


@pytest.mark.parametrize(("there", "back", "found"), [(0.37, 0.37, 1), (0.37, 1.0, 0), (1.0, -1.0, 0)])
def test_factors_that_are_not_one_lever_make_no_bond(drive, there, back, found):
    wires = (
        Connection("motor.phi", "load.phi", there, convert_units=False),
        Connection("load.tau", "motor.tau_load", back, convert_units=False),
    )
    assert len(bonds(check_system(replace(drive, connections=wires)))) == found


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_a_motor_on_a_spring_gives_what_the_spring_holds_but_for_the_coupling(drive, method):
    (found,) = bonds(check_system(drive))
    assert found.name == "motor.phi ~ load.tau"
    lost = []
    for step in (2e-3, 1e-3):
        experiment = Experiment(0.4, step, method=method)
        run = simulate_system(drive, 0.4, step, method=method, record=["motor.phi", "load.tau"])
        got = balance((drive, experiment), run)[found.name]
        tau = run.columns["load.tau"]
        assert got.taken == pytest.approx(tau[-1] ** 2 / (2.0 * 0.31), rel=1e-9)  # nothing but a spring
        lost.append(got.lost)
    assert math.log2(lost[0] / lost[1]) == pytest.approx(1.0, abs=0.15)


def test_the_order_of_exchange_is_said_to_matter_where_it_does(drive):
    coarse = compared((drive, Experiment(0.4, 2e-2)))
    assert coarse.startswith("The order of exchange matters: with Jacobi ")
    fine = compared((drive, Experiment(0.1, 1e-4)))
    assert fine.startswith("The order of exchange does not matter: at most ")
    assert "until" in compared((drive, Experiment(1.0, 1e-4)))
    alone = System((Component("motor", drive.components[0].fmu, {"u": 1.0, "tau_load": 0.0}),), ())
    assert compared((alone, Experiment(0.1, 1e-3))) == ""


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_springs_that_a_sum_adds_up_have_a_bond_each(drive, tmp_path, method):
    """Each takes what it holds; what the motor gives them goes there as the step goes to zero."""
    total = build_fmu(kernel("Sum"), tmp_path / "Sum.fmu", flavour="native", platforms=loaded_here())
    motor, load = drive.components
    stiffness = (0.31, 0.17)
    system = System(
        (
            motor,
            *(Component(f"load{k}", load.fmu, {"k": own, "d": 0.0}) for k, own in enumerate(stiffness)),
            Component("sum", total, {"k1": 1.0, "k2": 1.0, "k3": 0.0, "u3": 0.0}),
        ),
        (
            *(Connection("motor.phi", f"load{k}.phi") for k in (0, 1)),
            *(Connection(f"load{k}.tau", f"sum.u{k + 1}") for k in (0, 1)),
            Connection("sum.y", "motor.tau_load"),
        ),
    )
    assert [b.name for b in bonds(check_system(system))] == [f"motor.phi ~ load{k}.tau" for k in (0, 1)]
    lost = []
    for step in (2e-3, 1e-3):
        run = simulate_system(system, 0.4, step, method=method)
        found = balance((system, Experiment(0.4, step, method=method)), run)
        for k, own in enumerate(stiffness):
            tau = run.columns[f"load{k}.tau"]
            assert found[f"motor.phi ~ load{k}.tau"].taken == pytest.approx(tau[-1] ** 2 / (2.0 * own), rel=0.05)
        lost.append(sum(bond.lost for bond in found.values()))
    assert math.log2(lost[0] / lost[1]) == pytest.approx(1.0, abs=0.15)
