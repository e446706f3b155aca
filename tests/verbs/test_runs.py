"""Runs and their names, one run replayed, and choices of a sweep, against what was given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

import tsm_fmu as tsm
from tsm_fmu.card import CardParameter, ModelCard, write_card
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.agreement import agreement
from tsm_fmu.logs.record import Record, write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs.choices import card_change, choices
from tsm_fmu.verbs.runs import _names_of, grouped, records_of
from tsm_fmu.verbs.simulate import SimulateResult
from tsm_fmu.verbs.systems import Settings, opened

T = 0.1 * np.arange(30)


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["a/x.csv", "b/y.csv"], ["x", "y"]),
        (["a/x.csv", "b/x.csv", "b/y.csv"], ["a/x", "b/x", "y"]),
        (["p/a/x.csv", "q/a/x.csv", "q/x.csv"], ["p/a/x", "q/a/x", "q/x"]),
        (["a/x.csv", "a/x.parquet"], ["x.csv", "x.parquet"]),
        (["x.csv.gz"], ["x"]),
        ([], []),
    ],
)
def test_a_file_is_called_by_as_many_folders_as_tell_it_apart(
    files: list[str], names: list[str], tmp_path: Path
) -> None:
    assert _names_of([tmp_path / f for f in files]) == names


def test_a_file_given_twice_is_refused_however_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with pytest.raises(InputError, match=r"x\.csv is given 2 times -- expected each run once"):
        _names_of([tmp_path / "x.csv", tmp_path / "a" / ".." / "x.csv", tmp_path / "y.csv"])


def test_groups_get_their_own_runs_with_names_over_all(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_record(tmp_path / folder / "x.csv", T, {"y": T}, {"y": "rad"})
    frame = pd.DataFrame({"time [s]": T, "y [rad]": 2 * T})
    named = frame.copy()
    named.attrs["name"] = "mine"
    record = Record("rec", T, {"y": T}, {"y": "rad"})
    first, second, third = grouped([tmp_path / "a" / "x.csv", frame], named, [record, tmp_path / "b" / "x.csv"])
    assert [r.name for r in (*first, *second, *third)] == ["a/x", "run 2", "mine", "rec", "b/x"]
    assert third[0] is record
    assert first[1].columns["y"] == pytest.approx(2 * T)
    with pytest.raises(InputError, match="2 runs are called 'rec' -- expected a name each"):
        records_of([record, replace(record, time=T + 1.0)])


def test_a_replayed_run_is_drawn_beside_its_measurement_in_units_that_people_read() -> None:
    t = T
    run = tsm.sample("sine")
    simulated = {"x_out": np.sin(t), "v_in": np.cos(t)}
    record = replace(run, name="one", time=t, columns={"x_out": np.sin(t) + 0.1 * t}, units={"x_out": "rad"})
    made = SimpleNamespace(time=t, columns=simulated, units={"x_out": "rad", "v_in": "rad/s"})
    errors = {"x_out": agreement("rad", [record.columns["x_out"]], [-0.1 * t])}
    found = SimulateResult(cast(Any, made), errors, record, 0.25)
    (panel,) = found.figure().panels
    ours, measured = panel.lines
    degree = 180.0 / np.pi
    assert (ours.name, measured.name, ours.dashed, measured.dashed) == ("simulated", "measured", False, True)
    assert np.asarray(ours.y) == pytest.approx(degree * np.sin(t))
    assert np.asarray(measured.y) == pytest.approx(degree * (np.sin(t) + 0.1 * t))
    assert found.figure().title == "x_out, run one"
    (alone,) = found.figure("v_in").panels[0].lines
    assert np.asarray(alone.y) == pytest.approx(degree * np.cos(t))
    assert found["v_in"] is simulated["v_in"]
    with pytest.raises(KeyError, match="expected one of x_out, v_in"):
        found["nothing"]
    frame = found.to_frame()
    assert list(frame.columns) == ["x_out [rad]", "v_in [rad/s]"]
    assert frame.index.to_list() == t.tolist()
    assert found.as_json()["steps"] == 29
    assert found.as_json()["channels"]["x_out"]["rmse"] == pytest.approx(np.sqrt(np.mean((0.1 * t) ** 2)))
    row = next(line for line in found.summary().splitlines() if line.startswith("x_out")).split("  ")
    shown = [cell.strip() for cell in row if cell.strip()]
    about = -0.1 * t - np.mean(-0.1 * t)
    numbers = [np.sqrt(np.mean((0.1 * t) ** 2)), -0.1 * t.mean(), about.std(), 0.1 * np.ptp(t)]
    assert [float(c.removesuffix(" deg")) for c in shown[1:5]] == pytest.approx(np.degrees(numbers), rel=1e-3)
    nothing = replace(found, agreement={})
    assert nothing.summary() == "one has none of the outputs x_out, v_in: nothing to compare"
    assert len(nothing.figure().panels[0].lines) == 1


def card(**values: float) -> ModelCard:
    model = kernel("PairedTsmBacklash")
    known = {**model.named(model.params()), **values}
    return ModelCard("PairedTsmBacklash", "published", (), {
        v.name: CardParameter(known[v.name], v.quantity.unit, None) for v in model.parameters
    })  # fmt: skip


def test_choices_of_a_sweep_are_cards_and_units_of_the_right_component(tmp_path: Path) -> None:
    """Two cards and another FMU for one component, numbers of the other: each combination changes its own."""
    fmu = build_fmu(kernel("PairedTsmBacklash"), tmp_path / "a.fmu")
    other = build_fmu(kernel("PairedTsmBacklash"), tmp_path / "b.fmu", start_values={"alpha": 9.0})
    units = tuple(Component(n, fmu, {"x_in": 0.1}) for n in ("left", "right"))
    path = write_ssp(tmp_path / "two.ssp", (System(units, ()), Experiment(1.0, 0.1)))
    for name, c in (("one", 1.25), ("two", 1.5)):
        write_card(tmp_path / f"{name}.toml", card(c=c))
    cards = [tmp_path / "one.toml", tmp_path / "two.toml"]
    with opened(path, tmp_path, Settings({}, (), None, None)) as system:
        found = choices(system, {"left": [*cards, other], "right": cards, "right.alpha": [7.0, 8.0]}, tmp_path)
        assert [(a.name, a.unit) for a in found.axes] == [("left", ""), ("right", ""), ("right.alpha", "1/rad")]
        assert len(found.changes) == 6
        for (left, right), change in found.changes.items():
            level = {"one.toml": "1.25", "two.toml": "1.5"}
            assert change.values["right.c"] == level[Path(right).name]
            assert change.values.get("left.c") == level.get(Path(left).name)
            assert change.fmus == ({"left": other.resolve()} if left.endswith(".fmu") else {})
        wrong: list[tuple[dict[str, Any], str]] = [
            ({"left": []}, "left is varied over nothing"),
            ({"left": ["x.txt"]}, r"left=x\.txt -- expected a card \(\.toml\) or an FMU"),
            ({"left.c": ["much"]}, r"left\.c over much -- expected numbers.*left=a\.toml,b\.toml"),
            ({"flavour": ["native"]}, r"flavour=native of two\.ssp -- expected a scenario"),
            ({"flavour": ["odd"]}, "flavour 'odd' -- expected one of native, python"),
            ({"seed": [1.0]}, "--vary seed, which no component has"),
        ]
        for vary, message in wrong:
            with pytest.raises(InputError, match=message):
                choices(system, vary, tmp_path)
        with pytest.raises(InputError, match="component 'middle' -- expected one of left, right"):
            card_change(system, "middle", card(), tmp_path)
        values = {v.name: CardParameter(v.start, v.quantity.unit, None) for v in kernel("LuGreFriction").parameters}
        friction = ModelCard("LuGreFriction", "", (), values)
        with pytest.raises(InputError, match="card of LuGreFriction for component left, which is PairedTsmBacklash"):
            card_change(system, "left", friction, tmp_path)
        delayed = replace(card(), effects=("delay@x_out",))
        delay = CardParameter(0.02, "s", None)
        with_effect = replace(delayed, parameters={**delayed.parameters, "x_out.delay.T_d": delay})
        change = card_change(system, "left", with_effect, tmp_path)
        assert list(change.fmus) == ["left"]
        assert "delay" in change.fmus["left"].name
        assert change.values["left.c"] == repr(card().parameters["c"].value)
