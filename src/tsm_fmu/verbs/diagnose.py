"""``diagnose``: where a model and measured runs disagree, and which effect is missing."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..card import write_card
from ..diagnosis.report.write import write_diagnosis
from ..diagnosis.result import Diagnosis
from ..diagnosis.workflow import DiagnosisInterrupted
from ..diagnosis.workflow import diagnose as find
from ..logs.record import cutoff_note
from ..logs.whole_file import check_folder
from .models import ModelLike, resolve_model
from .runs import RunLike, grouped


def diagnose(
    model: ModelLike,
    runs: RunLike | Sequence[RunLike],
    *,
    holdout: RunLike | Sequence[RunLike] = (),
    reference: RunLike | Sequence[RunLike] = (),
    values: Mapping[str, float] | None = None,
    cutoff: float | None = None,
    seed: int = 0,
    drive: Mapping[str, str] | None = None,
    improve: bool = False,
    out: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find the effect that a model misses; nothing, or "cannot tell", are answers too.

    Parameters
    ----------
    model : str, path, ModelCard, Kernel or result
        The model that disagrees, see `identify`.
    runs : path, Record, DataFrame, or a sequence of them
        Runs with the gap.
    holdout, reference : path, Record, DataFrame, or a sequence of them
        Runs that confirm a name; runs of the same rig without the missing effect.
    values : mapping of str to float, optional
        Parameter values by public name, SI.
    cutoff : float, optional
        Cut-off [Hz] where v and a are derived from x.
    seed : int
        Same seed, same result.
    drive : mapping of str to str, optional
        What a column of the runs beyond the model's variables may be for effects: ``load`` (tensions, forces, motor
        currents), ``bend`` (a sheath's angle), ``temperature``, ``position`` (of a model driven by its speed) or
        ``none``. Without it its unit says so.
    improve : bool
        Also go on, effect after effect, to the model that predicts best on runs left out of the fit (two measured runs
        or more; minutes): ``improved`` of the result. It may hold effects that are useful and not named.
    out : str or Path, optional
        Folder for ``diagnosis.json``, the model of the answer as card and FMU, and the report; nothing is written
        without it.
    progress : callable
        Told what is being done, in a few words.

    Returns
    -------
    Diagnosis
        ``verdict``, ``answer``, ``effects``, ``gap``, ``model`` (a card), ``summary()``, ``to_frame()``, ``figure()``.

    Raises
    ------
    InputError
        Unknown names, values out of bounds, runs that cannot be read or do not fit the model.
    """
    resolved = resolve_model(model)
    folder = None if out is None else check_folder(out)
    start = {**resolved.values, **(values or {})}
    resolved.kernel.params(resolved.preset or None, start)
    measured, references, held_out = grouped(runs, reference, holdout)
    records = [*measured, *references, *held_out]
    try:
        found = find(
            resolved.kernel, measured, values=start, preset=resolved.preset or None, fixed=resolved.fixed,
            reference=references, holdout=held_out, cutoff=cutoff, seed=seed, drive=drive, improve=improve,
            progress=progress,
        )  # fmt: skip
    except DiagnosisInterrupted as stopped:
        if folder is None:
            raise
        kept = folder / "card.incomplete.toml"
        write_card(kept, stopped.card)
        raise KeyboardInterrupt(
            f"interrupted before an answer; {resolved.kernel.name} as refitted is kept in {kept}"
        ) from None
    unused = cutoff_note(cutoff, records, [v.name for v in resolved.kernel.inputs])
    found = replace(found, notes=(*found.notes, *(note.rstrip(".") for note in unused)))
    if folder is not None:
        progress("card, FMU, report")
        write_diagnosis(folder, found)
    return found
