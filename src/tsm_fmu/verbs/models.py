"""What a verb takes as a model: ``MODEL[:PRESET][+EFFECT...]``, a model card, a kernel, or the result of a fit."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from ..card import ModelCard, read_card
from ..kernels.chain import chain
from ..kernels.kernel import Kernel, kernel
from ..models.contract import InputError


@runtime_checkable
class HasCard(Protocol):
    """The result of a fit or a diagnosis."""

    @property
    def card(self) -> ModelCard | None: ...


ModelLike = str | os.PathLike[str] | ModelCard | Kernel | HasCard
"""A model as verbs take it."""


@dataclass(frozen=True)
class ResolvedModel:
    """A model with its effects, the preset it starts from, and the card it was read from, if any."""

    kernel: Kernel
    preset: str
    card: ModelCard | None
    effects: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """The card's values by public name; empty without a card."""
        return {name: p.value for name, p in self.card.parameters.items()} if self.card else {}

    @property
    def fixed(self) -> tuple[str, ...]:
        """Public names of the parameters that the card keeps fixed."""
        return tuple(name for name, p in self.card.parameters.items() if p.fixed) if self.card else ()

    def params(self, values: Mapping[str, float] | None = None, run: str = "") -> Any:
        """Validated parameters: of the card, with the values of ``run`` where it holds them, changed by ``values``."""
        if self.card is None:
            return self.kernel.params(self.preset or None, values)
        shared = self.card.params(run if run in self.card.per_run else None)
        return self.kernel.params(values={**self.kernel.named(shared), **(values or {})})


def resolve_model(model: ModelLike) -> ResolvedModel:
    """Read a model in any of the forms of `ModelLike`; a text or path that ends in ``.toml`` is a card.

    Raises
    ------
    InputError
        Unknown model, preset or effect, or a card that cannot be read.
    """
    if isinstance(model, Kernel):
        return ResolvedModel(model, next(iter(model.presets), ""), None, tuple(getattr(model.module, "EFFECTS", ())))
    if isinstance(model, HasCard):
        if model.card is None:
            raise InputError(f"{type(model).__name__} without a model -- expected one -- look at its answer")
        model = model.card
    if isinstance(model, ModelCard):
        return ResolvedModel(model.kernel(), model.preset, model, model.effects)
    text = os.fspath(model)
    if text.endswith(".toml") or Path(text).is_file():
        return resolve_model(read_card(text))
    base, *effects = text.split("+")
    name, colon, preset = base.partition(":")
    found = chain(name, tuple(effects)) if effects else kernel(name)
    if colon and preset not in found.presets:
        raise InputError(
            f"preset {preset!r} of {name} -- expected one of {', '.join(found.presets) or '(none)'} "
            "-- see 'tsm-fmu list'"
        )
    return ResolvedModel(found, preset or next(iter(found.presets), ""), None, tuple(effects))
