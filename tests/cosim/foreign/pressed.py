"""A Ctrl-C that arrives while one of its functions runs, named by the variable PRESSED of the environment."""

import os
import signal

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Pressed(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y = 0.0, 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self._at("__init__")

    def _at(self, function):
        if os.environ.get("PRESSED") == function:
            os.kill(os.getpid(), signal.SIGINT)
            sum(range(10000))  # an interpreter looks for signals between two instructions

    def setup_experiment(self, *times):
        self._at("setup_experiment")

    def exit_initialization_mode(self):
        self._at("exit_initialization_mode")

    def do_step(self, current_time, step_size):
        self.y = 2.0 * self.u
        return True

    def terminate(self):
        self._at("terminate")
