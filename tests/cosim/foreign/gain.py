"""y = k u + k_2 u_2 at once: direct feed-through, in volts from degrees; states its dependencies."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Gain(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.u_2, self.k = 0.0, 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("u_2", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: self.k * self.u + self.u_2))
        self.register_variable(
            Real("k", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=1.0)
        )

    def do_step(self, current_time, step_size):
        return True

    def to_xml(self, model_options=None):
        root = super().to_xml(model_options or {})
        indices = {v.get("name"): str(k) for k, v in enumerate(root.iterfind("ModelVariables/ScalarVariable"), start=1)}
        for unknown in root.iterfind("ModelStructure/Outputs/Unknown"):
            unknown.set("dependencies", f"{indices['u']} {indices['u_2']}")
        return root
