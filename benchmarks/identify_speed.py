"""Identification: compiled simulation against scipy's ``solve_ivp``, the fast method against the papers' one.

All sides solve equations of MMT 2015 on 20 000 samples. ``solve_ivp`` gets what favours it: motions in closed form
(a log would have to be interpolated at each call), scalar arithmetic from ``math``, and the loosest tolerance with
which it is as accurate as the kernel, on a grid of quarter decades.

The papers' method, differential evolution and then Nelder-Mead, runs on every tenth sample to count the simulations
it takes; on these the set of the fast fit to all samples must leave the same error, to 2 %. Its time on all samples
is that count times the measured time of one simulation, by the compiled kernel or by ``solve_ivp``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tsm_fmu.identify.fit import Fit, fit
from tsm_fmu.identify.problem import FitRun
from tsm_fmu.identify.specification import fit_parameters
from tsm_fmu.kernel import compile_kernel, kernel

from .ratio import Ratio, compare

ROWS = 20_000
EVERY = 10
SIMULATION_LIMIT = 1.0 / 100.0
FIT_LIMIT = 1.0 / 5.0
FIT_SOLVE_IVP_LIMIT = 1.0 / 100.0
SIGMA0, SIGMA1, SIGMA2, F_C, F_S, V_S = 58.574, 0.841, 0.872, 4.0, 5.94, 0.66  # MMT 2015, Section 3.2, per radian
SAME = 1.02
FORCE = 5.038  # sigma0 of the modified model
REASON = "on a smooth motion solve_ivp steps over a hundred samples, a record loop takes each one"
TOLERANCES = 10.0 ** -np.arange(2.0, 8.0, 0.25)

Array = NDArray[np.float64]
Solved = Callable[[Array, str, float], Array]


def ratios() -> Iterator[Ratio]:
    """Simulation, then fit.

    Raises
    ------
    RuntimeError
        If the two sides do not agree as far as the comparison needs.
    """
    time = np.linspace(0.0, 20.0, ROWS)
    yield from _simulation(time)
    yield from _fit(time)


def _speed(t: float) -> float:
    return 1.2 * math.cos(1.257 * t) + 0.4 * math.cos(3.1 * t)


def _acceleration(t: float) -> float:
    return -1.2 * 1.257 * math.sin(1.257 * t) - 0.4 * 3.1 * math.sin(3.1 * t)


def _sampled(signal: Callable[[float], float], time: Array) -> Array:
    return np.array([signal(t) for t in time.tolist()])


def _lugre_rate(t: float, z: Array) -> float:
    """MMT 2015 Eqs (2), (3)."""
    v = _speed(t)
    return v - SIGMA0 * abs(v) * z[0] / (F_C + (F_S - F_C) * math.exp(-((v / V_S) ** 2)))


def _lugre(time: Array, method: str, rtol: float, step: float = math.inf) -> Array:
    z = _state(_lugre_rate, time, method, rtol, step)
    v = 1.2 * np.cos(1.257 * time) + 0.4 * np.cos(3.1 * time)
    rate = v - SIGMA0 * np.abs(v) * z / (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2)))
    return SIGMA0 * z + SIGMA1 * rate + SIGMA2 * v


def _modified_rate(t: float, zeta: Array) -> float:
    """MMT 2015 Eqs (5)-(13) with |S|, other values than the published ones."""
    v, a = _speed(t), _acceleration(t)
    if v >= 0.0:
        s = 2.31 - 1.43 * math.exp(-0.77 * v / (0.41 * abs(a) + 1.0))
        s += 0.53 * (1.0 - math.exp(-1.9 * abs(a))) if a <= 0.0 else 0.0
    else:
        s = abs(1.13 - math.copysign(0.57, a) * math.exp(0.83 * v / (abs(a) + 1.18)))
    w = v + math.copysign(0.083, a)
    return 9.7 * (w - abs(w) * zeta[0] / s * abs(zeta[0] / s))


def _modified(time: Array, method: str, rtol: float, step: float = math.inf) -> Array:
    return FORCE * _state(_modified_rate, time, method, rtol, step)


def _state(rate: Callable[[float, Array], float], time: Array, method: str, rtol: float, step: float) -> Array:
    span = (time[0], time[-1])
    return solve_ivp(rate, span, [0.0], t_eval=time, method=method, rtol=rtol, atol=1e-3 * rtol, max_step=step).y[0]


def _as_accurate(solved: Solved, time: Array, method: str, truth: Array, error: float) -> float:
    """Loosest relative tolerance with which ``solve_ivp`` is as accurate as the kernel."""
    for rtol in TOLERANCES.tolist():
        if float(np.std(solved(time, method, rtol) - truth)) <= error:
            return rtol
    raise RuntimeError(f"solve_ivp {method} does not reach the error {error:g} N of the kernel")


def _simulation(time: Array) -> Iterator[Ratio]:
    model = kernel("LuGreFriction")
    p = model.params("mmt2015")
    inputs = _sampled(_speed, time)[:, None]
    truth = _lugre(time, "LSODA", 1e-10)
    simulated = model.simulate(p, time, inputs)
    error = float(np.sqrt(np.mean((simulated[:, 0] - truth)[1:] ** 2)))
    run = compile_kernel(model.module).run
    for method in ("RK45", "LSODA"):
        rtol = _as_accurate(_lugre, time, method, truth, error)
        ours: dict[str, Callable[[], object]] = {
            "simulate": lambda: model.simulate(p, time, inputs),
            "record loop": lambda: run(p, time, inputs, simulated),
        }
        for name, call in ours.items():
            row = compare(
                f"LuGre {name} / solve_ivp {method} {rtol:.0e}",
                call,
                lambda method=method, rtol=rtol: _lugre(time, method, rtol),
                ROWS,
                SIMULATION_LIMIT,
                rounds=11,
            )
            yield row._replace(reason=REASON)


def _fit(time: Array) -> Iterator[Ratio]:
    model = kernel("SingleTsmLuGre")
    truth = _modified(time, "RK45", 1e-7, step=0.01)
    columns = {"v": _sampled(_speed, time), "a": _sampled(_acceleration, time)}
    inputs = np.column_stack([columns.get(variable.name, np.full(ROWS, 20.0)) for variable in model.inputs])
    noise = np.random.default_rng(13).normal(0.0, 0.05, ROWS)
    run = FitRun("all samples", time, inputs, (truth + noise)[:, None])
    few = FitRun("few", *(np.ascontiguousarray(a[::EVERY]) for a in (run.time, run.inputs, run.targets)))
    fixed = ["R", "zeta_0", "sigma0"]  # sigma0 only scales rho, S and zeta: the data do not know it

    def timed(data: FitRun, method: str) -> tuple[Fit, float]:
        begin = perf_counter()
        result = fit(model, [data], ("F",), fit_parameters(model, fixed=fixed), method=method)
        return result, perf_counter() - begin

    model.simulate(model.params(), time, inputs)  # compiles
    fast, ours = timed(run, "fast")
    paper, _ = timed(few, "paper")
    p = model.params(values={v.name: v.kind(fast.parameters[v.field].value) for v in model.parameters})
    again = float(np.sqrt(np.mean((model.simulate(p, few.time, few.inputs)[:, 0] - few.targets[:, 0]) ** 2)))
    if again > SAME * paper.measured["F"].rmse:
        raise RuntimeError(f"fast leaves {again:g} N where paper leaves {paper.measured['F'].rmse:g} N")
    error = float(np.sqrt(np.mean((model.simulate(p, time, inputs)[:, 0] - truth)[1:] ** 2)))
    rtol = _as_accurate(_modified, time, "RK45", truth, error)
    compiled = _seconds(lambda: model.simulate(p, time, inputs), 20) * paper.evaluations
    solved = _seconds(lambda: _modified(time, "RK45", rtol), 3) * paper.evaluations
    free = sum(parameter.vary for parameter in paper.parameters.values())
    us = 1e6 / ROWS
    count = f"{paper.evaluations} simulations"
    yield Ratio(f"fit, {free} of 13: fast / paper, {count}", us * ours, us * compiled, ours / compiled, FIT_LIMIT)
    yield Ratio(f"the same by solve_ivp RK45 {rtol:.0e}", us * ours, us * solved, ours / solved, FIT_SOLVE_IVP_LIMIT)


def _seconds(call: Callable[[], object], times: int) -> float:
    """Shortest of several: what the machine's other work does not touch."""
    best = math.inf
    for _ in range(times):
        begin = perf_counter()
        call()
        best = min(best, perf_counter() - begin)
    return best
