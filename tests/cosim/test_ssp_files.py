"""Other people's SSPs: folders, descriptions in folders, files inside FMUs, dictionaries, steps of other tools."""

import re
import zipfile

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu import InputError
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import open_ssp
from tsm_fmu.cosim.system import Component, Connection, System

SSP = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = " ".join(
    f'xmlns:{prefix}="{SSP}{name}"'
    for prefix, name in {
        "ssd": "Description",
        "ssc": "Common",
        "ssv": "ParameterValues",
        "ssm": "ParameterMapping",
        "ssb": "SignalDictionary",
    }.items()
)


def description(body, rest=""):
    return (
        f'<ssd:SystemStructureDescription {NAMESPACES} version="1.0" name="theirs">'
        f'<ssd:System name="s">{body}</ssd:System>{rest}</ssd:SystemStructureDescription>'
    )


def values(name, number):
    parameter = f'<ssv:Parameter name="{name}"><ssv:Real value="{number}"/></ssv:Parameter>'
    return (
        f'<ssv:ParameterSet {NAMESPACES} version="1.0" name="p"><ssv:Parameters>{parameter}</ssv:Parameters>'
        "</ssv:ParameterSet>"
    )


def component(name, fmu, inside="", more=""):
    return f'<ssd:Component name="{name}" source="{fmu}" {more}>{inside}</ssd:Component>'


def bindings(*each):
    return f"<ssd:ParameterBindings>{''.join(each)}</ssd:ParameterBindings>"


def inline(name, number):
    table = f"<ssd:ParameterValues>{values(name, number)}</ssd:ParameterValues>"
    return f"<ssd:ParameterBinding>{table}</ssd:ParameterBinding>"


@pytest.fixture
def folder(foreign, tmp_path):
    """An unpacked SSP with FMUs in a folder of its own."""
    place = tmp_path / "theirs"
    (place / "parts" / "fmus").mkdir(parents=True)
    for fmu in ("gain", "integrator"):
        (place / "parts" / "fmus" / foreign[fmu].name).write_bytes(foreign[fmu].read_bytes())
    return place


def packed(folder):
    path = folder.with_suffix(".ssp")
    with zipfile.ZipFile(path, "w") as archive:
        for file in folder.rglob("*"):
            archive.write(file, file.relative_to(folder))
    return path


def written(folder, body, rest=""):
    (folder / "SystemStructure.ssd").write_text(description(body, rest), encoding="utf-8")
    return packed(folder)


def test_sources_of_a_description_count_from_its_own_folder(folder):
    inner = component("i", "fmus/Integrator.fmu", bindings('<ssd:ParameterBinding source="fmus/own%20set.ssv"/>'))
    (folder / "parts" / "fmus" / "own set.ssv").write_text(values("x_0", 0.37))
    (folder / "parts" / "inner.ssd").write_text(description(f"<ssd:Elements>{inner}</ssd:Elements>"))
    nested = component("part", "parts/inner.ssd", bindings(inline("i.u", 0.7)), 'type="application/x-ssp-definition"')
    path = written(folder, f"<ssd:Elements>{nested}</ssd:Elements>")
    for what in (path, folder):
        with open_ssp(what) as cases:
            (found,) = cases["theirs"][0].components
            assert (found.name, found.parameters) == ("part_i", {"x_0": "0.37", "u": "0.7"})


def test_an_ssp_inside_an_ssp_is_the_nested_system_that_it_holds(folder, tmp_path, foreign):
    """Its own FMUs, sets and variant; parameters of the component go first; the bits of the flat one."""
    inside = tmp_path / "inside"
    (inside / "resources").mkdir(parents=True)
    (inside / "resources" / "Gain.fmu").write_bytes(foreign["gain"].read_bytes())
    (inside / "own.ssv").write_text(values("g.k", -1.9))
    law = component("g", "resources/Gain.fmu")
    connectors = '<ssd:Connectors><ssd:Connector name="in" kind="input"/><ssd:Connector name="out" kind="output"/>'
    ends = (
        '<ssd:Connections><ssd:Connection startConnector="in" endElement="g" endConnector="u"/>'
        '<ssd:Connection startElement="g" startConnector="y" endConnector="out"/></ssd:Connections>'
    )
    own = bindings('<ssd:ParameterBinding source="own.ssv"/>', inline("g.u_2", 0.9))
    system = f"{connectors}</ssd:Connectors>{own}<ssd:Elements>{law}</ssd:Elements>{ends}"
    (inside / "variant.ssd").write_text(description(system))
    packed_inside = written(inside, system.replace("own.ssv", "none.ssv"))  # the default one would be refused
    (folder / "parts" / "law one.ssp").write_bytes(packed_inside.read_bytes())
    nested = component(
        "law",
        "parts/law%20one.ssp#variant.ssd",
        bindings(inline("g.u_2", 0.2)),
        'type="application/x-ssp-package"',
    )
    body = (
        f"<ssd:Elements>{nested}{component('x', 'parts/fmus/Integrator.fmu', bindings(inline('x_0', 0.4)))}"
        '</ssd:Elements><ssd:Connections><ssd:Connection startElement="x" startConnector="x" endElement="law" '
        'endConnector="in"/><ssd:Connection startElement="law" startConnector="out" endElement="x" endConnector="u"/>'
        "</ssd:Connections>"
    )
    flat = System(
        (
            Component("law_g", foreign["gain"], {"k": -1.9, "u_2": 0.2}),
            Component("x", foreign["integrator"], {"x_0": 0.4}),
        ),
        (Connection("x.x", "law_g.u"), Connection("law_g.y", "x.u")),
    )
    expected = simulate_system(flat, 0.5, 0.01).columns["x.x"]
    with open_ssp(written(folder, body)) as cases:
        found = simulate_system(cases["theirs"][0], 0.5, 0.01).columns["x.x"]
    assert np.array_equal(found, expected)
    assert np.ptp(found) > 0.1
    for source, message in (
        ("parts/none.ssp", "component 'law' with source 'parts/none.ssp' -- expected an SSP inside the archive"),
        ("parts/law%20one.ssp#none.ssd", "component 'law' with description 'none.ssd' -- expected a file inside"),
        ("parts/law%20one.ssp", "parameter source 'none.ssv'"),
        ("parts/fmus/Gain.fmu", "component 'law' with description 'SystemStructure.ssd' -- expected"),
    ):
        gone = written(folder, body.replace("parts/law%20one.ssp#variant.ssd", source))
        with pytest.raises(InputError, match=re.escape(message)) as caught, open_ssp(gone):
            pass
        assert "\n" not in str(caught.value)


def test_a_description_that_holds_itself_is_refused(folder):
    nested = component("again", "SystemStructure.ssd", "", 'type="application/x-ssp-definition"')
    message = "system again.again.again.again... is nested more than 50 times"
    with (
        pytest.raises(InputError, match=re.escape(message)),
        open_ssp(written(folder, f"<ssd:Elements>{nested}</ssd:Elements>")),
    ):
        pass


def test_a_folder_runs_as_its_archive_does(folder):
    body = f"<ssd:Elements>{component('i', 'parts/fmus/Integrator.fmu', bindings(inline('u', 0.7)))}</ssd:Elements>"
    path = written(folder, body, '<ssd:DefaultExperiment stopTime="0.3"/>')
    one, other = (tsm.run(what, step=0.1).to_frame() for what in (path, folder))
    assert one.equals(other)
    assert one.filter(like="i.x").iloc[-1, 0] == pytest.approx(0.21, rel=1e-14)
    with pytest.raises(InputError, match=r"has no SystemStructure\.ssd"), open_ssp(folder / "parts"):
        pass


def test_a_parameter_set_inside_the_fmu_of_its_component(folder):
    fmu = folder / "parts" / "fmus" / "Integrator.fmu"
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr("extra/start.ssv", values("x_0", -0.19))
    binding = '<ssd:ParameterBinding sourceBase="component" source="{}"/>'
    body = f"<ssd:Elements>{component('i', 'parts/fmus/Integrator.fmu', bindings(binding))}</ssd:Elements>"
    with open_ssp(written(folder, body.format("extra/start.ssv"))) as cases:
        assert cases["theirs"][0].components[0].parameters["x_0"] == "-0.19"
    message = (
        "parameter source 'extra/none.ssv' of component 'i' -- expected a file inside Integrator.fmu -- pack it in"
    )
    with pytest.raises(InputError, match=re.escape(message)), open_ssp(written(folder, body.format("extra/none.ssv"))):
        pass


# the integrator writes into the dictionary of the outer system, the gain of an inner one reads from it, and back
BUS = """<ssd:Elements>
 <ssd:SignalDictionaryReference name="here" dictionary="bus"/>{integrator}
 <ssd:System name="inner"><ssd:Elements><ssd:SignalDictionaryReference name="there" dictionary="bus"/>{gain}
  </ssd:Elements>
  <ssd:Connections>
   <ssd:Connection startElement="there" startConnector="x" endElement="g" endConnector="u"/>
   <ssd:Connection startElement="g" startConnector="y" endElement="there" endConnector="dx">
    <ssc:LinearTransformation factor="0.5" offset="0.1"/></ssd:Connection>
  </ssd:Connections></ssd:System>
</ssd:Elements>
<ssd:Connections>
 <ssd:Connection startElement="i" startConnector="x" endElement="here" endConnector="x"/>
 <ssd:Connection startElement="here" startConnector="dx" endElement="i" endConnector="u"/>
</ssd:Connections>
<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" {source}</ssd:SignalDictionary></ssd:SignalDictionaries>"""
ENTRIES = f"""<ssb:SignalDictionary {NAMESPACES} version="1.0">
<ssb:DictionaryEntry name="x"><ssc:Real/></ssb:DictionaryEntry>
<ssb:DictionaryEntry name="dx"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary>"""


@pytest.mark.parametrize("source", [f">{ENTRIES}", 'source="parts/bus.ssb">'])
def test_a_signal_dictionary_connects_what_is_connected_to_it(folder, foreign, source):
    (folder / "parts" / "bus.ssb").write_text(ENTRIES)
    body = BUS.format(
        integrator=component("i", "parts/fmus/Integrator.fmu", bindings(inline("x_0", 0.8))),
        gain=component("g", "parts/fmus/Gain.fmu", bindings(inline("k", -1.9))),
        source=source,
    )
    flat = System(
        (
            Component("i", foreign["integrator"], {"x_0": 0.8}),
            Component("g", foreign["gain"], {"k": -1.9, "u_2": 0.0}),
        ),
        (Connection("i.x", "g.u"), Connection("g.y", "i.u", 0.5, 0.1)),
    )
    expected = simulate_system(flat, 0.5, 0.01).columns["i.x"]
    with open_ssp(written(folder, body)) as cases:
        found = simulate_system(cases["theirs"][0], 0.5, 0.01).columns["i.x"]
    assert found == pytest.approx(expected, rel=1e-13)
    assert np.ptp(found) > 0.1
    gone = written(folder, body.replace('name="there" dictionary="bus"', 'name="there" dictionary="tram"'))
    message = "inner.there refers to the signal dictionary 'tram' -- expected one that its system"
    with pytest.raises(InputError, match=re.escape(message)), open_ssp(gone):
        pass


HINT = "<ssd:Annotations><ssc:Annotation type='osp'><osp:StepSizeHint value='{}'/></ssc:Annotation></ssd:Annotations>"
VARIES = "another tool varies the step: here it is fixed, at most its longest, unless --step-error divides it"
SLOW = "component i asks for steps of 0.05 s: it is stepped with all others, every 0.0125 s"


@pytest.mark.parametrize(
    ("system", "experiment", "hints", "notes"),
    [
        ('<oms:Annotations xmlns:oms="o"><oms:FixedStepMaster stepSize="0.0125"/></oms:Annotations>', "", [], ()),
        ('<oms:VariableStepMaster minimumStepSize="1e-9" maximumStepSize="0.0125"/>', "", [], (VARIES,)),
        ("", '<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="125e-4"/></osp:Algorithm>', ["0.05"], (SLOW,)),
        ("", "", ["0.05", "0.0125"], (SLOW,)),
        ("", "stepSize", ["0.0125"], ()),
    ],
)
def test_the_step_that_another_tool_noted(folder, system, experiment, hints, notes):
    """Of the system, of the experiment, of single components, of an attribute as FMI has it; what differs is said."""
    attribute = 'stepSize="0.0125"' if experiment == "stepSize" else ""
    inside = [
        f'<ssd:Annotations><ssc:Annotation type="them">{text}</ssc:Annotation></ssd:Annotations>'
        for text in (system, "" if attribute else experiment)
    ]
    parts = [
        component(name, "parts/fmus/Integrator.fmu", bindings(inline("u", 0.1)) + HINT.format(hint))
        for name, hint in zip("ij", hints or ["0"], strict=False)
    ]
    rest = f'<ssd:DefaultExperiment stopTime="0.5" {attribute}>{inside[1]}</ssd:DefaultExperiment>'
    with open_ssp(written(folder, f"<ssd:Elements>{''.join(parts)}</ssd:Elements>{inside[0]}", rest)) as cases:
        found, own = cases["theirs"]
        assert (own.stop, own.step) == (0.5, 0.0125)
        assert found.notes == notes


def test_what_cannot_be_as_the_author_meant_is_said(folder):
    mapping = (
        '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="" target="i.u"/>'
        '<ssm:MappingEntry source="none" target="i.u"/>'
        '<ssm:MappingEntry source="all" target="i.x_0"/></ssm:ParameterMapping></ssd:ParameterMapping>'
    )
    both = inline("all", 0.3).replace("</ssd:ParameterBinding>", f"{mapping}</ssd:ParameterBinding>")
    owned = component("i", "parts/fmus/Integrator.fmu", bindings(inline("x", 4.0)), 'implementation="ModelExchange"')
    with open_ssp(written(folder, f"{bindings(both)}<ssd:Elements>{owned}</ssd:Elements>")) as cases:
        system, _ = cases["theirs"]
    assert system.components[0].parameters == {"x_0": "0.3", "u": "0"}  # an entry that names no source says nothing
    assert system.notes == (
        "a mapping names the parameter none for i.u, which its set does not have: left out",
        "component i is meant for ModelExchange: its co-simulation runs instead",
        "parameter i.x is left out: the FMU has an output there",
        "nothing drives i.u = 0: the FMU's own start values stay",
    )


def test_names_that_are_no_identifiers_run_and_are_written_again(folder, tmp_path):
    """Blanks, digits, brackets, and two that would become one."""
    names = ("DP Controller", "1st", "arm[2]", "arm 2 ")
    each = "".join(component(n, "parts/fmus/Integrator.fmu", bindings(inline("u", 0.2))) for n in names)
    link = f'<ssd:Connection startElement="{names[0]}" startConnector="x" endElement="{names[1]}" endConnector="u"/>'
    path = written(folder, f"<ssd:Elements>{each}</ssd:Elements><ssd:Connections>{link}</ssd:Connections>")
    found = tsm.run(path, out=tmp_path / "out", step=0.1, stop=0.3).to_frame()
    assert {c.partition(".")[0] for c in found if "." in c} == {"DP_Controller", "_1st", "arm_2_", "arm_2__"}
    again = tsm.run(tmp_path / "out" / "theirs.ssp", step=0.1, stop=0.3).to_frame()
    assert np.array_equal(again.to_numpy(), found.to_numpy())
