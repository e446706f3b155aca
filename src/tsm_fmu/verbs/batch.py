"""``batch``: fits or diagnoses of many rigs, in local processes or on a cluster; a rig that fails stops nothing."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..batching.kept import Kept, digest_of
from ..batching.run import run_batch
from ..cosim.progress import bar
from ..logs.table import write_table
from ..logs.whole_file import check_folder
from ..models.contract import InputError
from ..report import Figure, Section, Table, bar_figure, histogram_figure, write_report
from ..report.text import text_table

if TYPE_CHECKING:
    import pandas as pd

VERBS = ("identify", "diagnose", "track")
ROLES = ("measured", "holdout", "reference")
MOST_BARS = 40
"""Rigs that are shown with a bar each."""
_EXAMPLE = "for example columns rig, measured, holdout; several files of a cell with ';' between"


@dataclass(frozen=True)
class Rig:
    """A rig: its name, and the files of its runs by role (``measured``, ``holdout``, ``reference``)."""

    name: str
    runs: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class RigResult:
    """What came of a rig: numbers and texts by name, and why it failed (empty if it did not)."""

    rig: str
    values: Mapping[str, float | str] = field(default_factory=dict)
    failed: str = ""


@dataclass(frozen=True)
class BatchResult:
    """A verb over many rigs; see `batch`.

    Attributes
    ----------
    verb : str
    rigs : tuple of RigResult
        In the order of the table.
    results, report : Path
        The table and the page.
    """

    verb: str
    rigs: tuple[RigResult, ...]
    results: Path
    report: Path

    @property
    def failures(self) -> tuple[str, ...]:
        """One line for each rig that failed."""
        return tuple(f"{rig.rig}: {rig.failed}" for rig in self.rigs if rig.failed)

    def to_frame(self) -> pd.DataFrame:
        """One row a rig."""
        import pandas as pd

        return pd.DataFrame([{"rig": r.rig, **r.values, "failed": r.failed} for r in self.rigs])

    def summary(self) -> str:
        """The first columns of the table as text."""
        header, columns = _columns(self.rigs)
        shown = [k for k, name in enumerate(header) if "stderr" not in name][:6]
        rows = [[_cell(columns[k][n]) for k in shown] for n in range(len(self.rigs))]
        return text_table([header[k] for k in shown], rows)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``batch``."""
        return {"verb": self.verb, "rigs": [asdict(rig) for rig in self.rigs],
                "results": str(self.results), "report": str(self.report)}  # fmt: skip


@dataclass(frozen=True)
class RigWork:
    """A verb for one rig, in whichever process; its card or report goes into a folder of its own."""

    verb: str
    model: str
    out: Path
    options: Mapping[str, Any]

    def __call__(self, rig: Rig) -> RigResult:
        folder = self.out / rig.name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            return RigResult(rig.name, getattr(self, f"_{self.verb}")(rig, folder))
        except InputError as wrong:
            return RigResult(rig.name, {}, str(wrong))
        except OSError as failure:
            return RigResult(rig.name, {}, f"{folder}: {failure.strerror} -- expected a writable folder")

    def _identify(self, rig: Rig, folder: Path) -> dict[str, float | str]:
        from .identify import identify

        found = identify(self.model, rig.runs["measured"], holdout=rig.runs["holdout"], **self.options)
        if not found.complete:
            raise KeyboardInterrupt
        found.write_card(folder / "card.toml")
        values: dict[str, float | str] = {}
        for name, p in found.card.parameters.items():
            values[f"{name} [{p.unit}]"] = p.value
            values[f"{name} stderr [{p.unit}]"] = float("nan") if p.stderr is None else p.stderr
        for role, scores in (("measured", found.fit.measured), ("holdout", found.fit.holdout)):
            for channel, score in scores.items():
                values[f"{role} rmse {channel} [{score.unit}]"] = score.rmse
        return {**values, "findings": "; ".join(found.findings)}

    def _diagnose(self, rig: Rig, folder: Path) -> dict[str, float | str]:
        from .diagnose import diagnose

        found = diagnose(
            self.model, rig.runs["measured"], holdout=rig.runs["holdout"], reference=rig.runs["reference"],
            out=folder, **self.options,
        )  # fmt: skip
        if not found.complete:
            raise KeyboardInterrupt
        return {"verdict": str(found.verdict), "effects": ", ".join(found.effects), "answer": str(found.answer)}

    def _track(self, rig: Rig, folder: Path) -> dict[str, float | str]:
        from .track import track

        found = track(self.model, rig.runs["measured"], out=folder, **self.options)
        return {"runs": float(len(found.runs)), "moving": ", ".join(found.moving), "answer": found.answer}


def batch(
    verb: str,
    model: str | os.PathLike[str],
    table: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    notes: Callable[[str], object] = lambda _: None,
    **options: Any,
) -> BatchResult:
    """Do a verb for every rig of a table; a rig that fails says why, and the rest goes on.

    Parameters
    ----------
    verb : {"identify", "diagnose", "track"}
    model : str or path
        ``MODEL[:PRESET][+EFFECT...]`` or a card, the same for all rigs.
    table : path
        CSV with a row a rig: columns ``rig`` and ``measured``, and if wanted ``holdout`` and ``reference``. Files
        stand relative to the table, several in one cell with ``;`` between; ``*`` stands for several.
    out : str or Path
        Folder for the table ``rigs.parquet``, the page, and a folder a rig; a killed batch goes on there.
    workers, scheduler, progress, notes
        As in `sweep`.
    options
        Of the verb: ``seed``, ``fixed``, ``shared``, ``method``, ...

    Returns
    -------
    BatchResult

    Raises
    ------
    InputError
        An unknown verb, a table that cannot be read, or all rigs failed.
    """
    if verb not in VERBS:
        raise InputError(f"verb {verb!r} -- expected one of {', '.join(VERBS)} -- choose one")
    folder = check_folder(out).resolve()
    rigs = read_rigs(Path(table), ROLES if verb == "diagnose" else ROLES[:2])
    place = os.fspath(model)
    work = RigWork(verb, str(Path(place).resolve()) if place.endswith(".toml") else place, folder, options)
    files = [
        (rig.name, role, file, digest_of(Path(file))) for rig in rigs for role in rig.runs for file in rig.runs[role]
    ]
    identity = (__version__, verb, work.model, digest_of(Path(work.model)), files, sorted(options.items()))
    kept = Kept(folder / "rigs.points.jsonl", identity)
    done = {n: RigResult(**plain) for n, plain in kept.results.items()}
    if done:
        notes(f"{len(done)} of {len(rigs)} rigs kept from a batch that did not end")
    with bar(progress, f"{verb} of {len(rigs)} rigs", len(rigs)) as advance:
        run_batch(
            work, rigs, done, lost=_lost, keep=lambda n, one: kept.add(n, asdict(one)), workers=workers,
            scheduler=scheduler, advance=advance,
        )  # fmt: skip
    found = tuple(done[n] for n in sorted(done))
    header, columns = _columns(found)
    for ending in ("csv", "parquet"):
        write_table(folder / f"rigs.{ending}", header, columns)
    report = _page(folder, verb, work.model, found)
    kept.finish()
    if all(rig.failed for rig in found):
        raise InputError(f"all {len(found)} rigs failed -- expected one that does not -- the first: {found[0].failed}")
    return BatchResult(verb, found, folder / "rigs.parquet", report)


def read_rigs(path: Path, roles: Sequence[str] = ROLES) -> list[Rig]:
    """The rigs of a table.

    Raises
    ------
    InputError
        No such file, columns, rows or runs, or a name that is used twice or is no name of a folder.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as failure:
        raise InputError(f"table {path}: {failure} -- expected a CSV of rigs -- {_EXAMPLE}") from None
    columns = set(rows[0]) if rows else set()
    if not {"rig", "measured"} <= columns or not columns <= {"rig", *roles}:
        known = ", ".join(str(c) for c in rows[0]) if rows else "no rows"
        raise InputError(f"table {path} has {known} -- expected columns rig, {', '.join(roles)} -- {_EXAMPLE}")
    rigs = []
    for row in rows:
        name = (row["rig"] or "").strip()
        if not re.fullmatch(r"[\w][\w.+-]*", name) or name in {rig.name for rig in rigs}:
            raise InputError(f"table {path}: rig {name!r} -- expected letters and digits, each rig once -- rename it")
        rigs.append(Rig(name, {role: _files(path.parent, row.get(role) or "") for role in ROLES}))
    return rigs


def _files(folder: Path, cell: str) -> tuple[str, ...]:
    found: list[str] = []
    for part in filter(None, (text.strip() for text in cell.split(";"))):
        path = (folder / part).absolute()
        several = sorted(str(p) for p in path.parent.glob(path.name)) if "*" in path.name else []
        found += several or [str(path)]
    return tuple(found)


def _lost(rig: Rig, reason: str) -> RigResult:
    return RigResult(rig.name, {}, reason)


def _columns(rigs: Sequence[RigResult]) -> tuple[list[str], list[Any]]:
    """Header cells and columns: the rig, what is known of any of them, why it failed."""
    names = list(dict.fromkeys(name for rig in rigs for name in rig.values))
    columns: list[Any] = [np.array([rig.rig for rig in rigs])]
    for name in names:
        text = any(isinstance(rig.values.get(name), str) for rig in rigs)
        columns.append(np.array([rig.values.get(name, "" if text else np.nan) for rig in rigs]))
    return ["rig", *names, "failed"], [*columns, np.array([rig.failed for rig in rigs])]


def _cell(value: Any) -> Any:
    return str(value) if isinstance(value, str) else float(value)


def _page(folder: Path, verb: str, model: str, rigs: Sequence[RigResult]) -> Path:
    header, columns = _columns(rigs)
    rows = [[_cell(column[n]) for column in columns] for n in range(len(rigs))]
    failed = sum(bool(rig.failed) for rig in rigs)
    numbers = [(header[k], c) for k, c in enumerate(columns) if c.dtype.kind == "f" and "stderr" not in header[k]]
    spread = [
        (name, *np.nanpercentile(c, [0, 50, 100]).tolist(), rigs[int(np.nanargmax(np.abs(c)))].rig)
        for name, c in numbers
        if np.isfinite(c).any()
    ]
    tables = [Table(("number", "lowest", "median", "highest", "largest at rig"), spread)] if spread else []
    text = f"{len(rigs)} rigs, {failed} failed. rigs.parquet has the same table; each rig has a folder of its own."
    section = Section("Rigs", text, [*tables, Table(header, rows, "One row for each rig.")])
    title = f"{verb} of {Path(model).name} over {len(rigs)} rigs"
    return write_report(
        folder / "report.html", title, _answer(rigs), [section], {"tsm-fmu": __version__}, _picture(rigs)
    )


def _answer(rigs: Sequence[RigResult]) -> str:
    """How many rigs failed; of the others the range of each error with its worst rig, or who has which effect."""
    count = sum(not rig.failed for rig in rigs)
    parts = [f"{len(rigs)} rigs, {len(rigs) - count} failed."]
    for name, errors in _errors(rigs).items():
        error, _, unit = name.rstrip("]").partition(" [")
        worst = max(errors, key=lambda rig: errors[rig])
        parts.append(f"{error} from {min(errors.values()):.3g} to {errors[worst]:.3g} {unit}, largest at {worst}.")
    for one, names in _having(rigs).items():
        shown = f"{', '.join(names[:5])}{', ...' * (len(names) > 5)}"
        parts.append(f"{one}: {len(names)} of {count} rigs ({shown}).")
    return " ".join(parts)


def _picture(rigs: Sequence[RigResult]) -> Figure | None:
    """The error of each rig, of many rigs how often which; or how many rigs have which effect."""
    errors, having = _errors(rigs), _having(rigs)
    if having:
        return bar_figure({"rigs": {one: float(len(names)) for one, names in having.items()}}, "what was found")
    if not errors:
        return None
    if max(map(len, errors.values())) <= MOST_BARS:
        return bar_figure(errors, "error by rig")
    name, of_rigs = next(iter(errors.items()))
    return histogram_figure(list(of_rigs.values()), name, name, "rigs")


def _errors(rigs: Sequence[RigResult]) -> dict[str, dict[str, float]]:
    """Errors by column, then by rig."""
    found: dict[str, dict[str, float]] = {}
    for rig in rigs:
        for name, value in rig.values.items():
            if " rmse " in name and not rig.failed:
                found.setdefault(name, {})[rig.rig] = float(value)
    return found


def _having(rigs: Sequence[RigResult]) -> dict[str, list[str]]:
    """Rigs by effect or moving parameter, the most frequent first."""
    found: dict[str, list[str]] = {}
    for column, without in (("effects", "nothing named"), ("moving", "nothing moves")):
        for rig in rigs:
            for one in str(rig.values[column]).split(", ") if column in rig.values and not rig.failed else ():
                found.setdefault(one or without, []).append(rig.rig)
    return dict(sorted(found.items(), key=lambda item: -len(item[1])))
