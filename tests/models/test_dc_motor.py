"""DC motor: exact time stepping with stick-slip and a gear that loses power in both directions."""

import math

import control
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import dc_motor
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.dc_motor import Inputs, Params, State, start, step

MOTOR = Kernel(dc_motor)
LINEAR = {"tau_c": 0.0, "efficiency": 1.0}


def constant(n: int, u: float, tau_load: float) -> np.ndarray:
    return np.tile([u, tau_load], (n, 1))


def reference(p: Params, segments: list[tuple[float, float, float]], rest: tuple[float, float]) -> np.ndarray:
    """(phi, omega, i) at the end of each (duration, u, tau_load) segment, by solve_ivp with events.

    The mode (direction, factor of the gear) is the one whose own gear power has the sign that it assumes.
    """
    n, y, states = p.gear_ratio, np.array([rest[0], 0.0, rest[1]]), []

    def torque_and_acceleration(y: np.ndarray, s: float, e: float, tau_load: float) -> tuple[float, float]:
        shaft = p.k_t * y[2] - p.b * n * y[1] - p.tau_c * s
        domega = (e * n * shaft - tau_load) / (p.J_load + e * n * n * p.J_rotor)
        return shaft - p.J_rotor * n * domega, domega

    def consistent(y: np.ndarray, s: float, tau_load: float) -> float:
        torque, _ = torque_and_acceleration(y, s, p.efficiency, tau_load)
        return p.efficiency if torque * s >= 0.0 else 1.0 / p.efficiency

    for duration, u, tau_load in segments:
        t, ratio = 0.0, 0.0
        while t < duration:
            s = float(np.sign(y[1]))
            if s == 0.0:
                for trial in (1.0, -1.0):
                    e = consistent(y, trial, tau_load)
                    if torque_and_acceleration(y, trial, e, tau_load)[1] * trial > 5e-8:
                        s = trial
            ratio = consistent(y, s, tau_load) if s else 1.0

            def rhs(_: float, y: np.ndarray, s: float = s, e: float = ratio, v: float = u, tau: float = tau_load):
                if s == 0.0:
                    return [0.0, 0.0, (v - p.R_a * y[2]) / p.L_a]
                domega = torque_and_acceleration(y, s, e, tau)[1]
                return [y[1], domega, (v - p.R_a * y[2] - p.k_e * n * y[1]) / p.L_a]

            def stops(t: float, y: np.ndarray, s: float = s, t0: float = t) -> float:
                return s * y[1] if s and t > t0 + 1e-9 else 1.0

            def turns(t: float, y: np.ndarray, s: float = s, e: float = ratio, tau: float = tau_load, t0: float = t):
                if s and (t <= t0 + 1e-9 or p.efficiency == 1.0):
                    return 1.0
                if s:
                    return s * torque_and_acceleration(y, s, e, tau)[0] * (1.0 if e <= 1.0 else -1.0)
                trials = [torque_and_acceleration(y, d, consistent(y, d, tau), tau)[1] * d for d in (1.0, -1.0)]
                return 1e-7 - max(trials)

            stops.terminal = turns.terminal = True  # type: ignore[attr-defined]
            stops.direction = turns.direction = -1.0  # type: ignore[attr-defined]
            run = solve_ivp(
                rhs, (t, duration), y, "DOP853", rtol=1e-12, atol=1e-14, max_step=4e-4, events=[stops, turns]
            )
            t, y = run.t[-1], run.y[:, -1]
            if run.t_events[0].size:
                y[1] = 0.0
        states.append(y)
    return np.array(states)


def kernel_states(p: Params, segments: list[tuple[float, float, float]], rest: tuple[float, float]) -> np.ndarray:
    s, states = State(rest[0], 0.0, rest[1]), []
    for duration, u, tau_load in segments:
        s, _ = step(p, s, Inputs(u, tau_load), duration)
        states.append((s.phi, s.omega, s.i))
    return np.array(states)


REVERSING = [(0.0137, 5.3, 0.02), (0.0311, 0.9, 0.11), (0.0503, -7.7, 0.11), (0.021, 0.0, -0.31), (0.3, 0.0, 0.01)]
STICKING = [(0.01, 0.1, 0.0), (0.02, 3.1, 0.05), (0.08, 0.2, 0.05), (0.05, 0.3, 0.0), (0.04, -2.9, 0.0)]
OVERHAULED = [(0.02, 0.0, 0.9), (0.05, 0.0, 0.9), (0.04, 6.1, 0.9), (0.05, 12.3, -0.4), (0.07, -3.7, -0.4)]


@pytest.mark.parametrize("segments", [REVERSING, STICKING, OVERHAULED], ids=["reversing", "sticking", "overhauled"])
@pytest.mark.parametrize(
    "changes",
    [{}, {"efficiency": 0.55, "tau_c": 0.0031}, {"L_a": 0.21, "efficiency": 0.9}, {"efficiency": 1.0}],
    ids=["default", "lossy", "oscillating", "lossless"],
)
def test_agrees_with_a_high_accuracy_solution(segments, changes) -> None:
    p = MOTOR.params(values=changes)
    expected = reference(p, segments, (0.217, 0.0))
    found = kernel_states(p, segments, (0.217, 0.0))
    scale = np.abs(expected).max(axis=0)
    assert scale.min() > 1e-3  # every channel moved
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("changes", [{}, {"L_a": 0.21}, {"efficiency": 0.55}, LINEAR])
@pytest.mark.parametrize(("u", "tau_load"), [(7.3, 0.13), (-11.9, 0.05), (24.0, -0.4)])
def test_one_step_equals_many_while_sliding(changes, u, tau_load) -> None:
    p = MOTOR.params(values=changes)
    moving, _ = step(p, start(p, Inputs(u, tau_load))[0], Inputs(u, tau_load), 0.0071)
    assert moving.omega != 0.0
    whole, _ = step(p, moving, Inputs(u, tau_load), 0.0833)
    parts = moving
    for _ in range(1000):
        parts, _ = step(p, parts, Inputs(u, tau_load), 0.0833 / 1000)
    np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-14)


def test_one_step_equals_many_through_reversal_and_rest() -> None:
    p = MOTOR.params()
    moving = State(0.0, 9.1, 0.21)
    for u in (Inputs(-3.3, 0.04), Inputs(0.0, 0.04)):
        whole, _ = step(p, moving, u, 0.1)
        parts = moving
        for _ in range(733):
            parts, _ = step(p, parts, u, 0.1 / 733)
        np.testing.assert_allclose(parts, whole, rtol=1e-11, atol=1e-13)


def test_linear_motor_agrees_with_python_control() -> None:
    p = MOTOR.params(values=LINEAR)
    n, inertia = p.gear_ratio, p.J_load + p.gear_ratio**2 * p.J_rotor
    a = [[-p.R_a / p.L_a, -p.k_e * n / p.L_a], [n * p.k_t / inertia, -(n**2) * p.b / inertia]]
    system = control.ss(a, [[1 / p.L_a, 0.0], [0.0, -1 / inertia]], [[0.0, 1.0], [1.0, 0.0]], np.zeros((2, 2)))
    t = np.arange(0.0, 0.2, 1.3e-3)
    y = MOTOR.simulate(p, t, constant(t.size, 6.2, 0.17))
    expected = control.forced_response(system, t, constant(t.size, 6.2, 0.17).T).outputs
    np.testing.assert_allclose(y[:, 1], expected[0], rtol=0, atol=1e-10 * np.abs(expected[0]).max())
    np.testing.assert_allclose(y[:, 3], expected[1], rtol=0, atol=1e-10 * np.abs(expected[1]).max())
    settled = MOTOR.simulate(p, [0.0, 9.0], constant(2, 6.2, 0.17))[-1]
    np.testing.assert_allclose(settled[[1, 3]], control.dcgain(system) @ [6.2, 0.17], rtol=1e-12)
    assert abs(settled[2]) < 1e-9


def test_electrical_energy_is_losses_plus_stored_energy_plus_load_work() -> None:
    p = MOTOR.params()
    t = np.arange(0.0, 0.6, 1e-5)
    u = 9.3 * np.sign(np.sin(2 * np.pi * 2.9 * t)) * (t < 0.45)
    inputs = np.column_stack([u, np.full_like(t, 0.12)])
    _, omega, domega, i = MOTOR.simulate(p, t, inputs).T
    n, torque_out = p.gear_ratio, p.J_load * domega + 0.12
    power_out = torque_out * omega  # leaves the gear; what enters it is more, either way it flows
    gear = np.where(power_out > 0.0, power_out * (1 / p.efficiency - 1), -power_out * (1 - p.efficiency))
    losses = p.R_a * i**2 + p.b * (n * omega) ** 2 + p.tau_c * n * np.abs(omega) + gear

    def integral(power: np.ndarray) -> float:
        return float(np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(t)))

    electrical = float(np.sum(u[1:] * 0.5 * (i[1:] + i[:-1]) * np.diff(t)))
    stored = 0.5 * p.L_a * i**2 + 0.5 * (p.J_load + n**2 * p.J_rotor) * omega**2
    balance = electrical - integral(losses) - (stored[-1] - stored[0]) - integral(0.12 * omega)
    assert integral(gear) > 0.05 * electrical
    assert abs(balance) < 2e-4 * electrical  # trapezoidal rule across the switching samples


@pytest.mark.parametrize("drives", [True, False])
def test_gear_loses_the_same_share_in_both_directions_of_flow(drives: bool) -> None:
    p = MOTOR.params(values={"efficiency": 0.71})
    tau_load = 0.3 if drives else -0.9  # -0.9 N.m pulls the output along
    _, omega, domega, i = MOTOR.simulate(p, [0.0, 5.0], constant(2, 8.0, tau_load))[-1]
    n = p.gear_ratio
    motor_side = (p.k_t * i - p.b * n * omega - p.tau_c) * n * omega
    assert omega > 0.0
    assert abs(domega) < 1e-9
    expected = 0.71 if drives else 1 / 0.71
    assert tau_load * omega / motor_side == pytest.approx(expected, rel=1e-9)


def test_comes_to_an_exact_rest_and_stays() -> None:
    p = MOTOR.params()
    t = np.arange(0.0, 1.0, 1e-3)
    u = np.where(t < 0.1, 4.7, 0.0)
    phi, omega, domega, i = MOTOR.simulate(p, t, np.column_stack([u, 0.0 * t])).T
    assert omega[90] > 5.0
    rest = t > 0.4
    assert not omega[rest].any()
    assert not domega[rest].any()
    assert np.ptp(phi[rest]) == 0.0
    assert abs(i[-1]) < 1e-12


def test_zero_input_is_rest() -> None:
    y = MOTOR.simulate(MOTOR.params(values={"phi_0": 0.37}), np.arange(500) * 2e-3, np.zeros((500, 2)))
    np.testing.assert_array_equal(y, np.tile([0.37, 0.0, 0.0, 0.0], (500, 1)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_breaks_away_at_the_holding_limit(sign: float) -> None:
    p = MOTOR.params(values={"efficiency": 0.71})
    # forwards against a load: Coulomb friction and load over ratio and efficiency
    limit = p.R_a * (p.tau_c + 0.2 / (0.71 * 14.0)) / p.k_t
    # held back against it: the gear helps
    hold = p.R_a * (0.71 * 0.2 / 14.0 - p.tau_c) / p.k_t
    t = [0.0, 30.0]
    for u, moves in ((limit * 0.999999, 0), (limit * 1.0001, 1), (hold * 1.000001, 0), (hold * 0.9999, -1)):
        y = MOTOR.simulate(p, t, constant(2, sign * u, sign * 0.2))
        from_rest = y[-1, 1] * sign
        # the load moves the shaft back before the current has risen; only the final state counts
        assert np.sign(from_rest) == moves


def test_no_chatter_around_rest() -> None:
    p = MOTOR.params()
    t = np.arange(0.0, 2.0, 1e-3)
    u = 0.9 * p.R_a * p.tau_c / p.k_t * np.sin(2 * np.pi * 3.7 * t)  # below break-away throughout
    assert not MOTOR.simulate(p, t, np.column_stack([u, 0 * t]))[:, 1].any()
    u *= 1.2  # above it around the peaks: one start and one stop for each half period
    moving = MOTOR.simulate(p, t, np.column_stack([u, 0 * t]))[:, 1] != 0.0
    assert np.count_nonzero(np.diff(moving.astype(int)) > 0) in (14, 15)


def test_voltage_beyond_the_supply_changes_nothing() -> None:
    p, t = MOTOR.params(), np.linspace(0.0, 0.2, 41)
    for sign in (1.0, -1.0):
        at_limit = MOTOR.simulate(p, t, constant(41, sign * 24.0, 0.1))
        np.testing.assert_array_equal(MOTOR.simulate(p, t, constant(41, sign * 71.3, 0.1)), at_limit)


def test_bare_motor_has_the_catalogue_speed_and_time_constant() -> None:
    bare = {"gear_ratio": 1.0, "efficiency": 1.0, "J_load": 0.0}
    p = MOTOR.params(values=bare)
    omega = MOTOR.simulate(p, [0.0, 1.0], constant(2, 24.0, 0.0))[-1, 1]
    assert omega * 60 / math.tau == pytest.approx(6400.0, rel=0.01)
    frictionless = MOTOR.params(values={**bare, "b": 0.0, "tau_c": 0.0})
    t = np.linspace(0.0, 0.05, 5001)
    omega = MOTOR.simulate(frictionless, t, constant(t.size, 10.0, 0.0))[:, 1]
    assert np.interp((1 - math.exp(-1)) * omega[-1], omega, t) == pytest.approx(5.4e-3, rel=0.05)


positive = st.floats(-3.0, 3.0).map(lambda exponent: 10.0**exponent)


REFUSED = "more than 100000 times in one step -- expected fewer -- make the communication step shorter"


def test_never_creates_energy_and_refuses_only_endless_ringing() -> None:
    outcomes = {"followed": 0, "refused": 0}

    @settings(max_examples=300, deadline=None, database=None, derandomize=True)
    @given(
        scale=st.tuples(positive, positive, positive, positive, positive),
        friction=st.tuples(st.sampled_from([0.0, 1e-4, 0.01, 3.0]), st.sampled_from([0.0, 1e-6, 1e-3])),
        efficiency=st.sampled_from([0.05, 0.31, 0.83, 1.0]),
        begin=st.tuples(st.floats(-40, 40), st.floats(-2, 2)),
        inputs=st.tuples(st.floats(-24, 24), st.sampled_from([0.0, 1e-9, 0.3, -1.7])),
        dt=st.sampled_from([1e-5, 1e-3, 0.1, 3.0]),
    )
    @example(
        # undamped but for the gear, half a million half periods: rings down to nothing
        scale=(6.19, 874.97, 0.01988, 874.97, 0.001),
        friction=(0.0, 0.0),
        efficiency=0.31,
        begin=(-13.3, 0.79),
        inputs=(0.0, 0.0),
        dt=3.0,
    )
    @example(
        # a voltage that drives no current worth the name
        scale=(0.0423, 27.35, 1.0, 1.0, 1.0),
        friction=(0.0, 0.0),
        efficiency=0.05,
        begin=(6.92, 0.0),
        inputs=(-6.15e-169, 0.0),
        dt=3.0,
    )
    def case(scale, friction, efficiency, begin, inputs, dt) -> None:
        p = motor(scale, friction, efficiency)
        try:
            follow(p, State(0.0, *begin), inputs, dt)
            outcomes["followed"] += 1
        except ValueError as refusal:
            half_periods = dt * math.sqrt(highest_a_0(p)) / math.pi
            if REFUSED not in str(refusal) or half_periods < 1e4:  # each has four events at most
                raise
            outcomes["refused"] += 1

    case()
    assert outcomes["refused"] < 0.02 * outcomes["followed"]


def motor(scale: tuple[float, ...], friction: tuple[float, float], efficiency: float) -> Params:
    k = 0.0349 * scale[3]
    return Params(
        *(5.78 * scale[0], 5.5e-4 * scale[1], k, k, 1.1e-6 * scale[2], friction[1], friction[0]),
        *(14.0, efficiency, 2.5e-4 * scale[4]),
    )


def highest_a_0(p: Params) -> float:
    """Square of the highest undamped frequency of Eq (7), with the larger factor of the gear."""
    e_n2 = p.gear_ratio**2 / p.efficiency
    return e_n2 * (p.R_a * p.b + p.k_t * p.k_e) / (p.L_a * (p.J_load + e_n2 * p.J_rotor))


def follow(p: Params, s: State, inputs: tuple[float, float], dt: float) -> None:
    """Four steps without input, in which stored energy never grows, and four with it; all results are finite."""

    def stored(s: State) -> float:
        return 0.5 * p.L_a * s.i**2 + 0.5 * (p.J_load + 196.0 * p.J_rotor) * s.omega**2

    for _ in range(4):
        after, out = step(p, s, Inputs(0.0, 0.0), dt)
        assert all(map(math.isfinite, after + out))
        assert stored(after) <= stored(s) * (1 + 1e-9)
        s = after
    for _ in range(4):
        s, out = step(p, s, Inputs(*inputs), dt)
        assert all(map(math.isfinite, s + out))


def test_ringing_without_friction_ends_at_rest() -> None:
    p = motor((6.19, 874.97, 0.01988, 874.97, 0.001), (0.0, 0.0), 0.31)
    s, out = step(p, State(0.217, -13.3, 0.79), Inputs(0.0, 0.0), 3.0)
    assert (s.omega, out.domega) == (0.0, 0.0)
    assert abs(s.i) < 1e-30
    parts = State(0.217, -13.3, 0.79)
    for _ in range(3000):
        parts, _ = step(p, parts, Inputs(0.0, 0.0), 1e-3)
    assert s.phi == pytest.approx(parts.phi, rel=1e-9)


def test_refuses_a_step_with_too_many_reversals() -> None:
    lossless = {"R_a": 1e-6, "L_a": 1e-3, "tau_c": 0.0, "b": 0.0, "efficiency": 0.99999}
    with pytest.raises(InputError, match=REFUSED):
        MOTOR.simulate(MOTOR.params(values=lossless), [0.0, 1e4], constant(2, 9.7, 0.0))
