"""What a co-simulation needs to know of an FMU before it loads it: ports, types, units, direct feed-through."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import fmpy

from ..models.contract import InputError

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


@dataclass(frozen=True)
class Port:
    """One scalar variable of an FMU.

    Attributes
    ----------
    name, fmi_type, kind : str
        Variable name, type as the FMU declares it, and one of Real, Integer, Boolean, String.
    causality, variability : str
        As in the model description.
    unit : str
        Declared unit; empty if none.
    reference : int
        Value reference.
    start : str or None
        Start value as written.
    """

    name: str
    fmi_type: str
    kind: str
    causality: str
    variability: str
    unit: str
    reference: int
    start: str | None


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
        """Scalar variables by name; arrays, binaries and clocks (FMI 3.0) are left out."""
        found = {}
        for v in self.model.modelVariables:
            if v.type in KINDS and not v.dimensions:
                unit = v.unit or (v.declaredType.unit if v.declaredType is not None else None) or ""
                found[v.name] = Port(
                    v.name,
                    v.type,
                    KINDS[v.type],
                    v.causality or "local",
                    v.variability or "",
                    unit,
                    v.valueReference,
                    v.start,
                )
        return found

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
            unknown.variable.name: frozenset(inputs & {v.name for v in unknown.dependencies})
            for unknown in self.model.outputs
            if unknown.variable is not None and unknown.dependencies is not None
        }


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
    if not zipfile.is_zipfile(path):
        raise InputError(f"FMU {path} -- expected a zip archive -- the file is damaged or not an FMU; get it again")
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
    return Description(path, model)


def _one_line(failure: Exception) -> str:
    return " ".join(str(failure).split()) or type(failure).__name__
