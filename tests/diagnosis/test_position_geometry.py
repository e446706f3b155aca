"""Laws of the position with unknown geometry: a wheel of any size is found by its period, phase and origin."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.answer.shape import located, with_position_law
from tsm_fmu.diagnosis.fits import extent, screening
from tsm_fmu.diagnosis.fits.disguise import disguised
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.screening import screen
from tsm_fmu.diagnosis.runs.drivers import drives_of
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.kernels.serving import Serving
from tsm_fmu.logs.record import Record

GIVEN = {"sigma0": 130.0, "sigma1": 0.0, "sigma2": 0.1, "F_c": 0.7, "F_s": 0.7, "v_s": 0.3}
DT, ROWS = 0.01, 2400


def ripple(theta: np.ndarray) -> np.ndarray:
    return 0.11 * np.cos(theta) + 0.05 * np.cos(2.0 * theta + 0.4)


def triangles(theta: np.ndarray) -> np.ndarray:
    """Bursts twice a turn, and not of the form that the library has: straight flanks."""
    nearest = (theta + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return 0.19 * np.maximum(0.0, 1.0 - np.abs(nearest) / 0.27)


def rig(seed: int, radius: float, law: Callable[[np.ndarray], np.ndarray] = ripple) -> Record:
    """Dahl friction with a law of the angle of a wheel, over a position whose origin is anywhere."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    waves = ((0.21, 0.083), (0.11, 0.29), (0.05, 0.71))
    x = np.sum([a * np.sin(2 * np.pi * f * t + rng.random() * 6.0) for a, f in waves], axis=0)
    v, z = np.gradient(x, DT), exponential(x, 0.0054)
    theta = x / radius + 1.1
    force = 0.7 * z + 0.1 * v + law(theta) + 0.01 * rng.normal(size=ROWS)
    return Record(f"run {seed}", t, {"x": 4.2 + x, "v": v, "F": force}, {"x": "m", "v": "m/s", "F": "N"})


def fitted(radius: float, law: Callable[[np.ndarray], np.ndarray] = ripple) -> Fitted:
    runs = prepared(kernel("LuGreFriction"), [rig(21, radius, law), rig(22, radius, law)], (), (), None)
    return refit(Task("LuGreFriction", runs.measured, runs.channels, GIVEN, drives=drives_of(runs.model)), (), {})


def explained(base: Fitted, spec: str) -> Fitted:
    """The refit with an effect, from where the screening would begin."""
    (seen,) = screen(base, [attach(kernel("LuGreFriction"), spec)])
    return refit(base.task.limited(seen.limits), (spec,), seen.starts[0][0], steps=40)


@pytest.mark.parametrize("radius", [0.0173, 0.031])
def test_the_period_of_a_wheel_of_unknown_size_is_found(radius: float) -> None:
    base = fitted(radius)
    (seen,) = screen(base, [attach(kernel("LuGreFriction"), "drum_periodic~x[m]")])
    assert seen.starts[0][0]["drum_periodic.r"] == pytest.approx(radius, rel=0.04)
    found = refit(base.task.limited(seen.limits), ("drum_periodic~x[m]",), seen.starts[0][0], steps=40)
    assert found.values["drum_periodic.r"] == pytest.approx(radius, rel=0.003)
    amplitudes = [np.hypot(found.values[f"drum_periodic.C_{k}"], found.values[f"drum_periodic.S_{k}"]) for k in (1, 2)]
    assert amplitudes == pytest.approx([0.11, 0.05], rel=0.1)
    assert found.rmse[0] < 0.02


@pytest.mark.parametrize("radius", [0.0119, 0.0173, 0.0307, 0.0893])
def test_narrow_bursts_of_a_wheel_of_unknown_size_are_found(radius: float) -> None:
    """Of a thousand sizes and angles few fit; those that come closest are searched around. One turns 1.2 times."""
    base = fitted(radius, triangles)
    found = explained(base, "winding_crossover~x[m]")
    assert found.values["winding_crossover.r"] == pytest.approx(radius, rel=0.004)
    assert found.values["winding_crossover.A"] == pytest.approx(0.19, rel=0.15)
    assert found.rmse[0] < 0.6 * base.rmse[0]


@pytest.mark.parametrize(("radius", "tries"), [(0.0119, 64), (0.0173, 12), (0.0261, 48)])
def test_bursts_are_looked_for_in_the_turns_of_a_ripple_that_explains_more(
    radius: float, tries: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With so few shapes bursts are missed and harmonics are not; in those turns the bursts explain more than they."""

    def few(module: ModuleType) -> np.ndarray:
        return extent.quantiles(module)[: tries if module.NAME == "winding_crossover" else None]

    monkeypatch.setattr(screening, "quantiles", few)
    base = fitted(radius, triangles)
    ripple_, bursts = (attach(kernel("LuGreFriction"), f"{n}~x[m]") for n in ("drum_periodic", "winding_crossover"))
    (alone,) = screen(base, [bursts])
    beside = {s.attached.module.NAME: s for s in screen(base, [ripple_, bursts])}
    found = beside["winding_crossover"]
    assert alone.gain < beside["drum_periodic"].gain < found.gain
    assert found.starts[0][0]["winding_crossover.r"] == pytest.approx(radius, rel=0.02)
    assert found.starts[1] == alone.starts[0]


@pytest.mark.parametrize(("spec", "law"), [("drum_periodic~x[m]", ripple), ("winding_crossover~x[m]", triangles)])
def test_shapes_that_are_tried_on_few_samples_explain_what_the_best_on_all_do(
    spec: str, law: Callable[[np.ndarray], np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    base, one = fitted(0.0211, law), [attach(kernel("LuGreFriction"), spec)]
    rows, simulated = [0], Serving.fill

    def counted(self: Serving, table: np.ndarray, spans: np.ndarray, *more: np.ndarray) -> None:
        rows[-1] += int(np.sum(spans[:, 1] - spans[:, 0]))
        simulated(self, table, spans, *more)

    monkeypatch.setattr(Serving, "fill", counted)
    (rough,) = screen(base, one)
    rows.append(0)
    monkeypatch.setattr(screening, "ROUGH_ROWS", 2 * ROWS)
    (whole,) = screen(base, one)
    assert rows[0] < 0.5 * rows[1]
    assert rough.gain > 0.2
    assert rough.gain == pytest.approx(whole.gain, rel=0.1)


def test_a_wheel_of_less_than_the_stroke_has_no_name_to_take_and_its_law_is_drawn() -> None:
    """A period longer than the stroke: the search stays at one and a half turns or more."""
    base = fitted(0.2)
    stroke = max(float(np.ptp(run.inputs[:, 1])) for run in base.problem.runs)
    (seen,) = screen(base, [attach(kernel("LuGreFriction"), "drum_periodic~x[m]")])
    longest = seen.limits["drum_periodic.r"][1]
    assert 2.0 * np.pi * longest <= 1.01 * stroke / 1.5 * 1.2  # of all runs together
    _, shapes = located(base, 0, formulas=False)
    (shown,) = with_position_law(shapes, base, "F", 0)
    curves = [d for d in shown.dependences if d.coordinate == "x"]
    assert {c.direction for c in curves} == {"forth", "back"}
    assert all(np.ptp(c.mean) > 0.1 for c in curves)
    assert with_position_law((shown,), base, "F", 0) == (shown,)


def test_bursts_so_wide_that_they_run_together_are_no_winding() -> None:
    """A ripple of harmonics is fitted by wide bursts as well, at the end of their range: it keeps its name."""
    base = fitted(0.0173)
    found = explained(base, "winding_crossover~x[m]")
    assert disguised(found, "winding_crossover~x[m]")
    base = fitted(0.0173, triangles)
    found = explained(base, "winding_crossover~x[m]")
    assert not disguised(found, "winding_crossover~x[m]")


@pytest.mark.parametrize("place", [-0.07, -0.02, 0.05])
def test_what_lies_at_one_place_of_the_stroke_is_no_ripple_of_turns(place: float) -> None:
    """A sticky spot: turns long enough hold it once, and harmonics are near any law within one turn."""
    base = fitted(1.0, lambda theta: 0.21 * np.exp(-(((theta - 1.1 - place) / 0.023) ** 2)))
    found = explained(base, "drum_periodic~x[m]")
    assert found.rmse[0] < 0.75 * base.rmse[0]  # it could be taken for one
    assert disguised(found, "drum_periodic~x[m]")


@pytest.mark.parametrize("turns", [1.6, 2.3, 7.1])
def test_a_ripple_of_some_turns_is_one(turns: float) -> None:
    stroke = max(float(np.ptp(run.inputs[:, 1])) for run in fitted(1.0).problem.runs)
    found = explained(fitted(stroke / (2.0 * np.pi * turns)), "drum_periodic~x[m]")
    assert not disguised(found, "drum_periodic~x[m]")


@pytest.mark.parametrize(("centre", "bend"), [(0.0, False), (0.06, False), (-0.3, True), (0.3, True)])
def test_stiffening_is_one_about_a_position_near_the_middle_of_the_stroke(centre: float, bend: bool) -> None:
    """About another one its law bends to one side only, as that of a cam or a weight does."""

    def spring(theta: np.ndarray) -> np.ndarray:  # the angle of a wheel of radius 1 is the position and 1.1
        d = theta - 1.1 - centre
        return 6.3 * np.sign(d) * np.abs(d) ** 2.7

    base = fitted(1.0, spring)
    spec = "stiffness_hardening~x[m]"
    found = explained(base, spec)
    assert disguised(found, spec) == bend


def test_a_cam_is_no_spring_that_stiffens() -> None:
    spec = "stiffness_hardening~x[m]"
    base = fitted(1.0, lambda theta: 1.9 * np.abs(theta - 1.1 - 0.05) ** 2.2)
    found = explained(base, spec)
    assert found.rmse[0] < 0.5 * base.rmse[0]  # it could be taken for one
    assert disguised(found, spec)
