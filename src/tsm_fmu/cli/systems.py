"""What `run` and `sweep` share: the options of a co-simulation, and the systems of a scenario or an SSP."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..models.contract import InputError

if TYPE_CHECKING:  # FMPy takes a while to import: only the verbs that simulate pay
    from ..cosim.ssp import Case as SystemCase
    from ..cosim.trajectory import Trajectory

System = Annotated[str, typer.Argument(metavar="SCENARIO|FILE.ssp", help="Scenario by name, or a system.")]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for all results.")]
Values = Annotated[
    list[str], typer.Option("--set", metavar="COMPONENT.VARIABLE=VALUE", help="Start value; repeatable.")
]
Case = Annotated[list[str], typer.Option("--case", help="Run this case only; repeatable.")]
StopTime = Annotated[float | None, typer.Option("--stop", metavar="S", help="Stop time [s].")]
Step = Annotated[float | None, typer.Option("--step", metavar="S", help="Communication step [s].")]
Isolate = Annotated[
    bool | None,
    typer.Option(
        "--isolate/--no-isolate",
        help="Simulate in a process of its own, which an FMU may crash or hang. Default: if an FMU is not ours.",
    ),
]
TimeLimit = Annotated[
    float, typer.Option("--time-limit", metavar="S", help="Longest time of one call of an FMU there [s].")
]
TIME_LIMIT = 300.0
Jacobi = Annotated[bool, typer.Option("--jacobi", help="Exchange all values at once (default Gauss-Seidel).")]


@dataclass(frozen=True)
class Opened:
    """Systems ready to run: the scenario they are from (None for an SSP), and what of them is recorded (None: all).

    ``simulate`` is `simulate_system`, here or in a process of its own.
    """

    name: str
    cases: Mapping[str, SystemCase]
    record: Sequence[str] | None
    scenario: ModuleType | None
    simulate: Callable[..., Trajectory]

    @property
    def quantities(self) -> Any:
        """The numbers that a scenario computes itself; None without any."""
        return getattr(self.scenario, "quantities", None)


@contextmanager
def opened(
    what: str,
    out: Path,
    values: Mapping[str, str],
    case: Sequence[str],
    stop: float | None,
    step: float | None,
    jacobi: bool,
    isolate: bool | None,
    time_limit: float,
) -> Iterator[Opened]:
    """The systems with their start values and timing; those of an SSP exist as long as the context.

    Raises
    ------
    InputError
        No such scenario, file, case or start value, times that do not fit, or a folder that is a file: found before
        FMUs are built.
    """
    from ..cosim.cases import chosen, with_values
    from ..cosim.isolation import simulation
    from ..cosim.master import number_of_steps
    from ..cosim.ssp import open_ssp
    from ..scenarios import SCENARIOS

    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file -- expected a folder -- choose another")
    scenario = SCENARIOS.get(what)
    timing: dict[str, Any] = {k: v for k, v in (("stop", stop), ("step", step)) if v is not None}
    if jacobi:
        timing["method"] = "jacobi"
    with ExitStack() as stack:
        if scenario is not None:
            paths = {model: out / "fmus" / f"{model}.fmu" for model in scenario.FMUS}
            cases, record = scenario.cases(paths), scenario.RECORD
        elif what.endswith(".ssp"):
            cases, record = stack.enter_context(open_ssp(Path(what))), None
        else:
            raise InputError(
                f"{what!r} -- expected one of {', '.join(SCENARIOS)} or a file that ends in .ssp -- correct the name"
            )
        cases = with_values(chosen(cases, case), values)
        cases = {name: (system, replace(experiment, **timing)) for name, (system, experiment) in cases.items()}
        for _, experiment in cases.values():
            number_of_steps(experiment.start, experiment.stop, experiment.step)
        fmus = {c.fmu for system, _ in cases.values() for c in system.components}
        if scenario is not None:
            _build(fmus)
        there = stack.enter_context(simulation(fmus, isolate, time_limit))
        name = what if scenario is not None else Path(what).name.removesuffix(".ssp")
        yield Opened(name, cases, record, scenario, there.simulate_system)


def _build(fmus: Iterable[Path]) -> None:
    from ..fmu.build import build_fmu
    from ..kernels.kernel import kernel

    for fmu in sorted(fmus):
        build_fmu(kernel(fmu.stem), fmu.parent)
