"""The FMI 2.0 slave of a kernel: state machine, checks and log around the pure functions of a model.

Runs inside an FMU, on a host that has only Python: it imports the standard library, PythonFMU's slave
class and the kernel contract. Never raises out of an FMI call: PythonFMU turns an exception into
fmi2Fatal without its text, and freeing such an instance can crash the host. Instead, what is wrong is
logged with its value, outputs become NaN where there is no valid state, and the next steps are discarded
until the instance is reset or an earlier state is set. The one exception is the constructor: an exception there
is a refused fmi2Instantiate, which is safe.
"""

import math
import sys
from math import isfinite
from types import ModuleType
from typing import Any, ClassVar
from xml.etree import ElementTree

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ..models.contract import check_bounds, check_conditions, conditions_of, flat, packed, variables
from .library_faults import FOREIGN_HOST, HostLog, give_back, hold_namespace, keep_thread_state, let_go_at_exit

TIME_TOLERANCE = 1e-3
"""How far a step may begin from the end of the last one, as a part of the step..."""
ROUNDING = 1e-15
"""... and as a part of the time: hosts add up their clocks in different ways."""

INFINITE = math.inf
new_tuple: Any = tuple.__new__  # a third of the cost of calling a named tuple's class
_SAVED = ("_time", "_phase", "_running", "_stale", "_watches_slack", "_not_started", "_fault")
"""What an FMU state holds besides values and kernel state."""

INSTANTIATED, INITIALISING, RUNNING, TERMINATED = "instantiated", "in initialisation mode", "running", "terminated"
"""States of an instance in the order of FMI 2.0, Figure 11."""

BEFORE_START = "step -- expected after the end of initialisation -- call exitInitializationMode first"
AFTER_END = "step -- expected before the end of the simulation -- reset the instance, then initialise it again"
MEND = "check what drives it"
NEXT = "see modelDescription.xml"


class KernelSlave(Fmi2Slave):
    """PythonFMU slave of a kernel module; a subclass names its ``kernel``.

    Value references count parameters, inputs and outputs in declared order.

    Attributes
    ----------
    kernel : module
        The kernel that is stepped.
    guid_built : str
        GUID of the build; the model description beside the resources must have the same.
    needs : str
        What the FMU needs of its host, as its description says.
    start_values : dict of str to float
        Start values of parameters, by public name, where they differ from the kernel's defaults.
    """

    kernel: ClassVar[ModuleType]
    guid_built: ClassVar[str] = ""
    needs: ClassVar[str] = ""
    start_values: ClassVar[dict[str, float]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        hold_namespace(cls.__module__)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        kernel = self.kernel
        self._step, self._inputs_type = kernel.step, kernel.Inputs
        self._parameters, self._conditions = variables(kernel.Params), conditions_of(kernel)
        inputs, outputs = variables(kernel.Inputs), variables(kernel.Outputs)
        self._variables = (*self._parameters, *inputs, *outputs)
        self._n_parameters, first_output = len(self._parameters), len(self._parameters) + len(inputs)
        self._input_slice = slice(self._n_parameters, first_output)
        self._output_slice = slice(first_output, len(self._variables))
        references = {
            kind: frozenset(r for r, v in enumerate(self._variables) if v.kind is kind) for kind in (float, int)
        }
        self._reals, self._integers = references[float], references[int]
        self._inputs = frozenset(range(self._n_parameters, first_output))
        self._real_inputs = self._inputs & self._reals
        self._values: list[Any] = [v.kind(self.start_values.get(v.name, v.start)) for v in self._variables]
        self._params: Any = None
        self._state: Any = None
        self._time = 0.0
        self._phase = INSTANTIATED
        self._running = False  # the phase of the calls that must be fast
        self._stale = True  # outputs are older than parameters or inputs; before the first step only
        self._watches_slack = "T_in" in kernel.Inputs._fields and "T_out" in kernel.Outputs._fields
        self._not_started = BEFORE_START
        self._fault = ""  # what only a reset or an earlier state clears
        self._passed: list[str] = []  # texts that PythonFMU's library holds on to
        self._host_log = HostLog(kwargs.get("logger", 0), self.instance_name)
        let_go_at_exit(f"{self.resources}/../binaries/linux64/{type(self).__name__}.so")
        foreign = self._foreign_description()
        if foreign:
            if self._host_log.is_shut():
                self._tell(foreign)
            raise RuntimeError(foreign)
        if self.needs:
            version = ".".join(map(str, sys.version_info[:3]))
            self._tell(f"runs on Python {version}. {self.needs}", Fmi2Status.ok)

    # -- FMI life cycle

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        if self._phase != INSTANTIATED:
            self._misplace("setupExperiment", "before initialisation mode")
            return
        self._time = start_time

    def enter_initialization_mode(self) -> None:
        if self._phase != INSTANTIATED:
            self._misplace("enterInitializationMode", "once, after instantiate or reset")
            return
        self._phase = INITIALISING

    def exit_initialization_mode(self) -> None:
        if self._phase != INITIALISING:
            self._misplace("exitInitializationMode", "once, after enterInitializationMode")
            return
        if self._stale:
            self._start()
        if not self._not_started:
            for text in check_conditions(self._conditions, self._params):
                self._tell(text, Fmi2Status.warning)
        self._phase, self._running = RUNNING, True

    def terminate(self) -> None:
        self._phase, self._running = TERMINATED, False

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One step of the kernel; False (fmi2Discard) leaves state and outputs as they were, the reason is logged."""
        if FOREIGN_HOST:
            keep_thread_state()
        if self._fault or self._not_started or not self._running:
            end = AFTER_END if self._phase == TERMINATED else ""
            return self._refuse(self._fault or end or self._not_started or BEFORE_START)
        if not 0.0 < step_size < INFINITE or (
            current_time != self._time and not self._continues(current_time, step_size)
        ):
            return self._refuse(self._wrong_time(current_time, step_size))
        values = self._values
        inputs = new_tuple(self._inputs_type, values[self._input_slice])
        if not isfinite(sum(inputs)):
            wrong = _not_finite(inputs)
            if wrong:
                return self._refuse(f"input {wrong} at t = {current_time!r} s -- expected a finite number -- {MEND}")
        try:
            state, outputs = self._step(self._params, self._state, inputs, step_size)
        except Exception as failure:
            return self._refuse(f"step at t = {current_time!r} s with {inputs!r} failed: {failure}")
        if not isfinite(sum(outputs)):
            wrong = _not_finite(outputs)
            if wrong:
                what = f"output {wrong} at t = {current_time!r} s with {inputs!r}"
                return self._refuse(f"{what} -- expected a finite number -- reduce the step")
        self._state = state
        values[self._output_slice] = outputs
        self._time = current_time + step_size
        # T_in = 0: the host uses the plant direction only, and T_out means nothing
        if self._watches_slack and outputs.T_out < 0.0 and inputs.T_in != 0.0:
            self._tell_slack(outputs.T_out)
        return True

    # -- FMI get and set

    def get_real(self, vrs: list[int]) -> list[float]:
        if self._stale:
            self._start()
        if not self._reals.issuperset(vrs):
            return self._known(self._reals, vrs, "Real", math.nan)
        values = self._values
        return [values[reference] for reference in vrs]

    def get_integer(self, vrs: list[int]) -> list[int]:
        if self._stale:
            self._start()
        return [int(value) for value in self._known(self._integers, vrs, "Integer", 0)]

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return self._known(frozenset(), vrs, "Boolean", False)

    def get_string(self, vrs: list[int]) -> list[str]:
        return self._known(frozenset(), vrs, "String", "")

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        if self._running and self._real_inputs.issuperset(vrs):
            store = self._values
            for reference, value in zip(vrs, values):  # noqa: B905  PythonFMU makes both lists in one loop
                store[reference] = value
        else:
            self._set(self._reals, vrs, values)

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._set(self._integers, vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self._set(frozenset(), vrs, values)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        self._set(frozenset(), vrs, values)

    # -- FMU state: everything that a later step depends on, as JSON-able values

    def _get_fmu_state(self) -> dict[str, Any]:
        own = {name: getattr(self, name) for name in _SAVED}
        inner = None if self._state is None else list(flat(self._state))
        return {"guid": self.guid_built, "values": list(self._values), "state": inner, **own}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            if state["guid"] != self.guid_built:
                raise ValueError(f"it is of guid {state['guid']}")
            values = [v.kind(x) for v, x in zip(self._variables, state["values"], strict=True)]
            inner = None if state["state"] is None else packed(self.kernel.State, state["state"])
            own = {name: state[name] for name in _SAVED}
        except (KeyError, TypeError, ValueError) as failure:
            self._fault = f"FMU state is foreign or damaged ({failure}) -- expected one saved by this FMU -- reset it"
            self._tell(self._fault)
            return
        self._values, self._state = values, inner
        self._params = packed(self.kernel.Params, values[: self._n_parameters])
        for name, value in own.items():
            setattr(self, name, value)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            return Fmi2Slave._fmu_state_from_bytes(state)
        except ValueError:  # not JSON, or not UTF-8: refused, with a message, when it is set
            return {}

    # -- inside

    def _start(self) -> None:
        """Outputs from parameters and inputs as they are now; on failure a reason not to step, and NaN outputs."""
        self._stale = False
        inputs = self._inputs_type(*self._values[self._input_slice])
        try:
            wrong = _not_finite(inputs)
            if wrong:
                raise ValueError(f"input {wrong} at the start -- expected a finite number -- {MEND}")
            params = packed(self.kernel.Params, self._values[: self._n_parameters])
            check_bounds(self._parameters, params)
            check_conditions(self._conditions, params)
            self._state, outputs = self.kernel.start(params, inputs)
            self._params, self._not_started = params, ""
        except Exception as failure:
            self._not_started = f"initialisation failed: {failure}"
            self._tell(self._not_started)
            self._state = None
            outputs = [math.nan if v.kind is float else 0 for v in self._variables[self._output_slice]]
        self._values[self._output_slice] = outputs

    def _set(self, typed: frozenset[int], references: list[int], values: list[Any]) -> None:
        for reference, value in zip(references, values, strict=True):
            is_parameter = 0 <= reference < self._n_parameters
            if reference not in typed or not (is_parameter or reference in self._inputs):
                self._spoil(reference, f"set to {value!r} -- expected an input or parameter of this type -- {NEXT}")
            elif self._phase == TERMINATED:
                self._spoil(reference, f"set to {value!r} -- expected before the end -- reset the instance")
            elif is_parameter and self._running:
                self._spoil(reference, f"set to {value!r} -- it is fixed after initialisation -- reset the instance")
            else:
                self._values[reference] = value
                self._stale = not self._running

    def _known(self, typed: frozenset[int], references: list[int], kind: str, otherwise: Any) -> list[Any]:
        """Values with a substitute for unknown references: too short a list would crash PythonFMU's library."""
        for reference in references:
            if reference not in typed:
                self._spoil(reference, f"read as {kind} -- expected a variable of that type -- {NEXT}")
        return [self._values[reference] if reference in typed else otherwise for reference in references]

    def _misplace(self, call: str, expected: str) -> None:
        """A call that FMI does not allow here: PythonFMU has no other answer than OK, so the steps are refused."""
        message = f"{call} in an instance that is {self._phase} -- expected {expected} -- reset the instance"
        self._fault = self._fault or message
        self._tell(message)

    def _spoil(self, reference: int, what: str) -> None:
        known = 0 <= reference < len(self._variables)
        called = f"variable {self._variables[reference].name}" if known else f"value reference {reference}"
        self._fault = f"{called} {what}"
        self._tell(self._fault)

    def _continues(self, time: float, step: float) -> bool:
        return abs(time - self._time) <= TIME_TOLERANCE * step + ROUNDING * abs(time)  # False for NaN

    def _wrong_time(self, time: float, step: float) -> str:
        if not 0.0 < step < INFINITE:
            return f"step size {step!r} s at t = {time!r} s -- expected a positive finite number -- correct it"
        return f"step from t = {time!r} s -- expected t = {self._time!r} s -- go on where the last step ended"

    def _tell_slack(self, tension: float) -> None:
        self._watches_slack = False
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
        text = f"{type(self).__name__}: {message}".replace("%", "percent")  # hosts take it for a printf format
        category = _CATEGORIES[status]
        if self._host_log.is_missing():
            return
        if self._host_log.is_shut():
            if status is not Fmi2Status.ok:
                self._host_log.tell(status, category, text)
            return
        if not self.log_queue:
            for passed in self._passed:
                give_back(passed)
            self._passed.clear()
        self._passed.append(text)
        self.log(text, status, category)


_CATEGORIES = {
    Fmi2Status.ok: "logAll",
    Fmi2Status.warning: "logStatusWarning",
    Fmi2Status.discard: "logStatusDiscard",
    Fmi2Status.error: "logStatusError",
}
"""One text each: PythonFMU makes a new one for each message and its library keeps it."""


def _not_finite(values: Any) -> str:
    for name, value in zip(values._fields, values, strict=True):
        if not isfinite(value):
            return f"{name} = {value!r}"
    return ""
