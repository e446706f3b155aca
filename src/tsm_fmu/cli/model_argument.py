"""``MODEL[:PRESET][+EFFECT...]`` or a model card: what several verbs start from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..card import ModelCard, read_card
from ..kernels.chain import chain
from ..kernels.kernel import Kernel, kernel
from ..models.contract import InputError


@dataclass(frozen=True)
class ModelArgument:
    """A model with its effects, the preset it starts from, and the card it was read from, if any."""

    kernel: Kernel
    preset: str
    card: ModelCard | None
    effects: tuple[str, ...] = ()


def model_argument(text: str) -> ModelArgument:
    """Read ``MODEL[:PRESET][+EFFECT[@CHANNEL]...]`` or the path of a card (a name that ends in .toml).

    Raises
    ------
    InputError
        Unknown model, preset or effect, or a card that cannot be read.
    """
    if text.endswith(".toml") or Path(text).is_file():
        card = read_card(text)
        return ModelArgument(card.kernel(), card.preset, card, card.effects)
    base, *effects = text.split("+")
    name, colon, preset = base.partition(":")
    model = chain(name, tuple(effects)) if effects else kernel(name)
    if colon and preset not in model.presets:
        raise InputError(
            f"preset {preset!r} of {name} -- expected one of {', '.join(model.presets) or '(none)'} "
            "-- see 'tsm-fmu list'"
        )
    return ModelArgument(model, preset or next(iter(model.presets), ""), None, tuple(effects))


def number_settings(pairs: dict[str, str], option: str = "--set") -> dict[str, float]:
    """Values of ``name=value`` options as numbers.

    Raises
    ------
    InputError
        If a value is not a finite number.
    """
    found = {}
    for name, text in pairs.items():
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            raise InputError(f"{option} {name}={text} -- expected a finite number -- for example {name}=0.5")
    return found
