"""What a check says of sensors, of the run as a whole, of signs and of spikes, on small and plain arrays."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.checking import power, run_check, sensor
from tsm_fmu.checking.coverage import MotionCoverage
from tsm_fmu.checking.finding import shown
from tsm_fmu.checking.spikes import spikes, without_spikes
from tsm_fmu.logs.record import Record

RATE, N = 100.0, 2000
TIME = 3.0 + np.arange(N) / RATE


def record(time: np.ndarray = TIME, units: dict[str, str] | None = None, **columns: np.ndarray) -> Record:
    known = {"x_in": "rad", "x_out": "rad", "x": "m", "v": "m/s", "w": "deg/s", "F": "N", "Theta": "rad"}
    known |= units or {}
    return Record("r", time, columns, {n: known.get(n, "N.m") for n in columns}, first_row=2)


# -- sensors


def test_runs_of_true_have_a_start_and_a_length() -> None:
    starts, lengths = sensor._runs(np.array([1, 1, 0, 0, 1, 0, 1, 1, 1], bool))
    assert (starts.tolist(), lengths.tolist()) == ([0, 4, 6], [2, 1, 3])
    assert sensor._runs(np.zeros(4, bool))[0].size == 0


def test_positions_travel_by_the_largest_share_of_their_range() -> None:
    run = record(x_in=np.linspace(0.0, 4.0, N), x_out=np.linspace(0.0, 1.0, N) ** 2, F=TIME)
    positions = sensor.Positions.of(run)
    assert positions.names == ("x_in", "x_out")
    assert positions.ranges == pytest.approx([4.0, 1.0])
    last = N - 1
    assert positions.travel(0, last // 2) == pytest.approx((last // 2) / last)
    assert positions.travel(last - 100, last) == pytest.approx(1.0 - (1.0 - 100 / last) ** 2)
    none = sensor.Positions.of(record(F=TIME))
    assert (none.names, none.travel(0, 10)) == ((), 0.0)
    assert sensor.Positions.of(record(x=np.zeros(N))).travel(0, 10) == 0.0


@pytest.mark.parametrize(("samples", "found"), [(9, 0), (10, 1)])
def test_a_noisy_channel_is_clipped_where_ten_samples_are_at_its_limit(samples: int, found: int) -> None:
    """In stretches of three and more; what is there once or twice is chance."""
    force = np.random.default_rng(2).normal(0.0, 1.0, 1000)
    limit = float(np.abs(force).max()) + 0.5
    for begin, length in ((100, 3), (300, 3), (500, samples - 6), (700, 2), (800, 1)):
        force[begin : begin + length] = limit
    force[600] = 0.9 * limit  # near it, and turning back
    texts = [f.text for f in sensor.check_clipping(record(np.arange(1000) / RATE, F=force), "F", 0.0, 25)]
    assert len(texts) == found
    if found:
        assert texts[0] == (
            f"F stays at its upper limit {shown(limit, 'N')} for 10 samples in 3 stretches: clipped or against a stop"
        )
        (f,) = sensor.check_clipping(record(np.arange(1000) / RATE, F=-force), "F", 0.0, 25)
        assert "lower limit" in f.text
        assert f.rows == (102, 505)
    still = np.where(np.arange(1000) < 500, 0.0, 0.0)
    assert sensor.check_clipping(record(np.arange(1000) / RATE, F=still), "F", 0.0, 25) == []


@pytest.mark.parametrize(("share", "found"), [(0.0019, 0), (0.0021, 1)])
def test_of_a_long_run_two_in_a_thousand_samples_are_at_the_limit(share: float, found: int) -> None:
    n = 10_000
    force = np.random.default_rng(2).normal(0.0, 1.0, n)
    force[5000 : 5000 + round(share * n)] = limit = float(np.abs(force).max()) + 0.1
    force[np.arange(100, 4000, 50)] = 0.95 * limit
    found_ = sensor.check_clipping(record(np.arange(n) / RATE, F=force), "F", 0.0, 25)
    assert len(found_) == found


@pytest.mark.parametrize(("step", "off", "at"), [(0.4, 0.09, 12), (0.4, 0.11, 0), (0.0, 1e-13, 12), (0.0, 1e-11, 0)])
def test_a_quarter_of_a_sensor_step_is_at_the_limit(step: float, off: float, at: int) -> None:
    random = np.random.default_rng(5)
    force = random.uniform(-1.0, 0.98, 1000)
    force[500:512] = 1.0 - off * np.array([1, 0, 1] * 4)
    found = sensor.check_clipping(record(np.arange(1000) / RATE, F=force), "F", step, 25)
    samples = [int(f.text.split(" for ")[1].split()[0]) for f in found if "upper" in f.text]
    assert samples == ([at] if at else [])


# -- the run


def test_a_channel_is_described_by_range_step_and_noise() -> None:
    random = np.random.default_rng(6)
    noise = random.normal(0.0, 0.25, 20_000)
    channel = run_check._channel(record(np.arange(20_000) / RATE, F=7.0 + noise), "F")
    assert (channel.unit, channel.lowest, channel.highest) == ("N", 7.0 + noise.min(), 7.0 + noise.max())
    assert channel.noise == pytest.approx(0.25, rel=0.02)
    stairs = run_check._channel(record(F=np.round(np.sin(TIME) / 0.1) * 0.1), "F")
    assert stairs.step == pytest.approx(0.1)
    assert stairs.noise == pytest.approx(0.1 / np.sqrt(12.0))
    assert run_check._channel(record(np.arange(2.0), F=np.array([1.0, 5.0])), "F").noise == 0.0
    three = run_check._channel(record(np.arange(3.0), F=np.array([1.0, 5.0, 3.0])), "F")
    assert three.noise == pytest.approx(max(1.4826 * 6.0 / np.sqrt(6.0), three.step / np.sqrt(12.0)))


@pytest.mark.parametrize(("rest", "said"), [(0.124, False), (0.126, True)])
def test_a_rest_at_the_start_is_told_where_it_is_longer_than_half_a_window(
    rest: float, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A window of 25 samples: a tenth of 2.5 s."""
    motion = MotionCoverage("x_in", "rad", (0, 1), (0, 1), (0, 1), 9, (0.1, 0.5, 1.0), (1.0, 2.0), 3.0, rest, 5.0)
    monkeypatch.setattr(run_check, "shortest_period", lambda *_: 2.5)
    monkeypatch.setattr(run_check, "motion_of", lambda *_: (motion, []))
    found = run_check.check_record(record(x_in=np.sin(2.0 * TIME), F=TIME)).findings
    texts = [f for f in found if f.kind == "start_up" and "rests until" in f.text]
    assert len(texts) == said
    if said:
        assert texts[0].text.startswith("x_in rests until 3.120 s; the state of friction")
        assert texts[0].rows == (2, 14)


def test_turning_is_slow_motion_with_a_window_before_and_the_way_it_breaks_away() -> None:
    """Speed below a tenth of what is reached; then until a tenth of the range is covered."""
    x = np.concatenate([np.linspace(0.0, 10.0, 101), np.full(20, 10.0), np.linspace(10.0, 0.0, 101)])
    v = np.gradient(x)
    slow = np.flatnonzero(np.abs(v) < 0.1 * np.quantile(np.abs(v), 0.99))
    marked = run_check._turning(x, v, 5)
    first, last = slow[0] - 5, slow[-1] + 1
    broken = next(k for k in range(last, x.size) if abs(x[k] - x[last - 1]) > 0.1 * np.ptp(x))
    assert np.flatnonzero(marked).tolist() == list(range(first, broken + 5))
    assert not run_check._turning(np.arange(50.0), np.ones(50), 5).any()
    never = np.concatenate([np.linspace(0.0, 10.0, 101), np.full(20, 10.0)])
    assert np.flatnonzero(run_check._turning(never, np.gradient(never), 3))[-1] == never.size - 1


def test_findings_stand_in_order_of_time_with_what_is_not_covered_last() -> None:
    force = np.sin(TIME)
    force[[900, 300]] += 50.0
    found = run_check.check_record(record(x_in=np.sin(2.0 * TIME), F=force)).findings
    kinds = [f.kind for f in found]
    assert kinds[:2] == ["glitch", "glitch"]
    assert [f.rows[0] for f in found[:2]] == [302, 902]
    assert set(kinds[2:]) == {"coverage"}
    result = run_check.check_record(record(time=np.array([1.0, 2.5]), x_in=np.zeros(2)))
    assert (result.t0, result.t1, result.samples, result.name) == (1.0, 2.5, 2, "r")


# -- signs


@pytest.mark.parametrize(("effort", "unit", "motion"), [
    ("tau_in", "N.m", "x_in"), ("tau_drive", "N.m", "x_in"), ("tau_out", "N.m", "x_out"), ("tau_load", "N.m", "x_out"),
    ("tau", "N.m", None), ("F", "N", "x"), ("F_in", "N", "x"), ("tau_in", "N", "x"), ("p", "Pa", None),
])  # fmt: skip
def test_an_effort_works_along_the_motion_of_its_side(effort: str, unit: str, motion: str | None) -> None:
    run = record(units={effort: unit}, x_in=TIME, x_out=TIME, x=TIME, **{effort: TIME})
    assert power._partner(run, effort) == motion


def test_whole_strokes_are_between_the_first_and_the_last_way_up_through_the_middle() -> None:
    x = 4.0 + np.sin(2 * np.pi * np.arange(100) / 20.0 - 0.05)
    first, last = power._whole_strokes(x)
    assert (last - first) % 20 == 0
    assert (first, last) == (0, 80)
    assert x[first] <= 4.0 < x[first + 1]
    assert power._whole_strokes(np.arange(30.0)) == (0, 29)


def test_work_is_force_over_way_by_the_mean_of_each_step() -> None:
    """A loop of Coulomb friction: 4 F A a period, all of it one way."""
    t = np.arange(4001) / RATE
    x = 0.3 * np.sin(2 * np.pi * 0.5 * t)
    v = np.cos(2 * np.pi * 0.5 * t)
    (one,), found = power.check_power(record(t, x_in=x, tau_in=2.0 * np.sign(v) + 5.0))
    assert one.mean == pytest.approx(4 * 2.0 * 0.3 * 0.5, rel=0.01)
    assert one.share == pytest.approx(1.0, rel=0.02)
    assert found == []
    (two,), (said,) = power.check_power(record(t, x_in=x, tau_in=-2.0 * np.sign(v)))
    assert two.mean == pytest.approx(-1.2, rel=0.01)
    assert said.text.startswith("tau_in * dx_in/dt is -1.2 W on average: the drive would take power out of a rig")
    (still,), none = power.check_power(record(t, x_in=x, tau_in=np.full(4001, 3.0)))
    assert (still.share, none) == (0.0, [])
    (load,), none = power.check_power(record(t, x_out=x, tau_out=-2.0 * np.sign(v)))
    assert load.share < -0.9
    assert none == []


@pytest.mark.parametrize(("share", "said"), [(-0.045, False), (-0.055, True)])
def test_a_drive_takes_power_out_below_a_twentieth_of_what_it_would_be_all_one_way(share: float, said: bool) -> None:
    """A force of 1 against the motion over the first part of each stroke and with it over the rest: 1 - 2 p."""
    t = np.arange(40_001) / 2000.0
    x, up = np.sin(2 * np.pi * t), np.cos(2 * np.pi * t) > 0.0
    against = np.where(up, x, -x) < -share
    run = record(t, x_in=x, tau_in=np.where(up, 1.0, -1.0) * np.where(against, -1.0, 1.0))
    (found,), texts = power.check_power(run)
    assert found.share == pytest.approx(share, abs=2e-3)
    assert found.mean == pytest.approx(4.0 * share, abs=1e-2)
    assert bool(texts) is said


# -- spikes


def test_a_line_takes_the_place_of_spikes_side_by_side_in_uneven_time() -> None:
    t = np.cumsum(np.where(np.arange(800) % 2 == 0, 0.01, 0.03))
    x = 2.0 * t
    hurt = x.copy()
    hurt[[300, 500]] += [40.0, -40.0]
    assert spikes(hurt).tolist() == [300, 500]
    assert without_spikes(hurt, t) == pytest.approx(x)
    assert hurt[300] != x[300]  # the channel itself stays as it was
