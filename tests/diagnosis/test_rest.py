"""A measured speed at rest: noise about zero is no motion, slow motion is."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.diagnosis.runs.rest import at_rest, with_quiet_rests
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

DT, NOISE, SPEED = 0.003, 0.0137, 1.83
LUGRE = kernel("LuGreFriction")


def moves_and_holds(between: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, speed, and where it is that of the holds: strokes of 1.1 s to and fro, holds of 1.7 s."""
    t = np.arange(0.0, 28.0, DT)
    phase = t % 2.8
    holds = phase >= 1.1
    stroke = SPEED * np.sin(np.pi * phase / 1.1) * np.where(t % 5.6 < 2.8, 1.0, -1.0)
    return t, np.where(holds, between, stroke), holds


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_noise_at_a_hold_is_rest_and_a_stroke_is_not(seed: int) -> None:
    t, v, holds = moves_and_holds()
    found = at_rest(t, v + NOISE * np.random.default_rng(seed).normal(size=t.size))
    assert found[holds].mean() > 0.97
    assert not found[np.abs(v) > 8.0 * NOISE].any()


@pytest.mark.parametrize("seed", [6, 7])
def test_creep_within_the_noise_is_motion(seed: int) -> None:
    """Its mean is told from zero where no single sample is."""
    t, v, holds = moves_and_holds(between=1.2 * NOISE)
    found = at_rest(t, v + NOISE * np.random.default_rng(seed).normal(size=t.size))
    assert found[holds].mean() < 0.02


@pytest.mark.parametrize("seed", [10, 11])
@pytest.mark.parametrize("within_s", [0.08, 0.13, 0.7])
def test_a_slow_reversal_is_motion(within_s: float, seed: int) -> None:
    """Its speed is within three standard deviations for longer than a window; no more is lost than noise moves."""
    t = np.arange(0.0, 20.0, DT)
    v = SPEED * np.sin(6.0 * NOISE / (SPEED * within_s) * (t - 10.0))
    found = at_rest(t, v + NOISE * np.random.default_rng(seed).normal(size=t.size))
    ends = np.flatnonzero(np.diff(np.concatenate([[0], found, [0]])))
    for first, last in ends.reshape(-1, 2):
        way = np.cumsum(v[first:last]) * DT
        assert np.ptp(way) < 4.0 * NOISE * DT * np.sqrt(last - first)


def test_a_speed_of_a_position_has_no_rests_but_those_of_the_position() -> None:
    """The steps of an encoder make a speed rough while the drive moves, slow reversals too; where it stands it is 0."""
    t = np.arange(0.0, 12.0, DT)
    x = 5e-6 * np.round(0.02 * np.sin(0.9 * t) ** 3 / 5e-6)
    f = np.sign(np.cos(0.9 * t))
    one = Record("one", t, {"x": x, "F": f}, {"x": "m", "F": "N"})
    found = diagnose(LUGRE, [one], values={"F_c": 1.0, "F_s": 1.0})
    assert any("is what x has moved in each sample" in note for note in found.notes)
    assert not any("counts as zero" in note for note in found.notes)


def test_without_noise_nothing_is_rest() -> None:
    t, v, _ = moves_and_holds()
    assert not at_rest(t, v).any()
    assert not at_rest(t, 1.3 * np.sin(0.7 * t)).any()
    assert not at_rest(t[:20], v[:20]).any()  # too short to tell


def record(v: np.ndarray, t: np.ndarray) -> Record:
    return Record("one", t, {"v": v, "F": 0.1 * v}, {"v": "m/s", "F": "N"}, sha256="as it was read")


def test_a_hold_keeps_its_force() -> None:
    """Noise lets the bristle of a LuGre model slip until nothing is left; what a user is told says so."""
    t, v, holds = moves_and_holds()
    noisy = v + NOISE * np.random.default_rng(8).normal(size=t.size)
    (quiet,), (said,) = with_quiet_rests(LUGRE, [record(noisy, t)])
    params = LUGRE.params(None, {"sigma0": 400.0, "sigma1": 0.0, "sigma2": 0.0, "F_c": 2.0, "F_s": 2.0, "v_s": 0.1})
    true, with_noise, with_rests = (
        LUGRE.simulate(params, t, np.asarray(one)[:, None])[:, 0] for one in (v, noisy, quiet.columns["v"])
    )
    late = holds & (t % 2.8 > 2.0)
    error_before, error_after = (np.sqrt(np.mean((y - true)[late] ** 2)) for y in (with_noise, with_rests))
    assert error_before > 0.5  # of 2 N
    assert error_after < 0.15 * error_before
    assert said.startswith("one: v counts as zero in 5") or said.startswith("one: v counts as zero in 6")
    assert said.endswith("where it is not told from zero")
    assert (quiet.columns["F"] == 0.1 * noisy).all()
    assert quiet.sha256 == "as it was read"
    moving = np.abs(v) > 8.0 * NOISE
    assert (quiet.columns["v"][moving] == noisy[moving]).all()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("rows", [2, 3, 5])
def test_a_short_log_is_left_without_a_warning(rows: int) -> None:
    t, v, _ = moves_and_holds()
    short = record(v[:rows] + 0.1, t[:rows])
    assert with_quiet_rests(LUGRE, [short]) == ([short], [])


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_records_stay_where_there_is_nothing_to_do() -> None:
    t, v, _ = moves_and_holds()
    clean, noisy = record(v, t), record(v + NOISE * np.random.default_rng(9).normal(size=t.size), t)
    assert with_quiet_rests(LUGRE, [clean]) == ([clean], [])
    assert with_quiet_rests(kernel("TendonDrive"), [noisy]) == ([noisy], [])  # its motion is x_in
    without = Record("two", t[:3], {"x": v[:3], "F": v[:3]}, {"x": "m", "F": "N"})
    assert with_quiet_rests(LUGRE, [without]) == ([without], [])
    without = Record("two", t, {"x": v, "F": v}, {"x": "m", "F": "N"})
    assert with_quiet_rests(LUGRE, [without]) == ([without], [])
