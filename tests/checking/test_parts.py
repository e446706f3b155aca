"""The steps of a check one by one, on small arrays whose answer is plain."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.checking import coverage, events
from tsm_fmu.checking.criteria import GLITCH_SAMPLES
from tsm_fmu.checking.finding import finding, rows_text, shown
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError

RATE, N = 100.0, 2000
TIME = 3.0 + np.arange(N) / RATE


def record(time: np.ndarray = TIME, units: dict[str, str] | None = None, **columns: np.ndarray) -> Record:
    known = {"x_in": "rad", "x_out": "rad", "x": "m", "v": "m/s", "w": "deg/s", "F": "N", "Theta": "rad"}
    known |= units or {}
    return Record("r", time, columns, {n: known.get(n, "N.m") for n in columns}, first_row=2)


# -- where things stand in a log


@pytest.mark.parametrize(("first", "last", "rows", "words"), [
    (3, 3, (5, 5), "row 5"), (3, 7, (5, 9), "rows 5 to 9"), (1998, 5000, (2000, 2001), "rows 2000 to 2001"),
    (6, 2, (8, 8), "row 8"),
])  # fmt: skip
def test_a_finding_is_between_two_samples_of_the_record(first: int, last: int, rows: tuple, words: str) -> None:
    run = record(x=TIME)
    found = finding(run, "gap", "x", first, last, "text")
    assert (found.kind, found.channel, found.text, found.rows) == ("gap", "x", "text", rows)
    assert (found.t0, found.t1) == (TIME[rows[0] - 2], TIME[rows[1] - 2])
    assert rows_text(run, rows[0] - 2, rows[1] - 2) == words
    assert shown(0.5, "rad/s") == "28.65 deg/s"


# -- motion


def test_the_drive_is_called_so_or_is_the_first_position_that_moves() -> None:
    t, still = TIME, np.zeros(N)
    assert coverage.position_channels(record(F=t, x_out=t, x=t)) == ["x_out", "x"]
    for columns, drive in (
        ({"x_out": t, "x_in": t}, "x_in"), ({"x_out": t, "x_in": still}, "x_out"), ({"x_out": t, "x": t}, "x"),
        ({"F": t}, None), ({"Theta": t, "x_out": t}, "x_out"), ({"Theta": t}, None), ({"x_in": still}, None),
    ):  # fmt: skip
        assert coverage.drive_channel(record(**columns)) == drive


def test_a_speed_is_integrated_from_the_first_row_on() -> None:
    run, name = coverage.with_travel(record(F=TIME, w=np.zeros(N), v=2.0 * (TIME - 3.0)))
    assert name == "integral of v"
    assert run.units[name] == "m"
    assert run.columns[name] == pytest.approx((TIME - 3.0) ** 2, abs=1e-9)
    turned, name = coverage.with_travel(record(w=np.cos(TIME), v=TIME))
    assert (name, turned.units[name]) == ("integral of w", "rad")  # as the log gives it: 1/s goes, the rest is SI
    bare = record(F=TIME, v=np.full(N, 2.0))
    assert coverage.with_travel(bare) == (bare, None)


@pytest.mark.parametrize(("amplitude", "period"), [(0.22, 2.0), (0.24, 0.25), (0.6, 0.25)])
def test_the_shortest_period_leaves_a_twentieth_of_the_power_to_faster_ones(amplitude: float, period: float) -> None:
    """Of sines of 0.5 and 4 Hz the faster has a^2 / (1 + a^2) of the power: a twentieth at a = 0.229."""
    t = np.arange(4000) / RATE
    x = np.sin(2 * np.pi * 0.5 * t) + amplitude * np.sin(2 * np.pi * 4.0 * t + 0.3) + 7.0
    assert coverage.shortest_period(record(t, x=x), "x") == pytest.approx(period, rel=0.06)
    assert coverage.shortest_period(record(t, x=x), None) == pytest.approx(0.5 * 39.99)
    ramp = record(t, x=np.where(t < 20.0, 0.0, 1.0))
    assert coverage.shortest_period(ramp, "x") <= 39.99


@pytest.mark.parametrize(("power_share", "lines"), [(0.027, 1), (0.033, 2)])
def test_a_line_of_the_spectrum_has_three_percent_of_the_strongest(power_share: float, lines: int) -> None:
    t = np.arange(4000) / RATE
    x = np.sin(2 * np.pi * 1.0 * t) + np.sqrt(power_share) * np.sin(2 * np.pi * 3.0 * t) - 5.0
    found = coverage._frequencies(record(t, x=x), "x")
    assert found == pytest.approx([1.0, 3.0][:lines], abs=1e-3)


@pytest.mark.parametrize(("bump", "lines"), [(0.064, 1), (0.066, 2)])
def test_a_line_stands_out_from_the_flank_of_another(bump: float, lines: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By half of the three percent that it must have: from a flank at 0.05 of the strongest."""
    flank = np.array([1e-3, 0.2, 2.0, 0.5, 0.1, 2.0 * bump, 1e-3, 1e-3])
    monkeypatch.setattr(coverage, "_spectrum", lambda *_: (0.5 * np.arange(1.0, 9.0), flank))
    assert len(coverage._frequencies(record(x=TIME), "x")) == lines


def test_at_most_five_frequencies_are_told_the_strongest_first() -> None:
    t = np.arange(4000) / RATE
    sizes = {1.0: 0.5, 2.0: 0.9, 3.5: 0.7, 5.0: 1.0, 7.0: 0.6, 9.0: 0.8}
    x = sum(a * np.sin(2 * np.pi * f * t + f) for f, a in sizes.items())
    found = coverage._frequencies(record(t, x=np.asarray(x)), "x")
    assert found == pytest.approx([5.0, 2.0, 9.0, 3.5, 7.0], abs=2e-3)


def test_a_spectrum_is_that_of_even_samples_without_the_mean() -> None:
    """Of a log with uneven times the same lines: 1.3 Hz."""
    random = np.random.default_rng(3)
    t = np.sort(np.concatenate([[0.0, 20.0], random.uniform(0.0, 20.0, 3000)]))
    frequency, power = coverage._spectrum(record(t, x=4.0 + np.sin(2 * np.pi * 1.3 * t)), "x")
    assert frequency[0] == pytest.approx(1.0 / 20.0, rel=1e-3)
    assert np.diff(frequency) == pytest.approx(frequency[0])
    assert frequency[np.argmax(power)] == pytest.approx(1.3, abs=0.03)
    assert power[0] < 1e-4 * power.max()
    assert frequency.size == power.size == 1501


def test_turns_of_less_than_three_sensor_steps_are_wobble() -> None:
    """A range of 1 and a step of 0.01: the sensor's three steps are more than 2 % of the range."""
    for size, extra in ((0.03, 0), (0.05, 2)):
        x = np.interp(np.arange(401.0), [0, 100, 200, 210, 220, 320, 400], [0, 0.5, 1.0, 1.0 - size, 0.99, 0.5, 0.0])
        x = np.round(x / 0.01) * 0.01
        turns = coverage._turning_points(x)
        assert turns.size == 1 + extra
        assert (np.diff(turns) > 0).all()
    assert coverage._turning_points(np.full(50, 2.0)).size == 0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_spread_of_a_load_is_that_of_its_middle_98_percent_over_its_mean_size(sign: float) -> None:
    load = sign * np.linspace(10.0, 30.0, 1001)
    assert coverage._load_spread(load) == pytest.approx(0.98 * 20.0 / 20.0)
    assert coverage._load_spread(np.zeros(10)) == 0.0
    load[[0, -1]] = [1e6 * sign, -1e6 * sign]
    assert coverage._load_spread(load) < 0.05  # a spike makes the size, not the spread


def test_speed_and_acceleration_are_differentiated_or_plain_differences_of_uneven_rows() -> None:
    x = 0.5 * np.sin(2.0 * TIME)
    v, a, cutoff = coverage.speed_and_acceleration(record(x=x), "x")
    inner = slice(200, -200)
    assert cutoff is not None
    assert v[inner] == pytest.approx(np.cos(2.0 * TIME)[inner], abs=1e-3)
    assert a[inner] == pytest.approx(-2.0 * np.sin(2.0 * TIME)[inner], abs=5e-3)
    assert coverage.speed_and_acceleration(record(x=x), "x", 5.0)[2] == pytest.approx(5.0, rel=0.01)
    uneven = np.array([0.0, 1.0, 1.5, 4.0, 4.25])
    v, a, none = coverage.speed_and_acceleration(record(uneven, x=3.0 * uneven), "x")
    assert none is None
    assert v == pytest.approx([3.0] * 5)
    assert a == pytest.approx([0.0] * 5)
    with pytest.raises(InputError):
        coverage.speed_and_acceleration(record(uneven, x=3.0 * uneven), "x", 1.0)


# -- events


def test_what_is_usual_is_what_three_of_four_blocks_do_not_exceed() -> None:
    residual = np.zeros(400)
    residual[np.arange(2, 400, 20)] = np.arange(20.0)
    blocks = [residual[k : k + 5].max() for k in range(0, 395, 5)]
    assert events._usual(residual, 10) == np.quantile(blocks, 0.75)
    # every second block of ten has one: among forty halves the ones that have are half
    assert events._usual(residual, 40) == np.quantile([residual[k : k + 20].max() for k in range(0, 380, 20)], 0.75)
    assert events._usual(np.arange(50.0), 1) == pytest.approx(np.quantile(np.arange(50.0), 0.75))


@pytest.mark.parametrize(("apart", "spans"), [(10, [(5, 15)]), (11, [(5, 5), (16, 16)])])
def test_runs_that_are_closer_than_half_a_window_are_one(apart: int, spans: list[tuple[int, int]]) -> None:
    outside = np.zeros(60, bool)
    outside[[5, 5 + apart]] = True
    assert events._spans(outside, 20) == spans
    assert events._spans(outside, 21) == spans
    assert events._spans(np.zeros(60, bool), 20) == []
    outside[30:34] = True
    assert events._spans(outside, 20)[-1] == (30, 33)


def described(x: np.ndarray, first: int, last: int, window: int = 21, jump: list[int] | None = None) -> events.Event:
    excursion = np.abs(x - np.median(x))
    jumps = np.zeros(x.size, bool)
    jumps[jump or []] = True
    return events._described(x, first, last, excursion, jumps, window)


def test_an_event_is_as_large_as_it_is_off_the_level_before_it() -> None:
    x = np.full(200, 2.0)
    x[80:83] = [3.0, 5.5, 4.0]
    assert described(x, 80, 82) == events.Event("glitch", 80, 82, 3.5)
    x[83] = 3.5
    assert described(x, 80, 83) == events.Event("disturbance", 80, 83, 3.5)
    x[70:90] = 2.0
    x[75:86] = 2.0 + 10.0 * np.array([0.05, 0.14, 0.16, 0.5, 0.9, 1.0, 0.9, 0.5, 0.16, 0.14, 0.05])
    assert described(x, 75, 85) == events.Event("disturbance", 77, 83, 10.0)  # above 15 % of its height
    start = np.full(200, 2.0)
    start[:4] = [9.0, 8.0, 4.0, 2.1]
    assert described(start, 0, 3) == events.Event("disturbance", 0, 3, pytest.approx(6.9))  # no level before it
    assert GLITCH_SAMPLES == 3


@pytest.mark.parametrize(("kept", "kind"), [(0.53, "jump"), (0.5, "disturbance"), (-0.3, "disturbance"), (1.0, "jump")])
def test_a_jump_keeps_half_of_its_step(kept: float, kind: str) -> None:
    """Up by 4 on a slope of 0.1 a sample, and after five samples back but for a part."""
    x = 0.1 * np.arange(200.0)
    x[100:] += 4.0
    x[105:] -= 4.0 * (1.0 - kept)
    found = events._described(x, 100, 105, np.where(np.arange(200) // 5 == 20, 4.0, 0.0), _at(200, [100, 105]), 21)
    assert found.kind == kind
    if kind == "jump":
        assert (found.first, found.last, found.size) == (100, 105, pytest.approx(4.0 * kept))


def _at(n: int, where: list[int]) -> np.ndarray:
    flags = np.zeros(n, bool)
    flags[where] = True
    return flags


def test_a_jump_at_either_end_of_a_run_is_none() -> None:
    """There is no level before, or after, to tell it by."""
    x = np.full(60, 1.0)
    x[:2] = 5.0
    assert events._described(x, 0, 2, np.abs(x - 1.0), _at(60, [2]), 21).kind == "glitch"
    x = np.full(60, 1.0)
    x[-2:] = 5.0
    assert events._described(x, 58, 59, np.abs(x - 1.0), _at(60, [58]), 21).kind == "glitch"


def test_of_one_channel_in_several_events_the_largest_size_is_told() -> None:
    run = record(x_in=TIME, F=TIME)
    group = [("F", events.Event("glitch", 500, 500, 2.0)), ("x_in", events.Event("jump", 502, 502, 0.5)),
             ("F", events.Event("glitch", 505, 505, 3.0))]  # fmt: skip
    found = events._finding(run, group, 51, ["x_in"])
    assert (found.kind, found.channel, found.rows) == ("jump", "F, x_in", (502, 507))
    assert found.text.startswith("F by 3 N and x_in by 28.65 deg from 8.000 to 8.050 s and stays there: a jump, as of ")
    assert "something that slips or lets go" in found.text
    for first, kind in ((50, "start_up"), (51, "glitch")):
        one = events._finding(run, [("F", events.Event("glitch", first, first, 2.0))], 51, [])
        assert one.kind == kind
        assert one.rows[0] == (2 if kind == "start_up" else first + 2)
