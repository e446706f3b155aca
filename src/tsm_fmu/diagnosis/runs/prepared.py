"""The runs of a diagnosis as the search and the report need them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...checking import spikes, without_spikes
from ...kernels.kernel import Kernel
from ...logs.record import Record
from ...regression.problem import FitRun
from ...regression.specification import fit_run, measured_channels, not_in_every_run
from .beginning import compared_after_gaps, compared_after_start
from .displacement import position_notes, with_position_between_steps
from .drivers import with_drives
from .elsewhere import Elsewhere, elsewhere
from .motion_signals import position_of
from .unresolved import with_doubt


@dataclass(frozen=True)
class PreparedRuns:
    """Runs with all their samples, compared from where friction has forgotten what was before the log.

    Attributes
    ----------
    model : Kernel
        With an input for each column that may drive an effect.
    channels : tuple of str
        Measured outputs.
    measured, reference, holdout : tuple of FitRun
    others : tuple of Elsewhere or None
        Of each of these runs in turn, how else it may have moved.
    notes : tuple of str
        What a user should know of it.
    """

    model: Kernel
    channels: tuple[str, ...]
    measured: tuple[FitRun, ...]
    reference: tuple[FitRun, ...]
    holdout: tuple[FitRun, ...]
    others: tuple[Elsewhere | None, ...]
    notes: tuple[str, ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that the model has already, as ``id`` or ``id@channel``."""
        return tuple(getattr(self.model.module, "EFFECTS", ()))

    @property
    def stroke(self) -> float:
        """Longest stroke of the measured runs, in the unit of the motion; 1 without motion."""
        whole = ((run.lead_time.size, position_of(self.model, *run.with_lead)) for run in self.measured)
        return max(float(np.ptp(x[lead:])) for lead, x in whole) or 1.0


def prepared(
    model: Kernel, measured: Sequence[Record], reference: Sequence[Record], holdout: Sequence[Record],
    cutoff: float | None, drive: Mapping[str, str] | None = None,
) -> PreparedRuns:  # fmt: skip
    """Runs of a model from records.

    Raises
    ------
    InputError
        Runs that do not fit the model.
    """
    records = [*measured, *reference, *holdout]
    channels = measured_channels(model, records)
    model, notes = with_drives(model, records, channels, drive)

    def as_read(record: Record) -> FitRun:
        return with_doubt(model, _repaired(fit_run(model, record, channels, cutoff)), channels)

    read = [as_read(record) for record in records]
    used = [with_position_between_steps(model, run) for run in read]
    compared = [compared_after_start(model, compared_after_gaps(model, run), channels) for run in used]
    ends = len(measured), len(measured) + len(reference)
    return PreparedRuns(
        model, tuple(channels), tuple(compared[: ends[0]]), tuple(compared[ends[0] : ends[1]]),
        tuple(compared[ends[1] :]), tuple(elsewhere(model, one, moved) for one, moved in zip(read, used, strict=True)),
        (
            *notes,
            *not_in_every_run(model, records),
            *_spike_notes(records, channels),
            *position_notes(model, read[: ends[0]]),
        ),
    )  # fmt: skip


def _repaired(run: FitRun) -> FitRun:
    """The run without the spikes of its compared channels: one sample can be more than all of a gap."""
    columns = [without_spikes(column, run.time) for column in run.targets.T]
    return replace(run, targets=np.ascontiguousarray(np.column_stack(columns)))


def _spike_notes(records: Sequence[Record], channels: Sequence[str]) -> Iterator[str]:
    """How many samples of each channel are not compared, and an example to look at."""
    for channel in channels:
        found = [(record, rows) for record in records if (rows := spikes(record.columns[channel])).size]
        if found:
            record, rows = found[0]
            yield (
                f"{sum(r.size for _, r in found)} single samples of {channel} are spikes that no motion makes (one in "
                f"{record.name} at {record.time[rows[0]]:.3f} s): the line between their neighbours is compared instead"
            )
