"""The bending angle of the sheath: an input of no model, but of an effect; a log may hold it."""

from __future__ import annotations

from collections.abc import Sequence

from ...effects import EFFECTS
from ...effects.coordinates import ANGLE
from ...kernels.chain import chain
from ...kernels.kernel import Kernel
from ...logs.record import Record


def with_sheath_angle(model: Kernel, records: Sequence[Record]) -> tuple[Kernel, tuple[str, ...]]:
    """The model with an input for the angle, where every run has it and an effect could use it.

    Parameters
    ----------
    model : Kernel
    records : sequence of Record

    Returns
    -------
    Kernel
    tuple of str
        What a user should know of it.
    """
    without_it = [record.name for record in records if ANGLE not in record.columns]
    if not model.roles.load or len(without_it) == len(records):
        return model, ()
    if without_it:
        untried = ", ".join(module.NAME for module in EFFECTS if "bend" in module.Inputs._fields)
        return model, (f"{ANGLE} is not in {', '.join(without_it)}: {untried} is not tried",)
    return chain(model.name, tuple(getattr(model.module, "EFFECTS", ())), bend=True), ()
