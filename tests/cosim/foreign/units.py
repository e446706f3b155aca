"""A pass-through with units: angle in degrees to turns per second; it states no dependencies."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Units(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.angle, self.speed, self.angle_rad, self.temperature, self.kelvin = 0.0, 0.0, 0.0, 0.0, 0.0
        for name in ("angle", "speed", "kelvin"):
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        for name in ("angle_rad", "temperature", "angle_seen", "speed_seen", "kelvin_seen"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.angle_seen, self.speed_seen, self.kelvin_seen = 0.0, 0.0, 0.0

    def exit_initialization_mode(self):
        self.do_step(0.0, 0.0)

    def do_step(self, current_time, step_size):
        self.angle_rad, self.temperature = 0.7 + current_time, 20.5
        self.angle_seen, self.speed_seen, self.kelvin_seen = self.angle, self.speed, self.kelvin
        return True

    def to_xml(self, model_options=None):
        root = super().to_xml(model_options or {})
        units = {"angle": "deg", "speed": "rpm", "angle_rad": "rad", "temperature": "degC", "kelvin": "K"}
        for variable in root.iterfind("ModelVariables/ScalarVariable"):
            if variable.get("name") in units:
                variable.find("Real").set("unit", units[variable.get("name")])
        return root
