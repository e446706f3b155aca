"""Copies of the contract in one process, one for each FMU, do not meet in the caches of ``typing``."""

import functools
import importlib
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tsm_fmu.models import contract

KERNEL = """
from typing import NamedTuple
from {contract} import Quantity

class Params(NamedTuple):
    x_0: Annotated[float, Quantity("rad", "output offset", display="deg")] = {start}
    stage: Annotated[int, Quantity("1", "stage", lo=0, hi=2)] = 1
"""


class Equal:
    """``Annotated`` with the cache of Python 3.11.2, which asks for equality only, on any Python."""

    @staticmethod
    @functools.cache
    def made(params: Any) -> Any:
        return typing.Annotated[params]

    def __getitem__(self, params: Any) -> Any:
        return self.made(params)


@pytest.fixture
def copies() -> Iterator[list[ModuleType]]:
    """Three copies of the contract module, as three FMUs have them."""
    names = ("copy_of_the_first", "copy_of_the_second", "copy_of_the_third")
    loaded = []
    for name in names:
        sys.modules[name] = package = ModuleType(name)
        package.__path__ = [str(Path(str(contract.__file__)).parent)]
        loaded.append(importlib.import_module(f"{name}.contract"))
    yield loaded
    for module in [m for m in sys.modules if m.partition(".")[0] in names]:
        del sys.modules[module]


def params_of(copy: ModuleType, start: float, annotated: Any) -> Any:
    namespace: dict[str, Any] = {"Annotated": annotated, "__name__": f"kernel_of_{copy.__name__}"}
    exec(KERNEL.format(contract=copy.__name__, start=start), namespace)  # noqa: S102  the text above
    return namespace["Params"]


def test_copies_read_their_own_declarations_through_one_cache(copies):
    annotated = Equal()
    declared = [params_of(copy, start, annotated) for copy, start in zip(copies, (0.0, 0.25, -1.5), strict=True)]
    for copy, fields, start in zip(copies, declared, (0.0, 0.25, -1.5), strict=True):
        found = copy.variables(fields)
        assert [(v.name, v.kind, v.start) for v in found] == [("x_0", float, start), ("stage", int, 1)]
        assert all(type(v.quantity) is copy.Quantity for v in found)


def test_the_cache_of_this_test_hands_out_what_is_equal(copies):
    """Otherwise the test above could not fail."""
    annotated = Equal()
    first, second = (typing.NamedTuple("Q", [("unit", str)]) for _ in range(2))
    assert annotated[float, first("rad")] is annotated[float, second("rad")]


def test_a_quantity_equals_one_of_its_class_only(copies):
    first, second = (copy.Quantity("rad", "angle", lo=0.0) for copy in copies[:2])
    again = copies[0].Quantity("rad", "angle", lo=0.0)
    assert first == again
    assert (first != again) is False
    assert hash(first) == hash(again)
    for other in (second, tuple(first)):
        assert first != other
        assert other != first
        assert (first == other) is False
        assert len({first, other}) == 2
