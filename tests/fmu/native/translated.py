"""Kernels translated to C, compiled with the compiler of this machine and called in this process: the same libm."""

from __future__ import annotations

import ctypes
import math
import random
import subprocess
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.fmu.native.types import Array, Record, Type, c_variable
from tsm_fmu.fmu.native.zig import c_compiler
from tsm_fmu.kernels.kernel import Kernel

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror")
LAYER = resources.files("tsm_fmu.fmu.native").joinpath("c")


class Fault(ctypes.Structure):
    _fields_ = (("raised", ctypes.c_bool), ("text", ctypes.c_char * 1024))


def structure(cls: Any) -> type[ctypes.Structure]:
    """The struct that a named-tuple class becomes."""
    fields = [(c_variable(name), _c_type(kind)) for name, kind in Record(cls).fields.items()]
    return type(cls.__name__, (ctypes.Structure,), {"_fields_": fields or [("none", ctypes.c_char)]})


def _c_type(kind: Type) -> Any:
    if isinstance(kind, Array):
        return _c_type(kind.item) * kind.size
    return {"float": ctypes.c_double, "int": ctypes.c_int}[kind.name]  # type: ignore[union-attr]


class Translated:
    """A kernel in C with the interface of the Python one; a fault becomes the exception `ValueError`."""

    def __init__(
        self, kernel: Kernel, folder: Path, compiler: tuple[str, ...] = (), flags: tuple[str, ...] = ()
    ) -> None:
        self.kernel, self.module = kernel, kernel.module
        for name, text in model_files(kernel).items():
            (folder / name).write_text(text)
        library = folder / "model.so"
        sources = [*map(str, folder.glob("*.c")), str(LAYER / "checked.c")]
        command = [*(compiler or c_compiler()), *FLAGS, *flags, "-I", str(LAYER), *sources, "-lm", "-o", str(library)]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, f"{kernel.name}: {done.stderr}"
        self.library = ctypes.CDLL(str(library))
        self._made = {n: structure(getattr(self.module, n)) for n in ("Params", "State", "Inputs", "Outputs")}

    def start(self, p: Any, u: Any) -> tuple[Any, Any]:
        return self._call("model_start", self._put(p, "Params"), self._put(u, "Inputs"))

    def step(self, p: Any, s: Any, u: Any, dt: float) -> tuple[Any, Any]:
        given = self._put(p, "Params"), self._put(s, "State"), self._put(u, "Inputs")
        return self._call("model_step", *given, ctypes.c_double(dt))

    def step_derivative(self, p: Any, s: Any, u: Any, dt: float, dp: Any, ds: Any, du: Any) -> tuple[Any, Any]:
        given = self._put(p, "Params"), self._put(s, "State"), self._put(u, "Inputs")
        changes = self._put(dp, "Params"), self._put(ds, "State"), self._put(du, "Inputs")
        return self._call("model_step_derivative", *given, ctypes.c_double(dt), *changes)

    def _call(self, function: str, *arguments: Any) -> tuple[Any, Any]:
        state, outputs, fault = self._made["State"](), self._made["Outputs"](), Fault()
        passed = [a if isinstance(a, ctypes.c_double) else ctypes.byref(a) for a in arguments]
        self.library[function](*passed, ctypes.byref(state), ctypes.byref(outputs), ctypes.byref(fault))
        if fault.raised:
            raise ValueError(fault.text.decode())
        return self._got(state, "State"), self._got(outputs, "Outputs")

    def _put(self, values: Any, name: str) -> ctypes.Structure:
        made = self._made[name]()
        for (field, kind, *_), value in zip(made._fields_, values, strict=False):
            setattr(made, field, kind(*value) if isinstance(value, tuple) else value)
        return made

    def _got(self, made: ctypes.Structure, name: str) -> Any:
        cls = getattr(self.module, name)
        read = (getattr(made, c_variable(field)) for field in cls._fields)
        return cls(*(tuple(v) if isinstance(v, ctypes.Array) else v for v in read))


def random_parameters(kernel: Kernel, source: random.Random) -> Any:
    """Allowed parameters about a preset, some at their bounds."""
    while True:
        preset = source.choice([None, *kernel.presets])
        values = kernel.named(kernel.params(preset))
        for v in kernel.parameters:
            values[v.name] = _near(v, values[v.name], source)
        try:
            return kernel.params(values=values)
        except ValueError:
            continue


def _near(variable: Any, value: float, source: random.Random) -> float:
    quantity = variable.quantity
    if variable.kind is int:
        return source.randint(int(quantity.lo), int(min(quantity.hi, 8)))
    if source.random() < 0.5:
        return value
    if source.random() < 0.1:
        return next((x for x in (quantity.lo, quantity.hi) if math.isfinite(x)), 0.0)
    moved = value * math.exp(source.gauss(0.0, 0.4)) if value else source.gauss(0.0, 0.3)
    return min(max(moved, quantity.lo), quantity.hi)


def random_inputs(kernel: Kernel, source: random.Random, count: int) -> Iterator[Any]:
    """Inputs that wander, rest and now and then jump far."""
    scales = {"N": 7.1, "V": 11.3, "m": 0.013, "m/s": 0.05, "N.m": 0.06}
    last = [source.gauss(0.5, 0.3) * scales.get(v.quantity.unit, 1.0) for v in kernel.inputs]
    for _ in range(count):
        if source.random() > 0.15:
            for k, v in enumerate(kernel.inputs):
                scale = scales.get(v.quantity.unit, 1.0) * (40.0 if source.random() < 0.02 else 0.3)
                last[k] = 0.0 if source.random() < 0.03 else last[k] * 0.98 + source.gauss(0.0, scale)
        yield kernel.module.Inputs(*last)
