"""The answer's model as an FMU, and the check that it is the model of the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...card import ModelCard
from ...cosim.replay import replay
from ...fmu.build import build_fmu
from ..result import Diagnosis

REPLAYED = 60_000
"""Samples replayed through the FMU at most; whole runs, one at least."""


def export_answer(folder: Path, found: Diagnosis) -> tuple[Path, dict[str, float]]:
    """Build the FMU of a diagnosis' model and drive it with the first measured runs.

    Parameters
    ----------
    folder : Path
    found : Diagnosis
        With a model.

    Returns
    -------
    Path
        The FMU.
    dict of str to float
        Its RMS error by channel, each run with its own parameters.

    Raises
    ------
    RuntimeError
        The FMU does not give what the diagnosis has simulated.
    """
    card = found.model
    if card is None:
        raise ValueError(f"a diagnosis with verdict {found.verdict} has no model")
    kernel = card.kernel()
    fmu = build_fmu(kernel, folder / f"{kernel.name}.fmu", start_values=_parameters(card, {}))
    replayed, expected, rows = [], [], 0
    for run in found.runs:
        if rows and rows + run.record.time.size > REPLAYED:
            break
        rows += run.record.time.size
        columns = replay(fmu, run.record, parameters=_parameters(card, run.per_run)).columns
        simulated = np.column_stack([columns[channel] for channel in found.channels])
        replayed.append(run.error(simulated[-run.time.size :]))
        expected.append(run.error(run.simulated["final"]))
    there, here = (np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0)) for errors in (replayed, expected))
    if not np.allclose(there, here, rtol=1e-6, atol=1e-12):
        raise RuntimeError(f"the FMU's gap {there} is not the diagnosis' {here}")
    return fmu, dict(zip(found.channels, there.tolist(), strict=True))


def _parameters(card: ModelCard, per_run: Mapping[str, float]) -> dict[str, float]:
    values = {name: p.value for name, p in card.parameters.items()} | dict(per_run)
    kernel = card.kernel()
    return kernel.named(kernel.params(card.preset or None, values))
