"""Compiled forms that serve more than one chain, so that a search compiles fewer.

A chain with one effect more, at its neutral values, gives the same numbers bit for bit: what is compiled of it serves
the smaller chain too. To compile one takes as long as many simulations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from .arrays import FloatArray
from .chain import Chain
from .kernel import Kernel, compiled_run


@dataclass(frozen=True)
class Serving:
    """A compiled form, and where the parameters of the kernel that it serves stand in its own.

    Attributes
    ----------
    run : callable
        Of `kernel.compiled_run`.
    columns : ndarray of int, shape (parameters,)
        Column of each parameter of the kernel that is served.
    neutral : ndarray, shape (parameters of the compiled form,)
        Values of the others.
    """

    run: Callable[..., None]
    columns: np.ndarray
    neutral: FloatArray

    def fill(self, table: FloatArray, spans: Any, t: FloatArray, u: FloatArray, y: FloatArray) -> None:
        """Fill ``y`` as `kernel.compiled_run` does, with NaN for a simulation that stops."""
        table, at = self.widened(table), np.zeros(1, dtype=np.int64)
        while at[0] < len(table):
            try:
                self.run(table, spans, t, u, y, at)
                break
            except (ValueError, ArithmeticError):
                first, end, to = spans[at[0]]
                y[to : to + end - first] = np.nan
                at[0] += 1

    def widened(self, table: FloatArray) -> FloatArray:
        """A table of values of the kernel as the compiled form takes it."""
        if table.shape[1] == self.neutral.size:
            return table
        found = np.tile(self.neutral, (len(table), 1))
        found[:, self.columns] = table
        return found


def filling(kernel: Kernel, table: FloatArray) -> Callable[..., Any]:
    """What simulates a kernel for a table of parameters: ``fill(table, spans, t, u, y)``, NaN where one stops."""
    staged = kernel.in_stages(table) if isinstance(kernel, Chain) else None
    return staged.fill if staged else serving(kernel).fill


_COMPILED: dict[str, dict[tuple[str, ...], Kernel]] = {}
"""Chains that were compiled in this process, by model and effects."""
_FOUND: dict[ModuleType, Serving] = {}


def serving(kernel: Kernel) -> Serving:
    """A compiled form of a kernel: its own, or that of a chain with more effects where this one is compiled already.

    Parameters
    ----------
    kernel : Kernel
        Of `kernel.kernel` or `chain.chain`.
    """
    if kernel.module not in _FOUND:
        effects = tuple(getattr(kernel.module, "EFFECTS", ()))
        there = _COMPILED.setdefault(kernel.name, {})
        larger = [chain for specs, chain in list(there.items()) if _serves(chain, specs, kernel, effects)]
        used = min(larger, key=lambda chain: len(chain.parameters), default=kernel)
        if used is kernel:
            there[effects] = kernel
        fields = [v.field for v in used.parameters]
        _FOUND[kernel.module] = Serving(
            compiled_run(used.module),
            np.array([fields.index(v.field) for v in kernel.parameters], dtype=int),
            np.array([v.start for v in used.parameters]),
        )
    return _FOUND[kernel.module]


def _serves(chain: Kernel, specs: tuple[str, ...], kernel: Kernel, effects: tuple[str, ...]) -> bool:
    """Whether a chain has all effects of another one in the same order, and its inputs and outputs."""
    left = iter(specs)
    in_order = all(spec in left for spec in effects)
    return in_order and chain.inputs == kernel.inputs and chain.outputs == kernel.outputs
