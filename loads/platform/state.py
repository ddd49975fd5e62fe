"""The state of the platform's motion, with what the fluid's memory keeps of the past."""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.platform.memory import resampled


@dataclass(slots=True, kw_only=True, eq=False)
class PlatformState:
    """State of the motion; `advance` writes into its arrays.

    Attributes
    ----------
    position, velocity, acceleration : (6,) m, rad and their time derivatives.
    force : (6,) N, N·m, external load at the present time.
    tensions, bottom_tensions : (n,) N, at the upper and lower ends of the tendons.
    intact : (n,) bool, false for a lost tendon.
    history : (rows, 6) m/s, rad/s, ring of velocities at the ends of past sub-steps, in axes that turn with yaw.
    cursor : (1,) int, row of the newest of them.
    filters : (m,) states of the memory's recursive filters.
    memory_step : (1,) s, sub-step of the ring; zero before the first step.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    force: NDArray[np.float64]
    tensions: NDArray[np.float64]
    bottom_tensions: NDArray[np.float64]
    intact: NDArray[np.bool_]
    history: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 6)))
    cursor: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    filters: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    memory_step: NDArray[np.float64] = field(default_factory=lambda: np.zeros(1))

    def copy(self) -> "PlatformState":
        """Exact snapshot that shares nothing with this state."""
        return PlatformState(**{each.name: getattr(self, each.name).copy() for each in fields(self)})


def fit_history(state: PlatformState, step: float, rows: int, filters: int) -> None:
    """Give the memory of a state its size, and bring its velocities to the sub-step; at most once a run as a rule."""
    if state.memory_step[0] != step or len(state.history) < rows:
        state.history = resampled(state.history, int(state.cursor[0]), float(state.memory_step[0]), step, rows)
        state.cursor[0] = rows - 1
        state.memory_step[0] = step
    if len(state.filters) != filters:
        state.filters = np.zeros(filters)
