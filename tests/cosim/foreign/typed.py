"""Integer, Boolean and String ports: counts up, inverts, greets, counts letters."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Integer, String


class Typed(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.n, self.flag, self.text = 0, False, "a"
        self.n_next, self.inverse, self.greeting, self.letters = 0, True, "", 0
        for kind, name, start in ((Integer, "n", 0), (Boolean, "flag", False), (String, "text", "a")):
            self.register_variable(kind(name, causality=Fmi2Causality.input, start=start))
        for kind, name in ((Integer, "n_next"), (Boolean, "inverse"), (String, "greeting"), (Integer, "letters")):
            self.register_variable(kind(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.n_next, self.inverse, self.greeting = self.n + 1, not self.flag, self.text + "!"
        self.letters = len(self.text)
        return True

    def to_xml(self, model_options=None):
        root = super().to_xml(model_options or {})
        root.find("CoSimulation").set("canHandleVariableCommunicationStepSize", "false")
        for unknown in root.iterfind("ModelStructure/Outputs/Unknown"):
            unknown.set("dependencies", "")
        return root
