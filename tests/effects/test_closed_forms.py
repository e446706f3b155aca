"""Each effect against a closed form or a limiting case, written here without its code."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.kernel import Kernel

BY_NAME = {module.NAME: Kernel(module) for module in EFFECTS}


def run(name, values, time, **signals):
    """Output of one effect; signals not given are 0."""
    effect = BY_NAME[name]
    columns = [np.broadcast_to(signals.get(v.name, 0.0), np.shape(time)) for v in effect.inputs]
    return effect.simulate(effect.params(None, values), time, np.column_stack(columns))[:, 0]


@pytest.fixture
def time():
    return np.arange(4001) * 1.3e-3


def test_static_force_laws(time):
    v = 1.7 * np.sin(3.1 * time)
    s, z, x = np.sign(v), np.tanh(5.0 * v), 0.4 - 0.9 * np.cos(2.0 * time)
    y = 0.3 * np.cos(time)
    load = 0.7 * np.sin(1.3 * time) - 0.2
    cases = {
        ("coulomb", (("F_c", 0.37),)): (y + 0.37 * z, {}),
        ("viscous", (("f_v", 0.21), ("q", 0.13), ("p", 0.7))): (y + 0.21 * v + 0.13 * np.abs(v) ** 0.7 * s, {}),
        ("stribeck", (("dF", 0.37), ("v_s", 0.23), ("d", 1.3))): (
            y + 0.37 * np.exp(-((np.abs(v) / 0.23) ** 1.3)) * z, {}),
        ("inertia", (("m", 0.37),)): (y + 0.37 * 5.0 * x, {"a": 5.0 * x}),
        ("load_dependence", (("k", 0.37),)): (y + 0.37 * np.abs(load) * z, {}),
        ("bend_angle", (("mu", 0.16),)): (y + 0.16 * (2.0 + x) * np.abs(load) * z, {"bend": 2.0 + x}),
        ("bend_angle", (("mu", 0.16), ("mu_c", 0.43), ("T_0", 0.9))): (
            y + 0.16 / 0.43 * (np.exp(0.43 * (2.0 + x)) - 1.0) * (np.abs(load) + 0.9) * z, {"bend": 2.0 + x}),
        ("bend_angle", (("mu", 0.16), ("mu_c", 1e-14))): (
            y + 0.16 * (2.0 + x) * np.abs(load) * z, {"bend": 2.0 + x}),
        ("temperature_dependence", (("beta", 0.07),)): (
            np.where(x < 13.0, y * (1.0 - 0.07 * x), 0.0), {"temperature": 293.15 + x}),
        ("temperature_dependence", (("beta", 3.0),)): (
            y * np.maximum(0.0, 1.0 - 3.0 * x), {"temperature": 293.15 + x}),
        ("drive_direction", (("k_m", 0.3), ("k_e", 0.17))): (y + np.abs(0.3 * (load + y) - 0.17 * load) * z, {}),
        ("direction_asymmetry", (("eps", -0.37), ("df_v", 0.23))): (y * (1.0 - 0.37 * s) + 0.23 * np.abs(v), {}),
        ("gain_error", (("g", 0.073),)): (1.073 * y, {}),
        ("tendon_elasticity", (("compliance", 0.37), ("compliance_drive", 0.13))): (
            y - 0.37 * load - 0.13 * (2.0 - x), {"drive": 2.0 - x}),
        ("stiffness_hardening", (("k_1", 0.21), ("k_3", 0.37), ("x_c", 0.11))): (
            y + 0.21 * (x - 0.11) + 0.37 * (x - 0.11) ** 3, {}),
        ("slack", (("w", 0.07), ("F_0", 0.013))): (y - 0.07 * load / (np.abs(load) + 0.013), {}),
        ("quantisation", (("q", 0.037),)): (0.037 * np.floor(y / 0.037 + 0.5), {}),
        ("quantisation", (("q", 0.037), ("y_0", 0.011))): (0.011 + 0.037 * np.floor((y - 0.011) / 0.037 + 0.5), {}),
        ("drum_periodic", (("C_2", 0.3), ("S_2", -0.4), ("r", 1.7))): (
            y + 0.5 * np.cos(2.0 * x / 1.7 + math.atan2(0.4, 0.3)), {}),
    }  # fmt: skip
    for (name, values), (expected, extra) in cases.items():
        given = {"y": y, "v": v, "s": s, "z": z, "x": x, "load": load, **extra}
        assert run(name, dict(values), time, **given) == pytest.approx(expected, abs=1e-13), name


def test_acceleration_branches_part_only_while_speeding_up(time):
    a = np.linspace(-3.0, 3.0, time.size)
    values = {"dF_p": 0.37, "dF_n": -0.11, "a_0": 0.7}
    x = 0.13 * time  # far at each sample beside the presliding distance: the bristles follow at once
    pull = run("acceleration_branches", values, time, a=a, s=1.0, x=x, x_pre=1e-6)
    release = run("acceleration_branches", values, time, a=a, s=-1.0, x=-x, x_pre=1e-6)
    opened = 1.0 - np.exp(-np.abs(a) / 0.7)
    assert pull[1:] == pytest.approx(np.where(a > 0.0, 0.37 * opened, 0.0)[1:], abs=1e-14)
    assert release[1:] == pytest.approx(np.where(a < 0.0, 0.11 * opened, 0.0)[1:], abs=1e-14)


@pytest.mark.parametrize("b", [0.0, 0.43, 1.0])
def test_the_bristles_carry_a_branch_over_the_presliding_distance(b):
    """Closed form over the travel, at any speed and step: to one branch, to the other, and on after a reversal."""
    x_pre, x = 0.037, np.concatenate([np.linspace(0.0, 0.21, 41), np.linspace(0.21, 0.3, 19), np.linspace(0.3, 0.1, 7)])
    a = np.where(np.arange(x.size) < 41, 2.3, -2.3)  # the last stretch speeds up the other way
    s = np.where(np.arange(x.size) < 60, 1.0, -1.0)
    values = {"dF_p": 0.37, "dF_n": 0.21, "a_0": 0.9, "b": b}
    found = run("acceleration_branches", values, np.arange(x.size) * 0.01, a=a, s=s, x=x, x_pre=x_pre)
    opened = 1.0 - math.exp(-2.3 / 0.9)
    first, second, third = 0.37 * opened, -b * 0.37 * opened, -0.21 * opened
    at_first = first * -math.expm1(-0.21 / x_pre)
    at_second = second + (at_first - second) * math.exp(-0.09 / x_pre)
    expected = np.concatenate([
        first * -np.expm1(-x[:41] / x_pre),
        second + (at_first - second) * np.exp(-(x[41:60] - 0.21) / x_pre),
        third + (at_second - third) * np.exp(-(0.3 - x[60:]) / x_pre),
    ])  # fmt: skip
    assert found == pytest.approx(expected, abs=1e-14)


def test_sensor_lag_follows_a_ramp_late_by_tau_and_is_exact(time):
    tau, slope = 0.137, 2.3
    y = run("sensor_lag", {"tau": tau}, time, y=slope * time)
    assert y == pytest.approx(slope * (time - tau + tau * np.exp(-time / tau)), abs=1e-12)


def test_friction_lag_solves_its_equation_and_leaves_the_direction_alone(time):
    d, v_s, tau = 0.37, 0.23, 0.137
    z = np.where(np.sin(1.9 * time) > 0.0, 1.0, -1.0)

    def strength(t):
        return np.exp(-(((0.31 + 0.29 * np.sin(2.7 * t)) / v_s) ** 2))

    late = solve_ivp(lambda t, f: (strength(t) - f) / tau, (0.0, time[-1]), [strength(0.0)], t_eval=time, rtol=1e-10,
                     atol=1e-12, max_step=0.01).y[0]  # fmt: skip
    y = run("friction_lag", {"d": d, "v_s": v_s, "tau": tau}, time, y=0.5 * z, v=0.31 + 0.29 * np.sin(2.7 * time))
    assert y == pytest.approx(0.5 * z * (1.0 + d * (late - strength(time))), abs=2e-6)
    prompt = run("friction_lag", {"d": d, "v_s": v_s, "tau": 0.0}, time, y=0.5 * z, v=z)
    assert np.array_equal(prompt, 0.5 * z)


@pytest.mark.parametrize("n", [0.5, 1.0, 1.7, 3.0])
def test_presliding_shape_solves_its_equation(n):
    """Load from rest, reverse, against an adaptive integration of dz/dx = (1 - s z)^n / x_0."""
    x_0 = 0.037
    forward = np.linspace(0.0, 0.05, 301)
    x = np.concatenate([forward, forward[-2::-1]])
    z = run("presliding_shape", {"dF": 1.0, "n": n, "x_0": x_0}, np.arange(x.size) * 1e-3, x=x)

    def grown(s, z_start):
        def slope(_x, state):
            return s * max(0.0, 1.0 - s * state[0]) ** n / x_0

        return solve_ivp(slope, (0.0, 0.05), [z_start], t_eval=forward, rtol=1e-11, atol=1e-13).y[0]

    assert z[:301] == pytest.approx(grown(1.0, 0.0), abs=1e-6)
    assert z[300:] == pytest.approx(grown(-1.0, z[300]), abs=1e-6)


def test_nonlocal_memory_closes_nested_loops_and_has_the_closed_form_area():
    values = {"F_1": 0.31, "F_2": 0.23, "F_3": 0.17, "x_1": 0.011, "x_2": 0.037, "x_3": 0.071}
    sizes = [(0.31, 0.011), (0.23, 0.037), (0.17, 0.071)]
    path = [0.0, 0.2, -0.2, 0.2, 0.05, 0.12, 0.05, 0.2]
    x = np.concatenate([np.linspace(a, b, 2001)[1:] for a, b in itertools.pairwise(path)])
    force = run("nonlocal_memory", values, np.arange(x.size) * 1e-3, x=x)
    outer = slice(1999, 6000)  # 0.2 -> -0.2 -> 0.2
    area = np.trapezoid(force[outer], x[outer])
    assert area == pytest.approx(sum(4.0 * f * (0.2 - w) for f, w in sizes), rel=1e-3)
    assert force[-1] == pytest.approx(sum(f for f, _ in sizes), abs=1e-12)
    first, second = force[8000 - 1], force[12000 - 1]  # both at 0.05, after a nested loop to 0.12 and back
    assert x[7999] == pytest.approx(x[11999])
    assert first == pytest.approx(second, abs=1e-12)


def test_breakaway_ageing_shows_after_the_hold_as_the_log_of_it_and_is_worn_away():
    B, D_c, theta_0, x_pre, speed, dt = 0.13, 2.0, 0.05, 1e-4, 0.7, 1e-4
    values = {"B": B, "D_c": D_c, "theta_0": theta_0}
    for hold in (0.3, 3.0, 30.0):
        rest = round(hold / dt)
        x = np.concatenate([np.zeros(rest + 1), speed * dt * np.arange(1, 61)])
        force = run("breakaway_ageing", values, np.arange(x.size) * dt, x=x, z=1.0, x_pre=x_pre)
        assert not force[: rest + 1].any()  # the presliding spring keeps its force
        assert force[-1] == pytest.approx(B * math.log1p(hold / theta_0), rel=0.02)
    time = np.arange(200_001) * dt
    force = run("breakaway_ageing", values, time, x=speed * time, z=1.0, x_pre=x_pre)
    assert force[-1] == pytest.approx(B * math.log1p(D_c / speed / theta_0), rel=1e-3)


def test_breakaway_ageing_at_rest_grows_with_the_log_of_the_hold():
    B, D_c, theta_0, dt = 0.13, 0.02, 0.05, 1e-3
    values = {"B": B, "D_c": D_c, "theta_0": theta_0, "rest": 1.0}
    for hold in (0.3, 3.0, 30.0):
        rows = round(hold / dt) + 1
        force = run("breakaway_ageing", values, np.arange(rows) * dt, x=0.0, z=1.0, x_pre=0.003)
        assert force[-1] == pytest.approx(B * math.log1p(hold / theta_0), rel=1e-9)
    time = np.arange(5001) * dt
    force = run("breakaway_ageing", values, time, x=0.7 * time, z=1.0, x_pre=0.003)
    assert force[-1] == pytest.approx(B * math.log1p(D_c / 0.7 / theta_0), rel=1e-9)


def test_breakaway_ageing_solves_its_equations():
    """Slide, hold, slide back, against an adaptive integration in time."""
    B, D_c, theta_0, x_pre, dt = 0.37, 0.031, 0.073, 0.0041, 1e-4

    def speed(t):
        return 0.13 if t < 0.5 else 0.0 if t < 1.7 else -0.09

    def slope(t, state):
        theta, b = state
        v = speed(t)
        g = math.log1p(theta / theta_0)
        return [1.0 - abs(v) * theta / D_c, (abs(v) / x_pre) * (math.copysign(g, v) - b)]

    time, parts, state = np.arange(23_001) * dt, [], [0.0, 0.0]
    for low, high in ((0.0, 0.5), (0.5, 1.7), (1.7, 2.3)):
        at = time[(time >= low - 1e-9) & (time <= high + 1e-9)]
        solved = solve_ivp(slope, (low, high), state, t_eval=np.clip(at, low, high - 1e-12), rtol=1e-10, atol=1e-12)
        parts.append(solved.y[1][1:])
        state = solved.y[:, -1]
    x = np.cumsum([0.0, *(speed(t) * dt for t in time[:-1] + 0.5 * dt)])
    force = run("breakaway_ageing", {"B": B, "D_c": D_c, "theta_0": theta_0}, time, x=x, z=1.0, x_pre=x_pre)
    assert force[1:] == pytest.approx(B * np.concatenate(parts), abs=2e-3 * B)


def test_offset_drift_is_a_straight_line(time):
    y = run("offset_drift", {"b": 0.31, "c": -0.07}, time, y=0.0)
    assert y == pytest.approx(0.31 - 0.07 * time, abs=1e-12)


def test_backlash_matches_its_describing_function():
    """First harmonic of the play operator on a sine, Gelb and Vander Velde."""
    amplitude, w, rows = 1.0, 0.31, 40_000
    phase = np.linspace(0.0, 6.0 * np.pi, rows, endpoint=False)
    y = run("backlash", {"w": w}, np.arange(rows) * 1e-3, y=amplitude * np.sin(phase))
    last = slice(rows // 3, rows)
    harmonic = 2.0 * np.mean(y[last] * np.exp(-1j * phase[last])) * 1j
    gamma = 1.0 - 2.0 * w / amplitude
    real = (math.pi / 2 + math.asin(gamma) + gamma * math.sqrt(1 - gamma**2)) / math.pi
    imaginary = -(1 - gamma**2) / math.pi
    assert harmonic == pytest.approx(complex(real, imaginary), abs=2e-4)


def test_a_stroke_inside_the_gap_moves_nothing(time):
    y = run("backlash", {"w": 0.2}, time, y=0.19 * np.sin(5.0 * time))
    assert np.ptp(y) == 0.0


def test_smooth_backlash_has_the_closed_form_half_height():
    beta, alpha, amplitude = -0.37, 7.3, 0.8
    phase = np.linspace(0.0, 8.0 * np.pi, 40_001)
    x = amplitude * np.sin(phase)
    h = run("smooth_backlash", {"beta": beta, "alpha": alpha}, np.arange(x.size) * 1e-3, y=x) - x
    assert np.max(h[-10_001:]) == pytest.approx(-beta / alpha * math.tanh(alpha * amplitude), rel=1e-6)


def test_creep_relaxes_from_a_spring_to_nothing():
    k, tau = 2.3, 0.41
    time = np.arange(3001) * 1e-3
    x = np.minimum(time / 0.1, 1.0)
    y = run("creep", {"k": k, "tau": tau}, time, x=x)
    rise = k * tau / 0.1 * (1.0 - math.exp(-0.1 / tau))
    assert y[100] == pytest.approx(rise, rel=1e-9)
    assert y[1100] == pytest.approx(rise * math.exp(-1.0 / tau), rel=1e-9)


def test_a_tendon_goes_on_stretching_under_its_load():
    compliance, tau = 0.037, 0.73
    time = np.arange(4001) * 1e-3
    load = np.where(time < 0.1, 1.9, np.where(time < 0.3, 1.9 + 2.3 * (time - 0.1) / 0.2, 4.2))
    y = run("creep", {"C": compliance, "tau": tau}, time, y=0.3, load=load)
    assert y[:101] == pytest.approx(0.3 - compliance * 1.9)  # what was there before has crept to its end
    behind = 2.3 * tau / 0.2 * (1.0 - math.exp(-0.2 / tau))  # of a load on a ramp, at its end
    assert y[300] == pytest.approx(0.3 - compliance * (4.2 - behind), rel=1e-9)
    assert y[1300] == pytest.approx(0.3 - compliance * (4.2 - behind * math.exp(-1.0 / tau)), rel=1e-9)


def test_a_load_that_is_put_on_as_a_run_begins_stretches_the_tendon_from_then_on():
    compliance, tau = 0.037, 0.73
    time = np.arange(2001) * 1e-3
    for before in (0.0, 0.31, 1.0):
        y = run("creep", {"C": compliance, "tau": tau, "l_0": before}, time, y=0.3, load=4.2)
        assert y == pytest.approx(0.3 - compliance * 4.2 * (1.0 - (1.0 - before) * np.exp(-time / tau)), rel=1e-9)


def test_thermal_decays_at_work_and_recovers_at_rest():
    d, tau = 0.4, 0.9
    time = np.arange(4001) * 1e-3
    moving = run("thermal", {"d": d, "tau": tau, "v_0": 0.01}, time, y=1.0, v=5.0)
    assert moving == pytest.approx(1.0 + d * np.exp(-time / tau), rel=1e-9)
    v = np.where(time < 2.0, 5.0, 0.0)
    rested = run("thermal", {"d": d, "tau": tau, "v_0": 0.01}, time, y=1.0, v=v)
    cold = 1.0 - math.exp(-(1.999) / tau)
    assert rested[-1] == pytest.approx(1.0 + d * (1.0 - cold * math.exp(-2.001 / tau)), rel=1e-9)


def test_wear_follows_the_travel_and_not_the_time():
    time = np.arange(6001) * 1e-3
    x = np.where(time < 3.0, 1.3 * np.sin(2.0 * np.pi * time), 0.0)
    y = run("wear", {"d": 0.3, "L": 7.0}, time, y=1.0, x=x)
    assert y[-1] == y[3001]
    assert y[-1] == pytest.approx(1.0 + 0.3 * math.exp(-3 * 4 * 1.3 / 7.0), rel=1e-4)
    steady = run("wear", {"r": 0.017, "X_0": 4.4}, time, y=2.0, x=x)
    assert steady[0] == pytest.approx(2.0 * (1.0 + 0.017 * 4.4), rel=1e-12)
    assert steady[-1] == pytest.approx(2.0 * (1.0 + 0.017 * (4.4 + 3 * 4 * 1.3)), rel=1e-4)
    both = run("wear", {"d": 0.3, "L": 7.0, "r": 0.017, "X_0": 4.4}, time, y=1.0, x=x)
    run_in = run("wear", {"d": 0.3, "L": 7.0, "X_0": 4.4}, time, y=1.0, x=x)
    assert both == pytest.approx(run_in + 0.5 * steady - 1.0, rel=1e-12)


def test_winding_crossover_bursts_twice_a_turn_and_bends_at_the_layer():
    x = np.linspace(0.0, 4.0 * np.pi, 40_001)
    y = run("winding_crossover", {"A": 0.3, "w": 0.15, "x_b": 0.7}, np.arange(x.size) * 1e-3, x=x)
    peaks = x[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])]
    assert peaks == pytest.approx(0.7 + np.pi * np.arange(4), abs=1e-3)
    assert y.max() == pytest.approx(0.3, abs=1e-6)
    bent = run("winding_crossover", {"h": 0.021, "x_l": 5.0}, np.arange(x.size) * 1e-3, x=x)
    assert bent == pytest.approx(0.021 * np.maximum(0.0, x - 5.0), abs=1e-14)


def test_delay_is_exact_on_lines_and_refuses_more_than_it_keeps():
    time = np.arange(2001) * 1e-3
    late = run("delay", {"T_d": 0.0173}, time, y=3.1 * time)
    assert late[100:] == pytest.approx(3.1 * (time[100:] - 0.0173), abs=1e-12)
    assert late[:17] == pytest.approx(np.zeros(17), abs=1e-12)
    with pytest.raises(ValueError, match=r"T_d over dt -- expected at most the 63 steps kept -- shorten T_d"):
        run("delay", {"T_d": 0.0637}, time, y=time)
