"""Steps chosen by their error, against closed forms; reversals where they are; what cannot go back is refused."""

import math
import re

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu import InputError
from tsm_fmu.card import CardParameter, Correlation, ModelCard
from tsm_fmu.cosim.cases import with_values
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels.kernel import kernel


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """A motor whose load is a spring, in native code: it saves its state."""
    folder = tmp_path_factory.mktemp("variable")
    models = ("DcMotor", "RotationalLoad", "ReferenceSignal")
    return {m: build_fmu(kernel(m), folder, flavour="native", platforms=loaded_here()) for m in models}


def oscillator(plant):
    """Motor without friction or back-EMF on a spring."""
    return System(
        (
            Component("motor", plant["DcMotor"], {"u": 3.7}),
            Component("load", plant["RotationalLoad"], {"k": 0.53, "d": 0.0}),
        ),
        (Connection("motor.phi", "load.phi"), Connection("load.tau", "motor.tau_load")),
    )


def test_the_error_falls_with_the_error_that_is_asked_for(plant):
    system = oscillator(plant)
    exact = simulate_system(system, 0.5, 1e-6, decimation=10_000, record=["motor.phi"]).columns["motor.phi"]
    size = np.max(np.abs(exact))
    errors = []
    for step_error in (1e-4, 1e-6):
        run = simulate_system(system, 0.5, 1e-2, record=["motor.phi"], step_error=step_error)
        errors.append(np.max(np.abs(run.columns["motor.phi"] - exact)) / size)
        assert np.array_equal(run.time, np.linspace(0.0, 0.5, 51))
    fixed = simulate_system(system, 0.5, 1e-2, record=["motor.phi"]).columns["motor.phi"]
    assert errors[0] < 0.3 * np.max(np.abs(fixed - exact)) / size
    # error of a step ~ step^2, of the run ~ step: a hundredth of the one gives a tenth of the other
    assert 0.5 < math.log10(errors[0] / errors[1]) < 1.6


def test_points_of_a_sweep_choose_their_steps(plant, tmp_path):
    path = write_ssp(tmp_path / "oscillator.ssp", (oscillator(plant), Experiment(0.5, 1e-2)))
    grid = {"load.k": [0.53, 1.31]}
    fixed, chosen = (
        [point.metrics["motor.phi.std"].value for point in tsm.sweep(path, grid, workers=1, **how).points]
        for how in ({}, {"step_error": 1e-5})
    )
    for k, rough, near in zip(grid["load.k"], fixed, chosen, strict=True):
        system = with_values({"one": (oscillator(plant), Experiment(0.5, 2e-5))}, {"load.k": str(k)})["one"][0]
        exact = np.std(simulate_system(system, 0.5, 2e-5, decimation=500).columns["motor.phi"])
        assert abs(near - exact) < 0.1 * abs(rough - exact)


def test_draws_of_a_card_choose_their_steps(plant, tmp_path):
    path = write_ssp(tmp_path / "oscillator.ssp", (oscillator(plant), Experiment(0.5, 1e-2)))
    values = {"k": CardParameter(0.53, "N.m/rad", 0.04), "d": CardParameter(0.0, "N.m.s/rad")}
    correlation = Correlation(("k",), ((1.0,),))
    card = ModelCard("RotationalLoad", parameters=values, correlation=correlation)
    given = {"cards": {"load": card}, "draws": 3, "seed": 7, "signal": "motor.phi", "workers": 1}
    fixed, chosen = (tsm.monte_carlo(path, **given, **how) for how in ({}, {"step_error": 1e-5}))
    assert [p.values for p in fixed.draws] == [p.values for p in chosen.draws]
    for rough, near in zip(fixed.draws, chosen.draws, strict=True):
        k = str(near.values["load.k"])
        system = with_values({"one": (oscillator(plant), Experiment(0.5, 2e-5))}, {"load.k": k})["one"][0]
        exact = np.std(simulate_system(system, 0.5, 2e-5, decimation=500, record=["motor.phi"]).columns["motor.phi"])
        errors = [abs(p.metrics["motor.phi.std"].value / exact - 1.0) for p in (rough, near)]
        assert errors[1] < 0.2 * errors[0]


def test_few_long_steps_where_nothing_happens(plant):
    said = simulate_system(oscillator(plant), 0.5, 1e-2, step_error=1e-4).messages
    found = re.search(r"variable step: (\d+) steps of (\S+) to (\S+) s, (\d+) rolled back", " ".join(said))
    assert found is not None
    assert float(found[2]) < float(found[3]) <= 1e-2
    assert int(found[1]) < 0.5 / float(found[2])


def test_reversals_are_located(plant):
    # 0.37 sin(2 pi 1.3 t) turns back at (1 + 2 n) / (4 1.3)
    wave = {"kind": 1, "amplitude_1": 0.37, "frequency_1": 1.3}
    system = System((Component("r", plant["ReferenceSignal"], wave),), ())
    said = simulate_system(system, 1.2, 5e-2, step_error=1e-3).messages
    times = [float(t) for t in re.findall(r"r\.y at (\S+) s", next(m for m in said if m.startswith("reversals")))]
    assert times == pytest.approx([(1 + 2 * n) / (4 * 1.3) for n in range(len(times))], abs=1e-4)
    assert len(times) == 3


def test_what_cannot_be_rolled_back_is_refused_by_name(foreign, plant):
    system = System((Component("x", foreign["integrator"], {"u": 1.0}),), ())
    with pytest.raises(InputError, match=r"variable step: x \(.*\.fmu\) cannot save its state -- expected FMUs"):
        simulate_system(system, 1.0, 0.1, step_error=1e-3)
    for wrong in (0.0, -1.0, math.nan, 1.0):
        with pytest.raises(InputError, match=r"step error .* -- expected a number between 0 and 1"):
            simulate_system(oscillator(plant), 1.0, 0.1, step_error=wrong)
