"""An effect at a place of a model."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

from .drives import Drive, text_of


@dataclass(frozen=True)
class Attached:
    """An effect at its place: ``channel`` is '' for friction, else an input or output of the model."""

    module: ModuleType
    channel: str
    drives: tuple[Drive, ...] = ()

    @property
    def spec(self) -> str:
        """The way users write it: ``id`` on friction, ``id@channel`` elsewhere, with the columns that drive it."""
        place = f"{self.module.NAME}@{self.channel}" if self.channel else self.module.NAME
        columns = text_of(self.drives, self.module)
        return f"{place}~{columns}" if columns else place

    @property
    def on_lost_motion(self) -> bool:
        """Whether it changes what friction takes of a motion, and not the motion itself."""
        return bool(self.channel) and "lost motion" in self.module.ABOUT.places

    @property
    def takes(self) -> tuple[str, ...]:
        """Signals that it takes at its place."""
        never = () if self.channel else self.module.ABOUT.at_outputs
        return tuple(f for f in self.module.Inputs._fields if f not in never)

    def drive(self, signal: str) -> Drive | None:
        """The column that is a signal of the effect; None where it is the model's own."""
        return next((d for d in self.drives if d.signal == signal), None)

    @property
    def prefix(self) -> str:
        """Prefix of its parameters' fields; a double underscore is a dot in the public name."""
        return f"{self.channel}__{self.module.NAME}__" if self.channel else f"{self.module.NAME}__"
