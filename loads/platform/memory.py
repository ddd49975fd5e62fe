"""Fluid memory as the integrator of the platform's motion takes it: filters of the velocity at a fixed step h.

    F_n = -D v_n - sum_{k=1..N} W_k v_{n-k} - C (Z z_{n-1} + G v_{n-1})                                   (1)
    z_n = Z z_{n-1} + G (v_{n-1} + v_n)                                                                   (2)

The taps W_k are a finite convolution, the states z a recursive filter; either may be missing. D takes what acts at
once. How they come from radiation damping is in `tlpsim.loads.hydro.radiation`.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiscreteMemory:
    """Filters of eqs. (1) and (2) for one step.

    Attributes
    ----------
    direct : (6, 6) D, N·s/m, N·s, N·m·s.
    pairs : (p, 2) int, force and motion of each column of `taps`.
    taps : (N, p), W_1 ... W_N, of the same units as D.
    transition, drive, output : (m, m) Z, (m, 6) G and (6, m) C.
    extent : (m, 2) int, first and one past the last column of each row of Z that is not zero.
    """

    direct: FloatArray
    pairs: NDArray[np.int64]
    taps: FloatArray
    transition: FloatArray
    drive: FloatArray
    output: FloatArray
    extent: NDArray[np.int64]

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """What the integration kernel reads."""
        return self.direct, self.pairs, self.taps, self.transition, self.drive, self.output, self.extent


def convolution(direct: FloatArray, pairs: NDArray[np.int64], taps: FloatArray) -> DiscreteMemory:
    """Memory of taps alone; arguments as the attributes of `DiscreteMemory`."""
    return DiscreteMemory(
        direct=direct,
        pairs=pairs,
        taps=np.ascontiguousarray(taps),
        transition=np.zeros((0, 0)),
        drive=np.zeros((0, 6)),
        output=np.zeros((6, 0)),
        extent=np.zeros((0, 2), dtype=np.int64),
    )


def recursion(direct: FloatArray, transition: FloatArray, drive: FloatArray, output: FloatArray) -> DiscreteMemory:
    """Memory of states alone; arguments as the attributes of `DiscreteMemory`."""
    filled = [np.flatnonzero(row) for row in transition]
    return DiscreteMemory(
        direct=direct,
        pairs=np.zeros((0, 2), dtype=np.int64),
        taps=np.zeros((0, 0)),
        transition=np.ascontiguousarray(transition),
        drive=np.ascontiguousarray(drive),
        output=np.ascontiguousarray(output),
        extent=np.array([(row[0], row[-1] + 1) if len(row) else (0, 0) for row in filled], dtype=np.int64),
    )


class Memory(Protocol):
    """A linear force of the fluid on the history of the velocity."""

    @property
    def longest_step(self) -> float:
        """Longest step in s at which the filters are accurate."""

    def discrete(self, step: float) -> DiscreteMemory:
        """The filters at a step in s."""


_NOTHING = convolution(np.zeros((6, 6)), np.zeros((0, 2), dtype=np.int64), np.zeros((0, 0)))


class NoMemory:
    """No force: added mass does not depend on frequency and nothing is radiated."""

    @property
    def longest_step(self) -> float:
        """Infinite."""
        return np.inf

    def discrete(self, step: float) -> DiscreteMemory:
        """Filters of no length."""
        return _NOTHING


def resampled(history: FloatArray, cursor: int, old: float, new: float, length: int) -> FloatArray:
    """A ring of velocities at another step, newest in its last row; linear in between and zero before its beginning.

    Parameters
    ----------
    history : (n, 6), ring at the step `old` (s), whose newest entry stands in row `cursor`.
    length : rows of the ring at the step `new` (s).
    """
    result = np.zeros((length, 6))
    if len(history) and old > 0.0:
        ordered = np.roll(history, -1 - cursor, axis=0)[::-1]
        age = new * np.arange(length)
        for column in range(6):
            result[:, column] = np.interp(age, old * np.arange(len(ordered)), ordered[:, column], right=0.0)
    return np.ascontiguousarray(result[::-1])
