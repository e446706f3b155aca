"""What other tools write into their SSPs: taken for what it means, passed over, or named in one line."""

import re

import numpy as np
import pytest

from tests.cosim.test_ssp import redescribed
from tests.cosim.test_ssp_values import archive, element, link, run
from tsm_fmu import InputError
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.ssp import open_ssp
from tsm_fmu.cosim.ssp.connectors import Connector
from tsm_fmu.cosim.ssp.parameters import Parameter

UNITS = """<ssd:Units><ssc:Unit name="our_m"><ssc:BaseUnit m="1.0"/></ssc:Unit>
<ssc:Unit name="our_cm"><ssc:BaseUnit m="1" kg="0" factor="0.01" offset="0.0"/></ssc:Unit></ssd:Units>"""


def with_(component, *connectors, more=""):
    """The component with connectors of it (name, kind, unit)."""
    inside = "".join(
        f'<ssd:Connector name="{n}" kind="{k}"><ssc:Real unit="{u}"/></ssd:Connector>' for n, k, u in connectors
    )
    begin, _, rest = component.partition(">")
    return f"{begin} {more}><ssd:Connectors>{inside}</ssd:Connectors>{rest}"


def refused(path, message):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        run(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("nested", [False, True])
def test_units_that_only_connectors_state_count(foreign, tmp_path, nested):
    """Model.CONNECT's way: no FMU here declares a unit. x in m goes to u in cm, then 3 u + 0.5 in cm."""
    fmus = [foreign["integrator"], foreign["gain"]]
    x = with_(element("x", fmus[0], x_0=0.4, u=0.9), ("x", "output", "our_m"))
    g = with_(element("g", fmus[1], k=1.0, u_2=0.0), ("u", "input", "our_cm"))
    factor = '<ssc:LinearTransformation factor="3" offset="0.5"/>'
    elements, links = [x, g], [link("x.x", "g.u", factor)]
    if nested:
        own = '<ssd:Connectors><ssd:Connector name="in" kind="input"/></ssd:Connectors>'
        law = f'<ssd:System name="law">{own}<ssd:Elements>{g}'
        elements[1] = f"{law}</ssd:Elements><ssd:Connections>{link('in', 'g.u', factor)}</ssd:Connections></ssd:System>"
        links = [link("x.x", "law.in")]
    found = run(archive(tmp_path, fmus, elements, links, UNITS)).columns
    assert found["law_g.y" if nested else "g.y"][1:] == pytest.approx(3.0 * 100.0 * found["x.x"][:-1] + 0.5, rel=1e-13)
    assert np.ptp(found["x.x"]) > 0.05


def test_a_parameter_is_in_the_unit_of_its_connector_unless_it_states_one(foreign, tmp_path):
    """The FMU's angle is in deg; the gain's k has no unit there."""
    fmus = [foreign["units"], foreign["gain"]]
    angle = with_(element("p", fmus[0], angle=0.3), ("angle", "input", "rad"))
    length = with_(element("g", fmus[1], k=0.0), ("k", "parameter", "our_cm")).replace(
        'value="0.0"', 'value="1.7" unit="our_m"'
    )
    with open_ssp(archive(tmp_path, fmus, [angle, length], [], UNITS)) as cases:
        p, g = (dict(component.parameters) for component in cases["theirs"][0].components)
    assert float(p["angle"]) == pytest.approx(np.degrees(0.3), rel=1e-14)
    assert float(g["k"]) == pytest.approx(170.0, rel=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"0.01"', '"much"', "'much' -- expected a number -- export it again"),
        ('m="1.0"', 'm="1.5"', "unit 'our_m' has the exponent 1.5 of m -- expected a whole number"),
    ],
)
def test_a_unit_table_with_what_is_no_number_is_named(foreign, tmp_path, old, new, message):
    refused(archive(tmp_path, [foreign["gain"]], [element("g", foreign["gain"])], [], UNITS.replace(old, new)), message)


@pytest.mark.parametrize(("proxy", "port"), [("proxy-fmu", ""), ("proxyfmu", ""), ("fmu-proxy", ":9090")])
def test_an_fmu_that_asks_for_a_process_of_its_own_is_that_fmu(foreign, tmp_path, proxy, port):
    """As libcosim and ecos write it; one on another machine is not there."""
    fmu = foreign["gain"]
    each = element("g", fmu, k=-1.3, u=0.7)
    local, remote = (
        each.replace('source="', f'source="{proxy}://{host}?file=') for host in (f"localhost{port}", "far:9090")
    )
    assert run(archive(tmp_path, [fmu], [local], [])).columns["g.y"] == pytest.approx(-1.3 * 0.7)
    refused(archive(tmp_path, [fmu], [remote], []), f"component 'g' with source '{proxy}://far:9090?file=Gain.fmu' -- ")


def test_items_that_only_the_description_names_set_an_integer(foreign, tmp_path):
    fmu = foreign["typed"]
    kind = '<ssd:Connector name="n" kind="input"><ssc:Enumeration name="Gear"/></ssd:Connector>'
    typed = element("t", fmu, n=0).replace('<ssv:Integer value="0"/>', '<ssv:Enumeration value="third" name="Gear"/>')
    begin, _, rest = typed.partition(">")
    gears = '<ssc:Enumeration name="Gear"><ssc:Item name="third" value="7"/></ssc:Enumeration>'
    gears = f"<ssd:Enumerations>{gears}</ssd:Enumerations>"
    assert (
        run(archive(tmp_path, [fmu], [f"{begin}><ssd:Connectors>{kind}</ssd:Connectors>{rest}"], [], gears))
        .columns["t.n_next"]
        .tolist()[1:]
        == [8] * 8
    )
    refused(archive(tmp_path, [fmu], [typed], [], gears), "start value t.n = 'third' -- expected an integer")


BINDING = "<ssd:ParameterBindings><ssd:ParameterBinding {}>{}</ssd:ParameterBinding></ssd:ParameterBindings>"
MODELICA = "</ssd:Component><ssd:Component name='m' type='text/x-modelica' source='m.mo'>"
NO_SET = "parameter binding of component 'g' has no ParameterSet -- expected one inside ParameterValues, or the source"
MISPLACED = '<ssd:ParameterSet><ssd:Parameter name="k"><ssd:Real value="1.5"/></ssd:Parameter></ssd:ParameterSet>'
TLM = """<ssd:Annotations><ssc:Annotation type="t"><oms:Connections xmlns:oms="o"><oms:Connection delay="0.001"
linearimpedance="100"/></oms:Connections></ssc:Annotation></ssd:Annotations>"""


@pytest.mark.parametrize(
    ("inside", "links", "message"),
    [
        ("", [link("x.x", "h.u")], "connection x.x -> h.u: there is no element 'h' -- expected one of its system"),
        ("", [link("h.y", "x.u")], "connection h.y -> x.u: there is no element 'h' -- expected one of its system"),
        ("", [link("x.bus", "g.bus")], "source 'x.bus' of a connection: Integrator.fmu has no variable 'bus'"),
        ("", [link("x.x", "g.y")], "connection x.x -> g.y goes from an output to an output -- expected"),
        (BINDING.format("", MISPLACED), [], NO_SET),
        (BINDING.format('type="text/csv" source="Gain.fmu"', ""), [], NO_SET),
        (BINDING.format("", ""), [], None),
        (MODELICA, [], "component 'm' is of type 'text/x-modelica' -- expected an FMU inside"),
        ("</ssd:Component><ssd:System name='x'/><ssd:Component>", [], "the element 'x' is there twice -- expected"),
        (f"</ssd:Component><ssd:System name='t'>{TLM}</ssd:System><ssd:Component>", [], "system 't' has transmission"),
    ],
)  # fmt: skip
def test_what_means_nothing_here_is_named(foreign, tmp_path, inside, links, message):
    fmus = [foreign["integrator"], foreign["gain"]]
    begin, _, _ = element("g", fmus[1]).partition(">")
    both = f"{element('x', fmus[0])}{begin}>{inside}</ssd:Component>".replace("<ssd:Component></ssd:Component>", "")
    path = archive(tmp_path, fmus, [both], links)
    if message is None:
        run(path)
    else:
        refused(path, message)


def test_what_another_tool_adds_and_this_one_leaves_out_is_said(foreign, tmp_path):
    fmus = [foreign["integrator"], foreign["gain"]]
    port = '<ssc:Annotation type="com.avl"><mc:Port xmlns:mc="a"><mc:Real default="3.0"/></mc:Port></ssc:Annotation>'
    own = f'<ssd:Connector name="u_2" kind="input"><ssd:Annotations>{port}</ssd:Annotations></ssd:Connector>'
    g = with_(element("g", fmus[1])).replace("</ssd:Connectors>", f"{own}</ssd:Connectors>")
    path = archive(tmp_path, fmus, [element("x", fmus[0]), g], [link("x.x", "g.u", more='information_delay="0.02"')])
    with open_ssp(path) as cases:
        assert cases["theirs"][0].notes[:2] == (
            "another tool's start value of g.u_2 in an annotation is not read",
            "connection x.x -> g.u: the delay of 0.02 s that ssp4sim adds is left out",
        )


# as Dymola, easySSP and SSP 2.0 have it: nothing of this is a value
AROUND = """<ssc:MetaData kind="quality" type="application/x-srmd-meta-data">
<ssc:Content><Parameters/></ssc:Content>
<ssc:Signature role="authenticity" type="t"><ssc:Content/></ssc:Signature></ssc:MetaData>"""
BESIDE = f"""<ssd:GraphicalElements><ssd:Note x1="0" y1="0" x2="1" y2="1" text="x.x"/></ssd:GraphicalElements>
<ssd:SystemGeometry x1="-359.5" y1="-383.0" x2="710.0" y2="198.0"/>{AROUND}
<ssd:Annotations><ssc:Annotation type="com.3ds.ssp"><smmd:Data xmlns:smmd="d">
<UserAnnotation key="step" value="7"/></smmd:Data></ssc:Annotation>
<ssc:Annotation type="org.openmodelica"><oms:Connections xmlns:oms="o"><oms:Connection startElement="x" endElement="g"
startConnector="bus" endConnector="bus"/></oms:Connections></ssc:Annotation></ssd:Annotations>"""
CONNECTORS = """<ssd:Connectors><ssd:Connector name="k" kind="parameter" description="k = k"><ssc:Binary
mime-type="text/x-modelica; path=Modelica.Units.SI.Time"/></ssd:Connector><ssd:Connector name="u" kind="input">
<ssc:Real unit=""/><ssd:ConnectorGeometry x="0.0" y="0.5"/></ssd:Connector><ssd:Connector name="y" kind="inout">
<ssc:Float64/><ssc:Dimension size="1"/></ssd:Connector><ssd:Connector name="tick" kind="input"><ssc:Clock/>
</ssd:Connector>
<ssd:Connector name="not_there" kind="local"/></ssd:Connectors>
<ssd:ElementGeometry x1="-92" x2="-72" y1="10" y2="30" iconFlip="false"/>"""


def test_pictures_notes_and_types_change_nothing(foreign, tmp_path):
    fmus = [foreign["integrator"], foreign["gain"]]
    elements = [element("x", fmus[0], x_0=0.4), element("g", fmus[1], k=-1.9, u_2=0.3)]
    links = [link("x.x", "g.u"), link("g.y", "x.u")]
    plain = run(archive(tmp_path, fmus, elements, links)).columns
    begin, _, rest = elements[1].partition(">")
    rest = rest.replace("</ssv:Parameters>", f"</ssv:Parameters>{AROUND}")
    elements[1] = f"{begin} implementation='CoSimulation' id='e7'>{CONNECTORS}{rest}"
    around = "<ssd:ConnectionGeometry pointsX='-2 7.6' pointsY='20 20'/>"
    links[0] = link("x.x", "g.u", around, "suppressUnitConversion='false' description=''")
    inside = "<ssd:Connectors><ssd:Connector name='seen' kind='output'/></ssd:Connectors>"
    links.append("<ssd:Connection startElement='g' startConnector='y' endElement='' endConnector='seen'/>")
    path = archive(tmp_path, fmus, elements, links, AROUND, inside + BESIDE, name="rich.ssp")
    with open_ssp(path) as cases:
        assert cases["theirs"][0].notes == ()
    rich = run(path).columns
    assert {name: values.tolist() for name, values in rich.items()} == {n: v.tolist() for n, v in plain.items()}
    assert np.ptp(plain["x.x"]) > 0.01


@pytest.mark.parametrize("kind", ["Binary", "Clock"])
def test_a_connection_of_what_is_no_value_is_named_by_its_type(in_c, tmp_path, kind):
    fmu = redescribed(in_c["arrays"], tmp_path / "other.fmu", lambda text: text.replace("<Binary", f"<{kind}"))
    ends = [element(name, fmu) for name in ("a", "b")]
    message = f"source 'a.picture' of a connection is a {kind}, or too large an array -- expected a number"
    refused(archive(tmp_path, [fmu], ends, [link("a.picture", "b.u[1]")]), message)


def test_a_factor_on_what_is_no_real_is_refused(foreign, tmp_path):
    entry = '<ssm:MappingEntry source="n" target="n"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry>'
    table = f'<ssm:ParameterMapping version="2.0">{entry}</ssm:ParameterMapping>'
    own = element("t", foreign["typed"], n=3).replace(
        "</ssd:ParameterBinding>", f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping></ssd:ParameterBinding>"
    )
    message = "parameter t.n has a factor or offset on an Integer -- expected a Real for that -- drop it"
    refused(archive(tmp_path, [foreign["typed"]], [own], []), message)


def test_values_for_variables_that_nobody_has_are_left_out_and_said(foreign, tmp_path):
    """SSP 1.0 and 2.0, Parameters: a set need not fit; one file may serve many components."""
    fmu = foreign["gain"]
    own = element("g", fmu, k=2.0, stiffness=3.0, mass=0.7)
    everywhere = element("", fmu, **{"g.k": 4.0, "h.k": 1.0}).partition(">")[2].removesuffix("</ssd:Component>")
    with open_ssp(archive(tmp_path, [fmu], [own], [], inside=everywhere)) as cases:
        system, _ = cases["theirs"]
    assert system.components[0].parameters == {"k": "4.0", "u": "0", "u_2": "0"}
    assert system.notes[:2] == ("no variable of g for: stiffness, mass", "no variable of the system for: h.k")


def test_one_system_of_a_description_is_there_as_often_as_it_is_named(foreign, tmp_path):
    """SSP 2.0, Component: ``source="#id"``; each with its own parameters."""
    fmus = [foreign["integrator"], foreign["gain"]]
    connectors = '<ssd:Connectors><ssd:Connector name="in" kind="input"/><ssd:Connector name="out" kind="output"/>'
    inner = [link("in", "g.u"), link("g.y", "out")]
    law = (
        f'<ssd:System name="one" id="law">{connectors}</ssd:Connectors><ssd:Elements>{element("g", fmus[1], k=-1.9)}'
        f"</ssd:Elements><ssd:Connections>{''.join(inner)}</ssd:Connections></ssd:System>"
    )
    two = element("two", fmus[1], **{"g.k": 0.7}).replace(
        'source="Gain.fmu"', 'source="#law" type="application/x-ssp-definition"'
    )
    elements = [law, two, element("x", fmus[0], x_0=0.4)]
    links = [link("x.x", "one.in"), link("one.out", "two.in"), link("two.out", "x.u")]
    x = run(archive(tmp_path, fmus, elements, links), 0.04).columns["x.x"]
    state = [0.4]
    for k in range(4):  # all values exchanged at once: what comes through two gains is two steps old
        state.append(state[-1] - 1.9 * 0.7 * 0.01 * state[max(k - 2, 0)])
    assert x == pytest.approx(state, rel=1e-13)
    gone = archive(tmp_path, fmus, [law, two.replace("#law", "#lawn"), elements[2]], links)
    refused(gone, "component 'two' with source '#lawn' -- expected the id of a System of its description")


def test_texts_and_items_may_be_elements_of_their_own(foreign, tmp_path):
    """SSP 2.0, String and Enumeration."""
    fmu = foreign["typed"]
    own = element("t", fmu, text="a").replace('value="a"/>', "><ssv:Value value='two words'/></ssv:String>")
    assert run(archive(tmp_path, [fmu], [own], [])).columns["t.letters"].tolist()[1:] == [9] * 8
    description, gears = describe(fmu), Connector(items={"no gear": 0, "low": 1, "high": 4})
    for written, number in (("no gear", "0"), ("high low high 7", "4 1 4 7")):
        parameter = Parameter("n", written, "", {})
        assert parameter.of("t.n", description.ports["n"], description, gears) == number


def test_an_experiment_without_an_end_takes_a_second(foreign, tmp_path):
    """The quarter truck of ecos begins at 10 s."""
    begin = '<ssd:DefaultExperiment startTime="10"/>'
    with open_ssp(archive(tmp_path, [foreign["gain"]], [element("g", foreign["gain"])], [], begin)) as cases:
        experiment = cases["theirs"][1]
    assert (experiment.start, experiment.stop) == (10.0, 11.0)


@pytest.mark.parametrize("kinds", ["kinds_2", "kinds_3"])
def test_an_output_with_a_start_value_of_its_own_takes_another(in_c, tmp_path, kinds):
    """States of other tools (``initial="exact"``): the ball's height, x0 of Van der Pol's oscillator."""
    found = run(archive(tmp_path, [in_c[kinds]], [element("k", in_c[kinds], speed=-1.25, load=0.5)], [])).columns
    assert found["k.speed"] == pytest.approx(-1.25 + 0.01 * (1.0 + 0.37 * 0.5) * np.arange(9), rel=1e-13)
