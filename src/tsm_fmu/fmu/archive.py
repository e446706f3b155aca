"""The archive of an FMU: GUID in its place, and the same bytes for the same content."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

from .content import GUID_MARK, TAG_MARK, guid_of, tag_of


def named(content: Mapping[str, bytes]) -> dict[str, bytes]:
    """Content with GUID and tag in the place of their marks."""
    guid = guid_of(content)
    names = {GUID_MARK: str(guid), TAG_MARK: tag_of(guid)}
    result: dict[str, bytes] = {}
    for path, data in content.items():
        for mark, value in names.items():
            path = path.replace(mark, value)
            if not path.startswith("binaries/"):
                data = data.replace(mark.encode(), value.encode())
        result[path] = data
    return result


def packed(files: Mapping[str, bytes]) -> bytes:
    """Files by path as an archive, the same bytes from any machine and at any time."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path in sorted(files):
            info = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3  # the same bytes from any operating system
            info.external_attr = (0o755 if path.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, files[path])
    return buffer.getvalue()
