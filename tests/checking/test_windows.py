"""Windows and leads of a check: how many samples each step looks at, on signals where one more or less shows."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.checking import run_check, sensor
from tsm_fmu.checking.coverage import _between
from tsm_fmu.checking.events import Event, _described, events
from tsm_fmu.checking.spikes import spikes
from tsm_fmu.logs.record import Record


def record(n: int = 2000, rate: float = 100.0, **columns: np.ndarray) -> Record:
    units = {"x_in": "rad", "x_out": "rad", "F": "N"}
    return Record("r", np.arange(n) / rate, columns, {c: units[c] for c in columns}, first_row=2)


@pytest.mark.parametrize(("n", "found"), [(96, 0), (103, 0), (104, 1)])
def test_a_window_is_an_odd_number_of_samples_and_an_eighth_of_the_run_at_most(n: int, found: int) -> None:
    """Of 96 to 103 samples an eighth is 12, so that the window is 13, for which the run is too short."""
    x = np.random.default_rng(2).normal(0.0, 0.01, n)
    x[50] = 3.0
    assert len(events(x, 50)) == found


@pytest.mark.parametrize("k", [2, 3, 4, 5])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_peak_beside_silence_is_at_its_own_line(k: int, side: int) -> None:
    frequency = 0.25 * np.arange(1, 9)
    power = np.exp(-((frequency - frequency[k] - 0.05) ** 2))
    assert _between(frequency, power, k) == pytest.approx(frequency[k] + 0.05)
    power[k + side] = 0.0
    assert _between(frequency, power, k) == frequency[k]


@pytest.mark.parametrize(("period", "window"), [(2.5, 25), (2.59, 25), (0.2, 3), (0.39, 3), (0.41, 4)])
def test_events_are_looked_for_in_a_tenth_of_the_shortest_period(
    period: float, window: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, int]] = []
    monkeypatch.setattr(run_check, "shortest_period", lambda *_: period)
    monkeypatch.setattr(run_check, "check_events", lambda r, w, *_: told.append(("events", w)) or [])
    monkeypatch.setattr(run_check, "check_clipping", lambda r, n, s, w: told.append(("clipping", w)) or [])
    monkeypatch.setattr(run_check, "_turning", lambda x, v, w: told.append(("turning", w)) or np.zeros(x.size, bool))
    t = np.arange(2000) / 100.0
    run_check.check_record(record(x_in=np.sin(t)))
    assert sorted(told) == [("clipping", window), ("events", window), ("turning", window)]


@pytest.mark.parametrize(("length", "cut"), [(2, 0), (3, 1)])
def test_a_stretch_at_a_limit_has_three_samples(length: int, cut: int) -> None:
    x = np.random.default_rng(4).uniform(-1.0, 1.0, 2000)
    for k in range(100, 1600, 100):
        x[k : k + length] = 1.5
    found = [f for f in sensor.check_clipping(record(F=x), "F", 0.0, 25) if "upper" in f.text]
    assert len(found) == cut
    for f in found:
        assert f"for {15 * length} samples in 15 stretches" in f.text


@pytest.mark.parametrize(("turning", "noisy"), [(0.18, False), (0.22, True)])
def test_a_channel_is_noisy_where_a_fifth_of_the_samples_near_its_limit_turn_back(turning: float, noisy: bool) -> None:
    """A ramp up to the limit, level there and slowly down: only noise makes that clipped. Turns are put in singly."""
    up = np.linspace(-1.0, 1.0, 1000)
    x = np.concatenate([up, np.full(20, 1.0), up[::-1]])
    near = np.flatnonzero((np.abs(x - 1.0) < 0.2 * 2.0) & (x < 1.0))
    wanted = round(turning * near.size)
    for k in near[4::8][: wanted // 2]:  # one sample too low: it turns, and so does the one beside it
        x[k] -= 0.01 if k < 1000 else -0.01
    found = sensor.check_clipping(record(x.size, F=x), "F", 0.0, 25)
    assert any("upper" in f.text for f in found) is noisy


@pytest.mark.parametrize(("window", "lead"), [(3, 3), (15, 3), (16, 4), (40, 10), (43, 10)])
def test_a_stop_is_run_into_over_a_quarter_of_a_window(window: int, lead: int, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[int, float]] = []
    monkeypatch.setattr(sensor, "_runs_into", lambda x, limit, b, e, lead, fast: told.append((lead, fast)) or False)
    x = np.minimum(np.sin(np.arange(2000) / 60.0), 0.8)
    sensor.check_clipping(record(F=x), "F", 0.0, window)
    typical = np.sqrt(np.mean((x[lead:] - x[:-lead]) ** 2))
    assert told == [(lead, pytest.approx(0.35 * typical))]


def zigzag(visits: int, flat: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strokes of 100 samples between -1 and 1, the first ones held at 1 for ten samples; begins and ends of these."""
    parts, begins, ends, at = [], [], [], 0
    for k in range(visits):
        up, down = np.linspace(-1.0, 1.0, 50), np.linspace(1.0, -1.0, 50)
        hold = np.full(10 if k < flat else 0, 1.0)
        if k < flat:
            begins.append(at + 49)
            ends.append(at + 60)
        parts += [up, hold, down]
        at += 100 + hold.size
    return np.concatenate(parts), np.array(begins), np.array(ends)


@pytest.mark.parametrize(
    ("visits", "flat", "into"), [(5, 4, True), (5, 3, False), (2, 2, True), (1, 1, False), (10, 8, True)]
)
def test_most_of_several_visits_are_cut(visits: int, flat: int, into: bool) -> None:
    x, begins, ends = zigzag(visits, flat)
    assert sensor._runs_into(x, 1.0, begins, ends, 5, 0.1) is into


@pytest.mark.parametrize(("fast", "into"), [(0.203, True), (0.205, False)])
def test_a_limit_is_reached_and_left_at_speed(fast: float, into: bool) -> None:
    """Two over 49 samples: five of them are 0.204."""
    x, begins, ends = zigzag(4, 4)
    assert sensor._runs_into(x, 1.0, begins, ends, 5, fast) is into
    late = x.copy()
    for b in begins:
        late[b - 5] = 1.0  # already there
    assert not sensor._runs_into(late, 1.0, begins, ends, 5, fast)
    assert not sensor._runs_into(x[: ends[-1] + 3], 1.0, begins[-2:], ends[-2:] + 200, 5, 0.1)


@pytest.mark.parametrize(("usual", "stuck"), [(1, True), (2, False)])
def test_a_force_is_stuck_by_what_it_usually_repeats(usual: int, stuck: bool) -> None:
    """31 equal samples: more than thirty times one, less than thirty times two."""
    force = np.repeat(np.random.default_rng(3).normal(0.0, 1.0, 4000 // usual), usual)
    force[700:731] = 0.125
    force[[699, 731]] = 7.0
    run = record(force.size, F=force)
    assert bool(sensor.check_stuck(run, "F", sensor.Positions.of(run))) is stuck


@pytest.mark.parametrize(("n", "stuck"), [(6600, True), (6900, False)])
def test_a_force_is_stuck_for_two_hundredths_of_a_hundred_of_the_run(n: int, stuck: bool) -> None:
    """33 samples are half a percent of 6600."""
    force = np.random.default_rng(3).normal(0.0, 1.0, n)
    force[700:733] = 0.125
    run = record(n, F=force)
    assert bool(sensor.check_stuck(run, "F", sensor.Positions.of(run))) is stuck


def test_a_position_that_repeats_is_not_noisy_and_a_coarse_force_neither() -> None:
    """A rest of a position, and of a force that repeats four samples each time, is what they do."""
    x = np.random.default_rng(3).normal(0.0, 1.0, 2000)
    x[500:600] = 0.5
    still = record(x_in=x)
    assert sensor.check_stuck(still, "x_in", sensor.Positions.of(still)) == []
    force = np.repeat(np.random.default_rng(3).normal(0.0, 1.0, 500), 4)
    force[500:700] = 0.5
    coarse = record(F=force)
    assert sensor.check_stuck(coarse, "F", sensor.Positions.of(coarse)) == []


@pytest.mark.parametrize(("window", "reach"), [(21, 11), (22, 11), (41, 20)])
def test_the_level_before_an_event_is_over_half_a_window(window: int, reach: int) -> None:
    """It was 0 until that many samples before, and 1 since: one sample more than half of them decides."""
    for ones, level in ((reach // 2 + 1, 1.0), ((reach - 1) // 2, 0.0)):
        x = np.zeros(200)
        x[100 - ones : 100] = 1.0
        x[100] = 9.0
        excursion = np.where(np.arange(200) == 100, 9.0, 0.0)
        found = _described(x, 100, 100, excursion, np.zeros(200, bool), window)
        assert found == Event("glitch", 100, 100, 9.0 - level)


@pytest.mark.parametrize(("apart", "found"), [(3, []), (4, [400, 404])])
def test_a_spike_is_outside_three_neighbours_on_either_side(apart: int, found: list[int]) -> None:
    for sign in (1.0, -1.0):
        x = np.linspace(0.0, 1.0, 800)
        x[[400, 400 + apart]] += 9.0 * sign
        x[400 + apart] = x[400]
        assert spikes(x).tolist() == found


def test_a_channel_that_rests_has_no_spikes_however_exactly() -> None:
    assert spikes(np.full(800, 2.0)).size == 0
    x = np.zeros(800)
    x[400] = 1.0
    assert spikes(x).tolist() == [400]
