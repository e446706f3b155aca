"""Translation of one kernel: what it calls is found from its functions, named, typed and written in C."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from functools import cache
from importlib import resources
from types import FunctionType, ModuleType
from typing import Any

from .arithmetic import Arithmetic, Dual, Plain, literal_text, type_name
from .asked import Law
from .source import Source, source
from .statements import Statements
from .text import INDENT, wrapped
from .types import FLOAT, Array, Mixed, Record, Type, c_variable, items_of, of_hint

MAIN = ("Params", "State", "Inputs", "Outputs")
"""Classes of the kernel itself, declared in ``model.h``."""


class Unit:
    """One kernel and all that it calls, in one arithmetic.

    Attributes
    ----------
    module : module
        The kernel.
    laws : list of Law
        Callees before callers.
    types : list of Type
        Struct types in the order in which C must see them.
    constants : dict of str to number
        By name in C.
    """

    def __init__(self, module: ModuleType, arithmetic: Arithmetic) -> None:
        self.module = module
        self.arithmetic = arithmetic
        self.laws: list[Law] = []
        self.types: list[Type] = []
        self.constants: dict[str, float | int] = {}
        self.nothings: list[Type] = []
        self._records: dict[Any, str] = {getattr(module, name): name for name in MAIN}
        self._known: dict[Any, Law | None] = {}
        self._names: set[str] = set()
        self._constant_of: dict[tuple[int, str], str] = {}
        p, s, u = (Record(getattr(module, name)) for name in MAIN[:3])
        nowhere = source(module.step, module)
        self.start = self.law(module.start, [p, u], arithmetic, nowhere, nowhere.tree)
        self.step = self.law(module.step, [p, s, u, FLOAT], arithmetic, nowhere, nowhere.tree)

    # -- asked by the translation of functions

    def law(
        self, function: FunctionType, kinds: list[Type], arithmetic: Arithmetic, caller: Source, node: ast.AST
    ) -> Law:
        """The function for arguments of these types, translated at its first use."""
        key = (function, tuple(kinds))
        if key in self._known:
            found = self._known[key]
            if found is None:
                caller.refuse(node, f"{function.__name__}(), which calls itself,")
            return found
        self._known[key] = None
        text = source(function, self._module_of(function))
        c_name = self._free_name(_public(function.__name__), text.module)
        parameters = [c_variable(name) for name in inspect.signature(function).parameters]
        arguments = dict(zip(parameters, kinds, strict=True))
        body = Statements(self, text, arithmetic, arguments)
        for kind in (*kinds, *([body.returns] if body.returns else [])):
            self.type_name(kind, arithmetic)
        law = Law(c_name, text, arguments, body.pointers, body.returns, body.fails, body.lines)
        self._known[key] = law
        self.laws.append(law)
        return law

    def type_name(self, kind: Type, arithmetic: Arithmetic) -> str:
        """Name of a type in C; a struct is declared."""
        for item in items_of(kind) or []:
            self.type_name(item, arithmetic)
        if isinstance(kind, Record) and kind.cls not in self._records:
            file = kind.cls.__module__.rpartition(".")[2]
            name = kind.cls.__name__
            if name in self._records.values() or name in reserved_names():
                name = "".join(part.capitalize() for part in file.split("_")) + name
            self._records[kind.cls] = name
        if isinstance(kind, Record | Array | Mixed) and kind not in self.types:
            self.types.append(kind)
        return self._name_in(arithmetic, kind)

    def nothing(self, kind: Type, arithmetic: Arithmetic) -> None:
        """Have a constant of zeros of a struct type: what a failing function returns."""
        if isinstance(kind, Record | Array | Mixed) and kind not in self.nothings:
            self.type_name(kind, arithmetic)
            self.nothings.append(kind)

    def constant(self, known: dict[str, Any], name: str, number: float | int) -> str:
        """Name in C of a module's constant."""
        key = (id(known), name)
        if key not in self._constant_of:
            c_name = self._free_name(_public(name), self._module_named(known["__name__"]))
            self._constant_of[key] = c_name
            self.constants[c_name] = number
        return self._constant_of[key]

    def hint(self, text: Source, name: str) -> Type | None:
        """Type that an annotation names, where it is in the subset."""
        return of_hint(_annotations(text.function).get(name))

    # -- names

    def _name_in(self, arithmetic: Arithmetic, kind: Type) -> str:
        return type_name(kind, arithmetic, self._records)

    def _module_of(self, function: FunctionType) -> ModuleType:
        if function.__globals__ is self.module.__dict__:
            return self.module
        return sys.modules[function.__module__]

    def _module_named(self, name: str) -> ModuleType:
        return self.module if name == self.module.__name__ else sys.modules[name]

    def _free_name(self, name: str, module: ModuleType) -> str:
        """The name itself where nothing else in the unit has it, else with the file's before it."""
        file = module.__name__.rpartition(".")[2]
        tried = [name, f"{file}_{name}", *(f"{file}_{name}_{n}" for n in range(2, 100))]
        found = next(t + self.arithmetic.suffix for t in tried if t not in self._names and t not in reserved_names())
        self._names.add(found.removesuffix(self.arithmetic.suffix))
        return found

    # -- text

    def declarations(self) -> list[str]:
        """Constants, struct types beside those of ``model.h``, and prototypes."""
        lines = [f"static const {_constant(n, x)};" for n, x in self.constants.items()]
        lines += [""] if lines else []
        main = [Record(getattr(self.module, name)) for name in MAIN]
        declared = {*main, *(kind for record in main for kind in record.fields.values())}
        known = {k for k in declared if self._name_in(self.arithmetic, k) == self._name_in(Plain(), k)}
        for kind in self.types:
            if kind not in known:
                lines += [*self.struct(kind), ""]
        used = "\n".join(line for law in self.laws for line in law.lines)
        nothings = [f"nothing_{self.type_name(kind, self.arithmetic)};" for kind in self.nothings]
        found = [f"static const {name.removeprefix('nothing_')[:-1]} {name}" for name in nothings if name in used]
        lines += [*found, ""] if found else []
        return [*lines, *(line for law in self.laws for line in wrapped(f"{self.prototype(law)};"))]

    def struct(self, kind: Type) -> list[str]:
        """Declaration of a struct type."""
        name = self.type_name(kind, self.arithmetic)
        if isinstance(kind, Array):
            item = self.type_name(kind.item, self.arithmetic)
            return [f"typedef struct {{ {item} item[{kind.size}]; }} {name};"]
        if isinstance(kind, Mixed):
            items = [f"{self.type_name(t, self.arithmetic)} item{n};" for n, t in enumerate(kind.items)]
            return [f"typedef struct {{ {' '.join(items)} }} {name};"]
        assert isinstance(kind, Record)
        lines = []
        for field, inner in kind.fields.items():
            declared = f"{INDENT}{self.type_name(inner, self.arithmetic)} {c_variable(field)};"
            lines += wrapped(declared, self._field_comment(kind.cls, field))
        return ["typedef struct {", *(lines or [f"{INDENT}char none;"]), f"}} {name};"]

    def _field_comment(self, cls: Any, field: str) -> str:
        if self.arithmetic.suffix:
            return ""
        metadata = getattr(inspect.get_annotations(cls, eval_str=True).get(field), "__metadata__", ())
        return f"  /* [{metadata[0].unit}] {metadata[0].meaning} */" if metadata else ""

    def prototype(self, law: Law) -> str:
        """How C declares a function."""
        names = {n: self.type_name(t, self.arithmetic) for n, t in law.arguments.items()}
        arguments = [f"const {t} *{n}" if n in law.pointers else f"{t} {n}" for n, t in names.items()]
        arguments += ["Fault *fault"] if law.fails else []
        returns = self.type_name(law.returns, self.arithmetic) if law.returns else "void"
        return f"static {returns} {law.c_name}({', '.join(arguments) or 'void'})"

    def functions(self) -> list[str]:
        """All functions, by the file that they are from, the model's own last."""
        modules = list(dict.fromkeys(law.source.module for law in self.laws))
        modules = [m for m in modules if m is not self.module] + [self.module]
        lines: list[str] = []
        for module in modules:
            lines += ["", "", *_banner(module, self.module, comments=not self.arithmetic.suffix)]
            for law in sorted((w for w in self.laws if w.source.module is module), key=lambda w: w.source.tree.lineno):
                lines += ["", *self._function(law)]
        return lines

    def _function(self, law: Law) -> list[str]:
        text = inspect.getdoc(law.source.function) or ""
        first = text.split("\n\n")[0].replace("\n", " ").replace("``", "") if not self.arithmetic.suffix else ""
        about = wrapped(f"/* {first} */") if first else []
        return [*about, *wrapped(self.prototype(law)), "{", *_used(law), *law.lines, "}"]


LIBRARY_NAMES = frozenset(
    "abs acos asin atan atan2 atanh ceil copysign cos cosh div dual exp expm1 fabs floor fmod gamma index j0 j1 jn log "
    "log1p pow remainder round signal sin sinh sqrt step_size tan tanh time trunc y0 y1 yn".split()
)
"""Functions of C's library that a function of ours must not have the name of."""


@cache
def reserved_names() -> frozenset[str]:
    """Names at file scope that the C library and the FMI layers have already."""
    found = set(LIBRARY_NAMES)
    for path in resources.files("tsm_fmu.fmu.native").joinpath("c").iterdir():
        text = path.read_text(encoding="utf-8")
        found.update(re.findall(r"^(?:[A-Za-z_][\w ]*[ *]+)(\w+)\(", text, flags=re.MULTILINE))
        found.update(re.findall(r"^static const .*?(\w+)(?:\[\])? =", text, flags=re.MULTILINE))
        found.update(re.findall(r"^#define (\w+)", text, flags=re.MULTILINE))
        found.update(re.findall(r"^(?:typedef .*?|typedef enum \{.*\} |\} )(\w+);", text, flags=re.MULTILINE))
        found.update(re.findall(r"\b([A-Z][A-Z_]+)\b", text))
    return frozenset(found)


def units(module: ModuleType) -> tuple[Unit, Unit]:
    """A kernel in plain numbers and in numbers with a derivative.

    Raises
    ------
    InputError
        For what C cannot hold: file, line and reason.
    """
    return Unit(module, Plain()), Unit(module, Dual())


def _public(name: str) -> str:
    """Name in C of a function or constant: at file scope a leading underscore belongs to the compiler."""
    bare = name.lstrip("_")
    return c_variable(bare if bare == name else f"{bare}_")


def _used(law: Law) -> list[str]:
    """Mark arguments that a function does not use: a kernel's ``step`` gets all, whether it needs them or not."""
    read = {c_variable(n.id) for n in ast.walk(law.source.tree) if isinstance(n, ast.Name)}
    unused = [name for name in law.arguments if name not in read]
    return [f"{INDENT}{' '.join(f'(void){name};' for name in unused)}"] if unused else []


def _constant(name: str, number: float | int) -> str:
    if isinstance(number, int):
        return f"int {name} = {number}"
    return f"double {name} = {literal_text(number)}"


def _banner(module: ModuleType, main: ModuleType, comments: bool) -> list[str]:
    name = module.__name__.rpartition(".")[2]
    if module is main or not comments:
        return [f"/* ---- {name} */"]
    text = (module.__doc__ or "").strip().replace("*/", "* /").splitlines()
    return [f"/* ---- {name}: {text[0] if text else ''}", *(f" * {line}".rstrip() for line in text[1:]), " */"]


@cache
def _annotations(function: FunctionType) -> dict[str, Any]:
    return inspect.get_annotations(function, eval_str=True)
