"""What `run` and `sweep` share: the options of a co-simulation, and the systems of a scenario or an SSP."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..models.contract import InputError

if TYPE_CHECKING:  # FMPy takes a while to import: only the verbs that simulate pay
    from ..cosim.ssp import Case as SystemCase

System = Annotated[str, typer.Argument(metavar="SCENARIO|FILE.ssp", help="Scenario by name, or a system.")]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for all results.")]
Values = Annotated[
    list[str], typer.Option("--set", metavar="COMPONENT.VARIABLE=VALUE", help="Start value; repeatable.")
]
Case = Annotated[list[str], typer.Option("--case", help="Run this case only; repeatable.")]
StopTime = Annotated[float | None, typer.Option("--stop", metavar="S", help="Stop time [s].")]
Step = Annotated[float | None, typer.Option("--step", metavar="S", help="Communication step [s].")]
Jacobi = Annotated[bool, typer.Option("--jacobi", help="Exchange all values at once (default Gauss-Seidel).")]


@dataclass(frozen=True)
class Opened:
    """Systems ready to run: the scenario they are from (None for an SSP), and what of them is recorded (None: all)."""

    name: str
    cases: Mapping[str, SystemCase]
    record: Sequence[str] | None
    scenario: ModuleType | None

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
) -> Iterator[Opened]:
    """The systems with their start values and timing; those of an SSP exist as long as the context.

    Raises
    ------
    InputError
        No such scenario, file, case or start value, or a folder that is a file.
    """
    from ..cosim.cases import chosen, with_values
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
            cases, record = scenario.cases(_built(scenario.FMUS, out / "fmus")), scenario.RECORD
        elif what.endswith(".ssp"):
            cases, record = stack.enter_context(open_ssp(Path(what))), None
        else:
            raise InputError(
                f"{what!r} -- expected one of {', '.join(SCENARIOS)} or a file that ends in .ssp -- correct the name"
            )
        cases = with_values(chosen(cases, case), values)
        cases = {name: (system, replace(experiment, **timing)) for name, (system, experiment) in cases.items()}
        yield Opened(what if scenario is not None else Path(what).name.removesuffix(".ssp"), cases, record, scenario)


def _built(models: tuple[str, ...], folder: Path) -> dict[str, Path]:
    from ..fmu.build import build_fmu
    from ..kernels.kernel import kernel

    return {model: build_fmu(kernel(model), folder) for model in models}
