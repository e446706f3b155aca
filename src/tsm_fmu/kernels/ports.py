"""What a model gives to effects, as kernels of its own: its friction to read and to write, what it takes of a motion.

They have no state. With them a model with effects can be simulated piece by piece (staged.py).
"""

from __future__ import annotations

from functools import cache
from types import ModuleType

from .. import models
from . import compiled_cache
from .chain_source import imported
from .kernel import Kernel

READ, WRITE = "friction_read", "friction_write"
_BODIES = {
    READ: "Outputs(port(p, model_Inputs({u}), model_Outputs({o})))",
    WRITE: "port(p, model_Inputs({u}), model_Outputs({o}), u.f) if u.f != u.f0 else model_Outputs({o})",
}
_LOST = "Outputs(port(p, model_Inputs({u}), model_Outputs({o})))"


@cache
def port(base: Kernel, name: str) -> ModuleType:
    """Kernel of a port of a model.

    Its inputs are those of the model, then its outputs, and to write a friction that before and after.

    Parameters
    ----------
    base : Kernel
        A model.
    name : str
        `READ`, `WRITE` or an output for which the model declares ``lost_motion``.
    """
    file = base.module.__name__.rsplit(".", 1)[-1]
    if name in _BODIES:
        assert base.roles.friction is not None
        function = base.roles.friction.read if name == READ else base.roles.friction.write
    else:
        function = base.roles.lost_motion[name]
    body = _BODIES.get(name, _LOST).format(
        u=", ".join(f"u.u_{f}" for f in base.module.Inputs._fields),
        o=", ".join(f"u.o_{f}" for f in base.module.Outputs._fields),
    )
    frictions = ', Part("", Frictions, None, {})' if name == WRITE else ""
    text = "\n".join([
        f'"""{name} of {base.name} as a kernel (written by ports.py)."""', "",
        "from typing import Annotated, NamedTuple", "",
        "from .contract import Quantity",
        "from .joined import Part, joined",
        f"from .{file} import Params, Inputs as model_Inputs, Outputs as model_Outputs",
        imported(function, "port"), "", "",
        "class Frictions(NamedTuple):",
        '    f0: Annotated[float, Quantity("1", "friction before effects")]',
        '    f: Annotated[float, Quantity("1", "friction after them")]', "", "",
        "class Value(NamedTuple):",
        '    value: Annotated[float, Quantity("1", "what the port reads")]', "", "",
        f'NAME = "{base.name}_{name}"',
        'Inputs = joined(__name__, "Inputs", Part("u_", model_Inputs, None, {}), Part("o_", model_Outputs, None, {})'
        f"{frictions})",
        f"Outputs = {'model_Outputs' if name == WRITE else 'Value'}",
        "State = float", "", "",
        "def start(p, u):", f"    return 0.0, {body}", "", "",
        "def step(p, s, u, dt):", f"    return s, {body}", "",
    ])  # fmt: skip
    return compiled_cache.module(models, compiled_cache.named("port", text), text)


def ports(base: Kernel) -> tuple[ModuleType, ...]:
    """All of a model."""
    names = (READ, WRITE) if base.roles.friction else ()
    return tuple(port(base, name) for name in (*names, *base.roles.lost_motion))
