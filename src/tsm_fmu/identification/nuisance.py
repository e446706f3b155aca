"""Delay and offset of a measurement, fitted beside the model on request: nuisance parameters.

A channel that comes late, or whose zero is off, would otherwise bend the model's own parameters. Both are
effects of a chain, so that card, FMU and diagnosis know them like any other effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType

from ..effects import EFFECTS, sizes_as, sizes_of
from ..kernels.attached import Attached
from ..kernels.chain import attach, chain
from ..kernels.kernel import Kernel, kernel
from ..models.contract import InputError
from ..regression.problem import FitRun
from ..regression.search_space import SearchSpace


@dataclass(frozen=True)
class Nuisance:
    """A model with its nuisance effects.

    Attributes
    ----------
    kernel : Kernel
        The chain.
    effects : tuple of str
        All its effects, in order, for the card.
    delays : mapping of str to int
        Fields of the delays, with the steps of a log that each may be at most.
    fixed, per_run : tuple of str
        Public names of parameters that stay at zero, and of those with a value for each run (the offsets).
    """

    kernel: Kernel
    effects: tuple[str, ...]
    delays: Mapping[str, int] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    per_run: tuple[str, ...] = ()


def with_nuisance(model: Kernel, effects: Sequence[str], specs: Sequence[str]) -> Nuisance:
    """Attach nuisance parameters behind the effects that a model has.

    Parameters
    ----------
    model : Kernel
        The model with ``effects``.
    effects : sequence of str
        As in `chain.chain`; one that is there already is not attached twice.
    specs : sequence of str
        Each ``delay@CHANNEL`` or ``offset@CHANNEL``.

    Raises
    ------
    InputError
        Unknown kind, no channel, or a channel that the model does not have.
    """
    if not specs:
        return Nuisance(model, tuple(effects))
    base = kernel(model.name)
    in_chain = [attach(base, text).spec for text in effects]
    delays, fixed, per_run = {}, [], []
    known = kinds()
    for text in dict.fromkeys(specs):
        kind, at, channel = text.partition("@")
        if kind not in known or not at or not channel:
            expected = " or ".join(f"{word}@CHANNEL" for word in known)
            raise InputError(
                f"--nuisance {text} -- expected {expected} -- for example {next(iter(known))}@{base.outputs[0].name}"
            )
        attached = attach(base, f"{known[kind].NAME}@{channel}")
        if attached.spec not in in_chain:
            in_chain.append(attached.spec)
            effects = (*effects, attached.spec)
            fixed += [_name(attached, name) for name in sizes_as(attached.module, "zero")]
        per_run += [_name(attached, name) for name in sizes_as(attached.module, "per run")]
        limited = {n: size.most_steps for n, size in sizes_of(attached.module).items() if size.most_steps}
        delays |= {attached.prefix + name: steps for name, steps in limited.items()}
    return Nuisance(chain(base.name, tuple(effects)), tuple(effects), delays, tuple(fixed), tuple(per_run))


def kinds() -> dict[str, ModuleType]:
    """What users ask for, and the effect that models it."""
    found = {module.ABOUT.fitted_as: module for module in EFFECTS if module.ABOUT.fitted_as}
    return dict(sorted(found.items()))


def with_limited_delays(space: SearchSpace, delays: Mapping[str, int], runs: Sequence[FitRun]) -> SearchSpace:
    """Bound each delay by what the effect can keep at the shortest step of the runs: the fit says when it is met."""
    step = min(float((run.time[1:] - run.time[:-1]).min()) for run in runs)
    for name, steps in delays.items():
        p, longest = space[name], steps * step
        if p.start > longest:
            raise InputError(
                f"start value of {name.replace('__', '.')} = {p.start:g} s -- expected at most {longest:g} s, "
                f"{steps} steps of these runs -- lower it"
            )
        space = space.with_bounds(name, hi=min(p.hi, longest))
    return space


def _name(attached: Attached, parameter: str) -> str:
    return f"{attached.prefix}{parameter}".replace("__", ".")
