"""Build of the python flavour: an FMI 2.0 co-simulation FMU with PythonFMU's library and slave class.

The archive is assembled here, not by PythonFMU's builder, because the builder imports what it packs into
the running process, dates and randomises its output, and names modules so that two FMUs in one process
share code. Each FMU here carries its kernel, the slave and PythonFMU's slave class in a package of its
own, ``tsm_fmu_<tag>``, and a start script ``<name>_<tag>.py``; the tag comes from the content.
"""

from __future__ import annotations

import ast
import keyword
import re
from collections.abc import Collection, Mapping
from importlib import import_module, resources
from pathlib import Path
from types import ModuleType
from typing import Any

from pythonfmu import __version__ as pythonfmu_version
from pythonfmu.fmi2slave import Fmi2Slave

from ..kernels.kernel import Kernel
from ..logs.whole_file import write_whole
from ..models.contract import InputError
from . import slave
from .accompanying import document, documentation, licence, source_of
from .archive import named, packed
from .content import GUID_MARK, TAG_MARK
from .description import Flavour, interface, model_description
from .reference import reference_files, reference_run
from .terminals import terminals_and_icons

PACKAGE = __name__.partition(".")[0]
PYTHONFMU_FILES = ("_version", "default_experiment", "enums", "fmi2slave", "logmsg", "variables")
"""What the slave class needs of PythonFMU; its builder stays out."""
LOWEST_PYTHON = (3, 10)
"""Of a host: what is packed uses no more."""

OLD_PYTHON = """import sys

if sys.version_info < {lowest!r}:
    raise ImportError("{name} in Python %d.%d.%d -- {needs}" % sys.version_info[:3])
"""

BUILT = (("native", 2), ("native", 3), ("python", 2))
"""Flavours and versions of FMI."""
FLAVOURS = tuple(dict.fromkeys(flavour for flavour, _ in BUILT))


def check_flavour(flavour: str) -> None:
    """Refuse a flavour that is not built.

    Raises
    ------
    InputError
    """
    if flavour not in FLAVOURS:
        raise InputError(f"flavour {flavour!r} -- expected one of {', '.join(FLAVOURS)} -- choose one")


def build_fmu(
    kernel: Kernel,
    out: Path,
    *,
    name: str | None = None,
    start_values: Mapping[str, float] | None = None,
    flavour: str = "python",
    fmi: int = 2,
    platforms: Collection[str] = (),
) -> Path:
    """Write the FMU of a kernel; equal content gives equal bytes.

    Parameters
    ----------
    kernel : Kernel
        A model, or a model with effects.
    out : Path
        The ``.fmu`` file, or a folder that gets ``<name>.fmu``.
    name : str, optional
        Model name and identifier; default the kernel's name.
    start_values : mapping of str to float, optional
        Start values of parameters by public name, SI: a fitted model's values. They are checked.
    flavour : str
        ``"native"`` (C, needs nothing of its host) or ``"python"`` (PythonFMU, FMI 2.0 only).
    fmi : int
        2 or 3.
    platforms : collection of str
        Of a native FMU, folders of its libraries: ``"linux64"``; default all.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    InputError
        A flavour that is not built, a name that is no identifier, an unknown parameter, a value out of bounds, or a
        file that cannot be written.
    """
    name = name or kernel.name
    if not re.fullmatch(r"[A-Za-z_]\w*", name, flags=re.ASCII) or keyword.iskeyword(name):
        raise InputError(
            f"FMU name {name!r} -- expected letters, digits and underscores, not beginning with a digit -- rename it"
        )
    if (flavour, fmi) not in BUILT:
        raise InputError(
            f"flavour {flavour!r} with FMI {fmi} -- expected native with 2 or 3, or python with 2 -- choose one of them"
        )
    params = kernel.params(values=start_values)
    starts = _changed(kernel, params)
    target = out if out.suffix == ".fmu" else out / f"{name}.fmu"
    if flavour == "native":
        from .native.build import native_files  # brings a compiler along

        data = packed(native_files(kernel, name, params, starts, fmi, platforms))
    else:
        data = packed(named(_content(kernel, name, params, starts)))
    return write_whole(target, data)


def script_text(module_name: str, name: str, build_attributes: str) -> str:
    """Start script of an FMU: the slave that PythonFMU's library looks for; the build adds GUID and start values."""
    return (
        f'"""PythonFMU slave of {name}."""\n\n'
        f"from {PACKAGE}.fmu.slave import KernelSlave\n"
        f"from {PACKAGE}.models import {module_name}\n\n\n"
        f"class {name}(KernelSlave):\n"
        f"    kernel = {module_name}\n{build_attributes}"
    )


def _changed(kernel: Kernel, params: Any) -> dict[str, float]:
    """Parameters that differ from the kernel's own, by public name."""
    starts = {v.name: v.start for v in kernel.parameters}
    return {name: value for name, value in kernel.named(params).items() if value != starts[name]}


def _content(kernel: Kernel, name: str, params: Any, starts: Mapping[str, float]) -> dict[str, bytes]:
    """Files of the FMU by archive path, with marks where GUID and tag will be."""
    reference, libraries = reference_run(kernel, params), _libraries(name)
    fmu = interface(kernel, name, starts, reference.largest())
    needs = _needs(libraries[f"binaries/linux64/{name}.so"])
    module_name = kernel.module.__name__.rpartition(".")[2]
    added = f'    guid_built = "{GUID_MARK}"\n    needs = "{needs}"  # noqa: E501\n'
    if starts:
        added += f"    start_values = {dict(sorted(starts.items()))!r}  # noqa: RUF012\n"
    package = f"resources/{PACKAGE}_{TAG_MARK}"
    texts = {
        "modelDescription.xml": document(model_description(fmu, GUID_MARK, python_flavour(needs))),
        "documentation/index.html": documentation(kernel, name),
        "documentation/licenses/license.txt": licence("tsm-fmu"),
        "documentation/licenses/PythonFMU.txt": licence("pythonfmu"),
        "resources/slavemodule.txt": f"{name}_{TAG_MARK}",
        f"resources/{name}_{TAG_MARK}.py": _isolated(script_text(module_name, name, added)),
        f"{package}/__init__.py": OLD_PYTHON.format(lowest=LOWEST_PYTHON, name=name, needs=needs),
        f"{package}/pythonfmu/__init__.py": "",
        **reference_files(fmu, reference),
    }
    for module in ("pythonfmu." + f for f in PYTHONFMU_FILES):
        texts[f"{package}/{module.replace('.', '/')}.py"] = source_of(import_module(module))
    for module, text in needed_sources(kernel.module, slave).items():
        folders = module.split(".")[1:]
        for depth in range(1, len(folders)):
            texts[f"{package}/{'/'.join(folders[:depth])}/__init__.py"] = ""
        texts[f"{package}/{'/'.join(folders)}.py"] = _isolated(text)
    return {path: text.encode() for path, text in texts.items()} | terminals_and_icons(fmu, 2) | libraries


def python_flavour(needs: str) -> Flavour:
    """What the model description says of PythonFMU's code."""
    return Flavour(
        tool=f"PythonFMU {pythonfmu_version}",
        needs=needs,
        capabilities={
            "needsExecutionTool": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
        },
        log_categories=Fmi2Slave.log_categories,
    )


def _needs(library: bytes) -> str:
    """What the host must have, the C libraries by the symbol versions that the Linux library asks for."""
    glibc, cxx = _newest(rb"GLIBC", library), _newest(rb"GLIBCXX", library)
    python = ".".join(map(str, LOWEST_PYTHON))
    return (
        f"Needs Python {python} or later in the process of the host (libpython), on Linux also glibc {glibc} and "
        f"libstdc++ GLIBCXX_{cxx} or later."
    )


def _newest(symbols: bytes, library: bytes) -> str:
    versions = re.findall(rb"\b" + symbols + rb"_([\d.]+)", library)
    return max(versions, key=lambda found: [int(part) for part in found.split(b".")]).decode()


def needed_sources(*modules: ModuleType) -> dict[str, str]:
    """Source text of modules of this package and of those that they import, by module name."""
    found: dict[str, str] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        if module.__name__ in found:
            continue
        found[module.__name__] = source_of(module)
        for node in ast.walk(ast.parse(found[module.__name__])):
            if isinstance(node, ast.ImportFrom) and node.level:
                parent = module.__name__.rsplit(".", node.level)[0]
                if node.module:
                    waiting.append(import_module(f"{parent}.{node.module}"))
                else:  # from . import sibling
                    waiting += [import_module(f"{parent}.{alias.name}") for alias in node.names]
    return dict(sorted(found.items()))


def _isolated(text: str) -> str:
    """Turn absolute imports of this package and of PythonFMU into imports of the FMU's own package."""
    text = re.sub(rf"^from {PACKAGE}\b", f"from {PACKAGE}_{TAG_MARK}", text, flags=re.MULTILINE)
    return re.sub(r"^from pythonfmu\b", f"from {PACKAGE}_{TAG_MARK}.pythonfmu", text, flags=re.MULTILINE)


def _libraries(name: str) -> dict[str, bytes]:
    """PythonFMU's shared libraries under the name of the model."""
    found: dict[str, bytes] = {}
    package = resources.files("pythonfmu")
    if not package.joinpath("resources/binaries").is_dir():
        raise InputError(
            f"pythonfmu of {package} -- expected the installed one: a unit that ran in this process has left its own "
            "copy where modules are looked for -- build in a new process"
        )
    for platform in package.joinpath("resources/binaries").iterdir():
        for library in platform.iterdir():
            found[f"binaries/{platform.name}/{name}{Path(library.name).suffix}"] = library.read_bytes()
    return found
