"""A case: logs as a user would have them, and what ``tsm-fmu diagnose`` answers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tsm_fmu.card import CardParameter, ModelCard, write_card
from tsm_fmu.cosim.system import Value
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import write_record

from ..blind.judge import in_process

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """One diagnosis.

    Attributes
    ----------
    paper, hidden, model : str
        Paper, what the rig has and the user's model has not, the user's model or card.
    expected : str
        Effect that the answer must hold, or the verdict where no effect is missing.
    measured, holdout : sequence of Path
    """

    paper: str
    hidden: str
    model: str
    expected: str
    measured: Sequence[Path]
    holdout: Sequence[Path]


@dataclass(frozen=True)
class Answer:
    """``diagnosis.json`` of a case."""

    case: Case
    data: Mapping[str, Any]

    @property
    def verdict(self) -> str:
        return str(self.data["verdict"])

    @property
    def effects(self) -> list[str]:
        return list(self.data["effects"])

    @property
    def met(self) -> bool:
        """Whether the answer is the expected one."""
        return self.case.expected in (self.effects or [self.verdict])

    @property
    def gap(self) -> tuple[float, float]:
        """Held-out gap over that of the model as given: after a refit alone, and with the answer."""
        (g,) = self.data["gap"].values()
        return g["holdout_refitted"] / g["holdout_before"], g["holdout_after"] / g["holdout_before"]


def logged(path: Path, time: FloatArray, columns: Mapping[str, tuple[FloatArray, str, float]], seed: int) -> Path:
    """Write a log; each column is its values, unit, and the RMS of the instrument's white noise."""
    rng = np.random.default_rng(seed)
    noisy = {n: values + noise * rng.normal(size=time.size) for n, (values, _, noise) in columns.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_record(path, time, noisy, {n: unit for n, (_, unit, _) in columns.items()})


def carded(path: Path, model: str, values: Mapping[str, Value], fixed: Sequence[str] = ()) -> Path:
    """Write the user's model as a card; no refit changes the fixed parameters."""
    units = {v.name: v.quantity.unit for v in kernel(model).parameters}
    parameters = {n: CardParameter(float(value), units[n], fixed=n in fixed) for n, value in values.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_card(path, ModelCard(model, "published", parameters=parameters))
    return path


def answered(case: Case, out: Path) -> Answer:
    """Run the command line; everything it writes stays in ``out``."""
    words = ["diagnose", case.model, "--out", str(out)]
    words += [w for path in case.measured for w in ("--measured", str(path))]
    words += [w for path in case.holdout for w in ("--holdout", str(path))]
    code = in_process(words)
    if code != 0:
        raise RuntimeError(f"tsm-fmu {' '.join(words)} -- exit code {code}")
    return Answer(case, json.loads((out / "diagnosis.json").read_text(encoding="utf-8")))
