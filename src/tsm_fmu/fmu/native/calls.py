"""Calls in a kernel: of other laws, of named-tuple classes, of `math` and of the few built-in functions."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
from types import FunctionType
from typing import Any

from .arithmetic import FAILING, SAFE, Value, call
from .operators import NUMBERS, Operators
from .types import BOOL, FLOAT, INT, NOTHING, WHOLE, Record, Scalar, c_variable, is_record, items_of, of_hint


class Expressions(Operators):
    """Translates the expressions of one function."""

    def _call(self, node: ast.Call) -> Value:
        called = self._called(node.func)
        if is_record(called):
            return self._record(called, node)
        if isinstance(called, FunctionType):
            return self._law(called, node)
        if called is None:
            self.source.refuse(node, f"a call of {ast.unparse(node.func)}")
        if node.keywords:
            self.source.refuse(node, "keywords in a call of a built-in function")
        arguments = self._spread(node.args)
        name = getattr(called, "__name__", "")
        if getattr(math, name, None) is called:
            return self._math(name, arguments, node)
        if getattr(builtins, name, None) is called:
            return self._builtin(name, arguments, node)
        self.source.refuse(node, f"a call of {ast.unparse(node.func)}")

    def _called(self, node: ast.expr) -> Any:
        known = self.source.known
        if isinstance(node, ast.Name) and c_variable(node.id) not in self.locals:
            return known.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            return getattr(known.get(node.value.id), node.attr, None)
        return None

    def _bound(self, signature: inspect.Signature, node: ast.Call) -> list[Value]:
        """Arguments in the order of the parameters, defaults put in."""
        keywords = {k.arg: self.value(k.value) for k in node.keywords if k.arg is not None}
        try:
            bound = signature.bind(*self._spread(node.args), **keywords)
        except TypeError as failure:
            self.source.refuse(node, f"a call that does not fit ({failure})")
        found: list[Value] = []
        for name, parameter in signature.parameters.items():
            value = bound.arguments.get(name, parameter.default)
            if isinstance(value, Value):
                found.append(value)
            else:
                found.append(self._constant(ast.copy_location(ast.Constant(value), node)))
        return found

    def _record(self, cls: Any, node: ast.Call) -> Value:
        kind = Record(cls)
        given = self._bound(inspect.signature(cls), node)
        items = [self.as_type(v, k, node) for v, k in zip(given, kind.fields.values(), strict=True)]
        return self._made(kind, items)

    def _law(self, function: FunctionType, node: ast.Call) -> Value:
        given = self._bound(inspect.signature(function), node)
        hints = inspect.get_annotations(function, eval_str=True)
        arguments = []
        for value, name in zip(given, inspect.signature(function).parameters, strict=True):
            hinted = of_hint(hints.get(name))
            if isinstance(hinted, Scalar) or value.elements is not None:
                value = self.as_type(value, hinted or value.type, node)
            arguments.append(value)
        law = self.unit.law(function, [a.type for a in arguments], self.arithmetic, self.source, node)
        if law.c_name in self.locals:
            self.source.refuse(node, f"a variable called {law.c_name!r} beside a function of that name")
        passed = [self.address(a) if n in law.pointers else a for n, a in zip(law.arguments, arguments, strict=True)]
        return call(law.c_name, law.returns or NOTHING, *passed, fault=law.fails)

    def _math(self, name: str, arguments: list[Value], node: ast.AST) -> Value:
        numbers = [self.as_type(a, FLOAT, node) for a in arguments]
        if name == "floor":
            return self.arithmetic.function(name, WHOLE, numbers, True)
        if name in ("isfinite", "isnan", "isinf"):
            return self.arithmetic.function(name, BOOL, numbers, False)
        if name not in (*FAILING, *SAFE):
            self.source.refuse(node, f"math.{name}")
        return self.arithmetic.function(name, FLOAT, numbers, name in FAILING)

    def _builtin(self, name: str, arguments: list[Value], node: ast.AST) -> Value:
        if name == "len" and items_of(arguments[0].type) is not None:
            return Value(str(len(items_of(arguments[0].type) or ())), INT)
        if any(a.type not in NUMBERS for a in arguments) or not arguments:
            self.source.refuse(node, f"{name}() of other than numbers")
        first = arguments[0]
        if name == "float" and len(arguments) == 1:
            return self.as_type(first, FLOAT, node)
        if name == "int" and len(arguments) == 1:
            return first if first.type == INT else self.arithmetic.function("int", INT, [first], True)
        if name in ("abs", "min", "max"):
            return self._chosen(name, arguments, node)
        self.source.refuse(node, f"a call of {name}()")

    def _chosen(self, name: str, arguments: list[Value], node: ast.AST) -> Value:
        """abs, min and max; the last two keep Python's choice between equal values and beside NaN."""
        if all(a.type == INT for a in arguments):
            plain = {"abs": "abs", "min": "int_lesser", "max": "int_greater"}[name]
            found = arguments[0] if name != "abs" else call(plain, INT, arguments[0])
            for other in arguments[1:]:
                found = call(plain, INT, found, other)
            return found
        numbers = [self.as_type(a, FLOAT, node) for a in arguments]
        found = numbers[0] if name != "abs" else self.arithmetic.function("abs", FLOAT, numbers, False)
        for other in numbers[1:]:
            found = self.arithmetic.function(name, FLOAT, [found, other], False)
        return found
