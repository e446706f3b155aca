"""XML of SSP: names, and reading that goes by the local names, as versions and tools differ in the rest."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from ...models.contract import InputError

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSC, SSV = (f"{{{_SSP}{part}}}" for part in ("Description", "Common", "ParameterValues"))
PREFIXES: Any = {"ssd": SSD[1:-1], "ssc": SSC[1:-1], "ssv": SSV[1:-1]}
ANNOTATION = "tsm-fmu.experiment"
FMU_TYPE = "application/x-fmu-sharedlibrary"
SSD_TYPE = "application/x-ssp-definition"
SSP_TYPE = "application/x-ssp-package"
SSV_TYPE = "application/x-ssp-parameter-set"
MAIN = "SystemStructure.ssd"
VERSIONS = ("1.0", "2.0")


def parse(path: Path, file: Path, root_name: str, content: bytes | None = None) -> Any:
    """Root of an XML file of the archive ``path``; its ``content`` where it is not on the disk.

    Raises
    ------
    InputError
        Not XML, another root, or a version that is not known.
    """
    options: Any = {"resolve_entities": False, "no_network": True, "remove_comments": True, "remove_pis": True}
    try:
        content = file.read_bytes() if content is None else content
        try:
            root = etree.fromstring(content, etree.XMLParser(**options))
        except etree.XMLSyntaxError as failure:
            if "Namespace prefix" not in str(failure):
                raise
            root = etree.fromstring(content, etree.XMLParser(recover=True, **options))  # a prefix never declared
    except (etree.XMLSyntaxError, OSError) as failure:
        reason = " ".join(str(failure).split())
        raise InputError(
            f"SSP {path}: {file.name} cannot be read ({reason}) -- expected XML -- export it again"
        ) from failure
    if local(root) != root_name or not (root.tag.startswith(f"{{{_SSP}") or "{" not in root.tag):
        raise InputError(
            f"SSP {path}: {file.name} has the root {root.tag!r} -- expected {root_name} of SSP 1.0 or 2.0 "
            "-- export it again"
        )
    version = root.get("version", "1.0")
    if not version.startswith(tuple(v[:2] for v in VERSIONS)):
        raise InputError(
            f"SSP {path}: {file.name} is of version {version!r} -- expected {' or '.join(VERSIONS)} -- export it as one"
        )
    return root


def local(node: Any) -> str:
    """Name without namespace, and without a prefix that was never declared."""
    return node.tag.rpartition("}")[2].rpartition(":")[2] if isinstance(node.tag, str) else ""


def children(node: Any, *path: str) -> Iterator[Any]:
    """Children by local name; of more names the children of children."""
    for child in () if node is None else node:
        if local(child) == path[0]:
            if len(path) == 1:
                yield child
            else:
                yield from children(child, *path[1:])


def child(node: Any, *path: str) -> Any:
    """The first of `children`, or None."""
    return next(children(node, *path), None)


def number(path: Path, text: str) -> float:
    """A number of an attribute.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return float(text)
    except ValueError:
        raise InputError(f"SSP {path}: {text!r} -- expected a number -- export it again") from None


def identifier(name: str) -> str:
    """The name with ``_`` for what no identifier has, which every tool reads."""
    plain = re.sub(r"\W", "_", name) or "system"
    return plain if plain.isidentifier() else f"_{plain}"
