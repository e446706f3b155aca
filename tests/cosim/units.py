"""Units in plain Python that stand in for FMUs: the buffers and calls that the step of a system uses."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any


class Unit:
    """Outputs of a function of inputs, state and time; a step adds its rate times the step to the state.

    Attributes
    ----------
    calls : list of str
        What was asked of it, in order.
    states : int
        States that were saved and not yet freed.
    """

    def __init__(
        self, name: str, inputs: Sequence[str] = (), outputs: Sequence[str] = ("y",), *,
        gives: Callable[..., Sequence[float]] = lambda x, u, t: [x], rate: Callable[..., float] = lambda x, u, t: 0.0,
        state: float = 0.0, kind: Any = ctypes.c_double, saves: bool = True,
    ) -> None:  # fmt: skip
        self.name, self.state, self._gives, self._rate = name, state, gives, rate
        self.inputs = [self._block(inputs, ctypes.c_double)] if inputs else []
        self.outputs = [self._block(outputs, kind)]
        self.do_step = SimpleNamespace(goes_back=False)
        self.description = SimpleNamespace(
            model=SimpleNamespace(coSimulation=SimpleNamespace(canGetAndSetFMUstate=saves)),
            path=SimpleNamespace(name=f"{name}.fmu"),
        )
        self.ended_at: float | None = None
        self.lost = False
        self.calls: list[str] = []
        self.states = 0

    def _block(self, names: Sequence[str], kind: Any) -> Any:
        real = kind is ctypes.c_double
        return SimpleNamespace(names=tuple(names), values=(kind * len(names))(), real=real)

    def port(self, name: str, side: str) -> tuple[Any, int]:
        block = next(b for b in (self.inputs if side == "inputs" else self.outputs) if name in b.names)
        return block.values, block.names.index(name)

    def _given(self) -> list[float]:
        return [v for block in self.inputs for v in block.values]

    def set_inputs(self, time: float) -> None:
        self.calls.append("set")

    def step(self, time: float, step: float) -> None:
        self.calls.append("step")
        self.state += step * self._rate(self.state, self._given(), time)

    def get_outputs(self, time: float) -> None:
        self.calls.append("get")
        self.outputs[0].values[:] = self._gives(self.state, self._given(), time)

    def save_state(self) -> float:
        self.states += 1
        return self.state

    def restore_state(self, state: float) -> None:
        self.calls.append("restore")
        self.state = state

    def free_state(self, state: float) -> None:
        self.states -= 1
