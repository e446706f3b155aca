"""FMI 3.0: FMPy's container, which is not ours, around an FMI 2.0 unit."""

import sys

import numpy as np
import pytest
from fmpy.container_fmu import Configuration
from fmpy.container_fmu.cli import create_container_fmu
from fmpy.container_fmu.config import Component as Inner
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown, read_model_description

from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.system import Component, Connection, System


@pytest.fixture(scope="module")
def container(foreign, tmp_path_factory):
    if not sys.platform.startswith("linux"):
        pytest.skip("FMPy's FMI 3.0 container is tried on Linux only")
    inner = Inner("x", foreign["integrator"], read_model_description(foreign["integrator"]))
    inside = {v.name: v for v in inner.modelDescription.modelVariables}
    outside = {
        "u": ModelVariable("u", type="Float64", causality="input", variability="continuous", start="0"),
        "x": ModelVariable("x", type="Float64", causality="output", variability="continuous"),
        "x_0": ModelVariable("x_0", type="Float64", causality="parameter", variability="tunable", start="0"),
    }
    time = ModelVariable("time", type="Float64", causality="independent", variability="continuous")  # reference 0
    description = ModelDescription(
        fmiVersion="3.0",
        modelName="Container",
        instantiationToken="{7a1c}",
        coSimulation=CoSimulation(modelIdentifier="container_fmu", fixedInternalStepSize=0.01),
        modelVariables=[time, *outside.values()],
        outputs=[Unknown(variable=outside["x"], dependencies=[], dependenciesKind=[])],
    )
    mapping = {outer: [(inner, inside[name])] for name, outer in outside.items()}
    folder = tmp_path_factory.mktemp("container")
    configuration = Configuration(False, description, [inner], [], mapping)
    (folder / "unpacked").mkdir()
    create_container_fmu(configuration, folder / "unpacked", folder / "Container.fmu")
    return folder / "Container.fmu"


def test_an_fmi_3_unit_runs_in_a_loop_with_an_fmi_2_unit(container, foreign):
    assert describe(container).fmi == 3
    system = System(
        (Component("x", container, {"x_0": 1.3}), Component("g", foreign["gain"], {"k": -2.7, "u_2": 0.0})),
        (Connection("x.x", "g.u"), Connection("g.y", "x.u")),
    )
    run = simulate_system(system, 0.5, 0.01)
    assert run.columns["x.x"] == pytest.approx(1.3 * (1.0 - 0.027) ** np.arange(51), rel=1e-12)
