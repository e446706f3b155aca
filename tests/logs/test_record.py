"""Reading and writing of measured runs."""

import gzip
import hashlib
import pickle

import numpy as np
import pytest

from tsm_fmu.cli.runs import read_runs
from tsm_fmu.logs.record import Record, read_record, write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs.runs import records_of

LOG = "time [ms],Motor angle [deg],tau_in [mN.m]\n0.5,30,-2.5\n1.75,-45,7\n2.25,90,1e2\n"


def written(path, text=LOG):
    path.write_bytes(text.encode())
    return path


def test_units_become_si(tmp_path):
    run = read_record(written(tmp_path / "run.csv"), mapping={"Motor angle": "x_in"})
    np.testing.assert_allclose(run.time, [0.5e-3, 1.75e-3, 2.25e-3], rtol=1e-15)
    np.testing.assert_allclose(run.columns["x_in"], np.pi * np.array([1 / 6, -1 / 4, 1 / 2]), rtol=1e-15)
    np.testing.assert_allclose(run.columns["tau_in"], [-2.5e-3, 7e-3, 0.1], rtol=1e-15)
    assert dict(run.units) == {"x_in": "rad", "tau_in": "N.m"}
    assert run.name == "run"
    assert run.sha256 == hashlib.sha256(LOG.encode()).hexdigest()


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet"])
def test_numbers_survive_to_the_last_bit(tmp_path, suffix):
    noise = np.random.default_rng(4711)
    n = 257
    time = np.cumsum(noise.uniform(1e-4, 3e-3, n)) - 0.1
    x = noise.standard_normal(n) * 10.0 ** noise.integers(-300, 300, n)
    x[:4] = 5e-324, -0.0, 1 / 3, 1.7976931348623157e308
    path = write_record(tmp_path / f"out{suffix}", time, {"x": x, "F": -x[::-1]}, {"x": "m", "F": "N"})
    run = read_record(path)
    np.testing.assert_array_equal(run.time, time)
    np.testing.assert_array_equal(run.columns["x"], x)
    np.testing.assert_array_equal(run.columns["F"], -x[::-1])
    assert run.name == "out"
    again = write_record(tmp_path / f"again{suffix}", time, {"x": x, "F": -x[::-1]}, {"x": "m", "F": "N"})
    assert again.read_bytes() == path.read_bytes()


def test_write_refuses_an_unknown_suffix_and_leaves_no_partial_file(tmp_path):
    with pytest.raises(InputError, match=r"out\.xlsx -- expected a name that ends in \.csv, \.csv\.gz or \.parquet"):
        write_record(tmp_path / "out.xlsx", [0.0, 1.0], {"x": [1.0, 2.0]}, {"x": "m"})
    (tmp_path / "taken.csv").mkdir()
    with pytest.raises(InputError, match=r"taken\.csv.* could not be written .* -- expected a writable place"):
        write_record(tmp_path / "taken.csv", [0.0, 1.0], {"x": [1.0, 2.0]}, {"x": "m"})
    assert [p.name for p in tmp_path.iterdir()] == ["taken.csv"]


def test_window_keeps_rows_of_the_file_and_cuts_bad_samples_away(tmp_path):
    rows = "".join(f"{0.1 * k:.1f},{k}\n" for k in range(20)).replace("0.3,3\n", "0.3,nan\n")
    path = written(tmp_path / "a.csv", "time [s],x [m]\n" + rows)
    with pytest.raises(InputError, match=r"NaN or empty cell in row 5, column 'x' \(t = 0\.3 s\), 1 such"):
        read_record(path)
    run = read_record(path, start=0.35, stop=1.2)
    np.testing.assert_array_equal(run.columns["x"], np.arange(4.0, 13.0))
    assert run.row(0) == 6
    assert run.window(0.95).row(0) == 12
    with pytest.raises(InputError, match=r"0 samples from 7 to 9 s -- expected 2 or more inside 0 to 1\.9 s"):
        read_record(path, start=7.0, stop=9.0)
    with pytest.raises(InputError, match="--from nan -- expected a finite time"):
        read_record(path, start=float("nan"))


@pytest.mark.parametrize("scale", [None, -1.0, 0.37])
@pytest.mark.parametrize(
    ("unit", "factor", "offset"),
    [("degF", 5.0 / 9.0, 459.67 * 5.0 / 9.0), ("degC", 1.0, 273.15), ("K", 1.0, 0.0), ("deg", np.pi / 180.0, 0.0)],
)
def test_a_channel_is_its_factor_times_the_value_in_si_zero_point_included(tmp_path, unit, factor, offset, scale):
    values = np.array([-40.0, 0.0, 21.5, 212.0])
    rows = "".join(f"{0.1 * k},{x}\n" for k, x in enumerate(values))
    path = tmp_path / "a.csv"
    path.write_text(f"time [s],q [{unit}]\n{rows}")
    read = read_record(path, scales={} if scale is None else {"q": scale})
    assert read.columns["q"] == pytest.approx((scale or 1.0) * (factor * values + offset), rel=1e-12, abs=1e-12)


def test_scale_takes_names_before_and_after_renaming(tmp_path):
    path = written(tmp_path / "a.csv")
    before = read_record(path, mapping={"Motor angle": "x_in"}, scales={"Motor angle": -1.0})
    after = read_record(path, mapping={"Motor angle": "x_in"}, scales={"x_in": -1.0})
    np.testing.assert_array_equal(before.columns["x_in"], after.columns["x_in"])
    np.testing.assert_allclose(after.columns["x_in"][0], -np.pi / 6)
    with pytest.raises(
        InputError, match=r"--scale y: .*a\.csv has no such channel -- expected one of Motor angle, tau_in"
    ):
        read_record(path, scales={"y": 2.0})
    with pytest.raises(InputError, match="--scale Motor angle: 'x_in' has a factor already"):
        read_record(path, mapping={"Motor angle": "x_in"}, scales={"x_in": 2.0, "Motor angle": 3.0})
    with pytest.raises(InputError, match=r"--scale tau_in=0\.0 -- expected a finite number other than 0"):
        read_record(path, scales={"tau_in": 0.0})


def test_renaming_names_what_is_wrong(tmp_path):
    path = written(tmp_path / "a.csv")
    with pytest.raises(
        InputError, match=r"--map angle=x_in: .*a\.csv has no column 'angle' -- expected one of time, Motor"
    ):
        read_record(path, mapping={"angle": "x_in"})
    with pytest.raises(InputError, match=r"two columns of .* are called 'tau_in' -- expected different names"):
        read_record(path, mapping={"Motor angle": "tau_in"})


def test_require_compares_what_is_measured(tmp_path):
    run = read_record(written(tmp_path / "a.csv"))
    assert run.require("tau_in", "N.m") is run.columns["tau_in"]
    with pytest.raises(InputError, match=r"channel 'tau_in' in N\.m -- expected a unit such as rad"):
        run.require("tau_in", "rad")
    with pytest.raises(
        InputError, match="has no channel 'x_out' -- it has Motor angle, tau_in -- rename one with --map"
    ):
        run.require("x_out", "rad")


def test_a_record_cannot_be_changed(tmp_path):
    run = read_record(written(tmp_path / "a.csv"))
    with pytest.raises(ValueError, match="read-only"):
        run.time[0] = 3.0
    with pytest.raises(TypeError):
        run.columns["tau_in"] = run.time  # pyright: ignore[reportIndexIssue]


def test_a_record_goes_to_another_process(tmp_path):
    run = read_record(written(tmp_path / "a.csv"), start=1e-3)
    twin = pickle.loads(pickle.dumps(run))
    assert (twin.name, twin.sha256, twin.source, twin.first_row) == (run.name, run.sha256, run.source, 3)
    np.testing.assert_array_equal(twin.columns["tau_in"], run.columns["tau_in"])


def test_records_made_in_memory_are_checked_too():
    with pytest.raises(InputError, match=r"mine: 'x' has shape \(3,\) -- expected \(2,\) as time"):
        Record("mine", np.array([0.0, 1.0]), {"x": np.zeros(3)}, {"x": "m"})
    with pytest.raises(InputError, match="mine: units for"):
        Record("mine", np.array([0.0, 1.0]), {"x": np.zeros(2)}, {})


def test_byte_order_mark_quotes_spaces_and_windows_line_ends_are_read(tmp_path):
    text = '\ufeff"time [s]", "x [mm]"\r\n0, 1\r\n"0.5",2.5\r\n\r\n'
    run = read_record(written(tmp_path / "a.csv", text))
    np.testing.assert_array_equal(run.columns["x"], [1e-3, 2.5e-3])


def test_run_names_are_unique(tmp_path):
    paths = []
    for place in ("p/one/00.csv", "p/two/00.csv", "q/two/00.csv", "q/two/01.csv.gz"):
        path = tmp_path / place
        path.parent.mkdir(parents=True, exist_ok=True)
        content = LOG.encode()
        path.write_bytes(gzip.compress(content) if place.endswith("gz") else content)
        paths.append(path)
    assert [r.name for r in records_of(paths[:1])] == ["00"]
    assert [r.name for r in records_of(paths[:2])] == ["one/00", "two/00"]
    names = [r.name for r in records_of(paths)]
    assert len(set(names)) == 4
    assert names[3] == "01"
    with pytest.raises(InputError, match="is given 2 times -- expected each run once"):
        records_of([paths[0], paths[0].parent / ".." / "one" / "00.csv"])


def test_options_of_the_command_line(tmp_path):
    path = written(tmp_path / "a.csv", "time [s],motor [rad]\n0,1\n1,2\n2,4\n3,8\n")
    (run,) = read_runs([path], 0.5, None, ["motor=x_in"], ["x_in=-1"])
    np.testing.assert_array_equal(run.columns["x_in"], [-2.0, -4.0, -8.0])
    with pytest.raises(InputError, match="--scale x_in=minus -- expected a number"):
        read_runs([path], None, None, [], ["x_in=minus"])
    with pytest.raises(InputError, match="--map 'x_in' -- expected name=value"):
        read_runs([path], None, None, ["x_in"], [])
    with pytest.raises(InputError, match="--map motor= -- expected a name after '='"):
        read_runs([path], None, None, ["motor="], [])
