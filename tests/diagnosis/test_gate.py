"""Each refusal of the gate alone, with its near miss: a run that is just good enough is judged."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.diagnosis.runs.gate import gate
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

MODEL = kernel("PairedTsmBacklash")


def record(rows: int = 1000, name: str = "one", **changed: np.ndarray) -> Record:
    t = 0.01 * np.arange(rows)
    rng = np.random.default_rng(rows)
    x = 1.1 * np.sin(2.3 * t)
    columns = {"x_in": x, "x_out": 0.93 * np.roll(x, 7) + 1e-3 * rng.standard_normal(rows)} | changed
    return Record(name, t, columns, {"x_in": "rad", "x_out": "rad"})


def refused(*records: Record) -> tuple[str, ...]:
    return gate(records, MODEL, ["x_out"]).refused


def test_a_sound_run_is_judged() -> None:
    assert refused(record()) == ()


@pytest.mark.parametrize(("rows", "fits"), [(199, False), (200, True)])
def test_two_hundred_samples_are_enough(rows: int, fits: bool) -> None:
    found = refused(record(rows))
    assert (found == ()) == fits
    if not fits:
        assert found == ("one has 199 samples, 200 or more are needed",)


@pytest.mark.parametrize(("share", "fits"), [(0.88, True), (0.92, False)])
def test_a_sensor_may_hang_for_nine_tenths_of_a_run(share: float, fits: bool) -> None:
    good = record().columns["x_out"]
    hanging = np.where(np.arange(1000) < 1000 * (1.0 - share), good, good[int(1000 * (1.0 - share))])
    found = refused(record(x_out=hanging))
    assert (found == ()) == fits
    assert all(text.startswith("one: x_out repeats") for text in found)


def noisy() -> np.ndarray:
    return record().columns["x_out"] + 0.05 * np.random.default_rng(3).standard_normal(1000)


def clipped(share: float, side: float = 1.0) -> np.ndarray:
    """A noisy channel that stands at its limit for one stretch of this part of its samples."""
    x = side * noisy()
    k, limit = int(np.argmax(x[:-300])), float(x.max())
    x = np.where(
        (np.arange(1000) >= k) & (np.arange(1000) < k + round(1000 * share)), limit, np.minimum(x, limit - 1e-6)
    )
    return side * x


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("share", "fits"), [(0.017, True), (0.024, False), (0.21, False)])
def test_a_fiftieth_of_a_run_may_be_clipped(share: float, fits: bool, side: float) -> None:
    run = record(x_out=clipped(share, side))
    assert any("clipped or against a stop" in note for note in gate([run], MODEL, ["x_out"]).notes)  # said in any case
    found = refused(run)
    assert (found == ()) == fits
    assert all(text.startswith(f"one: x_out stays at its {'upper' if side > 0 else 'lower'} limit") for text in found)
    assert gate([run], MODEL, []).refused == ()


@pytest.mark.parametrize(("levels", "fits"), [(12, True), (400, False)])
def test_a_level_of_a_coarse_converter_is_no_limit(levels: int, fits: bool) -> None:
    """A twentieth of the samples stand at the largest value: of 12 levels any may, of 400 none does by itself."""
    x = noisy()
    lo, hi = x.min(), np.quantile(x, 0.95)
    step = (hi - lo) / (levels - 1)
    run = record(x_out=lo + step * np.round((np.minimum(x, hi) - lo) / step))
    assert (refused(run) == ()) == fits


@pytest.mark.parametrize(("moves", "levels", "fits"), [(0.0, 41, True), (0.3, 41, False), (0.0, 1500, False)])
def test_a_friction_of_one_size_is_one_level_of_a_coarse_converter(moves: float, levels: int, fits: bool) -> None:
    """It stands at its limit in every stroke; so does one that goes on rising and is cut off."""
    t = 0.01 * np.arange(1000)
    own = 0.73 * np.clip(3.0 * np.sin(2.3 * t), -1.0, 1.0) + moves * np.sin(2.3 * t) ** 3
    step = 2.0 * 0.73 / (levels - 1)
    force = np.clip(step * (np.floor(own / step) + 0.5), -0.73, 0.73)
    run = Record("one", t, {"v": np.cos(2.3 * t), "F": force}, {"v": "m/s", "F": "N"})
    model = kernel("LuGreFriction")
    asked: list[tuple[int, str]] = []

    def modelled(k: int, channel: str) -> np.ndarray:
        asked.append((k, channel))
        wobbling = 1.04 * own + 2e-3 * np.sin(37.0 * t)  # within a step of 0.04 N, not of 0.001 N
        return np.where(t > 0.3, wobbling, np.nan)

    assert gate([run], model, ["F"]).refused  # where nothing is known of the model
    assert (gate([run], model, ["F"], modelled).refused == ()) == fits
    assert set(asked) == {(0, "F")}


def test_a_channel_that_is_not_compared_may_hang() -> None:
    stuck = record(x_out=np.full(1000, 0.4))
    assert [text.split(" in every row")[0] for text in refused(stuck)] == ["one: x_out is 22.92 deg"]
    assert gate([stuck], MODEL, []).refused == ()
    assert any("x_out" in note for note in gate([stuck], MODEL, []).notes)


def test_one_run_that_moves_is_enough() -> None:
    rest = record(name="rest", x_in=np.full(1000, 0.2))
    assert "x_in does not move in any run" in refused(rest)
    assert not any("does not move" in text for text in refused(rest, record()))
    assert any(text.startswith("rest: ") for text in gate([rest, record()], MODEL, ["x_out"]).notes)
