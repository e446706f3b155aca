"""Force loop of one tendon-sheath mechanism: FMUs in co-simulation against the printed equations, integrated here."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tsm_fmu.cosim.cases import run_cases, statistics
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import single_tsm_force as scenario

STOP = {"dahl.1_hz": 1.5, "dahl.08_hz": 2.0, "bouc_wen.multi_periodic": 6.0, "modified_lugre.periodic": 7.5}
R_MM = 25.0


@pytest.fixture(scope="module")
def cases(native_fmus):
    return scenario.cases({name: native_fmus(name) for name in scenario.FMUS})


def cut(case, stop, step=None):
    system, experiment = case
    return system, replace(experiment, stop=stop, step=step or experiment.step)


def dahl(levels):
    """ICINCO 2013, Eqs (2), (4), (5) and Table 1, in mm."""
    rho1, rho2, mu1, mu2, mu3 = (levels * x for x in (2.097, 3.960, 1.368, 1.579, -1.855))

    def rate(f, v, a, sv, sa):
        if sv > 0:
            level = rho1 + mu1 * math.exp(-0.172 * abs(v) / (1.228 * abs(a) + 1))
            level += mu2 * (1 - math.exp(-0.016 * abs(a))) if sa > 0 else 0.0
        else:
            level = rho2 - sa * mu3 * math.exp(-5.549 * abs(v) / (abs(a) + 0.005))
        return 17.57 * (v - abs(v) * f / level)

    return rate


def bouc_wen(levels):
    """IFToMM 2013, Eqs (1)-(3), reading A of the two unnamed numbers, in mm."""
    rho1, rho2, mu1, mu2, mu3, mu4 = (levels * x for x in (0.8855, 1.548, -0.6533, 1.461, 0.452, 0.875))

    def rate(f, v, a, sv, sa):
        if sv > 0:
            level = rho1 + mu1 * math.exp(-0.341 * abs(v) / (0.0777 * abs(a) + 1))
            level += mu2 * (1 - math.exp(-0.0063 * abs(a))) if sa > 0 else 0.0
        else:
            level = rho2 + mu3 * math.exp(-3.329 * abs(v)) - sa * mu4 * math.exp(-5.224 * abs(v) / (abs(a) + 0.0055))
        r = f / level
        return v - 5.491 * abs(v) * abs(r) ** 1.952 * r + 4.491 * v * abs(r) ** 2.952

    return rate


def modified_lugre(levels, swapped=False):
    """MMT 2015, Eqs (5)-(8), (10), (11), (13) with |S|, in rad."""
    rho1, rho2, mu1, mu2, mu3 = (levels * x for x in (2.8642, 0.072, -1.772, 0.342, 0.9991))

    def rate(f, v, a, sv, sa):
        if sv > 0:
            level = rho1 + mu1 * math.exp(-0.084 * abs(v) / (0.4104 * abs(a) + 1))
            level += mu2 * (1 - math.exp(-9.345 * abs(a))) if (sa > 0) == swapped else 0.0
        else:
            level = abs(rho2 - sa * mu3 * math.exp(-0.1704 * abs(v) / (abs(a) + 1.1823)))
        z, w = f / 5.038, v + 0.156 * sa
        return 5.038 * 7.938 * (w - abs(w) * (z / level) * abs(z / level))

    return rate


def lugre(z, v, a, sv, sa):
    """MMT 2015, Eq (2) of the bristles with its published set."""
    return v - 58.574 * abs(v) * z / (4.0 + 1.94 * math.exp(-((v / 0.66) ** 2)))


def integrated(rate, sines, stop, time):
    """State from 0, integrated from one sign change of v, a to the next; ``rate(f, v, a, sign of v, sign of a)``."""

    def v(t):
        return sum(2 * math.pi * f * x * math.cos(2 * math.pi * f * t) for x, f in sines)

    def a(t):
        return -sum((2 * math.pi * f) ** 2 * x * math.sin(2 * math.pi * f * t) for x, f in sines)

    grid = np.linspace(1e-6, stop, 4001)
    turns = {0.0, stop}
    for signal in (v, a):
        values = np.array([signal(t) for t in grid])
        turns |= {brentq(signal, grid[k], grid[k + 1], xtol=1e-14) for k in np.flatnonzero(np.diff(np.sign(values)))}
    found, state = np.zeros(time.size), 0.0
    for begin, end in zip(sorted(turns)[:-1], sorted(turns)[1:], strict=True):
        middle = 0.5 * (begin + end)
        signs = math.copysign(1.0, v(middle)), math.copysign(1.0, a(middle))
        inside = (time > begin + 1e-12) & (time <= end + 1e-12)
        done = solve_ivp(
            lambda t, y, s=signs: [rate(y[0], v(t), a(t), *s)],
            (begin, end),
            [state],
            method="LSODA",
            rtol=1e-9,
            atol=1e-11,
            dense_output=True,
        )
        found[inside] = done.sol(np.minimum(time[inside], end))[0]
        state = done.y[0, -1]
    return found


ORACLES = {
    "dahl.1_hz": (dahl, ((5.0, 1.0),)),
    "dahl.08_hz": (dahl, ((5.0, 0.8),)),
    "bouc_wen.multi_periodic": (bouc_wen, ((3.0, 0.2), (2.0, 0.35))),
    "modified_lugre.periodic": (modified_lugre, ((1.0, 0.2),)),
}


@pytest.mark.parametrize("motion", ORACLES)
def test_friction_of_plant_and_wrong_estimator_converge_to_the_printed_equations(cases, motion):
    law, sines = ORACLES[motion]
    name, stop = f"{motion}.levels_110", STOP[motion]
    errors = []
    for step in (2.5e-3, 1.25e-3):
        (run,) = run_cases({name: cut(cases[name], stop, step)}, record=scenario.RECORD).values()
        plant = integrated(law(1.0), sines, stop, run.time)
        estimate = integrated(law(1.1), sines, stop, run.time)
        errors.append(
            [
                np.mean(np.abs(run.columns["plant.F"] - plant)),
                np.mean(np.abs(run.columns["estimator.F"] - estimate)),
                np.mean(np.abs(run.columns["error.y"] - (plant - estimate))),
            ]
        )
    coarse, fine = np.array(errors)
    # inputs are held over a step: first order, so halving the step halves the error (in the mean over the run)
    assert (np.array(coarse) > 1.6 * np.array(fine)).all(), (coarse, fine)
    assert (np.array(fine)[:2] < 0.02).all()


@pytest.mark.parametrize("motion", ORACLES)
def test_the_true_model_gives_the_tension_of_the_spring(cases, motion):
    name = f"{motion}.same"
    (run,) = run_cases({name: cut(cases[name], STOP[motion])}, record=scenario.RECORD).values()
    stiffness = scenario.SHEATHS[motion.partition(".")[0]].stiffness
    spring = scenario.T_MEAN + stiffness * scenario.R * run.columns["reference.y"]
    rounding = 8 * np.finfo(float).eps * np.max(run.columns["plant.T_drive"])
    np.testing.assert_allclose(run.columns["load.tau"] / scenario.R, spring, rtol=0, atol=rounding)
    balance = run.columns["load.tau"] / scenario.R + run.columns["plant.F"]
    np.testing.assert_allclose(run.columns["plant.T_drive"], balance, rtol=0, atol=rounding)
    assert np.max(np.abs(run.columns["error.y"])) <= rounding
    assert np.ptp(run.columns["plant.F"]) > 2.0
    assert run.columns["plant.T_drive"].min() > 0.0  # nothing goes slack


@pytest.mark.parametrize(("plant", "swapped"), [("modified_lugre", False), ("swapped_lugre", True)])
def test_published_lugre_set_against_the_modified_model(cases, plant, swapped):
    name = f"{plant}.periodic.lugre"
    case = cut(cases[name], 10.0)
    runs = run_cases({name: case}, record=scenario.RECORD)
    mse = statistics({name: case}, runs, scenario.quantities)[name].quantities["error_mse"].value
    (run,) = runs.values()
    sines = ((1.0, 0.2),)
    model = integrated(modified_lugre(1.0, swapped), sines, 10.0, run.time)
    z = integrated(lugre, sines, 10.0, run.time)
    v = 0.4 * np.pi * np.cos(0.4 * np.pi * run.time)
    slip = v - 58.574 * np.abs(v) * z / (4.0 + 1.94 * np.exp(-((v / 0.66) ** 2)))
    law = 58.574 * z + 0.841 * slip + 0.872 * v
    window = run.time >= 5.0 - 1e-9
    expected = np.mean((model - law)[window] ** 2)
    assert mse == pytest.approx(expected, rel=5e-3)  # first order in the 2 ms step
    bounds = [(math.sqrt(1.4538) - s * math.sqrt(0.027)) ** 2 for s in (1, -1)]
    assert bool(bounds[0] < expected < bounds[1]) is swapped
    assert bool(bounds[0] < mse < bounds[1]) is swapped


def test_a_symmetric_law_misses_what_the_model_knows(cases):
    names = [f"dahl.{motion}.{estimator}" for motion in ("1_hz", "08_hz") for estimator in ("lugre", "levels_110")]
    picked = {name: cut(cases[name], 10.0) for name in names}
    runs = run_cases(picked, record=scenario.RECORD)
    rms = {name: scenario.quantities(name, run)["error_rms"].value for name, run in runs.items()}
    level = picked["dahl.1_hz.lugre"][0].components[3].parameters["F_c"]
    force = runs["dahl.1_hz.lugre"].columns["plant.F"][2500:]
    assert level == pytest.approx(np.mean(np.abs(force)), rel=5e-3)
    for motion in ("1_hz", "08_hz"):
        assert rms[f"dahl.{motion}.lugre"] > 1.5 * rms[f"dahl.{motion}.levels_110"]


@pytest.mark.parametrize("motion", ["periodic", "non_periodic"])
def test_behind_a_motor_friction_is_the_kernels_on_its_motion_and_the_estimate_exact(cases, motion):
    name = f"modified_lugre.{scenario.DRIVEN}{motion}.same"
    record = [*scenario.RECORD, "motor.domega"]
    (run,) = run_cases({name: cut(cases[name], 4.0)}, record=record).values()
    c, law = run.columns, kernel("SingleTsmLuGre")
    inputs = np.column_stack([c["motor.omega"], c["motor.domega"], 0.0 * run.time, c["load.tau"] / scenario.R])
    outputs = law.simulate(law.params("published"), run.time, inputs)
    expected = dict(zip([v.name for v in law.outputs], outputs.T, strict=True))
    # the law holds what it was handed at the start of a step
    assert np.max(np.abs(c["plant.F"] - expected["F"])) < 1e-9
    np.testing.assert_allclose(c["plant.T_drive"], expected["T_drive"], atol=1e-9)
    assert np.max(np.abs(c["error.y"])) < 1e-12
    later = run.time > 0.5
    # the speed of 1.3 to 3 rad/s over the crossover of 60 rad/s bounds what it lags behind
    assert np.max(np.abs(c["motor.phi"] - c["reference.y"])[later]) < 3.0 / scenario.CROSSOVER
    assert np.max(np.abs(c["controller.u"])) < 24.0
