"""Integers, Booleans, Enumerations and texts on connections of SSPs: mapped, converted, as FMPy by hand has them."""

import re
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from tsm_fmu import InputError
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import open_ssp, write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System, check_system
from tsm_fmu.cosim.trajectory import SimulationStopped

NAMESPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (
        ("ssd", "Description"),
        ("ssc", "Common"),
        ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
    )
)
STEP = 0.01


def mapping(kind, **entries):
    inside = "".join(f'<ssc:MapEntry source="{k.strip("_")}" target="{v}"/>' for k, v in entries.items())
    return f"<ssc:{kind}MappingTransformation>{inside}</ssc:{kind}MappingTransformation>"


def link(source, target, inside="", more=""):
    ends = []
    for end, address in (("start", source), ("end", target)):
        element, _, connector = address.rpartition(".")
        ends.append((f'{end}Element="{element}" ' if element else "") + f'{end}Connector="{connector}"')
    return f"<ssd:Connection {' '.join(ends)} {more}>{inside}</ssd:Connection>"


def element(name, fmu, **values):
    kinds = {int: "Integer", bool: "Boolean", str: "String", float: "Real"}
    given = "".join(
        f'<ssv:Parameter name="{k}"><ssv:{kinds[type(v)]} value="{str(v).lower() if type(v) is bool else v}"/>'
        "</ssv:Parameter>"
        for k, v in values.items()
    )
    table = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{given}</ssv:Parameters></ssv:ParameterSet>'
    return (
        f'<ssd:Component name="{name}" source="{fmu.name}"><ssd:ParameterBindings><ssd:ParameterBinding>'
        f"<ssd:ParameterValues>{table}</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
        "</ssd:Component>"
    )


def archive(folder, fmus, elements, links, rest="", inside="", name="theirs.ssp"):
    path = folder / name
    body = (
        f'<ssd:System name="s">{inside}<ssd:Elements>{"".join(elements)}</ssd:Elements>'
        f"<ssd:Connections>{''.join(links)}</ssd:Connections></ssd:System>"
    )
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr(
            "SystemStructure.ssd",
            f'<ssd:SystemStructureDescription {NAMESPACES} version="2.0" name="theirs">{body}{rest}'
            "</ssd:SystemStructureDescription>",
        )
        for fmu in fmus:
            packed.write(fmu, fmu.name)
    return path


def run(path, stop=0.08, **options):
    with open_ssp(path) as cases:
        return simulate_system(cases["theirs"][0], stop, STEP, method="jacobi", **options)


def by_hand(fmu, folder, rows, feed):
    """Outputs of ``typed`` at each communication point, its inputs fed from them by ``feed``, all calls FMPy's."""
    model = fmpy.read_model_description(fmu, validate=False)
    assert model.coSimulation is not None
    references = {v.name: v.valueReference for v in model.modelVariables}
    fmpy.extract(fmu, unzipdir=folder)
    unit = FMU2Slave(
        guid=model.guid,
        unzipDirectory=str(folder),
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName="by_hand",
    )
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)

    def put(values):
        for name, value in values.items():
            kind = "Boolean" if name == "flag" else "String" if name == "text" else "Integer"
            getattr(unit, f"set{kind}")([references[name]], [value])

    def got():
        text = unit.getString([references["greeting"]])[0]
        return {
            "n_next": unit.getInteger([references["n_next"]])[0],
            "inverse": bool(unit.getBoolean([references["inverse"]])[0]),
            "letters": unit.getInteger([references["letters"]])[0],
            "greeting": text.decode() if isinstance(text, bytes) else text,
        }

    unit.enterInitializationMode()
    unit.exitInitializationMode()
    found = [got()]
    for k in range(rows - 1):
        put(feed(found[-1]))
        unit.doStep(k * STEP, STEP)
        found.append(got())
    unit.terminate()
    unit.freeInstance()
    return found


def test_mapped_values_and_texts_are_those_of_fmpy(foreign, tmp_path):
    """Values without an entry stay as they are (SSP 2.0)."""
    fmu = foreign["typed"]
    links = (
        link("t.n_next", "t.n", mapping("Integer", _3="-5", _0="0")),
        link("t.inverse", "t.flag", mapping("Boolean", _1="false")),
        link("t.greeting", "t.text"),
    )
    found = run(archive(tmp_path, [fmu], [element("t", fmu)], links))
    expected = by_hand(
        fmu,
        tmp_path / "by_hand",
        9,
        lambda o: {
            "n": {3: -5}.get(o["n_next"], o["n_next"]),
            "flag": False if o["inverse"] else o["inverse"],
            "text": o["greeting"],
        },
    )
    for name in ("n_next", "inverse", "letters"):
        assert found.columns[f"t.{name}"].tolist() == [row[name] for row in expected], name
    assert min(found.columns["t.n_next"]) == -4
    assert found.columns["t.inverse"].all()
    assert found.columns["t.letters"][-1] == 7


def test_mappings_through_connectors_of_systems_follow_each_other(foreign, tmp_path):
    """3 becomes -5 outside and that 2 inside: round and round."""
    fmu = foreign["typed"]
    inner = (
        '<ssd:System name="in"><ssd:Connectors><ssd:Connector name="i" kind="input"/>'
        '<ssd:Connector name="o" kind="output"/></ssd:Connectors><ssd:Elements>'
        + element("t", fmu, flag=True, text="a")
        + "</ssd:Elements><ssd:Connections>"
        + link("i", "t.n", mapping("Integer", **{"-5": "2"}))
        + link("t.n_next", "o")
        + "</ssd:Connections></ssd:System>"
    )
    path = archive(tmp_path, [fmu], [inner], [link("in.o", "in.i", mapping("Integer", _3="-5"))])
    assert run(path).columns["in_t.n_next"].tolist() == [0, 1, 2, 3, 3, 3, 3, 3, 3]


def redescribed(fmu, path, **changes):
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                text = content.decode()
                types = "".join(
                    f'<SimpleType name="T_{variable}"><Enumeration>'
                    + "".join(f'<Item name="{n}" value="{v}"/>' for n, v in items.items())
                    + "</Enumeration></SimpleType>"
                    for variable, items in changes.items()
                )
                for variable in changes:
                    text = re.sub(
                        rf'(<ScalarVariable[^>]*name="{variable}"[^>]*>\s*)<Integer',
                        rf'\1<Enumeration declaredType="T_{variable}"',
                        text,
                    )
                content = text.replace(
                    "<ModelVariables>", f"<TypeDefinitions>{types}</TypeDefinitions><ModelVariables>"
                )
            new.writestr(name, content)
    return path


@pytest.fixture
def gears(foreign, tmp_path):
    """``typed`` with an Enumeration on each side: the position n_next, the gear n."""
    return redescribed(
        foreign["typed"],
        tmp_path / "gears.fmu",
        n_next={"zero": 0, "one": 1, "two": 2, "three": 3, "five": 5},
        n={"low": 1, "mid": 2, "high": 4},
    )


def test_items_of_an_enumeration_become_those_of_another(gears, tmp_path):
    """0 low, 2 stays 2 as mid has it, 3 high, and 5 is no gear: by hand 0 2 3 5."""
    links = [link("t.n_next", "t.n", mapping("Enumeration", zero="low", three="high"))]
    path = archive(tmp_path, [gears], [element("t", gears, flag=True, text="a")], links)
    message = (
        "connection t.n_next -> t.n hands on 5 at t = 0.03 s -- expected an item of the Enumeration n: 1 low, 2 mid, "
        "4 high -- map the value, or correct its source"
    )
    with pytest.raises(SimulationStopped, match=re.escape(message)) as stopped:
        run(path)
    assert stopped.value.trajectory.columns["t.n_next"].tolist() == [0, 2, 3, 5]


def test_an_integer_goes_to_an_enumeration_that_has_it(foreign, gears, tmp_path):
    fmus = [foreign["typed"], gears]
    each = [element("a", fmus[0], n=0, flag=True, text="a"), element("b", fmus[1], flag=True, text="a")]
    path = archive(tmp_path, fmus, each, [link("a.n_next", "b.n", mapping("Integer", _0="4"))])
    assert run(path, 0.02).columns["b.n_next"].tolist() == [0, 5, 2]
    with pytest.raises(SimulationStopped, match=r"connection a\.n_next -> b\.n hands on 0 at t = 0 s -- expected an i"):
        run(archive(tmp_path, fmus, each, [link("a.n_next", "b.n")]), 0.02)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (mapping("Enumeration", zero="reverse"), "maps 'reverse' -- expected one of low, mid, high"),
        (mapping("Enumeration", nine="low"), "maps 'nine' -- expected one of zero, one, two, three, five"),
        (mapping("Integer", _0="3"), "maps 0 to 3 -- expected an item of the Enumeration n: 1 low, 2 mid, 4 high"),
        (mapping("Integer", _0="1", _00="2"), "maps '0' twice -- expected one entry each"),
        (mapping("Integer", _0="much"), "maps '0' to 'much' -- expected values of type Integer"),
        (mapping("Boolean", true="2"), "maps 'true' to '2' -- expected values of type Boolean"),
        ("<ssc:IntegerMappingTransformation><ssc:MapEntry/></ssc:IntegerMappingTransformation>", "maps None to None"),
        (mapping("Boolean", true="false"), "has a mapping of type Boolean on Enumeration ports"),
    ],
)
def test_a_mapping_that_does_not_fit_is_named(gears, tmp_path, inside, message):
    path = archive(tmp_path, [gears], [element("t", gears)], [link("t.n_next", "t.n", inside)])
    with pytest.raises(InputError, match=re.escape(f"connection t.n_next -> t.n {message}")) as caught:
        run(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("compiled", [False, True])
def test_an_integer_becomes_a_real(foreign, in_c, tmp_path, compiled):
    """FMI 2.0 Integer and FMI 3.0 Int64 to FMI 2.0 Real, with a factor; the bits of both loops."""
    fmus = [foreign["typed"], in_c["arrays"], foreign["integrator"]]
    each = [
        element("t", fmus[0], flag=True, text="a"),
        element("a", fmus[1]),
        *(element(name, fmus[2], x_0=0.3) for name in ("x", "y")),
    ]
    links = [
        link("t.n_next", "t.n"),
        link("t.n_next", "x.u", '<ssc:LinearTransformation factor="-0.7" offset="0.1"/>'),
        link("a.n", "y.u"),
    ]
    found = run(archive(tmp_path, fmus, each, links), compiled=compiled).columns
    for name, slope in (("x", -0.7 * found["t.n_next"] + 0.1), ("y", found["a.n"])):
        assert found[f"{name}.x"] == pytest.approx(0.3 + STEP * np.append(0.0, np.cumsum(slope[:-1])), rel=1e-13)
    assert found["a.n"].tolist() == list(range(9))


def test_what_a_smaller_integer_does_not_hold_stops_the_run(in_c):
    """Never wrapped: the output of 64 bits counts past what the input holds."""
    from tsm_fmu.cosim.value_table import value_table

    description = check_system(System((Component("a", in_c["arrays"], {"u": 0.0}),), ())).descriptions["a"]
    source = description.ports["n"]
    for small, least, most in (("Int8", -128, 127), ("UInt16", 0, 65535), ("Int32", -(2**31), 2**31 - 1)):
        target = type(source)("v", small, "Integer", "input", "discrete", "", 1, "0")
        table = value_table("connection a.n -> b.v", source, target, (), {})
        assert table is not None
        assert [table.takes(v) for v in (least - 1, least, most, most + 1)] == [False, True, True, False]
        assert f"hands on {most + 1} at t = 2.5 s -- expected {least} to {most}, which {small} holds" in table.refusal(
            most + 1, 2.5
        )
        assert value_table("connection", target, source, (), {}) is None


def test_mapped_values_are_written_and_come_back(foreign, tmp_path):
    system = System(
        (Component("t", foreign["typed"], {"text": "a"}),),
        (
            Connection("t.n_next", "t.n", values=((3, -5), (0, 0))),
            Connection("t.inverse", "t.flag", values=((1, 0),)),
        ),
        "s",
    )
    with open_ssp(write_ssp(tmp_path / "a.ssp", (system, Experiment(0.08, STEP)))) as cases:
        (again, _) = cases["s"]
        assert again.connections == system.connections
        first, second = (simulate_system(s, 0.08, STEP).columns["t.n_next"] for s in (system, again))
    assert first.tolist() == second.tolist()


def test_start_and_end_do_not_say_the_direction(foreign, tmp_path):
    """SSP 2.0, Connections: the kinds of the connectors do. All of a nested system's connections turned round."""
    fmus = [foreign["gain"], foreign["integrator"]]
    pairs = [("x.x", "law.in"), ("law.out", "x.u")], [("in", "g.u"), ("g.y", "out"), ("strength", "g.k")]
    factor = '<ssc:LinearTransformation factor="0.5" offset="0.25"/>'
    found = []
    for turn in (1, -1):
        outer, inner = ([link(a, b, factor) for a, b in (pair[::turn] for pair in each)] for each in pairs)
        connectors = "".join(
            f'<ssd:Connector name="{n}" kind="{k}"/>'
            for n, k in (("in", "input"), ("out", "output"), ("strength", "parameter"))
        )
        binding = element("", fmus[0], strength=-3.1).partition(">")[2].removesuffix("</ssd:Component>")
        law = (
            f'<ssd:System name="law"><ssd:Connectors>{connectors}</ssd:Connectors>{binding}<ssd:Elements>'
            f"{element('g', fmus[0], u_2=0.1)}</ssd:Elements><ssd:Connections>{''.join(inner)}</ssd:Connections>"
            "</ssd:System>"
        )
        path = archive(tmp_path, fmus, [law, element("x", fmus[1], x_0=0.4)], outer, name=f"turned{turn}.ssp")
        found.append(run(path, 0.5).columns["x.x"])
    assert np.array_equal(found[0], found[1])
    assert np.ptp(found[0]) > 0.1
