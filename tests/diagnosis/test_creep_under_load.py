"""A tendon that goes on stretching under its load: where the law has a place, and that it is told from elasticity."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tsm_fmu as tsm
from tsm_fmu.diagnosis.fits.placing import places_of_effect
from tsm_fmu.effects import creep
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.drives import Drive
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

TENSION = Drive("load", "T_in", "N")


def stretched(time: np.ndarray, load: np.ndarray, before: float = 1.0) -> np.ndarray:
    """Three Kelvin-Voigt elements in series, integrated: not the one exponential of the library.

    ``before`` is the part of the first load that they have stretched for when the run begins.
    """
    taus, parts = np.array([0.9, 1.7, 3.1]), np.array([0.5, 0.3, 0.2])

    def rate(t: float, stretch: np.ndarray) -> np.ndarray:
        return (np.interp(t, time, load) - stretch) / taus

    found = solve_ivp(rate, (time[0], time[-1]), np.full(3, before * load[0]), t_eval=time, max_step=0.02)
    return parts @ found.y


def rig_run(name: str, seed: int, compliance: float, at_once: float, hung_up: bool = False) -> Record:
    """A run under a load that changes, or under a weight of its own that is hung up as the run begins."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 40.0, 0.02)
    x = 0.83 * np.sin(rng.uniform(0.8, 1.1) * t) + 0.31 * np.sin(rng.uniform(2.1, 2.9) * t + 1.3)
    levels = np.full(11, rng.uniform(0.6, 1.9)) if hung_up else rng.uniform(0.2, 1.9, 11)
    load = np.interp(t, np.arange(0.0, 44.0, 4.0), levels)
    model = kernel("PairedTsmBacklash")
    y = model.simulate(model.params(None, {"c": 0.913, "beta": -0.377, "alpha": 17.3, "x_0": 0.21}), t, x[:, None])[
        :, 0
    ]
    late = stretched(t, load, 0.0 if hung_up else 1.0)
    y = y - compliance * late - at_once * load + 1.1e-3 * rng.standard_normal(t.size)
    return Record(name, t, {"x_in": x, "x_out": y, "T_tip": load}, {"x_in": "rad", "x_out": "rad", "T_tip": "N"})


@pytest.mark.parametrize(("compliance", "at_once", "named"), [(0.043, 0.0, "creep"), (0.0, 0.043, "tendon_elasticity")])
def test_what_comes_late_is_creep_and_what_comes_at_once_elasticity(
    compliance: float, at_once: float, named: str
) -> None:
    runs = [rig_run(f"run {k}", 71 + k, compliance, at_once) for k in range(4)]
    found = tsm.diagnose("PairedTsmBacklash", runs[:3], holdout=runs[3:])
    assert found.verdict == "named", found.answer
    assert [e.partition("@")[0] for e in found.effects] == [named]


def test_a_weight_that_is_hung_up_as_each_run_begins_makes_a_creep_and_no_drift_of_a_sensor() -> None:
    runs = [rig_run(f"run {k}", 613 + k, 0.057, 0.0, hung_up=True) for k in range(4)]
    found = tsm.diagnose("PairedTsmBacklash", runs[:3], holdout=runs[3:])
    assert found.verdict == "named", found.answer
    assert [e.partition("@")[0] for e in found.effects] == ["creep"]


def test_a_load_makes_nothing_creep_but_a_position() -> None:
    specs = {a.spec for a in places_of_effect(kernel("TendonDrive"), creep, ("x_out", "tau_in"), (TENSION,))}
    assert specs == {"creep", "creep@x_out", "creep@x_out~T_in[N]"}
    model = chain("TendonDrive", ("creep",))
    time = np.arange(900) * 0.01
    inputs = np.column_stack([0.7 * np.sin(time), 0.4 + 0.3 * np.cos(2.3 * time)])
    plain, loaded = (
        model.simulate(model.params(None, {"creep.C": c, "creep.tau": 0.7}), time, inputs) for c in (0.0, 0.9)
    )
    assert np.array_equal(plain, loaded)
    without = chain("PairedTsmBacklash", ("creep@x_out",))  # it has no load
    still, moved = (
        without.simulate(without.params(None, {"x_out.creep.C": c}), time, inputs[:, :1]) for c in (0.0, 0.9)
    )
    assert np.array_equal(still, moved)
