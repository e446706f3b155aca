"""Order of evaluation, and algebraic loops by the names of their ports."""

import re
import zipfile
from itertools import permutations

import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.order import schedule
from tsm_fmu.cosim.system import Component, Connection, System, check_system


def ordered(components, connections):
    return schedule(check_system(System(tuple(components), tuple(Connection(*c) for c in connections))))


def test_feed_through_comes_after_its_sources_whatever_the_declared_order(foreign):
    gain, free = foreign["gain"], {"u_2": 0.0}
    components = [Component(n, gain, free) for n in ("third", "second")] + [
        Component("first", gain, {"u": 1.0, **free})
    ]
    plan = ordered(components, [("second.y", "third.u"), ("first.y", "second.u")])
    assert plan.components == ("first", "second", "third")
    assert plan.delayed == ()


def test_a_state_breaks_the_loop_and_its_input_is_the_delayed_link(foreign):
    components = [Component("g", foreign["gain"], {"u_2": 0.0}), Component("x", foreign["integrator"])]
    plan = ordered(components, [("x.x", "g.u"), ("g.y", "x.u")])
    assert plan.components == ("x", "g")
    assert [(d.source, d.target) for d in plan.delayed] == [(("g", "y"), ("x", "u"))]


def test_an_algebraic_loop_names_its_ports_in_the_direction_of_the_signal(foreign):
    components = [Component(n, foreign["gain"]) for n in ("a", "b")] + [Component("x", foreign["integrator"])]
    links = [("a.y", "b.u"), ("b.y", "a.u_2"), ("x.x", "a.u"), ("x.x", "b.u_2"), ("b.y", "x.u")]
    with pytest.raises(InputError) as caught:
        ordered(components, links)
    message = str(caught.value)
    ports = message.removeprefix("algebraic loop ").partition(" -- ")[0].split(" -> ")
    assert ports[0] == ports[-1]
    begin = ports.index("a.y")
    assert [*ports[begin:-1], *ports[:begin]] == ["a.y", "b.u", "b.y", "a.u_2"]
    assert "J_load" in message


def test_an_fmu_that_states_no_dependencies_may_be_in_a_feedback(foreign):
    units, free = foreign["units"], {"speed": 0.0, "kelvin": 0.0}
    plan = ordered([Component("p", units, free)], [("p.angle_rad", "p.angle")])
    assert [d.target for d in plan.delayed] == [("p", "angle")]


@pytest.mark.parametrize("names", list(permutations("abcx")))
def test_a_feedback_chain_starts_at_its_solution_in_any_declared_order(foreign, tmp_path, names):
    """Of FMUs that state no dependencies the order says nothing: values are handed on until the first row fits.

    x = 0.9 + 0.3 c, a = 0.5 x, b = 0.2 + 0.5 a, c = -0.5 b: each round leaves 0.0375 of what was wrong.
    """
    silent = tmp_path / "silent.fmu"
    with zipfile.ZipFile(foreign["gain"]) as old, zipfile.ZipFile(silent, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            if name == "modelDescription.xml":
                text = re.sub(r' dependencies="[^"]*"', "", text.decode())
            new.writestr(name, text)
    values = {"x": (0.3, 0.9), "a": (0.5, 0.0), "b": (0.5, 0.2), "c": (-0.5, 0.0)}
    parts = tuple(Component(n, silent, {"k": values[n][0], "u_2": values[n][1]}) for n in names)
    links = tuple(Connection(f"{n}.y", f"{m}.u") for n, m in ("xa", "ab", "bc", "cx"))
    run = simulate_system(System(parts, links), 0.01, 0.01)
    x = (0.9 - 0.3 * 0.5 * 0.2) / 1.0375
    solution = {"x.y": x, "a.y": 0.5 * x, "b.y": 0.2 + 0.25 * x, "c.y": -0.1 - 0.125 * x}
    assert {name: column[0] for name, column in run.columns.items()} == pytest.approx(solution, abs=1e-5)


def gains(foreign):
    components = [Component(n, foreign["gain"], {"k": -0.4, "u_2": 1.0}) for n in ("a", "b")]
    return System(tuple(components), (Connection("a.y", "b.u"), Connection("b.y", "a.u")))


def test_a_delayed_loop_is_said_with_the_port_that_is_late_and_has_its_closed_form(foreign):
    """a_n = 1 + k b_(n-1), b_n = 1 + k a_n: geometric towards 1/(1 - k)."""
    run = simulate_system(gains(foreign), 0.3, 0.01, loops="delay")
    assert run.messages == ("algebraic loop a.y -> b.u -> b.y -> a.u -> a.y: one step late at a.u",)
    a, b = run.columns["a.y"], run.columns["b.y"]
    assert a[1:] == pytest.approx(1.0 - 0.4 * b[:-1], rel=1e-14)
    assert b == pytest.approx(1.0 - 0.4 * a, rel=1e-14)
    assert a[-1] == pytest.approx(1.0 / 1.4, rel=1e-9)


def test_components_that_cannot_save_their_state_are_named(foreign):
    with pytest.raises(InputError, match=r"cannot be iterated: a, b cannot save its state .* --loops delay"):
        simulate_system(gains(foreign), 0.3, 0.01, loops="iterate")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"loops": "guess"}, "loops 'guess' -- expected one of refuse, delay, iterate"),
        ({"loops": "iterate", "method": "jacobi"}, "loops 'iterate' with method 'jacobi' -- expected Gauss-Seidel"),
        ({"tolerance": 0.0}, "tolerance 0.0 -- expected a number between 0 and 1"),
    ],
)
def test_wrong_options_of_loops_are_refused(foreign, options, message):
    with pytest.raises(InputError, match=re.escape(message)):
        simulate_system(gains(foreign), 0.3, 0.01, **options)
