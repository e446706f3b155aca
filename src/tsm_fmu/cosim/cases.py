"""Several systems run one after the other: common results, statistics of every signal, the archive to run again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..models.contract import InputError
from .description import describe
from .master import simulate_system
from .metric import CaseMetrics, Metric, spread
from .ssp import Case
from .system import System
from .trajectory import SimulationInterrupted, SimulationStopped, Trajectory


def with_values(cases: Mapping[str, Case], values: Mapping[str, str]) -> dict[str, Case]:
    """Set ``component.variable`` in every case that has the component.

    Raises
    ------
    InputError
        If no case has it.
    """
    for address in values:
        component = address.partition(".")[0]
        if not any(c.name == component for system, _ in cases.values() for c in system.components):
            names = {c.name: None for system, _ in cases.values() for c in system.components}
            raise InputError(
                f"{address!r} -- expected component.variable with one of {', '.join(names)} -- correct the name"
            )
    return {
        name: (
            system.with_values(
                {k: v for k, v in values.items() if k.partition(".")[0] in {c.name for c in system.components}}
            ),
            experiment,
        )
        for name, (system, experiment) in cases.items()
    }


def selected(cases: Mapping[str, Case], names: Sequence[str]) -> dict[str, Case]:
    """Return the named cases in their own order; all without names.

    Raises
    ------
    InputError
        Unknown name.
    """
    for name in names:
        if name not in cases:
            raise InputError(f"case {name!r} -- expected one of {', '.join(cases)} -- correct the name")
    return {name: case for name, case in cases.items() if not names or name in names}


def present(system: System, record: Sequence[str] | None) -> list[str] | None:
    """What of ``record`` the system has; None stays None."""
    names = {c.name for c in system.components}
    return None if record is None else [a for a in record if a.partition(".")[0] in names]


def run_cases(
    cases: Mapping[str, Case],
    *,
    record: Sequence[str] | None = None,
    progress: bool = False,
    simulate: Callable[..., Trajectory] = simulate_system,
) -> dict[str, Trajectory]:
    """Simulate every case; ``record`` as in `simulate_system`, as far as a case has the component.

    ``simulate`` is `simulate_system`, here or in another process (`isolation`).

    Raises
    ------
    InputError
        Cases that share a table but differ in start or step, or a tracking error that is no angle.
    SimulationStopped, SimulationInterrupted
        With `trajectory` in the form of `joined`: all cases until then, cut to the rows of the last; without the
        last where it has not begun.
    """
    _check_cases(cases)
    done: dict[str, Trajectory] = {}
    for name, (system, experiment) in cases.items():
        try:
            done[name] = simulate(
                replace(system, name=name),
                experiment.stop,
                experiment.step,
                start=experiment.start,
                method=experiment.method,
                loops=experiment.loops,
                record=present(system, record),
                progress=progress,
                **({} if experiment.step_error is None else {"step_error": experiment.step_error}),
            )
        except SimulationStopped as stopped:
            reason = str(stopped) if len(cases) == 1 else f"case {name}: {stopped}"
            raise SimulationStopped(reason, _until_then(done, name, stopped.trajectory)) from stopped
        except SimulationInterrupted as interrupted:
            raise SimulationInterrupted(_until_then(done, name, interrupted.trajectory)) from interrupted
    return done


def _check_cases(cases: Mapping[str, Case]) -> None:
    """What would otherwise be found only after the simulations."""
    timing = {name: f"{e.start:g} s with step {e.step:g} s" for name, (_, e) in cases.items()}
    first = next(iter(timing), "")
    for name, (system, experiment) in cases.items():
        if timing[name] != timing[first]:
            raise InputError(
                f"case {name} starts at {timing[name]}, case {first} at {timing[first]} -- expected the same in one "
                f"table -- set --step, or run it alone with --case {name}"
            )
        component, _, variable = experiment.tracking_error.partition(".")
        fmu = next((c.fmu for c in system.components if c.name == component), None)
        port = describe(fmu).ports.get(variable) if fmu is not None else None
        if port is not None and port.unit not in ("", "1", "rad"):
            raise InputError(
                f"tracking error {experiment.tracking_error} of case {name} is in {port.unit} -- expected rad "
                "-- name another signal, or none"
            )


def _until_then(done: Mapping[str, Trajectory], name: str, last: Trajectory) -> Trajectory:
    if done and last.time.size < 2:
        return replace(joined(done), incomplete=last.incomplete)
    return joined({**done, name: last})


def joined(runs: Mapping[str, Trajectory], decimation: int = 1) -> Trajectory:
    """Put the runs into one table, columns ``case.component.variable`` (without the case if there is one only).

    Rows are every n-th, as many as all runs have; their times must be the same.
    """
    last = list(runs.values())[-1]
    rows = min(run.time.size for run in runs.values())
    for name, run in runs.items():
        if not np.array_equal(run.time[:rows], last.time[:rows]):
            raise InputError(f"case {name} has other times than the rest -- expected the same step -- run it alone")
    columns, units = {}, {}
    for name, run in runs.items():
        for address, values in run.columns.items():
            column = address if len(runs) == 1 else f"{name}.{address}"
            columns[column], units[column] = values[:rows:decimation], run.units[address]
    return Trajectory(last.time[:rows:decimation], columns, units, last.incomplete)


Quantities = Callable[[str, Trajectory], Mapping[str, Metric]]
"""What a scenario computes from a case, by name."""


def statistics(
    cases: Mapping[str, Case], runs: Mapping[str, Trajectory], quantities: Quantities | None = None
) -> dict[str, CaseMetrics]:
    """Mean, standard deviation and peak-to-peak value of every signal, by case, with what a scenario computes itself.

    The window is `Experiment.evaluate_from` to the end.
    """
    found = {}
    for name, run in runs.items():
        experiment = cases[name][1]
        window = experiment.window(run.time)
        error = run.columns.get(experiment.tracking_error)
        found[name] = CaseMetrics(
            begin=Metric(float(run.time[window][0]), "s"),
            end=Metric(float(run.time[-1]), "s"),
            signals={address: spread(values[window], run.units[address]) for address, values in run.columns.items()},
            tracking_error=None if error is None else spread(np.degrees(error[window]), "deg"),
            quantities={} if quantities is None else quantities(name, run),
        )
    return found


def flat(metrics: Mapping[str, CaseMetrics]) -> dict[str, Metric]:
    """The numbers of all cases by ``case.name``, without the case if there is one only, as in `joined`."""
    if len(metrics) == 1:
        return next(iter(metrics.values())).flat()
    return {f"{case}.{name}": metric for case, own in metrics.items() for name, metric in own.flat().items()}
