"""SSP 1.0: what is written is valid, read by others, and comes back; what is damaged is named."""

import re
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy.ssp
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from lxml import etree

from tsm_fmu import InputError
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import open_ssp, write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System

EXPERIMENT = Experiment(stop=0.7, step=0.01, start=0.2, method="jacobi", evaluate_from=0.3, tracking_error="x.x")


@pytest.fixture
def system(foreign):
    components = (
        Component("x", foreign["integrator"], {"x_0": 0.1 + 0.2}),
        Component("g", foreign["gain"], {"k": -2.7, "u_2": 0.0}),
        Component("p", foreign["units"], {"speed": 0.0, "kelvin": 0.0}),
        Component("t", foreign["typed"], {"n": 3, "flag": True, "text": "a < b & c"}),
    )
    connections = (
        Connection("x.x", "g.u", factor=1.5, offset=-0.25),
        Connection("g.y", "x.u"),
        Connection("p.angle_rad", "p.angle", convert_units=False),
    )
    return System(components, connections, "loop")


@pytest.fixture
def written(system, tmp_path):
    return write_ssp(tmp_path / "loop.ssp", (system, EXPERIMENT))


def rewritten(old: Path, new: Path, change) -> Path:
    with zipfile.ZipFile(old) as source, zipfile.ZipFile(new, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            target.writestr(name, change(content.decode()) if name == "SystemStructure.ssd" else content)
    return new


def test_round_trip_keeps_everything_and_the_numbers(system, written):
    with open_ssp(written) as cases:
        assert list(cases) == ["loop"]
        again, experiment = cases["loop"]
        assert experiment == EXPERIMENT
        assert again.name == "loop"
        assert again.connections == system.connections
        for old, new in zip(system.components, again.components, strict=True):
            assert (old.name, old.fmu.read_bytes()) == (new.name, new.fmu.read_bytes())
            assert {k: str(v).lower() for k, v in old.parameters.items()} == {
                k: str(v).lower() for k, v in new.parameters.items()
            }
        first, second = (simulate_system(s, 0.7, 0.01, method="jacobi") for s in (system, again))
    for column, values in first.columns.items():
        assert np.array_equal(values, second.columns[column]), column


def test_two_writings_are_byte_equal(system, written, tmp_path):
    assert write_ssp(tmp_path / "again.ssp", (system, EXPERIMENT)).read_bytes() == written.read_bytes()


def test_the_description_is_valid_and_read_by_fmpy(written):
    schema = Path(fmpy.ssp.__file__).parent / "schema" / "SystemStructureDescription.xsd"
    with zipfile.ZipFile(written) as archive:
        tree = etree.fromstring(archive.read("SystemStructure.ssd"))
    etree.XMLSchema(etree.parse(schema)).assertValid(tree)
    described = read_ssd(written)
    assert [e.name for e in described.system.elements] == ["x", "g", "p", "t"]
    assert len(described.system.connections) == 3


def with_variant(first: Path, second: Path, path: Path, change=lambda text: text) -> Path:
    """An archive with the description of another one beside its own."""
    with zipfile.ZipFile(second) as other:
        text = change(other.read("SystemStructure.ssd").decode())
    with zipfile.ZipFile(first) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
        new.writestr("variant.ssd", text)
    return path


def test_further_descriptions_are_variants_and_a_bad_one_does_not_block_the_first(system, written, tmp_path):
    other = write_ssp(tmp_path / "b.ssp", (replace(system.with_values({"g.k": "-1.9"}), name="other"), EXPERIMENT))
    both = with_variant(written, other, tmp_path / "both.ssp")
    with open_ssp(both) as cases:
        found = {n: float(dict(s.components[1].parameters)["k"]) for n, (s, _) in cases.items()}
    assert found == {"loop": -2.7, "other": -1.9}
    for change, said in (
        (lambda text: text[:300], "cannot be read"),
        (lambda text: text.replace('version="1.0" name="other"', 'version="7.3" name="other"'), "is of version '7.3'"),
    ):
        bad = with_variant(written, other, tmp_path / "bad.ssp", change)
        with open_ssp(bad) as cases:
            assert list(cases) == ["loop"]
            notes = cases["loop"][0].notes
            assert notes[-1].startswith("variant.ssd is left out: SSP ")
            assert said in notes[-1]


def test_parameters_of_the_whole_system_and_a_missing_step(written, tmp_path):
    def change(text):
        text = re.sub(r"<ssd:Annotations>.*?</ssd:Annotations>", "", text, flags=re.DOTALL)
        binding = (
            '<ssd:ParameterBindings><ssd:ParameterBinding prefix="g."><ssd:ParameterValues>'
            '<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="k"><ssv:Real value="-0.4"/>'
            "</ssv:Parameter></ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>"
            "</ssd:ParameterBindings><ssd:Elements>"
        )
        return text.replace("<ssd:Elements>", binding, 1)

    with open_ssp(rewritten(written, tmp_path / "new.ssp", change)) as cases:
        system, experiment = cases["loop"]
        assert system.components[1].parameters["k"] == "-0.4"
        assert (experiment.start, experiment.stop, experiment.step) == (0.2, 0.7, 1e-3)


CHANGES = {
    "half": (lambda t: t[: len(t) // 2], "SystemStructure.ssd cannot be read ("),
    "other root": (lambda t: "<a/>", "has the root 'a' -- expected SystemStructureDescription of SSP 1.0"),
    "other namespace": (lambda t: t.replace("/SSP1/SystemStructureDescription", "/SSP9/x"), "has the root"),
    "version": (
        lambda t: t.replace('version="1.0" name="loop"', 'version="3.1" name="loop"'),
        "is of version '3.1' -- expected 1.0 or 2.0",
    ),
    "dictionary": (
        lambda t: t.replace("<ssd:Elements>", '<ssd:Elements><ssd:SignalDictionaryReference name="d"/>', 1),
        "refers to the signal dictionary ''",
    ),
    "no fmu": (lambda t: t.replace("resources/Gain.fmu", "resources/None.fmu"), "component 'g' with source"),
    "outside": (lambda t: t.replace("resources/Gain.fmu", "../Gain.fmu"), "expected an FMU inside the archive"),
    "number": (lambda t: t.replace('factor="1.5"', 'factor="much"'), "'much' -- expected a number"),
    "indices": (
        lambda t: t.replace('startElement="x"', 'startElement="x" startIndices="1"'),
        "connection x.x -> g.u has startIndices '1' -- expected whole arrays",
    ),
    "mapping": (
        lambda t: re.sub(r"<ssc:LinearTransformation[^>]*>", "<ssc:IntegerMappingTransformation/>", t),
        "connection x.x -> g.u has a mapping of type Integer on Real ports",
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_is_damaged_or_not_supported_is_named_in_one_line(written, tmp_path, name):
    change, message = CHANGES[name]
    path = rewritten(written, tmp_path / "new.ssp", change)
    with pytest.raises(InputError, match=re.escape(str(path)) + ".*" + re.escape(message)) as caught, open_ssp(path):
        pass
    assert "\n" not in str(caught.value)


def test_missing_empty_and_cut_archives_are_named(written, tmp_path):
    cut, empty = tmp_path / "cut.ssp", tmp_path / "empty.ssp"
    cut.write_bytes(written.read_bytes()[:10_000])
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("readme.txt", "nothing")
    cases = {tmp_path / "none.ssp": "existing", cut: "cannot be unpacked", empty: "has no SystemStructure.ssd"}
    for path, message in cases.items():
        with pytest.raises(InputError, match=f"SSP .*{message}"), open_ssp(path):
            pass


def test_names_are_identifiers_and_all_parameter_sets_have_one_name(system, tmp_path):
    path = write_ssp(tmp_path / "dot.ssp", (replace(system, name="periodic.law 1"), EXPERIMENT))
    with zipfile.ZipFile(path) as archive:
        assert [n for n in archive.namelist() if n.endswith(".ssd")] == ["SystemStructure.ssd"]
        tree = etree.fromstring(archive.read("SystemStructure.ssd"))
    names = [node.get("name") for node in tree.iter() if node.tag.endswith(("}System", "}Component", "Description"))]
    assert names == ["periodic_law_1", "periodic_law_1", "x", "g", "p", "t"]
    sets = {node.get("name") for node in tree.iter() if node.tag.endswith("}ParameterSet")}
    assert len(sets) == 1
    odd = System((Component("my part", system.components[0].fmu),), ())
    with pytest.raises(InputError, match=r"component name 'my part' -- expected an identifier"):
        write_ssp(tmp_path / "odd.ssp", (odd, EXPERIMENT))


def test_two_fmus_of_one_file_name_stay_two(foreign, tmp_path):
    folders = {name: tmp_path / name for name in ("a", "b")}
    for name, source in zip(folders, ("gain", "units"), strict=True):
        folders[name].mkdir()
        (folders[name] / "Unit.fmu").write_bytes(foreign[source].read_bytes())
    parts = [Component(n, folders[f] / "Unit.fmu", {}) for n, f in (("p", "a"), ("q", "b"), ("r", "a"), ("s", "b"))]
    path = write_ssp(tmp_path / "both.ssp", (System(tuple(parts), ()), EXPERIMENT))
    with zipfile.ZipFile(path) as archive:
        assert sum(name.endswith(".fmu") for name in archive.namelist()) == 2  # each once, however often it is used
    with open_ssp(path) as cases:
        ((system, _),) = cases.values()
        for component, source in zip(system.components, ("gain", "units") * 2, strict=True):
            assert component.fmu.read_bytes() == foreign[source].read_bytes()


@pytest.mark.parametrize("steps", [("0.02", "0.005", "0.3"), ("0.005", "0.3"), ("0.3",)])
def test_without_a_step_of_its_own_an_experiment_takes_the_smallest_that_an_fmu_proposes(foreign, tmp_path, steps):
    parts = [Component("plain", foreign["gain"], {"u": 0.0, "u_2": 0.0})]
    for k, step in enumerate(steps):
        proposed = f'<DefaultExperiment startTime="0" stepSize="{step}"/><ModelVariables>'

        def propose(text, proposed=proposed):
            return re.sub("<DefaultExperiment[^>]*/>", "", text).replace("<ModelVariables>", proposed, 1)

        fmu = redescribed(foreign["units"], tmp_path / f"u{k}.fmu", propose)
        parts.append(Component(f"u{k}", fmu, {"angle": 0.0, "speed": 0.0, "kelvin": 0.0}))
    written = write_ssp(tmp_path / "a.ssp", (System(tuple(parts), (), "one"), EXPERIMENT))

    def without(text):
        return re.sub(r"<ssd:Annotations>.*?</ssd:Annotations>", "", text, flags=re.DOTALL)

    with open_ssp(rewritten(written, tmp_path / "b.ssp", without)) as cases:
        ((_, experiment),) = cases.values()
    assert experiment.step == min(map(float, steps))


def redescribed(fmu: Path, path: Path, change) -> Path:
    """The same FMU with another model description."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, change(text.decode()) if name == "modelDescription.xml" else text)
    return path
