"""Where the variables of a function live: Python declares none, C all of them."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator


def declaration_places(tree: ast.FunctionDef) -> dict[str, ast.stmt]:
    """The statement that may declare each name: its first, in a block that holds every other use of it."""
    uses: dict[str, list[tuple[tuple[int, ...], ast.stmt, bool]]] = defaultdict(list)
    for path, statement in _statements(tree.body, ()):
        for node in _own_nodes(statement):
            if isinstance(node, ast.Name):
                uses[node.id].append((path, statement, isinstance(node.ctx, ast.Store)))
    found = {}
    for name, places in uses.items():
        path, statement, _ = places[0]
        plain = isinstance(statement, ast.Assign | ast.AnnAssign)
        stores_first = plain and not any(p[1] is statement and not p[2] for p in places)
        if stores_first and all(p[0][: len(path)] == path for p in places):
            found[name] = statement
    return found


def _statements(body: list[ast.stmt], path: tuple[int, ...]) -> Iterator[tuple[tuple[int, ...], ast.stmt]]:
    """Every statement with the path of blocks that it lies in."""
    for statement in body:
        yield path, statement
        for part in ("body", "orelse"):
            inner = getattr(statement, part, None)
            if inner:
                yield from _statements(inner, (*path, id(inner)))


def _own_nodes(statement: ast.stmt) -> Iterator[ast.AST]:
    """Nodes of a statement without those of the blocks in it."""
    for field, value in ast.iter_fields(statement):
        if field not in ("body", "orelse"):
            for node in value if isinstance(value, list) else [value]:
                if isinstance(node, ast.AST):
                    yield from ast.walk(node)


def used_outside(tree: ast.FunctionDef, name: str) -> bool:
    """Tell whether a loop variable is named anywhere but in loops that bind it."""
    inside: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.For) and isinstance(node.target, ast.Name) and node.target.id == name:
            inside.update(id(n) for n in ast.walk(node))
    return any(isinstance(n, ast.Name) and n.id == name and id(n) not in inside for n in ast.walk(tree))
