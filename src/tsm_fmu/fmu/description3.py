"""FMI 3.0 model description of a kernel: the same variables, units and structure as in FMI 2.0."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element, SubElement

from ..models.contract import Variable
from .description import Flavour, Interface, about, add_units, needed_inputs, number_text


def model_description3(fmu: Interface, guid: str, flavour: Flavour) -> Element:
    """Complete ``fmiModelDescription`` of FMI 3.0."""
    root = Element("fmiModelDescription", {"fmiVersion": "3.0", "modelName": fmu.name, "instantiationToken": guid})
    root.attrib.update(about(fmu, flavour))
    names = {"canGetAndSetFMUstate": "canGetAndSetFMUState", "canSerializeFMUstate": "canSerializeFMUState"}
    names["providesDirectionalDerivative"] = "providesDirectionalDerivatives"
    known = {names.get(k, k): v for k, v in flavour.capabilities.items() if k != "canNotUseMemoryManagementFunctions"}
    SubElement(root, "CoSimulation", {"modelIdentifier": fmu.name, **known})
    add_units(SubElement(root, "UnitDefinitions"), fmu.entries)
    _add_types(root, fmu)
    categories = SubElement(root, "LogCategories")
    for category, meaning in flavour.log_categories.items():
        SubElement(categories, "Category", name=category, description=meaning)
    experiment = {"stopTime": repr(fmu.experiment.stop), "stepSize": repr(fmu.experiment.step)}
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", **experiment})
    listed = SubElement(root, "ModelVariables")
    _add_time(listed, len(fmu.entries))
    for reference in _declared(fmu):
        _add_variable(listed, fmu, reference)
    _add_structure(SubElement(root, "ModelStructure"), fmu)
    return root


def _add_time(parent: Element, reference: int) -> None:
    attributes = {"name": "time", "valueReference": str(reference), "causality": "independent"}
    SubElement(parent, "Float64", {**attributes, "variability": "continuous", "description": "simulation time"})


def _declared(fmu: Interface) -> list[int]:
    """Value references of variables: those of numbers, and of arrays that of their first item."""
    found, at = [], 0
    while at < len(fmu.entries):
        found.append(at)
        at += fmu.arrays.get(fmu.entries[at].variable.name, ("", 1))[1]
    return found


def _add_variable(parent: Element, fmu: Interface, reference: int) -> None:
    entry = fmu.entries[reference]
    variable, quantity = entry.variable, entry.variable.quantity
    name, size = fmu.arrays.get(variable.name, (variable.name, 0))
    changing = "continuous" if variable.kind is float else "discrete"
    attributes = {
        "name": name,
        "valueReference": str(reference),
        "description": quantity.meaning,
        "causality": entry.causality,
        "variability": "fixed" if entry.causality == "parameter" else changing,
    }
    if entry.causality != "input":
        attributes["initial"] = "exact" if entry.causality == "parameter" else "calculated"
    if variable.kind is float:
        attributes |= entry.unit
    bounds = {"min": quantity.lo, "max": quantity.hi, "start": entry.start}
    attributes |= {k: number_text(variable.kind, x) for k, x in bounds.items() if x is not None and math.isfinite(x)}
    if quantity.choices:
        SubElement(parent, "Enumeration", {**attributes, "declaredType": choice_type(variable)})
        return
    if variable.kind is float and entry.nominal:
        attributes["nominal"] = number_text(float, entry.nominal)
    if size and entry.start is not None:
        attributes["start"] = " ".join(repr(float(e.start or 0.0)) for e in fmu.entries[reference : reference + size])
    node = SubElement(parent, "Float64" if variable.kind is float else "Int32", attributes)
    if size:
        SubElement(node, "Dimension", start=str(size))


def choice_type(variable: Variable) -> str:
    """Name of the type of a choice: not that of any variable."""
    return f"{variable.name.replace('.', '_')}_choice"


def _add_types(root: Element, fmu: Interface) -> None:
    chosen = [entry.variable for entry in fmu.entries if entry.variable.quantity.choices]
    if not chosen:
        return  # the schema has no empty list
    parent = SubElement(root, "TypeDefinitions")
    for variable in chosen:
        quantity = variable.quantity
        node = SubElement(parent, "EnumerationType", name=choice_type(variable), description=quantity.meaning)
        for value, choice in enumerate(quantity.choices, start=int(quantity.lo)):
            SubElement(node, "Item", name=choice, value=str(value))


def _add_structure(parent: Element, fmu: Interface) -> None:
    """Value references, where FMI 2.0 has indices from 1."""
    declared = {reference + 1 for reference in _declared(fmu)}
    inputs, parameters = ([p for p in fmu.positions(c) if p in declared] for c in ("input", "parameter"))
    needed = {p: needed_inputs(fmu, fmu.entries[p - 1], inputs) for p in fmu.positions("output") if p in declared}
    for tag in ("Output", "InitialUnknown"):
        for position, depends in needed.items():
            at_start = sorted(parameters + depends) if tag == "InitialUnknown" else depends
            listed = " ".join(str(p - 1) for p in at_start)
            SubElement(parent, tag, valueReference=str(position - 1), dependencies=listed)
