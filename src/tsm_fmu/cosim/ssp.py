"""System Structure and Parameterization (SSP 1.0): write and read systems with their FMUs in one archive.

One archive holds one system or several variants of it: ``SystemStructure.ssd`` is the first, further ``.ssd``
files beside it are the others, as SSP provides. Start and stop time are SSP's default experiment; what SSP has
no place for (communication step, method, evaluation) is an annotation of type ``tsm-fmu.experiment``.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from ..logs.units import unit_to_si
from ..models.contract import InputError
from .description import Description, describe
from .start_values import start_values
from .system import Component, Connection, Experiment, System, Value
from .unpack import unpacked

Case = tuple[System, Experiment]

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSC, SSV = (f"{{{_SSP}{part}}}" for part in ("Description", "Common", "ParameterValues"))
_PREFIXES: Any = {"ssd": SSD[1:-1], "ssc": SSC[1:-1], "ssv": SSV[1:-1]}
_ANNOTATION = "tsm-fmu.experiment"
_FMU_TYPE = "application/x-fmu-sharedlibrary"
_FIXED_TIME = (1980, 1, 1, 0, 0, 0)


def write_ssp(path: Path, cases: Mapping[str, Case]) -> Path:
    """Write systems that share FMUs to one archive; the same systems give the same bytes.

    Parameters
    ----------
    path : Path
        The ``.ssp`` file.
    cases : mapping of str to (System, Experiment)
        By variant name; the first becomes ``SystemStructure.ssd``.

    Raises
    ------
    InputError
        If a system does not name existing FMUs or the file cannot be written.
    """
    resources = _resources(system for system, _ in cases.values())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for k, (name, case) in enumerate(cases.items()):
                member = "SystemStructure.ssd" if k == 0 else f"{name}.ssd"
                _add(archive, member, _ssd(name, *case, resources))
            for fmu, member in resources.items():
                _add(archive, member, fmu.read_bytes())
    except OSError as failure:
        raise InputError(
            f"{path} -- expected a file that can be written ({failure.strerror}) -- choose another place"
        ) from failure
    return path


@contextmanager
def open_ssp(path: Path) -> Iterator[dict[str, Case]]:
    """Unpack an SSP and yield its systems by variant name; their FMUs exist as long as the context.

    Raises
    ------
    InputError
        No such file, damaged, or a structure that is not supported (nested systems, parameter or type
        mappings, components that are not FMUs): each named.
    """
    if not path.is_file():
        raise InputError(f"SSP {path} -- expected an existing .ssp file -- check the path")
    with unpacked(path, "SSP") as folder:
        files = sorted(folder.glob("*.ssd"), key=lambda f: (f.name != "SystemStructure.ssd", f.name))
        if not files or files[0].name != "SystemStructure.ssd":
            raise InputError(f"SSP {path} has no SystemStructure.ssd -- expected one in its root -- export it again")
        yield {
            root.get("name") or file.stem: _case(path, folder, root) for file in files for root in [_parse(path, file)]
        }


def _resources(systems: Iterator[System]) -> dict[Path, str]:
    found: dict[Path, str] = {}
    for system in systems:
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


def _ssd(name: str, system: System, experiment: Experiment, resources: Mapping[Path, str]) -> bytes:
    root = etree.Element(f"{SSD}SystemStructureDescription", nsmap=_PREFIXES, version="1.0", name=name)
    body = etree.SubElement(root, f"{SSD}System", name=system.name)
    elements = etree.SubElement(body, f"{SSD}Elements")
    used: dict[str, None] = {}
    for component in system.components:
        description = describe(component.fmu)
        node = etree.SubElement(
            elements, f"{SSD}Component", name=component.name, source=resources[component.fmu.resolve()], type=_FMU_TYPE
        )
        _write_connectors(node, description, used)
        _write_parameters(node, component, description)
    if system.connections:
        connections = etree.SubElement(body, f"{SSD}Connections")
        for connection in system.connections:
            _write_connection(connections, connection)
    if used:
        units = etree.SubElement(root, f"{SSD}Units")
        for unit in used:
            _write_unit(units, unit)
    default = etree.SubElement(
        root, f"{SSD}DefaultExperiment", startTime=repr(experiment.start), stopTime=repr(experiment.stop)
    )
    note = etree.SubElement(etree.SubElement(default, f"{SSD}Annotations"), f"{SSC}Annotation", type=_ANNOTATION)
    etree.SubElement(
        note, "experiment", {k: str(v) for k, v in asdict(experiment).items() if k not in ("start", "stop")}
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
    table = etree.SubElement(values, f"{SSV}ParameterSet", version="1.0", name=f"{component.name} parameters")
    parameters = etree.SubElement(table, f"{SSV}Parameters")
    for name, value in start_values(component.name, description, component.parameters).items():
        text = (
            str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)
        )
        kind = description.ports[name].kind
        etree.SubElement(etree.SubElement(parameters, f"{SSV}Parameter", name=name), SSV + kind, value=text)


def _write_connection(connections: Any, connection: Connection) -> None:
    ends: dict[str, str] = {}
    for end, address in (("start", connection.source), ("end", connection.target)):
        ends[f"{end}Element"], _, ends[f"{end}Connector"] = address.partition(".")
    node = etree.SubElement(connections, f"{SSD}Connection", ends)
    if not connection.convert_units:
        node.set("suppressUnitConversion", "true")
    if (connection.factor, connection.offset) != (1.0, 0.0):
        etree.SubElement(
            node, f"{SSC}LinearTransformation", factor=repr(connection.factor), offset=repr(connection.offset)
        )


def _parse(path: Path, file: Path) -> Any:
    try:
        parser = etree.XMLParser(resolve_entities=False, no_network=True)
        root = etree.parse(file, parser).getroot()
    except (etree.XMLSyntaxError, OSError) as failure:
        reason = " ".join(str(failure).split())
        raise InputError(
            f"SSP {path}: {file.name} cannot be read ({reason}) -- expected XML -- export it again"
        ) from failure
    if etree.QName(root).localname not in ("SystemStructureDescription", "ParameterSet"):
        raise InputError(
            f"SSP {path}: {file.name} has the root {root.tag!r} -- expected an SSP 1.0 description -- export it again"
        )
    return root


def _case(path: Path, folder: Path, root: Any) -> Case:
    body = root.find(f"{SSD}System")
    if body is None:
        raise InputError(f"SSP {path} has no System element -- expected one of SSP 1.0 -- export it as SSP 1.0")
    _refuse(path, body, f"{SSD}Elements/{SSD}System", "nested system", "flatten it")
    _refuse(path, body, f"{SSD}Elements/{SSD}SignalDictionaryReference", "signal dictionary", "connect directly")
    _refuse(path, body, f".//{SSD}ParameterMapping", "parameter mapping", "name the variables themselves")
    components = [_component(path, folder, node) for node in body.iterfind(f"{SSD}Elements/{SSD}Component")]
    connections = [
        _connection(path, node)
        for node in body.iterfind(f"{SSD}Connections/{SSD}Connection")
        if node.get("endElement")  # an output of the whole system leads nowhere here
    ]
    system = System(tuple(components), tuple(connections), body.get("name") or root.get("name") or path.stem)
    values: dict[str, Value] = {}
    for binding in body.iterfind(f"{SSD}ParameterBindings/{SSD}ParameterBinding"):
        values |= _values(path, folder, binding)
    return system.with_values(values), _experiment(path, root, system)


def _refuse(path: Path, node: Any, what: str, name: str, remedy: str) -> None:
    if node.find(what) is not None:
        raise InputError(f"SSP {path} has a {name} -- expected one flat system of FMUs -- {remedy}")


def _component(path: Path, folder: Path, node: Any) -> Component:
    name, source = node.get("name") or "", node.get("source") or ""
    fmu = (folder / unquote(source)).resolve()
    if node.get("type", _FMU_TYPE) != _FMU_TYPE or not fmu.is_relative_to(folder) or not fmu.is_file():
        raise InputError(
            f"SSP {path}: component {name!r} with source {source!r} -- expected an FMU inside the archive -- pack it in"
        )
    values: dict[str, Value] = {}
    for binding in node.iterfind(f"{SSD}ParameterBindings/{SSD}ParameterBinding"):
        values |= _values(path, folder, binding)
    return Component(name, fmu, values)


def _values(path: Path, folder: Path, binding: Any) -> dict[str, Value]:
    prefix, source = binding.get("prefix") or "", binding.get("source")
    table = binding.find(f"{SSD}ParameterValues/{SSV}ParameterSet")
    if source is not None:
        file = (folder / unquote(source)).resolve()
        if not file.is_relative_to(folder) or not file.is_file():
            raise InputError(
                f"SSP {path}: parameter source {source!r} -- expected a file inside the archive -- pack it in"
            )
        table = _parse(path, file)
    found: dict[str, Value] = {}
    for parameter in [] if table is None else table.iterfind(f"{SSV}Parameters/{SSV}Parameter"):
        value = next((child.get("value") for child in parameter if child.get("value") is not None), None)
        if value is None or not parameter.get("name"):
            raise InputError(
                f"SSP {path}: parameter {parameter.get('name')!r} -- expected a name and a value -- export it again"
            )
        found[prefix + parameter.get("name")] = value
    return found


def _connection(path: Path, node: Any) -> Connection:
    source, target = (f"{node.get(f'{end}Element')}.{node.get(f'{end}Connector')}" for end in ("start", "end"))
    if not node.get("startElement"):
        raise InputError(
            f"SSP {path}: {target} is connected to the system input {node.get('startConnector')!r} -- expected a "
            "source inside -- add an FMU that drives it"
        )
    for child in node:
        if etree.QName(child).localname.endswith("MappingTransformation"):
            raise InputError(
                f"SSP {path}: connection {source} -> {target} has a value mapping -- expected a linear one "
                "-- put an FMU that maps the values between"
            )
    linear = node.find(f"{SSC}LinearTransformation")
    linear = {} if linear is None else linear.attrib
    return Connection(
        source,
        target,
        _number(path, linear.get("factor", "1")),
        _number(path, linear.get("offset", "0")),
        node.get("suppressUnitConversion") not in ("true", "1"),
    )


def _number(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"SSP {path}: {text!r} -- expected a number -- export it again") from None


def _experiment(path: Path, root: Any, system: System) -> Experiment:
    default = root.find(f"{SSD}DefaultExperiment")
    times = {} if default is None else default.attrib
    note = root.find(f"{SSD}DefaultExperiment/{SSD}Annotations/{SSC}Annotation[@type='{_ANNOTATION}']/experiment")
    written = {} if note is None else dict(note.attrib)
    values: dict[str, Any] = {"start": times.get("startTime", "0"), "stop": times.get("stopTime", "1"), **written}
    values.setdefault("step", _suggested_step(system))
    numeric = {f.name for f in fields(Experiment) if f.type == "float"}
    known: dict[str, Any] = {k: _number(path, v) if k in numeric else v for k, v in values.items() if k in _EXPERIMENT}
    return Experiment(**known)


_EXPERIMENT = {f.name for f in fields(Experiment)}


def _suggested_step(system: System) -> str:
    """Smallest step that an FMU of the system proposes; 1 ms if none does."""
    proposed = [describe(c.fmu).model.defaultExperiment for c in system.components]
    steps = [float(e.stepSize) for e in proposed if e is not None and e.stepSize]
    return repr(min(steps, default=1e-3))
