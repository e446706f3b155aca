"""Normal noise of a seed: y is drawn anew in each step."""

import random

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Noise(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.seed, self.y, self.source = 0, 0.0, random.Random()
        self.register_variable(
            Integer("seed", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=0)
        )
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.source = random.Random(self.seed)

    def do_step(self, current_time, step_size):
        self.y = self.source.gauss(0.0, 1.0)
        return True
