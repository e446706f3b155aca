"""Counts its steps; from t_fail on it discards (mode 1), raises (2), gives NaN (3) or sends Ctrl-C.

Ctrl-C goes to itself (4) or to who started its process (5).
"""

import os
import signal

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.enums import Fmi2Status


class Failing(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.mode, self.t_fail, self.count = 0, 0.5, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Integer("mode", start=0, **fixed))
        self.register_variable(Real("t_fail", start=0.5, **fixed))
        self.register_variable(Real("count", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if current_time >= self.t_fail - 1e-9:
            if self.mode == 1:
                self.log(f"the belt slipped at t = {current_time:.3f}", Fmi2Status.discard)
                return False
            if self.mode == 2:
                raise RuntimeError("the belt tore")
            if self.mode == 3:
                self.count = float("nan")
                return True
            if self.mode in (4, 5):
                os.kill(os.getpid() if self.mode == 4 else os.getppid(), signal.SIGINT)
        self.count += 1.0
        return True
