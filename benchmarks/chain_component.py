"""A Python FMU for benchmarks: six inputs, of which its first six outputs of twelve are the sums over the steps."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from tlpsim.fmus.component import Component, Variable  # noqa: E402


class ChainComponent(Component):
    """As little as a component can do, so that what is timed is its interface."""

    table = (
        *(Variable(name=f"u[{k}]", causality="input", description=f"summand {k}") for k in range(1, 7)),
        *(Variable(name=f"y[{k}]", causality="output", description=f"sum {k}") for k in range(1, 13)),
    )

    def prepare(self) -> None:
        self.summands, self.sums = self.view("u["), self.view("y[")[:6]

    def start(self, time: float) -> None:
        pass

    def advance(self, time: float, step: float) -> None:
        self.sums += self.summands
