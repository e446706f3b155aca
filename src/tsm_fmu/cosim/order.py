"""Order of evaluation from the connection graph, and algebraic loops by the names of their ports."""

from __future__ import annotations

from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from ..models.contract import InputError
from .system import Link, Wiring

Address = tuple[str, str]


LOOPS = ("refuse", "delay", "iterate")
"""What becomes of algebraic loops: an error, one step of delay, or iteration in each step."""


@dataclass(frozen=True)
class AlgebraicLoop:
    """Ports that follow each other at once, in a circle.

    Attributes
    ----------
    ports : tuple of (component, variable)
        One circle through them, in the direction of the signal, its first port again at the end.
    components : tuple of str
        All that have a part in it, in the order of evaluation.
    late : tuple of Link
        Its links against that order.
    """

    ports: tuple[Address, ...]
    components: tuple[str, ...]
    late: tuple[Link, ...]

    def __str__(self) -> str:
        return "algebraic loop " + " -> ".join(".".join(port) for port in self.ports)


@dataclass(frozen=True)
class Schedule:
    """Order in which a system is evaluated.

    Attributes
    ----------
    components : tuple of str
        Gauss-Seidel order: a component comes after those whose outputs it passes on directly.
    delayed : tuple of Link
        Links against that order: they carry the value of the previous communication point.
    loops : tuple of AlgebraicLoop
        Empty where they are refused.
    """

    components: tuple[str, ...]
    delayed: tuple[Link, ...]
    loops: tuple[AlgebraicLoop, ...] = ()


def schedule(wiring: Wiring, loops: str = "refuse") -> Schedule:
    """Order the components of a checked system.

    Parameters
    ----------
    wiring : Wiring
        From `check_system`.
    loops : {"refuse", "delay", "iterate"}
        With ``iterate`` the components of an algebraic loop follow one another.

    Raises
    ------
    InputError
        If direct feed-through closes an algebraic loop and these are refused; the message names the ports on it.
    """
    if loops not in LOOPS:
        raise InputError(f"loops {loops!r} -- expected one of {', '.join(LOOPS)} -- choose one")
    components = _component_order(wiring)
    found = _algebraic_loops(wiring, components)
    if found and loops == "refuse":
        raise InputError(
            f"{found[0]} -- expected a state on every loop -- an inertia that closes it belongs into the motor's "
            "J_load; otherwise put an FMU with a state between, or choose --loops delay (one step late) or iterate"
        )
    if loops == "iterate":
        for loop in found:
            first = min(components.index(name) for name in loop.components)
            others = [name for name in components if name not in loop.components]
            components = (*others[:first], *loop.components, *others[first:])
    place = {name: k for k, name in enumerate(components)}
    delayed = tuple(link for link in wiring.links if place[link.source[0]] >= place[link.target[0]])
    return Schedule(components, delayed, found)


def _algebraic_loops(wiring: Wiring, components: tuple[str, ...]) -> tuple[AlgebraicLoop, ...]:
    """Loops that share no port; those that share a component are one.

    Only stated dependencies count: an FMU that states none would make every feedback an algebraic loop.
    """
    before: dict[Address, list[Address]] = {link.target: [link.source] for link in wiring.links}
    for name, description in wiring.descriptions.items():
        for output, inputs in description.declared_feedthrough.items():
            before[name, output] = [(name, i) for i in sorted(inputs)]
    place = {name: k for k, name in enumerate(components)}
    circles: list[list[Address]] = []
    members: list[set[str]] = []
    for strong in _strong_components(before):
        inside = {port: [p for p in before.get(port, ()) if p in strong] for port in before if port in strong}
        names = {name for name, _ in strong}
        shared = next((k for k, other in enumerate(members) if other & names), None)
        if shared is None:
            circles.append(_circle(inside, {link.source for link in wiring.links}, place))
            members.append(names)
        else:
            members[shared] |= names
    loops = []
    for circle, names in zip(circles, members, strict=True):
        order = sorted(names, key=components.index)
        own = [link for link in wiring.links if link.source[0] in names and link.target[0] in names]
        late = tuple(link for link in own if place[link.source[0]] >= place[link.target[0]])
        loops.append(AlgebraicLoop(tuple(circle), tuple(order), late))
    return tuple(loops)


def _strong_components(before: dict[Address, list[Address]]) -> list[set[Address]]:
    """Sets of ports that all follow each other, of more than one port."""
    try:
        TopologicalSorter(before).prepare()
        return []
    except CycleError:
        from scipy.sparse import csr_array  # half a second, which systems without loops need not pay
        from scipy.sparse.csgraph import connected_components
    ports = list(dict.fromkeys([*before, *(p for sources in before.values() for p in sources)]))
    index = {port: k for k, port in enumerate(ports)}
    pairs = [(index[p], index[port]) for port, sources in before.items() for p in sources]
    rows, columns = zip(*pairs, strict=True)
    graph = csr_array(([1] * len(pairs), (rows, columns)), shape=(len(ports), len(ports)))
    _, labels = connected_components(graph, connection="strong")
    found: dict[int, set[Address]] = {}
    for port, label in zip(ports, labels.tolist(), strict=True):
        found.setdefault(label, set()).add(port)
    return [strong for strong in found.values() if len(strong) > 1]


def _circle(before: dict[Address, list[Address]], outputs: set[Address], place: dict[str, int]) -> list[Address]:
    """One circle through ports of which each is on one; it begins with the output that is evaluated first."""
    try:
        TopologicalSorter(before).prepare()
    except CycleError as found:
        circle: list[Address] = found.args[1][:-1]
        k = circle.index(min((p for p in circle if p in outputs), key=lambda port: place[port[0]]))
        return [*circle[k:], *circle[: k + 1]]
    return []


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
    between: dict[tuple[str, str], list[Link]] = {pair: [] for pair in pairs}
    for link in binding:
        between.get((link.source[0], link.target[0]), []).append(link)
    for pair, following in zip(pairs, [*pairs[1:], pairs[0]], strict=True):
        feedthrough = wiring.descriptions[pair[1]].feedthrough
        leaving = {link.source[1] for link in between[following]}
        if not any(link.target[1] in feedthrough[output] for link in between[pair] for output in leaving):
            break
    else:
        pair = pairs[-1]
    return [link for link in binding if (link.source[0], link.target[0]) != pair]
