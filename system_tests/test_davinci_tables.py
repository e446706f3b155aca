"""Real logs: motion, drive torque, and the jaw from the drive side alone beside the published neural networks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import davinci, davinci_estimator, davinci_motion, davinci_torque
from benchmarks.davinci_data import Log, Split, data_folder, read_logs, rmse, splits
from tsm_fmu.cosim.replay import replay
from tsm_fmu.fmu.build import build_fmu

T4L4 = data_folder() / "T4L4"
with_data = pytest.mark.skipif(
    not T4L4.is_dir(), reason=f"no davinci/T4L4 in {T4L4.parents[1]}: set TSM_FMU_DATA to the folder with davinci/"
)
THIN = 40


@pytest.fixture(scope="module")
def split() -> Split:
    """Every third run out, as in the table of docs/davinci.md."""
    found = splits(read_logs(T4L4))[0]
    assert (len(found.fitted), len(found.held_out)) == (34, 16)
    return found


@pytest.fixture(scope="module")
def estimator(split: Split) -> dict[str, float]:
    return davinci_estimator.fitted(split.fitted, THIN)[0]


@with_data
def test_jaw_from_the_drive_alone_beats_the_published_networks(split: Split, estimator: dict[str, float]) -> None:
    assert len(davinci_estimator.START) <= 19
    angle, torque = davinci_estimator.error(estimator, split.held_out)
    assert np.degrees(angle) < 0.37
    assert torque < 4.42e-3


@with_data
def test_estimator_fmu_is_the_kernel(split: Split, estimator: dict[str, float], tmp_path: Path) -> None:
    record = split.held_out["38"].record.window(stop=4.0)
    model = davinci_estimator.ESTIMATOR
    fmu = build_fmu(model, tmp_path / "JawEstimator.fmu", name="JawEstimator", start_values=estimator)
    columns = replay(fmu, record).columns
    expected = model.simulate(model.params(None, estimator), record.time, record.inputs_for(model))
    for j, channel in enumerate(davinci_estimator.CHANNELS):
        assert columns[channel] == pytest.approx(expected[:, j], rel=1e-12, abs=1e-15)
        assert np.ptp(expected[:, j]) > 0.0


@with_data
def test_one_loop_for_all_runs(split: Split) -> None:
    """Half of the straight line's error is left with own offsets, a third with one offset and the measured load."""
    line = np.sqrt(np.mean(davinci_motion.lines(split.held_out) ** 2))
    own = davinci_motion.own_offsets(split.fitted, split.held_out, THIN)
    assert np.degrees(own.measured["x_out"].rmse) < 0.30
    assert np.degrees(own.holdout["x_out"].rmse) < 0.36
    shared = davinci_motion.stretched(split.fitted, THIN)
    error = rmse(davinci_motion.STRETCHED, shared, split.held_out, davinci_motion.CHANNELS)[0]
    assert error < line / 3.0
    assert error > davinci_motion.repeats(split.held_out)


@with_data
def test_friction_that_grows_with_the_load_halves_the_torque_error(split: Split) -> None:
    constant, *_, best = davinci_torque.MODELS
    some = dict(list(split.fitted.items())[::3])
    errors = {
        what: davinci_torque.error(what, davinci_torque.fitted(what, some, THIN), split.held_out)
        for what in (constant, best)
    }
    assert errors[best] < 0.5 * errors[constant]


@with_data
def test_disturbed_span_of_run_07_is_left_out_only_on_request() -> None:
    log: Log = read_logs(T4L4, lambda n: n == "07")["07"]
    left_out = log.scored() & ~log.scored(clean=True)
    assert 50 < left_out.sum() < 600
    assert left_out[np.argmin(abs(log.record.time - 17.35))]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected T4L4 and T4L2 in it -- set TSM_FMU_DATA to the folder that contains davinci/"),
        (["jaw"], "table 'jaw' -- expected some of motion, torque, estimator -- none prints all"),
    ],
)
def test_without_data_or_with_a_wrong_name_is_one_line(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("TSM_FMU_DATA", str(tmp_path))
    assert davinci.main(arguments) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
