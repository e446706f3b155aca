"""``tsm-fmu check``: what is in a measured run."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ..checking import RunCheck, check_record
from ..checking.finding import shown
from .app import app, print_json
from .runs import Cutoff, Map, ReadOptions, Run, Scale, Start, Stop, read_runs


@app.command("check")
def check(
    run: Run,
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Columns, rate, gaps, glitches, quantisation, power sign, coverage: what is in this log."""
    (record,) = read_runs([run], ReadOptions.of(start, stop, maps, scales))
    result = check_record(record, cutoff)
    if cutoff is not None and result.motion is None:
        typer.echo(f"--cutoff {cutoff:g} Hz is not used: no position in {record.name} moves", err=True)
    if as_json:
        print_json(asdict(result))
        return
    _print(Console(), result)


def _print(console: Console, result: RunCheck) -> None:
    say = console.print
    clock = result.clock
    say(
        f"{result.name}: {result.samples} samples from {result.t0:g} to {result.t1:g} s at {clock.rate:.6g} Hz, "
        f"jitter {clock.jitter:.2g} s, {clock.gaps} gaps; sha256 {result.sha256[:12]}",
        highlight=False,
    )
    table = Table("channel", "unit", "lowest", "highest", "step", "steps in range", "noise")
    for name, c in result.channels.items():
        steps = (f"{c.step:.6g}", f"{(c.highest - c.lowest) / c.step:.0f}") if c.step > 0.0 else ("none found", "")
        table.add_row(name, c.unit, f"{c.lowest:.6g}", f"{c.highest:.6g}", *steps, f"{c.noise:.3g}")
    if result.channels:
        say(table)
    if m := result.motion:
        strokes = " / ".join(shown(x, m.unit) for x in m.amplitudes)
        speed, accel = max(map(abs, m.v)), max(map(abs, m.a))
        lines = [
            f"motion of {m.channel}: {shown(m.x[0], m.unit)} to {shown(m.x[1], m.unit)}, speed up to "
            f"{shown(speed, m.unit + '/s')}, acceleration up to {shown(accel, m.unit + '/s2')}"
            + (f" (cut-off {m.cutoff:.3g} Hz)" if m.cutoff else " (uneven sampling: differences)"),
            f"{m.reversals} reversals, half strokes (least / median / most) {strokes}",
            f"frequencies {', '.join(f'{f:.3g}' for f in m.frequencies) or 'none'} Hz, longest rest {m.dwell:.3g} s",
        ]
        for line in lines:
            say(line, highlight=False)
    for p in result.powers:
        say(f"power {p.effort} * d{p.motion}/dt: {p.mean:.3g} W on average", highlight=False)
    found = [f for f in result.findings if f.kind != "coverage"]
    say(f"findings: {len(found)}" if found else "nothing wrong found", style="bold")
    for f in found:
        say(f"  {f.kind}: {f.text}", highlight=False, markup=False, soft_wrap=True)
    missing = [f for f in result.findings if f.kind == "coverage"]
    if missing:
        say("what this log cannot show", style="bold")
        for f in missing:
            say(f"  {f.text}", highlight=False, markup=False, soft_wrap=True)
