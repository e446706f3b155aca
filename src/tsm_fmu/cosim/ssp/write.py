"""Write a system as an SSP that every tool loads."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from ...logs.units import unit_to_si
from ...logs.whole_file import write_whole
from ...models.contract import InputError
from ..description import Description, describe
from ..start_values import start_values
from ..system import Component, Connection, Experiment, System
from .read import Case
from .xml import ANNOTATION, FMU_TYPE, PREFIXES, SSC, SSD, SSV, identifier

PARAMETER_SET = "initialValues"
"""One name for the parameter sets of all components: a tool that applies sets by name applies all."""
_FIXED_TIME = (1980, 1, 1, 0, 0, 0)


def write_ssp(path: Path, case: Case) -> Path:
    """Write a system to an archive; the same system gives the same bytes.

    Parameters
    ----------
    path : Path
        The ``.ssp`` file.
    case : (System, Experiment)
        The system; its name becomes an identifier.

    Raises
    ------
    InputError
        If the system does not name existing FMUs, a component's name is no identifier, or the file cannot be written.
    """
    system, experiment = case
    for component in system.components:
        if not component.name.isidentifier():
            raise InputError(
                f"component name {component.name!r} -- expected an identifier, which other tools read -- rename it"
            )
    resources = _resources(system)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        _add(archive, "SystemStructure.ssd", _ssd(system, experiment, resources))
        for fmu, member in resources.items():
            try:
                _add(archive, member, fmu.read_bytes())
            except OSError as failure:
                raise InputError(
                    f"FMU {fmu} -- expected a file that can be read ({failure.strerror}) -- build it again"
                ) from failure
    return write_whole(path, content.getvalue())


def _resources(system: System) -> dict[Path, str]:
    found: dict[Path, str] = {}
    for component in system.components:
        fmu = component.fmu.resolve()
        member = f"resources/{fmu.name}"
        if fmu not in found and member in found.values():
            member = f"resources/{component.name}-{fmu.name}"
        found.setdefault(fmu, member)
    return found


def _add(archive: zipfile.ZipFile, member: str, content: bytes) -> None:
    info = zipfile.ZipInfo(member, _FIXED_TIME)
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, content)


def _ssd(system: System, experiment: Experiment, resources: Mapping[Path, str]) -> bytes:
    name = identifier(system.name)
    root = etree.Element(f"{SSD}SystemStructureDescription", nsmap=PREFIXES, version="1.0", name=name)
    body = etree.SubElement(root, f"{SSD}System", name=name)
    described = {component.name: describe(component.fmu) for component in system.components}
    elements = etree.SubElement(body, f"{SSD}Elements")
    used: dict[str, None] = {}
    for component in system.components:
        description = described[component.name]
        node = etree.SubElement(
            elements, f"{SSD}Component", name=component.name, source=resources[component.fmu.resolve()], type=FMU_TYPE
        )
        _write_connectors(node, description, used)
        _write_parameters(node, component, description)
    if system.connections:
        connections = etree.SubElement(body, f"{SSD}Connections")
        for connection in system.connections:
            _write_connection(connections, connection, described)
    if used:
        units = etree.SubElement(root, f"{SSD}Units")
        for unit in used:
            _write_unit(units, unit)
    default = etree.SubElement(
        root, f"{SSD}DefaultExperiment", startTime=repr(experiment.start), stopTime=repr(experiment.stop)
    )
    note = etree.SubElement(etree.SubElement(default, f"{SSD}Annotations"), f"{SSC}Annotation", type=ANNOTATION)
    etree.SubElement(
        note,
        "experiment",
        {k: str(v) for k, v in asdict(experiment).items() if k not in ("start", "stop") and v is not None},
    )
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _write_connectors(node: Any, description: Description, used: dict[str, None]) -> None:
    connectors = etree.SubElement(node, f"{SSD}Connectors")
    for port in (*description.inputs, *description.outputs):
        connector = etree.SubElement(connectors, f"{SSD}Connector", name=port.name, kind=port.causality)
        kind = etree.SubElement(connector, SSC + port.kind)
        if port.kind == "Real" and port.unit:
            used[port.unit] = None
            kind.set("unit", port.unit)


def _write_unit(units: Any, name: str) -> None:
    unit = etree.SubElement(units, f"{SSC}Unit", name=name)
    try:
        si = unit_to_si(name)
        base = {k: str(int(power)) for k, power in si.base}
        etree.SubElement(unit, f"{SSC}BaseUnit", base, factor=repr(si.factor), offset=repr(si.offset))
    except InputError:  # an FMU's own unit that pint does not know: named, without a meaning
        etree.SubElement(unit, f"{SSC}BaseUnit")


def _write_parameters(node: Any, component: Component, description: Description) -> None:
    if not component.parameters:
        return
    binding = etree.SubElement(etree.SubElement(node, f"{SSD}ParameterBindings"), f"{SSD}ParameterBinding")
    values = etree.SubElement(binding, f"{SSD}ParameterValues")
    table = etree.SubElement(values, f"{SSV}ParameterSet", version="1.0", name=PARAMETER_SET)
    parameters = etree.SubElement(table, f"{SSV}Parameters")
    for name, value in start_values(component.name, description, component.parameters).items():
        text = (
            str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)
        )
        kind = description.ports[name].kind
        etree.SubElement(etree.SubElement(parameters, f"{SSV}Parameter", name=name), SSV + kind, value=text)


def _write_connection(connections: Any, connection: Connection, described: Mapping[str, Description]) -> None:
    ends: dict[str, str] = {}
    for end, address in (("start", connection.source), ("end", connection.target)):
        ends[f"{end}Element"], _, ends[f"{end}Connector"] = address.partition(".")
    node = etree.SubElement(connections, f"{SSD}Connection", ends)
    if not connection.convert_units or _takes_any(connection, described):
        node.set("suppressUnitConversion", "true")
    if (connection.factor, connection.offset) != (1.0, 0.0):
        etree.SubElement(
            node, f"{SSC}LinearTransformation", factor=repr(connection.factor), offset=repr(connection.offset)
        )
    if connection.values:
        _write_values(node, connection, described)


def _write_values(node: Any, connection: Connection, described: Mapping[str, Description]) -> None:
    component, _, variable = connection.source.partition(".")
    port = described[component].ports[described[component].elements(variable)[0]]
    kind = "Boolean" if port.kind == "Boolean" else "Integer"
    table = etree.SubElement(node, f"{SSC}{kind}MappingTransformation")
    for values in connection.values:
        written = [str(bool(v)).lower() if kind == "Boolean" else str(v) for v in values]
        etree.SubElement(table, f"{SSC}MapEntry", source=written[0], target=written[1])


def _takes_any(connection: Connection, described: Mapping[str, Description]) -> bool:
    """Whether a unit meets ``1``, which takes any here: other tools are told to take the number as it is."""
    units = []
    for address in (connection.source, connection.target):
        component, _, variable = address.partition(".")
        port = described[component].ports.get(variable) if component in described else None
        units.append("" if port is None else port.unit)
    return "1" in units and units[0] != units[1] and "" not in units
