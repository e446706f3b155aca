"""One page for each model and effect, from its file: equations, variables, presets, a plot of what it does.

Written into ``docs/models/`` and ``docs/effects/`` when the site is built; nothing of it is kept in the repository.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from typeset import docstring_html

from tsm_fmu.effects import EFFECTS, FAMILIES, roles_of
from tsm_fmu.effects.about import Read, Shape, Size
from tsm_fmu.fmu.stimuli import stimuli
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs.display import display
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import InputError, Variable

STEP = 1.0 / 64.0
SHARE = 0.35
"""Size at which an effect is drawn: its change over the friction it is drawn on, root mean square."""

mpl.rcParams["svg.hashsalt"] = "tsm-fmu"  # the same bytes at each build


def setup(app: Any) -> dict[str, Any]:
    """Sphinx calls this."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages(app: Any) -> None:
    """Write the pages of all models and effects, and the two lists of them."""
    docs = Path(app.srcdir)
    models, effects = [Kernel(m) for m in MODELS], [Kernel(e) for e in EFFECTS]
    for folder, kernels, page in (("models", models, model_page), ("effects", effects, effect_page)):
        (docs / folder).mkdir(exist_ok=True)
        for kernel in kernels:
            _write(docs / folder / f"{kernel.name}.md", page(kernel, docs / folder))
        _write(docs / folder / "index.md", _index(folder, kernels))


def model_page(kernel: Kernel, folder: Path) -> str:
    """The page of a model."""
    figure = _loop(kernel)
    figure.savefig(folder / f"{kernel.name}.svg", metadata={"Date": None})
    inputs, outputs = kernel.inputs, kernel.outputs
    parts = [
        f"# {kernel.name}",
        _equations(kernel),
        "## Response",
        f"![{kernel.name}: outputs over the first input]({kernel.name}.svg)",
        "The reference experiment of the FMU, with the default parameters: reversals, a nested loop, holds.",
        "## Inputs",
        _table(inputs) if inputs else "None.",
        "## Outputs",
        _table(outputs),
        "## Parameters",
        _table(kernel.parameters, bounds=True) if kernel.parameters else "None.",
        *_presets(kernel),
        "## Effects that can be added",
        ", ".join(f"[{e}](../effects/{e}.md)" for e in _attachable(kernel)) or "None.",
        "## Use",
        f"```console\n$ tsm-fmu list {kernel.name}\n$ tsm-fmu build {kernel.name} --out fmus\n```",
        _source(kernel),
    ]
    return "\n\n".join(parts)


def effect_page(kernel: Kernel, folder: Path) -> str:
    """The page of an effect."""
    figure = _change(kernel)
    plot = []
    if figure is not None:
        figure.savefig(folder / f"{kernel.name}.svg", metadata={"Date": None})
        plot = ["## What it does", f"![with and without {kernel.name}]({kernel.name}.svg)"]
    places = [
        f"{m.NAME}: {', '.join(a or 'the friction' for a in found)}" for m in MODELS if (found := _places(m, kernel))
    ]
    parts = [
        f"# {kernel.name}",
        _equations(kernel),
        _known(kernel),
        *plot,
        "## Parameters",
        "Units are relative: `{F}` is that of the friction, `{load}` of the load, `{x}` of the motion, `{y}` of the "
        "channel it acts on.",
        _table(kernel.parameters, bounds=True, roles=roles_of(kernel.module)),
        "A size alone brings the effect about; a shape does nothing without one, and is looked for in the range given, "
        "over the stroke, speed, length or load of the runs.",
        "## Places",
        "\n".join(f"- {place}" for place in places) or "None.",
        f"```console\n$ tsm-fmu identify TendonDrive+{kernel.name} --measured run.csv --out card.toml\n```",
        _source(kernel),
    ]
    return "\n\n".join(parts)


def _index(folder: str, kernels: list[Kernel]) -> str:
    rows = [f"| [{k.name}]({k.name}.md) | {_first_sentence(k)} |" for k in kernels]
    tree = "\n".join(k.name for k in kernels)
    return (
        f"# {folder.capitalize()}\n\n| name | what it is |\n|---|---|\n" + "\n".join(rows) + "\n\n"
        f"```{{toctree}}\n:hidden:\n\n{tree}\n```\n"
    )


def _equations(kernel: Kernel) -> str:
    return f"```{{raw}} html\n{docstring_html(kernel.module.__doc__ or '')}\n```"


def _first_sentence(kernel: Kernel) -> str:
    return (kernel.module.__doc__ or "").split("\n\n")[0].replace("\n", " ").replace("|", "\\|")


def _source(kernel: Kernel) -> str:
    path = kernel.module.__name__.replace(".", "/")
    return f"Written in `src/{path}.py`: the same text runs inside the FMU, compiled for fits, and as this page."


def _known(kernel: Kernel) -> str:
    about = kernel.module.ABOUT
    alike = ", ".join(f"[{name}]({name}.md)" for name in about.looks_like)
    known = f"In a sentence: {about.words}, {FAMILIES[about.family]}. Sign of it: {about.signature}."
    return f"{known} A log shows it that has {about.shown_by}." + (
        f" Where a log is poor, it looks like {alike}." if alike else ""
    )


def _role(role: Size | Shape | Read) -> str:
    if isinstance(role, Shape):
        return f"{role.scale}, {role.lo:.3g} to {role.hi:.3g}"
    return "size" if isinstance(role, Size) else "read from the log"


def _table(
    variables: tuple[Variable, ...],
    bounds: bool = False,
    roles: Mapping[str, Size | Shape | Read] = MappingProxyType({}),
) -> str:
    heading = ["name", "unit", *(["default", "bounds"] if bounds else []), *(["role"] if roles else []), "meaning"]
    rows = []
    for v in variables:
        q = v.quantity
        limits = f"{'(' if q.open_lo else '['}{q.lo:g}, {q.hi:g}{')' if q.open_hi else ']'}".replace("inf", "∞")
        middle = [f"{v.start:g}", "any" if math.isinf(q.lo) and math.isinf(q.hi) else limits] if bounds else []
        middle += [_role(roles[v.name])] if roles else []
        cells = [f"`{v.name}`", f"`{q.unit}`", *middle, q.meaning]
        rows.append("| " + " | ".join(c.replace("|", "\\|").replace("*", "\\*") for c in cells) + " |")
    return "\n".join(["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading), *rows])


def _presets(kernel: Kernel) -> list[str]:
    found = []
    for name, preset in kernel.presets.items():
        printed = ", ".join(f"`{n}` = {value:g} {unit}" for n, (value, unit) in preset.printed.items())
        found.append(f"**{name}** -- {preset.source}." + (f" Printed: {printed}." if printed else ""))
    return ["## Presets", *found] if found else []


def _attachable(kernel: Kernel) -> list[str]:
    return [e.NAME for e in EFFECTS if _places(kernel.module, Kernel(e))]


def _places(model: Any, effect: Kernel) -> list[str]:
    base, found = Kernel(model), []
    channels = [v.name for v in (*base.inputs, *base.outputs)]
    for text in (effect.name, *(f"{effect.name}@{channel}" for channel in channels)):
        try:
            found.append(attach(base, text).channel)
        except InputError:
            continue
    return list(dict.fromkeys(found))


def _loop(kernel: Kernel) -> Figure:
    """Outputs over the first input; over time without an input."""
    rows = np.array(stimuli(kernel)) if kernel.inputs else np.empty((640, 0))
    time = np.arange(len(rows)) * STEP
    y = kernel.simulate(kernel.params(), time, rows, compiled=False)
    shown = [(v, y[:, j]) for j, v in enumerate(kernel.outputs)][:3]
    height = 2.6 * len(shown)
    figure = Figure(figsize=(7.2, height))  # margins by hand: a layout that is solved for draws everything twice
    figure.subplots_adjust(left=0.12, right=0.98, bottom=0.48 / height, top=1.0 - 0.1 / height, hspace=0.28)
    for axes, (v, values) in zip(np.atleast_1d(figure.subplots(len(shown), 1)), shown, strict=True):
        over = display(kernel.inputs[0].quantity.unit) if kernel.inputs else None
        x = rows[:, 0] * over.factor if over else time
        label = f"{kernel.inputs[0].name} [{over.unit}]" if over else "time [s]"
        unit = display(v.quantity.unit)
        axes.plot(x, values * unit.factor, color="#0b5cad", lw=1.2)
        axes.set(xlabel=label, ylabel=f"{v.name} [{unit.unit}]")
        axes.grid(alpha=0.3)
    return figure


def _change(kernel: Kernel) -> Figure | None:
    """A friction loop with and without the effect, at a size that shows."""
    time = np.arange(600) * 0.02
    x = np.sin(1.3 * time) * np.linspace(0.4, 1.0, time.size)
    v, a = np.gradient(x, time), np.gradient(np.gradient(x, time), time)
    s, z = np.sign(v), np.zeros(time.size)
    for k in range(1, time.size):
        way = x[k] - x[k - 1]
        z[k] = np.sign(way) + (z[k - 1] - np.sign(way)) * math.exp(-abs(way) / 0.05)
    load = 1.0 + 0.5 * np.sin(0.4 * time)
    signals = {"x": x, "v": v, "a": a, "s": s, "z": z, "y": z, "load": load, "drive": load * x, "bend": 1.0 + load}
    signals["temperature"] = 283.15 + 15.0 * load
    signals["x_pre"] = np.full(time.size, 0.05)
    inputs = np.column_stack([signals[i.name] for i in kernel.inputs])
    best: tuple[float, tuple[str, float]] | None = None
    for parameter in kernel.parameters:
        for size in np.geomspace(1e-3, 30.0, 24):
            for sign in (1.0, -1.0):
                try:
                    p = kernel.params(None, {parameter.name: parameter.start + sign * size})
                    y = kernel.simulate(p, time[::3], inputs[::3], compiled=False)[:, 0]  # enough for the size
                except InputError:
                    continue
                off = abs(float(np.std(y - z[::3])) / float(np.std(z)) - SHARE)
                if best is None or off < best[0] - 1e-9:
                    best = (off, (parameter.name, parameter.start + sign * size))
    if best is None:
        return None
    name, value = best[1]
    y = kernel.simulate(kernel.params(None, {name: value}), time, inputs, compiled=False)[:, 0]
    figure = Figure(figsize=(7.2, 3.2))
    figure.subplots_adjust(left=0.1, right=0.98, bottom=0.15, top=0.97, wspace=0.28)
    left, right = figure.subplots(1, 2)
    for axes, over, label in ((left, x, "x"), (right, time, "time")):
        axes.plot(over, z, color="#8a949c", lw=1.2, label="without")
        axes.plot(over, y, color="#d1495b", lw=1.2, label=f"{name} = {value:.3g}")
        axes.set(xlabel=label, ylabel="y")
        axes.grid(alpha=0.3)
    left.legend(loc="best", fontsize=8)
    return figure


def _write(path: Path, text: str) -> None:
    """Write only what changes, so that a second build is quick."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
