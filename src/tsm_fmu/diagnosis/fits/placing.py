"""Where effects could be in a model with what its runs hold: their places, and why others have none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from types import ModuleType

import numpy as np

from ...effects import EFFECTS, id_of
from ...effects.coordinates import Motion
from ...kernels.attached import Attached
from ...kernels.chain import attach
from ...kernels.chain_source import adds_load, friction_unit, load_unit
from ...kernels.drives import ROLES, Drive, read_drives, text_of
from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError
from ..runs.beginning import friction_channels
from ..runs.drivers import drives_of

MOTION_UNITS = ("rad", "m")


def possible(
    model: str, channels: Sequence[str], attached: Sequence[str], drives: Sequence[Drive] = ()
) -> list[Attached]:
    """Every effect at every place of the model where it can be seen in the channels.

    Parameters
    ----------
    model : str
    channels : sequence of str
        Measured ones.
    attached : sequence of str
        Effects that are there already.
    drives : sequence of Drive
        Columns that may drive effects.
    """
    base, found = kernel(model), []
    for module in EFFECTS:
        if module.ABOUT.role != "read" and not _lacks(base, module, drives):
            places = places_of_effect(base, module, channels, drives)
            found += [one for one in places if one.spec not in attached]
    return found


def places_of_effect(
    base: Kernel, module: ModuleType, channels: Sequence[str], drives: Sequence[Drive] = ()
) -> list[Attached]:
    """An effect at each place of a model where a diagnosis looks for it, its friction first; with what may drive it."""
    about = module.ABOUT
    units = {v.name: v.quantity.unit for v in base.outputs}
    specs = [module.NAME] if "friction" in about.looked_for and friction_channels(base) & set(channels) else []
    if "lost motion" in about.looked_for:
        specs += [f"{module.NAME}@{c}" for c in channels if c in base.roles.lost_motion]
    if "output" in about.looked_for:
        taken = friction_channels(base) if specs else set()  # added to the friction it is added to the channel
        moving = [c for c in channels if units[c] in MOTION_UNITS or not about.motion_only]
        specs += [f"{module.NAME}@{c}" for c in moving if c not in taken]
    if module.NAME in play_before_friction(base, channels):
        specs.append(f"{module.NAME}@{base.motion}")
    found = []
    for spec, columns in product(specs, _columns(base, module, drives)):
        if spec == module.NAME and any(d.signal in about.at_outputs for d in read_drives(columns, module)):
            continue
        try:
            one = attach(base, f"{spec}~{columns}" if columns else spec)
        except InputError:
            continue
        if replace(one, drives=()).spec == spec:  # without friction an id stands for the first output
            found.append(one)
    return found


def _columns(base: Kernel, module: ModuleType, drives: Sequence[Drive]) -> list[str]:
    """What may drive an effect, as text: the model's own signals, and each combination of columns for the others."""
    signals, choices = module.Inputs._fields, list[list[Drive | None]]()
    for role, signal in ROLES.items():
        if signal not in signals:
            continue
        matching = [d for d in drives if d.role == role]
        known = {
            "load": bool(base.roles.load) or "load" in (*module.ABOUT.optional, *module.ABOUT.at_outputs),
            "bend": False,
            "temperature": False,
        }
        without_column = known.get(role, base.motion != "v" or not matching)
        choices.append([*([None] if without_column else []), *matching])
    return [text_of([d for d in one if d], module) for one in product(*choices)]


def not_applicable(model: Kernel, channels: Sequence[str]) -> dict[str, str]:
    """Why an effect cannot be asked about at all, by id, of those that can at no place.

    Parameters
    ----------
    model : Kernel
        With the inputs of the runs.
    channels : sequence of str
        Measured ones.
    """
    attached = tuple(getattr(model.module, "EFFECTS", ()))
    base, drives, found = kernel(model.name), drives_of(model), {}
    for module in EFFECTS:
        if module.NAME in map(id_of, attached):
            found[module.NAME] = "it is in the model as given"
        elif missing := _lacks(base, module, drives):
            found[module.NAME] = f"it needs {missing}, which these runs of {base.name} have not"
        elif module.ABOUT.role != "read" and not places_of_effect(base, module, channels, drives):
            acts = "friction" if "friction" in module.ABOUT.looked_for else "a position"
            found[module.NAME] = f"it acts on {acts}, which is in none of {', '.join(channels)}"
    return found


def play_before_friction(model: Kernel, channels: Sequence[str]) -> tuple[str, ...]:
    """Ids of plays that the motion may have before it comes to a friction, which alone is measured.

    Where more of the motion is measured than its friction, play shows there.

    Parameters
    ----------
    model : Kernel
    channels : sequence of str
        Measured ones.
    """
    if not model.motion or not channels or set(channels) - friction_channels(model):
        return ()
    return tuple(m.NAME for m in EFFECTS if m.ABOUT.play and "input" in m.ABOUT.places)


def least_stroke(module: ModuleType) -> float:
    """Stroke [rad] of a drum's angle below which runs cannot say that there is no effect of its turns."""
    return 2.0 * np.pi * module.ABOUT.turns


def _lacks(base: Kernel, module: ModuleType, drives: Sequence[Drive]) -> str:
    """What an effect takes that a model and its runs do not have; empty where they have all."""
    about = module.ABOUT
    signals, given = {*module.Inputs._fields} - {*about.optional, *about.at_outputs}, {d.signal for d in drives}
    if "load" in signals and not base.roles.load and "load" not in given:
        return "a load or a tension"
    if adds_load(module) and not base.roles.drive:
        return "a torque or a tension at the drive's side"
    if adds_load(module) and not given and load_unit(base, ()) != friction_unit(base):
        return f"a load in {friction_unit(base)}, the unit of the friction"
    if "bend" in signals and "bend" not in given:
        return "the sheath's angle"
    if "temperature" in signals and "temperature" not in given:
        return "a temperature"
    if signals & set(Motion._fields) and not base.motion:
        return "a motion"
    return ""
