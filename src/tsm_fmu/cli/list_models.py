"""``tsm-fmu list``: models and effects, a line each; of one of them its equations, presets and variables with units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..effects import EFFECTS
from ..kernels.kernel import Kernel
from ..models import MODELS
from ..models.contract import InputError, Variable
from .app import AsJson, app, print_json


@app.command("list")
def list_models(
    name: Annotated[
        str, typer.Argument(help="A model or an effect: its equations, presets and variables.", show_default=False)
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Models and effects; of one of them its equations, presets and variables with units."""
    kernels, effects = ([k for k in map(Kernel, modules) if name in ("", k.name)] for modules in (MODELS, EFFECTS))
    if not kernels and not effects:
        known = ", ".join(module.NAME for module in (*MODELS, *EFFECTS))
        raise InputError(f"{name!r} is no model and no effect -- expected one of {known} -- correct the name")
    if as_json:
        described = {k.name: _described(k) for k in kernels}
        print_json({"models": described, "effects": {k.name: _described_effect(k) for k in effects}})
        return
    console = Console()
    if not name:
        console.print(_overview("Models", [(k.name, k) for k in kernels]))
        effect_titles = [(f"{k.name} ({k.module.ABOUT.family})", k) for k in effects]
        console.print(_overview("Effects: attach one as MODEL+effect, or MODEL+effect@channel", effect_titles))
        console.print("Equations, source, presets and variables of one: tsm-fmu list NAME; all as data: --json")
        return
    console.print(escape((kernels or effects)[0].module.__doc__ or ""), highlight=False, soft_wrap=True)
    for k in kernels:
        console.print(_variables(k))
    if effects:
        console.print(_effects(effects))


def _overview(title: str, named: Sequence[tuple[str, Kernel]]) -> Table:
    """A line each: the name and the first sentence of its text."""
    table = Table(title=title, title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, min_width=max(len(shown) for shown, _ in named))
    table.add_column()
    for shown, k in named:
        table.add_row(escape(shown), escape((k.module.__doc__ or "").partition("\n\n")[0].replace("\n", " ")))
    return table


def _variables(k: Kernel) -> Table:
    table = Table(title=f"{k.name}  (presets: {', '.join(k.presets) or 'none'})", title_justify="left")
    names = [v.name for v in (*k.inputs, *k.outputs, *k.parameters)]
    table.add_column("")
    table.add_column("variable", no_wrap=True, min_width=max(map(len, names)))
    for heading in ("unit", "start", "bounds", "meaning"):
        table.add_column(heading)
    for role in ("inputs", "outputs", "parameters"):
        for v in getattr(k, role):
            start = f"{v.start:g}" if role == "parameters" else ""
            table.add_row(role[:-1], v.name, v.quantity.unit, start, escape(_bounds(v)), escape(v.quantity.meaning))
    return table


def _effects(effects: Sequence[Kernel]) -> Table:
    table = Table(title="Effects: attach one as id, or id@channel", title_justify="left")
    table.add_column("effect", no_wrap=True, min_width=max(len(k.name) for k in effects))  # ids are copied from here
    for heading in ("acts on", "family", "signature", "parameters"):
        table.add_column(heading)
    for k in effects:
        names = ", ".join(f"{v.name} [{v.quantity.unit}]" for v in k.parameters)
        about = k.module.ABOUT
        table.add_row(k.name, ", ".join(about.places), about.family, about.signature, escape(names))
    return table


def _described_effect(k: Kernel) -> dict[str, Any]:
    """An effect's units are relative: {F} the friction, {load} the load, {x} the input motion, {y} its channel."""
    parameters = [_variable(v) for v in k.parameters]
    about = k.module.ABOUT
    known = {"places": list(about.places), "family": about.family, "signature": about.signature}
    return {**known, "parameters": parameters}


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
        **({"choices": list(q.choices)} if q.choices else {}),
        "meaning": q.meaning,
    }


def _bounds(v: Variable) -> str:
    q = v.quantity
    return f"{'(' if q.open_lo else '['}{q.lo:g}, {q.hi:g}{')' if q.open_hi else ']'}"
