"""Inputs that the outputs of a model with effects follow at once, from those of the model and the effects' places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ..effects.coordinates import Motion
from .attached import Attached
from .kernel import Kernel

MOTION = frozenset(Motion._fields)


def dependencies(base: Kernel, attached: Sequence[Attached]) -> dict[str, tuple[str, ...]]:
    """By output, in the order of the inputs and the columns that drive effects.

    An effect is taken to pass on at once all that it reads, also where it passes on a state: a loop that needs no
    iteration may be told to need one, never the other way round.
    """
    roles = base.roles
    inputs = [v.name for v in base.inputs]
    follows = {v.name: set(roles.depends.get(v.name, inputs)) for v in base.outputs}
    made = {name: {name} for name in inputs}

    def read(a: Attached) -> set[str]:
        """What an effect reads beside the signal that it changes."""
        fields, driven = set(a.takes), {d.signal: {d.column} for d in a.drives}
        found: set[str] = set().union(*driven.values())
        if fields & MOTION - driven.keys():
            found |= {roles.motion} if roles.motion else {"v", "a"} & made.keys()
        for field, name in (("load", roles.load), ("drive", roles.drive)):
            if field in fields - driven.keys() and name:
                found |= follows.get(name, {name})
        return found

    for a in attached:
        if a.channel in made:
            made[a.channel] |= read(a)
    for name, known in follows.items():
        follows[name] = _together(made[i] for i in known)
    on_friction = [a for a in attached if not a.channel]
    if roles.friction and on_friction:
        friction = _together(map(read, on_friction))  # what the friction was before is in what shows it
        ports = [roles.friction.write, *([roles.held_load.write] if roles.held_load else [])]
        for name in _together(_written(base, port) for port in ports):
            follows[name] |= friction
    for a in attached:
        if a.channel in follows:
            lag = {roles.motion} if a.on_lost_motion else set()
            follows[a.channel] |= read(a) | lag
    columns = [d.column for a in attached for d in a.drives if d.column not in made]
    order = [*inputs, *dict.fromkeys(columns)]
    return {name: tuple(i for i in order if i in known) for name, known in follows.items()}


def _together(sets: Iterable[set[str]]) -> set[str]:
    return set().union(*sets)


def _written(base: Kernel, write: Callable[..., Any]) -> set[str]:
    """Outputs that a port changes, seen by what it does."""
    inputs, outputs = (
        fields(*(1.3 + 0.7 * k for k in range(len(fields._fields))))
        for fields in (base.module.Inputs, base.module.Outputs)
    )
    made = [write(base.params(), inputs, outputs, value) for value in (-2.1, 0.4, 3.7)]
    return {v.name for k, v in enumerate(base.outputs) if any(one[k] != outputs[k] for one in made)}
