"""``tsm-fmu list``: models, presets and variables with units."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..effects import EFFECTS
from ..kernel import Kernel
from ..models import MODELS
from ..models.contract import Variable
from .app import app, print_json


@app.command("list")
def list_models(as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False) -> None:
    """Models, effects, presets, variables with units."""
    kernels = [Kernel(module) for module in MODELS]
    if as_json:
        effects = {k.name: _described_effect(k) for k in map(Kernel, EFFECTS)}
        print_json({"models": {k.name: _described(k) for k in kernels}, "effects": effects})
        return
    console = Console()
    for k in kernels:
        table = Table(title=f"{k.name}  (presets: {', '.join(k.presets) or 'none'})", title_justify="left")
        for heading in ("", "variable", "unit", "start", "bounds", "meaning"):
            table.add_column(heading)
        for role in ("inputs", "outputs", "parameters"):
            for v in getattr(k, role):
                start = f"{v.start:g}" if role == "parameters" else ""
                table.add_row(role[:-1], v.name, v.quantity.unit, start, escape(_bounds(v)), escape(v.quantity.meaning))
        console.print(table)
    table = Table(title="Effects: attach one as id, or id@channel", title_justify="left")
    for heading in ("effect", "acts on", "signature", "parameters"):
        table.add_column(heading)
    for k in map(Kernel, EFFECTS):
        names = ", ".join(f"{v.name} [{v.quantity.unit}]" for v in k.parameters)
        table.add_row(k.name, ", ".join(k.module.PLACES), k.module.SIGNATURE, escape(names))
    console.print(table)


def _described_effect(k: Kernel) -> dict[str, Any]:
    """An effect's units are relative: {F} the friction, {load} the load, {x} the input motion, {y} its channel."""
    parameters = [_variable(v) for v in k.parameters]
    return {"places": list(k.module.PLACES), "signature": k.module.SIGNATURE, "parameters": parameters}


def _described(k: Kernel) -> dict[str, Any]:
    roles: dict[str, Any] = {
        role: [_variable(v) for v in getattr(k, role)] for role in ("inputs", "outputs", "parameters")
    }
    roles["presets"] = {n: {"source": p.source, "printed": p.printed, "si": p.si} for n, p in k.presets.items()}
    return roles


def _variable(v: Variable) -> dict[str, Any]:
    q = v.quantity
    return {
        "name": v.name,
        "type": "Integer" if v.kind is int else "Real",
        "unit": q.unit,
        "display_unit": q.display or q.unit,
        "start": v.start,
        "min": q.lo,
        "max": q.hi,
        "meaning": q.meaning,
    }


def _bounds(v: Variable) -> str:
    q = v.quantity
    return f"{'(' if q.open_lo else '['}{q.lo:g}, {q.hi:g}{')' if q.open_hi else ']'}"
