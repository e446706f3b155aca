"""Every friction and motion model finds the parameters that an independent implementation planted.

The truth is the printed equation, written here and integrated by scipy over inputs that hold from sample to sample;
on it lie coloured noise and the steps of an encoder or of an A/D converter. Every parameter that the output can
tell is free (but for Bouc-Wen, whose sets coincide); what is fixed, and why, stands with each case.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import pytest
import rig
from scipy.integrate import solve_ivp

from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import search_space

Array = np.ndarray
SHORT, LONG = (np.arange(0.0, seconds, 1.0 / rig.RATE) for seconds in (8.0, 24.0))
MISSED = 4.0
"""Standard errors beyond which a value counts as not recovered: over forty values are judged."""
SHARP = 0.35
"""Largest standard error, over the value, that still tells something."""


def integrated(time: Array, rate: Callable[[int, float], float]) -> Array:
    """State at each row; ``rate(k, state)`` has the inputs of row k, which hold over the step that ends there."""
    state = np.zeros(time.size)
    for k in range(1, time.size):
        run = solve_ivp(
            lambda _, y, k=k: [rate(k, float(y[0]))], (0.0, 1.0 / rig.RATE), [state[k - 1]], rtol=1e-6, atol=1e-10
        )
        state[k] = run.y[0, -1]
    return state


def motion(time: Array, size: float, slow: float, fast: float) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration of two sines whose periods do not divide."""
    w = np.array([slow, fast])
    share = size * np.array([0.63, 0.37])
    angle = np.outer(time, w) + np.array([0.3, 1.1])
    return (np.sin(angle) @ share, np.cos(angle) @ (share * w), -np.sin(angle) @ (share * w * w))


def held(a: Array) -> Array:
    """Sign of the acceleration; the motion above never has a = 0 in a row."""
    return np.sign(a)


class Case(NamedTuple):
    """Planted values, values that are known and fixed, the data before noise, and their length.

    The fit of a case with ``many`` starts knows only the model; the others start at the published set.
    """

    model: str
    channel: str
    planted: Mapping[str, float]
    known: Mapping[str, float]
    data: Callable[[Mapping[str, float], Array], tuple[dict[str, Array], Array]]
    time: Array = SHORT
    many: bool = True


def pull_and_release(p: Mapping[str, float], v: Array, a: Array, swap: bool) -> tuple[Array, Array]:
    """Sliding levels of ICINCO 2013 Eqs (2a)-(2d); with ``swap`` the pull branches of MMT 2015 Eqs (7), (8)."""
    grows = (a <= 0.0) if swap else (a >= 0.0)
    pull = p["rho1"] + p["mu1"] * np.exp(-p["kappa1"] * abs(v) / (p["kappa2"] * abs(a) + 1.0))
    pull = pull + np.where(grows, p["mu2"] * (1.0 - np.exp(-p["kappa3"] * abs(a))), 0.0)
    release = p["rho2"] - held(a) * p["mu3"] * np.exp(-p["kappa4"] * abs(v) / (abs(a) + p["kappa5"]))
    return pull, release


def dahl(p: Mapping[str, float], time: Array) -> tuple[dict[str, Array], Array]:
    """ICINCO 2013 Eqs (4), (5)."""
    _, v, a = motion(time, 0.0113, 2.3, 5.9)
    pull, release = pull_and_release(p, v, a, swap=False)
    level = np.where(v >= 0.0, pull, release)
    zeta = integrated(time, lambda k, z: v[k] - p["sigma"] * abs(v[k]) * z / level[k])
    return {"v": v, "a": a}, p["sigma"] * zeta


def bouc_wen(
    p: Mapping[str, float], time: Array, slow: float = 2.3, fast: float = 5.9
) -> tuple[dict[str, Array], Array]:
    """IFToMM 2013 Eqs (1)-(3)."""
    _, v, a = motion(time, 0.0113, slow, fast)
    pull = p["rho1"] + p["mu1"] * np.exp(-p["kappa1"] * abs(v) / (p["kappa2"] * abs(a) + 1.0))
    pull = pull + np.where(a >= 0.0, p["mu2"] * (1.0 - np.exp(-p["kappa3"] * abs(a))), 0.0)
    release = p["rho2"] + p["mu3"] * np.exp(-p["kappa4"] * abs(v))
    release = release - held(a) * p["mu4"] * np.exp(-p["kappa5"] * abs(v) / (abs(a) + p["kappa6"]))
    level = np.where(v >= 0.0, pull, release)
    return {"v": v, "a": a}, integrated(time, lambda k, f: p["k"] * shape(v[k], f / level[k], p["sigma"], p["n"]))


def shape(w: float, r: float, sigma: float, n: float) -> float:
    """Right side of Bouc-Wen: IFToMM 2013 Eq (2), MSSP 2015 Eq (6)."""
    return w - sigma * abs(w) * abs(r) ** (n - 1.0) * r + (sigma - 1.0) * w * abs(r) ** n


def modified_lugre(p: Mapping[str, float], time: Array) -> tuple[dict[str, Array], Array]:
    """MMT 2015 Eqs (5)-(13), |S|."""
    _, v, a = motion(time, 1.13, 1.3, 3.1)
    pull, release = pull_and_release(p, v, a, swap=True)
    s = np.abs(np.where(v >= 0.0, pull, release))
    w = v + p["lambda"] * held(a)
    zeta = integrated(time, lambda k, z: p["rho"] * (w[k] - abs(w[k]) * z / s[k] * abs(z / s[k])))
    return {"v": v, "a": a}, p["sigma0"] * zeta


def lugre_state(p: Mapping[str, float], time: Array, v: Array, coulomb: str, static: str) -> Array:
    """LuGre force, AME 2020 Eq (40)."""
    g = p[coulomb] + (p[static] - p[coulomb]) * np.exp(-((v / p["v_s"]) ** 2))
    z = integrated(time, lambda k, z: v[k] - p["sigma0"] * abs(v[k]) * z / g[k])
    return p["sigma0"] * z + p["sigma1"] * (v - p["sigma0"] * abs(v) * z / g) + p["sigma2"] * v


def lugre(p: Mapping[str, float], time: Array) -> tuple[dict[str, Array], Array]:
    _, v, _ = motion(time, 1.13, 1.3, 3.1)
    return {"v": v}, lugre_state(p, time, v, "F_c", "F_s")


def paired(p: Mapping[str, float], time: Array) -> tuple[dict[str, Array], Array]:
    """MSSP 2015 Eqs (6), (7), with the quotient of exponentials as printed."""
    x, v, a = motion(time, 1.13, 1.3, 3.1)
    w = v + p["lambda"] * held(a)
    zeta = integrated(time, lambda k, z: p["rho"] * shape(w[k], z, p["sigma"], p["n"]))
    up, down = np.exp(v), np.exp(-v)
    k_x = 0.5 * p["k_x"] * (2.0 * up + 2.0 * down * np.sign(x) * held(a)) / (up + down)
    force = k_x * x + p["k_zeta"] * zeta + p["upsilon"] * v + p["F_0"]
    return {"x": x, "v": v, "a": a}, p["force_scale"] * force


def drive(p: Mapping[str, float], time: Array) -> tuple[dict[str, Array], Array]:
    """LuGre on the speed of the straight line between samples, and the load through the ratio."""
    x, _, _ = motion(time, 1.13, 1.3, 3.1)
    v = np.concatenate([[0.0], np.diff(x) * rig.RATE])
    load = 0.31 * np.sin(0.71 * time) + 0.07
    return {"x_in": x, "tau_out": load}, p["ratio"] * load + lugre_state(p, time, v, "tau_c", "tau_s")


CASES = (
    Case(
        "SingleTsmDahl",
        "F",
        {
            **{"rho1": 2.137, "rho2": 3.911, "mu1": 1.413, "mu2": 1.517, "mu3": -1.783, "sigma": 11730.0},
            **{"kappa1": 173.0, "kappa2": 1231.0, "kappa3": 14.7, "kappa4": 0.731, "kappa5": 5.1e-3},
        },
        {},
        dahl,
        LONG,
        many=False,
    ),
    Case(
        "SingleTsmLuGre",
        "F",
        {
            **{"rho1": 2.831, "rho2": 1.473, "mu1": -1.693, "mu2": 0.517, "mu3": 0.871, "rho": 8.317},
            **{"kappa1": 0.871, "kappa2": 0.4104, "kappa3": 2.345, "kappa4": 0.783, "kappa5": 1.18, "lambda": 0.0773},
        },
        {"sigma0": 5.038},  # scales rho1, rho2, mu1..3 and zeta: F does not tell
        modified_lugre,
        LONG,
        many=False,
    ),
    Case(
        "SingleTsmLuGre",
        "F",
        {"rho1": 2.831, "rho2": 1.473, "mu1": -1.693, "mu2": 0.517, "mu3": 0.871, "rho": 8.317, "lambda": 0.0773},
        {"kappa1": 0.871, "kappa2": 0.4104, "kappa3": 2.345, "kappa4": 0.783, "kappa5": 1.18, "sigma0": 5.038},
        modified_lugre,  # the decays held, as from an earlier fit: many starts over seven values are quick
    ),
    Case(
        "LuGreFriction",
        "F",
        {"sigma0": 53.71, "sigma1": 0.937, "sigma2": 0.791, "F_c": 4.173, "F_s": 6.217, "v_s": 0.583},
        {},
        lugre,
    ),
    Case(
        "PairedTsmFriction",
        "F",
        {
            **{"rho": 21.37, "lambda": -0.0937, "sigma": 1.617, "n": 1.873},
            **{"k_x": 11.37, "k_zeta": 113.7, "upsilon": 23.9, "F_0": 1.737},
        },
        {"force_scale": 0.04, "R": 0.025},  # the first scales k_x, k_zeta, upsilon and F_0, the second acts on torques
        paired,
        many=False,
    ),
    Case(
        "TendonDrive",
        "tau_in",
        {
            **{"ratio": 1.0713, "sigma0": 2.113, "sigma1": 0.0119, "sigma2": 0.0317},
            **{"tau_c": 0.1037, "tau_s": 0.1591, "v_s": 0.483},
        },
        # all but tau_v, a filter that is off here, act on x_out alone (test_fit recovers them)
        {"c": 1.0, "beta": -0.9, "alpha": 10.0, "x_0": 0.0, "x_h_0": 0.0, "tau_v": 0.0},
        drive,
        many=False,
    ),
)


def noisy(clean: Array, seed: int) -> Array:
    """Coloured noise of half a percent of the range, then a converter of ten bits over it."""
    size = float(np.ptp(clean))
    step = size / 1024.0
    return step * np.round((clean + rig.coloured(clean.size, 0.005 * size, seed)) / step)


def recovered(case: Case, seed: int) -> tuple[Fit, Array]:
    """The fit, and what was added to the clean data."""
    model = kernel(case.model)
    assert not case.planted.keys() & case.known.keys()
    columns, clean = case.data({**case.planted, **case.known}, case.time)
    inputs = np.column_stack([columns.get(v.name, np.zeros(case.time.size)) for v in model.inputs])
    targets = noisy(clean, seed)
    fixed = [v.name for v in model.parameters if v.name not in case.planted]
    parameters = search_space(model, values=case.known, fixed=fixed)
    run = FitRun(case.model, case.time, inputs, targets[:, None])
    return fit(model, [run], (case.channel,), parameters, single_start=not case.many), targets - clean


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.model}-{len(case.planted)}")
def test_planted_parameters_are_recovered_within_their_intervals(case: Case) -> None:
    result, added = recovered(case, 71)
    fields = {v.name: v.field for v in result.kernel.parameters}
    missed = {}
    for name, true in case.planted.items():
        p = result.parameters[fields[name]]
        assert p.stderr is not None, name
        if abs(p.value - true) > MISSED * p.stderr or p.stderr > SHARP * abs(true):
            missed[name] = (true, p.value, p.stderr)
    assert missed == {}
    assert not set(result.at_bound) & set(fields.values())
    rmse, noise = result.measured[case.channel].rmse, float(np.sqrt(np.mean(added**2)))
    assert 0.9 * noise < rmse < 1.001 * noise  # the planted set leaves the noise: the best leaves no more


def test_bouc_wen_is_recovered_by_its_response() -> None:
    """Many parameter sets of Bouc-Wen nearly coincide (IFToMM 2013): what counts is the force on another motion."""
    planted = {"rho1": 1.137, "rho2": 2.371, "mu1": -0.613, "mu2": 0.917, "k": 1317.0, "sigma": 3.173, "n": 1.871}
    known = {
        "mu3": 0.452,
        "mu4": 0.575,
        "kappa1": 341.0,
        "kappa2": 77.7,
        "kappa3": 16.3,
        "kappa4": 3329.0,
        "kappa5": 5.224,
        "kappa6": 5.5e-3,
    }
    result, added = recovered(Case("SingleTsmBoucWen", "F", planted, known, bouc_wen), 72)
    model = kernel("SingleTsmBoucWen")
    columns, clean = bouc_wen({**planted, **known}, SHORT, 3.1, 4.3)
    inputs = np.column_stack([columns.get(v.name, np.zeros(SHORT.size)) for v in model.inputs])
    p = model.params(values={v.name: result.parameters[v.field].value for v in model.parameters})
    error = float(np.sqrt(np.mean((model.simulate(p, SHORT, inputs)[:, 0] - clean) ** 2)))
    assert error < 0.5 * float(np.std(added))
    assert error < 0.005 * float(np.ptp(clean))
