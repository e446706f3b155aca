"""FMUs that are not ours: small PythonFMU units and units in C, built once in a session."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from pythonfmu.builder import FmuBuilder


@pytest.fixture(scope="session")
def foreign(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("foreign")
    scripts = sorted((Path(__file__).parent / "foreign").glob("*.py"))
    return {script.stem: Path(FmuBuilder.build_FMU(script, dest=folder)) for script in scripts}


@pytest.fixture(scope="session")
def in_c(tmp_path_factory) -> dict[str, Path]:
    """Units written in C: what PythonFMU cannot do, FMI 3.0 and moods that take the process with them."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or not sys.platform.startswith("linux"):
        pytest.skip("units in C are compiled with cc on Linux only, and there is none here")
    folder = tmp_path_factory.mktemp("in_c")
    headers = Path(fmpy.__file__).parent / "c-code"
    built = {}
    for source in sorted((Path(__file__).parent / "foreign_c").glob("*.c")):
        library, rest = folder / f"{source.stem}.so", folder / f"{source.stem}_rest.c"
        description = source.with_suffix(".xml").read_text(encoding="utf-8")
        version, place = (2, "linux64") if 'fmiVersion="2.0"' in description else (3, "x86_64-linux")
        declared = re.findall(
            rf"\b(fmi{version}\w+)TYPE\s+\1\s*;", (headers / f"fmi{version}Functions.h").read_text(encoding="utf-8")
        )
        written = source.read_text(encoding="utf-8")
        missing = [name for name in declared if f" {name}(" not in written and f"*{name}(" not in written]
        rest.write_text("".join(f"int {name}(void) {{ return 3; }}\n" for name in missing))  # 3: Error
        subprocess.run([compiler, "-shared", "-fPIC", "-O1", f"-I{headers}", "-o", library, source, rest], check=True)
        built[source.stem] = folder / f"{source.stem}.fmu"
        with zipfile.ZipFile(built[source.stem], "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.write(library, f"binaries/{place}/{library.name}")
    return built
