"""x' = u by explicit Euler; the output is a state and says so."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Integrator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.x, self.x_0 = 0.0, 0.0, 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(
            Real("x_0", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=0.0)
        )

    def exit_initialization_mode(self):
        self.x = self.x_0

    def do_step(self, current_time, step_size):
        self.x += step_size * self.u
        return True

    def to_xml(self, model_options=None):
        root = super().to_xml(model_options or {})
        for unknown in root.iterfind("ModelStructure/Outputs/Unknown"):
            unknown.set("dependencies", "")
        return root
