"""A kernel module as one object: declared variables, validated parameters, plain and compiled simulation."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..models import MODELS
from ..models.contract import (
    Condition,
    InputError,
    Preset,
    Roles,
    Variable,
    check_bounds,
    check_conditions,
    conditions_of,
    flat,
    packed,
    sizes,
    variables,
)
from .arrays import FloatArray
from .compiled_cache import folder, kept, own, written

INLINED = 10_000
"""Bytes of code of a ``start`` or ``step``, with all it calls, up to which it is inlined: to pass a state of many
fields costs more than most steps. Beyond, it does not show, and each copy would take seconds to compile."""


@dataclass(frozen=True)
class Kernel:
    """One model or effect in kernel form.

    Attributes
    ----------
    module : module
        The model's own file; `name`, the variables and the presets derive from it.
    """

    module: ModuleType

    @property
    def name(self) -> str:
        return self.module.NAME

    @cached_property
    def parameters(self) -> tuple[Variable, ...]:
        return variables(self.module.Params)

    @cached_property
    def by_name(self) -> Mapping[str, Variable]:
        """Parameters by public name."""
        return {v.name: v for v in self.parameters}

    @cached_property
    def inputs(self) -> tuple[Variable, ...]:
        return variables(self.module.Inputs)

    @cached_property
    def outputs(self) -> tuple[Variable, ...]:
        return variables(self.module.Outputs)

    @property
    def presets(self) -> Mapping[str, Preset]:
        return self.module.PRESETS

    @property
    def roles(self) -> Roles:
        """What its variables are for those that work with any model; an effect has none of these roles."""
        return getattr(self.module, "ROLES", Roles())

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """What its parameters must meet together; those that only warn are not among them."""
        return tuple(c for c in conditions_of(self.module) if not c.consequence)

    @property
    def motion(self) -> str:
        """Its input that moves: a position, else the speed ``v``; '' for none."""
        return self.roles.motion or ("v" if "v" in self.module.Inputs._fields else "")

    def params(self, preset: str | None = None, values: Mapping[str, float] | None = None) -> Any:
        """Validated parameters: a preset, changed by ``values`` (public names, SI).

        Parameters
        ----------
        preset : str, optional
            Name in `presets`; without it the defaults, which are the first preset.
        values : mapping of str to float, optional
            Values by public name.

        Returns
        -------
        Params
            The kernel's named tuple.

        Raises
        ------
        InputError
            Unknown preset or name, value not a number, out of bounds, or a joint condition violated.
        """
        if preset is not None:
            if preset not in self.presets:
                raise InputError(
                    f"preset {preset!r} of {self.name} -- expected one of {', '.join(self.presets)} "
                    "-- see 'tsm-fmu list'"
                )
            values = {**self.presets[preset].si, **(values or {})}
        numbers = {name: v.start for name, v in self.by_name.items()}
        for name, value in (values or {}).items():
            numbers[name] = _number(self._declared(name), value)
        p = packed(self.module.Params, list(numbers.values()))
        self.check(p)
        return p

    def allowed(self, values: Sequence[Mapping[str, float]]) -> tuple[FloatArray, list[int]]:
        """Parameters changed by several sets of values that `params` takes, and the numbers of these sets.

        Parameters
        ----------
        values : sequence of mapping of str to float
            Sets of values by public name, numbers that are floats, each of the same names.

        Returns
        -------
        table : ndarray, shape (sets that are allowed, parameters)
        numbers : list of int

        Raises
        ------
        InputError
            Unknown name.
        """
        table = np.tile([float(v.start) for v in self.parameters], (len(values), 1))
        for name in values[0] if values else ():
            table[:, self.parameters.index(self._declared(name))] = [one[name] for one in values]
        low, high = self.ends
        within = np.flatnonzero(((low <= table) & (table <= high)).all(axis=1)).tolist()
        numbers = [i for i in within if all(condition.met(self.of_row(table[i])) for condition in self.conditions)]
        return table[numbers], numbers

    def _declared(self, name: str) -> Variable:
        if name not in self.by_name:
            raise InputError(
                f"parameter {name!r} of {self.name} -- expected one of {', '.join(self.by_name)} -- see 'tsm-fmu list'"
            )
        return self.by_name[name]

    @cached_property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Least and largest allowed value of each parameter; finite, and inside of a bound that is not allowed."""
        quantities = [v.quantity for v in self.parameters]
        low = [np.nextafter(q.lo, np.inf) if q.open_lo or np.isinf(q.lo) else q.lo for q in quantities]
        high = [np.nextafter(q.hi, -np.inf) if q.open_hi or np.isinf(q.hi) else q.hi for q in quantities]
        return np.array(low), np.array(high)

    def of_row(self, row: FloatArray) -> Any:
        """The kernel's named tuple of one row of a table of parameters, integers as integers."""
        values = row.tolist()
        for j in self._whole:
            values[j] = int(values[j])
        return packed(self.module.Params, values)

    @cached_property
    def _whole(self) -> list[int]:
        return [j for j, v in enumerate(self.parameters) if v.kind is int]

    def named(self, p: Any) -> dict[str, float]:
        """Values of parameters by public name, SI."""
        return {v.name: v.kind(value) for v, value in zip(self.parameters, flat(p), strict=True)}

    def check(self, p: Any) -> None:
        """Raise `InputError` where ``p`` violates a bound or a joint condition."""
        check_bounds(self.parameters, p)
        check_conditions(self.conditions, p)

    def warnings(self, p: Any) -> tuple[str, ...]:
        """Say what a user should know about allowed parameters, one line each."""
        return check_conditions(conditions_of(self.module), p)

    def compiled(self, table: FloatArray) -> Callable[..., None]:
        """What simulates it for each row of a table of parameters; see `compiled_run`."""
        del table  # to those that ask
        return compiled_run(self.module)

    def simulate(self, p: Any, time: ArrayLike, inputs: ArrayLike, *, compiled: bool = True) -> FloatArray:
        """Outputs at every row: row 0 starts the kernel, row k+1 is its k-th step.

        Parameters
        ----------
        p : Params
            From `params`.
        time : array_like, shape (n,)
            Time [s], strictly increasing.
        inputs : array_like, shape (n, number of inputs)
            Inputs by column, in declared order, SI.
        compiled : bool
            Use the numba form; the plain Python form gives the same numbers.

        Returns
        -------
        ndarray, shape (n, number of outputs)

        Raises
        ------
        InputError
            Wrong shapes, NaN, time not increasing, or a condition lost while running.
        """
        t = np.ascontiguousarray(time, dtype=float)
        u = np.ascontiguousarray(inputs, dtype=float)
        if t.ndim != 1 or t.size == 0 or u.shape != (t.size, len(self.inputs)):
            raise InputError(
                f"inputs of shape {u.shape} at times of shape {t.shape} for {self.name} -- expected "
                f"({t.size}, {len(self.inputs)}): one column for each of "
                f"{', '.join(v.name for v in self.inputs) or 'no inputs'} -- transpose or complete them"
            )
        if not np.isfinite(u).all():
            row, column = np.argwhere(~np.isfinite(u))[0]
            raise InputError(
                f"input {self.inputs[column].name} = {u[row, column]} in row {row} (t = {t[row]:g} s) -- expected a "
                "finite number -- cut or repair the log"
            )
        if not np.isfinite(t).all():
            row = int(np.argmin(np.isfinite(t)))
            raise InputError(f"time {t[row]} s in row {row} -- expected a finite number -- cut or repair the log")
        later = t[1:] > t[:-1]
        if not later.all():
            row = int(np.argmin(later)) + 1
            raise InputError(
                f"time {t[row]} s in row {row} -- expected more than {t[row - 1]} s -- sort or cut the log"
            )
        y = np.empty((t.size, len(self.outputs)))
        table = np.array([flat(p)], dtype=float)
        run = self.compiled(table) if compiled else plain_run(self.module)
        try:
            run(table, np.array([[0, t.size, 0]]), t, u, y, np.zeros(1, dtype=np.int64))
        except (ValueError, ArithmeticError) as failure:
            advice = "" if " -- " in str(failure) else " -- expected finite numbers -- check parameters and inputs"
            raise InputError(f"{self.name} stopped: {failure}{advice}") from failure
        return y


@cache
def compiled_run(module: ModuleType) -> Callable[..., None]:
    """Compiled form of a kernel's loops over records; ``run(table, spans, t, u, y, at)`` fills ``y`` row by row.

    ``table[i]`` holds the parameters of the i-th simulation, ``spans[i]`` its first row in ``t`` and ``u``, the one
    after its last, and its first in ``y``. Simulations begin with that of number ``at[0]``, which counts them: after
    a failure it is the one that failed. All of them run without the interpreter's lock.
    """
    return _over_records(module, compiled_loops(module))


def plain_run(module: ModuleType) -> Callable[..., None]:
    """The same in plain Python."""
    return _over_records(module, _runner(module, module.start, module.step))


def _over_records(module: ModuleType, loops: Callable[..., None]) -> Callable[..., None]:
    """Loops for inputs that are the columns of one array."""
    count = len(module.Inputs._fields)
    columns = np.array([np.arange(count), np.ones(count)], dtype=np.int64)

    def run(table: FloatArray, spans: Any, t: FloatArray, u: FloatArray, y: FloatArray, at: Any) -> None:
        spans = np.column_stack([spans, *[spans[:, 0]] * count])
        loops(table, spans, read_only(t), (read_only(u),) * count, columns, y, at)

    return run


@cache
def compiled_loops(module: ModuleType) -> Any:
    """Function of numba behind `compiled_run`, compiled for the types of its first call.

    ``loops(table, spans, t, u, columns, y, at)``: the j-th input is in the array ``u[j]``, in its column
    ``columns[0, j]``, from row ``spans[i, 3 + j]`` on in steps of ``columns[1, j]``, 0 for a number that stays.
    ``start`` and ``step`` are compiled by cloning them, and the functions they call, with numba's globals.
    """
    return _njit(_runner(module, _clone(module.start), _clone(module.step)))


@cache
def is_kept(module: ModuleType) -> bool:
    """Whether the loops of a kernel are compiled already, by another process."""
    place = folder()
    if place is None:
        return False
    with os.scandir(place) as entries:
        folders = [(entry.path, entry.stat().st_mtime_ns) for entry in entries if entry.is_dir()]
    return any(_loops_name(module) in _compiled_in(*one) for one in folders)


@lru_cache
def _compiled_in(path: str, changed: int) -> frozenset[str]:
    """Names of what is compiled in a folder that was changed at a time: thousands of files, and each chain asks."""
    del changed
    return frozenset(name.partition(".run-")[0] for name in os.listdir(path) if name.endswith(".nbi"))


def _loops_name(module: ModuleType) -> str:
    return f"loop_{module.__name__.rpartition('.')[2]}"


def read_only(array: FloatArray) -> FloatArray:
    """An array as the loops take it: to numba one that may be written to is of another type, compiled once more."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _njit(function: Any, **options: Any) -> Any:
    from numba import njit  # heavy: only those who compile pay for the import

    options["no_cfunc_wrapper"] = True  # costly, and nobody would call it
    with kept(function.__module__) as cache_it:
        on_disk = cache_it and os.path.isfile(function.__code__.co_filename)
        return njit(error_model="numpy", nogil=True, cache=on_disk, **options)(function)


@cache
def _code_size(function: FunctionType) -> int:
    """Bytes of code of a function and of those it calls, each counted where it is called."""
    called = (function.__globals__.get(name) for name in function.__code__.co_names)
    return len(function.__code__.co_code) + sum(_code_size(f) for f in called if isinstance(f, FunctionType))


@cache
def _clone(function: FunctionType) -> Any:
    """Clone of a function; kept, so that chains with the same model or effect compile it once."""
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if isinstance(names.get(name), FunctionType):
            names[name] = _clone(names[name])
    copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    inlined = function.__name__.endswith(("start", "step")) and _code_size(function) < INLINED
    return _njit(copy, no_cpython_wrapper=True, forceinline=inlined)


def _runner(module: ModuleType, start: Any, step: Any) -> Any:
    """The loops over records, written out so that numba sees one named tuple per row."""
    inputs = range(len(module.Inputs._fields))

    def row(k: str) -> str:
        return f"Inputs({', '.join(f'u[{j}][a{j} + d{j} * {k}, c{j}]' for j in inputs)})"

    def stored(indent: str, row: str) -> str:
        return "".join(f"{indent}y[{row}, {j}] = o.{f}\n" for j, f in enumerate(module.Outputs._fields))

    numbers = [f"{v.kind.__name__}(table[i, {j}])" for j, v in enumerate(variables(module.Params))]
    values = ", ".join(_nested(numbers, sizes(module.Params)))
    source = (
        "def run(table, spans, t, u, columns, y, at):\n"
        + "".join(f"    c{j}, d{j} = columns[0, {j}], columns[1, {j}]\n" for j in inputs)
        + f"    for i in range(at[0], len(table)):\n"
        f"        at[0] = i\n"
        f"        p = Params({values})\n"
        f"        first, end, to = spans[i, 0], spans[i, 1], spans[i, 2]\n"
        + "".join(f"        a{j} = spans[i, {3 + j}]\n" for j in inputs)
        + f"        s, o = start(p, {row('0')})\n"
        f"{stored('        ', 'to')}"
        f"        for k in range(1, end - first):\n"
        f"            s, o = step(p, s, {row('k')}, t[first + k] - t[first + k - 1])\n"
        f"{stored('            ', 'to + k')}"
    )
    names: dict[str, Any] = {"__name__": module.__name__, "start": start, "step": step}
    names |= {"Params": module.Params, "Inputs": module.Inputs}
    name = _loops_name(module)
    file = written(name, source) if own(module.__name__) else f"<{name}>"
    exec(compile(source, file, "exec"), names)  # noqa: S102  our own text, no input in it
    return names["run"]


def _nested(numbers: list[str], lengths: tuple[int, ...]) -> list[str]:
    """Texts of numbers as those of fields, of which some are tuples."""
    left, found = iter(numbers), []
    for length in lengths:
        found.append(f"({', '.join(next(left) for _ in range(length))},)" if length else next(left))
    return found


def _number(variable: Variable, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if math.isnan(number) or (variable.kind is int and not number.is_integer()):
        kind = "an integer" if variable.kind is int else "a number"
        raise InputError(
            f"parameter {variable.name} = {value!r} -- expected {kind} [{variable.quantity.unit}] -- correct it"
        )
    return variable.kind(number)


@cache
def kernel(name: str) -> Kernel:
    """The model called ``name`` (its FMU name).

    Raises
    ------
    InputError
        If there is no such model; the message lists those that exist.
    """
    for module in MODELS:
        if module.NAME == name:
            return Kernel(module)
    raise InputError(f"model {name!r} -- expected one of {', '.join(m.NAME for m in MODELS)} -- see 'tsm-fmu list'")
