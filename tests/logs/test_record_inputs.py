"""Speed and acceleration from position: closed forms, encoder steps, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.checking import check_record
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.differentiate import default_cutoff, differentiate, sample_period
from tsm_fmu.logs.quantisation import quantisation_step
from tsm_fmu.logs.record import Record, kernel_inputs
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.specification import fit_run

SINES = ((0.41, 0.37, 0.3), (0.083, 1.13, 2.2), (0.019, 2.71, 4.1))


def motion(time):
    x, v, a = (np.zeros_like(time) for _ in range(3))
    for amplitude, frequency, phase in SINES:
        w = 2 * np.pi * frequency
        x += amplitude * np.sin(w * time + phase)
        v += amplitude * w * np.cos(w * time + phase)
        a -= amplitude * w * w * np.sin(w * time + phase)
    return x, v, a


def nrms(error, signal):
    return float(np.sqrt(np.mean(np.square(error)) / np.mean(np.square(signal))))


def test_derivatives_of_sines():
    time = np.arange(7013) * 0.00173
    x, v, a = motion(time)
    inner = slice(200, -200)
    first, second = (differentiate(time, x, order, 25.0) for order in (1, 2))
    assert nrms((first.values - v)[inner], v) < 1e-4
    assert nrms((second.values - a)[inner], a) < 1e-3
    assert first.cutoff == pytest.approx(25.0, rel=0.05)
    assert second.cutoff == pytest.approx(25.0, rel=0.05)


@pytest.mark.parametrize("order", [1, 2])
def test_cutoff_is_where_the_derivative_is_three_decibels_low(order):
    time = np.arange(20001) / 1000.0
    frequency = differentiate(time, np.sin(time), order, 17.0).cutoff
    w = 2 * np.pi * frequency
    values = differentiate(time, np.sin(w * time), order, 17.0).values[2000:-2000]
    gain = np.sqrt(2 * np.mean(values**2)) / w**order
    assert gain == pytest.approx(np.sqrt(0.5), abs=2e-3)


def test_no_phase_shift():
    time = np.arange(8001) / 500.0
    x, v, _ = motion(time)
    derived = differentiate(time, x, 1, 6.0).values[500:-500]
    shifted = [nrms(derived - np.roll(v, k)[500:-500], v) for k in (-2, -1, 0, 1, 2)]
    assert int(np.argmin(shifted)) == 2


def test_encoder_steps_and_noise_are_kept_out_by_the_default_cutoff():
    time = np.arange(10001) / 500.0
    x, v, a = motion(time)
    step = 2 * np.pi / 3177
    read = step * np.round((x + 1e-4 * np.random.default_rng(86).standard_normal(x.size)) / step)
    inner = slice(300, -300)
    assert 2.71 < default_cutoff(time, read) < 40.0
    assert nrms((differentiate(time, read, 1).values - v)[inner], v) < 0.01
    assert nrms((differentiate(time, read, 2).values - a)[inner], a) < 0.12
    plain = np.gradient(read, time)
    assert nrms((plain - v)[inner], v) > 0.15  # what differences would have given


def test_edges_are_finite_and_close():
    time = np.arange(2001) / 500.0
    x, v, _ = motion(time)
    error = np.abs(differentiate(time, x, 1, 20.0).values - v)
    assert error.max() < 0.03 * np.abs(v).max()


def test_cutoff_outside_the_possible_range_is_refused():
    time = np.arange(1001) / 100.0
    with pytest.raises(InputError, match=r"cut-off 45 Hz -- expected 0\.\d+ to 1\d\.\d Hz for 1001 samples at 100 Hz"):
        differentiate(time, np.sin(time), 1, 45.0)
    with pytest.raises(InputError, match=r"cut-off 0\.001 Hz -- expected"):
        differentiate(time, np.sin(time), 1, 0.001)
    with pytest.raises(InputError, match="5 samples -- expected at least 7"):
        differentiate(time[:5], time[:5], 1)


@pytest.mark.parametrize("rate", [150.0, 700.0])
def test_stamps_that_jitter_cost_a_speed_nothing(rate):
    """The same motion at uneven instants, some a tenth of a period apart: no worse than on an even clock."""
    rng = np.random.default_rng(5309)
    even = np.arange(int(8.0 * rate)) / rate
    time = np.sort(even + 0.3 / rate * rng.standard_normal(even.size).clip(-1.4, 1.4))
    x, v, a = motion(time)
    assert np.diff(time).min() < 0.3 / rate
    found, of_even = differentiate(time, x, 1, 20.0), differentiate(even, motion(even)[0], 1, 20.0)
    assert (found.resampled, of_even.resampled, found.bridged, found.gaps) == (True, False, 0, 0)
    inner = slice(100, -100)
    assert nrms((found.values - v)[inner], v) < 1.2 * nrms((of_even.values - motion(even)[1])[inner], v) + 1e-3
    assert nrms((differentiate(time, x, 2, 20.0).values - a)[inner], a) < 0.05
    # as if the stamps were even, the speed is that of other instants
    taken_for_even = differentiate(even, x, 1, 20.0).values
    assert nrms((taken_for_even - v)[inner], v) > 3.0 * nrms((found.values - v)[inner], v)


def test_a_clock_that_jumps_once_is_said_in_the_note():
    time = np.arange(5000) / 1000.0
    time[1201:] += 0.0006
    time[3000] = time[2999] + 0.0002
    x, v, _ = motion(time)
    run = Record("gap", time, {"x": x, "tau_in": x, "tau_load": x}, {"x": "rad", "tau_in": "N.m", "tau_load": "N.m"})
    found, names = kernel_inputs(run, kernel("PairedTsmFriction")), [v.name for v in kernel("PairedTsmFriction").inputs]
    assert nrms((found.values[:, names.index("v")] - v)[300:-300], v) < 0.02
    assert ", from positions interpolated on an even clock, as the samples jitter" in found.notes[0]


def test_what_is_before_and_after_a_long_gap_is_derived_by_itself():
    """With a jump of the position in the gap, which no stretch sees."""
    kept = np.delete(np.arange(6001), np.r_[1200:1260, 4003:4900])
    time = kept / 1000.0
    x, v, a = motion(time)
    moved = x + np.where(kept > 4003, 0.37, 0.0)
    found = differentiate(time, moved, 1, 20.0)
    assert (found.gaps, found.bridged, found.values.shape) == (2, 0, time.shape)
    assert np.abs(found.values - v).max() < 0.03 * np.abs(v).max()
    alone = np.concatenate(
        [differentiate(time[k], x[k], 1, 20.0).values for k in (slice(0, 1200), slice(1200, 3943), slice(3943, None))]
    )
    np.testing.assert_allclose(found.values, alone, atol=1e-9)
    units = {"x": "rad", "tau_in": "N.m", "tau_load": "N.m"}
    record = Record("r", time, {"x": moved, "tau_in": x, "tau_load": x}, units)
    assert (
        kernel_inputs(record, kernel("PairedTsmFriction"))
        .notes[0]
        .endswith(", on each side of 2 longer gaps by itself")
    )
    assert nrms(differentiate(time, moved, 2, 20.0).values[300:900] - a[300:900], a) < 0.02


def test_a_stretch_too_short_to_differentiate_is_refused_by_its_rows():
    time = np.delete(np.arange(3000), np.r_[1200:1260, 1263:1400]) / 1000.0
    with pytest.raises(InputError, match=r"^3 samples in rows 1202 to 1204, beside a gap -- expected at least 7"):
        differentiate(time, np.sin(time), 1, first_row=2)


def test_a_short_stretch_has_the_cutoff_of_the_others_as_far_as_it_can():
    time = np.delete(np.arange(3000), np.r_[1200:1260, 1283:1400]) / 1000.0
    x, v, _ = motion(time)
    assert np.abs(differentiate(time, x, 1).values - v).max() < 0.03 * np.abs(v).max()
    with pytest.raises(InputError, match=r"^cut-off 5 Hz in rows 1200 to 1222, beside a gap -- expected"):
        differentiate(time, x, 1, 5.0)


def test_gaps_of_a_few_rows_are_bridged_and_said():
    rng = np.random.default_rng(20261123)
    keep = np.setdiff1d(
        np.arange(6001), np.concatenate([k + np.arange(n) for k, n in ((700, 1), (2111, 4), (4500, 10))])
    )
    time = keep / 500.0 + rng.uniform(-1e-4, 1e-4, keep.size)
    x, v, _ = motion(time)
    found = differentiate(time, x, 1, 20.0)
    assert found.bridged == 15
    assert found.values.shape == time.shape
    assert nrms((found.values - v)[300:-300], v) < 2e-3
    units = {"x": "rad", "tau_in": "N.m", "tau_load": "N.m"}
    notes = kernel_inputs(
        Record("r", time, {"x": x, "tau_in": x, "tau_load": x}, units), kernel("PairedTsmFriction")
    ).notes
    assert notes[0].endswith(", over gaps of 15 rows in all that the log lacks")
    eleven = np.delete(np.arange(6001), slice(700, 711)) / 500.0
    assert differentiate(eleven, np.sin(eleven), 1, 20.0).gaps == 1


def test_kernel_inputs_derive_what_is_missing_and_say_so():
    time = np.arange(6001) / 500.0
    x, v, a = motion(time)
    units = {"x": "rad", "tau_load": "N.m", "tau_in": "N.m"}
    run = Record("r", time, {"tau_load": 0.2 * x, "x": x, "tau_in": 0.1 * x}, units)
    model = kernel("PairedTsmFriction")
    inputs = kernel_inputs(run, model, 20.0)
    order = [variable.name for variable in model.inputs]
    inner = slice(300, -300)
    assert nrms((inputs.values[:, order.index("v")] - v)[inner], v) < 1e-3
    assert nrms((inputs.values[:, order.index("a")] - a)[inner], a) < 1e-2
    np.testing.assert_array_equal(inputs.values[:, order.index("tau_in")], 0.1 * x)
    np.testing.assert_array_equal(run.inputs_for(model, 20.0), inputs.values)
    assert len(inputs.notes) == 2
    assert inputs.notes[0].startswith("v derived from x by a zero-phase Savitzky-Golay differentiator, cut-off ")
    measured = Record("r", time, {**run.columns, "v": v}, {**units, "v": "rad/s"})
    found = kernel_inputs(measured, model, 20.0)
    np.testing.assert_array_equal(found.values[:, order.index("v")], v)
    assert len(found.notes) == 1
    assert found.notes[0].startswith("a derived from v")


@pytest.mark.parametrize(("column", "order"), [("x", 1), ("x", 2), ("v", 1)])
@pytest.mark.parametrize(("cutoff", "gain"), [(17.0, np.sqrt(0.5)), (110.0, 1.0)])
def test_the_given_cutoff_is_the_one_that_inputs_are_derived_with(column, order, cutoff, gain):
    """At the cut-off the derivative is 3 dB low, far below it it is whole."""
    time = np.arange(20001) / 1000.0
    frequency = differentiate(time, np.sin(time), order, 17.0).cutoff
    w = 2.0 * np.pi * frequency
    given = {column: np.sin(w * time), "tau_in": 0.0 * time, "tau_load": 0.0 * time}
    if column == "v":
        given["x"] = 0.0 * time
    units = {"x": "rad", "v": "rad/s", "tau_in": "N.m", "tau_load": "N.m"}
    run = Record("r", time, given, {name: units[name] for name in given})
    model = kernel("PairedTsmFriction")
    derived = "v" if (column, order) == ("x", 1) else "a"
    values = run.inputs_for(model, cutoff)[2000:-2000, [v.name for v in model.inputs].index(derived)]
    assert np.sqrt(2.0 * np.mean(values**2)) / w**order == pytest.approx(gain, abs=0.01)


@pytest.mark.parametrize(
    ("steps", "found"), [(0.51, True), (0.49, False), (1.49, True), (1.51, False)], ids=lambda v: str(v)
)
def test_a_sample_may_be_half_a_period_off_and_no_more(steps, found):
    time = 3.1 + np.cumsum(np.full(400, 0.0173))
    time[200:] += (steps - 1.0) * 0.0173
    if found:
        assert sample_period(time) == pytest.approx((time[-1] - time[0]) / 399.0, rel=1e-12)
        return
    with pytest.raises(InputError, match=rf"between rows 207 and 208 \(t = {time[199]:g} s\), 1 such in all"):
        sample_period(time, 8)


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_missing_samples_are_told_by_check_and_derived_over_alike(lost):
    time = np.delete(np.arange(3000), slice(1200, 1200 + lost)) / 500.0
    x, v, _ = motion(time)
    torques = {"tau_in": np.cos(time), "tau_load": np.sin(time)}
    run = Record("r", time, {"x": x, **torques}, {"x": "rad", "tau_in": "N.m", "tau_load": "N.m"})
    (gap,) = [f for f in check_record(run).findings if f.kind == "gap"]
    assert gap.rows == (1201, 1202)  # of the file
    assert f"about {lost} samples are missing" in gap.text
    model = kernel("PairedTsmFriction")
    found = kernel_inputs(run, model, 20.0)
    assert f"over gaps of {lost} rows in all that the log lacks" in found.notes[0]
    speeds = found.values[300:-300, [i.name for i in model.inputs].index("v")]
    assert nrms(speeds - v[300:-300], v) < 2e-3
    measured = replace(run, columns=run.columns | {"tau_drive": x}, units=run.units | {"tau_drive": "N.m"})
    assert fit_run(model, measured, ["tau_drive"], 20.0).inputs.tolist() == found.values.tolist()


def test_kernel_inputs_refuse_other_quantities_and_missing_channels():
    time = np.arange(100) / 100.0
    with pytest.raises(InputError, match="has no channel 'x_in' -- it has x_out"):
        Record("r", time, {"x_out": time}, {"x_out": "rad"}).inputs_for(kernel("PairedTsmBacklash"))
    with pytest.raises(InputError, match="channel 'x_in' in m -- expected a unit such as rad"):
        Record("r", time, {"x_in": time}, {"x_in": "m"}).inputs_for(kernel("PairedTsmBacklash"))
    with pytest.raises(
        InputError, match=r"v \[m/s\] from channel 'x' in rad -- expected a unit whose derivative is m/s"
    ):
        Record("r", time, {"x": time}, {"x": "rad"}).inputs_for(kernel("LuGreFriction"))


@pytest.mark.parametrize("step", [2 * np.pi / 8192, 3.7e-5, 11.0])
def test_quantisation_step_survives_rounding_of_the_log(step):
    time = np.arange(4001) / 500.0
    x = 300 * step * np.sin(1.7 * time) + 0.3 * step * np.random.default_rng(9).standard_normal(time.size)
    read = step * np.floor(x / step)
    rounded = np.round(read, int(np.ceil(-np.log10(step))) + 2)
    assert quantisation_step(rounded) == pytest.approx(step, rel=1e-3)
    assert quantisation_step(x) == 0.0
    assert quantisation_step(np.full(50, 0.3)) == 0.0


@pytest.mark.parametrize("step", [0.37, 1.3e-4])
def test_a_spike_between_the_levels_leaves_the_step_of_a_coarse_converter(step):
    force = np.random.default_rng(5).choice([-2.0, -1.0, 1.0], 4000) * step + 0.3 * step
    force[1234] -= 2.51 * step
    assert np.isclose(quantisation_step(force), step, rtol=1e-3)
    force[force < -step] = 1.3 * step  # two levels are no grid
    assert quantisation_step(force) == 0.0


@pytest.mark.parametrize(("spikes", "found"), [(7, 0.37), (53, 0.0)])
def test_more_spikes_than_levels_leave_the_step_unless_they_are_no_exception(spikes, found):
    rng = np.random.default_rng(8)
    force = rng.choice([-2.0, -1.0, 0.0], 4000) * 0.37 + 0.11
    force[rng.choice(4000, spikes, replace=False)] = rng.normal(size=spikes)
    assert quantisation_step(force) == pytest.approx(found, rel=1e-9)


def test_three_levels_are_a_grid_where_they_are_evenly_apart_and_recur():
    drawn = np.random.default_rng(7).integers(0, 3, 500)
    assert quantisation_step(0.13 + 0.71 * drawn) == pytest.approx(0.71, rel=1e-9)
    assert quantisation_step(np.array([0.0, 0.71, 0.73])[drawn]) == 0.0
    assert quantisation_step(np.array([0.0, 0.71, 1.43])[drawn]) == 0.0
    assert quantisation_step(0.13 + 0.71 * np.arange(3)) == 0.0


def test_an_interpolated_encoder_has_no_step_and_is_no_error():
    time = np.arange(4000) * 2e-3
    counts = np.round(np.sin(1.9 * time) / 1.5708e-3) * 1.5708e-3
    for late in np.linspace(1.1e-4, 0.0371, 23):
        shifted = np.interp(time - late, time, counts)
        assert 0.0 <= quantisation_step(shifted) < np.inf
    whole = np.interp(time - 2e-3 * 7, time, counts)  # shifted by whole samples: nothing between the levels
    assert quantisation_step(np.round(whole, 12)) == pytest.approx(1.5708e-3, rel=1e-3)
