"""What a fit is asked: its search space, which parameters have one value a run, which channels count."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ..card import ModelCard
from ..kernels.kernel import Kernel
from ..logs.record import Record, kernel_inputs
from ..logs.samples import check_fitted
from ..models.contract import InputError, flat, with_unit
from .problem import FitRun
from .search_space import SearchParameter, SearchSpace


def search_space(
    model: Kernel,
    preset: str | None = None,
    values: Mapping[str, float] | None = None,
    fixed: Collection[str] = (),
    card: ModelCard | None = None,
    per_run: Collection[str] = (),
) -> SearchSpace:
    """Start, bounds and freedom of each parameter of a model, by the field names of the kernel's ``Params``, in SI.

    Integer parameters (switches, counts) are not free. Bounds are those of the model, or of the card where it has
    narrower ones.

    Parameters
    ----------
    model : Kernel
    preset : str, optional
        Parameter set to start from.
    values : mapping of str to float, optional
        Start values by public name.
    fixed : collection of str
        Public names of parameters that stay at their value.
    card : ModelCard, optional
        Start values, bounds and fixed flags of an earlier fit.
    per_run : collection of str
        Fields with one value for each run, from `per_run_fields`.

    Raises
    ------
    InputError
        Unknown name, a start value out of bounds or against a joint condition, or nothing left to fit.
    """
    earlier_fit = dict(card.parameters) if card else {}
    start = model.params(preset, {**{name: p.value for name, p in earlier_fit.items()}, **(values or {})})
    known = [v.name for v in model.parameters]
    for name in fixed:
        if name not in known:
            raise InputError(
                f"--fix {name} of {model.name} -- expected one of {', '.join(known)} -- see 'tsm-fmu list'"
            )
    found: dict[str, SearchParameter] = {}
    for variable, value in zip(model.parameters, flat(start), strict=True):
        name, quantity, earlier = variable.name, variable.quantity, earlier_fit.get(variable.name)
        lo = max(quantity.lo, earlier.lo if earlier else -math.inf)
        hi = min(quantity.hi, earlier.hi if earlier else math.inf)
        if not lo <= value <= hi:
            raise InputError(
                f"start value {name} = {with_unit(repr(value), quantity.unit)} -- expected a value in the bounds "
                f"[{lo:g}, {hi:g}] of the card -- change one of them"
            )
        free = variable.kind is float and name not in fixed and not (earlier and earlier.fixed) and lo < hi
        found[variable.field] = SearchParameter(float(value), lo, hi, free, variable.field in per_run)
    if not any(p.free for p in found.values()):
        raise InputError(f"no parameter of {model.name} is left to fit -- expected at least one -- drop a --fix")
    return SearchSpace(found)


def per_run_fields(model: Kernel, shared: Collection[str] = (), offsets: Collection[str] = ()) -> tuple[str, ...]:
    """Fields that have one value a run: offsets and initial states, as the model's `Roles` declare them.

    Parameters
    ----------
    model : Kernel
    shared : collection of str
        Public names that are to have one value for all runs all the same.
    offsets : collection of str
        Further public names with one value a run, from `nuisance.with_nuisance`.
    """
    declared = (*model.roles.offsets, *model.roles.initial, *offsets)
    for name in shared:
        if name not in declared:
            raise InputError(
                f"--shared {name} of {model.name} -- expected one of {', '.join(declared) or '(none)'}: only these "
                "have a value for each run -- drop it"
            )
    return tuple(v.field for v in model.parameters if v.name in declared and v.name not in shared)


def measured_channels(model: Kernel, records: Sequence[Record]) -> tuple[str, ...]:
    """Outputs of the model that every record has.

    Raises
    ------
    InputError
        If there is none, with what the records have.
    """
    common = set.intersection(*(set(record.columns) for record in records))
    outputs = [v.name for v in model.outputs]
    found = tuple(name for name in outputs if name in common)
    if not found:
        without = [record for record in records if not set(outputs) & set(record.columns)]
        what = (
            f"run {without[0].name} has {', '.join(without[0].columns) or 'only time'} and no output of {model.name}"
            if without
            else f"no output of {model.name} is in every run ("
            + "; ".join(f"{r.name} has {', '.join(n for n in outputs if n in r.columns)}" for r in records)
            + ")"
        )
        raise InputError(f"{what} -- expected one of {', '.join(outputs)} -- rename one with --map LOG=NAME")
    return found


def not_in_every_run(model: Kernel, records: Sequence[Record]) -> tuple[str, ...]:
    """Say which outputs of the model are not compared because some of the runs do not have them."""
    found = []
    for name in (v.name for v in model.outputs):
        without = [record.name for record in records if name not in record.columns]
        if 0 < len(without) < len(records):
            runs = without[0] if len(without) == 1 else f"{len(without)} of {len(records)} runs ({without[0]})"
            found.append(f"{name} is not compared in any run: it is not in {runs}")
    return tuple(found)


def fit_run(model: Kernel, record: Record, channels: Sequence[str], cutoff: float | None = None) -> FitRun:
    """The inputs and the measured channels of a record."""
    units = {v.name: v.quantity.unit for v in model.outputs}
    measured = {name: record.require(name, units[name]) for name in channels}
    check_fitted(str(record.source or record.name), measured)
    targets = np.column_stack(list(measured.values()))
    found = kernel_inputs(record, model, cutoff)
    time, inputs, targets = (np.ascontiguousarray(a) for a in (record.time, found.values, targets))
    return FitRun(record.name, time, inputs, targets, derived=found.notes)
