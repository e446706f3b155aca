"""Moving reversal fronts of the LeBus transmission against finite elements with Coulomb friction, and closed forms."""

import itertools
import math

import numpy as np
import pytest
from lebus_finite_elements import Chain

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import lebus_transmission
from tsm_fmu.models.laws.capstan import CAPACITY, stretched
from tsm_fmu.models.lebus.loop import stretch_a, stretch_b
from tsm_fmu.models.lebus.rig import rig
from tsm_fmu.models.lebus.state import loop_of

K = kernel("LebusTransmission")
R = 0.0125
L, EA = 1.5, 6786.0


def run(p, s_in, F):
    """Rows of outputs for driver travel [m] and load force [N]."""
    F = np.broadcast_to(np.asarray(F, dtype=float), np.shape(s_in))
    return K.simulate(p, np.arange(len(s_in)) * 0.1, np.column_stack([np.asarray(s_in) / R, F * R]), compiled=False)


def path(*turns, steps=23):
    """Straight driver moves between the turning points."""
    legs = [np.linspace(a, b, steps)[1:] for a, b in itertools.pairwise(turns)]
    return np.concatenate([[turns[0]], *legs])


def oracle(s_in, F, n, lam, both, T_0):
    chain = Chain(n, L, EA, T_0, lam, both)
    F = np.broadcast_to(np.asarray(F, dtype=float), np.shape(s_in))
    chain.move(0.0, F[0])
    rows, before = [], F[0]
    for s, f in zip(s_in, F, strict=True):
        if f != before:
            chain.move(chain.u[0], f)  # a load that changes acts first
            before = f
        rows.append((chain.move(s, f), chain.T[0], chain.T[-1]))
    return np.array(rows)


FORWARD_BACK_INNER = path(0.0, 0.0061, 0.00497, 0.00553, 0.00512, 0.0054, 0.00441, 0.00093)


@pytest.mark.parametrize("bend", ["uniform", "straight_first_and_between"])
def test_hanging_load_matches_finite_elements(bend):
    """Forward, reversal, inner loops: the difference is the discretisation's and shrinks with the elements."""
    if bend == "uniform":
        p = K.params("m05_540", {"winding_strain": 0})

        def lam(x):
            return 0.16 * 3 * math.pi * x
    else:
        values = {"n_seg": 5, "L_1": 0.3, "R_1": 0.0, "L_2": 0.45, "R_2": 0.2, "L_3": 0.15, "R_3": 0.0}
        values |= {"L_4": 0.3, "R_4": 0.11, "L_5": 0.3, "R_5": 0.47}
        p = K.params("m05_540", {**values, "winding_strain": 0})

        def lam(x):
            rates = np.array([0.0, 0.16 / 0.2, 0.0, 0.16 / 0.11, 0.16 / 0.47])
            ends = np.array([0.0, 0.3, 0.75, 0.9, 1.2, 1.5])
            return np.interp(x * L, ends, np.concatenate([[0.0], np.cumsum(rates * np.diff(ends))]))

    ours = run(p, FORWARD_BACK_INNER, 4.905)
    errors = []
    for n in (125, 500, 2000):
        theirs = oracle(FORWARD_BACK_INNER, 4.905, n, lam, False, 1.1)
        errors.append(
            (np.abs(ours[:, 0] * R - theirs[:, 0]).max(), np.abs(ours[:, 1] / np.maximum(theirs[:, 1], 1) - 1).max())
        )
    position, tension = np.array(errors).T
    assert position[-1] < 2e-9  # of 6 mm
    assert tension[-1] < 2e-5
    assert (position[1:] < position[:-1] / 8).all()  # about second order: 16 for four times the elements
    assert (tension[1:] < tension[:-1] / 8).all()


def test_two_tight_tendons_and_a_changing_load_match_finite_elements():
    """Preload keeps both tendons tight: fronts from both ends, follower moving while a tendon still sticks."""
    s_in = path(0.0, 0.0031, 0.0012, 0.0024, 0.0018, -0.0027, 0.0005, steps=19)
    F = np.where(np.arange(s_in.size) % 18 < 9, 3.1, -2.3)
    F[40:] = 0.7
    p = K.params("m05_180", {"winding_strain": 0, "slack": 0.0, "T_0": 21.0})
    ours = run(p, s_in, F)
    assert ours[:, 2].min() > 0.5  # nothing loose
    errors = []
    for n in (125, 500):
        theirs = oracle(s_in, F, n, lambda x: 0.16 * math.pi * x, True, 21.0)
        errors.append(
            [np.abs(ours[:, 0] * R - theirs[:, 0]).max(), *(np.abs(ours[:, 1:3] - theirs[:, 1:]).max(axis=0) / 21.0)]
        )
    first, last = np.array(errors)
    assert (last < [2e-8, 5e-5, 5e-5]).all()
    assert (last < first / 8).all()


def test_driver_tension_and_travel_of_the_front_have_their_closed_form():
    """T_a0' = T_a0 (1 - sqrt(s EA mu kappa/T_a0))^2 until the front arrives."""
    p = K.params("m10_540", {"winding_strain": 0})
    T_a0 = 9.81 * math.exp(0.16 * 3 * math.pi)
    slope = EA * 0.16 * 3 * math.pi / L / T_a0
    arrives = (1 - math.exp(-0.16 * 3 * math.pi)) ** 2 / slope
    s = np.array([1e-9, 3.3e-7, 1.7e-5, 2.1e-4, 9.7e-4, 2.2e-3, 0.999999 * arrives])
    y = run(p, np.concatenate([[0.0, 0.03], 0.03 - s, [0.03 - 1.001 * arrives]]), 9.81)
    np.testing.assert_allclose(y[2:-1, 1], T_a0 * (1 - np.sqrt(s * slope)) ** 2, rtol=2e-10)
    assert (y[2:-1, 0] == y[1, 0]).all()  # the follower rests
    assert (y[2:-1, 6] == 1).all()
    assert y[-1, 0] < y[1, 0]
    assert y[-1, 6] == 2
    np.testing.assert_allclose(y[-1, 1], 9.81 * math.exp(-0.16 * 3 * math.pi), rtol=1e-12)


@pytest.mark.parametrize("values", [{}, {"T_0": 21.0, "slack": 0.0}, {"T_0": 3.0, "slack": 0.0015, "layers": 1}])
@pytest.mark.parametrize("winding_strain", [0, 1])
def test_sub_steps_change_nothing(values, winding_strain):
    """One step of a monotone move or many: same state, whatever stages lie between."""
    p = K.params("m05_540", {**values, "winding_strain": winding_strain})
    turns = np.array([0.013, 0.0331, 0.0307, 0.0322, 0.0139, 0.0321])
    coarse = run(p, turns, 4.905)
    fine = run(p, path(*turns, steps=38), 4.905)[::37]
    # winding strain counts while all slides: of second order in the strain (1e-3) where a tendon only just starts
    exact = winding_strain == 0 or not values
    np.testing.assert_allclose(fine[:, 0], coarse[:, 0], rtol=0, atol=2e-12 if exact else 2e-4)
    np.testing.assert_allclose(fine[:, 1:3], coarse[:, 1:3], rtol=1e-10 if exact else 1e-2, atol=1e-10)


def test_closed_inner_loops_are_forgotten():
    """Return-point memory: after an inner loop the path goes on as if it had not been."""
    p = K.params("m10_540", {"winding_strain": 0})
    plain = run(p, [0.0, 0.03, 0.0285, 0.0275], 9.81)
    looped = run(p, [0.0, 0.03, 0.0285, 0.0291, 0.0287, 0.0289, 0.0285, 0.0275], 9.81)
    np.testing.assert_allclose(looped[-1], plain[-1], rtol=1e-11)
    np.testing.assert_allclose(looped[-2], plain[-2], rtol=1e-11)


@pytest.mark.parametrize("ends", ["bend_last", "straight_last", "straight_first"])
def test_coming_back_to_the_turning_point_restores_everything(ends):
    """The front runs out on the very point where it began, also where that is a straight piece."""
    radii = {"bend_last": (0.05, 0.3), "straight_last": (0.05, 0.0), "straight_first": (0.0, 0.05)}[ends]
    p = K.params("m05_180", {"n_seg": 2, "L_1": 0.22, "L_2": 0.34, "R_1": radii[0], "R_2": radii[1]})
    for back in (1e-7, 3.3e-6, 1.7e-5, 4.1e-5, 7.7e-5):
        y = run(p, [0.0, 0.03, 0.03 - back, 0.03, 0.03 - 0.5 * back, 0.03], 4.905)
        assert y[2, 6] == 1
        np.testing.assert_allclose(y[[3, 5], :6], y[[1, 1], :6], rtol=1e-9, atol=1e-15)


def test_random_histories_keep_balance_friction_bound_and_compatibility():
    """Whatever the drive and the load do: T_ae r - T_be r = tau, |dT/T| <= mu dl/R, delta = S_in - S_out, T >= 0."""
    rng = np.random.default_rng(17)
    for T_0, slack, mu in ((0.0, 0.0, 0.3), (1.1, 0.15, 0.16), (20.0, 0.001, 0.16), (20.0, 0.0, 0.02)):
        values = {"n_seg": 3, "L_1": 0.3, "R_1": 0.0, "L_2": 0.5, "R_2": 0.3, "L_3": 0.2, "R_3": 0.1}
        p = K.params(None, {**values, "T_0": T_0, "slack": slack, "mu": mu})
        g = rig(p)
        s, _ = lebus_transmission.start(p, lebus_transmission.Inputs(0.3, 0.05))
        theta, tau = 0.3, 0.05
        for _ in range(150):
            theta += float(rng.normal() * 10 ** rng.uniform(-6, 0.3))
            tau = float(rng.choice([0.0, 0.06, -0.06, 0.21])) if rng.random() < 0.15 else tau
            s, _ = lebus_transmission.step(p, s, lebus_transmission.Inputs(theta, tau), 0.01)
            loop = loop_of(g, s)
            assert abs((loop.a.T[-1] - loop.b.T[-1]) * R - tau) < 1e-9 * (abs(tau) + 1e-3)
            for tendon, kinematic in ((loop.a, stretch_a(g, loop, theta)), (loop.b, stretch_b(g, loop, theta))):
                assert min(tendon.T) >= 0.0
                if tendon.T[0] == 0.0:
                    assert kinematic < 1e-15
                    continue
                steps = np.diff(tendon.lam)
                assert (steps >= 0).all()
                assert (np.abs(np.diff(np.log(tendon.T))) <= steps + 1e-13).all()
                assert stretched(g.sheath, tendon) / g.EA == pytest.approx(kinematic, rel=1e-9, abs=1e-14)


def test_more_reversals_than_the_memory_holds_cost_no_more_than_the_smallest_fold():
    """Ever smaller swings: the memory overflows, tensions stay within the documented bound of the exact ones."""
    p = K.params("m10_540", {"winding_strain": 0})
    turns = [0.0, 0.03]
    swing = 0.0024
    for k in range(4 * CAPACITY):
        turns.append(turns[-1] + swing * (-1) ** (k + 1))
        swing *= 0.86
    theirs = oracle(np.array(turns), 9.81, 2000, lambda x: 0.16 * 3 * math.pi * x, False, 1.1)
    ours = run(p, turns, 9.81)
    assert np.abs(ours[:, 1] / theirs[:, 1] - 1).max() < 0.03
    settled = run(p, [*turns, 0.02], 9.81)[-1]
    np.testing.assert_allclose(settled, run(p, [0.0, 0.03, 0.02], 9.81)[-1], rtol=1e-12)  # a full reversal forgets all


def test_piecewise_bend_of_equal_pieces_is_the_uniform_bend():
    s_in = FORWARD_BACK_INNER
    whole = run(K.params("m05_540"), s_in, 4.905)
    pieces = {f"L_{i}": L / 8 for i in range(1, 9)} | {f"R_{i}": 0.5 / math.pi for i in range(1, 9)}
    np.testing.assert_allclose(run(K.params("m05_540", {"n_seg": 8, **pieces}), s_in, 4.905), whole, rtol=1e-10)


def test_alternating_bends_and_straights_tend_to_the_uniform_bend():
    """Half the length straight, bends twice as sharp: the finer the alternation, the closer to uniform."""
    s_in = FORWARD_BACK_INNER
    whole = run(K.params("m05_540", {"winding_strain": 0}), s_in, 4.905)
    distance = []
    for n in (2, 4, 8):
        values = {f"L_{i}": L / n for i in range(1, n + 1)}
        values |= {f"R_{i}": 0.25 / math.pi if i % 2 else 0.0 for i in range(1, n + 1)}
        distance.append(
            np.abs(run(K.params("m05_540", {"n_seg": n, "winding_strain": 0, **values}), s_in, 4.905) - whole)
        )
    largest = [d[:, 0].max() for d in distance]
    assert largest[1] < 0.6 * largest[0]
    assert largest[2] < 0.6 * largest[1]
