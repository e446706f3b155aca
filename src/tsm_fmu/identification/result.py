"""A fit as a model card, and as the JSON object of ``identify --json``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from ..card import CardParameter, ModelCard, Provenance, RecordUsed, utc_now
from ..kernels.arrays import FloatArray
from ..logs.agreement import Agreement
from ..logs.record import Record
from ..regression.card_errors import correlation
from ..regression.problem import FitRun
from .fit import Fit


def model_card(
    fit: Fit, preset: str, records: Sequence[Record], holdout: Sequence[Record] = (), effects: Sequence[str] = ()
) -> ModelCard:
    """The card of a fit, with the records it was fitted to and judged on."""
    parameters = {}
    for variable in fit.kernel.parameters:
        p = fit.parameters[variable.field]
        unit = variable.quantity.unit
        parameters[variable.name] = CardParameter(p.value, unit, p.stderr, p.min, p.max, not p.vary)
    used = [RecordUsed(r.name, r.sha256) for r in records] + [RecordUsed(r.name, r.sha256, "holdout") for r in holdout]
    return ModelCard(
        model=fit.kernel.name,
        preset=preset,
        effects=tuple(effects),
        parameters=parameters,
        per_run={name: dict(run.values) for name, run in fit.runs.items() if run.values},
        provenance=Provenance(
            tuple(used),
            seed=fit.seed,
            date=utc_now(),
            method=fit.method if fit.complete else f"{fit.method}, interrupted",
        ),
        correlation=correlation(
            fit.kernel,
            fit.uncertainty,
            {f: p.stderr for f, p in fit.parameters.items()},
            {f: p.value for f, p in fit.parameters.items()},
        ),
    )


def run_outputs(fit: Fit, run: FitRun) -> FloatArray:
    """Simulated channels of one run of the fit, shape (n, channels), with the run's own values."""
    values = {v.name: v.kind(fit.parameters[v.field].value) for v in fit.kernel.parameters}
    p = fit.kernel.params(values={**values, **fit.runs[run.name].values})
    outputs = [v.name for v in fit.kernel.outputs]
    return fit.kernel.simulate(p, run.time, run.inputs)[:, [outputs.index(channel) for channel in fit.channels]]


def as_json(fit: Fit) -> dict[str, Any]:
    """The JSON contract of ``identify``; numbers that do not exist are None."""
    parameters = {}
    for variable in fit.kernel.parameters:
        p = fit.parameters[variable.field]
        parameters[variable.name] = {
            "value": p.value,
            "unit": variable.quantity.unit,
            "stderr": p.stderr,
            "interval": [_number(end) for end in fit.intervals.get(variable.field, ())] or None,
            "at_bound": variable.field in fit.at_bound,
            "fixed": not p.vary,
            "per_run": variable.field in fit.per_run,
            "determined": variable.field not in fit.undetermined,
        }
    names = [next(v.name for v in fit.kernel.parameters if v.field == f) for f in fit.uncertainty.names]
    return {
        "model": fit.kernel.name,
        "parameters": parameters,
        "measured": _channels(fit.measured),
        "holdout": _channels(fit.holdout),
        "per_run": {
            name: {
                "role": run.role,
                "parameters": {
                    key: {"value": value, "stderr": _number(run.stderr.get(key))} for key, value in run.values.items()
                },
                "channels": _channels(run.channels),
            }
            for name, run in fit.runs.items()
        },
        "residuals": {channel: asdict(tests) for channel, tests in fit.residuals.items()},
        "noise_floor": dict(fit.noise_floor),
        "correlation": {"names": names, "matrix": fit.uncertainty.correlation.tolist()},
        "condition_number": _number(fit.uncertainty.condition_number),
        "effective_samples": fit.uncertainty.effective_samples,
        "interval_method": fit.interval_method,
        "findings": list(fit.findings),
        "method": fit.method,
        "seed": fit.seed,
        "complete": fit.complete,
        "evaluations": fit.evaluations,
        "wall_s": fit.wall_s,
    }


def _channels(scores: Mapping[str, Agreement]) -> dict[str, Any]:
    return {channel: asdict(score) for channel, score in scores.items()}


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
