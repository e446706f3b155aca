"""Replay of a measured run through one FMU, and how well its outputs agree with what was measured.

Row k of the record belongs to the k-th result: the inputs of row k+1 are set, then the FMU steps from t_k to
t_k+1. The first row is the one of initialisation. Results are thus not one sample late.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..batching.stopping import interruptible
from ..kernels.arrays import FloatArray
from ..logs import agreement as scores
from ..logs.record import Record, cutoff_note, kernel_inputs
from ..logs.units import unit_to_si
from ..models.contract import InputError, Quantity, Variable
from .description import Description, describe
from .fmu_instance import FmuFailure, FmuInstance
from .fmu_process import Processes
from .recorder import Recorder, left_out, select
from .system import Component, System, Value, check_system
from .trajectory import SimulationInterrupted, SimulationStopped, Trajectory
from .unpack import unpacked


def replay(
    fmu: Path | str,
    record: Record,
    *,
    parameters: Mapping[str, Value] | None = None,
    cutoff: float | None = None,
    processes: Processes | None = None,
) -> Trajectory:
    """Drive an FMU with the inputs of a record.

    Parameters
    ----------
    fmu : Path
        FMU of ours or not; its inputs are channels of the record by name, converted from SI to the FMU's units.
    record : Record
        The run; v and a come from x where it has none.
    parameters : mapping of str to value, optional
        Start values; an input given here stays constant.
    cutoff : float, optional
        Cut-off of that differentiator [Hz].
    processes : Processes, optional
        As in `simulate_system`.

    Returns
    -------
    Trajectory
        All outputs by variable name, SI, one row for each row of the record; its messages begin with what was
        derived.

    Raises
    ------
    InputError
        Inputs missing from the record or not Real, uneven sampling for an FMU that needs equal steps, or a measured
        output in a unit of something else.
    SimulationStopped, SimulationInterrupted
        As in `simulate_system`.
    """
    name = "fmu"
    wiring = check_system(_alone(name, Path(fmu), record, parameters or {}))
    component, description = wiring.system.components[0], wiring.descriptions[name]
    driven = [p.name for p in description.inputs if p.name not in (parameters or {})]
    check_measured(record, {p.name: _si(p.unit) for p in description.outputs})
    rows, notes = _rows(description, driven, record, cutoff)
    rows = rows.tolist()
    steps = _steps(description, record).tolist()
    selection = select(wiring, None)
    with (
        interruptible() as stop,
        unpacked(component.fmu) as directory,
        FmuInstance(name, description, directory, driven, [v for _, v in selection.values()], processes) as instance,
    ):
        recorder = Recorder(selection, {name: instance}, len(rows), [*notes, *left_out(wiring, None)])
        ports = [instance.port(variable, "inputs") for variable in driven]
        time = record.time.tolist()

        def set_row(k: int) -> None:
            for (buffer, i), value in zip(ports, rows[k], strict=True):
                buffer[i] = value
            instance.set_inputs(time[k])

        try:
            instance.enter_initialization(time[0], None, component.parameters)
            set_row(0)
            instance.exit_initialization(time[0])
            instance.get_outputs(time[0])
            recorder.store(time[0])
            for k, dt in enumerate(steps):
                set_row(k + 1)
                instance.step(time[k], dt)
                instance.get_outputs(time[k + 1])
                if instance.ended_at is not None:
                    recorder.note(f"FMU {fmu} ended the run at t = {instance.ended_at:g} s")
                    if instance.ended_at < time[k + 1] - 1e-6 * dt:
                        break  # within the step: no row of the record
                    recorder.store(time[k + 1])
                    break
                recorder.store(time[k + 1])
                if stop:
                    break
            if lost := instance.close():
                recorder.note(lost)
            if stop:
                raise SimulationInterrupted(in_si(recorder.trajectory("interrupted")))
            return in_si(recorder.finished())
        except FmuFailure as failure:
            raise SimulationStopped(str(failure), in_si(recorder.trajectory(str(failure)))) from failure


def check_measured(record: Record, units: Mapping[str, str]) -> None:
    """Raise `InputError` where a channel of the record does not measure what the output of its name gives.

    ``units`` are SI units of the outputs; 1 passes, an FMU need not declare a unit. Called before a simulation.
    """
    for name in record.columns:
        if units.get(name, "1") != "1":
            record.require(name, units[name])


def agreement(time: FloatArray, columns: Mapping[str, FloatArray], record: Record) -> dict[str, scores.Agreement]:
    """Compare simulated channels with those of the same name in the record (`check_measured`), row by row.

    A simulation that ended early is compared as far as it went.

    Raises
    ------
    InputError
        If the times are not those of the record.
    """
    rows = time.size
    if not np.array_equal(time, record.time[:rows]):
        raise InputError(
            f"{rows} simulated rows for {record.time.size} of {record.name}, at other times -- expected those of the "
            "record -- compare with the record that was replayed"
        )
    return {
        name: scores.agreement(
            record.units[name], [record.columns[name][:rows]], [simulated - record.columns[name][:rows]]
        )
        for name, simulated in columns.items()
        if name in record.columns
    }


def _alone(name: str, fmu: Path, record: Record, parameters: Mapping[str, Value]) -> System:
    """Return a system of this FMU; inputs that the record will drive count as given."""
    inputs = describe(fmu).inputs
    for port in inputs:
        if port.kind != "Real" and port.name not in parameters:
            raise InputError(
                f"input {port.name} of {fmu.name} is {port.fmi_type} -- expected Real inputs in a replay -- "
                f"give it a constant with --set {port.name}=..."
            )
    driven = {p.name: p.start or 0 for p in inputs if p.kind == "Real"}
    return System((Component(name, fmu, {**driven, **parameters}),), (), record.name)


@dataclass(frozen=True)
class _Inputs:
    """What `kernel_inputs` asks of a kernel."""

    inputs: tuple[Variable, ...]


def _rows(
    description: Description, driven: list[str], record: Record, cutoff: float | None
) -> tuple[FloatArray, tuple[str, ...]]:
    variables = []
    for name in driven:
        port = description.ports[name]
        unit = port.unit or record.units.get(name, "1")
        variables.append(Variable(name, name, float, 0.0, Quantity(unit, "")))
    inputs: Any = _Inputs(tuple(variables))
    found = kernel_inputs(record, inputs, cutoff)
    values = found.values
    for column, variable in enumerate(variables):
        unit = unit_to_si(variable.quantity.unit)
        if (unit.factor, unit.offset) != (1.0, 0.0):
            values[:, column] = (values[:, column] - unit.offset) / unit.factor
    return values, (*found.notes, *cutoff_note(cutoff, [record], driven))


def _steps(description: Description, record: Record) -> FloatArray:
    steps = np.diff(record.time)
    if description.variable_step:
        return steps
    step = float(record.time[-1] - record.time[0]) / steps.size
    worst = int(np.argmax(abs(steps - step)))
    if abs(steps[worst] - step) > 1e-3 * step:
        raise InputError(
            f"{description.path.name} needs equal steps, {record.name} has {steps[worst]:g} s at t = "
            f"{record.time[worst]:g} s among steps of {step:g} s -- expected even sampling -- resample the log"
        )
    return np.full(steps.size, step)


def _si(unit: str) -> str:
    """The SI unit; 1 for an FMU's own unit that pint does not know, and for none."""
    try:
        return unit_to_si(unit or "1").si
    except InputError:
        return "1"


def in_si(run: Trajectory) -> Trajectory:
    """The trajectory of the one FMU of a replay by variable, in SI."""
    columns, units = {}, {}
    for address, values in run.columns.items():
        name = address.partition(".")[2]
        try:
            unit = unit_to_si(run.units[address])
        except InputError:  # an FMU's own unit that pint does not know stays as it is
            columns[name], units[name] = values, run.units[address]
            continue
        columns[name] = values if (unit.factor, unit.offset) == (1.0, 0.0) else values * unit.factor + unit.offset
        units[name] = unit.si
    return Trajectory(run.time, columns, units, run.incomplete, run.messages)
