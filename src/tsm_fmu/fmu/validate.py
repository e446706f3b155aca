"""Validation of FMU files: FMPy, fmu-manipulation-toolbox where it is installed, and checks of our own."""

from __future__ import annotations

import logging
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO
from uuid import UUID
from xml.etree import ElementTree

from fmpy.validation import validate_fmu as fmpy_validation

from ..cosim.unpack import opened
from ..models.contract import InputError
from .content import is_native, recomputed_guid, tag_of
from .reference_check import reference_problems

DESCRIPTION = "modelDescription.xml"
_CHUNK = 1 << 20


def validate_fmu(path: str | Path) -> list[str]:
    """Problems of an FMU file, one line each; an empty list when there are none.

    Any FMU is checked against the schema, the naming rules, units and model structure; of our own FMUs
    also that the content is the one that its GUID was computed from and that the reference results are complete.

    Parameters
    ----------
    path : path
        The ``.fmu`` file.
    """
    path = Path(path)
    if not path.is_file():
        return [f"FMU {path} -- expected an existing file -- build it with 'tsm-fmu build'"]
    try:
        with opened(path) as archive:
            return _problems(path, _Files(archive))
    except InputError as wrong:
        return [str(wrong)]


class _Files(Mapping[str, bytes]):
    """The files of an archive, each read when it is asked for: a library may be larger than the memory."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self._names = [name for name in archive.namelist() if not name.endswith("/")]

    def __getitem__(self, name: str) -> bytes:
        return self._archive.read(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def stream(self, name: str) -> IO[bytes]:
        """Open a file for reading in parts."""
        return self._archive.open(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _problems(path: Path, files: _Files) -> list[str]:
    for name in files:  # a damaged member is found before any tool unpacks it
        with files.stream(name) as member:
            while member.read(_CHUNK):
                pass
    if DESCRIPTION not in files:
        return [f"FMU {path} has no {DESCRIPTION} -- expected one at the top of the archive -- build it again"]
    try:
        root = ElementTree.fromstring(files[DESCRIPTION])
    except ElementTree.ParseError as failure:
        return [f"{DESCRIPTION} of {path} is not XML ({_line(failure)}) -- expected XML -- build the FMU again"]
    ours = root.get("generationTool", "").startswith("tsm-fmu ")
    return [
        *_fmpy_problems(path),
        *_toolbox_problems(path),
        *_binary_problems(root, files),
        *(_identity_problems(root, files) if ours else []),
        *(reference_problems(root, files) if ours else []),
    ]


def tools() -> tuple[str, ...]:
    """Names of the checkers that take part."""
    return ("FMPy", *(["fmu-manipulation-toolbox"] if _toolbox() else []), "tsm-fmu")


def _fmpy_problems(path: Path) -> list[str]:
    return [f"FMPy: {_line(problem)}" for problem in fmpy_validation(str(path))]


class _Errors(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(_line(record.getMessage()))


def _toolbox() -> Callable[[str], None] | None:
    """The check of ``fmutool -check``, or None where the package is not installed."""
    try:
        from fmu_manipulation_toolbox.checker import get_checkers
        from fmu_manipulation_toolbox.operations import FMU
    except ImportError:
        return None

    def check(path: str) -> None:
        with FMU(path) as fmu:
            for checker in get_checkers():
                fmu.apply_operation(checker())

    return check


def _toolbox_problems(path: Path) -> list[str]:
    check = _toolbox()
    if check is None:
        return []
    logger, errors = logging.getLogger("fmu_manipulation_toolbox"), _Errors()
    logger.addHandler(errors)
    propagated, logger.propagate = logger.propagate, False
    try:
        check(str(path))
    except Exception as failure:  # the tool has no common error type, and a damaged file may raise any
        errors.lines.append(_line(failure))
    finally:
        logger.removeHandler(errors)
        logger.propagate = propagated
    return [f"fmu-manipulation-toolbox: {line}" for line in errors.lines]


def _binary_problems(root: ElementTree.Element, files: Mapping[str, bytes]) -> list[str]:
    section = root.find("CoSimulation")
    if section is None:
        section = root.find("ModelExchange")
    identifier = "" if section is None else section.get("modelIdentifier", "")
    named = [f for f in files if f.startswith(("binaries/", "sources/"))]
    if not any(Path(f).stem == identifier or f.startswith("sources/") for f in named):
        return [f"no library named {identifier!r} under binaries/ -- expected one for each platform -- build it again"]
    return []


def _identity_problems(root: ElementTree.Element, files: Mapping[str, bytes]) -> list[str]:
    guid = root.get("guid", root.get("instantiationToken", ""))
    try:
        tag = tag_of(UUID(guid))
        expected = recomputed_guid(files, guid)
    except ValueError:
        return [f"guid {guid!r} -- expected a UUID -- build the FMU again"]
    problems: list[str] = []
    if str(expected) != guid:
        problems.append(
            f"guid {guid} does not belong to the content, which calls for {expected} -- the FMU was changed after "
            "its build, or only in part replaced -- build it again"
        )
    libraries = [f for f in files if is_native(files) and f.startswith("binaries/")]
    problems += [
        f"{library} is not of this build, its GUID is another -- expected {guid} -- build it again"
        for library in libraries
        if guid.encode() not in files[library]
    ]
    module = files.get("resources/slavemodule.txt", b"").decode(errors="replace").strip()
    if module and (f"resources/{module}.py" not in files or not module.endswith(tag)):
        problems.append(f"slavemodule.txt names {module!r} -- expected the script of build {tag} -- build it again")
    return problems


def _line(text: object) -> str:
    return " ".join(str(text).split())
