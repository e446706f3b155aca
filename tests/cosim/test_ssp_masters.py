"""One SSP in several masters: all kinds of variables, FMI 2.0 and 3.0, value for value."""

import ctypes
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import open_ssp

NAMESPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"))
)
STEP, STEPS = 0.01, 40
RATES = (0.61, -0.43)
INPUTS = {"load": "Real", "ask": "Integer", "mode": "Enumeration", "held": "Boolean", "call": "String"}
OUTPUTS = {"speed": "Real", "count": "Integer", "gear": "Enumeration", "over": "Boolean", "answer": "String"}
FROM = dict(zip(INPUTS, OUTPUTS, strict=True))
"""The output of the other unit that drives each input."""


def written(path, fmus, without=()):
    """Two units, each driven by the other in all kinds of variables but those that a master does not know."""
    kinds = {
        "Real": "<ssc:Real/>",
        "Integer": "<ssc:Integer/>",
        "Enumeration": '<ssc:Enumeration name="any"/>',
        "Boolean": "<ssc:Boolean/>",
        "String": "<ssc:String/>",
    }
    components = ""
    for name, fmu, rate in zip("ab", fmus, RATES, strict=True):
        connectors = "".join(
            f'<ssd:Connector name="{variable}" kind="{kind}">{kinds[of]}</ssd:Connector>'
            for kind, variables in (("input", INPUTS), ("output", OUTPUTS))
            for variable, of in variables.items()
            if of not in without
        )
        table = (
            f'<ssv:ParameterSet version="1.0" name="initialValues"><ssv:Parameters><ssv:Parameter name="rate">'
            f'<ssv:Real value="{rate}"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
        )
        components += (
            f'<ssd:Component name="{name}" source="resources/{fmu.name}" type="application/x-fmu-sharedlibrary">'
            f"<ssd:Connectors>{connectors}</ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding>"
            f"<ssd:ParameterValues>{table}</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
            "</ssd:Component>"
        )
    links = "".join(
        f'<ssd:Connection startElement="{start}" startConnector="{source}" endElement="{end}" endConnector="{target}"/>'
        for start, end in ("ab", "ba")
        for target, source in FROM.items()
        if INPUTS[target] not in without
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            "SystemStructure.ssd",
            f'<ssd:SystemStructureDescription {NAMESPACES} version="1.0" name="theirs"><ssd:System name="s">'
            f"<ssd:Elements>{components}</ssd:Elements><ssd:Connections>{links}</ssd:Connections></ssd:System>"
            "</ssd:SystemStructureDescription>",
        )
        for fmu in set(fmus):
            archive.write(fmu, f"resources/{fmu.name}")
    return path


def ours(path, **options):
    with open_ssp(path) as cases:
        columns = simulate_system(cases["theirs"][0], STEP * STEPS, STEP, method="jacobi", **options).columns
    for name in ("a", "b"):  # nothing stands still
        assert [len(np.unique(columns[f"{name}.{v}"])) > most for v, most in (("over", 1), ("gear", 2), ("speed", 30))]
    return columns


NUMBERS = [f"{c}.{v}" for c in "ab" for v, kind in OUTPUTS.items() if kind != "String"]


@pytest.mark.parametrize("compiled", [False, True])
def test_fmpys_own_ssp_simulation_gives_the_same_values(in_c, tmp_path, compiled):
    """It knows no texts, and starts with 0 on all connectors, as these outputs do."""
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import Parameter, ParameterSet

    path = written(tmp_path / "two.ssp", (in_c["kinds_2"], in_c["kinds_2"]), without=["String"])
    rates = [Parameter(name=f"{name}.rate", value=rate) for name, rate in zip("ab", RATES, strict=True)]
    given = ParameterSet(name="p", parameters=rates)
    rows = simulate_ssp(str(path), stop_time=(STEPS - 0.5) * STEP, step_size=STEP, parameter_set=given)
    found = ours(path, compiled=compiled)
    for name in NUMBERS:
        assert found[name][1:].tolist() == [row[name] for row in rows], name


def by_hand(folder, fmus):
    """The outputs at each communication point, all calls FMPy's, all values exchanged at once."""
    units = []
    for name, fmu, rate in zip("ab", fmus, RATES, strict=True):
        model = fmpy.read_model_description(fmu, validate=False)
        assert model.coSimulation is not None
        fmpy.extract(fmu, unzipdir=folder / name)
        kind = FMU2Slave if model.fmiVersion == "2.0" else FMU3Slave
        unit = kind(
            guid=model.guid,
            unzipDirectory=str(folder / name),
            modelIdentifier=model.coSimulation.modelIdentifier,
            instanceName=name,
        )
        unit.instantiate()
        variables = {v.name: v for v in model.modelVariables}

        def call(verb, variable, *values, unit=unit, variables=variables):
            kind, reference = variables[variable].type, variables[variable].valueReference
            if kind == "Enumeration":
                kind = "Integer" if isinstance(unit, FMU2Slave) else "Int64"
            return getattr(unit, verb + kind)([reference], *([value] for value in values))

        if isinstance(unit, FMU2Slave):
            unit.setupExperiment(startTime=0.0)
        call("set", "rate", rate)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        units.append((unit, call))

    def outputs():
        found = [{v: call("get", v)[0] for v in OUTPUTS} for _, call in units]
        for row in found:
            row["answer"] = row["answer"].decode() if isinstance(row["answer"], bytes) else row["answer"]
            row["over"] = bool(row["over"])
        return found

    rows = [outputs()]
    for k in range(STEPS):
        for (_, call), other in zip(units, rows[-1][::-1], strict=True):
            for target, source in FROM.items():
                call("set", target, other[source])
        for unit, _ in units:
            unit.doStep(k * STEP, STEP)
        rows.append(outputs())
    for unit, _ in units:
        unit.terminate()
        unit.freeInstance()
    return rows


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("kinds", [("kinds_2", "kinds_2"), ("kinds_2", "kinds_3"), ("kinds_3", "kinds_3")])
def test_texts_and_fmi_3_units_as_calls_of_fmpy_have_them(in_c, tmp_path, kinds, compiled):
    fmus = tuple(in_c[kind] for kind in kinds)
    found = ours(written(tmp_path / "two.ssp", fmus), compiled=compiled)
    rows = by_hand(tmp_path, fmus)
    for k, name in enumerate("ab"):
        for variable in OUTPUTS:
            if variable != "answer":
                assert found[f"{name}.{variable}"].tolist() == [row[k][variable] for row in rows], (name, variable)
    assert len(rows[-1][0]["answer"]) == STEPS  # the letters counted in, which only the texts carry


def test_libcosim_gives_the_same_values(in_c, tmp_path):
    """It reads FMI 2.0 here, and no Enumeration; a text counts its letters."""
    execution_of = pytest.importorskip("libcosimpy.CosimExecution").CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    path = written(tmp_path / "two.ssp", (in_c["kinds_2"], in_c["kinds_2"]), without=["Enumeration"])
    found = ours(path)
    execution, observer = execution_of.from_ssp_file(str(path), round(STEP * 1e9)), CosimObserver.create_last_value()
    execution.add_observer(observer)
    for k in range(1, STEPS + 1):
        assert execution.step(1)
        for name in "ab":
            slave = execution.slave_index_from_instance_name(name)
            speed = pytest.approx([found[f"{name}.speed"][k]], rel=1e-13)  # its time counts nanoseconds
            assert observer.last_real_values(slave, [1]) == speed
            assert observer.last_integer_values(slave, [1]) == [found[f"{name}.count"][k]]
            assert observer.last_boolean_values(slave, [1]) == [found[f"{name}.over"][k]]


@pytest.mark.parametrize("kinds", [("kinds_2", "kinds_2"), ("kinds_2", "kinds_3"), ("kinds_3", "kinds_3")])
def test_ecos_gives_the_same_values(in_c, tmp_path, kinds):
    """It knows no Enumeration either, and hands FMI 3.0 units no texts."""
    try:
        ctypes.CDLL("libtbb.so.12")
    except OSError as missing:
        pytest.skip(f"ecospy needs Debian's libtbb12: {missing}")
    ecospy = pytest.importorskip("ecospy")
    without = ["Enumeration", "String"] if "kinds_3" in kinds else ["Enumeration"]
    path = written(tmp_path / "two.ssp", tuple(in_c[kind] for kind in kinds), without)
    found = ours(path)
    simulation = ecospy.EcosSimulation(ssp_path=str(path), step_size=STEP)
    simulation.init(parameter_set="initialValues")
    for k in range(1, STEPS + 1):
        simulation.step(1)
        for name in "ab":
            assert simulation.get_real(f"{name}::speed") == found[f"{name}.speed"][k]
            assert simulation.get_integer(f"{name}::count") == found[f"{name}.count"][k]
            assert simulation.get_bool(f"{name}::over") == found[f"{name}.over"][k]
    simulation.terminate()
