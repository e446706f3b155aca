"""Which effects could be missing, and how far each would go: one linear step from the refitted baseline.

The response of a candidate is its effect applied to the baseline's own signals, at a size that matches the
gap, for a spread of its shape parameters. What of it the baseline's parameters and the nuisance effects cannot
imitate is what the log can show of this effect; how much of the residual that part explains ranks the candidates
for the full refit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...effects import about, shapes_of, sizes_of, starts_of
from ...kernels.arrays import BoolArray, FloatArray
from ...kernels.attached import Attached
from ...models.contract import Quantity
from ...regression.thinning import thinned
from ...regression.threads import together
from .amounts import Parts, Products, explained, products
from .extent import quantiles, turn_of
from .refit import Fitted
from .response import Acting, Responses, public, side_by_side
from .takeover import Place

ROWS = 3000
"""Samples of all runs together that the linear step looks at."""
COLUMNS = 128
"""Responses that are looked at together, for memory."""
SWEEPS = 3
"""Times, at most, that the states at the start of all runs are gone through for better ones."""
NO_GAIN = 1e-2
"""Log of the mean square that a change of these is worth at least: a size may do the same."""
STARTS = 8
"""Of the shapes that are tried, the best that a refit may begin from."""
CLOSER, CLOSER_DRAWS, CLOSER_REACH = 2, 16, (0.1, 0.04, 0.015)
"""Of an effect with many shapes to begin from, so many of the best are improved by draws around them, at these
distances as parts of the range."""
ROUGH_ROWS, PROMISING = 750, 24
"""Samples of all runs together that these shapes are tried on, and how many of the best are on all samples."""
ALONE_GAIN = 0.2
"""Gain of one size alone from which a refit begins there too: of a sixth of a gap another valley may be worth it."""
TURNS = (1.0, 2.0)
"""Turns of another law that one of such an effect may take: what comes twice a turn has harmonics of half of it."""


@dataclass(frozen=True)
class Screened:
    """What one linear step says of a candidate.

    Attributes
    ----------
    attached : Attached
        Effect and place.
    gain : float
        Log of the mean square that it would leave, over all channels, with the sign turned.
    starts : list of (dict, dict)
        Parameters of the effect at the best shapes, best first, by public name of the chain; and its states at the
        start of each run.
    limits : dict of str to tuple
        Range of its shape parameters, of sizes with a bound and of states at the start.
    tries : list of dict
        Sizes to begin from besides, of what one linear step says little of.
    alone : list of (dict, dict)
        As ``starts``, the best with one size of one sign alone: the states of each run may stand for another.
    """

    attached: Attached
    gain: float
    starts: list[Place]
    limits: dict[str, tuple[float, float]]
    tries: Sequence[dict[str, float]] = ()
    alone: Sequence[Place] = ()


def screen(
    fitted: Fitted, candidates: Sequence[Attached], progress: Callable[[str], None] = lambda _: None
) -> list[Screened]:
    """Rank candidates by one linear step from a fitted baseline.

    Parameters
    ----------
    fitted : Fitted
    candidates : sequence of Attached
    progress : callable
        Given what is being done.
    """
    bench = _Bench(fitted)

    def one(numbered: tuple[int, Attached]) -> Screened:
        number, candidate = numbered
        progress(f"screen {number}/{len(candidates)}: {candidate.spec}")
        return bench.screened(candidate)

    found = together(one, list(enumerate(candidates, 1)))
    return sorted(together(partial(bench.in_turns_of, found), found), key=lambda s: -s.gain)


class _Explained(NamedTuple):
    """What a candidate explains at one shape: its gain, the amounts of its sizes, and the states of each run."""

    gain: float
    amounts: FloatArray
    states: list[int]


class _Tried(NamedTuple):
    """One shape of a candidate: its gain, the quantiles of its shape parameters, and all of its values.

    Where it has states at the start of a run, ``place`` gives the best ones of each run, and ``alike`` is what it gains
    and where it is with the first one that is tried in all of them; ``alone`` the same with the best ones of each run
    and one size of one sign.
    """

    gain: float
    at: FloatArray
    place: Callable[[], Place]
    alike: tuple[float, Callable[[], Place]]
    alone: Sequence[tuple[float, Callable[[], Place]]]


def _same(one: Place, other: Place) -> bool:
    return one[0] == other[0] and all(np.array_equal(v, other[1][name]) for name, v in one[1].items())


def _each_alone(signed: BoolArray) -> list[FloatArray]:
    """One size of one sign, of those that each may have: the signs of all sizes, zero for the others."""
    of = np.eye(signed.size)
    return [sign * one for one, either in zip(of, signed, strict=True) for sign in ((1.0, -1.0) if either else (1.0,))]


def _within(amount: float, bounds: Quantity) -> float:
    """An amount of a linear step, half of the way to a bound where it lies beyond: at the bound a descent is stuck."""
    return 0.5 * bounds.lo if amount < bounds.lo else 0.5 * bounds.hi if amount > bounds.hi else float(amount)


def _closer(best: _Tried, tried: Callable[[FloatArray], list[_Tried]]) -> _Tried:
    """The best shape in a neighbourhood that shrinks: many shapes between those of a first draw fit nothing."""
    rng = np.random.default_rng(11)
    for reach in CLOSER_REACH:
        near = np.clip(best.at + reach * rng.standard_normal((CLOSER_DRAWS, best.at.size)), 0.0, 1.0)
        best = max([best, *tried(near)], key=lambda one: one.gain)
    return best


class _Bench:
    """The linearised baseline, on which candidates are tried."""

    def __init__(self, fitted: Fitted) -> None:
        fitted = fitted.at(thinned(fitted.problem.kernel, fitted.problem.runs, ROWS, ROWS // 10))
        self.channels = len(fitted.problem.channels)
        self._compare(Responses(fitted, 1.0 / np.maximum(fitted.rmse, 1e-12 * fitted.spread)))

    def _compare(self, responses: Responses) -> None:
        self.responses = responses
        self.residual = responses.outside(responses.flat(responses.fitted.residuals))
        self.before = self._squares(self.residual)

    @cached_property
    def rough(self) -> _Bench:
        """The same with fewer samples."""
        found = copy(self)
        found._compare(self.responses.at_fewer(ROUGH_ROWS))
        return found

    def in_turns_of(self, others: Sequence[Screened], one: Screened) -> Screened:
        """The same, begun in the turns of what looks like it and explains more, if it then explains more than it did.

        Bursts in turns of unknown length are missed by most of the shapes that are tried, their harmonics by few.
        """
        attached, alike = one.attached, about(one.attached.spec).looks_like
        of_turns = [
            s for s in others
            if s.gain > one.gain and s.attached.channel == attached.channel and s.attached.module.NAME in alike
            and turn_of(s.attached.module)
        ]  # fmt: skip
        turn = turn_of(attached.module)
        if turn is None or not of_turns:
            return one
        other = max(of_turns, key=lambda s: s.gain)
        length = other.starts[0][0][public(other.attached, str(turn_of(other.attached.module)))]
        at, shapes = quantiles(attached.module), shapes_of(attached.module)
        lengths = [self.responses.extent.quantile_of_turn(shapes[turn], number * length) for number in TURNS]
        at[:, list(shapes).index(turn)] = np.clip(np.resize(lengths, len(at)), 0.0, 1.0)
        again = self.screened(attached, at)
        if again.gain <= one.gain:
            return one
        return replace(again, starts=[again.starts[0], one.starts[0], *again.starts[1:]])

    def screened(self, attached: Attached, at: FloatArray | None = None) -> Screened:
        acting, module = self.responses.acting(attached), attached.module
        many = any(shape.tries for shape in shapes_of(module).values())
        at = quantiles(module) if at is None else at
        at = self.rough._promising(attached, at) if many else at
        found = sorted(self._tried(acting, at), key=lambda one: -one.gain)
        starts = [one.place() for one in found[:STARTS]]
        if starts_of(module):  # from the best states a descent may end in another valley
            alike = sorted((one.alike for one in found), key=lambda one: -one[0])[:STARTS]
            alike = [place() for _, place in alike]
            starts = [place for both in zip(starts, alike, strict=True) for place in both]
            starts = [one for k, one in enumerate(starts) if not any(_same(one, other) for other in starts[:k])]
        of_each = (max(one, key=lambda tried: tried[0]) for one in zip(*(one.alone for one in found), strict=True))
        alone = [place() for gain, place in of_each if gain > ALONE_GAIN]
        alone = [one for one in alone if not any(_same(one, other) for other in starts)]
        tries = self.responses.tries(acting)
        return Screened(attached, found[0].gain, starts, self.responses.limits(acting), tries, alone)

    def _promising(self, attached: Attached, at: FloatArray) -> FloatArray:
        """Where the best of many shapes are, the best few improved."""
        tried = partial(self._tried, self.responses.acting(attached))
        found = sorted(tried(at), key=lambda one: -one.gain)
        return np.array([one.at for one in [*(_closer(one, tried) for one in found[:CLOSER]), *found[:PROMISING]]])

    def _tried(self, acting: Acting, at: FloatArray) -> list[_Tried]:
        """An effect at several shapes, by the quantiles of their ranges."""
        module, found = acting.attached.module, []
        sizes, states = list(sizes_of(module)), self.responses.extent.starts(module)
        bounds = [acting.effect.by_name[n].quantity for n in sizes]
        signed = np.array([one.lo < 0.0 for one in bounds])
        # what falls from run to run with some states rises with others, and no descent goes from these to those
        alone = _each_alone(signed) if min(len(states), len(self.responses.rows)) > 1 else []

        def placed(what: _Explained, shape: dict[str, float], steps: FloatArray) -> Place:
            amounts = (_within(amount, one) for amount, one in zip(what.amounts * steps, bounds, strict=True))
            values = {**shape, **dict(zip(sizes, amounts, strict=True))}
            each = {n: np.array([states[i][n] for i in what.states]) for n in states[0]}
            names = {n: public(acting.attached, n) for n in (*values, *each)}
            return {names[n]: v for n, v in values.items()}, {names[n]: v for n, v in each.items()}

        for few in np.array_split(at, math.ceil(len(at) * len(sizes) * len(states) / COLUMNS)):
            shapes = [self.responses.extent.shape_at(module, one) for one in few]
            columns, steps = acting.columns([{**shape, **states[0]} for shape in shapes])
            others = [acting.columns([{**shape, **state} for shape in shapes], steps)[0] for state in states[1:]]
            by_state = side_by_side([columns, *others])
            flat = by_state.reshape(-1, *columns.shape[1:])
            of_all = products(flat, self.responses.outside(flat), self.residual, self.channels)
            in_all = self._in_all(of_all, len(states), signed)
            of_each = [(signs, self._in_all(of_all, len(states), signed, signs)) for signs in alone]
            for k, (one, shape, step) in enumerate(zip(few, shapes, steps, strict=True)):
                parts = self._parts(by_state[k])
                alike, best = in_all[k][0], self._in_states(in_all[k], parts, signed)
                each = [self._in_states(every[k], parts, signed, signs) for signs, every in of_each]
                first, *others = ((what.gain, partial(placed, what, shape, step)) for what in (alike, *each))
                found.append(_Tried(best.gain, one, partial(placed, best, shape, step), first, others))
        return found

    def _in_all(
        self, of_all: Products, states: int, signed: BoolArray, signs: FloatArray | None = None
    ) -> list[list[_Explained]]:
        """What an effect explains with each state in all runs, a list of states for each shape."""
        runs, (gains, amounts) = len(self.responses.rows), explained(of_all, self.before, signed, signs)
        each = [_Explained(float(gains[k]), amounts[k], [k % states] * runs) for k in range(len(gains))]
        return [each[k : k + states] for k in range(0, len(each), states)]

    def _parts(self, responses: FloatArray) -> Parts | None:
        """Of each run by itself, the responses to each size with each state at its start, shape (states, sizes, n).

        None where no run may have another state than the others.
        """
        if min(len(responses), len(self.responses.rows)) == 1:
            return None
        parts = np.zeros((len(self.responses.rows), *responses.shape))
        for k, (a, b) in enumerate(pairwise(self.responses.edges)):
            parts[k, :, :, a:b] = responses[:, :, a:b]
        return Parts(parts, self.responses.outside(parts), self.residual, self.channels)

    def _in_states(
        self, every: Sequence[_Explained], parts: Parts | None, signed: BoolArray, signs: FloatArray | None = None
    ) -> _Explained:
        """What an effect explains with the best state of each run, from that which is best in all of them.

        Parameters
        ----------
        every : sequence of _Explained
            With each state in all runs.
        parts : Parts or None
        signed, signs
            As for `explained`.
        """
        most = max(one.gain for one in every) - NO_GAIN
        best = next(one for one in every if one.gain >= most)  # of those that nothing tells apart, the first
        if parts is None:
            return best
        for _ in range(SWEEPS):
            before = best
            for k in range(len(best.states)):
                gains, amounts = explained(parts.with_run(k, best.states), self.before, signed, signs)
                for i in range(len(every)):
                    if gains[i] > best.gain + NO_GAIN:
                        best = _Explained(float(gains[i]), amounts[i], [*best.states[:k], i, *best.states[k + 1 :]])
            if best is before:
                break
        return best

    def _squares(self, column: FloatArray) -> FloatArray:
        """Sum of squares by channel."""
        by_channel = column.reshape(-1, self.channels)
        return np.maximum(np.einsum("ij,ij->j", by_channel, by_channel), 1e-300)
