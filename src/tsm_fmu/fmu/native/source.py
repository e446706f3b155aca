"""The text of a function: its syntax tree, its comments, and refusals that name file and line."""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import FunctionType, ModuleType
from typing import Any, NoReturn

from ...models.contract import InputError
from ..accompanying import source_of

_TOOL_COMMENTS = ("noqa", "fmt:", "type:", "pyright:")


@dataclass(frozen=True)
class Source:
    """One function of a kernel or law.

    Attributes
    ----------
    function : function
        Its globals say what the names in it mean.
    module : module
        Where it is written.
    tree : ast.FunctionDef
        Line numbers are those of the module's file.
    comments : dict of int to (str, bool)
        Comments by line, and whether each has the line to itself.
    """

    function: FunctionType
    module: ModuleType
    tree: ast.FunctionDef
    comments: dict[int, tuple[str, bool]]

    @property
    def name(self) -> str:
        return self.function.__name__

    @property
    def known(self) -> dict[str, Any]:
        """What the names of its module stand for."""
        return vars(self.module)

    def refuse(self, node: ast.AST, why: str) -> NoReturn:
        """Raise `InputError` for what a translation to C cannot hold."""
        line = getattr(node, "lineno", self.tree.lineno)
        raise InputError(
            f"{self.module.__file__}:{line}: {why} in {self.name} -- expected the subset of Python that kernels are "
            "written in -- rewrite it, see docs of models/contract.py"
        )


def source(function: FunctionType, module: ModuleType) -> Source:
    """Text of a function of a module.

    Raises
    ------
    InputError
        If it is not a plain function at the top level of the module.
    """
    found = _functions(module).get(function.__name__)
    if found is None:
        raise InputError(
            f"function {function.__qualname__} of {function.__module__} -- expected one written at the top level of a "
            "module -- move it there"
        )
    first, last = found.lineno, found.end_lineno or found.lineno
    comments = {line: c for line, c in _comments(module).items() if first <= line <= last}
    return Source(function, module, found, comments)


@cache
def _functions(module: ModuleType) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.parse(source_of(module)).body if isinstance(node, ast.FunctionDef)}


@cache
def _comments(module: ModuleType) -> dict[int, tuple[str, bool]]:
    """Comments of a module by line, without those that are for tools."""
    read: Callable[[], str] = io.StringIO(source_of(module)).readline
    found: dict[int, tuple[str, bool]] = {}
    for token in tokenize.generate_tokens(read):
        if token.type == tokenize.COMMENT:
            text = token.string.lstrip("# ")
            if not text.startswith(_TOOL_COMMENTS):
                found[token.start[0]] = (text, not token.line[: token.start[1]].strip())
    return found
