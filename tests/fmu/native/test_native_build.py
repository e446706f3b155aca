"""Files of a native FMU: what is there for each version, one piece of C that compiles, and how it is to be compiled."""

from __future__ import annotations

import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tsm_fmu.fmu.description import interface
from tsm_fmu.fmu.native import build
from tsm_fmu.fmu.native.build import native_files, sources_of
from tsm_fmu.fmu.native.zig import c_compiler
from tsm_fmu.kernels.kernel import kernel

from .test_interface_source import heads

BACKLASH = kernel("PairedTsmBacklash")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """What the compiler was asked for; it gives one library."""
    told: list[tuple] = []

    def binaries(*given: object) -> dict[str, bytes]:
        told.append(given)
        return {"binaries/x/Wrist.so": b"GUID"}

    monkeypatch.setattr(build, "binaries", binaries)
    return told


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_has_description_sources_documents_and_libraries(asked: list[tuple], fmi: int) -> None:
    files = native_files(BACKLASH, "Wrist", BACKLASH.params(values={"alpha": 9.0}), {"alpha": 9.0}, fmi, ["linux64"])
    xml = ElementTree.fromstring(files["modelDescription.xml"])
    assert xml.get("fmiVersion") == f"{fmi}.0"
    guid = xml.get("guid" if fmi == 2 else "instantiationToken")
    assert xml.get("modelName") == "Wrist"
    starts = {v.get("name"): v[0].get("start") if fmi == 2 else v.get("start")
              for v in xml.find("ModelVariables") or ()}  # fmt: skip
    assert starts["alpha"] == "9.0"
    capable = xml.find("CoSimulation")
    assert capable is not None
    state = "canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState"
    for capability in ("canHandleVariableCommunicationStepSize", state):
        assert capable.get(capability) == "true"
    assert "needsExecutionTool" not in capable.attrib
    assert {c.get("name") for c in xml.iter("Category")} == set(build.LOG_CATEGORIES)
    description = ElementTree.fromstring(files["sources/buildDescription.xml"])
    (configuration,) = description
    assert configuration.get("modelIdentifier") == "Wrist"
    assert [n.get("name") for n in description.iter("SourceFile")] == ["all.c"]
    assert "-ffp-contract=off" in configuration[0].get("compilerOptions", "")
    assert [n.get("name") for n in description.iter("Library")] == ["m"]
    sources = {path.removeprefix("sources/") for path in files if path.startswith("sources/")}
    other = 5 - fmi
    assert {
        f"fmi{fmi}.c",
        f"fmi{fmi}_step.c",
        "slave.c",
        "interface.c",
        "constants.h",
        "PairedTsmBacklash.c",
    } <= sources
    assert not [s for s in sources if s.startswith(f"fmi{other}")]
    assert f'#define MODEL_GUID "{guid}"'.encode() in files["sources/constants.h"]
    assert files["binaries/x/Wrist.so"] == b"GUID"
    assert {"documentation/index.html", "documentation/licenses/license.txt"} <= set(files)
    ((compiled, *given),) = asked
    assert given == ["all.c", "Wrist", fmi, ["linux64"]]
    assert compiled == {path.removeprefix("sources/"): d for path, d in files.items() if path.startswith("sources/")}


def test_every_source_is_included_once_steps_before_the_rest() -> None:
    for fmi in (2, 3):
        files = sources_of(BACKLASH, interface(BACKLASH, "Wrist", {}), fmi)
        small, fast = files["all.c"].split("#ifdef SMALL")[1].split("#else")
        fast, rest = fast.split("#endif\n", 1)
        named = [[line.split('"')[1] for line in part.splitlines() if line.startswith("#include")]
                 for part in (small, fast, rest)]  # fmt: skip
        assert named[0] == named[1] == ["PairedTsmBacklash.c", "interface.c", "step.c", f"fmi{fmi}_step.c"]
        assert sorted([*named[1], *named[2]]) == sorted(f for f in files if f.endswith(".c") and f != "all.c")
        assert named[2] == sorted(named[2])


@pytest.mark.parametrize(("fmi", "options"), [(2, ()), (3, ("-DSMALL",))])
def test_the_one_piece_compiles_without_a_warning(fmi: int, options: tuple[str, ...], tmp_path: Path) -> None:
    for name, text in sources_of(BACKLASH, interface(BACKLASH, "Wrist", {}), fmi).items():
        (tmp_path / name).write_text(text)
    flags = ["-std=c99", "-O0", "-fPIC", "-shared", "-fvisibility=hidden", "-Wall", "-Werror", *options]
    command = [*c_compiler(), *flags, "all.c", "-lm", "-o", "it.so"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    exported = (tmp_path / "it.so").read_bytes()
    assert f"fmi{fmi}DoStep".encode() in exported


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_parameter_set_has_arrays_one_by_one_where_the_fmu_has_them_so(asked: list[tuple], fmi: int) -> None:
    k = kernel("LebusTransmission")
    files = native_files(k, "L", k.params(), {}, fmi)
    (text,) = (d for path, d in files.items() if path.endswith(".ssv"))
    names = {n.get("name") for n in ElementTree.fromstring(text).iter() if n.tag.endswith("Parameter")}
    several = {v.name for v, head in zip(k.parameters, heads(k), strict=False) if head != 1}
    assert several
    assert names == {v.name for v in k.parameters} - (several if fmi == 3 else set())
