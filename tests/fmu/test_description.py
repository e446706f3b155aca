"""Model description: what FMI needs to know of a kernel, against the kernel's declarations."""

import math
from xml.etree.ElementTree import Element

import numpy as np
import pytest

from tsm_fmu import __version__
from tsm_fmu.fmu.build import python_flavour
from tsm_fmu.fmu.description import Flavour, decade, interface, model_description
from tsm_fmu.fmu.description3 import model_description3
from tsm_fmu.fmu.reference import reference_run
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.logs.units import unit_to_si
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import sizes


def described(k: Kernel, **starts: float) -> Element:
    return model_description(interface(k, k.name, starts), "guid", python_flavour("Needs a Python."))


@pytest.fixture(params=MODELS, ids=lambda m: m.NAME)
def model(request) -> Kernel:
    return Kernel(request.param)


def by_name(xml: Element) -> dict[str, Element]:
    return {v.get("name", ""): v for v in xml.iter("ScalarVariable")}


def test_every_variable_is_there_with_its_unit_bounds_and_meaning(model):
    listed = by_name(described(model))
    declared = [*model.parameters, *model.inputs, *model.outputs]
    assert list(listed) == [v.name for v in declared]
    for v in declared:
        node = listed[v.name]
        (typed,) = node
        assert (node.get("description") or "").startswith(v.quantity.meaning)
        assert typed.tag == {float: "Real", int: "Integer"}[v.kind]
        assert float(typed.get("min", "-inf")) == v.quantity.lo
        assert float(typed.get("max", "inf")) == v.quantity.hi
        if v.kind is float and model.roles.any_unit and v not in model.parameters:
            assert not {"unit", "displayUnit"} & set(typed.attrib)
        elif v.kind is float:
            assert typed.get("unit") == v.quantity.unit
            assert typed.get("displayUnit", "") == v.quantity.display


def test_start_values_keep_every_bit(model):
    listed = by_name(described(model))
    for v in model.parameters:
        assert v.kind(listed[v.name][0].get("start")) == v.start


def test_given_start_values_are_written_with_every_bit():
    alpha = math.nextafter(0.1 + 0.2, 1.0)
    node = by_name(described(kernel("PairedTsmBacklash"), alpha=alpha))["alpha"]
    assert float(node[0].get("start", "")) == alpha


def test_units_are_defined_once_and_display_units_convert(model):
    xml = described(model)
    units = {u.get("name", ""): u for u in xml.iter("Unit")}
    assert len(units) == len(list(xml.iter("Unit")))
    for real in xml.iter("Real"):
        if "unit" not in real.attrib:
            assert model.roles.any_unit
            continue
        unit, display = real.get("unit", ""), real.get("displayUnit")
        exponents = {k: float(x) for k, x in units[unit].find("BaseUnit").attrib.items()}  # type: ignore[union-attr]
        assert exponents == {k: x for k, x in unit_to_si(unit).base if x}
        if display:
            factors = {d.get("name"): float(d.get("factor", "")) for d in units[unit].iter("DisplayUnit")}
            assert factors[display] * unit_to_si(display).factor == pytest.approx(unit_to_si(unit).factor, rel=1e-15)


def test_a_display_unit_by_hand():
    xml = described(kernel("PairedTsmBacklash"))
    (degree,) = xml.iter("DisplayUnit")
    assert degree.get("name") == "deg"
    assert float(degree.get("factor", "")) == math.degrees(1.0)


def test_structure_lists_the_outputs_and_what_they_depend_on(model):
    xml = described(model)
    names = [v.get("name") for v in xml.iter("ScalarVariable")]
    inputs = {v.name for v in model.inputs}
    everything = inputs | {v.name for v in model.parameters}
    declared = model.roles.depends
    for section, otherwise in (("Outputs", inputs), ("InitialUnknowns", everything)):
        unknowns = list(xml.find(f"ModelStructure/{section}"))  # type: ignore[arg-type]
        assert [names[int(u.get("index", "")) - 1] for u in unknowns] == [v.name for v in model.outputs]
        for unknown, output in zip(unknowns, model.outputs, strict=True):
            depends = {names[int(i) - 1] for i in unknown.get("dependencies", "").split()}
            assert depends == (otherwise - inputs) | (set(declared.get(output.name, inputs)))


def test_causality_variability_and_initial(model):
    for node in described(model).iter("ScalarVariable"):
        integer = node[0].tag == "Integer"
        expected = {
            "parameter": ("fixed", "exact", True),
            "input": ("discrete" if integer else "continuous", None, True),
            "output": ("discrete" if integer else "continuous", "calculated", False),
        }[node.get("causality", "")]
        assert (node.get("variability"), node.get("initial"), "start" in node[0].attrib) == expected


def test_capabilities_and_default_experiment(model):
    xml = described(model)
    capabilities = xml.find("CoSimulation")
    assert capabilities is not None
    # it runs in a Python that must be there, and PythonFMU allocates on its own: hosts decide by this
    for flag in (
        "canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate", "needsExecutionTool",
        "canNotUseMemoryManagementFunctions",
    ):  # fmt: skip
        assert capabilities.get(flag) == "true"
    for flag in ("canBeInstantiatedOnlyOncePerProcess", "canInterpolateInputs", "canRunAsynchronuously"):
        assert capabilities.get(flag, "false") == "false"
    assert capabilities.get("modelIdentifier") == xml.get("modelName") == model.name
    experiment = xml.find("DefaultExperiment")
    assert experiment is not None
    assert float(experiment.get("stopTime", "")) > float(experiment.get("stepSize", "")) > 0


def test_a_flavour_says_what_it_needs_and_what_helped():
    backlash = interface(kernel("PairedTsmBacklash"), "Wrist", {})
    plain = model_description(backlash, "guid", Flavour("", "", {}, {}))
    assert plain.get("description") == "Backlash-like hysteresis of a paired tendon-sheath mechanism"
    assert plain.get("generationTool") == f"tsm-fmu {__version__}"
    helped = model_description(backlash, "guid", Flavour("Tool 1", "Needs a Python.", {}, {"logAll": "all"}))
    assert helped.get("description") == f"{plain.get('description')}. Needs a Python."
    assert helped.get("generationTool") == f"tsm-fmu {__version__} with Tool 1"
    assert [c.attrib for c in helped.iter("Category")] == [{"name": "logAll", "description": "all"}]


def test_choices_are_integers_with_their_names_in_words_and_enumerations_in_fmi_3(model):
    declared = [v for v in (*model.parameters, *model.inputs, *model.outputs) if v.quantity.choices]
    xml, xml3 = described(model), model_description3(interface(model, model.name, {}), "guid", Flavour("", "", {}, {}))
    assert not list(xml.iter("Enumeration"))  # libcosim and ecos do not set one
    types = {t.get("name"): list(t.iter("Item")) for t in xml3.iter("EnumerationType")}
    listed = {v.get("name"): v for v in xml3.iter("Enumeration")}
    names = {v.get("name") for v in xml.iter("ScalarVariable")}
    assert len(types) == len(declared) == len(listed)
    assert not names & set(types)
    for v in declared:
        items = types[listed[v.name].get("declaredType")]
        numbers = [int(i.get("value", "")) for i in items]
        assert v.kind is int
        assert numbers == list(range(int(v.quantity.lo), int(v.quantity.hi) + 1))
        assert [i.get("name") for i in items] == list(v.quantity.choices)
        assert len(set(v.quantity.choices)) == len(items)
        words = ", ".join(f"{n} = {name}" for n, name in zip(numbers, v.quantity.choices, strict=True))
        assert by_name(xml)[v.name].get("description") == f"{v.quantity.meaning} ({words})"


def test_a_whole_number_is_a_choice_or_a_count_with_bounds(model):
    for v in (*model.parameters, *model.inputs, *model.outputs):
        if v.kind is int:
            assert math.isfinite(v.quantity.lo)
            assert math.isfinite(v.quantity.hi)
            assert v.quantity.choices or "number" in v.quantity.meaning or v.name == "layer"


@pytest.mark.parametrize(
    ("magnitude", "power"), [(0.0, None), (1.27, 1.0), (-0.91693, 1.0), (3.05e-4, 1e-4), (4.0e5, 1e6), (31.7, 100.0)]
)
def test_a_nominal_value_is_a_power_of_ten(magnitude, power):
    assert decade(magnitude) == power


def test_nominal_values_are_of_the_reference_experiment(model):
    reference = reference_run(model, model.params())
    xml = model_description(interface(model, model.name, {}, reference.largest()), "guid", python_flavour(""))
    columns = {v.name: reference.results[:, i] for i, v in enumerate(model.outputs)}
    given = np.array(reference.inputs, dtype=float)
    columns |= {v.name: given[:, i] for i, v in enumerate(model.inputs)}
    listed = by_name(xml)
    for name, column in columns.items():
        nominal, largest = listed[name][0].get("nominal"), np.abs(column).max()
        if listed[name][0].tag == "Real" and largest:
            assert 10**-0.5 <= largest / float(nominal) <= 10**0.5
        else:
            assert nominal is None
    for v in model.parameters:
        if v.kind is float and v.start:
            assert 10**-0.5 <= abs(v.start) / float(listed[v.name][0].get("nominal", "")) <= 10**0.5


def test_the_default_experiment_is_that_of_the_model():
    for name, stop, step in (("LebusTransmission", 31.4, 0.02), ("DcMotor", 2.0, 0.001), ("TendonDrive", 20.0, 0.001)):
        experiment = described(kernel(name)).find("DefaultExperiment")
        assert experiment is not None
        assert experiment.attrib == {"startTime": "0.0", "stopTime": repr(stop), "stepSize": repr(step)}


def test_a_default_experiment_is_a_whole_number_of_steps(model):
    stop, step = model.roles.experiment
    assert stop / step == pytest.approx(round(stop / step), rel=1e-12)
    assert 100 <= stop / step <= 50_000


def test_a_chain_has_the_experiment_of_its_model():
    assert chain("SingleTsmDahl", ("coulomb",)).roles.experiment.step == 2e-3


ARRAYS = {"LebusTransmission", "LebusCompensator"}
"""Models with parameters that are arrays: one variable each in FMI 3.0."""


def heads_of(model: Kernel) -> list[tuple[int, int]]:
    """Value reference and length (0: a number) of each variable of FMI 3.0."""
    found, at = [], 0
    for part in ("Params", "Inputs", "Outputs"):
        for size in sizes(getattr(model.module, part)):
            found.append((at, size))
            at += size or 1
    return found


def test_fmi_3_says_of_every_variable_what_fmi_2_says_and_has_arrays_as_one(model):
    """Numbers one by one; of an array the name without the index, and the start values of all its items."""
    starts = {v.name: v.start * 1.25 + 0.01 for v in model.parameters if v.kind is float}
    reference = reference_run(model, model.params())
    fmu = interface(model, "Named", starts, reference.largest())
    flavour = Flavour("", "", {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "false",
                               "providesDirectionalDerivative": "true", "canNotUseMemoryManagementFunctions": "true",
                               "needsExecutionTool": "false"}, {"logAll": "all of it"})  # fmt: skip
    two, three = model_description(fmu, "guid", flavour), model_description3(fmu, "guid", flavour)
    listed2 = [*two.iter("ScalarVariable")]
    time, *listed3 = next(three.iter("ModelVariables"))
    assert time.attrib == {"name": "time", "valueReference": str(len(listed2)), "causality": "independent",
                           "variability": "continuous", "description": "simulation time"}  # fmt: skip
    heads = heads_of(model)
    assert [int(v.get("valueReference", "")) for v in listed3] == [at for at, _ in heads]
    assert any(size for _, size in heads) is (model.name in ARRAYS)
    for (at, size), node in zip(heads, listed3, strict=True):
        old, typed = listed2[at], listed2[at][0]
        choices = [*model.parameters, *model.inputs, *model.outputs][at].quantity.choices
        assert node.tag == ("Enumeration" if choices else {"Real": "Float64", "Integer": "Int32"}[typed.tag])
        assert node.get("name") == (old.get("name", "").removesuffix("_1") if size else old.get("name"))
        assert old.get("description", "").startswith(node.get("description", "nothing"))
        for name in ("causality", "variability", "initial"):
            assert node.get(name) == old.get(name)
        given = [v[0].get("start") for v in listed2[at : at + (size or 1)]]
        assert node.get("start") == (None if given[0] is None else " ".join(str(g) for g in given))
        for name in ("min", "max", "unit", "displayUnit", "nominal"):
            assert node.get(name) == typed.get(name)
        assert [d.attrib for d in node] == ([{"start": str(size)}] if size else [])
    simulation = three.find("CoSimulation")
    assert simulation is not None
    assert simulation.attrib == {"modelIdentifier": "Named", "canGetAndSetFMUState": "true",
                                 "canSerializeFMUState": "false", "providesDirectionalDerivatives": "true",
                                 "needsExecutionTool": "false"}  # fmt: skip
    assert [c.attrib for c in three.iter("Category")] == [{"name": "logAll", "description": "all of it"}]
    assert (three.get("fmiVersion"), three.get("modelName"), three.get("instantiationToken")) == (
        "3.0",
        "Named",
        "guid",
    )
    experiments = [xml.find("DefaultExperiment") for xml in (two, three)]
    assert experiments[0] is not None
    assert experiments[1] is not None
    assert experiments[0].attrib == experiments[1].attrib


def test_the_structure_of_fmi_3_is_that_of_fmi_2_by_value_reference(model):
    """An index counts from 1, a reference from 0; items within an array are not listed."""
    fmu = interface(model, model.name, {})
    two, three = (d(fmu, "guid", Flavour("", "", {}, {})) for d in (model_description, model_description3))
    listed = {at for at, _ in heads_of(model)}
    for tag2, tag3 in (("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")):
        expected = {
            int(u.get("index", "")) - 1: [int(d) - 1 for d in u.get("dependencies", "").split() if int(d) - 1 in listed]
            for u in next(two.iter(tag2))
        }
        found = {
            int(u.get("valueReference", "")): [int(d) for d in u.get("dependencies", "").split()]
            for u in three.iter(tag3)
        }
        assert found == {at: needs for at, needs in expected.items() if at in listed}
    assert (three.find("TypeDefinitions") is not None) is any(
        v.quantity.choices for v in (*model.parameters, *model.inputs, *model.outputs)
    )
