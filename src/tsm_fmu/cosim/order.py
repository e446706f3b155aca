"""Order of evaluation from the connection graph, and algebraic loops by the names of their ports."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from ..models.contract import InputError
from .system import Link, Wiring

Address = tuple[str, str]


@dataclass(frozen=True)
class Schedule:
    """Order in which a system is evaluated.

    Attributes
    ----------
    components : tuple of str
        Gauss-Seidel order: a component comes after those whose outputs it passes on directly.
    delayed : tuple of Link
        Links against that order: they carry the value of the previous communication point.
    """

    components: tuple[str, ...]
    delayed: tuple[Link, ...]


def schedule(wiring: Wiring) -> Schedule:
    """Order the components of a checked system.

    Raises
    ------
    InputError
        If direct feed-through closes an algebraic loop; the message names the ports on it.
    """
    _refuse_algebraic_loop(wiring)
    components = _component_order(wiring)
    place = {name: k for k, name in enumerate(components)}
    delayed = tuple(link for link in wiring.links if place[link.source[0]] >= place[link.target[0]])
    return Schedule(components, delayed)


def _refuse_algebraic_loop(wiring: Wiring) -> None:
    """Only stated dependencies count: an FMU that states none would make every feedback an algebraic loop."""
    before: dict[Address, list[Address]] = {link.target: [link.source] for link in wiring.links}
    for name, description in wiring.descriptions.items():
        for output, inputs in description.declared_feedthrough.items():
            before[name, output] = [(name, i) for i in sorted(inputs)]
    try:
        TopologicalSorter(before).prepare()
    except CycleError as found:
        cycle: list[Address] = found.args[1]
        ports = " -> ".join(".".join(a) for a in cycle)
        raise InputError(
            f"algebraic loop {ports} -- expected a state on every loop -- an inertia that closes it belongs into the "
            "motor's J_load; otherwise put an FMU with a state between, or an output without direct feed-through"
        ) from None


def _component_order(wiring: Wiring) -> tuple[str, ...]:
    """Topological order of the components by direct feed-through, declared order first.

    Two components can each pass an input of the other through although no algebraic loop exists (a motor
    passes its voltage to the acceleration, a controller the angle to the voltage). Then the link goes
    that does not reach the output which closes the circle.
    """
    names = [c.name for c in wiring.system.components]
    passed = {n: frozenset().union(*d.feedthrough.values()) for n, d in wiring.descriptions.items()}
    binding = [link for link in wiring.links if link.target[1] in passed[link.target[0]]]
    while True:
        before: dict[str, list[str]] = {n: [] for n in names}  # lists: a set of names has no fixed order
        for link in binding:
            before[link.target[0]].append(link.source[0])
        try:
            return tuple(TopologicalSorter(before).static_order())
        except CycleError as found:
            circle: list[str] = found.args[1]
            binding = _without(binding, list(pairwise(circle)), wiring)


def _without(binding: list[Link], pairs: list[tuple[str, str]], wiring: Wiring) -> list[Link]:
    """Drop from ``binding`` the links of that pair on the circle which nothing on the circle waits for."""

    def between(pair: tuple[str, str]) -> Iterable[Link]:
        return [link for link in binding if (link.source[0], link.target[0]) == pair]

    for pair, following in zip(pairs, [*pairs[1:], pairs[0]], strict=True):
        feedthrough = wiring.descriptions[pair[1]].feedthrough
        leaving = {link.source[1] for link in between(following)}
        if not any(link.target[1] in feedthrough[output] for link in between(pair) for output in leaving):
            return [link for link in binding if link not in between(pair)]
    return [link for link in binding if link not in between(pairs[-1])]
