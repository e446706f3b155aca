"""Model description: what FMI needs to know of a kernel, against the kernel's declarations."""

import math
from xml.etree.ElementTree import Element

import pytest

from tsm_fmu import __version__
from tsm_fmu.fmu.build import python_flavour
from tsm_fmu.fmu.description import Flavour, interface, model_description
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.logs.units import unit_to_si
from tsm_fmu.models import MODELS


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
        assert node.get("description") == v.quantity.meaning
        assert typed.tag == {float: "Real", int: "Integer"}[v.kind]
        assert float(typed.get("min", "-inf")) == v.quantity.lo
        assert float(typed.get("max", "inf")) == v.quantity.hi
        if v.kind is float:
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
    for flag in ("canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate"):
        assert capabilities.get(flag) == "true"
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
