"""Which ports `linearize` asks for, and of what: of the unit's derivatives, or of a simulation with loops open."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import control
import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.linearize import Linear
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs import linearize
from tsm_fmu.verbs.systems import Settings

H = 0.01
LINEAR = Linear(control.ss([[1.0]], [[H]], [[2.5]], [[0.0]], H), np.full((1, 1, 501), 2.5 * H), 0.0, 0.0,
                (("1",),), True, 0.75)  # fmt: skip
LOOP = (Connection("b.y", "a.u"), Connection("a.y", "b.u"))


def linearized(
    monkeypatch: pytest.MonkeyPatch, links: tuple[Connection, ...], module: Any = None, units: int = 2,
    derivatives: bool = True, what: str = "x.ssp", **options: Any
) -> tuple[Any, list[Any]]:  # fmt: skip
    """The result, and what the work was asked for: of the unit's derivatives, or of the simulation."""
    told: list[Any] = []
    one = (System(tuple(Component(n, Path("x.fmu")) for n in "ab"[:units]), links), Experiment(1.0, H))

    @contextmanager
    def system(*given: Any) -> Any:
        told.append(given)
        go = SimpleNamespace(of_derivatives=derive, simulate_system="there")
        yield "name", one, module, go

    def derive(*given: Any) -> Linear:
        told.append(("derivatives", *given))
        return replace(LINEAR, opened=False)

    def simulate(*given: Any, **named: Any) -> Linear:
        told.append((given, named))
        return replace(LINEAR, opened=named["opened"])

    monkeypatch.setattr(linearize, "_system", system)
    monkeypatch.setattr(linearize, "linearize_case", simulate)
    monkeypatch.setattr(linearize, "describe", lambda fmu: fmu)
    monkeypatch.setattr(linearize, "has_derivatives", lambda _: derivatives)
    return tsm.linearize(what=what, at=0.75, **options), told


def test_a_loop_is_open_at_an_input_that_is_connected_unless_it_is_to_stay_closed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ports = {"input": "a.u", "output": "b.y"}
    for links, options, is_open in (
        (LOOP, ports, True), (LOOP, {**ports, "closed": True}, False), (LOOP[1:], ports, False),
        (LOOP[:1], {**ports, "input": ["b.u"]}, False),
    ):  # fmt: skip
        _, (_, (given, named)) = linearized(monkeypatch, links, **options)
        assert named["opened"] is is_open
        assert (given[1:], named["simulate"]) == ((np.atleast_1d(options["input"]).tolist(), ["b.y"], 0.75), "there")
        assert (named["amplitude"], named["horizon"], named["order"]) == (None, None, None)
    _, (_, (_, named)) = linearized(monkeypatch, LOOP, **ports, amplitude=0.5, horizon=3.0, order=2)
    assert (named["amplitude"], named["horizon"], named["order"]) == (0.5, 3.0, 2)
    with pytest.raises(InputError, match="name -- expected an input and an output -- give both"):
        linearized(monkeypatch, LOOP, input="a.u")


def test_a_unit_alone_is_asked_for_its_derivatives_where_nothing_else_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ports = {"input": "u", "output": "unit.y", "what": "x.fmu", "units": 1}
    found, (_, (way, _, sources, targets, at)) = linearized(monkeypatch, (), **ports)
    assert (way, sources, targets, at) == ("derivatives", ["unit.u"], ["unit.y"], 0.75)
    assert (found.inputs, found.outputs, found.design) == (("u",), ("y",), None)
    assert (found.model.input_labels, found.model.output_labels) == (["u"], ["y"])
    for other in ({"amplitude": 0.5}, {"order": 2}, {"derivatives": False}, {"units": 2}):
        _, (_, call) = linearized(monkeypatch, (), **{**ports, **other})
        assert call[0] != "derivatives", other
    _, (_, call) = linearized(monkeypatch, (Connection("a.y", "a.u"),), **ports)
    assert call[0] != "derivatives"


def test_a_scenario_names_the_loop_that_it_was_designed_for(monkeypatch: pytest.MonkeyPatch) -> None:
    design = control.tf([2.5], [1.0, 0.0])
    module = SimpleNamespace(DESIGNED=("a.u", "b.y"), designed=lambda one: design)
    found, (_, (given, _)) = linearized(monkeypatch, LOOP, module)
    assert (given[1], given[2], found.design) == (["a.u"], ["b.y"], design)
    for options in ({"closed": True}, {"input": "b.u"}, {"output": "a.y"}):
        assert linearized(monkeypatch, LOOP, module, **options)[0].design is None
    assert linearized(monkeypatch, LOOP, module, input="a.u", output="b.y")[0].design is design


def test_an_fmu_is_a_system_of_its_own_with_its_own_step_if_none_is_given(tmp_path: Path) -> None:
    fmu = build_fmu(kernel("Sum"), tmp_path / "Sum.fmu", flavour="native", platforms=["linux64"])
    alone = System((Component("a", fmu, {"u1": 0.75, "u2": 0.0, "u3": 0.0}),), ())
    path = write_ssp(tmp_path / "one.ssp", (alone, Experiment(1.0, 0.125, tracking_error="a.y")))
    for step, expected in ((None, float(describe(fmu).model.defaultExperiment.stepSize)), (0.25, 0.25)):
        settings = Settings({"unit.u1": 1.5, "k2": 2.5}, step=step, isolate=False)
        with linearize._system(fmu, None, settings) as (name, (system, experiment), module, there):
            assert (name, module, experiment.step, experiment.start) == ("Sum", None, expected, 0.0)
            (unit,) = system.components
            assert (unit.name, unit.fmu, system.connections) == ("unit", fmu, ())
            assert {n: float(v) for n, v in unit.parameters.items()} == {"u1": 1.5, "u2": 0.0, "u3": 0.0, "k2": 2.5}
            assert there.simulate_system(system, 0.5, 0.25).columns["unit.y"].shape == (3,)
    with linearize._system(path, None, Settings({})) as (name, one, module, _):
        assert (name, one[1].tracking_error, module) == ("system", "a.y", None)
