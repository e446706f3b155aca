"""Parameters drawn from what a fit knows: the covariance of a model card, within all bounds and joint conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..card import ModelCard
from ..kernels.arrays import FloatArray
from ..models.contract import InputError

TRIES = 200
"""Draws that may be refused for each that is kept, before the bounds are said to leave no room."""


@dataclass(frozen=True)
class Draws:
    """Drawn parameters.

    Attributes
    ----------
    names : tuple of str
        Public names.
    values : ndarray, shape (draws, names)
        SI.
    held : tuple of str
        Free parameters that were not drawn: the fit knows no error of them, or each run has a value of its own.
    refused : int
        Draws that were out of bounds, or broke a joint condition, and were drawn again.
    """

    names: tuple[str, ...]
    values: FloatArray
    held: tuple[str, ...]
    refused: int


def draw(card: ModelCard, number: int, seed: int | tuple[int, ...]) -> Draws:
    """Draw from the normal distribution of the fit's errors, cut where the model or the card refuses values.

    Parameters
    ----------
    card : ModelCard
        With the correlation that an identification or a diagnosis writes.
    number : int
    seed : int or tuple of int
        Same seed, same draws.

    Raises
    ------
    InputError
        The card has no correlation, or its bounds leave almost no room.
    """
    errors = card.correlation
    if errors is None or not errors.names:
        raise InputError(
            f"card of {card.model} does not say how the errors of its parameters are correlated -- expected a card "
            "that 'tsm-fmu identify' or 'diagnose' of this version wrote -- fit it again: tsm-fmu identify CARD "
            "--measured RUN --out NEW.toml"
        )
    kernel = card.kernel()
    parameters = [card.parameters[name] for name in errors.names]
    value = np.array([p.value for p in parameters])
    stderr = np.array([p.stderr or 0.0 for p in parameters])
    logarithm = np.array([name in errors.logarithm for name in errors.names])
    low, high = np.array([p.lo for p in parameters]), np.array([p.hi for p in parameters])
    eigenvalues, vectors = np.linalg.eigh(np.array(errors.matrix))
    root = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))  # rounding may leave one just below zero
    fixed = {name: p.value for name, p in card.parameters.items() if name not in errors.names}
    random = np.random.default_rng(seed)
    kept: list[FloatArray] = []
    refused = 0
    while len(kept) < number:
        z = stderr * (root @ random.standard_normal(value.size))
        with np.errstate(over="ignore"):
            grown = value * np.exp(np.divide(z, np.abs(value), out=np.zeros_like(z), where=logarithm))
        one = np.where(logarithm, grown, value + z)
        try:
            if not ((one >= low) & (one <= high)).all():
                raise InputError(
                    f"draw {one.tolist()} -- expected values in the card's own bounds -- widen them, or fit more runs"
                )
            kernel.params(card.preset or None, {**fixed, **dict(zip(errors.names, one.tolist(), strict=True))})
        except InputError as wrong:
            refused += 1
            if refused > TRIES * max(number, 10):
                raise InputError(
                    f"card of {card.model}: {len(kept)} of {len(kept) + refused} draws were allowed, the last was "
                    f"{str(wrong).partition(' -- ')[0]} -- expected standard errors that bounds and conditions leave "
                    "room for -- fit more or longer runs, or fix parameters"
                ) from None
            continue
        kept.append(one)
    held = tuple(name for name, p in card.parameters.items() if name not in errors.names and not p.fixed)
    return Draws(errors.names, np.array(kept).reshape(number, value.size), held, refused)
