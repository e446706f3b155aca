"""What accompanies the code in an FMU of any flavour: documentation, licences, XML as text; the text of a kernel."""

from __future__ import annotations

import html
from importlib.metadata import distributions
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ..kernels.kernel import Kernel


def licence(package: str) -> str:
    """Text of a package's licence, as it was installed."""
    # a source tree on the path has metadata too, which name the file but do not hold it
    files = (Path(f.locate()) for found in distributions(name=package) for f in found.files or ())
    return next(f for f in files if f.name == "LICENSE" and f.is_file()).read_text()


def document(root: Element) -> str:
    """Text of an XML file."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode", xml_declaration=False)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def documentation(kernel: Kernel, name: str) -> str:
    """Page of an FMU: the text of its model."""
    text = html.escape((kernel.module.__doc__ or "").strip())
    return (
        f'<!DOCTYPE html>\n<meta charset="utf-8">\n<title>{name}</title>\n<h1>{name}</h1>\n<pre>{text}</pre>\n'
        '<p><a href="fmi-ls-ref.html">Reference results</a></p>\n'
    )


def source_of(module: ModuleType) -> str:
    """Text of a module; a kernel that was written at run time carries its text in ``SOURCE_TEXT``."""
    text: Any = getattr(module, "SOURCE_TEXT", None)
    return text if text is not None else Path(str(module.__file__)).read_text(encoding="utf-8")
