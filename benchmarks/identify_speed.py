"""Identification: compiled simulation against scipy's ``solve_ivp``, the fast method against the papers' one.

The fit is that of the 13-parameter model of MMT 2015 to 20 000 samples that scipy made from the paper's equations;
both methods use the compiled kernel, and the fast one must end at an error at least as low.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tsm_fmu.identify.fit import Fit, fit
from tsm_fmu.identify.problem import FitRun
from tsm_fmu.identify.specification import fit_parameters
from tsm_fmu.kernel import kernel

from .ratio import Ratio, compare

ROWS = 20_000
SIMULATION_LIMIT = 1.0 / 100.0
FIT_LIMIT = 1.0 / 5.0
SIGMA0, SIGMA1, SIGMA2, F_C, F_S, V_S = 58.574, 0.841, 0.872, 4.0, 5.94, 0.66  # MMT 2015, Section 3.2, per radian


def ratios() -> Iterator[Ratio]:
    """Simulation, then fit.

    Raises
    ------
    RuntimeError
        If the two sides do not agree as far as the comparison needs.
    """
    time = np.linspace(0.0, 20.0, ROWS)
    yield _simulation(time)
    yield _fit(time)


def _speed(time: NDArray[np.float64] | float) -> NDArray[np.float64]:
    return np.asarray(1.2 * np.cos(1.257 * time) + 0.4 * np.cos(3.1 * time))


def _slope(time: float, z: NDArray[np.float64]) -> NDArray[np.float64]:
    v = float(_speed(time))
    return v - SIGMA0 * abs(v) * z / (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2)))


def _friction(time: NDArray[np.float64], rtol: float) -> NDArray[np.float64]:
    v = _speed(time)
    z = solve_ivp(_slope, (time[0], time[-1]), [0.0], t_eval=time, method="LSODA", rtol=rtol, atol=1e-3 * rtol).y[0]
    rate = v - SIGMA0 * abs(v) * z / (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2)))
    return SIGMA0 * z + SIGMA1 * rate + SIGMA2 * v


def _simulation(time: NDArray[np.float64]) -> Ratio:
    model = kernel("LuGreFriction")
    p = model.params("mmt2015")
    inputs = _speed(time)[:, None]
    truth = _friction(time, 1e-10)
    own = float(np.sqrt(np.mean((model.simulate(p, time, inputs)[:, 0] - truth)[1:] ** 2)))
    rtol = next((r for r in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7) if np.std(_friction(time, r) - truth) <= own), None)
    if rtol is None:
        raise RuntimeError(f"solve_ivp does not reach the error {own:g} N of the kernel")
    return compare(
        f"LuGreFriction compiled / solve_ivp (rtol {rtol:g})",
        lambda: model.simulate(p, time, inputs),
        lambda: _friction(time, rtol),
        ROWS,
        SIMULATION_LIMIT,
        rounds=5,
    )


def _modified_lugre(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """MMT 2015 Eqs (5)-(13) with |S|, other values than the published ones."""

    def slope(t: float, zeta: NDArray[np.float64]) -> NDArray[np.float64]:
        v = float(_speed(t))
        a = float(-1.2 * 1.257 * np.sin(1.257 * t) - 0.4 * 3.1 * np.sin(3.1 * t))
        s = 2.31 - 1.43 * np.exp(-0.77 * abs(v) / (0.41 * abs(a) + 1.0))
        s += 0.53 * (1.0 - np.exp(-1.9 * abs(a))) if a <= 0.0 else 0.0
        if v < 0.0:
            s = abs(1.13 - np.sign(a) * 0.57 * np.exp(-0.83 * abs(v) / (abs(a) + 1.18)))
        w = v + 0.083 * np.sign(a)
        return 9.7 * (w - abs(w) * zeta / s * abs(zeta / s))

    return 5.038 * solve_ivp(slope, (time[0], time[-1]), [0.0], t_eval=time, rtol=1e-7, atol=1e-9, max_step=0.01).y[0]


def _fit(time: NDArray[np.float64]) -> Ratio:
    model = kernel("SingleTsmLuGre")
    v = _speed(time)
    columns = {"v": v, "a": np.gradient(v, time), "T_in": np.full(ROWS, 20.0), "T_load": np.full(ROWS, 20.0)}
    inputs = np.column_stack([columns[variable.name] for variable in model.inputs])
    noise = np.random.default_rng(13).normal(0.0, 0.05, ROWS)
    run = FitRun("mmt", time, inputs, (_modified_lugre(time) + noise)[:, None])
    fixed = ["R", "zeta_0", "sigma0"]  # sigma0 only scales rho, S and zeta: the data do not know it

    def timed(method: str) -> tuple[Fit, float]:
        begin = perf_counter()
        result = fit(model, [run], ("F",), fit_parameters(model, fixed=fixed), method=method)
        return result, 1e6 * (perf_counter() - begin) / ROWS

    timed("fast")  # compiles
    fast, ours = timed("fast")
    paper, reference = timed("paper")
    if fast.measured["F"].rmse > 1.001 * paper.measured["F"].rmse:
        raise RuntimeError(f"fast ends at {fast.measured['F'].rmse:g} N, paper at {paper.measured['F'].rmse:g} N")
    return Ratio("13-parameter fit: fast / paper, per sample", ours, reference, ours / reference, FIT_LIMIT)
