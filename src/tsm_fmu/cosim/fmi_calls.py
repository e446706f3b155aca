"""The calls of the step loop: one FMI function each, with buffers prepared once, callable from here or by address."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

WARNING, FATAL = 1, 4
"""The highest status with which a run goes on, and that after which nothing may be called."""

C_TYPES: dict[str, Any] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int,
    "Boolean": ctypes.c_int,
    "String": ctypes.c_char_p,
    "Float64": ctypes.c_double,
    "Float32": ctypes.c_float,
    **{
        f"{sign}Int{bits}": getattr(ctypes, f"c_{sign.lower()}int{bits}")
        for sign in ("", "U")
        for bits in (8, 16, 32, 64)
    },
}
"""Of the FMI types; a Boolean of FMI 3.0 is another (`c_type`)."""


def c_type(kind: str, fmi3: bool) -> Any:
    """The C type of an FMI type."""
    return ctypes.c_bool if fmi3 and kind == "Boolean" else C_TYPES[kind]


def address(thing: Any) -> int:
    """Address of a C function, or what a pointer holds; 0 for NULL."""
    return ctypes.cast(thing, ctypes.c_void_p).value or 0


@dataclass(frozen=True)
class Block:
    """The ports of one FMI type that are read or written in one call.

    Attributes
    ----------
    names : tuple of str
        Variable names, in buffer order.
    values : ctypes array
        The buffer.
    function, component : ctypes function and pointer
        Of the FMU.
    references : ctypes array
        Value references, one for each variable.
    counted : bool
        Whether the call also takes the number of values (FMI 3.0).
    """

    names: tuple[str, ...]
    values: Any
    function: Any
    component: Any
    references: Any
    counted: bool
    _arguments: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        arguments = (self.component, self.references, len(self.references), self.values)
        object.__setattr__(self, "_arguments", (*arguments, len(self.values)) if self.counted else arguments)

    @property
    def real(self) -> bool:
        """Whether the values can be other than finite."""
        return self.values._type_ in (ctypes.c_double, ctypes.c_float)

    def call(self) -> int:
        """Move the buffer to or from the FMU; returns the FMI status."""
        return self.function(*self._arguments)

    def addresses(self) -> tuple[int, ...]:
        """Function, component, references, their number, values, their number."""
        return (
            address(self.function),
            address(self.component),
            ctypes.addressof(self.references),
            len(self.references),
            ctypes.addressof(self.values),
            len(self.values),
        )


class Step:
    """``doStep`` of an FMU.

    Parameters
    ----------
    function, component : ctypes function and pointer
        Of the FMU.
    fmi3 : bool
        Whether it also answers with flags and the time that it reached.

    Attributes
    ----------
    goes_back : bool
        Whether a state from before a step may be restored after it, of which the FMU is told.
    """

    def __init__(self, function: Any, component: Any, fmi3: bool) -> None:
        self._function, self._component, self.fmi3 = function, component, fmi3
        self.goes_back = False
        self._flags = (ctypes.c_bool * 3)()  # event handling needed, terminate, early return
        self._reached = ctypes.c_double()
        flags: Sequence[Any] = [ctypes.byref(self._flags, k) for k in range(3)]
        pointers = [ctypes.cast(flag, ctypes.POINTER(ctypes.c_bool)) for flag in flags]
        self._answers = (*pointers, ctypes.byref(self._reached))

    def __call__(self, time: float, dt: float) -> int:
        if self.fmi3:
            return self._function(self._component, time, dt, not self.goes_back, *self._answers)
        return self._function(self._component, time, dt, not self.goes_back)

    def ended_at(self, time: float, dt: float) -> float | None:
        """Time that an FMI 3.0 unit reached when it asked to end the simulation [s]; None while it goes on."""
        if not self._flags[1]:
            return None
        return self._reached.value if self._reached.value > time else time + dt

    def addresses(self) -> tuple[int, ...]:
        """Function and component; for FMI 3.0 also the three flags and the time reached."""
        found = (address(self._function), address(self._component))
        if not self.fmi3:
            return found
        first = ctypes.addressof(self._flags)
        return (*found, first, first + 1, first + 2, ctypes.addressof(self._reached))
