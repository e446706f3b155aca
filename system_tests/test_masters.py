"""Scenarios in other masters, from the same .ssp: libcosim, ecos, fmu-manipulation-toolbox's container, against ours.

All exchange as Jacobi does. The step is a whole number both of nanoseconds, in which libcosim counts, and of a power of
2, so that times are the same however a master adds them up: a controller's derivative would show their rounding.
"""

import zipfile

import pytest
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from benchmarks import masters
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import check_system
from tsm_fmu.scenarios import SCENARIOS

STEPS, STEP = 1237, 2.0**-9
LOOPS = [
    (scenario, case, flavour)
    for scenario, case in [
        ("mssp_feedforward", "periodic.b065_law_1"),
        ("lebus_drive", None),
        ("single_tsm_force", None),
        ("single_tsm_drive", None),
        ("configuration_independence", None),
        ("tendon_drive_loop", None),
    ]
    for flavour in ("python", "native")
]


@pytest.fixture(scope="module", params=LOOPS, ids=lambda loop: f"{loop[0]}-{loop[2]}")
def loop(request, fmus, native_fmus, tmp_path_factory):
    """The .ssp and what ours gives at its end; for containers of a loop with factors the same with gains in FMUs."""
    scenario, case, flavour = request.param
    folder = tmp_path_factory.mktemp("loop")
    module = SCENARIOS[scenario]
    unit = native_fmus if flavour == "native" else fmus
    paths = {m: unit(m) for m in module.FMUS}
    cases = module.cases(paths)
    system, experiment = cases[case or next(iter(cases))]
    found = {"all": known(folder / "loop.ssp", system, experiment)}
    if any((c.factor, c.offset) != (1.0, 0.0) for c in system.connections):
        found["container"] = known(folder / "gains.ssp", masters.with_gains(system, fmus("Sum")), experiment)
    return found


def known(path, system, experiment):
    """The .ssp, what ours gives at the end, the size of each signal."""
    run = simulate_system(system, STEPS * STEP, STEP, method="jacobi", loops="delay")
    wiring = check_system(system)
    ports = {f"{name}.{p.name}": p for name, d in wiring.descriptions.items() for p in d.ports.values()}
    sizes = {n: float(max(abs(values))) for n, values in run.columns.items() if ports[n].kind == "Real"}
    ssp = write_ssp(path, (system, experiment))
    return ssp, {name: float(values[-1]) for name, values in run.columns.items()}, sizes


@pytest.mark.parametrize("master", ["libcosim", "ecos", "container"])
def test_another_master_gives_the_same_to_1e_12(loop, master):
    ssp, ours, sizes = loop.get(master, loop["all"])
    other = masters.run(ssp, master, STEPS, STEP)
    if other.missing:
        pytest.skip(f"{master} does not load here: {other.missing}")
    assert other.values is not None
    assert set(other.values) == {name for name in ours if name in sizes}
    apart = {name: abs(value - ours[name]) / (sizes[name] or 1.0) for name, value in other.values.items()}
    assert max(apart.values()) <= 1e-12, sorted(apart.items(), key=lambda item: -item[1])[:5]


def test_units_are_equal_unknown_or_joined_by_a_factor(loop):
    with zipfile.ZipFile(loop["all"][0]) as archive:
        tree = etree.fromstring(archive.read("SystemStructure.ssd"))
    units = {}
    for component in tree.iter("{*}Component"):
        for connector in component.iter("{*}Connector"):
            units[component.get("name"), connector.get("name")] = connector[0].get("unit")
    for link in tree.iter("{*}Connection"):
        a, b = (units[link.get(f"{end}Element"), link.get(f"{end}Connector")] for end in ("start", "end"))
        factors = list(link.iter("{*}LinearTransformation"))
        assert link.get("suppressUnitConversion") is None or factors, (dict(link.attrib), a, b)
        assert a == b or None in (a, b) or factors, (dict(link.attrib), a, b)
