"""Joint conditions of parameters in C: the margins are functions of the kernel, the sentences its texts."""

from __future__ import annotations

import string
from collections.abc import Iterable, Iterator
from typing import Any

from .source import source
from .text import INDENT, quoted, wrapped
from .types import INT, Array, Record, Type, c_variable
from .unit import Law, Unit

CHECK = "void model_check(const Params *p, Fault *fault)"
WARNINGS = "void model_warnings(const Params *p, void (*tell)(void *whom, const char *text), void *whom, Fault *fault)"


class Conditions:
    """Conditions of one kernel; their functions are part of its unit."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self._declared = [(c, self._own(c)) for c in getattr(unit.module, "CONDITIONS", ())]
        self._margins = [self._law(c.margin, own) for c, own in self._declared]
        self._numbers = [{n: self._law(f, own) for n, f in c.numbers.items()} for c, own in self._declared]

    def _own(self, condition: Any) -> Record:
        """Parameters that a condition is about: the kernel's, or in a chain those of one effect."""
        params = Record(self.unit.module.Params)
        if condition.part is None:
            return params
        part = self._law(condition.part, params).returns
        assert isinstance(part, Record)
        return part

    def _law(self, function: Any, kind: Record) -> Law:
        nowhere = source(self.unit.module.step, self.unit.module)
        return self.unit.law(function, [kind], self.unit.arithmetic, nowhere, nowhere.tree)

    def functions(self) -> Iterator[str]:
        """``model_check`` and ``model_warnings``."""
        yield from (*wrapped(CHECK), "{", *self._body(warning=False), "}", "")
        yield from (*wrapped(WARNINGS), "{", *self._body(warning=True), "}")

    def _body(self, warning: bool) -> Iterable[str]:
        numbered = [n for n, (c, _) in enumerate(self._declared) if bool(c.consequence) == warning]
        if not numbered:
            return [f"{INDENT}(void)p, (void)fault;" + (" (void)tell, (void)whom;" if warning else "")]
        lines = [f"{INDENT}char text[1024];"] if warning else []
        for n in numbered:
            lines += self._one(n, warning)
        return lines

    def _one(self, number: int, warning: bool) -> Iterator[str]:
        condition, own = self._declared[number]
        margin = self._margins[number]
        yield from wrapped(f"{INDENT}if (!fault->raised) {{  /* {condition.expected.replace('*/', '* /')} */")
        deeper = INDENT * 2
        given = "*p"
        if condition.part is not None:
            part = self._law(condition.part, Record(self.unit.module.Params))
            yield f"{deeper}{self.unit.type_name(own, self.unit.arithmetic)} own = {part.called('*p')};"
            given = "own"
        yield f"{deeper}double margin = {margin.called(given)};"
        bound = "margin >= 0.0" if condition.closed else "margin > 0.0"
        format_, values = self._sentence(number, "own." if given == "own" else "p->", given)
        arguments = "".join(f", {value}" for value in values)
        yield f"{deeper}if (!fault->raised && !({bound})) {{"
        if warning:
            yield from wrapped(f"{deeper}{INDENT}sentence_put(text, sizeof text, {format_}{arguments});")
            yield f"{deeper}{INDENT}tell(whom, text);"
        else:
            yield from wrapped(f"{deeper}{INDENT}fault_raise(fault, {format_}{arguments});")
        yield from (f"{deeper}}}", f"{INDENT}}}")

    def _sentence(self, number: int, owner: str, given: str) -> tuple[str, list[str]]:
        """Format and arguments of the line about parameters that do not meet it."""
        condition, own = self._declared[number]
        middle = condition.consequence or f"expected {condition.expected}"
        text, values = "", []
        fields = dict(_fields(own))
        for literal, name, spec, conversion in string.Formatter().parse(
            " -- ".join((condition.what, middle, condition.remedy))
        ):
            text += literal.replace("%", "%%")
            if name is None:
                continue
            if name == "margin":
                value, kind = "margin", None
            elif name in self._numbers[number]:
                value, kind = self._numbers[number][name].called(given), self._numbers[number][name].returns
            else:
                place, kind = fields[name]
                value = f"{owner}{place}"
            if kind == INT and not spec:
                text += "%d"
            else:
                text += f"%{spec}" if spec else "%r"
                value = f"(double){value}" if kind == INT else value
            assert conversion in (None, "r", "")
            values.append(value)
        return quoted(text), values


def _fields(record: Record) -> Iterator[tuple[str, tuple[str, Type]]]:
    """Public name, place in C and type of each number."""
    for field, kind in record.fields.items():
        name = field.rstrip("_").replace("__", ".")
        if isinstance(kind, Array):
            yield from ((f"{name}_{n + 1}", (f"{c_variable(field)}.item[{n}]", kind.item)) for n in range(kind.size))
        else:
            yield name, (c_variable(field), kind)
