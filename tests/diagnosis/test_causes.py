"""A thermometer that the drive's own work warms, and one that a room does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.conftest import DT, Rig
from tsm_fmu.diagnosis.answer.causes import made_by_the_drive
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.runs.drivers import drives_of, with_drives
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

Warmth = Callable[[np.ndarray, np.random.Generator], np.ndarray]
ROWS = 3000


def work(v: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The mean power against friction of two bodies, one of which warms the other: no first-order state."""
    body, case = np.zeros(v.size), np.zeros(v.size)
    body[0] = case[0] = 0.3 * rng.random()
    for k in range(1, v.size):
        body[k] = body[k - 1] + DT / 2.3 * (abs(v[k]) - body[k - 1])
        case[k] = case[k - 1] + DT / 0.7 * (body[k] - case[k - 1])
    return 295.0 + 6.0 * case


def heating(v: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """On and off, whatever the drive does."""
    return 295.0 + 3.0 * np.sin(2 * np.pi * np.arange(v.size) * DT / 11.3 + 6.0 * rng.random())


def warming(v: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A room that warms steadily: so does any state that is not at rest at the start."""
    return 295.0 + 0.2 * rng.random() * np.arange(v.size) * DT


def logged(seed: int, warmth: Warmth, beta: float = 0.0) -> Record:
    """Strokes with rests of seconds; Dahl friction that thins with warmth, which the thermometer reads to 0.1 K."""
    rng, t = np.random.default_rng(seed), np.arange(float(ROWS)) * DT
    moving = np.repeat(rng.random(ROWS // 250) < 0.6, 250)
    v = moving * (1.1 * np.sin(2 * np.pi * 0.61 * t) + 0.4 * np.sin(2 * np.pi * 1.31 * t + 6.0 * rng.random()))
    temperature, z = warmth(np.asarray(v, float), rng), np.zeros(ROWS)
    for j in range(1, ROWS):
        s = np.sign(v[j])
        z[j] = s + (z[j - 1] - s) * np.exp(-abs(v[j]) * DT / 0.006)
    force = 0.7 * np.exp(-beta * (temperature - 295.0)) * z + 0.11 * v + 0.006 * rng.normal(size=ROWS)
    read = np.round(temperature + 0.02 * rng.normal(size=ROWS), 1)
    units = {"v": "m/s", "F": "N", "temperature": "K"}
    return Record(f"run {seed}", t, {"v": v, "F": force, "temperature": read}, units)


def fitted(rig: Rig, known: dict[str, float], warmth: Warmth) -> Fitted:
    logs = [logged(seed, warmth) for seed in (41, 42)]
    model, _ = with_drives(kernel("LuGreFriction"), logs, ("F",))
    runs = [
        replace(
            rig(1, rows=ROWS), name=log.name, inputs=np.column_stack([log.columns[v.name] for v in model.inputs]),
            targets=log.columns["F"][:, None],
        )
        for log in logs
    ]  # fmt: skip
    return refit(Task("LuGreFriction", runs, ("F",), known, drives=drives_of(model)), (), {})


@pytest.mark.parametrize(("warmth", "cause"), [(work, "thermal"), (heating, None), (warming, None)])
def test_work_makes_the_warmth_that_follows_it(
    rig: Rig, known: dict[str, float], warmth: Warmth, cause: str | None
) -> None:
    found = fitted(rig, known, warmth)
    assert made_by_the_drive("temperature_dependence", found) == cause
    assert made_by_the_drive("viscous", found) is None  # it follows no column


@pytest.mark.parametrize(("warmth", "named"), [(work, False), (heating, True)])
def test_friction_that_follows_the_warmth_of_work_is_a_set(
    known: dict[str, float], warmth: Warmth, named: bool
) -> None:
    """A thermometer on the drive tells that warmth counts, not where it comes from."""
    logs = [logged(seed, warmth, beta=0.043) for seed in (51, 52, 53)]
    found = diagnose(kernel("LuGreFriction"), logs[:2], values=known, holdout=logs[2:])
    assert found.effects == (("temperature_dependence",) if named else ())
    assert found.verdict == ("named" if named else "ambiguous")
    assert [set(ids) for ids in found.equivalent] == ([] if named else [{"temperature_dependence", "thermal"}])
    assert found.family == ("time",)
