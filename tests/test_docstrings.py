"""Docstrings name what is there: the arguments of a function in its order, the fields of a class."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import NumpyDocString

import tsm_fmu


def _modules() -> Iterator[Any]:
    root = Path(tsm_fmu.__file__).parent  # not the packages' paths: chains that were written out stand there too
    for file in sorted(root.rglob("*.py")):
        parts = file.relative_to(root.parent).with_suffix("").parts
        if parts[-1] != "__main__":  # it runs the program
            yield importlib.import_module(".".join(parts).removesuffix(".__init__"))


def _documented() -> Iterator[tuple[str, Any]]:
    """Functions, classes and methods of the package that have a docstring, by their full name."""
    for module in _modules():
        for name, thing in vars(module).items():
            if getattr(thing, "__module__", None) != module.__name__ or not callable(thing):
                continue
            yield f"{module.__name__}.{name}", thing
            for inner, method in vars(thing).items() if inspect.isclass(thing) else ():
                plain = getattr(method, "__func__", method)
                if inspect.isfunction(plain):
                    yield f"{module.__name__}.{name}.{inner}", plain


def _named(doc: str, section: str) -> list[str]:
    return [name.strip().lstrip("*") for entry in NumpyDocString(doc)[section] for name in entry.name.split(",")]


WITH_PARAMETERS = {n: t for n, t in _documented() if "Parameters\n----" in (inspect.getdoc(t) or "")}
WITH_ATTRIBUTES = {
    n: t for n, t in _documented() if inspect.isclass(t) and "Attributes\n----" in inspect.cleandoc(t.__doc__ or "")
}


@pytest.mark.parametrize("name", WITH_PARAMETERS)
def test_parameters_are_those_of_the_signature(name: str) -> None:
    """In its order; those that are given by keyword alone may stand where they are understood best."""
    thing = WITH_PARAMETERS[name]
    taken = {n: p.kind is p.KEYWORD_ONLY for n, p in inspect.signature(thing).parameters.items()}
    taken = {n: by_keyword for n, by_keyword in taken.items() if n not in ("self", "cls")}
    named = _named(inspect.getdoc(thing) or "", "Parameters")
    assert sorted(named) == sorted(taken)
    assert [n for n in named if not taken[n]] == [n for n in taken if not taken[n]]


@pytest.mark.parametrize("name", WITH_ATTRIBUTES)
def test_attributes_are_those_of_the_class(name: str) -> None:
    """Fields of a record; any other class sets what it names."""
    cls = WITH_ATTRIBUTES[name]
    named = _named(inspect.getdoc(cls) or "", "Attributes")
    declared = [f.name for f in fields(cls)] if is_dataclass(cls) else list(getattr(cls, "_fields", ()))
    known = {*declared, *dir(cls), *getattr(cls, "__annotations__", ())}
    assert len(set(named)) == len(named)
    assert not {n for n in set(named) - known if f"self.{n}" not in inspect.getsource(cls)}


def test_there_is_something_to_compare() -> None:
    assert len(WITH_PARAMETERS) > 100
    assert len(WITH_ATTRIBUTES) > 50
