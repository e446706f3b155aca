"""What `run` and `sweep` take: a scenario by name or an SSP, as systems that are ready to run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from ..cosim.cases import selected, with_values
from ..cosim.isolation import Simulations, simulation
from ..cosim.master import number_of_steps
from ..cosim.order import LOOPS
from ..cosim.ssp import Case, open_ssp
from ..cosim.trajectory import Trajectory
from ..fmu.build import build_fmu
from ..kernels.kernel import kernel
from ..models.contract import InputError
from ..scenarios import SCENARIOS
from . import TIME_LIMIT


@dataclass(frozen=True)
class Settings:
    """How a system is to run: what `run`, `sweep`, `step_study` and `linearize` have in common.

    Attributes
    ----------
    values : mapping of str to value
        Start values by ``component.variable``.
    case : sequence of str
        Cases to run; all if empty.
    stop, step : float or None
        Stop time and communication step [s]; those of the system if None.
    jacobi : bool
        Exchange all values at once, not in order of the signals (Gauss-Seidel).
    loops : str or None
        What becomes of algebraic loops, one of `tsm_fmu.cosim.order.LOOPS`; as the system says if None.
    isolate : bool or None
        Give every FMU a process of its own, or none; if None, those that are not ours.
    time_limit : float
        Longest time of one call of an FMU there [s].
    step_error : float or None
        Largest relative error of a step, where the step is chosen by it; None: it is fixed.
    """

    values: Mapping[str, object]
    case: Sequence[str] = ()
    stop: float | None = None
    step: float | None = None
    jacobi: bool = False
    loops: str | None = None
    isolate: bool | None = None
    time_limit: float = TIME_LIMIT
    step_error: float | None = None

    def __post_init__(self) -> None:
        if self.loops is not None and self.loops not in LOOPS:
            raise InputError(f"--loops {self.loops!r} -- expected one of {', '.join(LOOPS)} -- choose one")

    @property
    def timing(self) -> dict[str, Any]:
        """What of an experiment is changed, by the name of its field."""
        changed = {"stop": self.stop, "step": self.step, "loops": self.loops, "step_error": self.step_error}
        found: dict[str, Any] = {name: value for name, value in changed.items() if value is not None}
        return found | {"method": "jacobi"} if self.jacobi else found


@dataclass(frozen=True)
class Opened:
    """Systems ready to run: the scenario they are from (None for an SSP), and what of them is recorded (None: all).

    ``there`` simulates, with FMUs here or in processes of their own.
    """

    name: str
    cases: Mapping[str, Case]
    record: Sequence[str] | None
    scenario: ModuleType | None
    there: Simulations

    @property
    def simulate(self) -> Callable[..., Trajectory]:
        """`simulate_system`, there."""
        return self.there.simulate_system

    @property
    def quantities(self) -> Any:
        """The numbers that a scenario computes itself; None without any."""
        return getattr(self.scenario, "quantities", None)


@contextmanager
def opened(what: str | os.PathLike[str], out: Path | None, settings: Settings) -> Iterator[Opened]:
    """The systems with their start values and timing; without ``out`` their FMUs exist as long as the context.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, a file that ends in ``.ssp``, or a folder that holds what such a file does.
    out : Path or None
        Folder for the FMUs of a scenario.
    settings : Settings

    Raises
    ------
    InputError
        No such scenario, file, case or start value, times that do not fit, or a folder that is a file: found before
        FMUs are built.
    """
    what = os.fspath(what)
    scenario = SCENARIOS.get(what)
    with ExitStack() as stack:
        if scenario is not None:
            folder = (out or Path(stack.enter_context(TemporaryDirectory(prefix="tsm-fmu-")))).resolve()
            paths = {model: folder / "fmus" / f"{model}.fmu" for model in scenario.FMUS}
            cases, record = scenario.cases(paths), scenario.RECORD
        elif what.endswith(".ssp") or Path(what).is_dir():
            cases, record = stack.enter_context(open_ssp(Path(what))), None
        else:
            raise InputError(
                f"{what!r} -- expected one of {', '.join(SCENARIOS)}, a file that ends in .ssp, or its folder "
                "-- correct the name"
            )
        cases = with_values(
            selected(cases, settings.case), {name: str(value) for name, value in settings.values.items()}
        )
        cases = {name: (system, replace(experiment, **settings.timing)) for name, (system, experiment) in cases.items()}
        for _, experiment in cases.values():
            number_of_steps(experiment.start, experiment.stop, experiment.step)
        fmus = {c.fmu for system, _ in cases.values() for c in system.components}
        if scenario is not None:
            _build(fmus)
        there = stack.enter_context(simulation(settings.isolate, settings.time_limit))
        name = what if scenario is not None else Path(what).resolve().name.removesuffix(".ssp")
        yield Opened(name, cases, record, scenario, there)


def _build(fmus: Iterable[Path]) -> None:
    for fmu in sorted(fmus):
        build_fmu(kernel(fmu.stem), fmu.parent)
