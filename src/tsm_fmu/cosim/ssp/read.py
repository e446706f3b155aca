"""Open an SSP: its systems with their experiments, ready to run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ...models.contract import InputError
from ..description import describe
from ..system import Experiment, System
from ..unpack import unpacked
from .files import Files
from .levels import read_structure
from .xml import ANNOTATION, MAIN, child, children, local, number, parse

Case = tuple[System, Experiment]


@contextmanager
def open_ssp(path: Path) -> Iterator[dict[str, Case]]:
    """Unpack an SSP and yield its systems by variant name; their FMUs exist as long as the context.

    A folder is read as the archive that it was, or will be.

    A further ``.ssd`` file that cannot be read is left out, and a note of the first system says so.

    Raises
    ------
    InputError
        No such file, damaged, or what is not supported (components that are not FMUs): each named.
    """
    if not path.exists():
        raise InputError(f"SSP {path} -- expected an existing .ssp file or a folder -- check the path")
    with ExitStack() as held:
        folder = path if path.is_dir() else held.enter_context(unpacked(path, "SSP"))
        if not (folder / MAIN).is_file():
            raise InputError(f"SSP {path} has no {MAIN} -- expected one in its root -- export it again")
        name, (system, experiment) = _case(path, folder, folder / MAIN, held)
        others: dict[str, Case] = {}
        for file in sorted(folder.glob("*.ssd")):
            if file.name != MAIN:
                try:
                    variant, case = _case(path, folder, file, held)
                    others[variant] = case
                except InputError as wrong:
                    system = replace(system, notes=(*system.notes, f"{file.name} is left out: {wrong}"))
        yield {name: (system, experiment), **others}


def _case(path: Path, folder: Path, file: Path, held: ExitStack) -> tuple[str, Case]:
    root = parse(path, file, "SystemStructureDescription")
    body = child(root, "System")
    if body is None:
        raise InputError(f"SSP {path} has no System element -- expected one of SSP 1.0 -- export it as SSP 1.0")
    files = Files(path, folder.resolve(), folder.resolve(), held)
    system = read_structure(files, root).flat(body.get("name") or root.get("name") or path.stem)
    experiment = _experiment(path, root, system)
    notes = (*system.notes, *_step_notes(path, root, experiment))
    return root.get("name") or file.stem, (replace(system, notes=notes), experiment)


def _experiment(path: Path, root: Any, system: System) -> Experiment:
    default = child(root, "DefaultExperiment")
    times = {} if default is None else default.attrib
    notes = [a for a in children(default, "Annotations", "Annotation") if a.get("type") == ANNOTATION]
    written: dict[str, str] = {}
    for note in notes:
        written |= dict(getattr(child(note, "experiment"), "attrib", {}))
    start = times.get("startTime", "0")
    stop = times.get("stopTime") or repr(number(path, start) + 1.0)
    values: dict[str, Any] = {"start": start, "stop": stop, **written}
    hints = _hints(path, root)
    proposed = _step_of_others(root) or times.get("stepSize") or (repr(min(hints.values())) if hints else "")
    values.setdefault("step", proposed or _suggested_step(system))
    numeric = {f.name for f in fields(Experiment) if str(f.type).startswith("float")}
    known: dict[str, Any] = {k: number(path, v) if k in numeric else v for k, v in values.items() if k in _EXPERIMENT}
    return Experiment(**known)


_EXPERIMENT = {f.name for f in fields(Experiment)}


_VARIABLE = "VariableStepMaster"
_STEPS = {"FixedStepMaster": "stepSize", _VARIABLE: "maximumStepSize", "FixedStepAlgorithm": "baseStepSize"}
"""Elements of other tools' annotations that hold a communication step: two of OMSimulator, of libcosim and Vico."""


def _hints(path: Path, root: Any) -> dict[str, float]:
    """Steps that libcosim or Vico would give to single components, by the component's name."""
    found: dict[str, float] = {}
    for component in root.iter():
        if local(component) == "Component":
            for annotation in children(component, "Annotations", "Annotation"):
                for node in children(annotation, "StepSizeHint"):
                    if (step := number(path, node.get("value", "0"))) > 0.0:
                        found[component.get("name") or ""] = step
    return found


def _step_notes(path: Path, root: Any, experiment: Experiment) -> list[str]:
    """What of other tools' steps is not as they have it."""
    notes = [
        f"component {name} asks for steps of {hint:g} s: it is stepped with all others, every {experiment.step:g} s"
        for name, hint in _hints(path, root).items()
        if hint > experiment.step * (1.0 + 1e-9)
    ]
    if any(local(node) == _VARIABLE for node in root.iter()):
        notes.append(
            "another tool varies the step: here it is fixed, at most its longest, unless --step-error divides it"
        )
    return notes


def _step_of_others(root: Any) -> str:
    """The step that the outermost system or the experiment has for another tool; empty if none."""
    for owner in (child(root, "System"), child(root, "DefaultExperiment")):
        for annotation in children(owner, "Annotations", "Annotation"):
            for node in annotation.iter():
                if local(node) in _STEPS and (step := node.get(_STEPS[local(node)])):
                    return step
    return ""


def _suggested_step(system: System) -> str:
    """Smallest step that an FMU of the system proposes; 1 ms if none does."""
    proposed = [describe(c.fmu).model.defaultExperiment for c in system.components]
    steps = [float(e.stepSize) for e in proposed if e is not None and e.stepSize]
    return repr(min(steps, default=1e-3))
