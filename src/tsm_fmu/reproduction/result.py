"""What one paper's module returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..report import Figure, Table
from .claims import Claim


@dataclass(frozen=True)
class PaperResult:
    """Claims of a paper; figures, tables and a text by the label of the item where they are shown."""

    claims: tuple[Claim, ...]
    figures: Mapping[str, tuple[Figure, ...]] = field(default_factory=dict)
    tables: Mapping[str, Table] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
