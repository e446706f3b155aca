"""The FMI 2.0 slave of a kernel: state machine, checks and log around the pure functions of a model.

Runs inside an FMU, on a host that has only Python: it imports the standard library, PythonFMU's slave
class and the kernel contract. Never raises out of an FMI call: PythonFMU turns an exception into
fmi2Fatal without its text, and freeing such an instance can crash the host. Instead, what is wrong is
logged with its value, outputs become NaN where there is no valid state, and the next steps are discarded
until the instance is reset or an earlier state is set.
"""

import atexit
import ctypes
import math
import os
import sys
from types import ModuleType
from typing import Any, ClassVar
from xml.etree import ElementTree

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ..models.contract import Variable, check_bounds, variables

TIME_TOLERANCE = 1e-3
"""How far a step may begin from the end of the last one, as a part of the step..."""
ROUNDING = 1e-15
"""... and as a part of the time: hosts add up their clocks in different ways."""

_HELD: list[dict[str, Any]] = []
"""Namespace of the start script, once for each execution. At every instantiation PythonFMU's library executes the
script again and drops a reference to its namespace that it does not own: without these the namespace is freed while
in use, and the host crashes a few instances later."""

_LET_GO: set[int] = set()

BEFORE_START = "step before the end of initialisation -- call exitInitializationMode"


class KernelSlave(Fmi2Slave):
    """PythonFMU slave of a kernel module; a subclass names its ``kernel``.

    Value references count parameters, inputs and outputs in declared order.

    Attributes
    ----------
    kernel : module
        The kernel that is stepped.
    guid_built : str
        GUID of the build; the model description beside the resources must have the same.
    start_values : dict of str to float
        Start values of parameters, by public name, where they differ from the kernel's defaults.
    """

    kernel: ClassVar[ModuleType]
    guid_built: ClassVar[str] = ""
    start_values: ClassVar[dict[str, float]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.__module__ in sys.modules:
            _HELD.append(vars(sys.modules[cls.__module__]))

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        kernel = self.kernel
        self._step, self._inputs_type = kernel.step, kernel.Inputs
        self._parameters = variables(kernel.Params)
        inputs, outputs = variables(kernel.Inputs), variables(kernel.Outputs)
        self._variables = (*self._parameters, *inputs, *outputs)
        first_input, first_output = len(self._parameters), len(self._parameters) + len(inputs)
        self._is_input = frozenset(range(first_input, first_output))
        self._is_parameter = frozenset(range(first_input))

        # One store for each FMI type: a reference of the wrong type or out of range is then a missing key.
        self._real: dict[int, float] = {}
        self._integer: dict[int, int] = {}
        for reference, variable in enumerate(self._variables):
            self._store(variable)[reference] = variable.kind(self.start_values.get(variable.name, variable.start))
        self._input_cells = [(self._store(v), first_input + i) for i, v in enumerate(inputs)]
        self._output_cells = [(self._store(v), first_output + i) for i, v in enumerate(outputs)]
        both_tensions = "T_in" in kernel.Inputs._fields and "T_out" in kernel.Outputs._fields
        self._tension = kernel.Outputs._fields.index("T_out") if both_tensions else None

        self._params: Any = None
        self._state: Any = None
        self._time = 0.0
        self._running = False
        self._stale = True  # outputs are older than parameters or inputs; before the first step only
        self._slack_told = False
        self._not_started = BEFORE_START
        _let_go_at_exit(f"{self.resources}/../binaries/linux64/{type(self).__name__}.so")
        self._fault = self._foreign_description()  # what only a reset or an earlier state clears
        if self._fault:
            self._tell(self._fault)

    # -- FMI life cycle

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        self._time = start_time

    def exit_initialization_mode(self) -> None:
        if self._stale:
            self._start()
        if not self._not_started and hasattr(self.kernel, "warnings"):
            for text in self.kernel.warnings(self._params):
                self._tell(text, Fmi2Status.warning)
        self._running = True

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One step of the kernel; False (fmi2Discard) leaves state and outputs as they were, the reason is logged."""
        if self._fault or self._not_started or not self._running:
            return self._refuse(self._fault or self._not_started or BEFORE_START)
        slip = TIME_TOLERANCE * step_size + ROUNDING * abs(current_time)
        if not (step_size > 0.0 and abs(current_time - self._time) <= slip < math.inf):  # fails for NaN as well
            return self._refuse(self._wrong_time(current_time, step_size))
        inputs = self._inputs_type(*[store[reference] for store, reference in self._input_cells])
        if not math.isfinite(sum(inputs)):
            wrong = self._not_finite(inputs, self._inputs_type._fields)
            if wrong:
                return self._refuse(f"input {wrong} at t = {current_time!r} s -- expected a finite number")
        try:
            state, outputs = self._step(self._params, self._state, inputs, step_size)
        except Exception as failure:
            return self._refuse(f"step at t = {current_time!r} s with {inputs!r} failed: {failure}")
        if not math.isfinite(sum(outputs)):
            wrong = self._not_finite(outputs, outputs._fields)
            if wrong:
                return self._refuse(f"output {wrong} at t = {current_time!r} s with {inputs!r} -- reduce the step")
        self._state = state
        for (store, reference), value in zip(self._output_cells, outputs):  # noqa: B905  same length by construction
            store[reference] = value
        self._time = current_time + step_size
        # T_in = 0: the host uses the plant direction only and T_out means nothing
        if self._tension is not None and outputs[self._tension] < 0.0 and not self._slack_told and inputs.T_in != 0.0:
            self._tell_slack(outputs[self._tension])
        return True

    # -- FMI get and set

    def get_real(self, vrs: list[int]) -> list[float]:
        if self._stale:
            self._start()
        values = self._real
        try:
            return [values[reference] for reference in vrs]
        except KeyError:
            return self._known(values, vrs, "Real", math.nan)

    def get_integer(self, vrs: list[int]) -> list[int]:
        if self._stale:
            self._start()
        try:
            return [self._integer[reference] for reference in vrs]
        except KeyError:
            return self._known(self._integer, vrs, "Integer", 0)

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return self._known({}, vrs, "Boolean", False)

    def get_string(self, vrs: list[int]) -> list[str]:
        return self._known({}, vrs, "String", "")

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        if self._running:
            store, settable = self._real, self._is_input
            for reference, value in zip(vrs, values):  # noqa: B905  PythonFMU makes both lists in one loop
                if reference in settable and reference in store:
                    store[reference] = value
                else:
                    self._refuse_set(reference, value)
        else:
            self._set(self._real, vrs, values)

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._set(self._integer, vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self._set({}, vrs, values)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        self._set({}, vrs, values)

    # -- FMU state: everything that a later step depends on, as JSON-able values

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "guid": self.guid_built,
            "time": self._time,
            "running": self._running,
            "stale": self._stale,
            "slack_told": self._slack_told,
            "not_started": self._not_started,
            "fault": self._fault,
            "real": list(self._real.values()),
            "integer": list(self._integer.values()),
            "state": None if self._state is None else list(self._state),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            if state["guid"] != self.guid_built:
                raise ValueError(f"it is of guid {state['guid']}")
            real = dict(zip(self._real, state["real"], strict=True))
            integer = dict(zip(self._integer, state["integer"], strict=True))
            inner = None if state["state"] is None else self.kernel.State(*state["state"])
            rest = [state[key] for key in ("time", "running", "stale", "slack_told", "not_started", "fault")]
        except (KeyError, TypeError, ValueError) as failure:
            self._fault = f"FMU state is foreign or damaged ({failure}) -- expected one saved by this FMU -- reset it"
            self._tell(self._fault)
            return
        self._real.update(real)  # in place: input and output cells hold on to the stores
        self._integer.update(integer)
        self._state = inner
        self._time, self._running, self._stale, self._slack_told, self._not_started, self._fault = rest
        self._params = self.kernel.Params(*self._values(self._is_parameter))

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            return Fmi2Slave._fmu_state_from_bytes(state)
        except ValueError:  # not JSON, or not UTF-8: refused, with a message, when it is set
            return {}

    # -- inside

    def _store(self, variable: Variable) -> dict[int, Any]:
        return self._integer if variable.kind is int else self._real

    def _values(self, references: Any) -> list[Any]:
        return [self._store(self._variables[r])[r] for r in sorted(references)]

    def _start(self) -> None:
        """Outputs from parameters and inputs as they are now; on failure a fault and NaN outputs."""
        self._stale = False
        inputs = self._inputs_type(*[store[reference] for store, reference in self._input_cells])
        try:
            wrong = self._not_finite(inputs, inputs._fields)
            if wrong:
                raise ValueError(f"input {wrong} at the start -- expected a finite number")
            params = self.kernel.Params(*self._values(self._is_parameter))
            check_bounds(self._parameters, params)
            if hasattr(self.kernel, "check"):
                self.kernel.check(params)
            self._state, outputs = self.kernel.start(params, inputs)
            self._params, self._not_started = params, ""
        except Exception as failure:
            self._not_started = f"initialisation failed: {failure}"
            self._tell(self._not_started)
            self._state, outputs = None, [math.nan] * len(self._output_cells)
        for (store, reference), value in zip(self._output_cells, outputs, strict=True):
            store[reference] = value if store is self._real or math.isfinite(value) else 0

    def _set(self, store: dict[int, Any], references: list[int], values: list[Any]) -> None:
        settable = self._is_input if self._running else self._is_input | self._is_parameter
        for reference, value in zip(references, values, strict=True):
            if reference in settable and reference in store:
                store[reference] = value
                self._stale = not self._running
            else:
                self._refuse_set(reference, value)

    def _refuse_set(self, reference: int, value: Any) -> None:
        if reference in self._is_parameter and self._running:
            why = "it is fixed after initialisation -- reset the instance, then set it"
        else:
            why = "expected an input or parameter of this type -- see the model description"
        self._fault = f"{self._called(reference)} set to {value!r} -- {why}"
        self._tell(self._fault)

    def _known(self, store: dict[int, Any], references: list[int], kind: str, otherwise: Any) -> list[Any]:
        """Values with a substitute for unknown references: too short a list would crash PythonFMU's library."""
        for reference in references:
            if reference not in store:
                self._fault = f"{self._called(reference)} read as {kind} -- expected a variable of that type"
                self._tell(self._fault)
        return [store.get(reference, otherwise) for reference in references]

    def _called(self, reference: int) -> str:
        if 0 <= reference < len(self._variables):
            return f"variable {self._variables[reference].name}"
        return f"value reference {reference}"

    def _wrong_time(self, time: float, step: float) -> str:
        if not 0.0 < step < math.inf:
            return f"step size {step!r} s at t = {time!r} s -- expected a positive finite number"
        return f"step from t = {time!r} s -- expected t = {self._time!r} s, where the last step ended"

    def _not_finite(self, values: Any, names: tuple[str, ...]) -> str:
        for name, value in zip(names, values, strict=True):
            if not math.isfinite(value):
                return f"{name} = {value!r}"
        return ""

    def _tell_slack(self, tension: float) -> None:
        self._slack_told = True
        self._tell(
            f"T_out = {tension!r} N at t = {self._time!r} s: the tendon would push -- slack is not in this model "
            "(said once)",
            Fmi2Status.warning,
        )

    def _foreign_description(self) -> str:
        """Why this code and the model description beside it are not of one build; '' when they are.

        PythonFMU does not hand the GUID of fmi2Instantiate to the slave, so the file is compared instead.
        """
        if not self.guid_built or not self.resources:
            return ""
        try:
            root = ElementTree.parse(f"{self.resources}/../modelDescription.xml").getroot()
        except (OSError, ElementTree.ParseError):
            return ""  # hosts may keep the description elsewhere
        if root.get("guid") == self.guid_built:
            return ""
        return f"guid {root.get('guid')} in modelDescription.xml -- expected {self.guid_built} -- build the FMU again"

    def _refuse(self, message: str) -> bool:
        self._tell(message, Fmi2Status.discard)
        return False

    def _tell(self, message: str, status: Fmi2Status = Fmi2Status.error) -> None:
        self.log(f"{type(self).__name__}: {message}", status)


def _let_go_at_exit(library: str) -> None:
    """Make PythonFMU's Linux library drop its hold on the interpreter before the process ends.

    By itself it does so twice, the second time through freed memory, which now and then aborts the host at
    its very end ("corrupted double-linked list"). Only where Python is the host: elsewhere this call would
    end the interpreter.
    """
    if sys.platform != "linux" or not sys.orig_argv:
        return
    try:
        loaded = ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        finalize = loaded.finalizePythonInterpreter
    except (OSError, AttributeError):
        return  # not run by PythonFMU's library
    if loaded._handle not in _LET_GO:
        _LET_GO.add(loaded._handle)
        atexit.register(finalize)
