"""How much of each size parameter explains most of a residual in one linear step, from sums of products alone.

A candidate is tried at thousands of shapes and states: none of these takes more than the products of its responses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from ...kernels.arrays import BoolArray, FloatArray
from ..criteria import IMITATED_SHARE

UNREACHED = 1e-6
"""Part of the residual's size that the response to the largest step makes at least: what does less, as a layer behind
the end of the motion, would need sizes without bounds."""
DAMPING = 1e-4
"""Keeps a response small of which nearly all is imitated by the baseline: the linear step must not lead far away."""
CLOSED = 1e-6
"""Part of a mean square that counts as nothing left."""


class Products(NamedTuple):
    """Of several sets of responses, one response a size parameter.

    Attributes
    ----------
    whole : ndarray, shape (sets, sizes)
        Sum of squares of each response.
    gram : ndarray, shape (sets, channels, sizes, sizes)
        Products of what of the responses nothing else imitates, by channel,
    cross : ndarray, shape (sets, channels, sizes)
        and of that and the residual.
    """

    whole: FloatArray
    gram: FloatArray
    cross: FloatArray


def products(responses: FloatArray, outside: FloatArray, residual: FloatArray, channels: int) -> Products:
    """Of responses, shape (sets, sizes, n), and what nothing else imitates of them; columns as `Responses.flat`."""
    by_channel = outside.reshape(*outside.shape[:2], -1, channels)
    return Products(
        np.einsum("sin,sin->si", responses, responses),
        np.stack([one @ one.swapaxes(1, 2) for one in np.moveaxis(by_channel, -1, 0)], axis=1),
        np.einsum("sinc,nc->sci", by_channel, residual.reshape(-1, channels), optimize=True),
    )


class Parts:
    """Products of the responses of single runs with each state, from which those of any states follow.

    Parameters
    ----------
    parts, outside : ndarray, shape (runs, states, sizes, n)
        Responses where one run's alone are not zero, and what of these nothing else imitates.
    residual : ndarray, shape (n,)
    channels : int
    """

    def __init__(self, parts: FloatArray, outside: FloatArray, residual: FloatArray, channels: int) -> None:
        runs, states, sizes, n = parts.shape
        flat = products(parts.reshape(1, -1, n), outside.reshape(1, -1, n), residual, channels)
        self.whole = flat.whole.reshape(runs, states, sizes)
        self.gram = flat.gram.reshape(channels, runs, states, sizes, runs, states, sizes)
        self.cross = flat.cross.reshape(channels, runs, states, sizes)

    def with_run(self, k: int, states: Sequence[int]) -> Products:
        """Of all runs at their states, the k-th at each state in turn: as many sets."""
        others = [j for j in range(len(states)) if j != k]
        at = [states[j] for j in others]
        beside = self.gram[:, others, at].sum(axis=1)  # channels, sizes of the others; runs, states, sizes of any
        still = beside[:, :, others, at].sum(axis=2)
        mixed = np.moveaxis(beside[:, :, k], 2, 0)  # states, channels, sizes of the others, sizes of the run
        own = np.moveaxis(np.diagonal(self.gram[:, k, :, :, k], axis1=1, axis2=3), -1, 0)
        return Products(
            self.whole[others, at].sum(axis=0) + self.whole[k],
            still + mixed + mixed.swapaxes(2, 3) + own,
            self.cross[:, others, at].sum(axis=1) + np.moveaxis(self.cross[:, k], 1, 0),
        )


def explained(
    of: Products, before: FloatArray, signed: BoolArray, signs: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """What each set explains of a residual.

    Parameters
    ----------
    of : Products
    before : ndarray, shape (channels,)
        Sum of squares of the residual.
    signed : ndarray of bool, shape (sizes,)
        Whether a size parameter may be negative.
    signs : ndarray, shape (sizes,), optional
        That each has at most: 1, -1, or 0 where it does nothing; instead of those that it may have.

    Returns
    -------
    gains : ndarray, shape (sets,)
        Log of the mean square without the effect over what is left, summed over the channels.
    amounts : ndarray, shape (sets, sizes)
        How much of each response; zero of one that does nothing, or nothing of its own.
    """
    whole, scale = np.sqrt(of.whole), np.sqrt(np.einsum("scii->si", of.gram))
    reaches = whole > UNREACHED * np.sqrt(before.sum())
    shows = scale > IMITATED_SHARE * np.where(reaches, whole, np.inf)
    if signs is not None:
        shows &= signs != 0.0
    per_size = (1.0 if signs is None else signs) / np.where(shows, scale, np.inf)
    gram = of.gram.sum(axis=1) * per_size[:, :, None] * per_size[:, None, :]
    bulk = np.where(shows, whole * np.abs(per_size), 1.0)
    normal = gram + DAMPING * bulk[:, :, None] ** 2 * np.eye(len(signed))
    amounts = per_size * _with_signs(normal, of.cross.sum(axis=1) * per_size, signed & (signs is None))
    gained = 2.0 * np.einsum("sci,si->sc", of.cross, amounts) - np.einsum("scij,si,sj->sc", of.gram, amounts, amounts)
    return np.sum(np.log(before / np.maximum(before - gained, CLOSED * before)), axis=1), amounts


def _with_signs(normal: FloatArray, cross: FloatArray, signed: BoolArray) -> FloatArray:
    """Minima of a' normal a / 2 - cross' a, none negative that may not be."""
    found = np.asarray(np.linalg.solve(normal, cross[:, :, None])[:, :, 0], dtype=np.float64)
    for one in np.flatnonzero((found[:, ~signed] < 0.0).any(axis=1)):
        root = np.linalg.cholesky(normal[one])
        either = np.concatenate([root.T, -root.T[:, signed]], axis=1)
        parts, _ = nnls(either, np.linalg.solve(root, cross[one]))
        found[one] = parts[: len(signed)]
        found[one, signed] -= parts[len(signed) :]
    return found
