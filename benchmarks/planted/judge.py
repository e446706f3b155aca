"""A case made, diagnosed and judged."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np

from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.effects import about
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

from .catalogue import CHANNELS, KNOWN, Case
from .formulas import FORMULAS
from .motions import Array
from .rigs import RIGS, Signals, record, signals

WRONG = 1.04
"""Factor by which the given parameters of the friction are wrong."""
BESIDE = {"bend_angle": ("Theta",), "temperature_dependence": ("temperature",)}
"""Columns of the log beyond the model's variables, of the effects that they drive."""


@dataclass(frozen=True)
class Judged:
    """What a diagnosis says of a case.

    Attributes
    ----------
    case : Case
    verdict : str
    answer : tuple of str
        Ids that it names or holds in a set.
    right : bool
        It names the effect alone, or a set with it of effects that it is declared to look like, or whose law holds
        the planted one (`Case.also`).
    seconds : float
        CPU time.
    """

    case: Case
    verdict: str
    answer: tuple[str, ...]
    right: bool
    seconds: float


def judged(case: Case) -> Judged:
    """Diagnose a case."""
    began = process_time()
    found = diagnosed(case)
    named = tuple(dict.fromkeys([*found.ids, *(e for ids in found.equivalent for e in ids)]))
    right = case.effect in named and set(named) <= {case.effect, *about(case.effect).looks_like, *case.also}
    return Judged(case, found.verdict, named, right, process_time() - began)


def diagnosed(case: Case) -> Diagnosis:
    """The diagnosis of a case."""
    rig = RIGS[case.model]
    records = planted(case)
    factors = {} if case.known else dict.fromkeys(rig.friction, WRONG)
    values = {name: value * factors.get(name, 1.0) for name, value in rig.values.items()}
    fixed = (*rig.fixed, *(KNOWN[case.model] if case.known else ()))
    return diagnose(kernel(case.model), records[:-1], values=values, fixed=fixed, holdout=records[-1:])


def planted(case: Case) -> list[Record]:
    """Its runs."""
    rng = np.random.default_rng(sum(map(ord, case.name)))
    runs = [
        signals(case.model, kind, case.rows, rng, case.scale, case.pace, case.dip, case.loaded) for kind in case.motions
    ]
    amount = _amount(case, runs[0])
    for s in runs[1:]:
        s.first = runs[0]
    found = []
    for number, s in enumerate(runs):
        _plant(case, s, amount)
        beside = BESIDE.get(case.effect, ())
        found.append(record(case.model, f"run{number}", s, CHANNELS[case.model], rng, beside))
    return found


def _plant(case: Case, s: Signals, amount: float) -> None:
    formula = FORMULAS[case.effect]
    if case.channel == "x_out" and case.effect != "quantisation":
        s.x_out = formula(s.x_out, s, amount)
    elif case.channel in ("x_out", "tau_in", "tau_out", "F"):
        s.sensor[case.channel] = lambda y: formula(y, s, amount)  # behind the noise
    else:
        s.friction = formula(s.friction, s, amount)


def _acted_on(case: Case, s: Signals) -> Array:
    if case.channel == "x_out":
        return s.x_out
    return s.load if case.channel in ("tau_in", "tau_out") else s.friction


def _amount(case: Case, s: Signals) -> float:
    """Amount at which the effect changes its signal by the wanted share, by bisection."""
    y = _acted_on(case, s)
    wanted = case.share * float(np.sqrt(np.mean(y**2)))

    def change(amount: float) -> float:
        return float(np.sqrt(np.mean((FORMULAS[case.effect](y, s, amount) - y) ** 2)))

    low, high = 1e-9, 1e-6
    while change(high) < wanted and high < 1e3:
        low, high = high, 2.0 * high
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if change(middle) < wanted else (low, middle)
    return float(high)
