"""Parts of an FMU one by one: connectors and icons, identity, the archive, what a host needs, faults of the library."""

from __future__ import annotations

import io
import sys
import zipfile
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest

from tsm_fmu.fmu import build, library_faults
from tsm_fmu.fmu.accompanying import document, documentation, licence, source_of
from tsm_fmu.fmu.archive import named, packed
from tsm_fmu.fmu.content import GUID_MARK, TAG_MARK, guid_of, is_native, recomputed_guid, tag_of
from tsm_fmu.fmu.description import interface
from tsm_fmu.fmu.native.arithmetic import Plain
from tsm_fmu.fmu.native.unit import Unit, reserved_names
from tsm_fmu.fmu.reference import checksum
from tsm_fmu.fmu.reference_check import reference_problems
from tsm_fmu.fmu.terminals import TERMINALS, terminals_and_icons
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.NAME)
def test_connectors_hold_the_signals_of_their_side_each_once(model: Any) -> None:
    fmu = interface(Kernel(model), model.NAME, {})
    files = terminals_and_icons(fmu, 3)
    assert set(files) == {"terminalsAndIcons/terminalsAndIcons.xml", "terminalsAndIcons/icon.png"}
    root = ElementTree.fromstring(files["terminalsAndIcons/terminalsAndIcons.xml"])
    assert root.get("fmiVersion") == "3.0"
    signals = [e.variable.name for e in fmu.entries if e.causality != "parameter"]
    found = {t.get("name"): [m.get("variableName") for m in t] for t in root.iter("Terminal")}
    assert found == {name: own for name, members in TERMINALS.items() if (own := [m for m in members if m in signals])}
    for member in root.iter("TerminalMemberVariable"):
        assert member.get("memberName") == member.get("variableName")
        assert member.get("variableKind") == "signal"
    assert {t.get("matchingRule") for t in root.iter("Terminal")} <= {"bus"}


def test_fmi_2_has_the_picture_at_the_top_too() -> None:
    fmu = interface(kernel("Sum"), "Sum", {})
    two, three = terminals_and_icons(fmu, 2), terminals_and_icons(fmu, 3)
    assert set(two) - set(three) == {"model.png"}
    assert two["model.png"] == two["terminalsAndIcons/icon.png"] == three["terminalsAndIcons/icon.png"]


CONTENT = {
    "modelDescription.xml": f'guid="{GUID_MARK}" {TAG_MARK}'.encode(),
    f"resources/a_{TAG_MARK}.py": f"{GUID_MARK} {TAG_MARK}".encode(),
    "binaries/linux64/a.so": f"\0{GUID_MARK} {TAG_MARK}".encode(),
}


def test_guid_and_tag_follow_from_the_content_and_stand_where_their_marks_were() -> None:
    guid = guid_of(CONTENT)
    assert guid == guid_of(dict(reversed(CONTENT.items())))
    tag = str(guid).replace("-", "")[:12]
    assert tag_of(guid) == tag
    files = named(CONTENT)
    assert files == {
        "modelDescription.xml": f'guid="{guid}" {tag}'.encode(),
        f"resources/a_{tag}.py": f"{guid} {tag}".encode(),
        "binaries/linux64/a.so": CONTENT["binaries/linux64/a.so"],
    }
    assert recomputed_guid(files, str(guid)) == guid
    assert not is_native(files)
    for path in files:
        changed = files | {path: files[path] + b" "}
        assert recomputed_guid(changed, str(guid)) != guid
    with pytest.raises(ValueError, match="hexadecimal"):
        recomputed_guid(files, "none")
    native = {**CONTENT, "sources/buildDescription.xml": b""}
    del native["binaries/linux64/a.so"]
    built = named(native) | {"binaries/linux64/a.so": b"compiled with the guid inside"}
    assert is_native(built)
    assert recomputed_guid(built, str(guid_of(native))) == guid_of(native)


def test_a_file_that_moves_or_splits_is_another_content() -> None:
    one = guid_of({"a": b"bc", "d": b""})
    assert one != guid_of({"a": b"b", "d": b"c"})
    assert one != guid_of({"ab": b"c", "d": b""})
    assert one.version == 5


def test_an_archive_is_its_files_in_order_with_rights_and_no_date() -> None:
    files = {"b.txt": b"two" * 500, "a.txt": b"one", "binaries/x.so": b"lib"}
    data = packed(files)
    assert data == packed(dict(reversed(files.items())))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.namelist() == ["a.txt", "b.txt", "binaries/x.so"]
        assert {name: archive.read(name) for name in archive.namelist()} == files
        rights = {i.filename: (i.external_attr >> 16, i.create_system, i.date_time) for i in archive.infolist()}
        assert archive.getinfo("b.txt").compress_size < 100
    for name, (mode, system, date) in rights.items():
        assert (mode, system, date) == (
            0o755 if name.startswith("b") and "/" in name else 0o644,
            3,
            (1980, 1, 1, 0, 0, 0),
        )


def test_the_newest_symbol_version_counts_by_number() -> None:
    library = b"\0GLIBC_2.9\0GLIBC_2.17\0GLIBC_2.2.5\0GLIBCXX_3.4.9\0GLIBCXX_3.4\0GLIBCXX_3.4.21\0xGLIBC_9.9"
    assert build._newest(rb"GLIBC", library) == "2.17"
    assert build._newest(rb"GLIBCXX", library) == "3.4.21"
    needs = build._needs(library)
    assert "Needs Python 3.10 or later" in needs
    assert needs.endswith("on Linux also glibc 2.17 and libstdc++ GLIBCXX_3.4.21 or later.")


def test_imports_are_turned_into_those_of_the_fmus_own_package() -> None:
    text = "from tsm_fmu.models import x\nfrom pythonfmu.enums import y\n    from tsm_fmu.z import w\nimport tsm_fmu\n"
    assert build._isolated(text) == (
        f"from tsm_fmu_{TAG_MARK}.models import x\nfrom tsm_fmu_{TAG_MARK}.pythonfmu.enums import y\n"
        "    from tsm_fmu.z import w\nimport tsm_fmu\n"
    )
    assert build._isolated("from tsm_fmu_other import x\n") == "from tsm_fmu_other import x\n"


def test_documents_say_what_the_model_says() -> None:
    module = ModuleType("m")
    module.__doc__, module.__dict__["SOURCE_TEXT"] = "\n a < b & c \n", "x = 1\n"
    page = documentation(SimpleNamespace(module=module), "Wrist")  # pyright: ignore[reportArgumentType]
    assert "<h1>Wrist</h1>" in page
    assert "<pre>a &lt; b &amp; c</pre>" in page
    assert source_of(module) == "x = 1\n"
    assert "def test_documents_say" in source_of(sys.modules[__name__])
    assert "MIT License" in licence("tsm-fmu")
    root = ElementTree.Element("a")
    ElementTree.SubElement(root, "b", c="1")
    assert document(root) == '<?xml version="1.0" encoding="UTF-8"?>\n<a>\n  <b c="1" />\n</a>\n'


def test_each_execution_of_a_script_holds_its_namespace_once_more(monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[Any] = []
    monkeypatch.setattr(library_faults, "_HELD", held)
    module = ModuleType("script_of_an_fmu")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for _ in range(2):
        library_faults.hold_namespace(module.__name__)
    library_faults.hold_namespace("no_such_script")
    assert held == [vars(module)] * 2
    assert held[0] is vars(module)


@pytest.mark.skipif(sys.platform != "linux", reason="the library that is let go is that of Linux")
def test_a_library_is_let_go_once_and_only_where_python_is_the_host(monkeypatch: pytest.MonkeyPatch) -> None:
    registered: list[Any] = []
    loaded = {
        "one.so": SimpleNamespace(finalizePythonInterpreter="end", _handle=7),
        "bare.so": SimpleNamespace(_handle=8),
    }
    monkeypatch.setattr(library_faults, "_LET_GO", set())
    monkeypatch.setattr(library_faults.atexit, "register", registered.append)

    def opened(library: str, mode: int) -> Any:
        if library not in loaded:
            raise OSError(library)
        return loaded[library]

    monkeypatch.setattr(library_faults.ctypes, "CDLL", opened)
    monkeypatch.setattr(library_faults, "FOREIGN_HOST", True)
    library_faults.let_go_at_exit("one.so")
    assert registered == []
    monkeypatch.setattr(library_faults, "FOREIGN_HOST", False)
    for name in ("one.so", "one.so", "bare.so", "none.so"):
        library_faults.let_go_at_exit(name)
    assert registered == ["end"]
    monkeypatch.setattr(library_faults.sys, "platform", "darwin")
    loaded["two.so"] = SimpleNamespace(finalizePythonInterpreter="other", _handle=9)
    library_faults.let_go_at_exit("two.so")
    assert registered == ["end"]


MAIN = """
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
from z_other_file import RATE as THEIRS, law, twice as doubled
NAME = "Tried"
RATE = 2.5
class Params(NamedTuple):
    k: Annotated[float, Quantity("1", "gain")] = 1.0
class State(NamedTuple):
    x: Annotated[float, Quantity("1", "state")]
class Inputs(NamedTuple):
    u: Annotated[float, Quantity("1", "input")]
class Outputs(NamedTuple):
    y: Annotated[float, Quantity("1", "output")]
PRESETS = {}
def twice(a: float) -> float:
    return 2.0 * a * RATE
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.u), Outputs(u.u)
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return State(twice(u.u) + RATE), Outputs(law(u.u) + doubled(s.x))
"""
OTHER = '''
"""Laws of another file. */

Second line."""
RATE = 7.5
COUNT = 3
def twice(a: float) -> float:
    return a + a
def law(a: float) -> float:
    return RATE * twice(a) * COUNT
'''


def test_names_of_two_files_are_told_apart_by_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    made = {}
    for name, text in (("z_other_file", OTHER), ("m.tried", MAIN)):
        module = made[name] = ModuleType(name)
        module.__dict__.update(SOURCE_TEXT=text, __file__=f"{name}.py")
        monkeypatch.setitem(sys.modules, name, module)
        exec(compile(text, name, "exec", dont_inherit=True), module.__dict__)  # noqa: S102  our own text
    unit = Unit(made["m.tried"], Plain())
    assert [law.c_name for law in unit.laws] == ["start", "twice", "z_other_file_twice", "law", "step"]
    assert unit.constants == {"RATE": 2.5, "z_other_file_RATE": 7.5, "COUNT": 3}
    text = "\n".join(unit.functions())
    places = [text.index(part) for part in ("/* ---- z_other_file: ", "law(", "/* ---- tried */", "step(")]
    assert places == sorted(places)
    assert "/* ---- z_other_file: Laws of another file. * /\n *\n * Second line.\n */" in text
    assert "return z_other_file_RATE * z_other_file_twice(a) * (double)COUNT;" in text
    assert {"sin", "fmod", "Fault", "NEVER"} <= reserved_names()


def test_reference_results_without_rows_or_with_other_variables_are_named() -> None:
    """The manifest lists an experiment whose files do not fit the description."""
    folder = "extra/org.fmi-standard.fmi-ls-ref"
    description = ElementTree.fromstring(
        '<d><ModelVariables><V name="u" causality="input"/><V name="y" causality="output"/>'
        '<V name="k" causality="parameter" start="2.0"/></ModelVariables></d>'
    )

    def problems(**changed: str) -> list[str]:
        texts = {
            "one.exp": '<E><Experiment name="one" stopTime="0.5" stepSize="0.25"><Parameters source="p.ssv"/>'
                       '<Stimuli source="in.csv"/><References source="out.csv"/></Experiment></E>',
            "in.csv": '"time","u"\n0.0,1\n0.25,2\n0.5,3\n', "out.csv": '"time","y"\n0.0,1\n0.25,2\n0.5,3\n',
            "p.ssv": '<s xmlns:v="x"><v:Parameter name="k"><v:Real value="2.0"/></v:Parameter></s>',
        } | {k.replace("_", "."): v for k, v in changed.items()}  # fmt: skip
        listed = "".join(
            f'<R role="{role}" source="{n}" checksum="{checksum(t.encode())}"/>'
            for n, t in texts.items()
            for role in ["experiment/x" if n.endswith("exp") else "other"]
        )
        files = {f"{folder}/{n}": t.encode() for n, t in texts.items()} | {
            f"{folder}/fmi-ls-manifest.xml": f"<m>{listed}</m>".encode()
        }
        return reference_problems(description, files)

    assert problems() == []
    assert problems(in_csv='"time","u"\n0.0,1\n0.25,2\n') != []
    for name, text, said in (
        ("in_csv", '"time","u"\n0.0,1\n0.25,2\n0.5,3\n0.75,4\n', None),
        ("in_csv", '"time","u"\n', "has not a row at every 0.25 s up to 0.5 s"),
        ("out_csv", '"time","y"\n0.0,1\n0.25,2,3\n0.5,3\n', "has 3 cells in line 3 -- expected 2"),
        ("out_csv", '"time","y"\n0.0,1\n0.25,nan\n0.5,3\n', "line 3, is 'nan' -- expected a finite number"),
        ("p_ssv", '<s xmlns:v="x"/>', "p.ssv differs in k -- expected the FMU's start values"),
        ("one_exp", '<E><Experiment name="one" stopTime="x" stepSize="0.25"/></E>', "stopTime of an experiment is 'x'"),
        ("one_exp", '<E><Experiment name="one" stopTime="0.5" stepSize="0.25"/></E>', "one names no Stimuli"),
    ):  # fmt: skip
        found = problems(**{name: text})
        assert (found == []) is (said is None)
        if said is not None:
            assert len(found) == 1
            assert said in found[0]
