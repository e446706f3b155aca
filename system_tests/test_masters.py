"""Scenarios in other masters, from the same .ssp: libcosim, ecos, the container of fmu-manipulation-toolbox, against ours.

All exchange as Jacobi does. libcosim counts time in whole nanoseconds, so that its times round otherwise.
"""

import math

import pytest

from benchmarks import masters
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import SCENARIOS

STEPS, STEP = 1237, 1e-3
LOOPS = [
    ("mssp_feedforward", "periodic.b065_law_1", "python"),
    ("mssp_feedforward", "periodic.b065_law_1", "native"),
    ("lebus_drive", None, "python"),
    ("single_tsm_force", None, "python"),
    ("configuration_independence", None, "python"),
    ("tendon_drive_loop", None, "python"),
]


@pytest.fixture(scope="module", params=LOOPS, ids=lambda loop: f"{loop[0]}-{loop[2]}")
def loop(request, fmus, tmp_path_factory):
    """The .ssp, what ours gives at the end, and the size of each signal."""
    scenario, case, flavour = request.param
    folder = tmp_path_factory.mktemp("loop")
    module = SCENARIOS[scenario]
    if flavour == "native":
        paths = {m: build_fmu(kernel(m), folder / f"{m}.fmu", flavour="native") for m in module.FMUS}
    else:
        paths = {m: fmus(m) for m in module.FMUS}
    cases = module.cases(paths)
    system, experiment = cases[case or next(iter(cases))]
    ssp = write_ssp(folder / "loop.ssp", (system, experiment))
    run = simulate_system(system, STEPS * STEP, STEP, method="jacobi", loops="delay")
    sizes = {name: max(abs(values.astype(float))) for name, values in run.columns.items()}
    return ssp, {name: float(values[-1]) for name, values in run.columns.items()}, sizes


@pytest.mark.parametrize(("master", "digits"), [("libcosim", 1e-12), ("ecos", 1e-12), ("container", 1e-12)])
def test_another_master_gives_the_same_to_1e_12(loop, master, digits):
    ssp, ours, sizes = loop
    other = masters.run(ssp, master, STEPS, STEP)
    if other.missing:
        pytest.skip(f"{master} does not load here: {other.missing}")
    assert other.values is not None
    apart = {name: abs(value - ours[name]) / (sizes[name] or 1.0) for name, value in other.values.items()}
    assert set(other.values) >= {name for name in ours if not math.isclose(sizes[name], 0.0)} or other.values
    assert max(apart.values()) <= digits, sorted(apart.items(), key=lambda item: -item[1])[:5]
