"""What the page of a fit draws and says, against the runs and the model themselves."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsm_fmu.identification import page
from tsm_fmu.identification.fit import SETTLING, Fit, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.models import MODELS
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import per_run_fields, search_space
from tsm_fmu.report import Figure, Line

DEGREE = 180.0 / math.pi


def drive_run(name: str, seed: int, x_0: float) -> FitRun:
    """A straight line with an offset, seen through white noise; the backlash of the model is off."""
    t = 0.013 * np.arange(300)
    x = 0.7 * np.sin(2.3 * t + seed)
    return FitRun(name, t, x[:, None], (0.93 * x + x_0 + np.random.default_rng(seed).normal(0.0, 0.01, 300))[:, None])


def friction_run(name: str, seed: int) -> FitRun:
    t = 0.013 * np.arange(300)
    v = 0.4 + 0.2 * t  # its travel is 0.4 t + 0.1 t^2, and trapezoids are exact
    return FitRun(name, t, v[:, None], (0.9 + 0.31 * v + np.random.default_rng(seed).normal(0.0, 0.02, 300))[:, None])


def fitted(model: str, runs: list[FitRun], holdout: list[FitRun], free: str, channel: str, values: dict) -> Fit:
    one = kernel(model)
    space = search_space(one, values=values, per_run=per_run_fields(one)).freeing_only(free.split())
    return fit(one, runs, (channel,), space, holdout=holdout, single_start=True)


class Written:
    """What `write_report` was given."""

    def __init__(self, path: Path, title: str, summary: str, sections: Any, provenance: Any, proof: Figure) -> None:
        self.title, self.summary, self.provenance, self.proof = title, summary, provenance, proof
        self.sections = {s.title: s for s in sections}

    def figures(self, section: str) -> dict[str, Figure]:
        return {f.title: f for f in self.sections[section].figures}

    def lines(self, section: str, figure: str) -> dict[str, Line]:
        (panel,) = self.figures(section)[figure].panels
        return {line.name: line for line in panel.lines}


def written(monkeypatch: pytest.MonkeyPatch, found: Fit, runs: list[FitRun]) -> Written:
    records = [Record(r.name, r.time, {}, {}, sha256=f"sha of {r.name}") for r in runs]
    told: list[Written] = []
    monkeypatch.setattr(page, "write_report", lambda *given: told.append(Written(*given)))
    page.write_fit_report(Path("page.html"), found, runs, records, ("delay@x_out",))
    return told[0]


@pytest.fixture(scope="module")
def backlash() -> tuple[Fit, list[FitRun]]:
    runs = [drive_run(f"m{k}", k, 0.1 * k) for k in range(5)] + [drive_run("h", 9, -0.2)]
    values = {"beta": -1e-9, "alpha": 10.0}
    return fitted("PairedTsmBacklash", runs[:5], runs[5:], "c x_0", "x_out", values), runs


def model_minus_measured(found: Fit, run: FitRun) -> np.ndarray:
    values = {"c": found.parameters["c"].value, "x_0": found.runs[run.name].values["x_0"]}
    return values["c"] * run.inputs[:, 0] + values["x_0"] - run.targets[:, 0]


def test_every_drawn_run_shows_the_model_beside_the_measurement_in_degrees(backlash, monkeypatch) -> None:
    found, runs = backlash
    seen = written(monkeypatch, found, runs)
    assert seen.title == "Identification of PairedTsmBacklash + delay@x_out"
    titles = [f"x_out, run {n} ({role})" for n, role in (("m0", "measured"), ("m1", "measured"), ("m2", "measured"))]
    titles.append("x_out, run h (holdout)")
    assert list(seen.figures("x_out: fit")) == [t for title in titles for t in (title, f"Loop of {title}")]
    assert seen.sections["x_out: fit"].text == "4 of 6 runs are drawn, at most 3 of each role."
    for run, title in zip([*runs[:3], runs[5]], titles, strict=True):
        over_time, loop = (seen.lines("x_out: fit", t) for t in (title, f"Loop of {title}"))
        for lines, x in ((over_time, run.time), (loop, DEGREE * run.inputs[:, 0])):
            assert {name: line.dashed for name, line in lines.items()} == {"measured": True, "PairedTsmBacklash": False}
            for line in lines.values():
                assert line.x == pytest.approx(x)
            assert lines["measured"].y == pytest.approx(DEGREE * run.targets[:, 0])
            shown = np.asarray(lines["PairedTsmBacklash"].y)
            assert shown - DEGREE * run.targets[:, 0] == pytest.approx(
                DEGREE * model_minus_measured(found, run), abs=1e-5
            )
        assert seen.figures("x_out: fit")[f"Loop of {title}"].panels[0].y_label == "x_out [deg]"


def test_the_residual_is_model_minus_measured_over_time_position_and_speed(backlash, monkeypatch) -> None:
    found, runs = backlash
    seen = written(monkeypatch, found, runs)
    over = {"time": lambda r: r.time, "x_in": lambda r: DEGREE * r.inputs[:, 0],
            "speed of x_in": lambda r: DEGREE * np.gradient(r.inputs[:, 0], r.time)}  # fmt: skip
    assert list(seen.figures("x_out: residual")) == [f"Model minus measured, over {name}" for name in over]
    labels = [f.panels[0].x_label for f in seen.sections["x_out: residual"].figures]
    assert labels == ["time [s]", "x_in [deg]", "speed of x_in [deg/s]"]
    for name, x in over.items():
        lines = seen.lines("x_out: residual", f"Model minus measured, over {name}")
        assert list(lines) == ["m0", "m1", "m2", "h"]
        for run in [*runs[:3], runs[5]]:
            assert lines[run.name].x == pytest.approx(x(run))
            assert lines[run.name].y == pytest.approx(DEGREE * model_minus_measured(found, run), abs=1e-5)


def test_the_proof_is_a_held_out_run_else_a_measured_one(backlash, monkeypatch) -> None:
    found, runs = backlash
    seen = written(monkeypatch, found, runs)
    assert seen.proof.title.startswith("x_out of the held-out run h: measured (dotted) and PairedTsmBacklash")
    above, below = seen.proof.panels
    (error,) = below.lines
    measured, simulated = above.lines
    assert (measured.dashed, simulated.dashed) == (True, False)
    assert error.y == pytest.approx(np.asarray(simulated.y) - np.asarray(measured.y))
    assert error.y == pytest.approx(DEGREE * model_minus_measured(found, runs[5]), abs=1e-5)
    alone = fitted("PairedTsmBacklash", runs[:1], [], "c x_0", "x_out", {"beta": -1e-9, "alpha": 10.0})
    seen = written(monkeypatch, alone, runs[:1])
    assert seen.proof.title.startswith("x_out of the measured run m0:")
    assert seen.sections["x_out: fit"].text == ""
    assert "held-out" not in seen.sections["Errors"].text


def test_tables_hold_every_run_in_the_units_that_people_read(backlash, monkeypatch) -> None:
    found, runs = backlash
    seen = written(monkeypatch, found, runs)
    errors, tests = seen.sections["Errors"].tables
    assert f"first {SETTLING:g} s" in seen.sections["Errors"].text
    assert [row[:3] for row in errors.rows] == [
        *((f"m{k}", "measured", "x_out") for k in range(5)), ("h", "holdout", "x_out"),
        ("all", "measured", "x_out"), ("all", "holdout", "x_out"),
    ]  # fmt: skip
    for row, run in zip(errors.rows, runs[:5], strict=False):
        left = DEGREE * model_minus_measured(found, run)
        assert row[3] == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
        assert row[4] == pytest.approx(np.ptp(left), rel=1e-6)
        assert row[5] == "deg"
        assert row[6] == pytest.approx(row[3] / (DEGREE * np.std(run.targets)), rel=1e-6)
    assert [row[0] for row in tests.rows] == ["x_out"]
    parameters, per_run = seen.sections["Parameters"].tables
    rows = {row[0]: row for row in parameters.rows}
    assert rows["alpha"][1] == 10.0
    assert rows["alpha"][5] == "fixed"
    assert rows["x_0"][5] == "per run, mean"
    low, high = map(float, rows["c"][3].split(" to "))
    c = found.parameters["c"]
    assert (low, high) == pytest.approx((c.value - 1.96 * c.stderr, c.value + 1.96 * c.stderr), rel=1e-4)
    assert [(row[0], row[1], row[2]) for row in per_run.rows] == [
        (n, r.role, r.values["x_0"]) for n, r in found.runs.items()
    ]
    rmse = DEGREE * found.measured["x_out"].rmse
    assert seen.summary.startswith(f"x_out: RMSE {rmse:.4g} deg on the measured runs, ")
    assert seen.provenance["holdout run h"] == "in memory, SHA-256 sha of h"
    assert seen.provenance["method"].startswith("fast, seed 0")


def test_a_model_driven_by_speed_shows_its_residual_over_the_travel(monkeypatch) -> None:
    runs = [friction_run("one", 3)]
    values = {"sigma0": 1e5, "sigma1": 0.0, "F_c": 0.9, "F_s": 0.9, "v_s": 1e-3}
    found = fitted("LuGreFriction", runs, [], "sigma2 F_c", "F", values)
    seen = written(monkeypatch, found, runs)
    (line,) = seen.lines("F: residual", "Model minus measured, over travel").values()
    t = runs[0].time
    unit = seen.figures("F: residual")["Model minus measured, over travel"].panels[0].x_label
    assert line.x == pytest.approx({"travel [mm]": 1e3, "travel [m]": 1.0}[unit] * (0.4 * t + 0.1 * t**2))
    correlations = seen.sections["Parameters"].tables[-1]
    assert [row[0] for row in correlations.rows] == ["sigma2", "F_c"]
    assert correlations.rows[0][2] == correlations.rows[1][1] == f"{found.uncertainty.correlation[0, 1]:.3f}"


def test_two_channels_have_each_their_own_numbers_lines_and_sentences(monkeypatch) -> None:
    """The second channel is of other size and unit; the proof shows the first."""
    model = kernel("TendonDrive")
    t = 0.013 * np.arange(200)
    x = 0.7 * np.sin(2.3 * t)
    noise = np.random.default_rng(5).normal(0.0, 1.0, (200, 2)) * [0.01, 0.003]
    inputs = np.column_stack([x, 0.05 * np.cos(t)])
    space = search_space(model, values={"x_0": 0.1}).freeing_only(["x_0", "tau_c"])
    truth = model.simulate(model.params(values={"x_0": 0.13, "tau_c": 0.09}), t, inputs)
    columns = [[v.name for v in model.outputs].index(c) for c in ("x_out", "tau_in")]
    runs = [FitRun("one", t, inputs, truth[:, columns] + noise)]
    found = fit(model, runs, ("x_out", "tau_in"), space, single_start=True, intervals="profile")
    found = replace(found, noise_floor={"tau_in": 0.002}, complete=False)
    seen = written(monkeypatch, found, runs)
    rmse = {c: found.measured[c].rmse for c in ("x_out", "tau_in")}
    assert seen.summary == (
        f"x_out: RMSE {DEGREE * rmse['x_out']:.4g} deg on the measured runs. "
        f"tau_in: RMSE {rmse['tau_in']:.4g} N.m on the measured runs; what does not repeat from period to period is "
        "0.002 N.m."
    )
    title = "tau_in, run one (measured)"
    assert seen.lines("tau_in: fit", title)["measured"].y == pytest.approx(runs[0].targets[:, 1])
    left = seen.lines("tau_in: residual", "Model minus measured, over time")["one"].y
    assert np.sqrt(np.mean(np.square(left))) == pytest.approx(rmse["tau_in"], rel=1e-9)
    assert seen.figures("tau_in: residual")["Model minus measured, over time"].panels[0].y_label.endswith("[N.m]")
    assert seen.proof.title.startswith("x_out of the measured run one")
    assert seen.proof.panels[0].lines[0].y == pytest.approx(DEGREE * runs[0].targets[:, 0])
    assert [p.y_label for p in seen.proof.panels] == ["x_out [deg]", "error [deg]"]
    assert "the others fitted anew" in seen.sections["Parameters"].text
    assert f"worth {found.uncertainty.effective_samples:.0f} independent samples" in seen.sections["Parameters"].text
    assert f"sensitivities: {found.uncertainty.condition_number:.4g}." in seen.sections["Parameters"].text
    errors = seen.sections["Errors"].tables[0].rows
    assert [(row[2], row[5]) for row in errors] == [("x_out", "deg"), ("tau_in", "N.m")] * 2
    assert seen.provenance["method"] == "fast, seed 0, interrupted"
    assert seen.provenance["cost"] == f"{found.evaluations} simulations of one run, {found.wall_s:.2f} s"
    assert len(seen.sections["Parameters"].tables) == 2  # no value of a run's own


def test_what_to_know_is_every_finding_as_a_sentence(backlash, monkeypatch) -> None:
    found, runs = backlash
    seen = written(monkeypatch, replace(found, findings=("c is odd", "the rest is not")), runs)
    assert seen.sections["What to know"].text == "C is odd.\n\nThe rest is not."
    seen = written(monkeypatch, replace(found, findings=()), runs)
    assert seen.sections["What to know"].text.startswith("No bound holds the fit")
    several = replace(found, at_bound=frozenset(["c"]), undetermined=("c", "x_0"))
    rows = {row[0]: row[5] for row in written(monkeypatch, several, runs).sections["Parameters"].tables[0].rows}
    assert rows["c"] == "on a bound, not determined"
    assert rows["x_0"] == "per run, mean, not determined"


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.NAME)
def test_a_residual_is_drawn_over_the_place_and_the_speed_once_each(model) -> None:
    """Of a straight motion with x = 0.3 + 0.2 t the speed is 0.2 wherever it comes from, and so is its travel."""
    one = kernel(model.NAME)
    t = np.array([0.0, 0.1, 0.25, 0.7])
    units = [v.quantity.unit for v in one.inputs]
    inputs = np.column_stack([0.2 + 0.0 * t if u.endswith("/s") else 0.3 + 0.2 * t for u in units] or [t])
    run = FitRun("r", t, inputs, inputs)
    over = page._abscissas(cast(Fit, SimpleNamespace(kernel=one)))
    factors = {"deg": DEGREE, "mm": 1e3, "deg/s": DEGREE, "mm/s": 1e3}
    for name, of in over.items():
        word, unit = name.removesuffix("]").split(" [")
        begin = 0.0 if word == "travel" else 0.3
        expected = np.full(4, 0.2) if unit.endswith("/s") else begin + 0.2 * t
        assert of(run) == pytest.approx(factors[unit] * expected), name
    driven = {"v", one.roles.motion} & {v.name for v in one.inputs}
    assert len(over) == (2 if driven or any(v.name.startswith("x") for v in one.inputs) else 0)
    assert len({name.endswith("/s]") for name in over}) == len(over)
