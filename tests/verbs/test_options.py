"""What options of verbs do before anything is simulated: command and function alike, systems opened, ports named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from inspect import signature
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.card import CardParameter, ModelCard, write_card
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record, write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs import choices, diagnose, identify, linearize, monte_carlo, step_study, sweep, systems
from tsm_fmu.verbs import run as run_verb
from tsm_fmu.verbs.points import How
from tsm_fmu.verbs.systems import Opened, Settings, opened

H = 0.01


class Told(InputError):
    """Ends a verb where it has said what it would do."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sums in a row; the first is named as tracking error."""
    folder = tmp_path_factory.mktemp("sums")
    fmu = build_fmu(kernel("Sum"), folder / "Sum.fmu", flavour="native", platforms=["linux64"])
    one = Component("a", fmu, {"u1": 0.75, "u2": 0.0, "u3": 0.0, "k1": 2.0})
    two = Component("b", fmu, {"u2": 0.0, "u3": 0.0, "k1": 3.0})
    system = System((one, two), (Connection("a.y", "b.u1"),))
    return write_ssp(folder / "sums.ssp", (system, Experiment(stop=1.0, step=0.125, tracking_error="a.y")))


def told_of(
    verb: str, options: dict[str, Any], command: list[str], told: list[Any], arguments: tuple[Any, ...]
) -> list[Any]:
    """What the function and the command told."""
    function = getattr(tsm, verb)
    with pytest.raises(Told):
        function(**dict(zip(signature(function).parameters, arguments, strict=False)), **options)
    first = told.copy()
    told.clear()
    assert run(command) == 2
    assert len(first) == len(told) > 0
    pairs = list(zip(first, told, strict=True))
    told.clear()
    return pairs


def ends(told: list[Any], *known: int | str) -> Callable[..., Any]:
    """A function that tells its arguments, those with these names or places, and ends."""

    def ending(*given: Any, **named: Any) -> Any:
        told.append({key: given[key] if isinstance(key, int) else named[key] for key in known})
        raise Told("told")

    return ending


@pytest.mark.parametrize(
    ("module", "verb", "arguments", "command"),
    [
        (run_verb, "run", ("x.ssp",), ["run", "x.ssp"]),
        (sweep, "sweep", ("x.ssp", {"a.k1": [1.0]}), ["sweep", "x.ssp", "--vary", "a.k1=1"]),
        (monte_carlo, "monte_carlo", ("x.ssp", {"a": "c"}), ["monte-carlo", "x.ssp", "--card", "a=c"]),
        (step_study, "step_study", ("x.ssp",), ["step-study", "x.ssp"]),
        (linearize, "linearize", ("x.ssp", 0.5), ["linearize", "x.ssp", "--at", "0.5"]),
    ],
)
def test_a_verb_without_options_is_the_command_without_options(
    module: Any,
    verb: str,
    arguments: tuple[Any, ...],
    command: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[Any] = []
    monkeypatch.setattr(module, "opened", ends(told, 0, 2))
    folder = [] if verb in ("step_study", "linearize") else ["--out", str(tmp_path)]
    for function, said in told_of(verb, {}, [*command, *folder], told, arguments):
        assert function[0] == said[0] == "x.ssp"
        # FMUs of a sweep run where its points do
        isolate = False if verb in ("sweep", "monte_carlo") else None
        assert function[2] == replace(said[2], case=()) == Settings({}, isolate=isolate, time_limit=300.0)


@pytest.mark.parametrize("module", [sweep, monte_carlo])
def test_options_of_a_sweep_arrive_at_its_points(
    module: Any, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []
    monkeypatch.setattr(module, "run_points", ends(told, 1, 2, 3, 4, "settings"))
    monkeypatch.setattr(module, "How", lambda *given: How(*given[:5]))
    values = {"k1": (2.0, 0.5), "k2": (0.25, None), "k3": (0.0, None)}
    found = {n: CardParameter(v, "1", e) for n, (v, e) in values.items()}
    card = ModelCard("Sum", parameters=found, correlation=tsm.card.Correlation(("k1",), ((1.0,),)))
    write_card(tmp_path / "c.toml", card)
    arguments = ({"a.k1": [1.0, 2.5]},) if module is sweep else ({"a": tmp_path / "c.toml"},)
    name = module.__name__.rpartition(".")[2]
    what = ["--vary", "a.k1=1,2.5"] if module is sweep else ["--card", f"a={tmp_path / 'c.toml'}"]
    command = [name.replace("_", "-"), str(path), *what, "--out", str(tmp_path), "--json"]
    ((function, said),) = told_of(name, {}, command, told, (path, *arguments))
    axes, points, folder, how = (function[k] for k in (1, 2, 3, 4))
    assert (axes, points) == (said[1], said[2])
    assert (folder, said[3]) == (None, tmp_path)
    for one in (how, said[4]):
        assert (one.workers, one.scheduler, one.isolate, one.time_limit, one.progress) == (
            None,
            None,
            None,
            300.0,
            False,
        )
    assert function["settings"] == {}
    if module is sweep:
        assert points == [{"a.k1": 1.0}, {"a.k1": 2.5}]
        return
    assert [p["draw"] for p in points] == list(range(201))
    assert points[0]["a.k1"] == 2.0
    drawn = np.array([p["a.k1"] for p in points[1:]])
    assert drawn.mean() == pytest.approx(2.0, abs=4 * 0.5 / np.sqrt(200))
    assert [(a.name, a.unit, len(a.values)) for a in axes] == [("draw", "1", 200), ("a.k1", "1", 200)]
    assert axes[1].values == tuple(drawn)
    other = told_of(name, {"seed": 1}, [*command, "--seed", "1"], told, (path, *arguments))[0]
    assert other[0][2] == other[1][2] != points


def test_a_fit_and_a_diagnosis_get_what_was_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    t = 0.01 * np.arange(200)
    x = np.sin(3.0 * t)
    files = [write_record(tmp_path / f"{n}.csv", t, {"x_in": x, "x_out": x}, {"x_in": "rad", "x_out": "rad"})
             for n in "abc"]  # fmt: skip
    a, b, c = map(str, files)
    told: list[Any] = []
    asked = ("method", "single_start", "intervals", "seed")
    monkeypatch.setattr(identify, "fit", ends(told, 1, *asked, "holdout"))
    monkeypatch.setattr(
        diagnose,
        "find",
        ends(told, 1, "reference", "holdout", "values", "preset", "fixed", "cutoff", "seed", "improve"),
    )
    plain = ["PairedTsmBacklash", "--measured", a, "--measured", b, "--holdout", c]
    arguments = ("PairedTsmBacklash", [a, b])
    command = ["identify", *plain, "--out", str(tmp_path / "c.toml")]
    for said in told_of("identify", {"holdout": c}, command, told, arguments)[0]:
        assert [r.name for r in said[1]] == ["a", "b"]
        assert [r.name for r in said["holdout"]] == ["c"]
        assert [said[n] for n in asked] == ["fast", False, "linear", 0]
    command = ["diagnose", *plain, "--out", str(tmp_path / "d"), "--reference", c]
    command[command.index("--holdout") : command.index("--holdout") + 2] = []
    told.clear()
    for said in told_of("diagnose", {"reference": c}, command, told, arguments)[0]:
        assert [r.name for r in said[1]] == ["a", "b"]
        assert ([r.name for r in said["reference"]], said["holdout"]) == (["c"], [])
        assert (said["values"], said["preset"], said["fixed"]) == ({}, "published", ())
        assert (said["cutoff"], said["seed"], said["improve"]) == (None, 0, False)


@pytest.mark.parametrize("draws", [1, 20_001])
def test_draws_out_of_range_are_refused_before_anything_is_opened(draws: int) -> None:
    with pytest.raises(InputError, match=f"draws {draws} -- expected 2 to 20000 -- choose another number"):
        tsm.monte_carlo("ghost", {"a": "c"}, draws=draws)
    for fits in (2, 20_000):
        with pytest.raises(InputError, match="'ghost' -- expected one of"):
            tsm.monte_carlo("ghost", {"a": "c"}, draws=fits)


@pytest.mark.parametrize(("halvings", "fits"), [(0, False), (1, True), (10, True), (11, False)])
def test_a_step_is_halved_once_to_ten_times(
    halvings: int, fits: bool, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step_study, "study_case", lambda one, n, **_: (n, one[1].step))
    if not fits:
        with pytest.raises(InputError, match=f"halvings {halvings} -- expected 1 to 10 -- correct it"):
            tsm.step_study(what=path, halvings=halvings)
        return
    found = tsm.step_study(path, halvings=halvings, stop=2.0)
    assert found.steps == tuple(0.125 * 0.5**k for k in range(halvings + 1))
    assert found.signals == (halvings, 0.125)  # pyright: ignore[reportAttributeAccessIssue]
    assert found.stop == 2.0


def test_settings_change_of_an_experiment_what_is_given_and_nothing_else() -> None:
    assert Settings({}).timing == {}
    whole = Settings({}, (), 2.0, 0.5, True, "iterate", None, 300.0, 1e-3)
    assert whole.timing == {"stop": 2.0, "step": 0.5, "loops": "iterate", "step_error": 1e-3, "method": "jacobi"}
    for loops in ("refuse", "delay", "iterate"):
        assert Settings({}, loops=loops).timing == {"loops": loops}
    with pytest.raises(InputError, match="--loops 'stop' -- expected one of refuse, delay, iterate -- choose one"):
        Settings({}, loops="stop")


def test_a_system_is_opened_with_its_name_values_and_times(path: Path, tmp_path: Path) -> None:
    with opened(path, None, Settings({"a.k1": 4.5}, (), 3.0, 0.25, jacobi=True)) as system:
        ((one, experiment),) = system.cases.values()
        assert (system.name, system.record, system.scenario, system.quantities) == ("sums", None, None, None)
        assert one.components[0].parameters["k1"] == "4.5"
        assert one.components[1].parameters["k1"] == "3.0"
        assert experiment == Experiment(3.0, 0.25, method="jacobi", tracking_error="a.y")
        run_here = system.simulate(one, 0.5, 0.25)
        assert run_here.columns["a.y"] == pytest.approx([3.375] * 3)
        fmus = [c.fmu for c in one.components]
        assert all(fmu.is_file() for fmu in fmus)
    assert not any(fmu.exists() for fmu in fmus)
    for what in ("ghost", tmp_path / "none"):
        with pytest.raises(InputError, match=r"expected one of .*, a file that ends in \.ssp, or its folder"):
            opened(what, None, Settings({})).__enter__()
    with pytest.raises(InputError, match="expected a whole number of steps"):
        opened(path, None, Settings({}, step=0.3)).__enter__()


def test_fmus_of_a_scenario_are_built_once_each_into_the_folder_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[tuple[str, Path]] = []
    monkeypatch.setattr(systems, "build_fmu", lambda model, folder: built.append((model.name, folder)))
    with opened("mssp_feedforward", tmp_path, Settings({}, ["periodic.law_1"], 2.0)) as system:
        assert list(system.cases) == ["periodic.law_1"]
        ((one, experiment),) = system.cases.values()
        assert (experiment.stop, experiment.step, system.name) == (2.0, 1e-3, "mssp_feedforward")
        assert system.scenario is not None
        assert system.quantities is system.scenario.quantities
        assert {c.fmu.parent for c in one.components} == {tmp_path.resolve() / "fmus"}
    assert built == sorted({(c.fmu.stem, tmp_path.resolve() / "fmus") for c in one.components})
    with pytest.raises(InputError, match="case 'ghost'"):
        opened("mssp_feedforward", tmp_path, Settings({}, ["ghost"])).__enter__()


def test_the_signal_of_the_bands_is_one_that_is_recorded(path: Path) -> None:
    with opened(path, None, Settings({})) as system:
        cases = system.cases
        assert monte_carlo._traced(cases, None, None) == "a.y"  # the tracking error
        assert monte_carlo._traced(cases, None, "b.y") == "b.y"
        assert monte_carlo._traced(cases, ["b.y", "ghost.y"], "b.y") == "b.y"
        for record, signal, said in (
            (["b.y"], None, "signal 'a.y' -- expected one of b.y --"),
            (None, "b.u1", "signal 'b.u1' -- expected one of a.y, b.y --"),
        ):
            with pytest.raises(InputError, match=said):
                monte_carlo._traced(cases, record, signal)
        bare = {n: (s, replace(e, tracking_error="")) for n, (s, e) in cases.items()}
        with pytest.raises(InputError, match="the system names no tracking error -- expected one of "):
            monte_carlo._traced(bare, None, None)
        one = next(iter(cases.values()))[0]
        assert (monte_carlo._unit(one, "a.y"), monte_carlo._unit(one, "ghost.y")) == ("1", "1")


@pytest.mark.parametrize(("steps", "every"), [(100, 1), (799, 2), (798, 1), (4000, 10)])
def test_times_of_bands_are_at_most_every_so_many_steps_of_the_run(steps: int, every: int) -> None:
    times = monte_carlo._times(Experiment(stop=1.5 + 0.25 * steps, step=0.25, start=1.5))
    assert times == pytest.approx(1.5 + 0.25 * np.arange(0, steps + 1, every))


def test_notes_of_draws_say_what_was_held_and_which_share_was_refused() -> None:
    draws: Any = SimpleNamespace(names=("c", "beta"), held=("x_0",), refused=50)
    drawn, held, again = monte_carlo._notes_of_draws("drive", draws, 150)
    assert drawn == "drive: c, beta drawn from the fit's covariance."
    assert held.startswith("drive: x_0 stay at the card's values")
    assert again.startswith("drive: 25 % of the draws were outside bounds or conditions")
    assert len(monte_carlo._notes_of_draws("drive", SimpleNamespace(names=("c",), held=(), refused=0), 150)) == 1


def test_flavours_of_a_scenario_build_each_fmu_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Any] = []

    def build(model: Any, folder: Path, flavour: str) -> Path:
        told.append((model.name, folder, flavour))
        return folder / f"{model.name}.fmu"

    monkeypatch.setattr(choices, "build_fmu", build)
    units = tuple(Component(n, Path(f"/x/{m}.fmu")) for n, m in (("p", "Sum"), ("q", "DcMotor"), ("r", "Sum")))
    unused: Any = SimpleNamespace()
    system = Opened("s", {"one": (System(units, ()), Experiment(1.0, 0.1))}, None, unused, unused)
    found = choices.choices(system, {"flavour": ["native", "python"]}, tmp_path)
    assert [(a.name, a.unit, a.values) for a in found.axes] == [("flavour", "", ("native", "python"))]
    assert told == [(m, tmp_path / "fmus" / f, f) for f in ("native", "python") for m in ("DcMotor", "Sum")]
    for flavour in ("native", "python"):
        named = {c: tmp_path / "fmus" / flavour / f"{m}.fmu" for c, m in (("p", "Sum"), ("q", "DcMotor"), ("r", "Sum"))}
        assert found.changes[flavour,].fmus == named


def test_a_run_through_a_model_has_its_outputs_and_says_what_had_no_effect() -> None:
    model = kernel("PairedTsmBacklash")
    t = 0.01 * np.arange(300)
    x = 0.6 * np.sin(4.0 * t)
    record = Record("one", t, {"x_in": x, "x_out": 0.9 * x}, {"x_in": "rad", "x_out": "rad"})
    found = tsm.simulate(what="PairedTsmBacklash:published", run=record, values={"x_0": 0.25}, cutoff=5.0)
    y = model.simulate(model.params("published", {"x_0": 0.25}), t, x[:, None])
    for k, v in enumerate(model.outputs):
        assert np.array_equal(found[v.name], y[:, k])
        assert found.trajectory.units[v.name] == v.quantity.unit
    assert found.trajectory.messages[0].startswith("--cutoff 5 Hz is not used")
    assert found.agreement["x_out"].rmse == pytest.approx(np.sqrt(np.mean((y[:, 0] - 0.9 * x) ** 2)))
    assert found.wall_s > 0.0
    for wrong in ("PairedTsmBacklash.csv", "a/b", "a\\b"):
        with pytest.raises(InputError, match=r"expected a file that ends in \.fmu or \.toml, or MODEL"):
            tsm.simulate(wrong, record)
    with pytest.raises(InputError, match="x_out"):
        tsm.simulate("PairedTsmBacklash", replace(record, units={"x_in": "rad", "x_out": "N"}))


def test_a_check_and_an_export_take_their_arguments_by_name(tmp_path: Path) -> None:
    t = 0.01 * np.arange(300)
    record = Record("one", t, {"x_in": np.sin(4.0 * t), "x_out": np.sin(4.0 * t)}, {"x_in": "rad", "x_out": "rad"})
    (found,) = tsm.check(runs=record).runs
    assert (found.name, found.samples, found.t1) == ("one", 300, pytest.approx(2.99))
    fmu = tsm.export(model="Sum", path=tmp_path / "S.fmu", flavour="python")
    assert describe(fmu).model.modelName == "Sum"
    assert {p.start for n, p in describe(fmu).ports.items() if n in ("k1", "k2", "k3")} == {
        repr(v.start) for v in kernel("Sum").parameters if v.name in ("k1", "k2", "k3")
    }
