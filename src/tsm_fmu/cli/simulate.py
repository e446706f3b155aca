"""``tsm-fmu simulate``: replay a measured run through an FMU, a model card or a model."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ..kernels.kernel import Kernel
from ..logs.record import Record, cutoff_note, kernel_inputs
from ..models.contract import InputError
from .app import app, print_json, settings
from .model_argument import model_argument, number_settings
from .outputs import check_output_file
from .runs import Cutoff, Input, Map, ReadOptions, Scale, Start, Stop, read_runs


@app.command("simulate")
def simulate(
    what: Annotated[str, typer.Argument(metavar="FMU|CARD|MODEL[:PRESET][+EFFECT...]", help="What to simulate.")],
    measured: Input,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Results: .csv, .csv.gz or .parquet.")],
    values: Annotated[list[str], typer.Option("--set", metavar="P=V", help="Parameter value, SI; repeatable.")] = [],  # noqa: B006
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Replay a record; RMSE and peak-to-peak error of every output that was measured."""
    from ..cosim.replay import agreement, check_measured, replay
    from ..cosim.trajectory import SimulationInterrupted, SimulationStopped, Trajectory, write_trajectory

    check_output_file(out, (".csv", ".csv.gz", ".parquet"), [measured], make_folder=True)
    (record,) = read_runs([measured], ReadOptions.of(start, stop, maps, scales))
    settled = settings(values)
    begun = time.perf_counter()
    if what.endswith(".fmu"):
        try:
            result = replay(Path(what), record, parameters=settled, cutoff=cutoff)
        except (SimulationStopped, SimulationInterrupted) as early:
            raise early.keep(out) from early
    else:
        model, p = _model(what, record, settled)
        units = {v.name: v.quantity.unit for v in model.outputs}
        check_measured(record, units)
        inputs = kernel_inputs(record, model, cutoff)
        y = model.simulate(p, record.time, inputs.values)
        columns = {v.name: y[:, k] for k, v in enumerate(model.outputs)}
        notes = (*inputs.notes, *cutoff_note(cutoff, [record], [v.name for v in model.inputs]))
        result = Trajectory(record.time, columns, units, messages=notes)
    wall = time.perf_counter() - begun
    channels = agreement(result.time, result.columns, record)
    write_trajectory(out, result)
    for line in result.messages:
        typer.echo(line, err=True)
    if as_json:
        steps = record.time.size - 1
        print_json({"channels": {n: asdict(a) for n, a in channels.items()}, "steps": steps, "wall_s": wall})
        return
    table = Table("channel", "unit", "RMSE", "peak-to-peak error", "RMSE / std of measured")
    for name, a in channels.items():
        table.add_row(name, a.unit, *(f"{x:.6g}" for x in (a.rmse, a.peak_to_peak_error, a.nrmse)))
    if channels:
        Console().print(table)
    else:
        typer.echo(f"{record.name} has none of the outputs {', '.join(result.columns)}: nothing to compare")
    typer.echo(f"results {out}")


def _model(what: str, record: Record, values: Mapping[str, str]) -> tuple[Kernel, object]:
    """Kernel and parameters of a model card, with the record's own values if it holds them, or of a model."""
    if any(mark in what for mark in "/\\.") and not what.endswith(".toml"):
        raise InputError(
            f"{what!r} -- expected a file that ends in .fmu or .toml, or MODEL[:PRESET][+EFFECT...] -- correct the name"
        )
    chosen = model_argument(what)
    model, settled = chosen.kernel, number_settings(dict(values))
    if chosen.card is None:
        return model, model.params(chosen.preset or None, settled)
    shared = chosen.card.params(record.name if record.name in chosen.card.per_run else None)
    fitted = {v.name: x for v, x in zip(model.parameters, shared, strict=True)}
    return model, model.params(values={**fitted, **settled})
