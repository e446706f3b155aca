"""Where time begins changes the times of the rows and nothing else, however an FMU is driven."""

from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.cosim.master import METHODS, simulate_system
from tsm_fmu.cosim.replay import replay
from tsm_fmu.cosim.ssp import open_ssp, write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.logs.record import Record

T0, STEP, ROWS = 17.3, 0.01, 24


def clocked(foreign: dict[str, Path]) -> System:
    """A decay, and a unit that tells the time at which each of its steps begins: angle_rad = 0.7 + t."""
    return System(
        (
            Component("x", foreign["integrator"], {"x_0": 1.3}),
            Component("g", foreign["gain"], {"k": -2.7, "u_2": 0.0}),
            Component("clock", foreign["units"], {"angle": 0.0, "speed": 0.0, "kelvin": 0.0}),
        ),
        (Connection("x.x", "g.u"), Connection("g.y", "x.u")),
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("decimation", [1, 3])
def test_a_system_of_fmus(foreign, method, compiled, decimation):
    system, options = clocked(foreign), {"method": method, "compiled": compiled, "decimation": decimation}
    early = simulate_system(system, ROWS * STEP, STEP, **options)
    late = simulate_system(system, T0 + ROWS * STEP, STEP, start=T0, **options)
    expected = np.arange(0, ROWS + 1, decimation) * STEP
    assert early.time == pytest.approx(expected, abs=1e-12)
    assert late.time == pytest.approx(T0 + expected, abs=1e-12)
    for name in ("x.x", "g.y"):
        assert late.columns[name].tolist() == early.columns[name].tolist()
    for run, start in ((early, 0.0), (late, T0)):
        assert run.columns["clock.angle_rad"][1:] == pytest.approx(0.7 + start + expected[1:] - STEP, abs=1e-12)


def test_a_replay(foreign):
    time = np.cumsum(np.random.default_rng(17).uniform(0.7, 1.3, ROWS)) * STEP
    angle = np.cos(3.1 * time)
    for start in (-4.4, 0.0, T0):
        record = Record("r", start + time, {"angle": angle}, {"angle": "rad"})
        found = replay(foreign["units"], record, parameters={"speed": 0.0, "kelvin": 0.0})
        assert found.time.tolist() == record.time.tolist()
        assert found.columns["angle_rad"][1:] == pytest.approx(0.7 + record.time[:-1], abs=1e-12)
        assert found.columns["angle_seen"][1:] == pytest.approx(np.degrees(angle[1:]), rel=1e-12)


def test_an_experiment_of_an_ssp(foreign, tmp_path):
    path = write_ssp(tmp_path / "late.ssp", (clocked(foreign), Experiment(stop=T0 + 0.2, step=STEP, start=T0)))
    with open_ssp(path) as cases:
        ((system, experiment),) = cases.values()
        late = simulate_system(system, experiment.stop, experiment.step, start=experiment.start)
    early = simulate_system(clocked(foreign), 0.2, STEP)
    assert late.time == pytest.approx(T0 + early.time, abs=1e-12)
    assert late.columns["x.x"].tolist() == early.columns["x.x"].tolist()
