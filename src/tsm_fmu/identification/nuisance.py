"""Delay and offset of a measurement, fitted beside the model on request: nuisance parameters.

A channel that comes late, or whose zero is off, would otherwise bend the model's own parameters. Both are
effects of a chain, so that card, FMU and diagnosis know them like any other effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lmfit import Parameters

from ..effects.delay import KEPT
from ..kernels.chain import attach, chain
from ..kernels.chain_source import Attached
from ..kernels.kernel import Kernel, kernel
from ..models.contract import InputError
from ..regression.problem import FitRun

EFFECT = {"delay": "delay", "offset": "offset_drift"}
"""What users ask for, and the effect that models it; of ``offset_drift`` the drift stays zero."""


@dataclass(frozen=True)
class Nuisance:
    """A model with its nuisance effects.

    Attributes
    ----------
    kernel : Kernel
        The chain.
    effects : tuple of str
        All its effects, in order, for the card.
    delays : tuple of str
        Fields of the delays.
    fixed, per_run : tuple of str
        Public names of parameters that stay at zero, and of those with a value for each run (the offsets).
    """

    kernel: Kernel
    effects: tuple[str, ...]
    delays: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    per_run: tuple[str, ...] = ()


def with_nuisance(model: Kernel, effects: Sequence[str], wanted: Sequence[str]) -> Nuisance:
    """Attach nuisance parameters behind the effects that a model has.

    Parameters
    ----------
    model : Kernel
        The model with ``effects``.
    effects : sequence of str
        As in `chain.chain`; one that is there already is not attached twice.
    wanted : sequence of str
        Each ``delay@CHANNEL`` or ``offset@CHANNEL``.

    Raises
    ------
    InputError
        Unknown kind, no channel, or a channel that the model does not have.
    """
    if not wanted:
        return Nuisance(model, tuple(effects))
    base = kernel(model.name)
    specs = [attach(base, text).spec for text in effects]
    delays, fixed, per_run = [], [], []
    for text in dict.fromkeys(wanted):
        kind, at, channel = text.partition("@")
        if kind not in EFFECT or not at or not channel:
            raise InputError(
                f"--nuisance {text} -- expected delay@CHANNEL or offset@CHANNEL -- for example "
                f"delay@{base.outputs[0].name}"
            )
        attached = attach(base, f"{EFFECT[kind]}@{channel}")
        if attached.spec not in specs:
            specs.append(attached.spec)
            effects = (*effects, attached.spec)
            fixed += [_name(attached, "c")] if kind == "offset" else []
        if kind == "offset":
            per_run.append(_name(attached, "b"))
        else:
            delays.append(f"{attached.prefix}T_d")
    return Nuisance(chain(base.name, tuple(effects)), tuple(effects), tuple(delays), tuple(fixed), tuple(per_run))


def limit_delays(parameters: Parameters, delays: Sequence[str], runs: Sequence[FitRun]) -> None:
    """Bound each delay by what the effect can keep at the shortest step of the runs: the fit says when it is met."""
    longest = (KEPT - 1) * min(float((run.time[1:] - run.time[:-1]).min()) for run in runs)
    for field in delays:
        p = parameters[field]
        if p.value > longest:
            raise InputError(
                f"start value of {field.replace('__', '.')} = {p.value:g} s -- expected at most {longest:g} s, "
                f"{KEPT - 1} steps of these runs -- lower it"
            )
        p.max = min(p.max, longest)


def _name(attached: Attached, parameter: str) -> str:
    return f"{attached.prefix}{parameter}".replace("__", ".")
