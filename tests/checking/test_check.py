"""The data gate on logs with planted faults, and on the shipped logs."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from tsm_fmu.checking import check_record
from tsm_fmu.cli.app import run
from tsm_fmu.logs.record import Record, read_record, write_record

DATA = Path(__file__).parents[2] / "src" / "tsm_fmu" / "data"
RATE, N = 400.0, 7201
STEP_IN, STEP_OUT = 2 * np.pi / 5000, 2 * np.pi / 3600
UNITS = {"x_in": "rad", "tau_in": "N.m", "x_out": "rad", "tau_out": "N.m"}
PLANTED = (
    "gap",
    "jitter",
    "glitch",
    "jump",
    "disturbance",
    "clipping",
    "stuck",
    "quantisation",
    "direction",
    "power_sign",
)


def play(x, half):
    y = np.empty_like(x)
    last = 0.0
    for k, value in enumerate(x):
        last = max(value - half, min(value + half, last))
        y[k] = last
    return y


def clean(seed, frequency=0.31):
    """Two sines into a play with elastic load, Coulomb and viscous friction, coloured noise, encoders."""
    noise = np.random.default_rng(seed)
    time = np.arange(N) / RATE
    x = 0.43 * np.sin(2 * np.pi * frequency * time) + 0.09 * np.sin(2 * np.pi * 3.1 * frequency * time + 1.0)
    out = 0.87 * play(x, 0.021) - 0.4
    v = np.gradient(x, time)
    tau_out = 0.06 + 0.051 * out

    def coloured(size):
        return np.asarray(lfilter([size * 0.4], [1.0, -0.6], noise.standard_normal(N)))

    return time, {
        "x_in": STEP_IN * np.floor(x / STEP_IN + noise.uniform()),
        "tau_in": 0.9 * tau_out + 0.024 * np.tanh(v / 0.02) + 0.006 * v + coloured(6e-4),
        "x_out": STEP_OUT * np.floor(out / STEP_OUT + noise.uniform()),
        "tau_out": tau_out + coloured(5e-4),
    }


def found(time, columns, units=UNITS):
    result = check_record(Record("planted", time, columns, units))
    return result, [f for f in result.findings if f.kind in PLANTED]


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_where_nothing_is_planted(seed):
    result, findings = found(*clean(seed, frequency=0.2 + 0.07 * seed))
    assert findings == []
    assert result.clock.rate == pytest.approx(RATE)
    assert result.channels["x_in"].step == pytest.approx(STEP_IN, rel=1e-6)
    assert result.channels["x_out"].step == pytest.approx(STEP_OUT, rel=1e-6)
    assert result.channels["tau_in"].step == 0.0
    # of first-order noise with pole 0.6 and variance s^2: s^2 (6 - 8 * 0.6 + 2 * 0.36) / 6 in second differences
    coloured = 2e-4 / np.sqrt(1 - 0.36) * np.sqrt((6 - 8 * 0.6 + 2 * 0.36) / 6)
    assert result.channels["tau_out"].noise == pytest.approx(coloured, rel=0.05)
    assert result.channels["x_in"].noise >= STEP_IN / np.sqrt(12) * (1 - 1e-6)
    (first, second) = result.motion.frequencies
    assert first == pytest.approx(0.2 + 0.07 * seed, rel=0.02)
    assert second == pytest.approx(3.1 * (0.2 + 0.07 * seed), rel=0.02)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("channel", ["x_in", "x_out", "tau_out"])
def test_spikes_of_two_samples(seed, channel):
    time, columns = clean(seed)
    where = sorted(np.random.default_rng(100 + seed).choice(np.arange(800, N - 800, 450), 3, replace=False))
    size = 1.3 * np.ptp(columns[channel])
    for k in where:
        columns[channel][k : k + 2] += size
    _, findings = found(time, columns)
    assert [(f.kind, f.channel, f.rows) for f in findings] == [("glitch", channel, (k + 2, k + 3)) for k in where]


def test_lost_encoder_counts():
    time, columns = clean(1)
    columns["x_out"][3170:] += 0.11
    _, findings = found(time, columns)
    (jump,) = [f for f in findings if f.kind == "jump"]
    assert (jump.channel, len(findings)) == ("x_out", 1)
    assert jump.rows[0] <= 3172 <= jump.rows[1]
    assert jump.rows[1] - jump.rows[0] < 3
    assert float(re.search(r"x_out by (\S+) deg", jump.text)[1]) == pytest.approx(np.degrees(0.11), abs=0.2)


@pytest.mark.parametrize("seed", range(4))
def test_disturbance_that_comes_back(seed):
    time, columns = clean(seed)
    begin = 2903 + 611 * seed
    bump = 0.6 * np.sin(np.linspace(0, np.pi, 31)) ** 2
    columns["x_out"][begin : begin + 31] += bump
    _, findings = found(time, columns)
    (event,) = findings
    assert (event.kind, event.channel) == ("disturbance", "x_out")
    assert time[begin] - 0.05 < event.t0 < event.t1 < time[begin + 31] + 0.05


def test_gaps_are_counted_with_rows():
    time, columns = clean(2)
    keep = np.delete(np.arange(N), np.r_[1000:1007, 5000:5003])
    result, findings = found(time[keep], {c: x[keep] for c, x in columns.items()})
    gaps = [f for f in findings if f.kind == "gap"]
    assert [f.rows for f in gaps] == [(1001, 1002), (4994, 4995)]
    assert "about 7 samples are missing" in gaps[0].text
    assert "about 3 samples are missing" in gaps[1].text
    assert result.clock.gaps == 2
    assert [f.kind for f in findings if f.kind != "gap"] == []


def test_jitter():
    time, columns = clean(3)
    moved = time + np.random.default_rng(5).uniform(-0.2, 0.2, N) / RATE
    result, findings = found(moved, columns)
    assert [f.kind for f in findings] == ["jitter"]
    # difference of two uniform deviates of +-0.2 intervals
    assert result.clock.jitter * RATE == pytest.approx(0.4 / np.sqrt(6), rel=0.05)


def test_clipping_of_position_and_of_torque():
    time, columns = clean(4)
    top = 0.7 * columns["x_out"].max() + 0.3 * columns["x_out"].min()
    columns["x_out"] = np.minimum(columns["x_out"], STEP_OUT * np.round(top / STEP_OUT))
    columns["tau_in"] = np.maximum(columns["tau_in"], np.quantile(columns["tau_in"], 0.2))
    _, findings = found(time, columns)
    assert {(f.kind, f.channel) for f in findings} >= {("clipping", "x_out"), ("clipping", "tau_in")}
    text = next(f.text for f in findings if f.channel == "x_out")
    assert "upper limit" in text


def test_stuck_sensors():
    time, columns = clean(5)
    columns["x_out"][4000:5200] = columns["x_out"][4000]
    columns["tau_out"][2000:2300] = columns["tau_out"][2000]
    _, findings = found(time, columns)
    stuck = {f.channel: f.rows for f in findings if f.kind == "stuck"}
    assert stuck.keys() == {"x_out", "tau_out"}
    assert abs(stuck["x_out"][0] - 4002) < 5
    assert abs(stuck["x_out"][1] - 5201) < 5
    assert stuck["tau_out"] == (2002, 2301)
    columns["tau_out"] = np.zeros(N)
    _, findings = found(time, columns)
    assert "is 0 N.m in every row" in next(f.text for f in findings if f.channel == "tau_out")


def test_turned_signs_are_named_with_the_option_that_turns_them():
    time, columns = clean(6)
    turned = {**columns, "tau_in": -columns["tau_in"]}
    result, findings = found(time, turned)
    assert "power_sign" in [f.kind for f in findings]
    assert "--scale tau_in=-1" in next(f.text for f in findings if f.kind == "power_sign")
    assert next(p for p in result.powers if p.effort == "tau_in").mean < 0.0
    _, findings = found(time, {**columns, "x_out": -columns["x_out"]})
    assert "--scale x_out=-1" in next(f.text for f in findings if f.kind == "direction")


def test_power_is_that_of_the_friction():
    time, columns = clean(7)
    result, _ = found(time, columns)
    x = 0.43 * np.sin(2 * np.pi * 0.31 * time) + 0.09 * np.sin(2 * np.pi * 0.961 * time + 1.0)
    v = np.gradient(x, time)
    friction = np.mean((0.024 * np.tanh(v / 0.02) + 0.006 * v) * v)
    power = next(p for p in result.powers if p.effort == "tau_in")
    assert power.mean == pytest.approx(friction, rel=0.1)  # the rest is the load's loop over x_in


def test_coarse_sensor():
    time, columns = clean(0)
    columns["x_out"] = 0.05 * np.round(columns["x_out"] / 0.05)
    _, findings = found(time, columns)
    assert ("quantisation", "x_out") in [(f.kind, f.channel) for f in findings]


def test_coverage_says_what_is_missing():
    time = np.arange(N) / RATE
    x = 0.4 * np.sin(2 * np.pi * 0.5 * time)
    result = check_record(Record("r", time, {"x_in": x}, {"x_in": "rad"}))
    texts = " ".join(f.text for f in result.findings if f.kind == "coverage")
    for part in ("one frequency only (0.5 Hz)", "no inner loops", "no force or torque", "no rest longer"):
        assert part in texts
    assert result.motion.v[1] == pytest.approx(0.4 * np.pi, rel=0.01)
    assert result.motion.a[1] == pytest.approx(0.4 * np.pi**2, rel=0.02)
    assert result.motion.reversals == 18
    assert result.motion.amplitudes[1] == pytest.approx(0.4, rel=1e-3)
    _, rich = found(*clean(0))
    assert rich == []


def test_holds_are_measured():
    time = np.arange(N) / RATE
    x = 0.4 * np.clip(np.interp(time, [0, 2, 3, 7, 8, 18], [0, 0, 1, 1, 0, 0]), 0, 1)
    motion = check_record(Record("r", time, {"x_in": x}, {"x_in": "rad"})).motion
    assert motion.initial_rest == pytest.approx(2.0, abs=0.05)
    assert motion.dwell == pytest.approx(10.0, abs=0.1)


def test_logs_without_motion_or_with_two_rows_are_described():
    result = check_record(Record("r", np.array([0.0, 1.0]), {"F": np.array([1.0, 2.0])}, {"F": "N"}))
    assert result.motion is None
    result = check_record(Record("r", np.arange(9.0), {"x": np.zeros(9)}, {"x": "m"}))
    assert [f.kind for f in result.findings] == ["stuck", "coverage"]
    assert "x: no motion; strokes, reversals and frequencies cannot be judged" in result.findings[-1].text
    result = check_record(Record("r", np.arange(9.0), {"F": np.sin(np.arange(9.0))}, {"F": "N"}))
    assert "no channel is an angle, a length or a speed; strokes" in result.findings[-1].text


def test_a_speed_alone_tells_the_strokes():
    t = np.arange(0.0, 21.0, 0.01)
    x = 0.031 * np.sin(1.7 * t)
    motion = check_record(Record("r", t, {"v": 0.031 * 1.7 * np.cos(1.7 * t)}, {"v": "m/s"})).motion
    assert motion is not None
    assert (motion.channel, motion.unit) == ("integral of v", "m")
    assert motion.reversals == check_record(Record("r", t, {"x": x}, {"x": "m"})).motion.reversals
    assert motion.amplitudes[1] == pytest.approx(0.031, rel=1e-3)


def test_the_angle_of_a_sheath_is_not_the_drive():
    t = np.arange(0.0, 9.0, 0.01)
    columns = {"Theta": 2.0 + np.sin(0.3 * t), "q": 0.7 * np.sin(1.1 * t)}
    assert check_record(Record("r", t, columns, {"Theta": "rad", "q": "rad"})).motion.channel == "q"


def test_a_log_of_times_alone_is_not_called_good(tmp_path, capsys):
    path = tmp_path / "times.csv"
    path.write_text("time [s]\n0.0\n0.013\n0.026\n")
    assert run(["check", str(path)]) == 0
    text = capsys.readouterr().out
    assert "nothing wrong found" not in text
    assert "columns: no channel beside time: nothing can be checked; add measured columns such as 'x_in [rad]'" in text
    assert run(["check", str(path), "--json"]) == 0
    (finding,) = json.loads(capsys.readouterr().out)["findings"]
    assert (finding["kind"], finding["channel"], finding["rows"]) == ("columns", "time", [2, 4])


@pytest.mark.parametrize("name", ["sample_sine", "sample_multisine"])
def test_shipped_logs_are_clean_and_reproducible(tmp_path, name):
    record = read_record(DATA / f"{name}.csv.gz")
    assert [f.text for f in check_record(record).findings if f.kind in PLANTED] == []
    script = DATA.parents[2] / "build_scripts" / "make_sample_log.py"
    subprocess.run([sys.executable, str(script), "--out", str(tmp_path)], check=True, capture_output=True)
    again = read_record(tmp_path / f"{name}.csv.gz")
    for channel, step in (("x_in", 2 * np.pi / 8192), ("x_out", 2 * np.pi / 4000), ("tau_in", 6.1e-5)):
        off = np.abs(again.columns[channel] - record.columns[channel])
        assert off.max() < 1.01 * step, channel  # another libm may round to the next step
        assert np.mean(off > 0) < 1e-3, channel


def test_verb_prints_text_and_json(tmp_path, capsys):
    time, columns = clean(1)
    columns["x_out"][3000:3002] += 2.0
    path = write_record(tmp_path / "run.csv.gz", time, {**columns, "tau_in": -columns["tau_in"]}, UNITS)
    assert run(["check", str(path), "--scale", "tau_in=-1"]) == 0
    text = capsys.readouterr().out
    assert "findings: 1" in text
    assert "x_out by 11" in text
    assert "(rows 3002 to 3003)" in text
    assert run(["check", str(path), "--scale", "tau_in=-1", "--to", "7", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["samples"] == 2801
    assert [f["kind"] for f in result["findings"] if f["kind"] in PLANTED] == []
