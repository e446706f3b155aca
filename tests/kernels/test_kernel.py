"""Kernel: validated parameters, simulation of records, and what bad input is told."""

import contextlib
import math
from types import ModuleType
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import Quantity, flat

BACKLASH = kernel("PairedTsmBacklash")


def test_kernel_of_unknown_name_lists_the_models() -> None:
    with pytest.raises(InputError, match=r"model 'PairedTSM' -- expected one of .*PairedTsmBacklash.* -- see"):
        kernel("PairedTSM")


@pytest.mark.parametrize(
    ("preset", "values", "message"),
    [
        ("publihsed", {}, r"preset 'publihsed' of PairedTsmBacklash -- expected one of published -- see"),
        (None, {"Beta": 1.0}, r"parameter 'Beta' of PairedTsmBacklash -- expected one of c, beta, alpha, x_0, x_h_0"),
        (None, {"alpha": -3.2}, r"parameter alpha = -3\.2 1/rad .* expected a value in \(0, inf.* -- choose"),
        (None, {"alpha": "ten"}, r"parameter alpha = 'ten' -- expected a number \[1/rad\]"),
        (None, {"alpha": None}, r"parameter alpha = None -- expected a number \[1/rad\]"),
        (None, {"alpha": math.nan}, r"parameter alpha = nan -- expected a number"),
        (None, {"c": math.inf}, r"parameter c = inf .* expected a value in"),
        (None, {"beta": -1.7}, r"beta = -1\.7 with c = 1\.00056 gives B = .* -- expected B > 0 .* -- raise beta"),
    ],
)
def test_params_says_what_is_wrong(preset, values, message) -> None:
    with pytest.raises(InputError, match=message) as raised:
        BACKLASH.params(preset, values)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("value", [1.5, "2.5", math.inf, math.nan, 4])
def test_whole_numbers_are_asked_for(value) -> None:
    with pytest.raises(InputError, match=r"parameter kind = .* -- expected (an integer \[1\]|1 \(sines\) or 2)"):
        kernel("ReferenceSignal").params(values={"kind": value})


def test_params_start_from_the_preset_and_are_changed_by_name() -> None:
    p = kernel("ReferenceSignal").params("ame2020", {"speed": 2.5, "kind": 2.0})
    assert (p.kind, p.speed, p.stroke, p.cycles) == (2, 2.5, 62.8, 1.0)
    assert type(p.kind) is int
    default = kernel("ReferenceSignal").params()
    assert default == kernel("ReferenceSignal").params("published")
    assert default.kind == 1


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.NAME)
def test_a_value_given_beside_a_preset_goes_over_it(model) -> None:
    one = Kernel(model)
    for preset, values in one.presets.items():
        whole = one.named(one.params(preset))
        assert {name: whole[name] for name in values.si} == pytest.approx(dict(values.si))
        for v in one.parameters:
            for given in (whole[v.name] * (1.0 + 1e-9), whole[v.name] * (1.0 - 1e-9)) if v.kind is float else ():
                with contextlib.suppress(InputError):  # at a bound, or of a joint condition
                    assert one.named(one.params(preset, {v.name: given})) == whole | {v.name: given}


T = [0.0, 0.1, 0.25]


@pytest.mark.parametrize(
    ("time", "inputs", "message"),
    [
        (T, [0.0, 1.0, 2.0], r"inputs of shape \(3,\) at times of shape \(3,\) .* expected \(3, 1\): .* each of x_in"),
        (T, [[0.0], [1.0]], r"inputs of shape \(2, 1\) at times of shape \(3,\) for PairedTsmBacklash"),
        (T, [[0.0, 0.0]] * 3, r"inputs of shape \(3, 2\) .* expected \(3, 1\)"),
        ([], np.empty((0, 1)), r"inputs of shape \(0, 1\) at times of shape \(0,\)"),
        ([T], [[0.0]] * 3, r"at times of shape \(1, 3\)"),
        (T, [[0.0], [math.nan], [1.0]], r"input x_in = nan in row 1 \(t = 0\.1 s\) -- expected a finite number -- cut"),
        (T, [[0.0], [0.2], [-math.inf]], r"input x_in = -inf in row 2 \(t = 0\.25 s\)"),
        ([0.0, 0.2, 0.1], [[0.0]] * 3, r"time 0\.1 s in row 2 -- expected more than 0\.2 s -- sort or cut the log"),
        ([0.0, 0.2, 0.2], [[0.0]] * 3, r"time 0\.2 s in row 2 -- expected more than 0\.2 s"),
        ([0.0, math.nan, 0.2], [[0.0]] * 3, r"time nan s in row 1 -- expected a finite number -- cut or repair"),
        ([0.0, 0.1, math.inf], [[0.0]] * 3, r"time inf s in row 2 -- expected a finite number"),
        ([math.nan], [[0.0]], r"time nan s in row 0 -- expected a finite number"),
    ],
)
@pytest.mark.parametrize("compiled", [True, False])
def test_simulate_says_what_is_wrong(time, inputs, message, compiled) -> None:
    with pytest.raises(InputError, match=message) as raised:
        BACKLASH.simulate(BACKLASH.params(), time, inputs, compiled=compiled)
    assert "\n" not in str(raised.value)


def test_a_model_without_inputs_takes_no_columns() -> None:
    reference = kernel("ReferenceSignal")
    assert reference.simulate(reference.params(), T, np.empty((3, 0))).shape == (3, 3)
    with pytest.raises(InputError, match=r"expected \(3, 0\): one column for each of no inputs"):
        reference.simulate(reference.params(), T, [[1.0]] * 3)


class Params(NamedTuple):
    limit: Annotated[float, Quantity("m", "largest position")] = 1.0


class State(NamedTuple):
    x: Annotated[float, Quantity("m", "position")]


class Inputs(NamedTuple):
    v: Annotated[float, Quantity("m/s", "speed")]


class Outputs(NamedTuple):
    x: Annotated[float, Quantity("m", "position")]


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(0.0), Outputs(0.0)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    x = advanced(s.x, u.v, dt)
    if x > p.limit:
        raise ValueError("x left its range -- expected at most limit -- raise limit")
    return State(x), Outputs(x)


def advanced(x: float, v: float, dt: float) -> float:
    return x + v * dt


@pytest.fixture
def counter() -> Kernel:
    module = ModuleType("counter")
    module.__dict__.update(
        NAME="Counter", PRESETS={}, Params=Params, State=State, Inputs=Inputs, Outputs=Outputs, start=start, step=step
    )
    return Kernel(module)


@pytest.mark.parametrize("compiled", [True, False])
def test_row_k_plus_1_is_set_before_the_step_to_it(counter, compiled) -> None:
    y = counter.simulate(Params(), [0.0, 0.1, 0.3], [[77.0], [2.0], [-1.0]], compiled=compiled)
    assert y[:, 0].tolist() == [0.0, 0.2, 0.2 + -1.0 * (0.3 - 0.1)]


class Gains(NamedTuple):
    n: Annotated[int, Quantity("1", "gains that count", lo=1, hi=3)] = 2
    g: Annotated[tuple[float, float, float], Quantity("1", "gain")] = (0.7, 0.11, 1.3)
    offset: Annotated[float, Quantity("m", "offset")] = 0.17


class Line(NamedTuple):
    last: Annotated[tuple[float, float], Quantity("m", "positions")]


def gains_start(p: Gains, u: Inputs) -> tuple[Line, Outputs]:
    return Line((0.0, u.v)), Outputs(p.offset)


def gains_step(p: Gains, s: Line, u: Inputs, dt: float) -> tuple[Line, Outputs]:
    total = p.offset
    for i in range(p.n):
        total += p.g[i] * u.v
    return Line((s.last[1], u.v)), Outputs(total + s.last[0] * p.g[2])


@pytest.mark.parametrize("compiled", [True, False])
def test_parameters_and_states_may_be_tuples(counter, compiled) -> None:
    counter.module.__dict__.update(Params=Gains, State=Line, start=gains_start, step=gains_step)
    p = counter.params(values={"g_2": 0.53, "g_3": -0.31, "n": 3})
    assert p == Gains(3, (0.7, 0.53, -0.31), 0.17)
    assert counter.named(p) == {"n": 3, "g_1": 0.7, "g_2": 0.53, "g_3": -0.31, "offset": 0.17}
    y = counter.simulate(p, [0.0, 0.1, 0.3, 0.4], [[0.37], [2.0], [-1.0], [0.9]], compiled=compiled)[:, 0]
    gain = 0.7 + 0.53 - 0.31
    expected = [0.17, 0.17 + 2.0 * gain, 0.17 - gain + 0.37 * -0.31, 0.17 + 0.9 * gain + 2.0 * -0.31]
    np.testing.assert_allclose(y, expected, rtol=1e-14)
    with pytest.raises(InputError, match=r"parameter 'g_4' of Counter -- expected one of n, g_1, g_2, g_3, offset"):
        counter.params(values={"g_4": 1.0})


@pytest.mark.parametrize("compiled", [True, False])
def test_a_condition_lost_while_running_is_one_line(counter, compiled) -> None:
    with pytest.raises(InputError, match=r"^Counter stopped: x left its range -- expected at most limit -- raise"):
        counter.simulate(Params(0.5), np.arange(5.0), np.ones((5, 1)), compiled=compiled)


@pytest.mark.parametrize("model", ["LuGreFriction", "PairedTsmBacklash", "SingleTsmBoucWen"])
def test_of_many_sets_of_values_those_are_allowed_that_params_takes(model: str) -> None:
    """At bounds that belong to their range and at those that do not, beyond, no numbers, and joint conditions."""
    one, rng, values = kernel(model), np.random.default_rng(31), []
    names = [v.name for v in one.parameters if v.kind is float]
    for name in names:
        lo, hi = one.by_name[name].quantity.lo, one.by_name[name].quantity.hi
        for value in (lo, hi, lo - 0.013, hi + 0.013, math.nan, 1.7 * one.by_name[name].start + 0.003):
            values.append({n: one.by_name[n].start * float(rng.uniform(0.3, 3.1)) for n in names} | {name: value})
    expected = []
    for number, some in enumerate(values):
        with contextlib.suppress(InputError):
            expected.append((number, flat(one.params(None, some))))
    table, numbers = one.allowed(values)
    assert numbers == [number for number, _ in expected]
    assert 0 < len(numbers) < len(values)
    assert table.tolist() == [list(map(float, p)) for _, p in expected]
    assert one.allowed([])[1] == []
    with pytest.raises(InputError, match=rf"^parameter 'nu' of {model} -- expected one of "):
        one.allowed([{"nu": 1.0}])
