"""All that an author of a model or of an effect may declare, and the checks that hold for every one.

A *kernel* is a module with four named tuples and pure functions on them. Both kinds declare::

    NAME = "TendonDrive"                       name of the FMU, or id of the effect
    class Params, State, Inputs, Outputs       fields: name: Annotated[float, Quantity(unit, meaning, ...)] = default
    PRESETS = {"published": Preset(...)}       named parameter sets, the first one equal to the defaults; an effect: {}
    start(p, u)        -> (state, outputs)     at the first input: motion starts there, no jump from zero
    step(p, s, u, dt)  -> (state, outputs)     inputs hold over the step, outputs are those at its end
    CONDITIONS = (Condition(...), ...)         what several parameters must meet together; optional

A model alone::

    ROLES = Roles(motion="x_in", ...)          what its variables are for others, its friction port (roles.py); optional

An effect alone (its Inputs are any of `SIGNALS`, its only output is ``y``)::

    NEUTRAL = Params()                         parameters with which it changes nothing
    ABOUT = Effect(words, signature, ...)      what else is known of it; each parameter is Annotated with a Size or a
                                               Shape too (effects/about.py)

Each variable is declared once: FMU variables, documentation, bounds of a fit and the command line derive from that
declaration. The public name drops a trailing underscore of the field (``lambda_``). A field of Params or State may be a
tuple of floats whose type says its length, ``L: Annotated[tuple[float, float], Quantity(...)]``: it is the variables
L_1 and L_2. Numbers in the state are always floats, so that the compiled form keeps one type from step to step.
Docstrings hold the equations, numbered ``(1)``, their source and their validity (of an effect: its limits).

A ``start`` or ``step`` that cannot go on raises ValueError(``what -- what was expected -- what to do``).

Parameters that simulate but bite are conditions with a consequence: an FMU logs the line at its start, the command line
prints it, nothing is refused.

This file runs inside an FMU on a host that has only Python: it imports ``typing`` and ``math`` alone.
"""

import math
from typing import (  # noqa: UP035  a kernel file imports nothing but typing and math
    Annotated,
    Any,
    Callable,
    Mapping,
    NamedTuple,
    get_args,
    get_origin,
    get_type_hints,
)

from .roles import SLIDING_SHARE, DefaultExperiment, FrictionPort, HeldLoad, Roles

__all__ = [
    "SIGNALS",
    "SLIDING_SHARE",
    "Condition",
    "DefaultExperiment",
    "FrictionPort",
    "HeldLoad",
    "InputError",
    "Preset",
    "Quantity",
    "Roles",
    "Variable",
    "bounds_in_words",
    "check_bounds",
    "check_conditions",
    "conditions_of",
    "flat",
    "named",
    "packed",
    "sizes",
    "variables",
]


SIGNALS = {
    "y": "what the effect changes, before it; always the first",
    "x": "position of the drive, or a column of the log; the travel where the model has its speed only",
    "v": "speed of the drive",
    "a": "acceleration of the drive",
    "s": "direction of the last motion: -1, 1, or 0 before any",
    "z": "presliding state between -1 and 1",
    "x_pre": "presliding distance, after which z has turned",
    "load": "the model's load, `Roles.load`, or a column of the log",
    "drive": "load or tension at the drive side, `Roles.drive`; 0 in a model without",
    "bend": "total bending angle of the sheath, a column of the log: the chain gains an input for it",
    "temperature": "a measured temperature, a column of the log: the chain gains an input for it",
}
"""What an effect may take as fields of its ``Inputs``, by name; x to z are those of effects/coordinates.py."""


class InputError(ValueError):
    """Wrong input: one line that says what, the value, what was expected and what to do."""


class Quantity(NamedTuple):
    """Unit, meaning and bounds of one variable, in SI.

    Equal only to one of the same class, unlike other named tuples: each FMU in a process has a copy of this
    file, and ``typing`` hands out ``Annotated[...]`` from a cache, which in Python 3.11.2 looks at equality alone
    and so would answer with another FMU's class.

    Attributes
    ----------
    unit : str
        SI unit as FMI writes it: ``"N"``, ``"rad/s"``, ``"1/rad"``, ``"1"`` for a pure number.
    meaning : str
        What the quantity is, with the source's equation number where it has one.
    lo, hi : float
        Bounds; ``open_lo``/``open_hi`` say that the bound itself is not allowed.
    display : str
        Unit that people prefer to read (``"deg"``, ``"mm"``); empty: the SI unit.
    choices : tuple of str
        Names of the whole numbers from `lo` to `hi`, where they are a choice (an FMI Enumeration) and not a count.
    """

    unit: str
    meaning: str
    lo: float = -math.inf
    hi: float = math.inf
    open_lo: bool = False
    open_hi: bool = False
    display: str = ""
    choices: tuple[str, ...] = ()

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and tuple.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((type(self), *self))


class Variable(NamedTuple):
    """A declared number: public name, the same as an identifier of Python, type, start value and `Quantity`.

    The identifier is the field's name; for an item of a tuple, the field's name with the number of the item from 1.
    """

    name: str
    field: str
    kind: type
    start: float
    quantity: Quantity


class Preset(NamedTuple):
    """A named parameter set.

    Attributes
    ----------
    source : str
        Where the numbers are from.
    printed : dict of str to (float, str)
        The numbers as the source prints them, with the source's unit.
    si : dict of str to float
        The same in SI, only where they differ from the default of the field.
    """

    source: str
    printed: dict[str, tuple[float, str]]
    si: dict[str, float]


class Condition(NamedTuple):
    """What several parameters must meet together, as data: by how much they do, and what is said where they do not.

    The texts are the three parts of one line, ``what -- expected ... -- remedy``; in them ``{name}`` is a parameter by
    its public name, ``{margin}`` the margin or one of the `numbers`, with a format as in ``str.format``.

    Attributes
    ----------
    expected : str
        What must hold, ``"B > 0"``.
    margin : callable
        ``margin(p) -> float``: above 0 where it holds, and the further above the further inside.
    what : str
        What the parameters are instead.
    remedy : str
        What to do.
    closed : bool
        Whether it holds where the margin is 0.
    numbers : mapping of str to callable
        Further numbers of the texts, ``number(p) -> float``.
    consequence : str
        What comes of it where the parameters are allowed all the same: a warning, ``what -- consequence -- remedy``.
    part : callable or None
        In a chain, ``part(p)``: the parameters of the effect that the condition is of; None: ``p`` itself.
    """

    expected: str
    margin: Callable[[Any], float]
    what: str
    remedy: str
    closed: bool = False
    numbers: Mapping[str, Callable[[Any], float]] = {}
    consequence: str = ""
    part: Callable[[Any], Any] | None = None

    def met(self, p: Any) -> bool:
        """Whether the parameters meet it; False for a margin that is no number."""
        margin = self.margin_of(p)
        return margin > 0.0 or (self.closed and margin == 0.0)

    def margin_of(self, p: Any) -> float:
        """The margin of these parameters."""
        return self.margin(self._own(p))

    def expectation(self, p: Any) -> str:
        """What must hold, with the numbers of these parameters."""
        return self.expected.format_map(self._values(p))

    def sentence(self, p: Any) -> str:
        """The line about parameters that do not meet it."""
        values = self._values(p)
        middle = self.consequence or f"expected {self.expected}"
        return " -- ".join(text.format_map(values) for text in (self.what, middle, self.remedy))

    def _own(self, p: Any) -> Any:
        return p if self.part is None else self.part(p)

    def _values(self, p: Any) -> dict[str, float]:
        own = self._own(p)
        numbers = {name: number(own) for name, number in self.numbers.items()}
        return {**named(own), **numbers, "margin": self.margin(own)}


def variables(fields: Any) -> tuple[Variable, ...]:
    """List the declared variables of a named-tuple class in field order, those of a tuple item by item.

    A trailing underscore of a field name (``lambda_``) is not part of the public name, and a double
    one inside it (``load_dependence__k``) is its dot. A field without a default starts at 0.

    Raises
    ------
    TypeError
        If a field is not ``Annotated[float | int | tuple[float, ...], Quantity(...)]``, the tuple of known length.
    """
    found = []
    for field, (kind, quantity) in _declared(fields).items():
        name, default = field.rstrip("_").replace("__", "."), fields._field_defaults.get(field, 0)
        items = get_args(kind)
        if not items:
            found.append(Variable(name, field, kind, kind(default), quantity))
        for k, item in enumerate(items):
            start = float(default[k]) if default else 0.0
            found.append(Variable(f"{name}_{k + 1}", f"{field}_{k + 1}", item, start, quantity))
    return tuple(found)


def sizes(fields: Any) -> tuple[int, ...]:
    """Length of each field of a declared named-tuple class that is a tuple, 0 for a number."""
    if fields not in _SIZES:
        _SIZES[fields] = tuple(len(get_args(kind)) for kind, _ in _declared(fields).values())
    return _SIZES[fields]


def flat(values: Any) -> tuple[float, ...]:
    """Numbers of an instance of a declared named-tuple class, in the order of its `variables`."""
    return tuple(number for value in values for number in (value if isinstance(value, tuple) else (value,)))


def packed(fields: Any, numbers: Any) -> Any:
    """Instance of a declared named-tuple class from its numbers: the inverse of `flat`.

    Raises
    ------
    TypeError
        Too few numbers or too many.
    """
    lengths = sizes(fields)
    if not any(lengths) and len(numbers) == len(lengths):
        return fields(*numbers)
    left = iter(numbers)
    if len(numbers) != sum(length or 1 for length in lengths):
        raise TypeError(f"{len(numbers)} numbers for {fields.__qualname__} -- expected {len(variables(fields))}")
    return fields(*[tuple([next(left) for _ in range(length)]) if length else next(left) for length in lengths])


_DECLARED: dict[Any, dict[str, tuple[Any, Quantity]]] = {}
"""What was read of each class: it is asked for at every simulation."""
_SIZES: dict[Any, tuple[int, ...]] = {}
"""The same of the lengths of its fields."""


def _declared(fields: Any) -> dict[str, tuple[Any, Quantity]]:
    """Type and quantity of each field."""
    if fields not in _DECLARED:
        hints, found = get_type_hints(fields, include_extras=True), {}
        for field in fields._fields:
            hint = hints[field]
            if get_origin(hint) is not Annotated or not isinstance(get_args(hint)[1], Quantity):
                raise TypeError(f"{fields.__qualname__}.{field} is not Annotated[type, Quantity(...)]")
            kind, quantity = get_args(hint)[:2]
            if kind not in (float, int) and (get_origin(kind) is not tuple or set(get_args(kind)) != {float}):
                raise TypeError(f"{fields.__qualname__}.{field} is no float, int or tuple of floats of known length")
            found[field] = (kind, quantity)
        _DECLARED[fields] = found
    return _DECLARED[fields]


def named(values: Any) -> dict[str, float]:
    """Values of an instance of a declared named-tuple class by public name."""
    return {v.name: value for v, value in zip(variables(type(values)), flat(values), strict=True)}


def conditions_of(kernel: Any) -> tuple[Condition, ...]:
    """Joint conditions that a kernel module declares."""
    return getattr(kernel, "CONDITIONS", ())


def check_conditions(conditions: tuple[Condition, ...], p: Any) -> tuple[str, ...]:
    """Raise `InputError` for the first condition that parameters within their bounds do not meet.

    Returns
    -------
    tuple of str
        The sentences of those with a consequence that they do not meet either: warnings.
    """
    unmet = [condition for condition in conditions if not condition.met(p)]
    for condition in unmet:
        if not condition.consequence:
            raise InputError(condition.sentence(p))
    return tuple(condition.sentence(p) for condition in unmet)


def check_bounds(declared: tuple[Variable, ...], values: Any) -> None:
    """Raise `InputError` for the first value that is not finite or lies outside its declared bounds."""
    for variable, value in zip(declared, flat(values), strict=True):
        quantity = variable.quantity
        above = value > quantity.lo or (value == quantity.lo and not quantity.open_lo)
        below = value < quantity.hi or (value == quantity.hi and not quantity.open_hi)
        if not (math.isfinite(value) and above and below):
            raise InputError(
                f"parameter {variable.name} = {with_unit(repr(value), quantity.unit)} ({quantity.meaning}) -- expected "
                f"{bounds_in_words(quantity)} -- choose a value inside"
            )


def with_unit(number: str, unit: str) -> str:
    """A number as text with its unit, none for 1."""
    return number if unit == "1" else f"{number} {unit}"


def bounds_in_words(quantity: Quantity) -> str:
    """What is expected of a value with these bounds."""
    if quantity.choices:
        return " or ".join(f"{n} ({name})" for n, name in enumerate(quantity.choices, start=int(quantity.lo)))
    if math.isinf(quantity.lo) and math.isinf(quantity.hi):
        return "a finite number"
    left = "(" if quantity.open_lo or math.isinf(quantity.lo) else "["
    right = ")" if quantity.open_hi or math.isinf(quantity.hi) else "]"
    return f"a value in {left}{quantity.lo:g}, {quantity.hi:g}{right}"
