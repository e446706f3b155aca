"""Other people's SSPs: nested systems, connectors of systems, parameter sets with units, prefixes and mappings."""

import re
import zipfile

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import open_ssp
from tsm_fmu.cosim.system import Component, Connection, System

NAMESPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (
        ("ssd", "Description"),
        ("ssc", "Common"),
        ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
    )
)
UNITS = """<ssd:Units><ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="0.017453292519943295"/></ssc:Unit>
<ssc:Unit name="turns_of_ours"><ssc:BaseUnit rad="1" factor="6.283185307179586"/></ssc:Unit>
<ssc:Unit name="kg"><ssc:BaseUnit kg="1"/></ssc:Unit></ssd:Units>"""

# an outer system of an inner one (a gain behind connectors) and an integrator; the gain's k is a parameter connector
NESTED = """<ssd:System name="outer">
<ssd:Connectors><ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector>
<ssd:Connector name="seen" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>
<ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>
<ssd:Elements>
 <ssd:System name="law">
  <ssd:Connectors><ssd:Connector name="in" kind="input"><ssc:Real/></ssd:Connector>
  <ssd:Connector name="out" kind="output"><ssc:Real/></ssd:Connector>
  <ssd:Connector name="strength" kind="parameter"><ssc:Real/></ssd:Connector></ssd:Connectors>
  <ssd:Elements><ssd:Component name="g" source="resources/Gain.fmu" type="application/x-fmu-sharedlibrary">
   <ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector></ssd:Connectors>
  </ssd:Component></ssd:Elements>
  <ssd:Connections>
   <ssd:Connection startConnector="in" endElement="g" endConnector="u">
    <ssc:LinearTransformation factor="2.0" offset="0.5"/></ssd:Connection>
   <ssd:Connection startElement="g" startConnector="y" endConnector="out"/>
   <ssd:Connection startConnector="strength" endElement="g" endConnector="k"/>
  </ssd:Connections>
 </ssd:System>
 <ssd:Component name="x" source="resources/Integrator.fmu"/>
</ssd:Elements>
<ssd:Connections>
 <ssd:Connection startElement="x" startConnector="x" endElement="law" endConnector="in">
  <ssc:LinearTransformation factor="3.0" offset="-0.25"/></ssd:Connection>
 <ssd:Connection startElement="law" startConnector="out" endElement="x" endConnector="u"/>
 <ssd:Connection startConnector="gain" endElement="law" endConnector="strength"/>
 <ssd:Connection startElement="x" startConnector="x" endConnector="seen"/>
</ssd:Connections>
</ssd:System>"""


def values(*pairs, binding="", mapping="", **units):
    parameters = "".join(
        f'<ssv:Parameter name="{n}"><ssv:Real value="{v}" {unit}/></ssv:Parameter>'
        for n, v in pairs
        for unit in [f'unit="{units[n]}"' if n in units else ""]
    )
    table = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{parameters}</ssv:Parameters></ssv:ParameterSet>'
    inside = f"<ssd:ParameterValues>{table}</ssd:ParameterValues>"
    if mapping:
        inside += (
            f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping>'
            "</ssd:ParameterMapping>"
        )
    return f"<ssd:ParameterBinding {binding}>{inside}</ssd:ParameterBinding>"


@pytest.fixture
def ssp(foreign, tmp_path):
    def written(body, version="1.0", **files):
        path = tmp_path / "theirs.ssp"
        text = f'<ssd:SystemStructureDescription {NAMESPACES} version="{version}" name="theirs">{body}'
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("SystemStructure.ssd", f"{text}{UNITS}</ssd:SystemStructureDescription>")
            for fmu in ("gain", "integrator", "units"):
                archive.write(foreign[fmu], f"resources/{foreign[fmu].name}")
            for name, content in files.items():
                archive.writestr(name.replace("_dot_", "."), content)
        return path

    return written


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_nested_systems_run_as_the_flat_one_they_stand_for(ssp, foreign, version):
    """In = 3 x - 0.25, u = 2 in + 0.5, y = k u + u_2, with k through two parameter connectors."""
    path = ssp(NESTED.format(bindings=values(("gain", -0.7), ("x.x_0", 0.4))), version)
    flat = System(
        (Component("g", foreign["gain"], {"k": -0.7, "u_2": 0.0}), Component("x", foreign["integrator"], {"x_0": 0.4})),
        (Connection("x.x", "g.u", 6.0, 0.0), Connection("g.y", "x.u")),
    )
    expected = simulate_system(flat, 0.5, 0.01)
    with open_ssp(path) as cases:
        system, _ = cases["theirs"]
        found = simulate_system(system, 0.5, 0.01)
    assert [c.name for c in system.components] == ["law_g", "x"]
    assert found.columns["x.x"] == pytest.approx(expected.columns["x.x"], rel=1e-13)
    assert np.ptp(found.columns["x.x"]) > 0.1
    assert found.messages == ("nothing drives law_g.u_2 = 0: the FMU's own start values stay",)


def test_a_mapping_renames_scales_and_selects(ssp):
    mapping = (
        '<ssm:MappingEntry source="all.strength" target="law.g.k"><ssc:LinearTransformation factor="-2" offset="0.5"/>'
        '</ssm:MappingEntry><ssm:MappingEntry source="all.start" target="x.x_0">'
        '<ssc:EnumerationMappingTransformation><ssc:MapEntry source="7.0" target="0.125"/>'
        "</ssc:EnumerationMappingTransformation></ssm:MappingEntry>"
    )
    bindings = values(("strength", 1.5), ("start", "7.0"), ("gone", 1), binding='prefix="all."', mapping=mapping)
    with open_ssp(ssp(NESTED.format(bindings=bindings))) as cases:
        system, _ = cases["theirs"]
    found = {c.name: dict(c.parameters) for c in system.components}
    assert float(found["law_g"]["k"]) == -2.5
    assert float(found["x"]["x_0"]) == 0.125
    assert "not applied, because their mapping does not name them: all.gone" in system.notes


def test_outer_bindings_replace_inner_ones_and_files_are_read(ssp):
    ssv = (
        f'<ssv:ParameterSet {NAMESPACES} version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="k">'
        '<ssv:Real value="5"/></ssv:Parameter><ssv:Parameter name="u_2"><ssv:Real value="0.3"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet>"
    )
    entry = '<ssm:MappingEntry source="k" target="gain"/>'
    ssm = f'<ssm:ParameterMapping {NAMESPACES} version="1.0">{entry}</ssm:ParameterMapping>'
    bindings = (
        '<ssd:ParameterBinding source="set.ssv"><ssd:ParameterMapping source="names.ssm"/></ssd:ParameterBinding>'
    )
    inner = '<ssd:Component name="g" source="resources/Gain.fmu" type="application/x-fmu-sharedlibrary">'
    body = NESTED.format(bindings=bindings).replace(
        inner, f"{inner}<ssd:ParameterBindings>{values(('k', 1.25), ('u_2', 0.75))}</ssd:ParameterBindings>"
    )
    with open_ssp(ssp(body, **{"set_dot_ssv": ssv, "names_dot_ssm": ssm})) as cases:
        found = {c.name: dict(c.parameters) for c in cases["theirs"][0].components}
    assert float(found["law_g"]["k"]) == 5.0  # by the mapping to the connector
    assert float(found["law_g"]["u_2"]) == 0.75


ALONE = (
    '<ssd:System name="s"><ssd:Elements><ssd:Component name="p" source="resources/Units.fmu">{inside}</ssd:Component>'
    "</ssd:Elements></ssd:System>"
)


@pytest.mark.parametrize(
    ("unit", "written", "expected"),
    [("rad", 0.1, np.degrees(0.1)), ("deg", 0.1, 0.1), ("turns_of_ours", 0.25, 90.0), (None, 5.7, 5.7)],
)
def test_the_unit_of_a_parameter_counts(ssp, unit, written, expected):
    """The FMU's angle is in deg."""
    inside = values(("angle", written), **({} if unit is None else {"angle": unit}))
    path = ssp(ALONE.format(inside=f"<ssd:ParameterBindings>{inside}</ssd:ParameterBindings>"))
    with open_ssp(path) as cases:
        run = simulate_system(cases["theirs"][0], 0.02, 0.01)
    assert run.columns["p.angle_seen"][-1] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("unit", ["kg", "furlongs_of_nobody"])
def test_a_unit_that_measures_something_else_is_refused(ssp, unit):
    inside = f"<ssd:ParameterBindings>{values(('angle', 1.0), angle=unit)}</ssd:ParameterBindings>"
    with (
        pytest.raises(InputError, match=re.escape(f"parameter p.angle goes from [{unit}] to [deg] -- expected units")),
        open_ssp(ssp(ALONE.format(inside=inside))),
    ):
        pass


def test_connectors_in_other_units_than_their_fmus_convert(ssp):
    """Angle_rad -> angle of one unit: connectors in turns and rad, a factor in the unit of the second."""
    connectors = (
        '<ssd:Connectors><ssd:Connector name="angle_rad" kind="output"><ssc:Real unit="turns_of_ours"/></ssd:Connector>'
        '<ssd:Connector name="angle" kind="input"><ssc:Real unit="rad"/></ssd:Connector></ssd:Connectors>'
    )
    link = (
        '<ssd:Connections><ssd:Connection startElement="p" startConnector="angle_rad" endElement="p" '
        'endConnector="angle"><ssc:LinearTransformation factor="3" offset="0.5"/></ssd:Connection></ssd:Connections>'
    )
    body = ALONE.format(inside=connectors).replace("</ssd:Elements>", f"</ssd:Elements>{link}")
    with open_ssp(ssp(body)) as cases:
        run = simulate_system(cases["theirs"][0], 0.03, 0.01)
    expected = np.degrees(3.0 * run.columns["p.angle_rad"][:-1] + 0.5)
    assert run.columns["p.angle_seen"][1:] == pytest.approx(expected, rel=1e-13)


def test_a_prefix_that_nobody_declared_is_read_all_the_same(ssp):
    text = NESTED.format(bindings=values(("gain", -0.7), ("x.x_0", 0.4)))
    path = ssp(text.replace("<ssd:Elements>", '<ssd:Elements><tool:Extra note="1"/>', 1))
    with open_ssp(path) as cases:
        assert [c.name for c in cases["theirs"][0].components] == ["law_g", "x"]


LISTED = """<ssd:System name="outer"><ssd:Elements>
 <ssd:Component name="a" source="resources/Integrator.fmu" type="application/x-fmu-sharedlibrary">
  <ssd:Connectors><ssd:Connector name="x" kind="output"/></ssd:Connectors></ssd:Component>
 <ssd:System name="law">
  <ssd:Connectors><ssd:Connector name="in" kind="input"/><ssd:Connector name="back" kind="input"/>
  <ssd:Connector name="out" kind="output"/></ssd:Connectors>
  <ssd:Elements><ssd:Component name="g" source="resources/Gain.fmu" type="application/x-fmu-sharedlibrary">
   <ssd:Connectors><ssd:Connector name="u" kind="input"/><ssd:Connector name="u_2" kind="input"/>
   <ssd:Connector name="y" kind="output"/></ssd:Connectors></ssd:Component></ssd:Elements>
  <ssd:Connections><ssd:Connection startConnector="in" endElement="g" endConnector="u"/>
  <ssd:Connection startConnector="back" endElement="g" endConnector="u_2"/>
  <ssd:Connection startElement="g" startConnector="y" endConnector="out"/></ssd:Connections>
 </ssd:System>
 <ssd:Component name="b" source="resources/Integrator.fmu" type="application/x-fmu-sharedlibrary">
  <ssd:Connectors><ssd:Connector name="u" kind="input"/><ssd:Connector name="x" kind="output"/></ssd:Connectors>
 </ssd:Component></ssd:Elements>
 <ssd:Connections><ssd:Connection startElement="a" startConnector="x" endElement="law" endConnector="in"/>
 <ssd:Connection startElement="b" startConnector="x" endElement="law" endConnector="back"/>
 <ssd:Connection startElement="law" startConnector="out" endElement="b" endConnector="u"/></ssd:Connections>
{values}</ssd:System>"""


def test_a_nested_system_gives_the_digits_of_fmpy(ssp):
    """All outputs are 0 at the start, where FMPy's connectors are too; it exchanges all values at once."""
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import Parameter, ParameterSet

    numbers = (("a.u", 0.9), ("law.g.k", -1.7))
    bindings = f"<ssd:ParameterBindings>{values(*numbers)}</ssd:ParameterBindings>"
    with open_ssp(ssp(LISTED.format(values=bindings))) as cases:
        found = simulate_system(cases["theirs"][0], 1.0, 0.01, method="jacobi")
    # FMPy reads no ParameterBindings: it is handed them
    given = ParameterSet(name="p", parameters=[Parameter(name=name, value=value) for name, value in numbers])
    rows = simulate_ssp(str(ssp(LISTED.format(values=""))), stop_time=0.995, step_size=0.01, parameter_set=given)
    for ours, theirs in (("a.x", "a.x"), ("b.x", "b.x"), ("law_g.y", "law.g.y")):
        assert found.columns[ours][1:] == pytest.approx([row[theirs] for row in rows], rel=1e-12, abs=1e-15)
    assert np.ptp(found.columns["b.x"]) > 0.1
