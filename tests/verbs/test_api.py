"""``import tsm_fmu as tsm``: the verbs from Python, on files, records and DataFrames."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import tsm_fmu as tsm

RNG = np.random.default_rng(20261122)


@pytest.fixture(scope="module")
def frame():
    """A paired tendon with c = 0.913, loop half-width and noise of our own: none of the package's code."""
    time = np.arange(4000) * 2.5e-3
    x = 0.71 * np.sin(1.7 * time) + 0.23 * np.sin(4.9 * time)
    play, out = 0.0, []
    for value in x:  # a backlash of +-0.047 rad
        play = min(max(play, value - 0.047), value + 0.047)
        out.append(0.913 * play)
    noisy = np.array(out) + RNG.normal(0.0, 4e-4, time.size)
    return pd.DataFrame({"time [s]": time, "x_in [deg]": np.degrees(x), "x_out [rad]": noisy})


@pytest.fixture(scope="module")
def fitted(frame):
    early, late = frame[frame["time [s]"] < 6.0], frame[frame["time [s]"] >= 6.0].reset_index(drop=True)
    early.attrs["name"], late.attrs["name"] = "early", "late"
    return tsm.identify("PairedTsmBacklash", early, holdout=late, seed=3)


def test_every_public_name_is_there_and_has_a_docstring():
    for name in tsm.__all__:
        assert (getattr(tsm, name).__doc__ or "").strip(), name


def test_the_import_alone_loads_nothing_heavy():
    heavy = "numpy scipy pandas numba bokeh fmpy pyarrow lmfit".split()
    code = f"import sys, tsm_fmu; print(sorted(set({heavy!r}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_frame_and_its_file_are_the_same_run(frame, tmp_path):
    frame.to_csv(tmp_path / "run.csv", index=False)
    one, other = tsm.read_record(frame), tsm.read_record(tmp_path / "run.csv")
    np.testing.assert_array_equal(one.time, other.time)
    for name in other.columns:
        np.testing.assert_array_equal(one.columns[name], other.columns[name])
    assert one.units == other.units
    again = tsm.read_record(one.to_frame())
    np.testing.assert_array_equal(again.columns["x_in"], one.columns["x_in"])


def test_units_of_a_frame_may_stand_in_its_attributes(frame):
    bare = frame.rename(columns=lambda cell: cell.partition(" [")[0])
    bare.attrs["units"] = {"time": "s", "x_in": "deg", "x_out": "rad"}
    np.testing.assert_array_equal(tsm.read_record(bare).columns["x_in"], tsm.read_record(frame).columns["x_in"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.rename(columns={"x_in [deg]": "x_in"}), "x_in"),
        (lambda f: f.assign(**{"x_in [deg]": "much"}), "column 'x_in.*' holds text .* -- expected numbers"),
        (lambda f: f.iloc[:, :0], "has no columns"),
        (lambda f: f.iloc[::-1], "time"),
        (lambda f: f.assign(**{"x_in [deg]": np.nan}), "x_in"),
        (lambda f: f[["x_in [deg]", "x_out [rad]"]], "first column is 'x_in'"),
    ],
)
def test_a_malformed_frame_is_one_sentence(frame, change, message):
    with pytest.raises(tsm.InputError, match=message) as caught:
        tsm.read_record(change(frame))
    assert str(caught.value).count(" -- ") == 2


def test_two_runs_of_one_name_are_refused(frame):
    record = tsm.read_record(frame, name="same")
    with pytest.raises(tsm.InputError, match="2 runs are called 'same'"):
        tsm.check([record, record])


def test_check_speaks_of_every_run_and_shades_what_it_finds(frame):
    glitched = frame.copy()
    glitched.loc[1234, "x_out [rad]"] += 0.8
    found = tsm.check([frame, glitched])
    assert [run.name for run in found.runs] == ["run 1", "run 2"]
    table = found.to_frame()
    assert {"glitch"} == set(table[(table.run == "run 2") & (table.kind != "coverage")].kind)
    assert "run 1" in found.summary()
    assert "run 2" in found.summary()
    marked = [sum(len(panel.spans) for panel in found.figure(run).panels) for run in ("run 1", "run 2")]
    assert marked[1] > marked[0]
    assert "<table" in found._repr_html_()


def test_identify_returns_what_the_summary_frame_and_card_say(fitted):
    parameters = fitted.to_frame()
    assert fitted.parameters["c"] == parameters.loc["c", "value"] == fitted.card.parameters["c"].value
    assert parameters.loc["c", "value"] == pytest.approx(0.913, abs=0.03)
    assert set(fitted.errors().role) == {"measured", "holdout"}
    for name in parameters.index:
        assert name in fitted.summary()
    x, measured = fitted.figure().lines[0].x, fitted.records[0].columns["x_in"]
    assert np.max(x) == pytest.approx(np.degrees(np.max(measured)))
    assert fitted._repr_html_().count("<table") == 2


def test_a_result_serves_as_model(fitted, frame, tmp_path):
    record = tsm.read_record(frame, name="whole")
    direct = tsm.simulate(fitted, record)
    card = fitted.write_card(tmp_path / "card.toml")
    np.testing.assert_array_equal(direct["x_out"], tsm.simulate(card, record)["x_out"])
    np.testing.assert_array_equal(direct["x_out"], tsm.simulate(tsm.read_card(card), record)["x_out"])
    unit = tsm.export(fitted, tmp_path / "Mine.fmu")
    np.testing.assert_allclose(tsm.simulate(unit, record)["x_out"], direct["x_out"], rtol=0, atol=1e-12)
    assert direct.agreement["x_out"].rmse == pytest.approx(
        np.sqrt(np.mean((direct["x_out"] - record.columns["x_out"]) ** 2)), rel=1e-9
    )
    assert list(direct.to_frame().columns) == ["x_out [rad]", "x_h [rad]"]
    assert len(direct.figure().lines) == 2


def test_logs_to_fmu_in_five_lines(fitted, frame, tmp_path):
    """The distal sensor comes 60 ms late in the second rig; the model of the answer leaves less than the fit did."""
    time = frame["time [s]"].to_numpy()
    late = frame.assign(**{"x_out [rad]": np.interp(time - 0.06, time, frame["x_out [rad]"])})
    steps = []
    found = tsm.diagnose(
        fitted, late[time < 7.0], holdout=late[time >= 7.0].reset_index(drop=True), progress=steps.append
    )
    assert found.verdict in ("named", "ambiguous", "unknown", "parameters")
    assert {"delay", "sensor_lag"} & {spec.partition("@")[0] for spec in found.to_frame().index}
    gap = found.gap["x_out"]
    assert gap.after < gap.before
    assert found.answer in found.summary()
    assert "<table" in found._repr_html_()
    assert found.figure().panels
    assert steps
    unit = tsm.export(found.model, tmp_path / "MyDrive.fmu")
    record = tsm.read_record(late)
    np.testing.assert_allclose(tsm.simulate(unit, record)["x_out"], tsm.simulate(found, record)["x_out"], atol=1e-12)


def test_an_output_that_is_not_there_is_named(fitted, frame):
    with pytest.raises(KeyError, match="expected one of x_out, x_h"):
        tsm.simulate(fitted, frame)["y"]


@pytest.mark.parametrize("model", ["Nothing", "TendonDrive:odd", "missing.toml", "some/where"])
def test_what_is_no_model_is_an_input_error(model, frame):
    for verb in (tsm.identify, tsm.simulate):
        with pytest.raises(tsm.InputError):
            verb(model, frame)


def test_a_sample_that_is_not_there_is_named():
    with pytest.raises(tsm.InputError, match="sample 'triangle' -- expected one of sine, multisine"):
        tsm.sample("triangle")


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    return tsm.run("mssp_feedforward", case=["periodic.law_1"], stop=2.0, out=tmp_path_factory.mktemp("run"))


def test_run_returns_what_it_writes(loop):
    written = tsm.read_record(loop.results)
    frame = loop.to_frame()
    assert frame.index[-1] == pytest.approx(2.0)
    for name, values in written.columns.items():
        np.testing.assert_allclose(values, frame[f"{name} [{written.units[name]}]"], rtol=1e-12)
    assert loop.report.is_file()
    assert "periodic.law_1" in loop.summary()
    assert len(loop.figure().lines) == 1


def test_run_without_a_folder_gives_the_same_and_writes_nothing(loop, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    again = tsm.run("mssp_feedforward", case=["periodic.law_1"], stop=2.0)
    pd.testing.assert_frame_equal(again.to_frame(), loop.to_frame())
    assert again.results is None
    assert list(tmp_path.iterdir()) == []


def test_sweep_is_run_at_each_point(loop):
    grid = tsm.sweep("mssp_feedforward", {"load.k": [0.031, 0.077]}, case=["periodic.law_1"], stop=2.0)
    alone = tsm.run("mssp_feedforward", case=["periodic.law_1"], stop=2.0, values={"load.k": 0.077})
    table = grid.to_frame()
    assert list(table["load.k [N.m/rad]"]) == [0.031, 0.077]
    spread = alone.metrics["periodic.law_1"].tracked().peak_to_peak
    assert table["tracking_error.peak_to_peak [deg]"].iloc[1] == pytest.approx(spread, rel=1e-12)
    assert grid.failures == ()
    assert len(grid.figure().lines[0].x) == 2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: tsm.run("ghost"), "'ghost' -- expected one of"),
        (lambda: tsm.run("mssp_feedforward", case=["ghost"]), "case 'ghost'"),
        (lambda: tsm.sweep("mssp_feedforward", {"ghost.k": [1.0]}), "'ghost.k' -- expected component.variable"),
    ],
)
def test_a_system_that_is_not_there_is_named(call, message):
    with pytest.raises(tsm.InputError, match=message):
        call()
