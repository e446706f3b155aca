"""Each finding of a check at its limit: just inside and just outside, with its rows, its numbers and its sentence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.checking.clock import check_clock
from tsm_fmu.checking.coverage import MotionCoverage, _between, _missing, motion_of
from tsm_fmu.checking.events import check_events, events
from tsm_fmu.checking.power import _directions
from tsm_fmu.checking.sensor import Positions, check_clipping, check_stuck
from tsm_fmu.checking.spikes import spikes
from tsm_fmu.logs.record import Record

UNITS = {"x_in": "rad", "x_out": "rad", "tau_in": "N.m", "tau_out": "N.m", "F": "N", "s": "m", "v": "rad/s"}


def record(time: np.ndarray, **columns: np.ndarray) -> Record:
    return Record("r", time, columns, {n: UNITS[n] for n in columns}, first_row=2)


def test_gaps_are_counted_listed_and_left_out_of_the_jitter() -> None:
    """Seven gaps of 1.51 to 9 intervals and one of 1.49, which is none; the rest is even."""
    longer = {11: 1.51, 20: 3.0, 31: 4.2, 44: 2.0, 58: 9.0, 63: 2.6, 77: 5.3, 90: 1.49}
    steps = np.array([0.02 * longer.get(k, 1.0) for k in range(100)])
    time = np.concatenate([[3.1], 3.1 + np.cumsum(steps)])
    clock, found = check_clock(record(time, s=time))
    assert clock.rate == pytest.approx(50.0)
    assert clock.gaps == 7
    assert clock.jitter == pytest.approx(0.49 * 0.02 / np.sqrt(93), rel=1e-6)
    *listed, rest, jitter = found
    assert [f.rows for f in listed] == [(k + 2, k + 3) for k in (11, 20, 31, 44, 58)]
    assert [f.t1 - f.t0 for f in listed] == pytest.approx([0.02 * longer[k] for k in (11, 20, 31, 44, 58)])
    for f, missing in zip(listed, (1, 2, 3, 1, 8), strict=True):
        assert f.text.startswith(
            f"gap of {f.t1 - f.t0:.4g} s at {f.t0:.3f} s, between rows {f.rows[0]} and {f.rows[1]}"
        )
        assert f"about {missing} samples are missing" in f.text
    assert rest.rows == (65, 80)
    assert rest.text == "2 more gaps after row 65, the longest 0.106 s"
    assert jitter.kind == "jitter"
    assert (jitter.rows, clock.jitter / 0.02 > 0.05) == ((2, 102), True)


@pytest.mark.parametrize(("share", "said"), [(0.0495, False), (0.0505, True)])
def test_jitter_is_said_from_a_twentieth_of_the_interval_on(share: float, said: bool) -> None:
    steps = 0.004 * (1.0 + share * np.tile([1.0, -1.0, 0.0], 80) * np.sqrt(1.5))
    time = np.concatenate([[0.0], np.cumsum(steps)])
    clock, found = check_clock(record(time, s=time))
    assert clock.jitter == pytest.approx(0.004 * share, rel=1e-6)
    assert len(found) == said
    if said:
        assert found[0].text == f"sampling jitters by {clock.jitter:.3g} s RMS around 0.004 s (5 %)"
    assert check_clock(record(np.array([0.0, 0.5]), s=np.zeros(2)))[0].rate == 2.0


MOTION = MotionCoverage(
    "x_in", "rad", (-1.0, 1.0), (-2.0, 2.0), (-9.0, 9.0), 9, (0.2, 0.5, 1.0), (0.3, 1.1), 2.5, 0.0, 9.0
)
LOAD = np.linspace(1.0, 3.0, 50)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"reversals": 3}, ""),
        ({"reversals": 2}, "2 reversals: a loop is not repeated; drive at least two whole periods"),
        ({"reversals": 2, "amplitudes": (1.0, 1.0, 1.0)}, "2 reversals: a loop is not repeated"),
        ({"frequencies": (0.4567,)}, "one frequency only (0.457 Hz): rate dependence, delay and inertia"),
        ({"frequencies": ()}, ""),
        ({"amplitudes": (0.79, 0.9, 1.0)}, ""),
        ({"amplitudes": (0.81, 0.9, 1.0)}, "all half strokes are near 51.57 deg: no inner loops"),
        ({"dwell": 2.0}, ""),
        ({"dwell": 1.994}, "no rest longer than 2 s: creep and breakaway"),
        ({"dwell": 0.123}, "no rest longer than 0.12 s: creep and breakaway"),
    ],
)
def test_what_a_motion_leaves_out_is_said_at_its_limit(changed: dict, said: str) -> None:
    run = record(0.1 * np.arange(50.0), x_in=LOAD, tau_out=LOAD)
    texts = [f.text for f in _missing(run, replace(MOTION, **changed))]
    assert len(texts) == bool(said)
    assert all(text.startswith(said) for text in texts)
    for f in _missing(run, replace(MOTION, reversals=0)):
        assert (f.kind, f.channel, f.rows) == ("coverage", "x_in", (2, 51))


def test_a_load_is_judged_by_its_spread_about_its_size_and_the_one_outside_first() -> None:
    """The 1 and 99 % quantiles against the mean size: a straight line from 1 to b spreads over 0.98 (b - 1)."""
    t = 0.1 * np.arange(1001.0)
    for share, said in ((0.495, True), (0.505, False)):
        b = (0.98 + 0.5 * share) / (0.98 - 0.5 * share)
        for sign in (1.0, -1.0):
            load = sign * np.linspace(1.0, b, 1001)
            texts = [f.text for f in _missing(record(t, x_in=t, tau_in=np.sin(t), tau_out=load), MOTION)]
            percent = f"{100 * share:.0f}"
            assert texts == ([f"tau_out varies by {percent} % of its size: load dependence is not seen; add a run with "
                              "another load"] if said else [])  # fmt: skip
    assert not _missing(record(t, x_in=t, tau_in=np.sin(t)), MOTION)
    (none,) = _missing(record(t, x_in=t), MOTION)
    assert none.text == "no force or torque in the log: friction and load dependence cannot be judged"
    (still,) = _missing(record(t, x_in=t, F=np.zeros(1001)), MOTION)
    assert still.text.startswith("F varies by 0 % of its size")


@pytest.mark.parametrize("rest_first", [0, 37])
def test_rests_are_told_apart_and_ranges_are_those_of_the_signals(rest_first: int) -> None:
    """Speed given: it rests below 2 % of what it reaches, at the start (or not), then for 60 and for 25 samples."""
    speed = np.full(400, 1.0)
    speed[:rest_first] = 0.0
    speed[100:160] = 0.019
    speed[250:275] = -0.0199
    speed[300:360] = 0.021  # slow, and no rest
    speed[200:210] = -3.0
    t = 0.05 * np.arange(400.0) + 7.0
    x = np.cumsum(speed) * 0.05
    motion, _ = motion_of(record(t, x_in=x), "x_in", (speed / 3.0 * 1.0, 2.0 * speed - 1.0, 4.5))
    top = float(np.quantile(np.abs(speed / 3.0), 0.99))
    assert top == pytest.approx(1.0)
    rests = np.abs(speed / 3.0) < 0.02
    runs = np.flatnonzero(np.diff(rests.astype(int), prepend=0, append=0)).reshape(-1, 2)
    seconds = [0.05 * (b - a - 1) for a, b in runs]
    assert motion.initial_rest == pytest.approx(seconds[0] if rest_first else 0.0)
    assert motion.dwell == pytest.approx(max(seconds[1:] if rest_first else seconds))
    assert motion.v == (speed.min() / 3.0, speed.max() / 3.0)
    assert motion.a == (2.0 * speed.min() - 1.0, 2.0 * speed.max() - 1.0)
    assert motion.x == (x.min(), x.max())
    assert (motion.channel, motion.unit, motion.cutoff) == ("x_in", "rad", 4.5)


def test_a_motion_without_rest_or_with_one_only_at_its_start_has_no_dwell() -> None:
    t = 0.05 * np.arange(100.0)
    for still in (0, 30):
        v = np.where(np.arange(100) < still, 0.0, 1.0)
        motion, _ = motion_of(record(t, x_in=np.cumsum(v)), "x_in", (v, v, None))
        assert motion.dwell == 0.0
        assert motion.initial_rest == pytest.approx(0.05 * max(0, still - 1))
        assert motion.reversals == 0
        assert motion.amplitudes == (0.5 * np.ptp(np.cumsum(v)),) * 3


def test_turns_and_half_strokes_of_a_zigzag_are_counted_without_its_wobble() -> None:
    """Corners at given places; one of 1.9 % of the range is wobble, one of 2.1 % a turn."""
    for small, extra in ((0.0379, 0), (0.0421, 2)):
        corners = [0.0, 1.0, -1.0, 0.5, 0.5 - small, 0.7, -0.2, 0.1]
        x = np.interp(np.arange(701.0), 100.0 * np.arange(8), corners)
        motion, _ = motion_of(record(0.01 * np.arange(701.0), x_in=x), "x_in", (np.gradient(x), np.gradient(x), None))
        assert motion.reversals == 4 + extra
        turns = [1.0, -1.0, *([0.5, 0.5 - small] if extra else []), 0.7, -0.2]
        half = 0.5 * np.abs(np.diff(turns))
        assert motion.amplitudes == pytest.approx((half.min(), np.median(half), half.max()))


def rough(h: float, n: int = 800) -> np.ndarray:
    """A slow ramp over 20 with a bump of one sample in every tenth: what is usual."""
    x = np.linspace(0.0, 20.0, n)
    x[5::10] += h
    return x


@pytest.mark.parametrize("factor", [1.0, -1e-4, 3e3])
@pytest.mark.parametrize(("times", "found"), [(4.0, []), (5.9, [400])])
def test_a_spike_is_five_times_what_recurs_in_any_unit(factor: float, times: float, found: list[int]) -> None:
    x = rough(0.5)
    x[400] += times * 0.5
    assert spikes(factor * x).tolist() == found


@pytest.mark.parametrize(("share", "found"), [(0.047, 0), (0.054, 1)])
def test_a_spike_is_a_twentieth_of_the_range(share: float, found: int) -> None:
    x = np.linspace(0.0, 1.0, 800)
    x[300] += share * 0.98
    assert spikes(x).size == found


def test_spikes_need_eight_parts_of_seven_samples_and_neighbours_on_both_sides() -> None:
    for n, found in ((55, 0), (56, 1)):
        x = np.linspace(0.0, 1.0, n)
        x[30] = 9.0
        assert spikes(x).size == found
    for at, found in ((2, 0), (3, 1), (796, 1), (797, 0)):
        x = np.linspace(0.0, 1.0, 800)
        x[at] = 9.0
        assert spikes(x).size == found, at


@pytest.mark.parametrize(("pair", "limit"), [(("x_in", "x_out"), -0.5), (("tau_in", "tau_out"), -0.7)])
def test_opposite_senses_are_told_by_their_correlation_over_all_rows(pair: tuple[str, str], limit: float) -> None:
    t = np.arange(600.0)
    p, other = np.sin(2 * np.pi * t / 100), np.cos(2 * np.pi * t / 100)
    for r in (limit + 0.006, limit - 0.006, -1.0, 0.9):
        q = 3.0 + 2.7 * (r * p + np.sqrt(1.0 - r**2) * other)
        found = _directions(record(0.01 * t, **{pair[0]: p, pair[1]: q}))
        assert len(found) == (r < limit)
        for f in found:
            assert (f.kind, f.channel, f.rows) == ("direction", ", ".join(pair), (2, 601))
            assert f.text == (
                f"{pair[1]} falls when {pair[0]} grows (correlation {r:.2f}): opposite senses; try --scale {pair[1]}=-1"
            )
    assert not _directions(record(0.01 * t, **{pair[0]: p, pair[1]: np.full(600, 2.0)}))
    assert not _directions(record(0.01 * t, **{pair[0]: np.full(600, 2.0), pair[1]: p}))
    assert not _directions(record(0.01 * t, **{pair[1]: p}))


def busy(at: int, samples: int, size: float) -> np.ndarray:
    """A slow motion with noise and an excursion."""
    x = np.sin(2 * np.pi * np.arange(2000.0) / 1000) + np.random.default_rng(4).normal(0.0, 0.002, 2000)
    x[at : at + samples] += size
    return x


@pytest.mark.parametrize(
    ("at", "samples", "kind", "rows"),
    [(900, 1, "glitch", (902, 902)), (900, 2, "glitch", (902, 903)), (900, 3, "glitch", (902, 904)),
     (900, 4, "disturbance", (902, 905)),
     (20, 2, "start_up", (2, 23)), (900, 1100, "jump", (902, 902))],
)  # fmt: skip
@pytest.mark.parametrize("channel", ["x_out", "F"])
def test_an_event_is_told_by_its_length_place_and_what_follows(at, samples, kind, rows, channel) -> None:
    run = record(0.004 * np.arange(2000.0), **{channel: busy(at, samples, 0.8)})
    (found,) = check_events(run, 51, ["x_out"], np.zeros(2000, bool))
    assert (found.kind, found.channel, found.rows) == (kind, channel, rows)
    place = f"at {run.time[rows[0] - 2]:.3f} s"
    through = f"from {run.time[rows[0] - 2]:.3f} to {run.time[rows[1] - 2]:.3f} s"
    count = rows[1] - rows[0] + 1
    where = "row 902" if count == 1 else f"rows {rows[0]} to {rows[1]}" if kind != "start_up" else "rows 22 to 23"
    assert found.text.endswith(f" ({where})")
    if kind == "glitch":
        assert f"{place}, for {count} samples only: a glitch" in found.text
    if kind == "disturbance":
        assert f" {through} away from the motion around it" in found.text
    if kind == "start_up":
        assert found.text.startswith(f"start-up transient until {run.time[21]:.3f} s: {channel} by ")
    if kind == "jump":
        cause = "lost counts or a slipped coupling" if channel == "x_out" else "something that slips or lets go"
        assert found.text.split(" (row")[0].endswith(f" {place} and stays there: a jump, as of {cause}")
    long = record(0.004 * np.arange(2000.0), **{channel: busy(900, 9, 0.8)})
    (wide,) = check_events(long, 51, ["x_out"], np.zeros(2000, bool))
    assert f"from {long.time[900]:.3f} to {long.time[908]:.3f} s away" in wide.text


def test_events_of_several_channels_at_once_are_one_and_a_turn_excuses_a_force() -> None:
    t = 0.004 * np.arange(2000.0)
    run = record(t, x_out=busy(900, 2, 0.8), F=busy(915, 2, -0.7), tau_out=busy(1400, 1, 0.9))
    nowhere = np.zeros(2000, bool)
    first, second = check_events(run, 51, ["x_out"], nowhere)
    assert (first.channel, second.channel) == ("x_out, F", "tau_out")
    assert first.rows == (902, 918)
    turning = nowhere.copy()
    turning[1350:1450] = True
    assert [f.channel for f in check_events(run, 51, ["x_out"], turning)] == ["x_out, F"]
    assert [f.channel for f in check_events(run, 51, ["x_out", "tau_out"], turning)] == ["x_out, F", "tau_out"]


@pytest.mark.parametrize(("share", "stuck"), [(0.29, False), (0.31, True)])
def test_a_channel_is_stuck_while_another_position_moves_over_three_tenths_of_its_range(share, stuck) -> None:
    x = np.linspace(0.0, 2.0, 1001)
    still = np.sin(np.arange(1001.0))
    n = round(share * 1000)
    still[100 : 101 + n] = 0.4321
    run = record(0.01 * np.arange(1001.0), x_in=x, x_out=still)
    found = check_stuck(run, "x_out", Positions.of(run))
    assert len(found) == stuck
    if stuck:
        assert found[0].rows == (102, 102 + n)
        assert found[0].text == (
            f"x_out repeats 24.76 deg exactly from 1.000 to {1.0 + 0.01 * n:.3f} s while another position moves over "
            f"31 % of its range (rows 102 to {102 + n}): stuck sensor or lost link"
        )


def test_a_drive_that_rests_is_not_stuck_for_a_spike_of_another_position() -> None:
    t = 0.01 * np.arange(2001.0)
    moving = np.clip(t - 8.0, 0.0, None)
    x = 0.4 * np.sin(2.0 * moving) * (t > 8.0) + 0.2 * np.sin(2.0 * np.minimum(t, np.pi))
    y = 0.9 * x + 1e-4 * np.random.default_rng(4).normal(size=t.size)
    y[[571, 702]] += (1.7, -1.6)
    run = record(t, x_in=x, x_out=y)
    assert check_stuck(run, "x_in", Positions.of(run)) == []


@pytest.mark.parametrize(("repeats", "stuck"), [(29, False), (32, True)])
def test_a_noisy_force_is_stuck_where_it_repeats_thirty_times_longer_than_ever(repeats: int, stuck: bool) -> None:
    force = np.random.default_rng(3).normal(0.0, 1.0, 4000)
    force[700 : 700 + repeats] = 0.125
    run = record(0.001 * np.arange(4000.0), F=force)
    found = check_stuck(run, "F", Positions.of(run))
    assert len(found) == stuck
    if stuck:
        assert found[0].rows == (702, 701 + repeats)
        assert "while another" not in found[0].text


@pytest.mark.parametrize(("moved", "value", "found"), [(0.0, 0.0, 0), (0.0, 0.02, 1), (0.1, 0.0, 1)])
def test_a_speed_of_zero_where_the_positions_stand_is_a_rest(moved: float, value: float, found: int) -> None:
    """Derived of an encoder it is exactly zero there; another value, or zero while a position moves, is a lost link."""
    rng = np.random.default_rng(5)
    v = np.sin(0.01 * np.arange(4000.0)) + 0.01 * rng.normal(size=4000)
    v[1000:2000] = 0.0
    x = 0.001 * np.cumsum(v) + np.where(np.arange(4000) < 1500, 0.0, moved)
    v[1000:2000] = value
    run = record(0.001 * np.arange(4000.0), x_in=x, v=v)
    assert len(check_stuck(run, "v", Positions.of(run))) == found


def test_the_top_of_a_line_lies_between_its_neighbours_as_a_gaussian_through_three_says() -> None:
    frequency = 0.25 * np.arange(1, 9)
    for shift in (-0.4, 0.0, 0.3):
        power = 3.0 * np.exp(-((frequency - 1.0 - 0.25 * shift) ** 2) / 0.1)
        assert _between(frequency, power, 3) == pytest.approx(1.0 + 0.25 * shift)
        for k in (1, 6):  # the second and the last but one have neighbours too
            assert _between(frequency, power, k) == pytest.approx(1.0 + 0.25 * shift)
        assert _between(frequency, power, 0) == frequency[0]
        assert _between(frequency, power, 7) == frequency[7]
    for silent in (2, 4):
        power = np.exp(-((frequency - 1.1) ** 2))
        power[silent] = 0.0
        assert _between(frequency, power, 3) == frequency[3]


@pytest.mark.parametrize(("n", "found"), [(8 * 11 - 1, 0), (8 * 11, 1)])
def test_events_need_eight_windows_and_a_signal_that_moves(n: int, found: int) -> None:
    x = np.random.default_rng(2).normal(0.0, 0.01, n)
    x[50] = 3.0
    assert len(events(x, 5)) == found  # a window is eleven samples at least
    assert events(np.full(n, 1.7), 5) == []


@pytest.mark.parametrize(("visits", "found"), [(5, 1), (7, 0)])
def test_a_stop_cuts_four_of_five_visits(visits: int, found: int) -> None:
    """Strokes at full speed; five run flat into the limit, the others turn just below it."""
    parts = []
    for k in range(visits):
        top = 0.8 if k < 5 else 0.79
        up = np.minimum(np.interp(np.arange(100.0), [0, 50, 100], [-1.0, 1.0, -1.0]), top if k < 5 else 9.9)
        parts.append(up if k < 5 else 0.5 * (top + 1.0) * (up + 1.0) - 1.0)
    run = record(0.01 * np.arange(100.0 * visits), x_in=np.concatenate(parts))
    clipped = [f for f in check_clipping(run, "x_in", 0.0, 25) if "upper" in f.text]
    assert len(clipped) == found
    for f in clipped:
        stretches = f.text.split(" in ")[1]
        assert stretches == "5 stretches: clipped or against a stop"


def _moves(peaks: list[int], samples: int = 8) -> np.ndarray:
    """A slow motion with quick moves of one width, there and back, of which the last is ``peaks[-1]``."""
    x = np.sin(2 * np.pi * np.arange(4000.0) / 2000) + np.random.default_rng(7).normal(0.0, 0.002, 4000)
    for at in peaks:
        x[at : at + samples] += 0.83 * np.sin(np.linspace(0.0, np.pi, samples)) ** 2
    return x


@pytest.mark.parametrize(("also", "found"), [([], 1), ([2200], 2), ([2200, 3010], 3), ([1210, 2200, 3010], 0)])
def test_what_a_drive_does_no_faster_in_three_other_places_is_a_move(also: list[int], found: int) -> None:
    x, nowhere = _moves([*also, 700]), np.zeros(4000, bool)
    run = record(0.004 * np.arange(4000.0), x_in=x, x_out=0.9 * x)
    events = check_events(run, 51, ["x_in", "x_out"], nowhere, ["x_in"])
    assert [f.kind for f in events] == ["disturbance"] * found
    assert {f.channel for f in events} <= {"x_in, x_out"}
    assert len(check_events(run, 51, ["x_in", "x_out"], nowhere)) == len(also) + 1  # of a channel that drives nothing


@pytest.mark.parametrize(("ratio", "moves"), [(1.4, True), (1.6, False)])
def test_a_knock_is_half_as_fast_again_as_the_moves_of_a_drive(ratio: float, moves: bool) -> None:
    x = _moves([1210, 2200, 3010, 3500])
    x[700:708] += ratio * 0.83 * np.sin(np.linspace(0.0, np.pi, 8)) ** 2
    run = record(0.004 * np.arange(4000.0), x_in=x)
    found = check_events(run, 51, ["x_in"], np.zeros(4000, bool), ["x_in"])
    assert [f.rows[0] // 100 for f in found] == ([] if moves else [7])


def test_lost_counts_of_a_drive_are_none_of_its_moves_however_often() -> None:
    x, nowhere = _moves([]), np.zeros(4000, bool)
    for at in (500, 1210, 2200, 3010, 3500):
        x[at:] += 0.31
    run = record(0.004 * np.arange(4000.0), x_in=x)
    assert [f.kind for f in check_events(run, 51, ["x_in"], nowhere, ["x_in"])] == ["jump"] * 5


def test_spikes_during_a_move_of_the_drive_stay_spikes() -> None:
    x = _moves([700, 1210, 2200, 3010])
    y = 0.9 * x
    y[703] += 4.0
    run = record(0.004 * np.arange(4000.0), x_in=x, F=np.sin(0.01 * np.arange(4000.0)), x_out=y)
    found = check_events(run, 51, ["x_in", "x_out"], np.zeros(4000, bool), ["x_in"])
    assert [(f.kind, f.channel) for f in found] == [("glitch", "x_out")]
