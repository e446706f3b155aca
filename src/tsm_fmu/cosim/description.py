"""What a co-simulation needs to know of an FMU before it loads it: ports, types, units, direct feed-through."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from pathlib import Path
from typing import Any

import fmpy

from ..models.contract import InputError
from .unpack import opened

KINDS = {
    "Real": "Real",
    "Float64": "Real",
    "Float32": "Real",
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Integer",
    "Integer": "Integer",
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
"""FMI 2.0 and 3.0 type name to the four kinds that a connection may join."""

MOST_ELEMENTS = 10_000
"""An array with more elements is left out: each would be a column."""

_LIBRARY = re.compile(r"[A-Za-z0-9_.+-]*[A-Za-z0-9_]")


@dataclass(frozen=True)
class Port:
    """One scalar variable of an FMU, or one element of an array (FMI 3.0).

    Attributes
    ----------
    name, fmi_type, kind : str
        Name (``A[1,2]`` for an element, counted from 1), type as the FMU declares it, and one of Real, Integer,
        Boolean, String.
    causality, variability : str
        As in the model description.
    unit : str
        Declared unit; empty if none.
    reference : int
        Value reference of the variable.
    start : str or None
        Start value as written.
    array : str
        Name of the array that this is an element of; empty for a scalar.
    initial : str
        Whether an output has a start value: exact, approx or calculated.
    """

    name: str
    fmi_type: str
    kind: str
    causality: str
    variability: str
    unit: str
    reference: int
    start: str | None
    array: str = ""
    initial: str = ""


@dataclass(frozen=True)
class Description:
    """Co-simulation interface of the FMU at `path`, read by `describe`."""

    path: Path
    model: Any

    @property
    def fmi(self) -> int:
        """Major version of FMI."""
        return self.model.fmiMajorVersion

    @property
    def variable_step(self) -> bool:
        return bool(self.model.coSimulation.canHandleVariableCommunicationStepSize)

    @cached_property
    def ports(self) -> dict[str, Port]:
        """Scalar variables and elements of arrays by name; `left_out` are not among them."""
        return {port.name: port for v in self.model.modelVariables if _usable(v) for port in _ports(v)}

    @cached_property
    def arrays(self) -> dict[str, tuple[str, ...]]:
        """Names of the elements of each array (FMI 3.0), last index fastest, as FMI hands them over."""
        found: dict[str, list[str]] = {}
        for port in self.ports.values():
            if port.array:
                found.setdefault(port.array, []).append(port.name)
        return {name: tuple(elements) for name, elements in found.items()}

    @cached_property
    def left_out(self) -> dict[str, str]:
        """Outputs that no table of numbers can hold, by name: what they are."""
        outputs = [v for v in self.model.modelVariables if v.causality == "output"]
        unusable = {
            v.name: v.type if v.type not in KINDS else f"array of {_size(v)}" for v in outputs if not _usable(v)
        }
        return unusable | {p.name: "String" for p in self.outputs if p.kind == "String"}

    def elements(self, name: str) -> tuple[str, ...]:
        """The elements of an array; of a scalar itself."""
        return self.arrays.get(name, (name,))

    def items(self, port: Port) -> dict[str, int]:
        """Items of an Enumeration by name; empty for any other type."""
        name = port.array or port.name
        declared = next((v.declaredType for v in self.model.modelVariables if v.name == name), None)
        return {item.name: int(item.value) for item in getattr(declared, "items", None) or ()}

    @cached_property
    def units(self) -> Mapping[str, Any]:
        """The FMU's own unit definitions that have a meaning, by name: FMPy's ``BaseUnit``."""
        return {u.name: u.baseUnit for u in self.model.unitDefinitions if u.baseUnit is not None}

    @cached_property
    def inputs(self) -> tuple[Port, ...]:
        return tuple(p for p in self.ports.values() if p.causality == "input")

    @cached_property
    def outputs(self) -> tuple[Port, ...]:
        return tuple(p for p in self.ports.values() if p.causality == "output")

    @cached_property
    def feedthrough(self) -> dict[str, frozenset[str]]:
        """Inputs on which each output depends directly.

        From the model structure; where an FMU leaves the dependencies out, FMI says: on all inputs.
        """
        inputs = frozenset(p.name for p in self.inputs)
        return {p.name: inputs for p in self.outputs} | self.declared_feedthrough

    @cached_property
    def declared_feedthrough(self) -> dict[str, frozenset[str]]:
        """The part of `feedthrough` that the FMU states itself."""
        inputs = {p.name for p in self.inputs}
        return {
            output: frozenset(inputs & {e for v in unknown.dependencies for e in self.elements(v.name)})
            for unknown in self.model.outputs
            if unknown.variable is not None and unknown.dependencies is not None
            for output in self.elements(unknown.variable.name)
        }


def _size(variable: Any) -> int:
    return math.prod(variable.shape or ())


def _usable(variable: Any) -> bool:
    return variable.type in KINDS and _size(variable) <= MOST_ELEMENTS


def _ports(variable: Any) -> list[Port]:
    """One port for a scalar, one for each element of an array."""
    v = variable
    unit = v.unit or (v.declaredType.unit if v.declaredType is not None else None) or ""
    common = (v.type, KINDS[v.type], v.causality or "local", v.variability or "", unit, v.valueReference)
    if not v.dimensions:
        return [Port(v.name, *common, v.start, initial=v.initial or "")]
    starts = [v.start] if v.start is None or KINDS[v.type] == "String" else str(v.start).split()
    if len(starts) != _size(v):  # one value for all elements
        starts = starts[:1] * _size(v)
    indices = product(*(range(1, n + 1) for n in v.shape))
    return [
        Port(f"{v.name}[{','.join(map(str, index))}]", *common, start, v.name, v.initial or "")
        for index, start in zip(indices, starts, strict=True)
    ]


def describe(path: Path | str) -> Description:
    """Read the model description of a co-simulation FMU.

    Raises
    ------
    InputError
        No such file, not an FMU, damaged, FMI 1.0, or without a co-simulation interface.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"FMU {path} -- expected an existing .fmu file -- build it with 'tsm-fmu build'")
    state = path.stat()
    return _described(path, state.st_mtime_ns, state.st_ctime_ns, state.st_size, state.st_ino)


@lru_cache(maxsize=256)
def _described(path: Path, *_state: int) -> Description:
    """Of a file in this state, read once: a sweep asks for it at every point."""
    if not zipfile.is_zipfile(path):
        raise InputError(f"FMU {path} -- expected a zip archive -- the file is damaged or not an FMU; get it again")
    with opened(path):
        pass  # of sensible size and paths: the reader below asks for neither
    try:
        model = fmpy.read_model_description(path, validate=False)
        version = model.fmiMajorVersion
    except Exception as failure:
        raise InputError(
            f"FMU {path} has no readable modelDescription.xml ({_one_line(failure)}) -- expected an FMI 2.0 or 3.0 "
            "unit -- check it with 'tsm-fmu validate'"
        ) from failure
    if version not in (2, 3):
        raise InputError(f"FMU {path} is FMI {model.fmiVersion} -- expected FMI 2.0 or 3.0 -- export it again")
    if model.coSimulation is None:
        raise InputError(f"FMU {path} has no co-simulation interface -- expected one -- export it for co-simulation")
    library = model.coSimulation.modelIdentifier or ""
    if not _LIBRARY.fullmatch(library) or ".." in library:  # it names the library that is loaded
        raise InputError(f"FMU {path} has the modelIdentifier {library!r} -- expected a plain name -- do not use it")
    return Description(path, model)


def _one_line(failure: Exception) -> str:
    return " ".join(str(failure).split()) or type(failure).__name__
