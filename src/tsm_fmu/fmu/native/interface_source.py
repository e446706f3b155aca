"""C files of what a host sees of a model: names, bounds and start values of its variables."""

from __future__ import annotations

import math
from collections.abc import Iterable
from types import ModuleType

from ...models.contract import Variable, bounds_in_words, with_unit
from ..content import GUID_MARK
from ..description import Entry, Interface
from .arithmetic import literal_text
from .text import INDENT, quoted, wrapped
from .types import Array, Record, c_variable

_STRUCTS = {"parameter": "p", "input": "u", "output": "y"}


def interface_files(module: ModuleType, fmu: Interface, fmi: int) -> dict[str, str]:
    """C files of an FMU's variable table by name: ``constants.h`` and ``interface.c``."""
    return {"constants.h": _constants(fmu), "interface.c": _table(module, fmu, fmi)}


def _constants(fmu: Interface) -> str:
    first_input = len(fmu.positions("parameter"))
    first_output = first_input + len(fmu.positions("input"))
    places = {e.variable.name: n for n, e in enumerate(fmu.entries)}
    slack = (places["T_in"], places["T_out"]) if {"T_in", "T_out"} <= set(places) else (-1, 0)
    return (
        f"/* {fmu.name}: name, identity and layout of its variables. Written by tsm-fmu. */\n"
        "#ifndef TSM_FMU_CONSTANTS_H\n#define TSM_FMU_CONSTANTS_H\n\n"
        f'#define MODEL_NAME "{fmu.name}"\n#define MODEL_GUID "{GUID_MARK}"\n\n'
        "enum {\n"
        f"{INDENT}FIRST_INPUT = {first_input},\n"
        f"{INDENT}FIRST_OUTPUT = {first_output},\n"
        f"{INDENT}VARIABLES = {len(fmu.entries)},\n"
        f"{INDENT}MEASURED_TENSION = {slack[0]},  /* T_in; -1: no tension is estimated */\n"
        f"{INDENT}DISTAL_TENSION = {slack[1]}     /* T_out */\n"
        "};\n\n#endif\n"
    )


def _table(module: ModuleType, fmu: Interface, fmi: int) -> str:
    structs = (("parameter", module.Params), ("input", module.Inputs), ("output", module.Outputs))
    lines = [f"/* {fmu.name}: its variables, in the order of their value references. Written by tsm-fmu. */"]
    lines += ['#include "interface.h"', "", "const Variable model_variables[VARIABLES] = {"]
    places = [place for causality, fields in structs for place in _places(_STRUCTS[causality], Record(fields))]
    for entry, (place, count) in zip(fmu.entries, places, strict=True):
        lines += [f"{INDENT}{{{', '.join(_row(entry, place, count, fmi))}}},"]
    lines += ["};", "", "const Values model_start_values = {"]
    for causality, fields in structs:
        starts = [_number(e.variable, e.start or 0) for e in fmu.entries if e.causality == causality]
        lines += wrapped(f"{INDENT}{{{', '.join(_grouped(starts, Record(fields))) or '0'}}},")
    lines += ["};", ""]
    terms = [f"y->{place.partition('.')[2]}" for place, _ in _places("y", Record(module.Outputs))]
    lines += ["double model_outputs_sum(const Outputs *y)", "{", *wrapped(f"{INDENT}return {' + '.join(terms)};"), "}"]
    lines += ["", "void model_within_bounds(const Params *p)", "{", *_never_zero(fmu, module), "}"]
    return "\n".join(lines).rstrip() + "\n"


def _never_zero(fmu: Interface, module: ModuleType) -> Iterable[str]:
    """Statements for the parameters whose bounds exclude 0."""
    yield f"{INDENT}(void)p;"
    parameters = (e.variable for e in fmu.entries if e.causality == "parameter")
    for variable, (place, _) in zip(parameters, _places("p", Record(module.Params)), strict=True):
        q = variable.quantity
        positive, negative = q.lo > 0.0 or (q.lo == 0.0 and q.open_lo), q.hi < 0.0 or (q.hi == 0.0 and q.open_hi)
        if variable.kind is float and (positive or negative):
            yield f"{INDENT}NEVER(p->{place.partition('.')[2]} == 0.0);"


def _row(entry: Entry, place: str, count: int, fmi: int) -> Iterable[str]:
    variable, quantity = entry.variable, entry.variable.quantity
    yield from (quoted(variable.name), quoted(with_unit("", quantity.unit).rstrip()), quoted(quantity.meaning))
    yield quoted(bounds_in_words(quantity))
    choice = bool(quantity.choices) and fmi == 3  # FMI 2.0 reads and sets a choice as an Integer
    yield "REAL" if variable.kind is float else "ENUMERATION" if choice else "INTEGER"
    yield f"offsetof(Values, {place})"
    yield str(count if fmi == 3 else 1)
    yield from (_bound(quantity.lo), _bound(quantity.hi))
    yield from (str(bound).lower() for bound in (quantity.open_lo, quantity.open_hi))


def _places(struct: str, record: Record) -> Iterable[tuple[str, int]]:
    """How C reaches each number, and how many there are in the FMI 3.0 variable that begins with it."""
    for field, kind in record.fields.items():
        if isinstance(kind, Array):
            yield from ((f"{struct}.{c_variable(field)}.item[{n}]", 0 if n else kind.size) for n in range(kind.size))
        else:
            yield f"{struct}.{c_variable(field)}", 1


def _grouped(numbers: list[str], record: Record) -> Iterable[str]:
    """Numbers of a struct, those of an array in braces."""
    left = iter(numbers)
    for kind in record.fields.values():
        if isinstance(kind, Array):
            yield f"{{{{{', '.join(next(left) for _ in range(kind.size))}}}}}"
        else:
            yield next(left)


def _bound(number: float) -> str:
    return literal_text(float(number))


def _number(variable: Variable, number: float) -> str:
    if not math.isfinite(number):
        raise ValueError(f"start of {variable.name} = {number!r}")
    return repr(float(number)) if variable.kind is float else str(int(number))
