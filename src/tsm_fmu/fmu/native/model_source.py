"""C files of one model: its declarations, its equations, their derivatives."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from functools import cache
from typing import Any

from ...kernels.kernel import Kernel
from .asked import Law
from .conditions import CHECK, WARNINGS, Conditions
from .text import INDENT, wrapped
from .types import FLOAT, INT, Array, Record, Type, c_variable
from .unit import MAIN, Unit, units

_WRITTEN = "Written by tsm-fmu from its Python text: same names, same operations in the same order."


@cache
def model_files(kernel: Kernel) -> dict[str, str]:
    """C files of a kernel by name: ``model.h``, ``<name>.c`` and ``<name>_derivatives.c``.

    Raises
    ------
    InputError
        For a kernel outside the subset of Python that can be translated: file, line and reason.
    """
    plain, dual = units(kernel.module)
    return {
        "model.h": _text(_header(kernel, plain)),
        f"{kernel.name}.c": _text(_equations(kernel, plain)),
        f"{kernel.name}_derivatives.c": _text(_derivatives(kernel, dual)),
    }


START = "void model_start(const Params *p, const Inputs *u, State *s, Outputs *y, Fault *fault)"
STEP = (
    "void model_step(const Params *p, const State *s, const Inputs *u, double dt, State *after, Outputs *y, "
    "Fault *fault)"
)
START_DERIVATIVE = (
    "void model_start_derivative(const Params *p, const Inputs *u, const Params *dp, const Inputs *du, "
    "State *ds, Outputs *dy, Fault *fault)"
)
STEP_DERIVATIVE = (
    "void model_step_derivative(const Params *p, const State *s, const Inputs *u, double dt, const Params *dp, "
    "const State *ds, const Inputs *du, State *dafter, Outputs *dy, Fault *fault)"
)


def _header(kernel: Kernel, unit: Unit) -> Iterable[str]:
    yield f"/* {kernel.name}: what the model is made of. {_WRITTEN} */"
    yield from ("#ifndef TSM_FMU_MODEL_H", "#define TSM_FMU_MODEL_H", "", '#include "checked.h"', "")
    records = [Record(getattr(kernel.module, name)) for name in MAIN]
    inner = {kind for record in records for kind in record.fields.values() if not _is_scalar(kind)}
    for kind in sorted(inner, key=repr):
        yield from unit.struct(kind)
    for record in records:
        yield from (*unit.struct(record), "")
    yield "/* State and outputs at the first input. */"
    yield from wrapped(f"{START};")
    yield "/* State and outputs after a step of dt seconds, over which the inputs hold. */"
    yield from wrapped(f"{STEP};")
    yield "/* Joint conditions of the parameters: a fault where one is not met; a text for each that only warns. */"
    yield from wrapped(f"{CHECK};")
    yield from wrapped(f"{WARNINGS};")
    yield "/* Change of state and outputs along a change of parameters, state and inputs: forward differentiation. */"
    yield from wrapped(f"{START_DERIVATIVE};")
    yield from wrapped(f"{STEP_DERIVATIVE};")
    yield from ("", "#endif")


def _equations(kernel: Kernel, unit: Unit) -> Iterable[str]:
    conditions = Conditions(unit)
    text = (inspect.getdoc(kernel.module) or kernel.name).replace("*/", "* /").splitlines()
    yield f"/* {kernel.name}: {text[0]}"
    yield from (f" * {line}".rstrip() for line in [*text[1:], "", _WRITTEN])
    yield from (" */", '#include "model.h"', "")
    yield from (*unit.declarations(), *unit.functions(), "", "")
    yield from _entry(unit, START, unit.start, ["*p", "*u"], "s")
    yield ""
    yield from _entry(unit, STEP, unit.step, ["*p", "*s", "*u", "dt"], "after")
    yield from ("", *conditions.functions())


def _entry(unit: Unit, prototype: str, law: Law, arguments: list[str], state: str) -> Iterable[str]:
    result = unit.type_name(unit.start.returns or FLOAT, unit.arithmetic)
    yield from (*wrapped(prototype), "{")
    yield f"{INDENT}const {result} both = {law.called(*arguments)};"
    if not law.fails:
        yield f"{INDENT}(void)fault;"
    yield from (f"{INDENT}*{state} = both.item0;", f"{INDENT}*y = both.item1;", "}")


def _derivatives(kernel: Kernel, unit: Unit) -> Iterable[str]:
    yield f"/* {kernel.name}: derivatives, by the same equations in numbers that carry one (dual.h)."
    yield from (" *", f" * {_WRITTEN} Read {kernel.name}.c.", " */")
    yield from ('#include "dual.h"', '#include "model.h"', "")
    yield from (*unit.declarations(), *unit.functions(), "", "")
    for name in MAIN[:3]:
        yield from (*_joined(unit, Record(getattr(unit.module, name)), name), "")
    for name in (MAIN[1], MAIN[3]):
        yield from (*_derivative_of(unit, Record(getattr(unit.module, name)), name), "")
    result = unit.type_name(unit.start.returns or FLOAT, unit.arithmetic)
    made = {"Params": "p", "State": "s", "Inputs": "u"}
    for law, prototype, needed, state in (
        (unit.start, START_DERIVATIVE, ("Params", "Inputs"), "ds"),
        (unit.step, STEP_DERIVATIVE, ("Params", "State", "Inputs"), "dafter"),
    ):
        yield from (*wrapped(prototype), "{")
        for name in needed:
            value = made[name]
            yield f"{INDENT}const {name}{unit.arithmetic.suffix} {value}_dual = with_{name}({value}, d{value});"
        given = [*(f"{made[name]}_dual" for name in needed), *(["dual(dt)"] if law is unit.step else [])]
        yield from wrapped(f"{INDENT}const {result} both = {law.called(*given)};")
        if not law.fails:
            yield f"{INDENT}(void)fault;"
        yield f"{INDENT}*{state} = derivative_of_State(&both.item0);"
        yield from (f"{INDENT}*dy = derivative_of_Outputs(&both.item1);", "}", "")


def _joined(unit: Unit, record: Record, name: str) -> Iterable[str]:
    """A function that puts values and derivatives together."""
    made = unit.type_name(record, unit.arithmetic)
    yield f"COLD static {made} with_{name}(const {name} *value, const {name} *change)"
    yield from ("{", f"{INDENT}{made} made;")
    if not record.fields:
        yield f"{INDENT}(void)value, (void)change;"
        yield f"{INDENT}made.none = 0;"
    for place, kind, loop in _places(record):
        item = f"dual_of(value->{place}, change->{place})" if kind == FLOAT else f"value->{place}"
        yield f"{INDENT}{loop}made.{place} = {item};"
    if record.fields and all(kind == INT for _, kind, _ in _places(record)):
        yield f"{INDENT}(void)change;"
    yield from (f"{INDENT}return made;", "}")


def _derivative_of(unit: Unit, record: Record, name: str) -> Iterable[str]:
    made = unit.type_name(record, unit.arithmetic)
    yield f"COLD static {name} derivative_of_{name}(const {made} *value)"
    yield from ("{", f"{INDENT}{name} made;")
    places = list(_places(record)) or [("none", INT, "")]
    if all(kind == INT for _, kind, _ in places):
        yield f"{INDENT}(void)value;"
    for place, kind, loop in places:
        yield f"{INDENT}{loop}made.{place} = {f'value->{place}.d' if kind == FLOAT else '0'};"
    yield from (f"{INDENT}return made;", "}")


def _places(record: Record) -> Iterable[tuple[str, Type, str]]:
    """How C reaches each number of a struct, its type, and the loop over those of an array."""
    for field, kind in record.fields.items():
        name = c_variable(field)
        if isinstance(kind, Array):
            yield f"{name}.item[k]", kind.item, f"for (int k = 0; k < {kind.size}; k++) "
        else:
            yield name, kind, ""


def _is_scalar(kind: Any) -> bool:
    return kind in (FLOAT, INT)


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines).rstrip() + "\n"
