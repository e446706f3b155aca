"""Linearisation without FMUs: what is asked of a simulation, what is made of its responses, margins in closed form."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import control
import numpy as np
import pytest

from tsm_fmu.cosim import linearize
from tsm_fmu.cosim.linearize import Linear, margins, named, realised
from tsm_fmu.cosim.system import Component, Experiment, Link
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.models.contract import InputError

H = 0.02


def port(name: str, causality: str, unit: str, kind: str = "Real") -> Any:
    return SimpleNamespace(name=name, causality=causality, unit=unit, kind=kind)


def wiring(*links: Link, free: float = 0.75) -> Any:
    """A plant with inputs u, w and outputs x, v, and a gain from u to y."""
    plant = [port("u", "input", "N"), port("w", "input", ""), port("x", "output", "m"), port("v", "output", ""),
             port("n", "output", "", "Integer")]  # fmt: skip
    gain = [port("u", "input", "m"), port("y", "output", "N")]
    descriptions = {
        name: SimpleNamespace(
            ports={p.name: p for p in ports}, inputs=[p for p in ports if p.causality == "input"],
            outputs=[p for p in ports if p.causality == "output"],
        )
        for name, ports in (("p", plant), ("g", gain))
    }  # fmt: skip
    components = (Component("p", Any, {"u": free, "w": "0.25"}), Component("g", Any, {}))  # pyright: ignore
    return SimpleNamespace(links=links, descriptions=descriptions, system=SimpleNamespace(components=components))


LOOP = (Link(("p", "x"), ("g", "u"), "Real", 1.0, 0.0), Link(("g", "y"), ("p", "u"), "Real", -2.0, 0.5))


class Plant:
    """X' = a x + b u + 0.5 w, held over steps, with u = -2 y + 0.5, y = 3 x a step late; notes what it is given."""

    def __init__(self, a: float = -1.5, b: float = 4.0, bend: float = 0.0, free: bool = False) -> None:
        self.a, self.b, self.bend, self.free = a, b, bend, free
        self.given: list[list[Any]] = []
        self.options: list[dict[str, Any]] = []

    def __call__(self, system: Any, stop: float, step: float, **options: Any) -> Trajectory:
        self.given.append(list(options.pop("stimuli")))
        self.options.append({"stop": stop, "step": step, **options})
        steps = round((stop - options["start"]) / step)
        of = {(s.component, s.variable): s for s in self.given[-1]}
        x, columns = 0.3, {"p.x": [0.3], "p.v": [0.6], "g.y": [0.9]}
        for k in range(steps):
            u = 0.75 if self.free else -2.0 * columns["g.y"][-1] + 0.5
            s = of.get(("p", "u"))
            if s is not None:
                u = s.values[k] + (u if s.add else 0.0)
            w = of[("p", "w")].values[k] if ("p", "w") in of else 0.25
            x = x + step * (self.a * x + self.b * u + self.bend * u * u + 0.5 * w)
            for name, value in (("p.x", x), ("p.v", 2.0 * x), ("g.y", 3.0 * x)):
                columns[name].append(value)
        time = options["start"] + step * np.arange(steps + 1)
        return Trajectory(time, {n: np.array(v) for n, v in columns.items()}, dict.fromkeys(columns, "1"))


def found(
    monkeypatch: pytest.MonkeyPatch, plant: Plant, sources: Any, outputs: Any, opened: bool, links: Any = LOOP,
    start: float = 1.0, at: float = 1.2, delayed: tuple[Link, ...] = (LOOP[1],), **options: Any
) -> Linear:  # fmt: skip
    monkeypatch.setattr(linearize, "check_system", lambda _: wiring(*links))
    monkeypatch.setattr(linearize, "schedule", lambda *_: SimpleNamespace(delayed=delayed))
    case: Any = ("system", Experiment(9.0, H, start=start, loops="delay"))
    return linearize.linearize(case, sources, outputs, at, opened=opened, simulate=plant, **{"horizon": 1.0, **options})


def test_an_open_loop_gets_what_the_closed_one_gave_and_an_impulse_on_top(monkeypatch: pytest.MonkeyPatch) -> None:
    """With u cut, x is b h / (z - 1 - a h) of it; the working point is that of the closed loop."""
    plant = Plant()
    linear = found(monkeypatch, plant, "p.u", "g.y", True)
    base, up, down = plant.given
    assert base == []
    closed = plant.__class__()("s", 2.2, H, start=1.0, stimuli=[]).columns["g.y"]
    handed = -2.0 * closed[:-1] + 0.5
    size = 1e-7 * np.abs(handed).max()
    for (stimulus,), sign in ((up, 1.0), (down, -1.0)):
        assert (stimulus.component, stimulus.variable, stimulus.add) == ("p", "u", False)
        moved = stimulus.values - handed
        assert moved[10] == pytest.approx(sign * size, rel=1e-6)
        assert np.abs(np.delete(moved, 10)).max() == 0.0
    assert all(o["record"] == ["g.y"] and o["compiled"] is True and o["loops"] == "delay" for o in plant.options)
    assert all(o["stop"] == pytest.approx(2.2) and o["start"] == 1.0 for o in plant.options)
    expected = -3.0 * 4.0 * H * (1.0 - 1.5 * H) ** np.arange(-1, 49)
    expected[0] = 0.0
    assert linear.response[0, 0] == pytest.approx(expected, rel=1e-5, abs=1e-8)
    assert (linear.opened, linear.at, linear.step, linear.single) == (True, 1.2, pytest.approx(H), True)
    assert linear.units == (("(N)/(N)",),)
    assert linear.returns == (-2.0,)
    assert linear.asymmetry < 1e-6
    z = np.exp(1j * 5.0 * H)
    assert linear.frequency_response(np.array([5.0])) == pytest.approx([-3.0 * 4.0 * H / (z - 1.0 + 1.5 * H)], rel=1e-4)


def test_a_closed_loop_gets_an_impulse_added(monkeypatch: pytest.MonkeyPatch) -> None:
    """A late return makes it x(k+1) = (1 + a h) x(k) - 6 b h x(k) + b h d(k)."""
    plant = Plant()
    linear = found(monkeypatch, plant, "p.u", "p.x", False, amplitude=0.125)
    assert [len(g) for g in plant.given] == [0, 1, 1]
    (stimulus,) = plant.given[1]
    assert stimulus.add
    assert stimulus.values[10] == 0.125
    assert np.count_nonzero(stimulus.values) == 1
    ratio = 1.0 - 1.5 * H - 24.0 * H
    expected = 4.0 * H * np.concatenate(([0.0], ratio ** np.arange(49)))
    assert linear.response[0, 0] == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert (linear.opened, linear.returns) == (False, ())
    assert linear.units == (("(m)/(N)",),)
    assert np.real(linear.model.poles()) == pytest.approx(ratio)


def test_inputs_that_nothing_drives_get_their_start_value_and_several_ports_a_matrix(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant = Plant(free=True)
    linear = found(monkeypatch, plant, ["p.w", "p.u"], ["p.x", "p.v"], False, (), amplitude=0.5, horizon=0.4)
    assert [[s.variable for s in g] for g in plant.given] == [[], ["w"], ["w"], ["u"], ["u"]]
    (w,), (u,) = plant.given[1], plant.given[3]
    assert (w.values[9:12].tolist(), u.values[9:12].tolist()) == ([0.25, 0.75, 0.25], [0.75, 1.25, 0.75])
    assert linear.response.shape == (2, 2, 20)
    assert linear.units == (("(m)/(1)", "(m)/(N)"), ("(1)/(1)", "(1)/(N)"))
    assert (linear.model.input_labels, linear.model.output_labels) == (["p_w", "p_u"], ["p_x", "p_v"])
    assert not linear.single
    with pytest.raises(ValueError, match="expected loops that are open"):
        linear.margins()


def test_what_bends_is_said_by_the_asymmetry(monkeypatch: pytest.MonkeyPatch) -> None:
    """X' = b u + c u^2 at u_0: the second differences are 2 c d^2 against 2 (b + 2 c u_0) d."""
    plant = Plant(a=0.0, bend=0.5, free=True)
    linear = found(monkeypatch, plant, "p.u", "p.x", False, (), amplitude=0.25)
    slope = 4.0 + 2.0 * 0.5 * 0.75
    # up gives slope d + c d^2, down -(slope d - c d^2), each over d: the difference is 2 c d of slope
    assert linear.asymmetry == pytest.approx(2.0 * 0.5 * 0.25 / slope, rel=1e-9)
    assert linear.response[0, 0, 1:] == pytest.approx(H * slope)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"at": 1.0}, "working point 1.0 s with horizon 1 s -- expected one after the start (1 s) and 10 steps of"),
        ({"horizon": 0.18}, "with horizon 0.18 s"),
        ({"amplitude": 0.0}, "amplitude 0.0 -- expected a positive number"),
        ({"amplitude": math.inf}, "amplitude inf -- expected a positive number"),
        ({"outputs": "p.n"}, "output 'p.n' -- expected one of p.x, p.v, g.y -- correct the name"),
        ({"sources": "q.u"}, "input 'q.u' -- expected one of p.u, p.w, g.u -- correct the name"),
        ({"sources": "p.w", "opened": True}, "input p.w is not connected -- expected one in a loop"),
        ({"outputs": []}, "output (none) -- expected one or more, each once"),
    ],
)  # fmt: skip
def test_wrong_calls_are_refused(monkeypatch: pytest.MonkeyPatch, options: dict[str, Any], message: str) -> None:
    given = {"sources": "p.u", "outputs": "p.x", "opened": False, **options}
    with pytest.raises(InputError) as wrong:
        found(monkeypatch, Plant(), given.pop("sources"), given.pop("outputs"), given.pop("opened"), **given)
    assert message in str(wrong.value)


def test_the_least_times_and_the_usual_horizon(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = Plant()
    linear = found(monkeypatch, plant, "p.u", "p.x", False, at=1.02, horizon=0.2)
    assert linear.response.shape == (1, 1, 10)
    assert plant.options[0]["stop"] == pytest.approx(1.0 + 11 * H)
    assert found(monkeypatch, plant, "p.u", "p.x", False, horizon=None, order=1).response.shape == (1, 1, 1000)


@pytest.mark.parametrize(("method", "delayed", "first"), [
    ("gauss-seidel", (LOOP[0],), 10), ("gauss-seidel", (), 11), ("jacobi", (), 10),
])  # fmt: skip
def test_a_response_begins_with_the_row_that_the_input_got_its_value_from(
    monkeypatch: pytest.MonkeyPatch, method: str, delayed: tuple[Link, ...], first: int
) -> None:
    monkeypatch.setattr(linearize, "check_system", lambda _: wiring(*LOOP))
    monkeypatch.setattr(linearize, "schedule", lambda *_: SimpleNamespace(delayed=delayed))

    def simulate(system: Any, stop: float, step: float, *, stimuli: Any, start: float, **_: Any) -> Trajectory:
        steps = round((stop - start) / step)
        x = np.arange(steps + 1.0)
        if stimuli:  # the row number, times what was added
            x = x * (1.0 + stimuli[0].values.sum() if stimuli[0].add else 1.0 + (stimuli[0].values - kept[0]).sum())
        else:
            kept.append(LOOP[0].gain * (x[:-1] if first == 10 else x[1:]))
        return Trajectory(start + step * x, {"p.x": x}, {"p.x": "m"})

    kept: list[Any] = []
    case: Any = ("system", Experiment(9.0, H, start=1.0, method=method))
    linear = linearize.linearize(case, "g.u", "p.x", 1.2, opened=True, simulate=simulate, horizon=0.4, amplitude=0.5)
    assert linear.response[0, 0] == pytest.approx(-np.arange(first, first + 20.0))


def test_ports_that_do_not_answer_are_named() -> None:
    answers = np.zeros((2, 2, 5))
    answers[0, 0, 3] = 1.0
    with pytest.raises(InputError, match=r"y does not answer to a, b within 0.5 s"):
        linearize._answers(answers, ["a", "b"], ["x", "y"], 0.5)
    answers[1, 0, 2] = 1.0
    with pytest.raises(InputError, match=r"x, y does not answer to b within 0.5 s"):
        linearize._answers(answers, ["a", "b"], ["x", "y"], 0.5)
    answers[1, 1, 2] = math.nan
    with pytest.raises(InputError, match="y does not answer to a, b"):
        linearize._answers(answers, ["a", "b"], ["x", "y"], 0.5)
    answers[1, 1, 2] = -1.0
    linearize._answers(answers, ["a", "b"], ["x", "y"], 0.5)


def test_scales_of_outputs_and_inputs_multiply_to_the_sizes() -> None:
    left, right = np.array([3.0, 0.02]), np.array([7.0, 500.0, 0.1])
    shape = np.random.default_rng(2).choice([-1.0, 1.0], size=40)
    response = left[:, None, None] * right[None, :, None] * shape
    rows, columns = linearize._scales(response)
    assert rows.shape == (2, 1, 1)
    assert columns.shape == (1, 3, 1)
    assert (rows * columns)[:, :, 0] == pytest.approx(np.outer(left, right))


@pytest.mark.parametrize("order", [None, 2])
def test_a_realisation_of_two_inputs_and_outputs_has_their_poles_and_answers_at_once(order: int | None) -> None:
    a, b = np.diag([0.9, 0.4]), np.array([[1.0, 20.0], [3.0, -0.5]])
    c, d = np.array([[2.0, 1.0], [0.001, 0.004]]), np.array([[0.25, 0.0], [0.0, 0.5]])
    response = np.stack([d, *(c @ np.linalg.matrix_power(a, k) @ b for k in range(80))], axis=2)
    model, left = realised(response, H, order)
    assert np.sort(np.real(model.poles())) == pytest.approx([0.4, 0.9])
    assert left < 1e-9
    assert model.dt == H
    assert model.D == pytest.approx(d)
    assert linearize._markov(model, 81) == pytest.approx(response, rel=1e-6, abs=1e-9)
    one, left = realised(response, H, 1)
    assert (one.nstates, 0.01 < left < 1.0) == (1, True)
    rest = linearize._markov(one, 81) - response
    rows, columns = linearize._scales(response)
    assert left == pytest.approx(linearize._rms(rest / rows / columns) / linearize._rms(response / rows / columns))
    still, nothing = realised(np.array([2.5, 0.0, 0.0, 0.0]), H)
    assert (still.nstates, float(still.D[0, 0]), nothing) == (0, 2.5, 0.0)


def test_a_long_response_is_realised_from_a_part_of_it() -> None:
    """600 rows at most, two outputs: 300 of each; more samples than that change nothing."""
    k = np.arange(2001)
    response = np.stack([0.999**k, 0.5 * 0.98**k])[:, None, :]
    response[:, :, 0] = 0.0
    model, left = realised(response, H)
    assert np.sort(np.real(model.poles())) == pytest.approx([0.98, 0.999], rel=1e-6)
    assert left < 1e-6


def integrator(gain: float, step: float = H, returns: tuple[float, ...] = ()) -> Linear:
    model = named(control.ss([[1.0]], [[step]], [[gain]], [[0.0]], step), ["a.u"], ["b.y"])
    return Linear(model, np.zeros((1, 1, 501)), 0.0, 0.0, (("1",),), True, 0.5, returns)


@pytest.mark.parametrize(("gain", "returns"), [(2.5, ()), (-5.0, (-0.5,)), (0.125, (20.0,))])
def test_margins_of_one_loop_are_those_with_its_return(gain: float, returns: tuple[float, ...]) -> None:
    """L = 2.5 h / (z - 1); the phase is -180 deg at half the sampling frequency, where it is 2.5 h / 2."""
    found_ = integrator(gain, returns=returns).margins()
    crossover = 2.0 / H * math.asin(0.5 * 2.5 * H)
    assert found_.crossover == pytest.approx(crossover, rel=1e-4)
    assert found_.phase_margin_deg == pytest.approx(90.0 - math.degrees(0.5 * crossover * H), rel=1e-4)
    assert found_.delay_margin_s == pytest.approx(math.radians(found_.phase_margin_deg) / crossover, rel=1e-4)


def test_margins_are_infinite_where_nothing_crosses() -> None:
    omega = np.geomspace(0.1, 100.0, 2000)
    none = margins(0.5 / (1j * omega + 1.0), omega)
    assert math.isnan(none.crossover)
    assert (none.gain_margin_db, none.phase_margin_deg, none.delay_margin_s) == (math.inf,) * 3
    third = 4.0 / (1j * omega + 1.0) ** 3  # at w = sqrt(3) it is -4/8
    found_ = margins(third, omega)
    assert found_.gain_margin_db == pytest.approx(20.0 * math.log10(2.0), abs=0.01)
    crossover = math.sqrt(4.0 ** (2.0 / 3.0) - 1.0)
    assert found_.crossover == pytest.approx(crossover, rel=1e-4)
    assert found_.phase_margin_deg == pytest.approx(180.0 - 3.0 * math.degrees(math.atan(crossover)), abs=0.01)


def test_the_range_is_from_a_period_to_half_the_sampling_or_about_the_poles() -> None:
    assert integrator(1.0).range == pytest.approx((2.0 * math.pi / (500 * H), math.pi / H))
    for poles, expected in (([-2.0, -30.0], (0.02, 3000.0)), ([0.0, -4.0], (0.04, 400.0)), ([0.0], (0.01, 100.0))):
        model = control.ss(np.diag(poles), np.ones((len(poles), 1)), np.ones((1, len(poles))), [[0.0]])
        linear = Linear(model, np.empty((1, 1, 0)), 0.0, 0.0, (("1",),), False, 0.5)
        assert linear.range == pytest.approx(expected)
        assert linear.step == 0.0
        omega = np.array([0.5, 7.0])
        by_hand = sum(1.0 / (1j * omega - p) for p in poles)
        assert linear.frequency_response(omega) == pytest.approx(by_hand)


def test_margins_of_a_loop_with_two_others_closed() -> None:
    """L = R h / (z - 1) with R of 3 x 3: of one loop r_kk - r_ko (z' + r_oo)^-1 r_ok over z', z' = (z - 1) / h."""
    r = np.array([[3.0, 0.7, -0.4], [0.5, 2.0, 0.6], [-0.3, 0.9, 1.5]])
    returns = (1.0, -0.5, 2.0)
    model = control.ss(np.eye(3), H * np.eye(3), r / np.array(returns)[:, None], np.zeros((3, 3)), H)
    linear = Linear(model, np.zeros((3, 3, 2001)), 0.0, 0.0, (("1",) * 3,) * 3, True, 0.5, returns)
    for k in range(3):
        found_ = linear.margins(k)
        o = [j for j in range(3) if j != k]
        z = (np.exp(1j * found_.crossover * H) - 1.0) / H
        there = (r[k, k] - r[k, o] @ np.linalg.solve(z * np.eye(2) + r[np.ix_(o, o)], r[o, k])) / z
        assert abs(there) == pytest.approx(1.0, rel=1e-3)
        assert found_.phase_margin_deg == pytest.approx(180.0 + math.degrees(np.angle(there)), abs=0.1)
