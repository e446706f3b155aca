"""FMI 2.0 model description of a kernel: variables with units and bounds, structure, units, default experiment.

Written from the declared variables of the kernel, whatever runs it: a `Flavour` says what differs. PythonFMU's own
description has no units, no bounds and no InitialUnknowns, and prints start values with 16 digits, which does not keep
a double.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from .. import __version__
from ..kernels.kernel import Kernel
from ..logs.units import unit_to_si
from ..models.contract import DefaultExperiment, Quantity, Variable, sizes, variables

FIXED_DATE = "1980-01-01T00:00:00Z"
"""Date of generation and of every file in the archive: equal content gives equal bytes."""

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Entry:
    """A variable as FMI sees it: its position is its value reference, from 0, and its index, from 1."""

    variable: Variable
    causality: str
    start: float | None
    nominal: float | None = None
    unitless: bool = False

    @property
    def unit(self) -> dict[str, str]:
        """Attributes that declare the unit; none for a signal that takes any (`Roles.any_unit`)."""
        quantity = self.variable.quantity
        if self.unitless:
            return {}
        return {"unit": quantity.unit, **({"displayUnit": quantity.display} if quantity.display else {})}


@dataclass(frozen=True)
class Interface:
    """Name, text and variable table of one FMU.

    Attributes
    ----------
    name : str
        Model name and model identifier.
    summary : str
        First line of the kernel's docstring.
    entries : tuple of Entry
        Parameters, inputs, outputs, in declared order (as in `slave.KernelSlave`).
    depends : mapping of str to tuple of str
        Inputs that an output depends on, by name; an output that is not in it depends on all.
    experiment : DefaultExperiment
        Stop time and step that suit the model.
    arrays : mapping of str to (str, int)
        Name and length of each array by the name of its first item: FMI 3.0 has them as one variable.
    """

    name: str
    summary: str
    entries: tuple[Entry, ...]
    depends: Mapping[str, tuple[str, ...]]
    experiment: DefaultExperiment
    arrays: Mapping[str, tuple[str, int]]

    def positions(self, *causalities: str) -> list[int]:
        """FMI indices, from 1, of the variables with these causalities."""
        return [i for i, e in enumerate(self.entries, start=1) if e.causality in causalities]


@dataclass(frozen=True)
class Flavour:
    """What the description says of the code that runs a kernel.

    Attributes
    ----------
    tool : str
        What this package was helped by, for the generation tool: ``"PythonFMU 0.7.0"``; empty for nothing.
    needs : str
        What the FMU needs of its host, a sentence; empty for nothing.
    capabilities : mapping of str to str
        Attributes of ``CoSimulation``.
    log_categories : mapping of str to str
        Meaning by name.
    sources : tuple of str
        C files in ``sources/`` to compile.
    """

    tool: str
    needs: str
    capabilities: Mapping[str, str]
    log_categories: Mapping[str, str]
    sources: tuple[str, ...] = ()


def interface(
    kernel: Kernel, name: str, start_values: Mapping[str, float], largest: Mapping[str, float] | None = None
) -> Interface:
    """Variable table of a kernel.

    Parameters
    ----------
    kernel : Kernel
        A model, or a model with effects.
    name : str
        Model name and identifier.
    start_values : mapping of str to float
        What replaces the kernel's defaults of its parameters.
    largest : mapping of str to float
        Largest magnitude of inputs and outputs in the reference experiment: nominal values follow from it.
    """
    nominals = {v: decade(x) for v, x in (largest or {}).items()}
    units: dict[str, float] = {}
    for v in (*kernel.inputs, *kernel.outputs):
        units[v.quantity.unit] = max(units.get(v.quantity.unit, 0.0), nominals.get(v.name) or 0.0)
    for v in kernel.parameters:
        nominals[v.name] = decade(v.start) or units.get(v.quantity.unit)
    entries = [Entry(v, "parameter", start_values.get(v.name, v.start), nominals[v.name]) for v in kernel.parameters]
    free = kernel.roles.any_unit
    entries += [Entry(v, "input", v.start, nominals.get(v.name), free) for v in kernel.inputs]
    entries += [Entry(v, "output", None, nominals.get(v.name), free) for v in kernel.outputs]
    summary = (kernel.module.__doc__ or kernel.name).strip().splitlines()[0].rstrip(".")
    arrays = {k: v for fields in (kernel.module.Params, kernel.module.Inputs, kernel.module.Outputs)
              for k, v in _arrays(fields).items()}  # fmt: skip
    return Interface(name, summary, tuple(entries), kernel.roles.depends, kernel.roles.experiment, arrays)


def _arrays(fields: Any) -> dict[str, tuple[str, int]]:
    found, listed, at = {}, variables(fields), 0
    for field, size in zip(fields._fields, sizes(fields), strict=True):
        if size:
            found[listed[at].name] = (field.rstrip("_").replace("__", "."), size)
        at += size or 1
    return found


def decade(magnitude: float) -> float | None:
    """Power of ten that is nearest to a magnitude; None for 0."""
    return 10.0 ** round(math.log10(abs(magnitude))) if magnitude else None


def about(fmu: Interface, flavour: Flavour) -> dict[str, str]:
    """Attributes of a model description that FMI 2.0 and 3.0 share."""
    return {
        "description": f"{fmu.summary}. {flavour.needs}" if flavour.needs else fmu.summary,
        "author": "tsm-fmu",
        "version": __version__,
        "copyright": "the tsm-fmu authors",
        "license": "MIT",
        "generationTool": f"tsm-fmu {__version__}" + (f" with {flavour.tool}" if flavour.tool else ""),
        "generationDateAndTime": FIXED_DATE,
        "variableNamingConvention": "structured",
    }


def model_description(fmu: Interface, guid: str, flavour: Flavour) -> Element:
    """Complete ``fmiModelDescription``."""
    root = Element("fmiModelDescription", {"fmiVersion": "2.0", "modelName": fmu.name, "guid": guid})
    root.attrib.update(about(fmu, flavour))
    simulation = SubElement(root, "CoSimulation", {"modelIdentifier": fmu.name, **flavour.capabilities})
    if flavour.sources:
        files = SubElement(simulation, "SourceFiles")
        for file in flavour.sources:
            SubElement(files, "File", name=file)
    add_units(SubElement(root, "UnitDefinitions"), fmu.entries)
    categories = SubElement(root, "LogCategories")
    for category, meaning in flavour.log_categories.items():
        SubElement(categories, "Category", name=category, description=meaning)
    experiment = {"stopTime": repr(fmu.experiment.stop), "stepSize": repr(fmu.experiment.step)}
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", **experiment})
    listed = SubElement(root, "ModelVariables")
    for reference, entry in enumerate(fmu.entries):
        _add_variable(listed, entry, reference)
    _add_structure(SubElement(root, "ModelStructure"), fmu)
    return root


def _add_variable(parent: Element, entry: Entry, reference: int) -> None:
    variable, quantity = entry.variable, entry.variable.quantity
    changing = "continuous" if variable.kind is float else "discrete"
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": quantity.meaning + _named(quantity),
        "causality": entry.causality,
        "variability": "fixed" if entry.causality == "parameter" else changing,
    }
    if entry.causality != "input":
        attributes["initial"] = "exact" if entry.causality == "parameter" else "calculated"
    node = SubElement(parent, "ScalarVariable", attributes)
    bounds = {"min": quantity.lo, "max": quantity.hi, "start": entry.start}
    numbers = {k: number_text(variable.kind, x) for k, x in bounds.items() if x is not None and math.isfinite(x)}
    if variable.kind is int:
        SubElement(node, "Integer", numbers)
        return
    if entry.nominal:
        numbers["nominal"] = number_text(float, entry.nominal)
    SubElement(node, "Real", {**entry.unit, **numbers})


def number_text(kind: type, number: Any) -> str:
    """A number as FMI files have it: all digits of a float."""
    return str(int(number)) if kind is int else repr(float(number))


def _named(quantity: Quantity) -> str:
    """Names of a choice, for a description.

    FMI 2.0 would have it as an Enumeration, which libcosim and ecos never set: a system would run there with other
    values, and only a warning. It is an Integer with bounds here, which every host sets; FMI 3.0 has the Enumeration.
    """
    if not quantity.choices:
        return ""
    return f" ({', '.join(f'{n} = {name}' for n, name in enumerate(quantity.choices, start=int(quantity.lo)))})"


def add_units(parent: Element, entries: Iterable[Entry]) -> None:
    displays: dict[str, set[str]] = {}
    for entry in entries:
        if entry.variable.kind is float and not entry.unitless:
            quantity = entry.variable.quantity
            displays.setdefault(quantity.unit, set()).update([quantity.display] if quantity.display else [])
    for unit in sorted(displays):
        node = SubElement(parent, "Unit", name=unit)
        exponents = {symbol: power for symbol, power in unit_to_si(unit).base if power}
        SubElement(node, "BaseUnit", {s: str(int(exponents[s])) for s in BASE_UNITS if s in exponents})
        for display in sorted(displays[unit]):
            factor = unit_to_si(unit).factor / unit_to_si(display).factor
            SubElement(node, "DisplayUnit", name=display, factor=repr(factor))


def _add_structure(parent: Element, fmu: Interface) -> None:
    inputs, parameters = fmu.positions("input"), fmu.positions("parameter")
    needed = {p: needed_inputs(fmu, fmu.entries[p - 1], inputs) for p in fmu.positions("output")}
    outputs = SubElement(parent, "Outputs")
    for position, depends in needed.items():
        SubElement(outputs, "Unknown", index=str(position), dependencies=" ".join(map(str, depends)))
    initial = SubElement(parent, "InitialUnknowns")
    for position, depends in needed.items():
        at_start = sorted(parameters + depends)
        SubElement(initial, "Unknown", index=str(position), dependencies=" ".join(map(str, at_start)))


def needed_inputs(fmu: Interface, output: Entry, inputs: list[int]) -> list[int]:
    if output.variable.name not in fmu.depends:
        return inputs
    return [p for p in inputs if fmu.entries[p - 1].variable.name in fmu.depends[output.variable.name]]
