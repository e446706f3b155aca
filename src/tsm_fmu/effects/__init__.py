"""The effects, one file each, and look-ups of what their files say.

`EFFECTS` is the registry: chains, diagnosis, command line and tests iterate over it, and nothing outside this folder
names an effect. One is given as ``id``, or as ``id@channel`` with its place, either with ``~column[unit]`` behind it
where a column of the log drives it: a *spec*.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import get_type_hints

from ..models import MODELS
from .about import AsNuisance, Effect, Family, Read, Shape, Size, Start

EFFECTS: tuple[ModuleType, ...] = tuple(
    import_module(f"{__name__}.{name}")
    for name in (
        "coulomb",
        "viscous",
        "stribeck",
        "acceleration_branches",
        "inertia",
        "friction_lag",
        "presliding_shape",
        "nonlocal_memory",
        "breakaway_ageing",
        "load_dependence",
        "bend_angle",
        "temperature_dependence",
        "drive_direction",
        "direction_asymmetry",
        "offset_drift",
        "gain_error",
        "backlash",
        "smooth_backlash",
        "tendon_elasticity",
        "stiffness_hardening",
        "slack",
        "creep",
        "thermal",
        "wear",
        "drum_periodic",
        "winding_crossover",
        "delay",
        "sensor_lag",
        "quantisation",
    )
)


MOTIONS = frozenset(module.ROLES.motion or "v" for module in MODELS if hasattr(module, "ROLES"))
"""Inputs that move the models."""


def id_of(spec: str) -> str:
    """Id of an effect given by its spec."""
    return place_of(spec)[0]


def place_of(spec: str) -> tuple[str, str]:
    """Id and channel of a spec, the channel empty on friction."""
    name, _, channel = spec.partition("~")[0].partition("@")
    return name, channel


def prefix_of(spec: str) -> str:
    """What stands before the public names of an effect's parameters in a chain."""
    name, channel = place_of(spec)
    return f"{channel}.{name}." if channel else f"{name}."


def effect_of(spec: str) -> ModuleType:
    """File of an effect."""
    return next(module for module in EFFECTS if module.NAME == id_of(spec))


def about(spec: str) -> Effect:
    """What the file of an effect says of it."""
    return effect_of(spec).ABOUT


def words(spec: str) -> str:
    """Name of an effect in a sentence, with its channel and what drives it where the spec says so."""
    channel, columns, known = place_of(spec)[1], spec.partition("~")[2], about(spec)
    place = f" in {channel}" if channel else ""
    if known.play and channel in MOTIONS:
        place = " before the friction"
    driven = " and ".join(item.partition("[")[0].rpartition("=")[2] for item in columns.split(",") if item)
    name = (known.words_on_motion if channel else "") or known.words
    return name + place + (f", driven by {driven}" if driven else "")


FAMILIES: dict[Family, str] = {
    "position": "a law of the position",
    "speed": "a law of the speed",
    "acceleration": "a law of the acceleration",
    "load": "a law of the load",
    "time": "a law of time or travel",
    "history": "a law of the motion before",
    "direction": "a law of the direction of motion",
    "sensor": "a law of the measured signal itself",
}
"""Families in a sentence."""


def looks_like(spec: str, others: Iterable[str]) -> bool:
    """Whether an effect hides behind one of others, by what the file of either says."""
    return any(id_of(other) in about(spec).looks_like or id_of(spec) in about(other).looks_like for other in others)


@cache
def roles_of(module: ModuleType) -> dict[str, Size | Shape | Read | Start]:
    """Role of each parameter of an effect, by public name."""
    hints = get_type_hints(module.Params, include_extras=True)
    roles = {field.rstrip("_"): role for field, hint in hints.items() for role in hint.__metadata__[1:]}
    known = Size | Shape | Read | Start
    missing = [field for field in module.Params._fields if not isinstance(roles.get(field.rstrip("_")), known)]
    if missing:
        raise TypeError(f"{module.__name__}.Params: {', '.join(missing)} without a Size, Shape, Read or Start")
    return roles


def sizes_of(module: ModuleType) -> dict[str, Size]:
    """Parameters that alone take an effect out of neutral."""
    return {name: role for name, role in roles_of(module).items() if isinstance(role, Size)}


def sizes_as(module: ModuleType, use: AsNuisance) -> list[str]:
    """Sizes that do that where the effect is a nuisance."""
    return [name for name, size in sizes_of(module).items() if size.as_nuisance == use]


def starts_of(module: ModuleType) -> dict[str, Start]:
    """States at the start that each run has of its own."""
    return {name: role for name, role in roles_of(module).items() if isinstance(role, Start)}


def shapes_of(module: ModuleType) -> dict[str, Shape]:
    """Parameters that do nothing without a size."""
    return {name: role for name, role in roles_of(module).items() if isinstance(role, Shape)}
