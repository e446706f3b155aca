"""Energy through the power bonds of a run: what one side gives and what the other takes are not the same.

A power bond is a motion from one component to another and the force or torque that comes back. In a step each side
works with what it was handed, held or late, against what it computes itself; the difference of the two works is energy
that the coupling takes from the system, or makes: the residual energy of Sadjina et al., Energy conservation and power
bonds in co-simulations, Engineering with Computers 33 (2017) 607.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..logs.units import same_quantity, unit_to_si
from .fmu_process import is_foreign
from .metric import BondEnergy, CaseMetrics
from .order import schedule
from .ssp import Case
from .system import Link, Wiring, check_system
from .trajectory import Trajectory

Array = NDArray[np.float64]

_PAIRS = (("rad", "N.m"), ("m", "N"), ("rad/s", "N.m"), ("m/s", "N"))
"""Unit of a motion and of what works on it, what is preferred first: a distance is exact, a speed integrated."""


@dataclass(frozen=True)
class Bond:
    """A motion from one component to another, and the force or torque that comes back.

    Attributes
    ----------
    motion, effort : Link
        There and back.
    speed : bool
        Whether the motion is a speed.
    scales : tuple of float
        What makes joules of the product of both at the component that moves, and at the other.
    """

    motion: Link
    effort: Link
    speed: bool
    scales: tuple[float, float]

    @property
    def name(self) -> str:
        """``motor.theta ~ load.tau``."""
        return f"{'.'.join(self.motion.source)} ~ {'.'.join(self.effort.source)}"

    @property
    def signals(self) -> tuple[str, str]:
        """What has to be recorded."""
        return ".".join(self.motion.source), ".".join(self.effort.source)


def bonds(wiring: Wiring) -> list[Bond]:
    """The power bonds of a system; where several motions or efforts of a kind join two components none is named.

    What goes through a Sum of ours counts as a link of its own, with the gain of that summand. Where the factors there
    and back are not the same power (a law of another unit than its ports say), there is no bond either: what the
    sides give and take would differ however short the step.
    """
    found = []
    paths = [*wiring.links, *_summed(wiring)]
    for one in wiring.descriptions:
        for other in wiring.descriptions:
            there = [link for link in paths if (link.source[0], link.target[0]) == (one, other)]
            back = [link for link in paths if (link.source[0], link.target[0]) == (other, one)]
            for motion_unit, effort_unit in _PAIRS:
                motions = [link for link in there if _is(_unit(wiring, link.source), motion_unit)]
                efforts = [link for link in back if _is(_unit(wiring, link.target), effort_unit)]
                if one != other and len(motions) == 1 == len(efforts):
                    bond = _bond(wiring, motions[0], efforts[0], motion_unit.endswith("/s"))
                    if math.isclose(bond.scales[0] * efforts[0].gain, bond.scales[1] * motions[0].gain, rel_tol=1e-6):
                        found.append(bond)
                    break
    return found


def _bond(wiring: Wiring, motion: Link, effort: Link, speed: bool) -> Bond:
    def scale(*ports: tuple[str, str]) -> float:
        units = [_unit(wiring, port) for port in ports]
        return float(np.prod([unit_to_si(unit).factor if unit else 1.0 for unit in units]))

    return Bond(motion, effort, speed, (scale(motion.source, effort.target), scale(motion.target, effort.source)))


@dataclass(frozen=True)
class _Summed(Link):
    """A path through a Sum: to one of its inputs, and from its output on."""

    parts: tuple[Link, Link] = field(kw_only=True)


def _summed(wiring: Wiring) -> list[_Summed]:
    found = []
    for component in wiring.system.components:
        description = wiring.descriptions[component.name]
        if is_foreign(description) or description.model.modelName != "Sum":
            continue
        for before in wiring.links:
            for after in wiring.links:
                if before.target[0] == after.source[0] == component.name:
                    name = f"k{before.target[1].removeprefix('u')}"
                    factor = float(component.parameters.get(name, description.ports[name].start or 0.0)) * after.gain
                    gain, offset = factor * before.gain, factor * before.offset
                    found.append(_Summed(before.source, after.target, "Real", gain, offset, parts=(before, after)))
    return found


def _unit(wiring: Wiring, port: tuple[str, str]) -> str:
    return wiring.descriptions[port[0]].ports[port[1]].unit


def _is(unit: str, wanted: str) -> bool:
    return bool(unit) and same_quantity(unit, wanted)


def recorded_too(cases: Iterable[Case], record: Sequence[str] | None) -> list[str] | None:
    """What to record so that the bonds of systems can be balanced; None is all."""
    if record is None:
        return None
    found = [s for system, _ in cases for bond in bonds(check_system(system)) for s in bond.signals]
    return list(dict.fromkeys([*record, *found]))


BOND_HEADING = ("case", "power bond", "given [J]", "taken [J]", "lost in the coupling [J]", "of the moved energy [%]")


def bond_rows(metrics: Mapping[str, CaseMetrics]) -> list[tuple[str, str, float, float, float, float]]:
    """Rows below `BOND_HEADING`."""
    return [
        (case, name, bond.given, bond.taken, bond.lost, 100.0 * bond.share)
        for case, own in metrics.items()
        for name, bond in own.bonds.items()
    ]


def balance(case: Case, run: Trajectory) -> dict[str, BondEnergy]:
    """Energy through each bond of a run that recorded its signals at every communication point.

    None where the step was chosen by its error: the rows are not all the points at which values were handed on.
    """
    system, experiment = case
    if experiment.step_error is not None:
        return {}
    wiring = check_system(system)
    plan = schedule(wiring, experiment.loops)
    late = set() if experiment.loops != "iterate" else {link for loop in plan.loops for link in loop.late}
    held: set[Link] = set(wiring.links) if experiment.method == "jacobi" else set(plan.delayed) - late
    found = {}
    for bond in bonds(wiring):
        motion, effort = (np.asarray(run.columns[name], float) for name in bond.signals)
        found[bond.name] = energy(bond, run.time, motion, effort, (_late(bond.motion, held), _late(bond.effort, held)))
    return found


def _late(path: Link, held: set[Link]) -> int:
    """Steps by which a value arrives late."""
    return sum(link in held for link in (path.parts if isinstance(path, _Summed) else (path,)))


def _shifted(values: Array, late: int) -> Array:
    """Values of the ends of the steps as they arrive, the first for those from before the start."""
    rows = np.maximum(np.arange(1, values.size) - late, 0)
    return values[rows]


def energy(bond: Bond, time: Array, motion: Array, effort: Array, late: tuple[int, int]) -> BondEnergy:
    """Works of both sides of a bond.

    Parameters
    ----------
    bond : Bond
        What the signals are.
    time, motion, effort : ndarray, shape (n,)
        At the communication points, as their sources give them.
    late : tuple of int
        Steps by which the motion, and the effort, arrives late: 0 is that of the end of the step.
    """
    step = np.diff(time)
    arrived = bond.effort.gain * _shifted(effort, late[1]) + bond.effort.offset
    if bond.speed:
        path = 0.5 * (motion[:-1] + motion[1:]) * step
        taken = (bond.motion.gain * _shifted(motion, late[0]) + bond.motion.offset) * step
    else:
        path = np.diff(motion)
        taken = bond.motion.gain * np.concatenate((np.zeros(late[0]), path))[: path.size]
    given = bond.scales[0] * arrived * path
    received = bond.scales[1] * 0.5 * (effort[:-1] + effort[1:]) * taken
    total, back = float(np.sum(given)), float(np.sum(received))
    return BondEnergy(total, back, total - back, float(np.sum(np.abs(given))))
