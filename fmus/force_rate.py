"""Time derivatives of the forces of the wind and the wave FMU, for masters that interpolate by them.

    dF/dt = (F(t + h, x + h v, v + h a) - F(t, x, v)) / h                                            (1)

with the platform's velocity v at the end of the communication step, the mean acceleration a over the step, and
h = 0.1 ms: an error of ω h/2 at the frequency ω, 3e-5 at 0.1 Hz. The acceleration matters for drag only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tlpsim.fmus.component import Variable, six

FloatArray = NDArray[np.float64]

RATE_STEP = 1e-4
"""s, h of eq. (1)."""


def force_rates(depends_on: tuple[str, ...]) -> tuple[Variable, ...]:
    """Variables `force_rate.*`, the time derivatives of `force.*`."""
    return six(
        "force_rate", "local", "rate of change of force", ("N/s", "N.m/s"), derivative_of="force", depends_on=depends_on
    )


class Motion:
    """Velocity at the last communication point, and the mean acceleration since then.

    Attributes
    ----------
    velocity, acceleration
        Shape (6,), m/s, rad/s and per second.
    """

    def __init__(self) -> None:
        self.velocity: FloatArray = np.zeros(6)
        self.acceleration: FloatArray = np.zeros(6)

    def begin(self, velocity: FloatArray) -> None:
        """Take the velocity at the start."""
        self.velocity[:], self.acceleration[:] = velocity, 0.0

    def advance(self, velocity: FloatArray, step: float) -> None:
        """Take the velocity after a step."""
        self.acceleration[:] = (velocity - self.velocity) / step
        self.velocity[:] = velocity

    def snapshot(self) -> dict[str, FloatArray]:
        """Copies, for the state of an FMU."""
        return {"motion": np.array([self.velocity, self.acceleration])}

    def restore(self, arrays: dict[str, FloatArray]) -> None:
        """Take back what `snapshot` gave."""
        self.velocity[:], self.acceleration[:] = arrays["motion"]
