"""The co-simulation master: initialisation, Gauss-Seidel or Jacobi stepping, recording.

Gauss-Seidel (default) steps the components in the order of `schedule` and hands every output on at once, so
that only the links against that order carry the previous communication point. Jacobi steps all with the
values of the previous point. Both are first order in the communication step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

from ..batching.stopping import StopRequest, interruptible
from ..models.contract import InputError
from .exchange import (
    Advance,
    Part,
    Transfer,
    gauss_seidel,
    in_sequence,
    iterated,
    jacobi,
    move,
    settle,
    settle_loop,
    transfers_to,
)
from .fmu_instance import FmuFailure, FmuInstance
from .fmu_process import Processes
from .order import AlgebraicLoop, Schedule, schedule
from .program import Program, Stimulus, can_compile
from .progress import bar
from .recorder import Recorder, Selection, left_out, select
from .system import System, Wiring, check_system
from .trajectory import SimulationInterrupted, SimulationStopped, Trajectory
from .unpack import unpacked
from .variable_step import VariableStep, check_variable_step

Run = Callable[[int, int, int, StopRequest], int]
"""Take steps; see `Program.run`."""
METHODS = ("gauss-seidel", "jacobi")
REPAID = 50_000
"""Steps times components from which on the compiled loop repays being loaded."""
MOST_STEPS = 1e8
"""More rows than this fit into no memory that such a run has."""


def simulate_system(
    system: System,
    stop: float,
    step: float,
    *,
    start: float = 0.0,
    method: str = "gauss-seidel",
    loops: str = "refuse",
    tolerance: float = 1e-9,
    record: Sequence[str] | None = None,
    decimation: int = 1,
    progress: bool = False,
    processes: Processes | None = None,
    compiled: bool | None = None,
    stimuli: Sequence[Stimulus] = (),
    step_error: float | None = None,
) -> Trajectory:
    """Co-simulate a system with a fixed communication step, or with one that is chosen by its error within it.

    Parameters
    ----------
    system : System
        Components, connections, start values.
    stop, step, start : float
        Time [s]; ``stop - start`` is a whole number of steps.
    method : {"gauss-seidel", "jacobi"}
        Order of the exchange.
    loops : {"refuse", "delay", "iterate"}
        What becomes of algebraic loops; ``iterate`` needs Gauss-Seidel and FMUs that save their state.
    tolerance : float
        Of that iteration, relative to each value or to 1.
    record : sequence of str, optional
        ``component.variable`` or ``component`` (all its outputs); without it all outputs.
    decimation : int
        Record every n-th communication point.
    progress : bool
        Show a bar on stderr, if that is a terminal.
    processes : Processes, optional
        Give FMUs that are not ours processes of their own; without it all run in this one.
    compiled : bool, optional
        Step in machine code or not; both give the same bits. Without it where the run is long (`REPAID`). Texts
        or mapped values that are handed on and loops that are iterated are never stepped there.
    stimuli : sequence of Stimulus
        Values for inputs at every step; they need machine code. An input that is not connected wants a start value.
    step_error : float, optional
        Largest error of a step, relative to each signal's largest value: the step is divided where it is larger, by
        rolling back (`variable_step`). It needs FMUs that save their state, and is never done in machine code.

    Returns
    -------
    Trajectory
        First row at ``start``, after initialisation.

    Raises
    ------
    InputError
        If the system does not fit together (`check_system`, `schedule`) or an argument is wrong.
    SimulationStopped
        If an FMU fails or an output is no longer finite; `trajectory` has the rows until then.
    SimulationInterrupted
        On Ctrl-C; `trajectory` has the rows until then.
    """
    steps = number_of_steps(start, stop, step)
    if method not in METHODS:
        raise InputError(f"method {method!r} -- expected one of {', '.join(METHODS)} -- choose one")
    if decimation < 1:
        raise InputError(f"decimation {decimation!r} -- expected 1 or more -- give 1 to record every point")
    if loops == "iterate" and method == "jacobi":
        raise InputError("loops 'iterate' with method 'jacobi' -- expected Gauss-Seidel -- leave --jacobi out")
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"tolerance {tolerance!r} -- expected a number between 0 and 1 -- correct it")
    wiring = check_system(system)
    if step_error is not None:
        if stimuli or compiled:
            raise InputError("step error with given inputs or machine code -- expected neither -- leave one out")
        check_variable_step(wiring, step_error)
    plan = schedule(wiring, loops)
    selection = select(wiring, record)
    with ExitStack() as stack:
        asked = stack.enter_context(interruptible())
        instances = _instantiate(wiring, selection, stack, processes, stimuli)
        notes = (*system.notes, *(_loop_note(loop, loops) for loop in plan.loops), *left_out(wiring, record))
        recorder = Recorder(selection, instances, 2 + steps // decimation, notes)
        order = [instances[name] for name in plan.components]
        transfers = {name: transfers_to(name, wiring, instances) for name in instances}
        wanted = tolerance if loops == "iterate" else None
        parts: list[Part] = [(instances[name], transfers[name]) for name in plan.components]
        by_hand = (wanted is not None and plan.loops) or not can_compile(transfers)
        if stimuli and by_hand:
            raise InputError(
                f"system {system.name} hands on texts or mapped values, or iterates loops -- expected none of these "
                "where inputs are given -- choose --loops delay, or leave that connection out"
            )
        given = [(instances[s.component], s) for s in stimuli]
        varied: VariableStep | None = None
        if step_error is not None:
            by_hand = True
            advance_all = _advance(plan, instances, transfers, method, wanted)
            varied = VariableStep(advance_all, order, wiring, step_error)
        if compiled is None or given:
            compiled = bool(given) or steps * len(parts) >= REPAID
        try:
            _initialise(wiring, plan, instances, transfers, start, wanted)
            recorder.store(start)
            with bar(progress, system.name, steps, step) as advance:
                run: Run
                if compiled and not by_hand:
                    run = Program(parts, method == "jacobi", recorder, (start, step), given).run
                else:
                    taken = varied or _advance(plan, instances, transfers, method, wanted)
                    run = _interpreted(taken, order, recorder, start, step)
                done = 0
                while done < steps:
                    done = run(done, steps, decimation, asked)
                    if ended := [i for i in order if i.ended_at is not None]:
                        _store_end(recorder, ended, len(order), start + done * step)
                        break
                    advance(done)
                    if asked:
                        break
        except FmuFailure as failure:
            _note(recorder, varied)
            raise SimulationStopped(str(failure), recorder.trajectory(str(failure))) from failure
        _note(recorder, varied)
        for instance in instances.values():
            if lost := instance.close():
                recorder.note(lost)
        if asked:
            raise SimulationInterrupted(recorder.trajectory("interrupted"))
        return recorder.finished()


def _note(recorder: Recorder, varied: VariableStep | None) -> None:
    for note in () if varied is None else varied.notes():
        recorder.note(note)


def _interpreted(advance: Advance, order: Sequence[FmuInstance], recorder: Recorder, start: float, step: float) -> Run:
    """As `Program.run`, one step at a time."""

    def run(begin: int, end: int, decimation: int, asked: StopRequest) -> int:
        advance(start + begin * step, step)
        done = begin + 1
        if done % decimation == 0 and all(i.ended_at is None for i in order):
            recorder.store(start + done * step)
        return done

    return run


def _loop_note(loop: AlgebraicLoop, loops: str) -> str:
    if loops == "iterate":
        return f"{loop}: iterated in each step"
    return f"{loop}: one step late at {', '.join('.'.join(link.target) for link in loop.late)}"


def _advance(
    plan: Schedule,
    instances: Mapping[str, FmuInstance],
    transfers: Mapping[str, list[Transfer]],
    method: str,
    tolerance: float | None,
) -> Advance:
    """The step of the whole system; algebraic loops are iterated with a tolerance."""

    def parts(names: Sequence[str]) -> list[Part]:
        return [(instances[name], transfers[name]) for name in names]

    if method == "jacobi":
        return jacobi(parts(plan.components))
    if tolerance is None or not plan.loops:
        return gauss_seidel(parts(plan.components))
    advances: list[Advance] = []
    for name in plan.components:
        loop = next((found for found in plan.loops if name in found.components), None)
        if loop is None:
            advances.append(gauss_seidel(parts([name])))
        elif name == loop.components[0]:
            advances.append(iterated(loop, parts(loop.components), instances, tolerance))
    return in_sequence(advances)


def _store_end(recorder: Recorder, ended: Sequence[FmuInstance], running: int, time: float) -> None:
    """The last row of a run that FMUs asked to end: where they stopped within the step, only if they are alone."""
    reached = min(instance.ended_at or 0.0 for instance in ended)
    whole = abs(reached - time) <= 1e-9 * abs(time)
    if whole or running == 1:
        recorder.store(time if whole else reached)
    for instance in ended:
        recorder.note(f"FMU {instance.name} ({instance.description.path.name}) ended the run at t = {reached:g} s")


def number_of_steps(start: float, stop: float, step: float) -> int:
    """Communication steps of a run.

    Raises
    ------
    InputError
        Times that are not finite, not in order, not a whole number of steps, or more than a memory holds.
    """
    if not (math.isfinite(start) and math.isfinite(stop) and math.isfinite(step) and step > 0.0 and stop > start):
        raise InputError(
            f"start {start!r}, stop {stop!r}, step {step!r} s -- expected start < stop and step > 0 -- correct them"
        )
    if not (stop - start) / step <= MOST_STEPS:
        raise InputError(
            f"stop {stop!r} s with step {step!r} s from {start!r} s -- expected at most {MOST_STEPS:.0e} steps "
            "-- choose a longer step"
        )
    steps = round((stop - start) / step)
    if steps < 1 or abs(steps * step - (stop - start)) > 1e-6 * step:
        raise InputError(
            f"stop {stop!r} s with step {step!r} s from {start!r} s -- expected a whole number of steps -- set for "
            f"example stop {start + max(steps, 1) * step:g} s"
        )
    return steps


def _instantiate(
    wiring: Wiring, selection: Selection, stack: ExitStack, processes: Processes | None, stimuli: Sequence[Stimulus]
) -> dict[str, FmuInstance]:
    instances: dict[str, FmuInstance] = {}
    fmus = dict.fromkeys(component.fmu for component in wiring.system.components)
    directories = {fmu: stack.enter_context(unpacked(fmu)) for fmu in fmus}
    for component in wiring.system.components:
        name, directory = component.name, directories[component.fmu]
        wanted = [link.source[1] for link in wiring.links if link.source[0] == name]
        wanted += [variable for owner, variable in selection.values() if owner == name]
        inputs = [link.target[1] for link in wiring.links if link.target[0] == name]
        inputs += [s.variable for s in stimuli if s.component == name and s.variable not in inputs]
        outputs = list(dict.fromkeys(wanted))
        instance = FmuInstance(name, wiring.descriptions[name], directory, inputs, outputs, processes)
        stack.enter_context(instance)
        instances[name] = instance
    return instances


def _initialise(
    wiring: Wiring,
    plan: Schedule,
    instances: Mapping[str, FmuInstance],
    transfers: Mapping[str, list[Transfer]],
    start: float,
    tolerance: float | None,
) -> None:
    """Bring all components through initialisation mode with consistent inputs.

    In that mode outputs follow inputs, so the values are handed on in order until none changes. An FMU
    that computes its outputs only on leaving the mode is served too: each gets its inputs once more just
    before it leaves. Algebraic loops are solved where a tolerance is given.
    """
    for component in wiring.system.components:
        instances[component.name].enter_initialization(start, None, component.parameters)
    for instance in instances.values():
        instance.get_outputs(start)
    # with its own start values as inputs; round a loop one that has failed would leave none with finite inputs
    alone = {name: instance.not_started(start) for name, instance in instances.items()}
    for _ in range(len(instances) + 1):
        before = [bytes(block.values) for i in instances.values() for block in i.inputs]
        for name in plan.components:
            settle([(instances[name], transfers[name])], start)
        if tolerance is not None:
            for loop in plan.loops:
                parts = [(instances[name], transfers[name]) for name in loop.components]
                settle_loop(loop, parts, instances, tolerance, start)
        if before == [bytes(block.values) for i in instances.values() for block in i.inputs]:
            break
    for name, instance in instances.items():
        if failure := instance.not_started(start) or (alone[name] if not instance.finite_outputs else None):
            raise failure
    for name in plan.components:
        move(transfers[name], start)
        instances[name].set_inputs(start)
        instances[name].exit_initialization(start)
        instances[name].get_outputs(start)
