"""Names, directions, types, units and start values: each misfit is one line that names it."""

import re

import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.system import Component, Connection, System, check_system


def two_gains(foreign, *connections, **parameters):
    names = ("a", "b")
    components = tuple(Component(n, foreign["gain"], parameters.get(n, {"u": 0.0, "u_2": 0.0})) for n in names)
    return System(components, tuple(connections))


MISFITS = {
    "unknown component": (
        Connection("c.y", "b.u"),
        "source 'c.y' of a connection -- expected component.variable with one of a, b",
    ),
    "no dot": (Connection("y", "b.u"), "source 'y' of a connection -- expected component.variable"),
    "unknown output": (Connection("a.z", "b.u"), "source 'a.z' of a connection: Gain.fmu has no variable 'z'"),
    "unknown input": (Connection("a.y", "b.z"), "no variable 'z' -- expected one of u, u_2"),
    "output to output": (Connection("a.y", "b.y"), "connection a.y -> b.y goes from an output to an output"),
    "input to input": (Connection("a.u", "b.u"), "connection a.u -> b.u goes from an input to an input"),
    "parameter": (Connection("a.k", "b.u"), "goes from a parameter to an input"),
    "factor": (Connection("a.y", "b.u", factor=float("nan")), "has factor nan and offset 0.0 -- expected finite"),
}


@pytest.mark.parametrize("name", MISFITS)
def test_a_wrong_connection_is_named(foreign, name):
    connection, message = MISFITS[name]
    with pytest.raises(InputError, match=re.escape(message)):
        check_system(two_gains(foreign, connection))


def test_an_input_driven_twice_names_both_sources(foreign):
    wrong = two_gains(foreign, Connection("a.y", "b.u"), Connection("b.y", "b.u"))
    with pytest.raises(InputError, match=r"input b\.u is driven by a\.y and by b\.y"):
        check_system(wrong)


def test_inputs_without_connection_or_value_are_named_together(foreign):
    wrong = two_gains(foreign, Connection("a.y", "b.u"), a={"u": 0.3}, b={})
    with pytest.raises(InputError, match=r"^inputs a\.u_2, b\.u_2 not connected -- .* set for example a\.u_2=0$"):
        check_system(wrong)


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("t.inverse", "g.u", "joins Boolean to Real"),
        ("t.greeting", "g.u", "joins String to Real"),
        ("g.y", "t.n", "joins Real to Integer"),
        ("t.inverse", "t.n", "joins Boolean to Integer"),
    ],
)
def test_types_that_do_not_fit_are_named(foreign, source, target, message):
    system = System((Component("t", foreign["typed"]), Component("g", foreign["gain"])), (Connection(source, target),))
    with pytest.raises(InputError, match=re.escape(f"connection {source} -> {target} {message}")):
        check_system(system)


def test_a_factor_on_integers_is_refused(foreign):
    values = {"flag": False, "text": "x"}
    system = System((Component("t", foreign["typed"], values),), (Connection("t.n_next", "t.n", factor=2.0),))
    with pytest.raises(InputError, match=r"t\.n_next -> t\.n has a factor or offset on Integer ports"):
        check_system(system)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"k": "fast"}, "start value a.k = 'fast' -- expected a finite number"),
        ({"k": float("inf")}, "start value a.k = inf -- expected a finite number"),
        ({"gain": 2.0}, "start value 'a.gain': Gain.fmu has no such variable -- expected one of u, u_2, k"),
        ({"y": 2.0}, "start value 'a.y' is an output"),
    ],
)
def test_a_start_value_that_cannot_be_set_is_named(foreign, values, message):
    with pytest.raises(InputError, match=re.escape(message)):
        check_system(two_gains(foreign, a={"u": 0.0, "u_2": 0.0, **values}))


@pytest.mark.parametrize(("name", "value"), [("n", 2.5), ("flag", "perhaps"), ("n", "1e400")])
def test_start_values_have_the_declared_type(foreign, name, value):
    system = System((Component("t", foreign["typed"], {name: value}),), ())
    with pytest.raises(InputError, match=rf"start value t\.{name} = .* -- expected (an integer|true or false)"):
        check_system(system)


def test_names_are_unique_and_without_dots(foreign):
    for names in (("a", "a"), ("a.b", "c")):
        with pytest.raises(
            InputError, match=r"component name 'a(\.b)?' -- expected names without a dot, each used once"
        ):
            check_system(System(tuple(Component(n, foreign["typed"]) for n in names), ()))


def test_units_convert_and_the_linear_transformation_follows_in_the_unit_of_the_target(foreign):
    units = foreign["units"]
    values = {"speed": 0.0, "kelvin": 0.0}
    connections = (
        Connection("p.angle_rad", "q.angle", factor=2.0, offset=1.5),
        Connection("p.temperature", "q.kelvin", factor=-3.7, offset=11.0),
    )
    system = System(
        (Component("p", units, {"angle": 0.0, **values}), Component("q", units, {"speed": 0.0})), connections
    )
    angle, temperature = check_system(system).links
    assert angle.gain == pytest.approx(2.0 * 57.29577951308232, rel=1e-14)
    assert angle.offset == pytest.approx(1.5, rel=1e-14)
    assert temperature.gain * 20.5 + temperature.offset == pytest.approx(-3.7 * 293.65 + 11.0, rel=1e-14)


def test_units_that_measure_different_things_are_named(foreign):
    units = foreign["units"]
    system = System((Component("p", units), Component("q", units)), (Connection("p.angle_rad", "q.speed"),))
    with pytest.raises(
        InputError, match=r"connection p\.angle_rad -> q\.speed joins \[rad\] to \[rpm\] -- expected units"
    ):
        check_system(system)


def test_conversion_can_be_switched_off(foreign):
    units = foreign["units"]
    free = {"angle": 0.0, "kelvin": 0.0}
    system = System(
        (Component("p", units, {**free, "speed": 0.0}), Component("q", units, free)),
        (Connection("p.angle_rad", "q.speed", factor=3.7, convert_units=False),),
    )
    (link,) = check_system(system).links
    assert (link.gain, link.offset) == (3.7, 0.0)


def redescribed(fmu, path, change):
    """The same FMU with another model description."""
    import zipfile

    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, change(text.decode()) if name == "modelDescription.xml" else text)
    return path


def test_an_fmu_that_allows_one_instance_is_one_component(foreign, tmp_path):
    once = "canBeInstantiatedOnlyOncePerProcess"
    single = redescribed(
        foreign["gain"], tmp_path / "single.fmu", lambda t: t.replace(f'{once}="false"', f'{once}="true"')
    )
    free, other = {"u": 0.0, "u_2": 0.0}, {"angle": 0.0, "speed": 0.0, "kelvin": 0.0}
    check_system(System((Component("a", single, free), Component("b", foreign["units"], other)), ()))
    check_system(two_gains(foreign))  # twice the same FMU that says nothing of it
    parts = [Component(n, single, free) if n in "bd" else Component(n, foreign["units"], other) for n in "abcd"]
    with pytest.raises(InputError, match=r"^components b and d are the same FMU \(single\.fmu\), which allows one"):
        check_system(System(tuple(parts), ()))


def test_what_is_not_an_fmu_is_named(tmp_path, foreign):
    text, missing, cut = tmp_path / "text.fmu", tmp_path / "missing.fmu", tmp_path / "cut.fmu"
    text.write_text("not a zip")
    cut.write_bytes(foreign["gain"].read_bytes()[:5000])
    for path, message in ((missing, "expected an existing .fmu"), (text, "expected a zip"), (cut, "expected a zip")):
        with pytest.raises(InputError, match=re.escape(str(path)) + ".*" + message):
            describe(path)


def test_an_archive_without_description_or_for_model_exchange_only_is_named(tmp_path, foreign):
    import zipfile

    def rewritten(name, change):
        path = tmp_path / name
        with zipfile.ZipFile(foreign["gain"]) as old, zipfile.ZipFile(path, "w") as new:
            text = old.read("modelDescription.xml").decode()
            changed = change(text)
            if changed is not None:
                new.writestr("modelDescription.xml", changed)
        return path

    cases = {
        "none.fmu": (lambda text: None, "has no readable modelDescription.xml"),
        "broken.fmu": (lambda text: text[: len(text) // 2], "has no readable modelDescription.xml"),
        "me.fmu": (lambda text: text.replace("CoSimulation", "ModelExchange"), "no co-simulation interface"),
        "old.fmu": (lambda text: text.replace('fmiVersion="2.0"', 'fmiVersion="9.0"'), "FMU .*old.fmu"),
    }
    for name, (change, message) in cases.items():
        with pytest.raises(InputError, match=message) as caught:
            describe(rewritten(name, change))
        assert "\n" not in str(caught.value)
