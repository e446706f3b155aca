"""What `sweep` varies: numbers, a component's cards or FMUs, and the flavour of the FMUs that we build."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from ..card import ModelCard, read_card
from ..cosim.cases import with_values
from ..cosim.description import describe
from ..cosim.sweep import SEED, Axis, Change, numeric_axis, seeds
from ..fmu.build import build_fmu, check_flavour
from ..kernels.kernel import kernel
from ..models.contract import InputError
from .systems import Opened

FLAVOUR = "flavour"
"""The axis whose values are flavours; a component of this name goes before."""

Varied = Mapping[str, Sequence[float | str | os.PathLike[str]]]
"""Values by axis: numbers by ``component.variable``, cards or FMUs by ``component``, ``flavour``, ``seed``."""


@dataclass(frozen=True)
class Choices:
    """Axes, and what each combination of the values that are texts changes, in the order of the axes."""

    axes: tuple[Axis, ...]
    changes: Mapping[tuple[str, ...], Change]


def choices(system: Opened, vary: Varied, folder: Path) -> Choices:
    """Axes that every system accepts, cards read and FMUs built.

    Parameters
    ----------
    system : Opened
    vary : mapping
    folder : Path
        FMUs of cards with effects, and of flavours, are put into ``fmus`` there.

    Raises
    ------
    InputError
        An axis without values, a name that no system has, a value of another type, or a card or FMU that cannot be
        read or does not fit.
    """
    components = {c.name: c.fmu for s, _ in system.cases.values() for c in s.components}
    axes = []
    for name, values in vary.items():
        if not values:
            raise InputError(f"{name} is varied over nothing -- expected one value or more -- give some")
        if name in components or (name == FLAVOUR and FLAVOUR not in components):
            axes.append(Axis(name, "", tuple(os.fspath(v) if isinstance(v, os.PathLike) else str(v) for v in values)))
        elif name == SEED:
            axes.append(_seed_axis(system, _numbers(name, values)))
        else:
            axes.append(numeric_axis(system.cases, name, _numbers(name, values)))
    texts = [axis for axis in axes if not axis.unit]
    changes = {
        combination: _change(system, components, dict(zip([a.name for a in texts], combination, strict=True)), folder)
        for combination in product(*([str(v) for v in axis.values] for axis in texts))
    }
    return Choices(tuple(axes), changes)


def card_change(system: Opened, component: str, card: ModelCard, folder: Path, flavour: str = "python") -> Change:
    """A card in the place of a component's model: its values, and its FMU where the card has effects.

    Raises
    ------
    InputError
        The component has another model.
    """
    fmu = next((c.fmu for s, _ in system.cases.values() for c in s.components if c.name == component), None)
    if fmu is None:
        known = dict.fromkeys(c.name for s, _ in system.cases.values() for c in s.components)
        raise InputError(f"component {component!r} -- expected one of {', '.join(known)} -- correct the name")
    there, model = describe(fmu), card.kernel()
    if there.model.modelName != model.name:
        raise InputError(
            f"card of {model.name} for component {component}, which is {there.model.modelName} -- expected the same "
            f"model -- fit {there.model.modelName}, or name another component"
        )
    values = {f"{component}.{name}": repr(value) for name, value in model.named(card.params()).items()}
    parameters = {name for name, port in there.ports.items() if port.causality == "parameter"}
    if parameters == {v.name for v in model.parameters}:
        return Change({}, values)
    path = folder / "fmus" / flavour / f"{'+'.join((model.name, *card.effects))}.fmu"
    return Change({component: build_fmu(model, path, flavour=flavour)}, values)


def _seed_axis(system: Opened, values: Sequence[float]) -> Axis:
    known = seeds(system.cases)
    if not known:
        raise InputError(
            "--vary seed, which no component has -- expected one with a variable seed -- vary another variable"
        )
    for name in known:
        numeric_axis(system.cases, name, values)
    return Axis(SEED, "1", tuple(values))


def _numbers(name: str, values: Sequence[object]) -> list[float]:
    try:
        return [float(value) for value in values]  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(
            f"{name} over {', '.join(map(str, values))} -- expected numbers, or a component alone for cards and FMUs "
            f"-- for example load.k=0.1,0.2 or {name.partition('.')[0]}=a.toml,b.toml"
        ) from None


def _change(system: Opened, components: Mapping[str, Path], at: Mapping[str, str], folder: Path) -> Change:
    fmus: dict[str, Path] = {}
    values: dict[str, str] = {}
    flavour = at.get(FLAVOUR, "") if FLAVOUR not in components else ""
    if flavour:
        fmus |= _of_flavour(system, components, flavour, folder)
    for component, text in at.items():
        if component not in components:
            continue
        path = Path(text)
        if text.endswith(".toml"):
            change = card_change(system, component, read_card(path), folder, flavour or "python")
            fmus, values = {**fmus, **change.fmus}, {**values, **change.values}
        elif text.endswith(".fmu"):
            describe(path)  # a file that is none is found before the simulations
            fmus[component] = path.resolve()
        else:
            raise InputError(
                f"{component}={text} -- expected a card (.toml) or an FMU (.fmu) -- or a variable: {component}.NAME=..."
            )
    with_values(system.cases, values)
    return Change(fmus, values)


def _of_flavour(system: Opened, components: Mapping[str, Path], flavour: str, folder: Path) -> dict[str, Path]:
    check_flavour(flavour)
    if system.scenario is None:
        first = next(iter(components))
        raise InputError(
            f"flavour={flavour} of {system.name}.ssp -- expected a scenario, whose FMUs are built here -- name FMUs: "
            f"{first}=a.fmu,b.fmu"
        )
    built = {fmu: build_fmu(kernel(fmu.stem), folder / "fmus" / flavour, flavour=flavour)
             for fmu in sorted(set(components.values()))}  # fmt: skip
    return {component: built[fmu] for component, fmu in components.items()}
