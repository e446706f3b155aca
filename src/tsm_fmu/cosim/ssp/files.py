"""Files of an SSP: where a description, a component or a parameter set finds what it names."""

from __future__ import annotations

import re
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ...models.contract import InputError
from ..unpack import opened, unpacked
from .xml import child, local, parse

_PROXY = re.compile(r"(proxy-?fmu|fmu-proxy)://localhost(:\d+)?\?file=")
"""How libcosim and ecos ask for a process of its own, which other people's FMUs have here anyway."""


@dataclass(frozen=True)
class Files:
    """The files of an archive as one description in it sees them.

    Attributes
    ----------
    path : Path
        The archive, as the user calls it.
    folder : Path
        Where it is unpacked; nothing outside is read.
    base : Path
        Folder of the description, which its sources are relative to.
    held : ExitStack
        Holds what is unpacked of archives inside the archive.
    """

    path: Path
    folder: Path
    base: Path
    held: ExitStack

    def named(self, source: str, what: str, expected: str = "a file inside the archive") -> Path:
        """The file of a ``source``.

        Raises
        ------
        InputError
            If there is none, or it is outside the archive; ``what`` says whose it is.
        """
        file = (self.base / _PROXY.sub("", unquote(source))).resolve()
        if not file.is_relative_to(self.folder) or not file.is_file():
            raise InputError(f"SSP {self.path}: {what} {source!r} -- expected {expected} -- pack it in")
        return file

    def beside(self, file: Path) -> Files:
        """The same archive as a description in the folder of ``file`` sees it."""
        return replace(self, base=file.parent)

    def inside(self, package: Path) -> Files:
        """The files of an SSP inside the archive, as its own descriptions see them."""
        folder = self.held.enter_context(unpacked(package, "SSP")).resolve()
        return replace(self, folder=folder, base=folder)

    def table(self, node: Any, root: str, owner: Any, *inside: str) -> Any:
        """The XML that ``node`` holds under ``inside``, or that its ``source`` names; None if neither.

        Parameters
        ----------
        node : element
            Binding, mapping or dictionary.
        root : str
            Element that the file holds.
        owner : element
            Component that a source counts from where ``sourceBase`` says so: a folder in its FMU.
        inside : str
            Names of the elements between the node and that root, where there is no source.

        Raises
        ------
        InputError
            A file that is missing or outside, or no such XML.
        """
        source = node.get("source")
        if not source:
            return child(node, *inside, root)
        if node.get("sourceBase") != "component":
            return parse(self.path, self.named(source, "parameter source"), root)
        fmu = self.named(owner.get("source") or "", f"{local(owner).lower()} {owner.get('name')!r} with source")
        with opened(fmu) as members:
            if unquote(source) not in members.namelist():
                raise InputError(
                    f"SSP {self.path}: parameter source {source!r} of component {owner.get('name')!r} -- expected a "
                    f"file inside {fmu.name} -- pack it in"
                )
            return parse(self.path, Path(source), root, members.read(unquote(source)))
