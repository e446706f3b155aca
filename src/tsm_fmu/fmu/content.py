"""Identity of an FMU: a GUID that follows from everything in it, and that a reader can compute again."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from uuid import UUID, uuid5

GUID_MARK = "@GUID@"
TAG_MARK = "@TAG@"
"""Stand in for the GUID and the tag while the content is hashed: neither can be part of its own hash."""

_NAMESPACE = UUID("7c0f6d0e-5b0c-5d0a-9a4e-0a6b3f1d2c11")


def guid_of(content: Mapping[str, bytes]) -> UUID:
    """GUID of files by archive path, with the marks in the place of GUID and tag.

    The content holds name, version, variable table and start values (model description) and the code.
    """
    digest = hashlib.sha256()
    for path in sorted(content):
        digest.update(f"{path}\0{len(content[path])}\0".encode())
        digest.update(content[path])
    return uuid5(_NAMESPACE, digest.hexdigest())


def tag_of(guid: UUID) -> str:
    """Short form of a GUID that makes module names unique."""
    return guid.hex[:12]


def recomputed_guid(files: Mapping[str, bytes], guid: str) -> UUID:
    """GUID that the files of an FMU call for, when they carry ``guid``.

    Raises
    ------
    ValueError
        If ``guid`` is not a UUID.
    """
    tag = tag_of(UUID(guid))
    content: dict[str, bytes] = {}
    for path, data in files.items():
        if is_native(files) and path.startswith("binaries/"):
            continue  # compiled from the sources, with the GUID inside
        if not path.startswith("binaries/"):
            data = data.replace(guid.encode(), GUID_MARK.encode()).replace(tag.encode(), TAG_MARK.encode())
        content[path.replace(tag, TAG_MARK)] = data
    return guid_of(content)


def is_native(files: Mapping[str, bytes]) -> bool:
    """Tell whether an FMU's binaries were compiled from the sources beside them."""
    return "sources/buildDescription.xml" in files
