"""Names, tuples and operators of a kernel in C: the same operations in the same order, so that rounding is the same."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Sequence

from .arithmetic import (
    AND,
    CHECK,
    CHOICE,
    EQUAL,
    OR,
    ORDER,
    PRIMARY,
    UNARY,
    Arithmetic,
    Value,
    call,
    infix,
    inside,
)
from .asked import Asked
from .source import Source
from .types import (
    BOOL,
    FLOAT,
    INT,
    WHOLE,
    Array,
    Record,
    Scalar,
    Type,
    c_variable,
    items_of,
    member,
    members,
    of_items,
)

_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "**",
}  # fmt: skip
_COMPARISONS: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", ORDER), ast.LtE: ("<=", ORDER), ast.Gt: (">", ORDER), ast.GtE: (">=", ORDER),
    ast.Eq: ("==", EQUAL), ast.NotEq: ("!=", EQUAL),
}  # fmt: skip
NUMBERS = (FLOAT, WHOLE, INT)
_PLACE = re.compile(r"\(\*\w+\)|\w+(->|[\w.\[\]])*")
"""What may be written out several times: a variable or a part of one."""


class Operators:
    """Translates the expressions of one function.

    Attributes
    ----------
    locals : dict of str to Type
        Variables by their name in C.
    pointers : frozenset of str
        Those that are pointers to const.
    prelude : list of str
        C lines that must come before the statement that is being written.
    """

    def __init__(self, unit: Asked, source: Source, arithmetic: Arithmetic) -> None:
        self.unit = unit
        self.source = source
        self.arithmetic = arithmetic
        self.locals: dict[str, Type] = {}
        self.pointers: frozenset[str] = frozenset()
        self.prelude: list[str] = []
        self._lazily = 0
        self._temporaries = 0

    # -- what statements ask for

    def value(self, node: ast.expr) -> Value:
        """An expression."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.source.refuse(node, f"{type(node).__name__} expression")
        return method(node)

    def condition(self, node: ast.expr) -> Value:
        """An expression that is true or false."""
        value = self.value(node)
        if value.type != BOOL:
            self.source.refuse(node, "a number as a condition")
        return value

    def as_type(self, value: Value, kind: Type, node: ast.AST) -> Value:
        """A value as C needs it where ``kind`` is expected."""
        if value.elements is not None:
            wanted = items_of(kind)
            if wanted is None or isinstance(kind, Record) or len(wanted) != len(value.elements):
                self.source.refuse(node, f"a tuple of {len(value.elements)} where another type is expected")
            items = [self.as_type(e, t, node) for e, t in zip(value.elements, wanted, strict=True)]
            return self._made(kind, items)
        if value.type == kind:
            return value
        if kind == FLOAT and value.type == WHOLE:
            return self.arithmetic.from_double(value)
        if kind == FLOAT and value.type == INT:
            if value.number is not None:
                return self.arithmetic.literal(float(value.number))
            cast = Value(f"(double){inside(value, UNARY)}", FLOAT, UNARY, value.fails)
            return self.arithmetic.from_double(cast)
        self.source.refuse(node, f"a value of type {kind_name(value.type)} where {kind_name(kind)} is expected")

    def hoisted(self, value: Value, node: ast.AST) -> Value:
        """The value in a variable of its own, written before the statement."""
        if self._lazily:
            self.source.refuse(node, "an expression that C cannot evaluate in part,")
        self._temporaries += 1
        name = f"value_{self._temporaries}"
        self.prelude.append(f"const {self.unit.type_name(value.type, self.arithmetic)} {name} = {value.text};")
        if value.fails:
            self.prelude.append(CHECK)
        return Value(name, value.type)

    def address(self, value: Value) -> Value:
        """Address of a struct; one that has none is put into an array of one."""
        if value.text.startswith("(*"):
            text = value.text[2:-1]
        elif _PLACE.fullmatch(value.text):
            text = f"&{value.text}"
        else:
            text = f"({self.unit.type_name(value.type, self.arithmetic)}[1]){{{value.text}}}"
        return Value(text, value.type, UNARY, value.fails)

    def items(self, value: Value, node: ast.AST) -> Sequence[Value]:
        """What a tuple or named tuple holds."""
        if value.elements is not None:
            return value.elements
        kinds = items_of(value.type)
        if kinds is None:
            self.source.refuse(node, "a number where a tuple is expected")
        held = value if _PLACE.fullmatch(value.text) else self.hoisted(value, node)
        return [Value(member(held.text, part), kind) for part, kind in zip(members(value.type), kinds, strict=True)]

    # -- literals and names

    def _constant(self, node: ast.Constant) -> Value:
        if isinstance(node.value, bool):
            return Value(str(node.value).lower(), BOOL)
        if isinstance(node.value, int):
            return Value(str(node.value), INT, number=node.value)
        if isinstance(node.value, float):
            return self.arithmetic.literal(node.value)
        self.source.refuse(node, f"the literal {node.value!r}")

    def _name(self, node: ast.Name) -> Value:
        name = c_variable(node.id)
        if name in self.locals:
            return Value(f"(*{name})" if name in self.pointers else name, self.locals[name])
        known = self.source.known
        if node.id in known and isinstance(known[node.id], float | int):
            return self._global(node.id, known[node.id])
        self.source.refuse(node, f"the name {node.id!r}, which has no value here,")

    def _global(self, name: str, number: float) -> Value:
        if isinstance(number, bool):
            return Value(str(number).lower(), BOOL)
        text = self.unit.constant(self.source.known, name, number)
        if isinstance(number, int):
            return Value(text, INT)
        return self.arithmetic.from_double(Value(text, FLOAT, number=None))

    def _attribute(self, node: ast.Attribute) -> Value:
        if isinstance(node.value, ast.Name) and c_variable(node.value.id) not in self.locals:
            owner = self.source.known.get(node.value.id)
            number = getattr(owner, node.attr, None)
            if owner is math and isinstance(number, float):
                return self.arithmetic.literal(number)
            self.source.refuse(node, f"{node.value.id}.{node.attr}")
        owner = self.value(node.value)
        if not isinstance(owner.type, Record) or node.attr not in owner.type.fields:
            self.source.refuse(node, f"the attribute {node.attr!r} of a {kind_name(owner.type)}")
        kind = owner.type.fields[node.attr]
        return Value(member(inside(owner, PRIMARY), f".{c_variable(node.attr)}"), kind, PRIMARY, owner.fails)

    # -- tuples

    def _tuple(self, node: ast.Tuple) -> Value:
        return self._elements(self._spread(node.elts))

    def _elements(self, elements: Sequence[Value]) -> Value:
        fails = any(e.fails for e in elements)
        return Value("", of_items([e.type for e in elements]), fails=fails, elements=tuple(elements))

    def _spread(self, nodes: Sequence[ast.expr]) -> list[Value]:
        found: list[Value] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                found += self.items(self.value(node.value), node)
            else:
                found.append(self.value(node))
        return found

    def _made(self, kind: Type, items: Sequence[Value]) -> Value:
        """A struct written out."""
        name = self.unit.type_name(kind, self.arithmetic)
        inner = ", ".join(item.text for item in items) or "0"
        braces = f"{{{{{inner}}}}}" if isinstance(kind, Array) else f"{{{inner}}}"
        return Value(f"({name}){braces}", kind, PRIMARY, any(item.fails for item in items))

    def _subscript(self, node: ast.Subscript) -> Value:
        owner = self.value(node.value)
        kinds = items_of(owner.type)
        if kinds is None:
            self.source.refuse(node, "an index into a number")
        if isinstance(node.slice, ast.Slice):
            bounds = [self._whole(part) for part in (node.slice.lower, node.slice.upper, node.slice.step)]
            return self._elements(self.items(owner, node)[slice(*bounds)])
        index = self._literal_index(node.slice)
        if index is not None:
            if not -len(kinds) <= index < len(kinds):
                self.source.refuse(node, f"index {index} of a tuple of {len(kinds)}")
            if owner.elements is not None and not owner.fails:
                return owner.elements[index]
            if owner.elements is not None:
                self.source.refuse(node, "an index into a tuple whose items may fail")
            kind = kinds[index]
            return Value(member(inside(owner, PRIMARY), members(owner.type)[index]), kind, PRIMARY, owner.fails)
        return self._at(owner, self.as_type(self.value(node.slice), INT, node), kinds, node)

    def _at(self, owner: Value, index: Value, kinds: list[Type], node: ast.AST) -> Value:
        """Item at an index that is known only when it runs."""
        if any(kind != kinds[0] for kind in kinds):
            self.source.refuse(node, "a computed index into items of several types")
        if not isinstance(owner.type, Array):
            owner = self._elements(self.items(owner, node))
        owner = self.as_type(owner, Array(kinds[0], len(kinds)), node)
        place = call("checked_index", INT, index, Value(str(len(kinds)), INT), fault=True)
        return Value(member(inside(owner, PRIMARY), f".item[{place.text}]"), kinds[0], PRIMARY, True)

    def _whole(self, node: ast.expr | None) -> int | None:
        return None if node is None else self._literal_index(node)

    def _literal_index(self, node: ast.expr) -> int | None:
        try:
            found = ast.literal_eval(node)
        except ValueError:
            return None
        return found if isinstance(found, int) else None

    # -- operators

    def _binop(self, node: ast.BinOp) -> Value:
        operator = _OPERATORS.get(type(node.op))
        if operator is None:
            self.source.refuse(node, f"operator {type(node.op).__name__}")
        a, b = self.value(node.left), self.value(node.right)
        if operator == "+" and items_of(a.type) and items_of(b.type):
            return self._elements([*self.items(a, node), *self.items(b, node)])
        return self.operation(operator, a, b, node)

    def operation(self, operator: str, a: Value, b: Value, node: ast.AST) -> Value:
        """Two numbers with an operator between them."""
        if a.type not in NUMBERS or b.type not in NUMBERS:
            self.source.refuse(node, f"{operator} between {kind_name(a.type)} and {kind_name(b.type)}")
        if a.type == INT and b.type == INT and operator != "/":
            if operator in ("+", "-", "*"):
                return infix(operator, a, b, INT)
            if operator == "%" and b.number is not None and b.number > 0:
                return call("int_mod", INT, a, b)
            self.source.refuse(node, f"{operator} between integers")
        if WHOLE in (a.type, b.type) and FLOAT not in (a.type, b.type):
            self.source.refuse(node, "arithmetic on whole numbers of any size")
        return self.arithmetic.binary(operator, self.as_type(a, FLOAT, node), self.as_type(b, FLOAT, node))

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            truth = self.condition(node.operand)
            return Value(f"!{inside(truth, PRIMARY)}", BOOL, UNARY, truth.fails)
        value = self.value(node.operand)
        if not isinstance(node.op, ast.USub) or value.type not in (FLOAT, INT):
            self.source.refuse(node, f"operator {type(node.op).__name__} on a {kind_name(value.type)}")
        if value.number is not None:
            if value.type == FLOAT:
                return self.arithmetic.literal(-value.number)
            number = int(-value.number)
            return Value(str(number), INT, number=number)
        if value.type == INT:
            return Value(f"-{inside(value, PRIMARY)}", INT, UNARY, value.fails)
        return self.arithmetic.negative(value)

    def _boolop(self, node: ast.BoolOp) -> Value:
        sign, rank = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        first = self.condition(node.values[0])
        self._lazily += 1
        values = [first, *(self.condition(v) for v in node.values[1:])]
        self._lazily -= 1
        texts = [f"({v.text})" if v.rank <= AND else v.text for v in values]  # C compilers ask for them
        return Value(f" {sign} ".join(texts), BOOL, rank, any(v.fails for v in values))

    def _compare(self, node: ast.Compare) -> Value:
        values = [self.value(n) for n in (node.left, *node.comparators)]
        if any(v.fails for v in values[1:-1]):  # C would compute it twice
            self.source.refuse(node, "a chained comparison whose middle may fail")
        pairs = [self._comparison(op, values[k], values[k + 1], node) for k, op in enumerate(node.ops)]
        if len(pairs) == 1:
            return pairs[0]
        return Value(" && ".join(p.text for p in pairs), BOOL, AND, any(p.fails for p in pairs))

    def _comparison(self, operator: ast.cmpop, a: Value, b: Value, node: ast.AST) -> Value:
        if type(operator) not in _COMPARISONS:
            self.source.refuse(node, f"comparison {type(operator).__name__}")
        text, rank = _COMPARISONS[type(operator)]
        if not (a.type == b.type == BOOL or (a.type in NUMBERS and b.type in NUMBERS)):
            self.source.refuse(node, f"a comparison of {kind_name(a.type)} and {kind_name(b.type)}")
        if a.type != b.type:
            a, b = self.as_type(a, FLOAT, node), self.as_type(b, FLOAT, node)
        if a.type == FLOAT:
            a, b = self.arithmetic.plain(a), self.arithmetic.plain(b)
        return Value(f"{inside(a, ORDER + 1)} {text} {inside(b, ORDER + 1)}", BOOL, rank, a.fails or b.fails)

    def _ifexp(self, node: ast.IfExp) -> Value:
        condition = self.condition(node.test)
        self._lazily += 1
        a, b = self.value(node.body), self.value(node.orelse)
        kind = FLOAT if FLOAT in (a.type, b.type) else a.type
        a, b = self.as_type(a, kind, node.body), self.as_type(b, kind, node.orelse)
        self._lazily -= 1
        text = f"{inside(condition, CHOICE + 1)} ? {inside(a, CHOICE + 1)} : {inside(b, CHOICE)}"
        return Value(text, kind, CHOICE, condition.fails or a.fails or b.fails)


def kind_name(kind: Type) -> str:
    return kind.name if isinstance(kind, Scalar) else "tuple"
