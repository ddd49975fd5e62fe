"""An FMU that a reader of the documents might have: y' = u - y (pythonfmu)."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Lag(Fmi2Slave):
    author = "a reader"
    description = "a lag of the first order"

    def __init__(self, **kwargs):  # type: ignore[no-untyped-def]
        super().__init__(**kwargs)
        self.u = 0.0
        self.y = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):  # type: ignore[no-untyped-def]
        self.y += step_size * (self.u - self.y)
        return True
