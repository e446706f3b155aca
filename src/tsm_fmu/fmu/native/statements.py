"""Statements of a kernel in C: one for one, with the comments of the Python text beside them."""

from __future__ import annotations

import ast
import re

from .arithmetic import CHECK, RETURN_NOTHING, Arithmetic, Value
from .asked import Asked
from .calls import Expressions
from .scopes import declaration_places, used_outside
from .source import Source
from .text import INDENT, quoted, safe, wrapped
from .types import BOOL, FLOAT, INT, NOTHING, WHOLE, Array, Record, Scalar, Type, c_variable

_ZERO = {FLOAT: 0.0, WHOLE: 0.0, INT: 0, BOOL: 0}


class Statements:
    """Translates the body of one function.

    Attributes
    ----------
    lines : list of str
        The body in C, in the braces of the function.
    pointers : frozenset of str
        Arguments that come by their address.
    returns : Type or None
        Type of the result; None for a function that returns nothing.
    fails : bool
        Whether it may note a fault, and so needs the pointer.
    """

    def __init__(self, unit: Asked, source: Source, arithmetic: Arithmetic, arguments: dict[str, Type]) -> None:
        self.unit = unit
        self.source = source
        self.arithmetic = arithmetic
        self.expressions = Expressions(unit, source, arithmetic)
        self.expressions.locals.update(arguments)
        self.pointers = frozenset(arguments) & _structs(arguments) - _assigned(source.tree)
        self.expressions.pointers = self.pointers
        self.lines: list[str] = []
        self.returns: Type | None = None
        self.fails = False
        self._depth = 1
        self._comments = sorted(source.comments.items()) if not arithmetic.suffix else []
        self._hoisted: dict[str, str] = {}
        self._places = declaration_places(source.tree)
        self._read = {n.id for n in ast.walk(source.tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        self._loop_names: list[str] = []
        self._arrays: set[str] = set()
        self._returned = False
        self._block(source.tree.body)
        self.lines[:0] = [f"{INDENT}{text}" for text in self._hoisted.values()]
        self.lines = [line.replace(RETURN_NOTHING, self._nothing()) for line in self.lines]

    # -- lines

    def _put(self, text: str, node: ast.stmt | None = None) -> None:
        comment = self._comment_of(node) if node is not None else ""
        self.lines += wrapped(INDENT * self._depth + text, comment)

    def _comment_of(self, node: ast.stmt) -> str:
        """Comments that stand beside a statement; those on lines before it are written out."""
        body = getattr(node, "body", None)
        last = body[0].lineno - 1 if body else node.end_lineno or node.lineno
        beside: list[str] = []
        while self._comments and self._comments[0][0] <= last:
            line, (text, alone) = self._comments.pop(0)
            if line < node.lineno:
                self.lines.append(f"{INDENT * self._depth}/* {safe(text)} */")
            elif not alone or not body:
                beside.append(safe(text))
            else:
                self._comments.insert(0, (body[0].lineno - 1, (text, True)))  # belongs into the block
                break
        return f"  /* {'; '.join(beside)} */" if beside else ""

    def _prepared(self, fails: bool = False) -> None:
        """Write what an expression needs before its statement."""
        for line in self.expressions.prelude:
            self._put(line)
            fails = fails or line == CHECK
        self.expressions.prelude.clear()
        self.fails = self.fails or fails

    def _check(self, value: Value) -> None:
        if value.fails:
            self.fails = True
            self._put(CHECK)

    def _nothing(self) -> str:
        """What a failing function returns."""
        if self.returns is None:
            return "return;"
        if isinstance(self.returns, Scalar):
            zero = {FLOAT: self.arithmetic.literal(0.0).text, WHOLE: "0.0", INT: "0", BOOL: "false"}[self.returns]
            return f"return {zero};"
        name = self.unit.type_name(self.returns, self.arithmetic)
        return f"return nothing_{name};"

    # -- blocks

    def _block(self, statements: list[ast.stmt]) -> None:
        for node in statements:
            method = getattr(self, f"_{type(node).__name__.lower()}", None)
            if method is None:
                self.source.refuse(node, f"{type(node).__name__} statement")
            method(node)

    def _inner(self, statements: list[ast.stmt]) -> None:
        self._depth += 1
        self._block(statements)
        self._depth -= 1

    def _expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            return
        value = self.expressions.value(node.value)
        self._prepared()
        self._put(f"{value.text};", node)
        self._check(value)

    def _pass(self, node: ast.Pass) -> None:
        pass

    def _break(self, node: ast.Break) -> None:
        self._put("break;", node)

    def _continue(self, node: ast.Continue) -> None:
        self._put("continue;", node)

    def _return(self, node: ast.Return) -> None:
        if node.value is None:
            self._put("return;", node)
            return
        value = self.expressions.value(node.value)
        kind = self.returns or self._annotated() or value.type
        value = self.expressions.as_type(value, kind, node)
        self.returns = kind
        self.unit.nothing(kind, self.arithmetic)
        self._prepared(value.fails)
        self._put(f"return {value.text};", node)

    def _annotated(self) -> Type | None:
        hint = self.unit.hint(self.source, "return")
        return hint if isinstance(hint, Scalar) or (isinstance(hint, Array) and hint.item == FLOAT) else None

    def _raise(self, node: ast.Raise) -> None:
        if not isinstance(node.exc, ast.Call) or len(node.exc.args) != 1:
            self.source.refuse(node, "raise without a sentence")
        text, values = self._sentence(node.exc.args[0])
        self._prepared(True)
        self._put(f"fault_raise({', '.join(['fault', text, *values])});", node)
        self._put(RETURN_NOTHING)

    def _sentence(self, node: ast.expr) -> tuple[str, list[str]]:
        """A string, with values in it, as format and arguments of ``fault_raise``."""
        parts = node.values if isinstance(node, ast.JoinedStr) else [node]
        text, values = "", []
        for part in parts:
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                text += part.value.replace("%", "%%")
            elif isinstance(part, ast.FormattedValue):
                value = self.expressions.value(part.value)
                spec = ast.unparse(part.format_spec)[2:-1] if part.format_spec else ""
                if value.type not in (FLOAT, INT) or (spec and not re.fullmatch(r"(\.\d+)?[gfe]", spec)):
                    self.source.refuse(part, f"the format {ast.unparse(part)}")
                if value.type == INT and not spec:
                    text += "%d"
                    values.append(value.text)
                else:
                    text += f"%{spec}" if spec else "%r"
                    values.append(self.arithmetic.plain(self.expressions.as_type(value, FLOAT, part)).text)
            else:
                self.source.refuse(node, "a sentence that is not written out")
        return quoted(text), values

    # -- assignments

    def _assign(self, node: ast.Assign) -> None:
        if len(node.targets) != 1:
            self.source.refuse(node, "an assignment to several names at once")
        value = self.expressions.value(node.value)
        self._store(node.targets[0], value, node)

    def _annassign(self, node: ast.AnnAssign) -> None:
        if node.value is None:
            self.source.refuse(node, "a variable without a value")
        self._store(node.target, self.expressions.value(node.value), node)

    def _augassign(self, node: ast.AugAssign) -> None:
        as_binary = ast.copy_location(ast.BinOp(_loaded(node.target), node.op, node.value), node)
        value = self.expressions.value(as_binary)
        short = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*="}.get(type(node.op))
        name = c_variable(node.target.id) if isinstance(node.target, ast.Name) else ""
        if short and value.type in (FLOAT, INT) and not (self.arithmetic.suffix and value.type == FLOAT):
            right = self.expressions.as_type(self.expressions.value(node.value), value.type, node)
            if self.expressions.locals.get(name) == value.type:
                self._prepared()
                self._put(f"{name} {short} {right.text};", node)
                self._check(right)
                return
        self._store(node.target, value, node)

    def _store(self, target: ast.expr, value: Value, node: ast.stmt) -> None:
        if isinstance(target, ast.Tuple):
            self._unpack(target, value, node)
            return
        if not isinstance(target, ast.Name):
            self.source.refuse(node, "an assignment to a part of a value")
        name = c_variable(target.id)
        if name in self._loop_names:
            self.source.refuse(node, f"a change of the loop's own variable {target.id!r}")
        known = self.expressions.locals.get(name)
        if value.type == NOTHING:
            self.source.refuse(node, "the result of a function that returns none")
        value = self.expressions.as_type(value, known or value.type, node)
        declared = f"{self.unit.type_name(value.type, self.arithmetic)} {name}"
        self._prepared()
        if known is not None:
            self._put(f"{name} = {value.text};", node)
        elif self._places.get(target.id) is node:
            self._put(f"{declared} = {value.text};", node)
        else:  # first met in a branch: it belongs to the function
            self._hoisted[name] = f"{declared} = {self._zero(value.type)};"
            self._put(f"{name} = {value.text};", node)
        if known is None and target.id not in self._read:
            self._put(f"(void){name};")
        self.expressions.locals[name] = value.type
        self._check(value)

    def _zero(self, kind: Type) -> str:
        if isinstance(kind, Scalar):
            return self.arithmetic.literal(0.0).text if kind == FLOAT else str(_ZERO[kind]).lower()
        self.unit.nothing(kind, self.arithmetic)
        return f"nothing_{self.unit.type_name(kind, self.arithmetic)}"

    def _unpack(self, target: ast.Tuple, value: Value, node: ast.stmt) -> None:
        if value.elements is None and not isinstance(value.type, Record):
            value = self.expressions.hoisted(value, node)
        items = list(self.expressions.items(value, node))
        if len(items) != len(target.elts):
            self.source.refuse(node, f"an assignment of {len(items)} values to {len(target.elts)} names")
        stored = [t.id for t in target.elts if isinstance(t, ast.Name)]
        needed = {n.id for n in ast.walk(getattr(node, "value", node)) if isinstance(n, ast.Name)}
        if value.elements is not None and needed & set(stored):
            items = [i if i.number is not None else self.expressions.hoisted(i, node) for i in items]
        for one, item in zip(target.elts, items, strict=True):
            if not isinstance(one, ast.Name) or one.id in self._read:
                self._store(one, item, node)

    # -- branches and loops

    def _if(self, node: ast.If) -> None:
        condition = self._tested(node.test)
        self._put(f"if ({condition}) {{", node)
        self._inner(node.body)
        rest = node.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            before = len(self.lines), len(self.expressions.prelude)
            inner = self.expressions.condition(rest[0].test)
            if inner.fails or len(self.expressions.prelude) > before[1]:
                self.expressions.prelude.clear()
                break
            self._put(f"}} else if ({inner.text}) {{", rest[0])
            self._inner(rest[0].body)
            rest = rest[0].orelse
        if rest:
            self._put("} else {")
            self._inner(rest)
        self._put("}")

    def _tested(self, test: ast.expr) -> str:
        """A condition that cannot fail any more."""
        value = self.expressions.condition(test)
        if value.fails:
            value = self.expressions.hoisted(value, test)
        self._prepared()
        return value.text

    def _while(self, node: ast.While) -> None:
        if node.orelse:
            self.source.refuse(node, "else of a loop")
        if isinstance(node.test, ast.Constant) and node.test.value is True:
            self._put("for (;;) {", node)
            self._inner(node.body)
            self._put("}")
            return
        value = self.expressions.condition(node.test)
        if not value.fails and not self.expressions.prelude:
            self._put(f"while ({value.text}) {{", node)
            self._inner(node.body)
        else:
            self.expressions.prelude.clear()
            self._put("for (;;) {", node)
            self._depth += 1
            self._put(f"if (!({self._tested(node.test)})) break;")
            self._block(node.body)
            self._depth -= 1
        self._put("}")

    def _for(self, node: ast.For) -> None:
        if node.orelse:
            self.source.refuse(node, "else of a loop")
        if not isinstance(node.target, ast.Name):
            self.source.refuse(node, "a loop over several names")
        name = c_variable(node.target.id)
        outside = self.expressions.locals.pop(name, None)
        if outside is not None or (name != "_" and used_outside(self.source.tree, node.target.id)):
            self.source.refuse(node, f"a loop variable {node.target.id!r} that is used outside the loop")
        if isinstance(node.iter, ast.Tuple):
            kind = self._over_tuple(node, node.iter, name)
        else:
            kind = self._over_range(node, name)
        self.expressions.locals[name] = kind
        self._loop_names.append(name)
        self._inner(node.body)
        self._loop_names.pop()
        del self.expressions.locals[name]
        self._put("}")

    def _over_range(self, node: ast.For, name: str) -> Type:
        if not (
            isinstance(node.iter, ast.Call) and isinstance(node.iter.func, ast.Name) and node.iter.func.id == "range"
        ):
            self.source.refuse(node, "a loop over other than range() or a tuple")
        values = [self.expressions.value(a) for a in node.iter.args]
        changed = {
            n.id for b in node.body for n in ast.walk(b) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }
        first, last, step = values[0], values[-1], 1
        if len(values) == 1:
            first = Value("0", INT, number=0)
        elif len(values) == 3:
            last, step = values[1], values[2].number
        if any(v.type != INT for v in values) or step not in (1, -1):
            self.source.refuse(node, "a range of other than integers with step 1 or -1")
        if last.fails or changed & {n.id for n in ast.walk(node.iter) if isinstance(n, ast.Name)}:
            last = self.expressions.hoisted(last, node)
        self._prepared(first.fails)
        sign, move = ("<", "++") if step == 1 else (">", "--")
        self._put(f"for (int {name} = {first.text}; {name} {sign} {last.text}; {name}{move}) {{", node)
        return INT

    def _over_tuple(self, node: ast.For, over: ast.Tuple, name: str) -> Type:
        """A loop over a tuple that is written out."""
        items = [self.expressions.value(e) for e in over.elts]
        if any(i.type != items[0].type for i in items) or any(i.fails for i in items):
            self.source.refuse(node, "a loop over values of several types")
        kind = items[0].type
        spelled = self.unit.type_name(kind, self.arithmetic)
        each = f"{name}_each"
        while each in self._arrays:  # of an earlier loop with a variable of this name
            each += "_"
        self._arrays.add(each)
        self._put(f"const {spelled} {each}[{len(items)}] = {{{', '.join(i.text for i in items)}}};")
        self._put(f"for (int {name}_at = 0; {name}_at < {len(items)}; {name}_at++) {{", node)
        self._put(f"{INDENT}const {spelled} {name} = {each}[{name}_at];")
        return kind


def _structs(arguments: dict[str, Type]) -> frozenset[str]:
    return frozenset(name for name, kind in arguments.items() if not isinstance(kind, Scalar))


def _assigned(tree: ast.FunctionDef) -> frozenset[str]:
    return frozenset(
        c_variable(n.id) for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    )


def _loaded(target: ast.expr) -> ast.expr:
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    return target
