"""Files of a native FMU: model description, C sources, libraries of all platforms, documentation, reference results."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from importlib import resources
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from ...kernels.kernel import Kernel
from ..accompanying import document, documentation, licence
from ..archive import named
from ..content import GUID_MARK
from ..description import Flavour, interface, model_description
from ..description3 import model_description3
from ..reference import reference_files, reference_run
from ..terminals import terminals_and_icons
from .interface_source import interface_files
from .model_source import model_files
from .zig import binaries

LAYER = ("checked.c", "checked.h", "dual.h", "interface.h", "slave.c", "slave.h", "states.c", "step.c", "fmi_alike.h")
"""C files that are the same in every FMU."""
CALLS = {2: ("fmi2.c", "fmi2_step.c"), 3: ("fmi3.c", "fmi3_absent.c", "fmi3_step.c")}
"""Those of the FMI version."""
HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Of the FMI standard, as FMPy brings them, with their licence in them."""
MAIN = "all.c"

_SMALL = (
    "#if defined(__clang__)",
    "#pragma clang attribute push(__attribute__((minsize)), apply_to = function)",
    "#elif defined(__GNUC__)",
    '#pragma GCC optimize("Os")',
    "#endif",
)
_END = ("#if defined(__clang__)", "#pragma clang attribute pop", "#endif")
"""What is no part of a step is compiled small rather than fast; bits stay the same."""

LOG_CATEGORIES = {
    "logStatusWarning": "what a user should know; only with loggingOn",
    "logStatusDiscard": "a step that a smaller one may replace",
    "logStatusError": "a refused call",
    "logAll": "all messages",
}


def native_files(
    kernel: Kernel, name: str, params: Any, starts: Mapping[str, float], fmi: int, platforms: Collection[str] = ()
) -> dict[str, bytes]:
    """Files of a native FMU by archive path.

    Parameters
    ----------
    kernel : Kernel
        A model, or a model with effects.
    name : str
        Model name and identifier.
    params : Params
        Parameters that it starts with.
    starts : mapping of str to float
        Those that differ from the kernel's own, by public name.
    fmi : int
        2 or 3.
    platforms : collection of str
        Folders of the libraries, ``"linux64"``; default all.

    Raises
    ------
    InputError
        For a kernel that cannot be translated, or a compiler that fails.
    """
    reference = reference_run(kernel, params)
    fmu = interface(kernel, name, starts, reference.largest())
    sources = sources_of(kernel, fmu, fmi)
    xml = (model_description if fmi == 2 else model_description3)(fmu, GUID_MARK, native_flavour())
    texts = {
        "modelDescription.xml": document(xml),
        "sources/buildDescription.xml": document(_build_description(name)),
        "documentation/index.html": documentation(kernel, name),
        "documentation/licenses/license.txt": licence("tsm-fmu"),
        **{f"sources/{file}": text for file, text in sources.items()},
        **reference_files(fmu, reference, arrays=fmi == 3),
    }
    files = named({path: text.encode() for path, text in texts.items()} | terminals_and_icons(fmu, fmi))
    compiled = {path.removeprefix("sources/"): data for path, data in files.items() if path.startswith("sources/")}
    return files | binaries(compiled, MAIN, name, fmi, platforms)


def native_flavour() -> Flavour:
    """What the model description says of the C code."""
    return Flavour(
        tool="",
        needs="",
        capabilities={
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
            "providesDirectionalDerivative": "true",
        },
        log_categories=LOG_CATEGORIES,
        sources=(MAIN,),
    )


def sources_of(kernel: Kernel, fmu: Any, fmi: int) -> dict[str, str]:
    """All C files of an FMU by name."""
    layer = resources.files("tsm_fmu.fmu.native").joinpath("c")
    standard = resources.files("fmpy").joinpath("c-code")
    files = {file: layer.joinpath(file).read_text(encoding="utf-8") for file in (*LAYER, *CALLS[fmi])}
    files |= {file: standard.joinpath(file).read_text(encoding="utf-8") for file in HEADERS[fmi]}
    files |= model_files(kernel) | interface_files(kernel.module, fmu, fmi)
    fast = (f"{kernel.name}.c", "interface.c", "step.c", f"fmi{fmi}_step.c")
    small = sorted(file for file in files if file.endswith(".c") and file not in fast)
    # the GUID tells apart what compilers keep under the file's name
    fast_files = [f'#include "{file}"' for file in fast]
    lines = [f"/* {fmu.name} ({GUID_MARK}) in one piece: compile this file alone. */"]
    lines += ["#ifdef SMALL", *_SMALL, *fast_files, *_END, "#else", *fast_files, "#endif", ""]
    lines += ["/* No part of a step: small rather than fast, with the same bits. */", *_SMALL]
    lines += [*(f'#include "{file}"' for file in small), *_END, ""]
    files[MAIN] = "\n".join(lines)
    return files


def _build_description(name: str) -> Element:
    """How to compile the sources, as FMI 3.0 has it."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = SubElement(root, "BuildConfiguration", modelIdentifier=name, description="any platform with a C99 compiler")
    sources = SubElement(
        build, "SourceFileSet", language="C99", compilerOptions="-std=c99 -O2 -ffp-contract=off -fvisibility=hidden"
    )
    SubElement(sources, "SourceFile", name=MAIN)
    SubElement(build, "Library", name="m", external="true", description="math; part of the C library on Windows")
    return root
