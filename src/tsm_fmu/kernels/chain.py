"""A model with effects as one kernel: one pure step, compiled, plain or inside an FMU.

The chain is written out as the source of a kernel module, because that is what every user of a kernel
takes: numba clones its functions, the FMU build copies its text. In the order of one step::

    effects on the input motion -> the model -> effects on its friction -> effects on its outputs

What a model and an effect declare for this is in models/contract.py. Where the load of a model is itself an output, the
friction that depends on it is solved for by Aitken's method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from .. import models
from ..effects import EFFECTS, place_of
from ..effects.coordinates import Motion
from ..models.contract import InputError
from . import compiled_cache
from .arrays import FloatArray
from .attached import Attached
from .chain_source import Writer, adds_load, friction_unit, load_unit
from .drives import Drive, read_drives
from .kernel import Kernel, is_kept, kernel
from .staged import Staged

WORTH_COMPILING = 20_000_000
"""Rows that a chain simulates in stages before it is compiled: they cost about as much more than its own compiled form
as the compiler does. Where that is kept from before, it is used at once."""


@dataclass(frozen=True)
class Chain(Kernel):
    """A model with effects.

    Attributes
    ----------
    staged : Staged or None
        The same piece by piece; None where something that an effect changes always comes back to what was before it.
    """

    staged: Staged | None = field(compare=False)

    def in_stages(self, table: FloatArray) -> Staged | None:
        """Its pieces, where they can simulate a table and to compile the whole would take longer than it saves."""
        if self.staged is None or not self.staged.can_simulate(table) or is_kept(self.module):
            return None
        return self.staged if self.staged.rows < WORTH_COMPILING else None

    def compiled(self, table: FloatArray) -> Callable[..., None]:
        staged = self.in_stages(table)
        return staged.run if staged else super().compiled(table)


@cache
def chain(model: str, effects: tuple[str, ...], drives: tuple[Drive, ...] = ()) -> Kernel:
    """Kernel of ``model`` with ``effects`` in the order given; with its defaults it equals the model bit for bit.

    Parameters
    ----------
    model : str
        FMU name of the model.
    effects : tuple of str
        Each ``id``, ``id@channel`` or either with ``~column[unit]`` (drives.py); without a channel the effect goes to
        its first place: the friction, or the model's first output or input.
    drives : tuple of Drive
        Columns that are inputs also where no effect uses them, so that the same runs fit with and without.

    Raises
    ------
    InputError
        Unknown effect or channel, an effect where it makes no sense, or one given twice.
    """
    base = kernel(model)
    if not effects and not drives:
        return base
    attached = [attach(base, text) for text in effects]
    if len({a.prefix for a in attached}) < len(attached):
        raise InputError(f"effects {', '.join(effects)} of {model} -- expected each effect once a place -- drop one")
    writer = Writer(base, attached, drives)
    source = writer.text()
    module = compiled_cache.module(models, compiled_cache.named("chain", source), source)
    module.__dict__["SOURCE_TEXT"] = source
    return Chain(module, None if writer.feeds_back else Staged(writer, Kernel(module)))


@dataclass(frozen=True)
class ModelPart:
    """The model's own parameters, and columns of its inputs and outputs, as its named tuples."""

    parameters: Any
    inputs: Any
    outputs: Any


def model_part(chained: Kernel, p: Any, inputs: FloatArray, outputs: FloatArray) -> ModelPart:
    """Cut the model's own part out of a chain's parameters and of the columns of its inputs and outputs.

    Parameters
    ----------
    chained : Kernel
        From `chain`.
    p : Params
        Of the chain.
    inputs, outputs : ndarray, shape (n, number of the chain's inputs or outputs)
    """
    module = kernel(chained.name).module
    first = (module.Params, p), (module.Inputs, inputs.T), (module.Outputs, outputs.T)
    return ModelPart(*(own(*values[: len(own._fields)]) for own, values in first))


def attach(base: Kernel, text: str) -> Attached:
    """Read ``id``, ``id@channel``, with ``~column[unit]`` behind it, and check that the effect can be there."""
    (name, channel), drives = place_of(text), text.partition("~")[2]
    found = {module.NAME: module for module in EFFECTS}
    if name not in found:
        raise InputError(f"effect {name!r} -- expected one of {', '.join(found)} -- see 'tsm-fmu list'")
    module = found[name]
    driven = read_drives(drives, module)
    for drive in driven:
        if drive.column in [v.name for v in (*base.outputs, *base.parameters)]:
            raise InputError(f"effect {text!r} on {base.name} -- {drive.column} is its own -- name another column")
    needed = "load" in module.Inputs._fields and "load" not in (*module.ABOUT.optional, *module.ABOUT.at_outputs)
    if needed and not base.roles.load and not any(d.signal == "load" for d in driven):
        raise InputError(
            f"effect {name!r} on {base.name} -- it needs a load, which {base.name} has not -- name the "
            f"column of the log that is one: {name}~T_in[N]"
        )
    unit, force = load_unit(base, driven), friction_unit(base)
    if adds_load(module) and unit != force:
        raise InputError(
            f"effect {name!r} on {base.name} -- it adds the load to the friction, and {unit} is not {force} -- name a "
            f"column of the log that is a load in {force}: {name}~COLUMN[{force}]"
        )
    if not base.motion and set(Motion._fields) & set(module.Inputs._fields):
        raise InputError(
            f"effect {name!r} on {base.name} -- it needs a motion, which {base.name} has not -- use TendonDrive"
        )
    inputs = [v.name for v in base.inputs]
    outputs = [v.name for v in base.outputs]
    allowed = [""] if "friction" in module.ABOUT.places and base.roles.friction else []
    allowed += list(base.roles.lost_motion) if "lost motion" in module.ABOUT.places else []
    allowed += outputs if "output" in module.ABOUT.places else []
    allowed += inputs if "input" in module.ABOUT.places else []
    if not channel and allowed:
        return Attached(module, allowed[0], driven)
    if channel not in allowed:
        if not allowed:
            raise InputError(f"effect {text!r} on {base.name} -- it has no place there -- choose another")
        places = ", ".join(a or "the friction" for a in allowed)
        raise InputError(f"effect {text!r} on {base.name} -- it can act on {places} -- choose one of these")
    return Attached(module, channel, driven)
