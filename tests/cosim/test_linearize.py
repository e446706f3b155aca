"""Linearisation against exact discretisations, and what is refused."""

import re
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from tsm_fmu import InputError, linearize
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.fmu_instance import FmuInstance
from tsm_fmu.cosim.linearize import linearize as linearize_case
from tsm_fmu.cosim.linearize import realised
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios.pid_design import motor_model


def decay(foreign, rate=2.7):
    """Decay, x' = -rate x, through a gain."""
    x, g = (
        Component("x", foreign["integrator"], {"x_0": 1.3}),
        Component("g", foreign["gain"], {"k": -rate, "u_2": 0.0}),
    )
    return System((x, g), (Connection("x.x", "g.u"), Connection("g.y", "x.u")))


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_an_open_loop_of_an_integrator_and_a_gain_is_known(foreign, method):
    """L = rate h / (z - 1), with Jacobi one step later; its phase margin in closed form."""
    h, rate = 0.013, 2.7
    case = (decay(foreign, rate), Experiment(stop=1.0, step=h, method=method))
    found = linearize_case(case, "g.u", "x.x", 0.26, opened=True, horizon=13.0)
    omega = np.array([1.1, 3.7, 11.0, 61.0])
    z = np.exp(1j * omega * h)
    late = z if method == "jacobi" else 1.0
    np.testing.assert_allclose(found.frequency_response(omega), rate * h / (z - 1.0) / late, rtol=1e-6)
    assert found.asymmetry < 1e-6
    crossover = 2.0 / h * np.arcsin(0.5 * rate * h)
    phase = 90.0 - np.degrees(0.5 * crossover * h) - (np.degrees(crossover * h) if method == "jacobi" else 0.0)
    assert found.margins().crossover == pytest.approx(crossover, rel=1e-4)
    assert found.margins().phase_margin_deg == pytest.approx(phase, rel=1e-4)


def test_a_closed_loop_answers_to_a_disturbance_as_it_does(foreign):
    """Gauss-Seidel makes x(k+1) = (1 - rate h) x(k) + h d(k) of it."""
    h, rate = 0.013, 2.7
    found = linearize_case((decay(foreign, rate), Experiment(1.0, h)), "x.u", "x.x", 0.26, opened=False, horizon=1.3)
    assert found.model.nstates == 1
    assert np.real(found.model.poles()) == pytest.approx(1.0 - rate * h, rel=1e-6)
    assert float(np.real(found.model(1.0))) == pytest.approx(1.0 / rate, rel=1e-5)


def test_the_motor_is_the_zero_order_hold_of_its_transfer_function(tmp_path):
    fmu = build_fmu(kernel("DcMotor"), tmp_path / "DcMotor.fmu")
    start = {"T_C": 0.0} if "T_C" in {p.name for p in kernel("DcMotor").parameters} else {}
    friction = {p.name: 0.0 for p in kernel("DcMotor").parameters if "oulomb" in p.quantity.meaning}
    h, exact = 1e-3, motor_model(kernel("DcMotor").params(values={**start, **friction}))
    found = linearize(fmu, 0.1, input="u", output="phi", values={"u": 0.73, **start, **friction}, step=h, horizon=0.4)
    held = control.sample_system(exact, h, "zoh")
    omega = np.array([20.0, 70.0, 300.0, 1500.0])
    expected = np.asarray(held(np.exp(1j * omega * h)))
    np.testing.assert_allclose(found.linear.frequency_response(omega), expected, rtol=1e-4)
    assert found.linear.units == (("(rad)/(V)",),)
    assert found.margins is None
    assert "iframe" in found._repr_html_()


def test_a_realisation_gives_back_a_response_with_noise_and_says_what_it_leaves():
    rng = np.random.default_rng(15)
    k = np.arange(401)
    response = 0.7 * 0.93**k * np.cos(0.31 * k) - 0.4 * 0.99**k
    model, left = realised(response, 0.02)
    assert (model.nstates, left < 1e-9) == (3, True)
    noisy = response + 1e-3 * rng.normal(size=k.size)
    assert 1e-4 < realised(noisy, 0.02)[1] < 1e-2


def test_what_answers_at_once_has_no_state(foreign):
    """Gauss-Seidel hands x on within the step: the gain behind it, cut off from its integrator, is a number."""
    found = linearize_case((decay(foreign, 2.7), Experiment(1.0, 0.01)), "g.u", "g.y", 0.1, opened=True, horizon=0.5)
    assert (found.model.nstates, found.unexplained) == (0, 0.0)
    np.testing.assert_allclose(found.frequency_response(np.array([15.0, 70.0])), [2.7, 2.7], rtol=1e-6)
    assert found.margins().gain_margin_db == np.inf


def coupled(foreign, rates=((2.7, 0.4), (-1.1, 1.9))):
    """X' = -rates x, each row through a gain of both states, with Jacobi."""
    components, links = [], []
    for i, row in enumerate(rates):
        j = 1 - i
        components += [
            Component(f"x{i}", foreign["integrator"], {"x_0": 1.3}),
            Component(f"g{i}{i}", foreign["gain"], {"k": -row[i]}),
            Component(f"g{i}{j}", foreign["gain"], {"k": -row[j], "u_2": 0.0}),
        ]
        links += [
            Connection(f"x{i}.x", f"g{i}{i}.u"), Connection(f"x{j}.x", f"g{i}{j}.u"),
            Connection(f"g{i}{j}.y", f"g{i}{i}.u_2"), Connection(f"g{i}{i}.y", f"x{i}.u"),
        ]  # fmt: skip
    return System(tuple(components), tuple(links))


def test_several_inputs_and_outputs_are_one_state_space_with_their_names(foreign):
    """Each channel is what it is alone, and at rest the states are the inverse of the rates."""
    h, system = 0.013, coupled(foreign)
    names, seen = ("x0.u", "x1.u"), ("x0.x", "x1.x", "g00.y")
    found = linearize_case((system, Experiment(1.0, h)), names, seen, 0.26, opened=False, horizon=2.6)
    assert (found.model.input_labels, found.model.output_labels) == (["x0_u", "x1_u"], ["x0_x", "x1_x", "g00_y"])
    assert (found.unexplained < 1e-6, found.response.shape) == (True, (3, 2, 200))
    for j, name in enumerate(names):
        for i, output in enumerate(seen):
            alone = linearize_case((system, Experiment(1.0, h)), name, output, 0.26, opened=False, horizon=2.6)
            omega = np.array([2.1, 7.7, 61.0])
            np.testing.assert_allclose(
                found.frequency_response(omega)[i, j], alone.frequency_response(omega), rtol=1e-4, atol=1e-9
            )
    gain = np.real(found.model(1.0))[:2]  # at rest x = rates^-1 d, whatever the order of exchange
    np.testing.assert_allclose(gain, np.linalg.inv([[2.7, 0.4], [-1.1, 1.9]]), rtol=1e-4)


def test_loops_opened_together_are_the_matrix_of_the_open_loops(foreign):
    """With both returns cut, x_i = h / (z - 1) of its own input; the gains return -rates x."""
    h, rates = 0.013, np.array([[2.7, 0.4], [-1.1, 1.9]])
    case = (coupled(foreign), Experiment(1.0, h))
    found = linearize_case(case, ("x0.u", "x1.u"), ("g00.y", "g11.y"), 0.26, opened=True, horizon=2.6)
    z = np.exp(1j * h * np.array([2.1, 17.0]))
    integrator = h / (z - 1.0)
    open_loop = found.frequency_response(np.array([2.1, 17.0]))
    np.testing.assert_allclose(open_loop, rates[:, :, None] * integrator, rtol=1e-5)


@pytest.mark.parametrize("factor", [1.0, -0.35])
def test_a_loop_has_its_margins_with_the_other_closed(foreign, factor):
    """Two integrators through R: L_1 = r11 I - r12 I (1 + r22 I)^-1 r21 I, crossed where a search of its own finds it.

    A factor on the way back scales what an output returns, and with it the gain that the loop needs.
    """
    h, r = 0.013, np.array([[2.7, 0.4], [-1.1, 1.9]])
    system = coupled(foreign, r / factor)
    links = [replace(c, factor=factor) if c.target in ("x0.u", "x1.u") else c for c in system.connections]
    case = (replace(system, connections=tuple(links)), Experiment(1.0, h))
    found = linearize_case(case, ("x0.u", "x1.u"), ("g00.y", "g11.y"), 0.26, opened=True, horizon=10.4)

    def loop(omega, k):
        j, integrator = 1 - k, h / (np.exp(1j * omega * h) - 1.0)
        return integrator * r[k, k] - integrator**2 * r[k, j] * r[j, k] / (1.0 + r[j, j] * integrator)

    for k in (0, 1):
        crossover = brentq(lambda omega, k=k: np.log(abs(loop(omega, k))), 0.5, 20.0)
        phase = 180.0 + np.degrees(np.angle(loop(crossover, k)))
        assert found.margins(k).crossover == pytest.approx(crossover, rel=1e-4)
        assert found.margins(k).phase_margin_deg == pytest.approx(phase, rel=1e-3)
        alone = r[k, k]
        assert abs(found.margins(k).crossover / alone - 1.0) > 0.02, "the other loop must matter"


def test_margins_of_several_loops_are_in_the_answer_where_they_are_loops(foreign, tmp_path):
    system, names = coupled(foreign), ["x0.u", "x1.u"]
    path = write_ssp(tmp_path / "two.ssp", (system, Experiment(1.3, 0.013)))
    found = linearize(path, 0.26, input=names, output=["g00.y", "g11.y"], horizon=6.5, out=tmp_path / "page")
    assert (list(found.loops), found.margins) == (names, None)
    assert found.as_json()["loops"]["x1.u"]["crossover"] == found.loops["x1.u"].crossover
    assert "each loop with the others closed" in found.summary()
    least = min(found.loops.values(), key=lambda m: m.phase_margin_deg)
    assert found.report is not None
    assert f"{least.phase_margin_deg:.3g} deg, of the loop at" in found.report.read_text()
    crossed = linearize(path, 0.26, input=names, output=["g11.y", "g00.y"], horizon=0.65)  # these do not feed them
    assert crossed.loops == {}
    with pytest.raises(ValueError, match="expected loops that are open where their outputs return"):
        crossed.linear.margins(1)


def test_a_unit_that_gives_its_derivatives_is_linearised_by_them(in_c):
    run = simulate_system(System((Component("p", in_c["pendulum"], {"u": 0.7, "f": 0.0}),), ()), 0.9, 0.01)
    angle = run.columns["p.a"][-1]
    found = linearize(in_c["pendulum"], 0.9, input=["u", "f"], output=["a", "h"], values={"u": 0.7}, step=0.01)
    model = found.model
    np.testing.assert_allclose(model.A, [[0.0, 1.0], [-9.81 * np.cos(angle), -0.3]], rtol=1e-12)
    np.testing.assert_allclose(model.B, [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_allclose(model.C, [[1.0, 0.0], [-np.sin(angle), 0.0]], rtol=1e-12)
    np.testing.assert_allclose(model.D, [[0.0, 0.0], [0.0, 0.5]])
    assert (model.dt, model.input_labels, model.output_labels) == (0, ["u", "f"], ["a", "h"])
    assert "from the unit's own derivatives" in found.summary()
    assert "u -> h: gain [dB]" in found.to_frame().columns


def test_the_first_answer_of_our_units_is_their_own_directional_derivative(tmp_path):
    fmu = build_fmu(kernel("DcMotor"), tmp_path / "DcMotor.fmu", flavour="native", platforms=loaded_here())
    system = System((Component("m", fmu, {"u": 0.73, "tau_load": 0.0}),), ())
    found = linearize_case((system, Experiment(1.0, 1e-3)), "m.u", "m.omega", 0.1, opened=False, horizon=0.1)
    description = describe(fmu)
    with unpacked(fmu) as folder, FmuInstance("m", description, folder, [], ["omega"]) as unit:
        unit.enter_initialization(0.0, None, {"u": 0.73})
        unit.exit_initialization(0.0)
        for k in range(101):
            unit.step(k * 1e-3, 1e-3)
        ports = description.ports
        (exact,) = unit.derivative([ports["omega"].reference], [ports["u"].reference], 0.1)
    assert found.response[0, 0, 1] == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize(
    ("source", "output", "options", "message"),
    [
        ("g.w", "x.x", {}, "input 'g.w' -- expected one of x.u, g.u, g.u_2"),
        ("g.u", "x.v", {}, "output 'x.v' -- expected one of x.x, g.y"),
        ("g.u_2", "x.x", {"opened": True}, "input g.u_2 is not connected"),
        ("g.u", "x.x", {"at": 0.0}, "working point 0.0 s"),
        (("g.u", "g.u"), "x.x", {}, "input g.u, g.u -- expected one or more, each once"),
        ("g.u", ("x.x", "x.x"), {}, "output x.x, x.x -- expected one or more, each once"),
        ("g.u", (), {}, "output (none) -- expected one or more"),
        ("g.u", "x.x", {"amplitude": -1.0}, "amplitude -1.0 -- expected a positive number"),
        ("g.u", "x.x", {"horizon": 0.02}, "expected one after the start"),
    ],
)
def test_wrong_use_is_one_line(foreign, source, output, options, message):
    with pytest.raises(InputError, match=re.escape(message)):
        linearize_case(
            (decay(foreign), Experiment(1.0, 0.01)), source, output, **{"at": 0.5, "opened": False, **options}
        )
