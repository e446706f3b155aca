"""One loaded FMU, driven through the FMI 2.0 or 3.0 co-simulation call sequence, strictly.

FMPy loads the library and declares the C functions; the calls of the step loop go to them directly, with
the value references and buffers of all ports of one type prepared once, so that a step costs one set,
one doStep and one get per type. Statuses are checked here: a warning passes, anything above stops.
"""

from __future__ import annotations

import ctypes
import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
from fmpy.fmi1 import FMICallException

from ..models.contract import InputError
from .description import Description, Port
from .fmi_calls import FATAL, WARNING, Block, Step, c_type
from .fmu_library import MOST_LINES, SCRIPT_NAME, forget, load
from .fmu_process import Processes, ProcessLost
from .remote_slave import RemoteSlave
from .start_values import typed_value
from .system import Value

DISCARD = 2
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")


class FmuFailure(InputError):
    """An FMU returned Discard, Error or Fatal; the line names it, the call, the time and its last message."""


class FmuInstance:
    """An instantiated FMU; use as a context manager, which terminates and frees it as FMI allows.

    Parameters
    ----------
    name : str
        Instance name.
    description : Description
        From `describe`.
    directory : Path
        Where the FMU is unpacked.
    inputs, outputs : sequence of str
        Variables that the step loop sets and gets.
    processes : Processes, optional
        Give processes to FMUs that are to run in one of their own; without it the FMU runs here.

    Attributes
    ----------
    ended_at : float or None
        Time that the FMU reached when it asked to end the simulation [s]; None while it goes on.

    Raises
    ------
    FmuFailure
        If the library cannot be loaded or the FMU does not instantiate.
    """

    def __init__(
        self,
        name: str,
        description: Description,
        directory: Path,
        inputs: Sequence[str],
        outputs: Sequence[str],
        processes: Processes | None = None,
    ) -> None:
        self.name, self.description = name, description
        self.label = f"{name} ({description.path.name})"
        """What messages call it."""
        self._fmi3 = description.fmi == 3
        self._stage = "new"
        self.ended_at: float | None = None
        self._log: deque[str] = deque(maxlen=MOST_LINES)
        arguments = {
            "guid": description.model.guid,
            "modelIdentifier": description.model.coSimulation.modelIdentifier,
            "unzipDirectory": str(directory),
            "instanceName": name,
        }
        self.python = "PythonFMU" in (description.model.generationTool or "")
        """Whether PythonFMU runs it, which calls every discarded step a request to end the simulation."""
        if self.python and not (directory / SCRIPT_NAME).is_file():
            raise FmuFailure(  # its library would crash
                f"FMU {self.label} has no {SCRIPT_NAME} -- expected the script that PythonFMU runs -- build it again"
            )
        self._give_back: Callable[[], None] | None = None
        process = None if processes is None else processes.take(description)
        try:
            if process is None or processes is None:
                self._fmu: Any = load(description.fmi, arguments, self._log, self.python)
            else:
                self._give_back = partial(processes.give_back, description, process)
                self._fmu = RemoteSlave(process, description.fmi, arguments, self._log, self.python)
        except ProcessLost as lost:
            raise FmuFailure(self._lost("instantiate", str(lost))) from None
        except Exception as failure:
            if process is not None:
                process.kill()
            hint = (
                "the FMU needs its own tool" if description.model.coSimulation.needsExecutionTool else "build it again"
            )
            raise FmuFailure(
                f"FMU {self.label} cannot be loaded: {self.last_log or _first_line(failure)} -- "
                f"expected a library for {fmpy.platform_tuple} that instantiates -- {hint}, or for this platform"
            ) from failure
        self.inputs = self._blocks(inputs, "Set")
        self.outputs = self._blocks(outputs, "Get")
        self.do_step = Step(self._fmu._functions[f"fmi{description.fmi}DoStep"], self._fmu.component, self._fmi3)

    def __enter__(self) -> FmuInstance:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def messages(self) -> tuple[str, ...]:
        """What the FMU logged above the status OK, the last twenty lines, after its name."""
        return tuple(f"{self.name}: {line}" for line in self._log)

    @property
    def lost(self) -> bool:
        """Whether it returned Error or Fatal, after which FMI has no way back."""
        return self._stage in ("failed", "fatal")

    @property
    def last_log(self) -> str:
        """Last line that the FMU logged; empty if none."""
        return self._log[-1] if self._log else ""

    def port(self, name: str, side: str) -> tuple[Any, int]:
        """Buffer and index of a variable among the inputs or outputs (``side``)."""
        for block in getattr(self, side):
            if name in block.names:
                return block.values, block.names.index(name)
        raise KeyError(f"{self.name}.{name} is not among the {side}")

    def set_start_values(self, values: Mapping[str, Value]) -> None:
        """Set parameters and other start values before initialisation."""
        ports = self.description.ports
        variables: dict[str, str] = {}
        for name in values:
            variables.setdefault(ports[name].array or name, name)
        for element in variables.values():
            (block,) = self._blocks([element], "Set")  # an array is set as a whole, with the elements that are given
            given = {name: value for name, value in values.items() if name in block.names}
            for name, value in given.items():
                block.values[block.names.index(name)] = value.encode() if isinstance(value, str) else value
            what = ", ".join(f"{name} = {value!r}" for name, value in given.items())
            self._check(block.call(), f"set {what}", None)
        for block in self.inputs:  # elements of an array of which others are connected
            for name in values.keys() & set(block.names):
                value = values[name]
                block.values[block.names.index(name)] = value.encode() if isinstance(value, str) else value

    def enter_initialization(self, start: float, stop: float | None, values: Mapping[str, Value]) -> None:
        """Set the experiment up, set start values and enter initialisation mode.

        In this order, as in FMPy: some FMI 2.0 units put all variables to their defaults in setupExperiment.
        """
        if self._fmi3:
            self.set_start_values(values)
            self._attempt(
                partial(self._fmu.enterInitializationMode, None, start, stop), "enterInitializationMode", start
            )
        else:
            self._attempt(partial(self._fmu.setupExperiment, None, start, stop), "setupExperiment", start)
            self.set_start_values(values)
            self._attempt(self._fmu.enterInitializationMode, "enterInitializationMode", start)
        self._stage = "initialising"

    @property
    def finite_outputs(self) -> bool:
        """Whether all numbers in the output buffers are finite."""
        return all(math.isfinite(v) for block in self.outputs if block.real for v in block.values)

    def not_started(self, time: float) -> FmuFailure | None:
        """The failure, if outputs are not finite although all inputs are: the cause, not one that follows it."""
        wrong, given = (
            [n for b in blocks if b.real for n, v in zip(b.names, b.values, strict=True) if not math.isfinite(v)]
            for blocks in (self.outputs, self.inputs)
        )
        if not wrong or given:
            return None
        return FmuFailure(
            f"FMU {self.label} has no finite {', '.join(wrong)} at t = {time:g} s: {self._reason('finite outputs')}"
        )

    def exit_initialization(self, time: float) -> None:
        """Leave initialisation mode: the outputs are now those at the start."""
        self._attempt(self._fmu.exitInitializationMode, "exitInitializationMode", time)
        self._stage = "running"

    def set_inputs(self, time: float) -> None:
        """Write the input buffers to the FMU."""
        for block in self.inputs:
            self.after_set(block, block.call(), time)

    def after_set(self, block: Block, status: int, time: float) -> None:
        """Raise `FmuFailure` if a block of inputs was refused."""
        if status > WARNING:
            self._check(status, f"set {', '.join(block.names)} = {list(block.values)}", time)

    def get_outputs(self, time: float) -> None:
        """Read the outputs of the FMU into the output buffers."""
        for block in self.outputs:
            self.after_get(block, block.call(), time)

    def after_get(self, block: Block, status: int, time: float) -> None:
        """Raise `FmuFailure` if a block of outputs was refused."""
        if status > WARNING:
            self._check(status, f"get {', '.join(block.names)}", time)

    def step(self, time: float, dt: float) -> None:
        """Advance from ``time`` by ``dt`` [s]; an FMU that asks to end the simulation has not failed (`ended_at`)."""
        self.after_step(self.do_step(time, dt), time, dt)

    def after_step(self, status: int, time: float, dt: float) -> None:
        """Take note of a request to end the simulation; raise `FmuFailure` if the step was refused."""
        if self._fmi3 and status <= WARNING:
            self.ended_at = self.do_step.ended_at(time, dt)
        elif status == DISCARD and not self._fmi3 and not self.python:
            self.ended_at = self._terminated()
        if status > WARNING and self.ended_at is None:
            self._check(status, "doStep", time)

    def _terminated(self) -> float | None:
        """Last time that an FMI 2.0 unit reached, if its discarded step was a request to end the simulation."""
        logged = tuple(self._log)
        try:
            if self._fmu.getBooleanStatus(fmpy.fmi2.fmi2Terminated):
                return self._fmu.getRealStatus(fmpy.fmi2.fmi2LastSuccessfulTime)
        except Exception:  # most FMUs do not implement the question; what they log on it is no reason
            self._log.clear()
            self._log.extend(logged)
        return None

    def derivative(self, unknowns: Sequence[int], knowns: Sequence[int], time: float) -> list[float]:
        """Directional derivative of unknowns for a change by 1 of each of the knowns, by value reference."""
        ask = partial(self._fmu.getDirectionalDerivative, list(unknowns), list(knowns), [1.0] * len(knowns))
        return list(self._attempt(ask, "getDirectionalDerivative", time))

    def save_state(self) -> Any:
        """The complete state, to be given back to `restore_state` and `free_state`."""
        return self._attempt(self._fmu.getFMUState, "getFMUState", math.nan)

    def restore_state(self, state: Any) -> None:
        """Go back to a saved state."""
        self._attempt(partial(self._fmu.setFMUState, state), "setFMUState", math.nan)

    def free_state(self, state: Any) -> None:
        """Give the memory of a saved state back."""
        if self._stage != "fatal":
            self._attempt(partial(self._fmu.freeFMUState, state), "freeFMUState", math.nan)

    def close(self) -> str:
        """Terminate and free: after an error only the freeing is allowed, after Fatal nothing is.

        Returns
        -------
        str
            How that took the FMU's process with it; empty if it did not, or if it was lost before.
        """
        if self._stage == "closed":
            return ""
        loss = ""
        for name, allowed in (("terminate", self._stage == "running"), ("freeInstance", self._stage != "fatal")):
            try:
                if allowed and not loss:
                    getattr(self._fmu, name)()
            except ProcessLost as lost:
                loss = self._lost(name, str(lost))
            except Exception:
                pass
        if self._give_back is not None and self._stage == "fatal":
            self._fmu.process.kill()
        elif self._give_back is not None:
            self._give_back()
            del self._fmu.process  # it ends when nothing holds it, and this one may be held in a circle
        self._give_back = None
        self._stage = "closed"
        forget(self.name)
        return loss

    def _blocks(self, names: Sequence[str], verb: str) -> list[Block]:
        """One block for each type that the variables have; of an array all elements are in it."""
        ports = self.description.ports
        grouped: dict[str, dict[str, tuple[str, ...]]] = {}
        for name in names:
            kind = ports[name].fmi_type
            if kind == "Enumeration":
                kind = "Int64" if self._fmi3 else "Integer"
            variable = ports[name].array or name
            grouped.setdefault(kind, {})[variable] = self.description.elements(variable)
        return [
            self._block(kind, [[ports[e] for e in elements] for elements in variables.values()], verb)
            for kind, variables in grouped.items()
        ]

    def _block(self, kind: str, variables: Sequence[Sequence[Port]], verb: str) -> Block:
        ports = [port for elements in variables for port in elements]
        references = (ctypes.c_uint * len(variables))(*(elements[0].reference for elements in variables))
        values = (c_type(kind, self._fmi3) * len(ports))(*(_start(port) for port in ports))
        function = self._fmu._functions[f"fmi{self.description.fmi}{verb}{kind}"]
        return Block(tuple(p.name for p in ports), values, function, self._fmu.component, references, self._fmi3)

    def _attempt(self, call: Callable[[], Any], what: str, time: float) -> Any:
        try:
            return call()
        except FMICallException as failure:
            self._check(failure.status, what, time)
        except ProcessLost:
            self._check(FATAL, what, time)

    def _check(self, status: int, what: str, time: float | None) -> None:
        """Raise unless OK or Warning, and remember what FMI still allows on this instance."""
        if status <= WARNING:
            return
        if status == FATAL:
            self._stage = "fatal"
        elif status != DISCARD:
            self._stage = "failed"
        at = "" if time is None or math.isnan(time) else f" at t = {time:g} s"
        if self._give_back is not None and self._fmu.failure is not None:
            raise self._fmu.failure
        if self._give_back is not None and self._fmu.process.ended:
            raise FmuFailure(self._lost(what + at, self._fmu.process.ended))
        label = STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"
        raise FmuFailure(f"FMU {self.label} returned {label} from {what}{at}: {self._reason('OK')}")

    def _lost(self, what: str, how: str) -> str:
        return (
            f"FMU {self.label}: {what} {how} -- expected a return from every call -- get a corrected FMU from its maker"
        )

    def _reason(self, expected: str) -> str:
        """The last log line, with what was expected and what to do unless the FMU says that itself."""
        line = self.last_log or "it logged nothing"
        return line if line.count(" -- ") > 1 else f"{line} -- expected {expected} -- check its inputs and parameters"


def _start(port: Port) -> Any:
    """The declared start value of a variable as its buffer has it: what an element that nobody sets keeps."""
    if port.kind == "String":
        return (port.start or "").encode()
    try:
        value = typed_value(port.name, port, port.start or 0)
    except InputError:  # an FMU's own number that is none: what is set replaces it
        return 0
    return value


def _first_line(failure: Exception) -> str:
    return (str(failure).splitlines() or [type(failure).__name__])[0]
