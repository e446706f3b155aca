"""``track``: one model over the life of a drive."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..logs.display import display
from ..logs.plain_json import finite
from ..logs.record import cutoff_note
from ..logs.repeated import without_repeated_rows
from ..logs.whole_file import check_folder, remove_earlier, write_whole
from ..models.contract import InputError
from ..regression.specification import fit_run, measured_channels, not_in_every_run, per_run_fields, search_space
from ..report.text import text_table
from ..tracking.follow import TrackedRun, followed, followed_fields
from ..tracking.life import Series, check_count, series_of
from ..tracking.order import GIVEN, order_note, ordered
from .models import ModelLike, ResolvedModel, resolve_model
from .runs import RunLike, records_of

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure


@dataclass(frozen=True)
class TrackResult:
    """A model over the runs of a drive's life; see `track`.

    Attributes
    ----------
    model : str
        Base model and effects.
    tracked : tuple of str
        Parameters refitted in each run; all others of the card's shared values stay.
    runs : tuple of TrackedRun
        In time order: values with intervals, errors before and after.
    series : tuple of Series
        What each tracked parameter, each run's offset and the error of each channel does over the runs.
    sources : mapping of str to str
        Digest of each run's file.
    by : str
        What they are ordered by: ``given``, ``name``, ``start``, or a column.
    notes : tuple of str
        What was derived, and which options had no effect.
    """

    model: str
    tracked: tuple[str, ...]
    runs: tuple[TrackedRun, ...]
    series: tuple[Series, ...]
    sources: dict[str, str]
    by: str
    notes: tuple[str, ...]

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the series that show a trend or a jump."""
        return tuple(one.name for one in self.series if one.moves)

    @property
    def answer(self) -> str:
        """The result in a sentence for each value that moves."""
        if self.moving:
            return " ".join(f"{one.text}." for one in self.series if one.moves)
        return f"No drift shown in {', '.join(self.tracked)} over {len(self.runs)} runs."

    def summary(self) -> str:
        """What each value does over the runs, as text."""
        rows = []
        for one in self.series:
            show = display(one.unit, max(map(abs, one.values), default=0.0))
            if (d := one.drift) is None:
                rows.append((one.name, "too few runs", "", "", "", "", ""))
                continue
            jump = ", ".join(show(one_jump.size) for one_jump in d.jumps)
            rows.append(
                (one.name, d.form, show(d.begin, 4), show(d.end, 4), jump, f"{d.p_trend:.2g}", f"{d.p_jump:.2g}")
            )
        heading = ("value", "over the runs", "begin", "end", "jumps", "p of a trend", "p of a jump")
        title = f"{self.model} over {len(self.runs)} runs, {self.runs[0].name} to {self.runs[-1].name}"
        return "\n".join([*self.notes, text_table(heading, rows, title), "", *(f"{one.text}." for one in self.series)])

    def to_frame(self) -> pd.DataFrame:
        """One row a run and value, SI: run, number, name, kind, unit, value, stderr, low, high, used."""
        import pandas as pd

        units = {one.name: (one.kind, one.unit) for one in self.series}
        rows = [
            {"run": run.name, "number": k, "name": name, "kind": kind, "unit": unit, **vars(found)}
            for k, run in enumerate(self.runs, 1)
            for name, found in run.values.items()
            for kind, unit in [units[name]]
        ]
        rows += [
            {"run": run.name, "number": k, "name": one.name, "kind": one.kind, "unit": one.unit,
             "value": run.rmse[one.name.removeprefix("error of ")], "used": True}
            for k, run in enumerate(self.runs, 1)
            for one in self.series
            if one.kind == "error"
        ]  # fmt: skip
        return pd.DataFrame(rows)

    def figure(self, name: str | None = None) -> Figure:
        """Values with intervals over the runs and the form found.

        Parameters
        ----------
        name : str, optional
            Of one series; all without it.
        """
        from ..tracking.page import life_figure

        selected = [one for one in self.series if name in (None, one.name)]
        if not selected:
            known = ", ".join(one.name for one in self.series)
            raise InputError(f"series {name!r} -- expected one of {known} -- correct the name")
        return life_figure(selected, self.runs, f"{self.model} over {len(self.runs)} runs")

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``track``."""
        return finite(
            {
                "model": self.model,
                "tracked": self.tracked,
                "by": self.by,
                "moving": self.moving,
                "answer": self.answer,
                "series": {one.name: {k: v for k, v in vars(one).items() if k != "name"} for one in self.series},
                "runs": self.runs,
                "sources": self.sources,
                "notes": self.notes,
            }
        )

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write ``track.json``, ``track.csv`` and the page ``report.html`` into a folder; returns it.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        from ..tracking.page import write_life

        place = Path(folder)
        remove_earlier(place, ("track.json", "track.csv", "track.incomplete.csv", "report.html"))
        write_whole(place / "track.json", json.dumps(self.as_json(), indent=2) + "\n")
        write_whole(place / "track.csv", self.to_frame().to_csv(index=False))
        sources = {f"run {k}, {name}": f"SHA-256 {sha}" for k, (name, sha) in enumerate(self.sources.items(), 1) if sha}
        title = f"{self.model} over {len(self.runs)} runs"
        write_life(place / "report.html", title, self.series, self.runs, self.answer, self.by, sources)
        return place

    def _repr_html_(self) -> str:
        return f"<p>{self.answer}</p>{self.figure()._repr_html_()}"


def track(
    card: ModelLike,
    runs: Sequence[RunLike],
    *,
    free: Sequence[str] = (),
    by: str = GIVEN,
    cutoff: float | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> TrackResult:
    """Refit a few parameters of a card in each of many runs, and say which of them drift or jump over the runs.

    Offsets and initial states are fitted in each run too; all other values stay at the card's.

    Parameters
    ----------
    card : path, ModelCard or result
        A fitted model, also with effects.
    runs : sequence of path, Record or DataFrame
        Five or more.
    free : sequence of str
        Parameters to follow; without it those that have a standard error in the card and that single runs tell to a
        tenth of their value.
    by : str
        Order of the runs in time: ``given``; ``name``, numbers in it by their value; ``start``, the date at which each
        begins; or the first value of a column.
    cutoff : float, optional
        Cut-off [Hz] where v and a are derived from x; from the data without it.
    out : path, optional
        Folder for ``track.json``, ``track.csv`` and ``report.html``.
    progress : callable, optional
        Told the run that is being fitted.

    Returns
    -------
    TrackResult

    Raises
    ------
    InputError
        No card, unknown parameters, fewer than five runs, runs that cannot be read, ordered or do not fit the model.
    """
    resolved = resolve_model(card)
    if resolved.card is None:
        raise InputError(
            f"model {resolved.kernel.name} without a card -- expected a fitted model "
            "-- write one with 'tsm-fmu identify'"
        )
    if out is not None:
        check_folder(out)
    kernel = resolved.kernel
    per_run = per_run_fields(kernel)
    followed_names = _followed(resolved, free, per_run)
    records, repeated = without_repeated_rows(ordered(records_of(runs), by))
    check_count(len(records))
    channels = measured_channels(kernel, records)
    fit_runs = [fit_run(kernel, record, channels, cutoff) for record in records]
    released = _released(resolved, free)
    space = search_space(kernel, resolved.preset or None, card=released, per_run=per_run)
    fields = tuple(followed_names) if free else followed_fields(kernel, fit_runs, channels, space, followed_names)
    offsets = [v.field for v in kernel.parameters if v.name in kernel.roles.offsets and space[v.field].free]
    tracked = tuple(v.name for v in kernel.parameters if v.field in fields)
    units = {v.name: v.quantity.unit for v in kernel.outputs if v.name in channels}
    notes = dict.fromkeys(
        [*repeated, *not_in_every_run(kernel, records), *(note for run in fit_runs for note in run.derived)]
    )

    def result_of(found: Sequence[TrackedRun]) -> TrackResult:
        return TrackResult(
            "+".join((kernel.name, *resolved.effects)),
            tracked,
            tuple(found),
            series_of(kernel, resolved.effects, tracked, found, units),
            {record.name: record.sha256 for record in records[: len(found)]},
            by,
            (*notes, *order_note(records, by), *cutoff_note(cutoff, records, [v.name for v in kernel.inputs])),
        )

    found: list[TrackedRun] = []
    try:
        for one in followed(kernel, fit_runs, channels, space, fields, [*fields, *offsets], progress):
            found.append(one)
    except KeyboardInterrupt:
        if out is None or not found:
            raise
        kept = Path(out) / "track.incomplete.csv"
        write_whole(kept, result_of(found).to_frame().to_csv(index=False))
        raise KeyboardInterrupt(f"interrupted; {len(found)} of {len(records)} runs kept in {kept}") from None
    result = result_of(found)
    if out is not None:
        result.write(out)
    return result


def _followed(resolved: ResolvedModel, free: Sequence[str], per_run: Sequence[str]) -> list[str]:
    """Fields asked for, or those that the card says are known."""
    assert resolved.card is not None
    follows = {v.name: v.field for v in resolved.kernel.parameters if v.kind is float and v.field not in per_run}
    for name in free:
        if name not in follows:
            raise InputError(
                f"--free {name} of {resolved.kernel.name} -- expected one of {', '.join(follows)} -- correct the name"
            )
    known = [name for name, p in resolved.card.parameters.items() if p.stderr is not None and not p.fixed]
    return [field for name, field in follows.items() if name in (free or known)]


def _released(resolved: ResolvedModel, free: Sequence[str]) -> Any:
    """The card with what is asked for no longer fixed."""
    from dataclasses import replace

    assert resolved.card is not None
    parameters = {name: replace(p, fixed=False) if name in free else p for name, p in resolved.card.parameters.items()}
    return replace(resolved.card, parameters=parameters)
