"""Routes of one total angle: same friction while the tendon slides, other elongation; against capstan closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cosim.cases import run_cases, statistics
from tsm_fmu.scenarios import configuration_independence as scenario

MU, EA, T_0 = 0.16, 6786.0, 1.1
BENT_540 = ("uniform", "bends_at_driver", "bends_at_follower", "bends_apart")


@pytest.fixture(scope="module")
def cases(native_fmus):
    found = scenario.cases({name: native_fmus(name) for name in scenario.FMUS})
    return {name: (system, replace(experiment, stop=10.0)) for name, (system, experiment) in found.items()}


@pytest.fixture(scope="module")
def runs(cases):
    return run_cases(cases, record=scenario.RECORD)


@pytest.fixture(scope="module")
def metrics(cases, runs):
    return statistics(cases, runs, scenario.quantities)


def elongation(route, way):
    """Stretch beyond preload [m] of a sliding tendon: int T dl/EA with T = m g exp(way mu (Theta - theta))."""
    rest = MU * sum(length / radius for length, radius in route if radius)
    stretch = 0.0
    for length, radius in route:
        if radius:
            part = MU * length / radius
            mean = way * (math.exp(way * rest) - math.exp(way * (rest - part))) / part
            rest -= part
        else:
            mean = math.exp(way * rest)
        stretch += scenario.WEIGHT * mean * length / EA
    return stretch - T_0 * scenario.LENGTH / EA


@pytest.mark.parametrize("name", scenario.ROUTES)
def test_tension_ratio_is_the_capstan_factor_of_the_total_angle(metrics, name):
    angle = math.radians(360.0 if name == "less_bent" else 540.0)
    found = {quantity: metric.value for quantity, metric in metrics[name].quantities.items()}
    assert found["ratio_pull"] == pytest.approx(math.exp(MU * angle), rel=1e-9)
    assert found["ratio_release"] == pytest.approx(math.exp(-MU * angle), rel=1e-9)
    assert found["ratio_spread"] < 1e-9


@pytest.mark.parametrize("name", scenario.ROUTES)
def test_elongation_is_that_of_the_route(metrics, name):
    found = {quantity: metric.value for quantity, metric in metrics[name].quantities.items()}
    assert found["elongation_pull"] == pytest.approx(1e3 * elongation(scenario.ROUTES[name], 1.0), rel=1e-9)
    assert found["elongation_release"] == pytest.approx(1e3 * elongation(scenario.ROUTES[name], -1.0), rel=1e-9)


def test_routes_of_one_angle_differ_in_elongation_and_after_a_reversal_only(runs, metrics):
    pull = [
        metrics[name].quantities["elongation_pull"].value
        for name in ("bends_at_driver", "uniform", "bends_at_follower")
    ]
    assert pull[0] < 0.8 * pull[1]
    assert pull[2] > 1.2 * pull[1]
    friction = {name: run.columns["friction.y"] for name, run in runs.items()}
    sliding = {name: run.columns["transmission.stage"] == 2 for name, run in runs.items()}
    for name in BENT_540[1:]:
        both = sliding[name] & sliding["uniform"]
        both[:1] = False
        turned = np.sign(friction[name]) == np.sign(friction["uniform"])  # one may already slide back
        assert np.mean(both & turned) > 0.5
        np.testing.assert_allclose(friction[name][both & turned], friction["uniform"][both & turned], rtol=1e-9)
        assert np.max(np.abs(friction[name] - friction["uniform"])) > 1.0  # in the transitions
    less = sliding["less_bent"] & sliding["uniform"] & (friction["uniform"] > 0) & (friction["less_bent"] > 0)
    expected = (math.exp(MU * 2 * math.pi) - 1) / (math.exp(MU * 3 * math.pi) - 1)
    np.testing.assert_allclose(friction["less_bent"][less] / friction["uniform"][less], expected, rtol=1e-9)


def test_all_routes_are_as_long_and_bent_as_stated():
    for name, route in scenario.ROUTES.items():
        assert sum(length for length, _ in route) == pytest.approx(1.5, rel=1e-12)
        assert math.degrees(scenario.angle(route)) == pytest.approx(360.0 if name == "less_bent" else 540.0, rel=1e-12)
