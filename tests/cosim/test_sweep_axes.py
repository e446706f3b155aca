"""Axes of a sweep that are no numbers of a component: cards, FMUs, flavours, seeds."""

import random

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu import InputError
from tsm_fmu.card import CardParameter, ModelCard, write_card
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native import zig
from tsm_fmu.kernels.kernel import kernel

TIMING = Experiment(stop=0.3, step=0.01)
CARDS = {"soft": (1.13, -0.87), "stiff": (2.31, 0.19)}


@pytest.fixture(scope="module")
def loop(foreign, tmp_path_factory):
    """X' = 1.7, summed up with a constant by a Sum of ours."""
    folder = tmp_path_factory.mktemp("axes")
    total = build_fmu(kernel("Sum"), folder / "Sum.fmu")
    components = (
        Component("x", foreign["integrator"], {"u": 1.7, "x_0": -0.4}),
        Component("sum", total, {"u2": 0.9, "u3": 0.0, "k3": 0.0}),
    )
    return write_ssp(folder / "loop.ssp", (System(components, (Connection("x.x", "sum.u1"),)), TIMING))


def test_cards_take_the_place_of_a_component_s_values(loop, tmp_path):
    files = []
    for name, (k1, k2) in CARDS.items():
        parameters = {"k1": k1, "k2": k2, "k3": 0.0}
        card = ModelCard("Sum", parameters={n: CardParameter(v, "1") for n, v in parameters.items()})
        files.append(tmp_path / f"{name}.toml")
        write_card(files[-1], card)
    table = tsm.sweep(loop, {"sum": files, "x.x_0": [0.25, -1.5]}, workers=1).to_frame()
    for (_, row), (k1, k2), x_0 in zip(
        table.iterrows(), np.repeat(list(CARDS.values()), 2, axis=0), (0.25, -1.5) * 2, strict=True
    ):
        assert row["sum.y.mean [1]"] == pytest.approx(k1 * (x_0 + 1.7 * 0.15) + k2 * 0.9, rel=1e-12)
    assert table["sum"].tolist() == [str(f) for f in files for _ in (0, 1)]
    with pytest.raises(InputError, match="card of Sum for component x, which is Integrator"):
        tsm.sweep(loop, {"x": files}, workers=1)


def test_fmus_take_the_place_of_a_component(loop, foreign, tmp_path):
    """The Sum in C and in Python, and a unit of another make that has not these ports, which fails its points alone."""
    native = build_fmu(kernel("Sum"), tmp_path / "Sum_c.fmu", flavour="native", platforms=["linux64"])
    python = build_fmu(kernel("Sum"), tmp_path / "Sum_py.fmu", flavour="python")
    found = tsm.sweep(loop, {"sum": [native, python, foreign["gain"]]}, workers=1)
    first, second, other = found.points
    assert first.metrics["sum.y.mean"] == second.metrics["sum.y.mean"]
    assert "Gain.fmu" in other.failed
    with pytest.raises(InputError, match=r"flavour=native of loop.ssp -- expected a scenario"):
        tsm.sweep(loop, {"flavour": ["native", "python"]}, workers=1)


def test_flavours_of_a_scenario_give_the_same_numbers(tmp_path, monkeypatch):
    """The same kernels in C and in Python, at two loads; each flavour's FMUs are kept beside the table."""
    here = tuple(p for p in zig.PLATFORMS if p.folders.get(2) in zig.loaded_here())
    monkeypatch.setattr(zig, "PLATFORMS", here or zig.PLATFORMS)  # the others have tests of their own
    grid = {"flavour": ["native", "python"], "load.k": [0.11, 0.19]}
    table = tsm.sweep("mssp_feedforward", grid, case=["periodic.b065_law_1"], stop=0.05, out=tmp_path, workers=1)
    table = table.to_frame()
    assert table["flavour"].tolist() == ["native", "native", "python", "python"]
    numbers = table.select_dtypes("number").drop(columns="load.k [N.m/rad]")
    assert not table["failed"].any()
    assert numbers.shape[1] > 10
    np.testing.assert_array_equal(numbers[:2], numbers[2:])
    assert (numbers.iloc[0] != numbers.iloc[1]).any()
    assert {f.name for f in (tmp_path / "fmus").iterdir()} >= {"native", "python"}
    with pytest.raises(InputError, match=r"flavour 'rust' -- expected one of native, python"):
        tsm.sweep("mssp_feedforward", {"flavour": ["rust"]}, stop=0.05, workers=1)


def test_a_seed_is_for_every_component_that_has_one(foreign, tmp_path):
    noise = Component("a", foreign["noise"]), Component("b", foreign["noise"], {"seed": 99})
    path = write_ssp(tmp_path / "noise.ssp", (System(noise, ()), TIMING))
    found = tsm.sweep(path, {"seed": [3, 8]}, workers=1)
    for point, seed in zip(found.points, (3, 8), strict=True):
        source = random.Random(seed)
        expected = np.mean([0.0, *(source.gauss(0.0, 1.0) for _ in range(30))])
        assert [point.metrics[f"{c}.y.mean"].value for c in "ab"] == pytest.approx([expected] * 2, rel=1e-12)
    still = System((Component("x", foreign["integrator"], {"u": 1.0}),), ())
    with pytest.raises(InputError, match=r"^--vary seed, which no component has -- expected"):
        tsm.sweep(write_ssp(tmp_path / "still.ssp", (still, TIMING)), {"seed": [1, 2]}, workers=1)
