"""What is fitted to what: runs, channels, free parameters, and the weighted residuals of a table of values.

All parameter values of a problem are one table of shape (runs, parameters), in the order of the kernel's
``Params``: a shared parameter has the same value in every row, a per-run parameter its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..kernels.serving import filling
from ..models.contract import Condition, Variable
from .prior import Prior
from .search_space import SearchSpace
from .slow_zero import SlowZero
from .threads import on_shared_threads

MAX_ROWS = 40_000
"""Rows of the optimiser's residual; longer data are averaged over blocks (every sample is still simulated)."""
PARALLEL_ROWS = 50_000
"""Below so many rows to simulate, threads cost more than they give."""
FEW = 8
"""Samples of a block that are added one by one."""
Points = Sequence[tuple[int, FloatArray]]
"""Runs by their number, each with a row of values."""
PIECE_ROWS = 50_000
"""Rows simulated in one call, but for longer runs: enough to leave the interpreter's lock alone, few in memory."""


@dataclass(frozen=True)
class FitRun:
    """One record cut to what a fit needs.

    Attributes
    ----------
    name : str
    time : ndarray, shape (n,)
        [s], increasing.
    inputs : ndarray, shape (n, number of kernel inputs)
    targets : ndarray, shape (n, number of channels)
        Measured values of the fitted outputs, SI.
    lead_time, lead_inputs : ndarray, shape (m,) and (m, number of kernel inputs)
        The lead, samples before these: simulated, but not compared.
    derived : tuple of str
        One sentence for each input that the record does not hold itself.
    doubt : ndarray, shape (n, number of channels)
        What the log leaves open of what is simulated: where it is within so much of what was measured it counts as
        measured, beyond it what is beyond. Infinite where nothing is compared, empty where all is.
    slow_zero : SlowZero or None
        Channels of which only what is no slow zero is compared.
    """

    name: str
    time: FloatArray
    inputs: FloatArray
    targets: FloatArray
    lead_time: FloatArray = field(default_factory=lambda: np.empty(0))
    lead_inputs: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    derived: tuple[str, ...] = ()
    doubt: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    slow_zero: SlowZero | None = None

    @cached_property
    def unresolved(self) -> NDArray[np.bool_]:
        """Values of which the log leaves something open, shape (n, number of channels); empty where there are none."""
        return self.doubt > 0.0

    @cached_property
    def with_lead(self) -> tuple[FloatArray, FloatArray]:
        """Time and inputs of all that is simulated: the lead, then what is compared."""
        if not self.lead_time.size:
            return self.time, self.inputs
        return np.append(self.lead_time, self.time), np.concatenate([self.lead_inputs, self.inputs])

    def compared_from(self, first: int) -> FitRun:
        """A copy whose samples before ``first`` belong to the lead: simulated, not compared."""
        time, inputs, targets = (np.ascontiguousarray(a[first:]) for a in (self.time, self.inputs, self.targets))
        lead = self.lead_time.size + first
        lead_time, lead_inputs = (a[:lead] for a in self.with_lead)
        doubt = self.doubt[first:]
        return FitRun(self.name, time, inputs, targets, lead_time, lead_inputs, self.derived, doubt, self.slow_zero)

    def compared(self, y: FloatArray) -> FloatArray:
        """Simulated channels, shape (n, channels), nearer to the measured ones by what the log leaves open of them.

        Slow zeros that are free are the measured ones'.
        """
        if self.doubt.size:
            y = np.where(self.unresolved, self.targets + _beyond(y - self.targets, self.doubt), y)
        if self.slow_zero is not None:
            y = y.copy()
            for c, known, basis in self._slow_functions:
                y[known, c] += basis @ (basis.T @ (self.targets[known, c] - y[known, c]))
        return y

    def excess(self, y: FloatArray) -> FloatArray:
        """Simulated minus measured channels, what of it is beyond doubt, shape (channels, n); y (n, channels)."""
        found = y.T - self._by_channel
        at, doubt = self._doubtful
        found[at] = _beyond(found[at], doubt)
        for c, known, basis in self._slow_functions:
            found[c, known] -= basis @ (basis.T @ found[c, known])
        return found

    @cached_property
    def _by_channel(self) -> FloatArray:
        """Targets, each channel in one piece."""
        return np.ascontiguousarray(self.targets.T)

    @cached_property
    def _doubtful(self) -> tuple[tuple[NDArray[np.intp], ...], FloatArray]:
        """Where there is doubt, by channel and sample, and how much."""
        at = np.nonzero(self.unresolved.T)
        return at, self.doubt.T[at]

    @cached_property
    def _slow_functions(self) -> list[tuple[int, NDArray[np.bool_] | slice, FloatArray]]:
        """Columns of the channels with a slow zero, where these are compared, and its functions there."""
        if self.slow_zero is None:
            return []
        found = []
        for c in self.slow_zero.channels:
            known = np.isfinite(self.doubt[:, c]) if self.doubt.size else slice(None)
            found.append((c, known, self.slow_zero.basis(self.time[known])))
        return found

    @property
    def as_measured(self) -> FitRun:
        """A copy without doubt and without zeros that are free."""
        return replace(self, doubt=np.empty((0, 0)), slow_zero=None)

    def with_slow_zero(self, channels: Sequence[int], functions: int, *, constant: bool) -> FitRun:
        """A copy whose channels are compared but for a slow zero: see `SlowZero`."""
        ends = float(self.time[0]), float(self.time[-1])
        return replace(self, slow_zero=SlowZero(tuple(channels), *ends, functions, constant))

    def doubting(self, doubt: FloatArray) -> FitRun:
        """A copy that is compared beyond this doubt too, shape (n, channels)."""
        found = np.maximum(doubt, self.doubt) if self.doubt.size else doubt
        return replace(self, doubt=found if found.any() else np.empty((0, 0)))

    def only(self, kept: NDArray[np.bool_]) -> FitRun:
        """A copy with some of the samples that are compared, shape (n,)."""
        doubt = self.doubt[kept] if self.doubt.size else self.doubt
        chosen = {name: getattr(self, name)[kept] for name in ("time", "inputs", "targets")}
        return replace(self, **chosen, doubt=doubt)

    def every(self, step: int) -> FitRun:
        """A copy at every ``step``-th sample."""
        parts = ("time", "inputs", "targets", "lead_time", "lead_inputs", "doubt")
        return replace(self, **{name: np.ascontiguousarray(getattr(self, name)[::step]) for name in parts})


def _beyond(difference: FloatArray, doubt: FloatArray) -> FloatArray:
    """What of a difference is beyond doubt; nothing where the doubt has no end, though a model runs away there."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(doubt), 0.0, difference - np.clip(difference, -doubt, doubt))


@dataclass(frozen=True)
class Problem:
    """Residuals of a kernel against several runs.

    Attributes
    ----------
    kernel : Kernel
    runs : sequence of FitRun
    channels : tuple of str
        Names of the fitted outputs, the columns of the targets.
    space : SearchSpace
        By Python field name: start value, bounds, whether the parameter is free, and whether each run has its own.
    weights : ndarray, shape (channels,)
        Factor of each channel's residual, 1/noise; 1/standard deviation by default.
    pooling : mapping of str to float
        Partial pooling of per-run parameters, by field: weight of how far the runs' values are from their mean,
    centres : mapping of str to float
        or from the value given here.
    kept : tuple of Condition
        Joint conditions that a fit keeps, beside those of the model.
    prior : Prior, optional
        What a fit to other runs says of shared parameters.
    """

    kernel: Kernel
    runs: Sequence[FitRun]
    channels: tuple[str, ...]
    space: SearchSpace
    weights: FloatArray = field(default_factory=lambda: np.empty(0))
    pooling: Mapping[str, float] = field(default_factory=dict)
    centres: Mapping[str, float] = field(default_factory=dict)
    kept: tuple[Condition, ...] = ()
    prior: Prior | None = None

    def __post_init__(self) -> None:
        if not self.weights.size:
            spread = np.sqrt(np.mean([r.targets.var(axis=0) for r in self.runs], axis=0))
            object.__setattr__(self, "weights", 1.0 / np.where(spread > 0.0, spread, 1.0))

    @cached_property
    def fields(self) -> tuple[str, ...]:
        return tuple(v.field for v in self.kernel.parameters)

    @cached_property
    def declared(self) -> Mapping[str, Variable]:
        return {v.field: v for v in self.kernel.parameters}

    @property
    def shared(self) -> tuple[str, ...]:
        """Free parameters with one value for all runs."""
        return self.space.shared

    @property
    def per_run(self) -> tuple[str, ...]:
        """Free parameters with one value for each run."""
        return self.space.per_run

    @cached_property
    def columns(self) -> tuple[int, ...]:
        """Column of each channel among the kernel's outputs."""
        names = [v.name for v in self.kernel.outputs]
        return tuple(names.index(channel) for channel in self.channels)

    @cached_property
    def block(self) -> int:
        """Samples averaged into one residual row."""
        return max(1, -(-sum(r.targets.size for r in self.runs) // MAX_ROWS))

    def with_runs(self, runs: Sequence[FitRun]) -> Problem:
        """A copy with other runs."""
        return replace(self, runs=runs)

    def over(self, space: SearchSpace) -> Problem:
        """A copy with another search space."""
        return replace(self, space=space)

    def reweighted(self, weights: FloatArray) -> Problem:
        """A copy with other weights of the channels."""
        return replace(self, weights=weights)

    def starting_at(self, table: FloatArray) -> Problem:
        """A copy with the first row of a table as start values."""
        return self.over(self.space.starting_at(dict(zip(self.fields, table[0].tolist(), strict=True))))

    def start(self) -> FloatArray:
        """Table of the start values."""
        return np.tile([self.space[f].start for f in self.fields], (len(self.runs), 1))

    def params(self, row: FloatArray) -> Any:
        """The kernel's named tuple of one row, integers as integers."""
        return self.kernel.of_row(row)

    def refused(self, table: FloatArray) -> bool:
        """Whether a row of a table violates a bound or a joint condition of the model."""
        low, high = self.kernel.ends
        if not ((low <= table) & (table <= high)).all():
            return True
        return any(self.unmet(row) is not None for row in table)

    def unmet(self, row: FloatArray) -> Condition | None:
        """The first joint condition that a row within the bounds does not meet."""
        p = self.params(row)
        return next((c for c in (*self.kernel.conditions, *self.kept) if not c.met(p)), None)

    def outputs(self, run: int, row: FloatArray) -> FloatArray:
        """Simulated channels of one run, shape (n, channels); all NaN if the model stops."""
        return self.runs[run].compared(self.every_output(run, row)[:, self.columns])

    def every_output(self, run: int, row: FloatArray) -> FloatArray:
        """All outputs of the kernel for one run, shape (n, outputs)."""
        return self.outputs_with_lead(run, row)[self.runs[run].lead_time.size :]

    def outputs_with_lead(self, run: int, row: FloatArray) -> FloatArray:
        """All outputs of one run with its lead, shape (m + n, outputs)."""
        return self._simulated([(run, row)])[0]

    def outputs_of_all(self, table: FloatArray) -> list[FloatArray]:
        """Simulated channels of every run at its row of a table."""
        return self.outputs_at(list(enumerate(table)))

    def outputs_at(self, points: Points) -> list[FloatArray]:
        """Simulated channels of several (run, row of values)."""
        return self._by_pieces(self._channels, points)

    def gaps(self, table: FloatArray) -> list[FloatArray]:
        """Measured minus simulated channels of every run at its row of a table."""
        return [run.targets - y for run, y in zip(self.runs, self.outputs_of_all(table), strict=True)]

    def residual(self, run: int, row: FloatArray) -> FloatArray:
        """Weighted residual of one run, averaged over blocks, channel by channel, shape (rows,)."""
        return self.residuals([(run, row)])[0]

    def residuals(self, points: Points) -> list[FloatArray]:
        """Residuals of several (run, row of values), simulated side by side."""
        many = sum(self._rows[k] for k, _ in points) >= PARALLEL_ROWS
        return self._by_pieces(self._residuals, points, on_shared_threads if many else map)

    def penalties(self, table: FloatArray) -> FloatArray:
        """What values cost beside the residuals: the pooled ones by run, then those that a prior knows.

        Weighted distances of the runs' values from their centre, one pooled parameter after the other; and rows whose
        sum of squares is what the values cost other runs.
        """
        found = [np.empty(0)]
        for f in (f for f in self.per_run if self.pooling.get(f, 0.0) > 0.0):
            values = table[:, self.fields.index(f)]
            found.append(self.pooling[f] * (values - self.centres.get(f, values.mean())))
        if self.known is not None:
            at = [self.fields.index(f) for f in self.known.fields]
            found.append(self._prior_rows @ self.known.distances(table[0, at]))
        return np.concatenate(found)

    @cached_property
    def known(self) -> Prior | None:
        """What the prior says of the parameters here; those of others are anywhere."""
        if self.prior is None:
            return None
        found = self.prior.only(self.fields)
        return found if found.fields else None

    @cached_property
    def _prior_rows(self) -> FloatArray:
        return self.known.rows(self.weights) if self.known is not None else np.empty((0, 0))

    def cost(self, table: FloatArray) -> float:
        """Sum of squares of all residuals; infinite where the model fails."""
        with np.errstate(over="ignore"):
            total = sum(float(np.sum(r**2)) for r in self.residuals(list(enumerate(table))))
            total += float(np.sum(self.penalties(table) ** 2))
        return total if np.isfinite(total) else np.inf

    def _residuals(self, points: Points) -> list[FloatArray]:
        found, weights = [], self.weights[:, None]
        for (k, _), y in zip(points, self._simulated(points), strict=True):
            run = self.runs[k]
            found.append(self.condensed(run.excess(y[run.lead_time.size :, self.columns]) * weights))
        return found

    def _channels(self, points: Points) -> list[FloatArray]:
        simulated = zip(points, self._simulated(points), strict=True)
        runs = self.runs
        return [runs[k].compared(y[runs[k].lead_time.size :, self.columns]) for (k, _), y in simulated]

    def _by_pieces(
        self, work: Callable[[Points], list[FloatArray]], points: Points,
        map_: Callable[..., Iterable[list[FloatArray]]] = map,
    ) -> list[FloatArray]:  # fmt: skip
        """Results for points in their order, worked on in parts of about `PIECE_ROWS` rows, run by run.

        Simulations of one run can have the pieces of a chain in common.
        """
        order = sorted(range(len(points)), key=lambda i: points[i][0])
        found = (y for piece in map_(work, self._pieces([points[i] for i in order])) for y in piece)
        placed = dict(zip(order, found, strict=True))
        return [placed[i] for i in range(len(points))]

    def _pieces(self, points: Points) -> list[Points]:
        pieces: list[list[tuple[int, FloatArray]]] = []
        rows = PIECE_ROWS
        for k, row in points:
            if rows >= PIECE_ROWS:
                pieces.append([])
                rows = 0
            pieces[-1].append((k, row))
            rows += self._rows[k]
        return [*pieces]

    @cached_property
    def _rows(self) -> list[int]:
        """Rows to simulate of each run."""
        return [run.lead_time.size + run.time.size for run in self.runs]

    def _simulated(self, points: Points) -> list[FloatArray]:
        """All outputs of several (run, row of values), with what was before; of one where the model stops only NaN."""
        used = sorted({k for k, _ in points})
        times, all_inputs = zip(*(self.runs[k].with_lead for k in used), strict=True)
        time, inputs = (
            (times[0], all_inputs[0]) if len(used) == 1 else (np.concatenate(times), np.concatenate(all_inputs))
        )
        first = dict(zip(used, np.cumsum([0, *(t.size for t in times)]).tolist(), strict=False))
        table = np.array([row for _, row in points])
        to = np.cumsum([0, *(self._rows[k] for k, _ in points)], dtype=np.int64)
        spans = np.array([(first[k], first[k] + self._rows[k], at) for (k, _), at in zip(points, to, strict=False)])
        y = np.empty((to[-1], len(self.kernel.outputs)))
        filling(self.kernel, table)(table, spans, time, inputs, y)
        return [y[a:b] for a, b in pairwise(to.tolist())]

    def condensed(self, samples: FloatArray) -> FloatArray:
        """Block means times the root of the block length, shape (channels, n): a constant keeps its sum of squares."""
        if self.block == 1:
            return samples.ravel()
        edges, roots = _blocks(samples.shape[1], self.block)
        few = self.block <= FEW
        sums = _sums_of_few(samples, self.block) if few else np.add.reduceat(samples, edges, axis=1)
        return (sums / roots).ravel()


@cache
def _blocks(rows: int, block: int) -> tuple[NDArray[np.int64], FloatArray]:
    """First row of each block, and the root of its length."""
    edges = np.arange(0, rows, block)
    return edges, np.sqrt(np.diff(np.append(edges, rows)).astype(np.float64))


def _sums_of_few(samples: FloatArray, block: int) -> FloatArray:
    """``np.add.reduceat`` over blocks of few samples, to the same bits: that takes as long for a block of a hundred."""
    first = samples[:, ::block]
    others = np.zeros(first.shape)
    for k in range(1, block):
        part = samples[:, k::block]
        others[:, : part.shape[1]] += part
    return first + others
