"""Named-tuple classes put together from others, for a model with effects."""

from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

from .unit_text import simplified


class Part(NamedTuple):
    """Fields of one class inside a joined one.

    Attributes
    ----------
    prefix : str
        Put before each field name.
    fields : type
        A named-tuple class with declared fields.
    defaults : tuple or None
        Instance of ``fields`` whose values become the defaults; None for a class without defaults.
    units : dict of str to str
        What ``{F}``, ``{load}``, ``{x}`` and ``{y}`` in a declared unit stand for: an effect does not know whether
        it acts on a force or a torque.
    left_out : tuple of str
        Fields that another part has already.
    """

    prefix: str
    fields: Any
    defaults: Any
    units: dict[str, str]
    left_out: tuple[str, ...] = ()


def joined(module: str, name: str, *parts: Part) -> Any:
    """Named-tuple class of a module, with the fields of all parts in order."""
    hints: dict[str, Any] = {}
    defaults: dict[str, Any] = {}
    for part in parts:
        declared = get_type_hints(part.fields, include_extras=True)
        for position, field in enumerate(part.fields._fields):
            if field in part.left_out:
                continue
            kind, quantity = get_args(declared[field])[:2]
            unit = quantity.unit
            for placeholder, meant in part.units.items():
                unit = unit.replace("{" + placeholder + "}", meant)
            hints[part.prefix + field] = Annotated[kind, quantity._replace(unit=simplified(unit))]
            if part.defaults is not None:
                defaults[part.prefix + field] = part.defaults[position]
    made: Any = NamedTuple(name, list(hints.items()))
    made.__new__.__defaults__ = tuple(defaults.values()) or None
    made._field_defaults = defaults
    made.__module__ = module
    return made
