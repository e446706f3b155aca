"""Monte Carlo from a card: bands against a closed form, bounds and conditions kept, old cards refused in a line."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

import tsm_fmu as tsm
from tsm_fmu.card import CardParameter, Correlation, ModelCard, read_card, write_card
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.draws import draw

K, STDERR, RHO = (1.13, -0.87), (0.043, 0.071), -0.62
CARD = ModelCard(
    "Sum",
    parameters={
        "k1": CardParameter(K[0], "1", STDERR[0]),
        "k2": CardParameter(K[1], "1", STDERR[1]),
        "k3": CardParameter(0.31, "1", None),
    },
    correlation=Correlation(("k1", "k2"), ((1.0, RHO), (RHO, 1.0))),
)
DRAWS = 200


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Error = k1 r1 + k2 r2 of two sines, which is linear in what is drawn."""
    folder = tmp_path_factory.mktemp("sum")
    fmus = {
        m: build_fmu(kernel(m), folder, flavour="native", platforms=["linux64"]) for m in ("Sum", "ReferenceSignal")
    }
    first = {"kind": 1, "amplitude_1": 0.7, "frequency_1": 0.37, "amplitude_2": 0.0, "amplitude_3": 0.0}
    system = System(
        (
            Component("r1", fmus["ReferenceSignal"], first),
            Component("r2", fmus["ReferenceSignal"], {**first, "amplitude_1": 0.4, "frequency_1": 0.91}),
            Component("error", fmus["Sum"], {"u3": 0.2, "k3": 0.31}),
        ),
        (Connection("r1.y", "error.u1"), Connection("r2.y", "error.u2")),
        "loop",
    )
    return write_ssp(folder / "loop.ssp", (system, Experiment(stop=3.0, step=0.01, tracking_error="error.y")))


@pytest.fixture(scope="module")
def result(path):
    return tsm.monte_carlo(path, {"error": CARD}, draws=DRAWS, seed=11, workers=1)


def test_the_bands_of_a_linear_loop_are_those_of_its_covariance(path, result):
    """error(t) is normal with mean k.r(t) and variance r'C r; a sample quantile has a known spread."""
    signals = tsm.run(path).to_frame()
    (found,) = result.bands.values()
    rows = np.searchsorted(signals.index.to_numpy(), found.time - 1e-9)
    r = np.column_stack([signals["r1.y [rad]"].to_numpy()[rows], signals["r2.y [rad]"].to_numpy()[rows]])
    s = np.array(STDERR)
    covariance = np.outer(s, s) * np.array([[1.0, RHO], [RHO, 1.0]])
    mean, std = r @ np.array(K) + 0.31 * 0.2, np.sqrt(np.einsum("ti,ij,tj->t", r, covariance, r))
    assert found.nominal == pytest.approx(mean, abs=1e-12)
    moved = std > 0.1 * std.max()
    assert moved.sum() > 200
    for p, quantile in zip((0.025, 0.25, 0.5, 0.75, 0.975), found.quantiles, strict=True):
        z = norm.ppf(p)
        error = math.sqrt(p * (1.0 - p) / DRAWS) / norm.pdf(z)  # of a sample quantile, in standard deviations
        assert np.abs((quantile - mean)[moved] / std[moved] - z).max() < 4.5 * error


def test_the_same_seed_gives_the_same_draws_and_another_one_others(result):
    values = [[p.values["error.k1"], p.values["error.k2"]] for p in result.draws]
    assert np.array_equal(draw(CARD, DRAWS, (11, 0)).values, values)
    assert not np.array_equal(draw(CARD, DRAWS, (12, 0)).values, values)
    assert any("k3 stay" in note for note in result.notes)


def test_draws_keep_bounds_and_joint_conditions_and_their_correlation():
    """Errors as large as the values: most draws of a plain normal would be refused by the model."""
    model = kernel("PairedTsmBacklash")
    p = model.named(model.params())
    names = tuple(v.name for v in model.parameters if v.kind is float and p[v.name] != 0.0)
    parameters = {
        v.name: CardParameter(p[v.name], v.quantity.unit, abs(p[v.name]) if v.name in names else None)
        for v in model.parameters
        if v.kind is float
    }
    n = len(names)
    matrix = tuple(tuple(1.0 if i == j else 0.55 for j in range(n)) for i in range(n))
    card = ModelCard("PairedTsmBacklash", parameters=parameters, correlation=Correlation(names, matrix))
    found = draw(card, 300, 5)
    assert found.refused > 100
    for row in found.values:
        model.params(values=dict(zip(found.names, row.tolist(), strict=True)))  # raises where it is out of bounds
    tight = replace(card, parameters={**parameters, names[0]: replace(parameters[names[0]], lo=p[names[0]] - 1e-3)})
    assert draw(tight, 50, 5).values[:, 0].min() >= p[names[0]] - 1e-3


def test_a_parameter_known_in_its_logarithm_is_drawn_there():
    first = next(v for v in kernel("DcMotor").parameters if v.quantity.lo == 0.0 and v.quantity.open_lo)
    parameters = {first.name: CardParameter(2.7, first.quantity.unit, 1.6)}
    card = ModelCard("DcMotor", parameters=parameters, correlation=Correlation((first.name,), ((1.0,),), (first.name,)))
    values = np.log(draw(card, 4000, 3).values[:, 0])
    assert values.mean() == pytest.approx(math.log(2.7), abs=4 * (1.6 / 2.7) / math.sqrt(4000))
    assert values.std() == pytest.approx(1.6 / 2.7, rel=4 / math.sqrt(2 * 4000))


def test_identify_writes_the_covariance_of_least_squares(tmp_path):
    """White noise on a linear model: C = s^2 (X'X)^-1, in closed form."""
    random = np.random.default_rng(8)
    time = np.arange(4000) * 0.01
    x = np.column_stack([np.sin(1.7 * time), np.sin(1.7 * time + 0.6), np.cos(0.31 * time)])
    y = x @ np.array([0.93, -1.21, 0.44]) + 0.05 * random.standard_normal(time.size)
    log = pd.DataFrame({"time [s]": time, "u1 [1]": x[:, 0], "u2 [1]": x[:, 1], "u3 [1]": x[:, 2], "y [1]": y})
    path = tsm.identify("Sum", log).write_card(tmp_path / "card.toml")
    card = read_card(path)
    assert card.correlation is not None
    assert card.correlation.logarithm == ()
    stderr = np.array([card.parameters[name].stderr for name in card.correlation.names])
    ours = np.outer(stderr, stderr) * np.array(card.correlation.matrix)
    order = [("k1", "k2", "k3").index(name) for name in card.correlation.names]
    closed = (0.05**2 * np.linalg.inv(x.T @ x))[np.ix_(order, order)]
    scale = np.sqrt(np.outer(np.diag(closed), np.diag(closed)))
    assert np.abs(ours - closed).max() < 0.25 * scale.max()
    assert np.array(card.correlation.matrix)[0, 1] == pytest.approx(closed[0, 1] / scale[0, 1], abs=0.1)


def test_the_command_writes_one_table_one_page_and_a_card_without_covariance_is_one_line(path, tmp_path, capsys):
    write_card(tmp_path / "card.toml", CARD)
    command = ["monte-carlo", str(path), "--card", f"error={tmp_path / 'card.toml'}", "--draws", "12", "--workers", "1"]
    assert run([*command, "--out", str(tmp_path / "out"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    table = pd.read_parquet(tmp_path / "out" / "draws.parquet")
    assert len(table) == len(said["points"]) == 12
    assert table["error.k1 [1]"].tolist() == [p["values"]["error.k1"] for p in said["points"]]
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "bands.csv", "draws.csv", "draws.json", "draws.parquet", "report.html",
    }  # fmt: skip
    assert said["answer"] in (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("&#39;", "'")
    old = (tmp_path / "card.toml").read_text(encoding="utf-8").replace("format = 2", "format = 1")
    head, _, rest = old.partition("[correlation]")
    (tmp_path / "card.toml").write_text(head + "[provenance]" + rest.partition("[provenance]")[2], encoding="utf-8")
    assert read_card(tmp_path / "card.toml").correlation is None
    assert run([*command, "--out", str(tmp_path / "new")]) == 2
    err = capsys.readouterr().err
    assert "does not say how the errors of its parameters are correlated" in err
    assert "tsm-fmu identify CARD" in err
    assert err.count("\n") == 1


def test_a_card_of_a_diagnosis_brings_its_effects(tmp_path):
    """F = F_0(v) + f_v v: with f_v alone drawn the band is |v| wide, and its middle the sum of both laws."""
    f_v, stderr, model = 0.83, 0.057, kernel("LuGreFriction")
    values = model.named(model.params())
    own = {p.name: CardParameter(values[p.name], p.quantity.unit) for p in model.parameters}
    effect = {"viscous.f_v": (f_v, "N.s/m", stderr), "viscous.q": (0.0, "N", None), "viscous.p": (0.5, "1", None)}
    card = ModelCard(
        "LuGreFriction",
        effects=("viscous",),
        parameters={**own, **{n: CardParameter(*given) for n, given in effect.items()}},
        correlation=Correlation(("viscous.f_v",), ((1.0,),)),
    )
    fmus = {
        m: build_fmu(kernel(m), tmp_path, flavour="native", platforms=["linux64"])
        for m in ("LuGreFriction", "ReferenceSignal")
    }
    speed = {"kind": 1, "amplitude_1": 0.37, "frequency_1": 0.9, "amplitude_2": 0.0, "amplitude_3": 0.0}
    system = System(
        (Component("speed", fmus["ReferenceSignal"], speed), Component("friction", fmus["LuGreFriction"])),
        (Connection("speed.y", "friction.v", convert_units=False),),
    )
    path = write_ssp(tmp_path / "loop.ssp", (system, Experiment(stop=2.0, step=0.001)))
    plain = tsm.run(path, jacobi=True).to_frame()
    drawn = tsm.monte_carlo(path, {"friction": card}, draws=60, seed=3, signal="friction.F", jacobi=True, workers=1)
    (found,) = drawn.bands.values()
    rows = np.searchsorted(plain.index.to_numpy(), found.time - 1e-9)
    v, force = (plain[name].to_numpy() for name in ("speed.y [rad]", "friction.F [N]"))
    v = np.concatenate([[0.0], v[:-1]])  # what it gets a step later
    values = np.array([point.values["friction.viscous.f_v"] for point in drawn.draws])
    assert abs(values.mean() - f_v) < 4.0 * stderr / math.sqrt(60)
    assert found.nominal == pytest.approx((force + f_v * v)[rows], abs=1e-9)
    for share, quantile in zip((0.025, 0.25, 0.5, 0.75, 0.975), found.quantiles, strict=True):
        edge = np.where(v > 0.0, np.quantile(values, share), np.quantile(values, 1.0 - share))
        assert quantile == pytest.approx((force + edge * v)[rows], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"draws": 1}, "draws 1 -- expected 2 to"),
        ({"cards": {}}, "no card -- expected one or more"),
        ({"cards": {"r1": CARD}}, "card of Sum for component r1, which is ReferenceSignal"),
        ({"cards": {"ghost": CARD}}, "component 'ghost' -- expected one of r1, r2, error"),
        ({"cards": {"error": "Sum"}}, "error=Sum -- expected a model card"),
        ({"signal": "error.z"}, "signal 'error.z' -- expected one of"),
        ({"values": {"error.k1": 1.0}}, "error.k1 is set and drawn -- expected one of them"),
    ],
)
def test_wrong_use_is_one_line(path, options, message):
    with pytest.raises(InputError) as wrong:
        tsm.monte_carlo(path, **{"cards": {"error": CARD}, **options})
    assert message in str(wrong.value)
    assert str(wrong.value).count(" -- ") == 2
