"""Says which process it is in, and writes into a file how it ends."""

import os
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String


class Process(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.path, self.pid = "", float(os.getpid())
        self.register_variable(
            String("path", start="", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        )
        self.register_variable(Real("pid", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        return True

    def terminate(self):
        Path(self.path).write_text(f"terminated in {os.getpid()}")
