"""Iteration of a group over a window until its inputs are those that its outputs give.

The inputs u of all steps of a window solve u = G(u), with G the steps and the links. From what stepping once gives, by
(Küttler and Wall 2008; Degroote, Bathe and Vierendeels 2009)

    none          u <- u + r,   r = G(u) - u                                                           (1)
    aitken        u <- u + w r,   w <- -w r_0 . (r - r_0) / |r - r_0|²                                  (2)
    quasi_newton  u <- u + r - (W + V) c,   c the least squares solution of V c = r                     (3)

with the differences V of the residuals r and W of the inputs u of the newest iterations of the window, each input
relative to its own size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import StepError
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.loop import kernel
from tlpsim.orchestrator.loop.windows import Window, members_of, window

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import Master

FloatArray = NDArray[np.float64]

_SMALLEST_SIZE = 1e-30
_FIRST_RELAXATION = 1.0
_DEPENDENT = 1e-8  # singular value of V, of columns of length 1, that eq. (3) leaves out


class Acceleration(Protocol):
    """Next inputs from the inputs and residuals so far, eqs. (1) to (3), all relative to the sizes of the inputs."""

    def __call__(self, inputs: Sequence[FloatArray], residuals: Sequence[FloatArray]) -> FloatArray:
        """Next inputs, shape (n,), of those and their residuals so far, oldest first."""


class _Aitken:
    def __init__(self) -> None:
        self._relaxation = _FIRST_RELAXATION

    def __call__(self, inputs: Sequence[FloatArray], residuals: Sequence[FloatArray]) -> FloatArray:
        if len(residuals) > 1:
            change = residuals[-1] - residuals[-2]
            square = float(change @ change)
            if square > 0.0:
                self._relaxation *= -float(residuals[-2] @ change) / square
        return inputs[-1] + self._relaxation * residuals[-1]


def _quasi_newton(inputs: Sequence[FloatArray], residuals: Sequence[FloatArray]) -> FloatArray:
    if len(residuals) == 1:
        return inputs[-1] + residuals[-1]
    # As many of the newest differences as there are unknowns, each by its own size.
    latest = slice(-min(len(residuals) - 1, len(residuals[0])), None)
    changes, steps = (np.diff(np.array(each), axis=0)[latest].T for each in (residuals, inputs))
    size = np.maximum(np.linalg.norm(changes, axis=0), _SMALLEST_SIZE)
    solution, *_ = np.linalg.lstsq(changes / size, residuals[-1], rcond=_DEPENDENT)
    return np.asarray(inputs[-1] + residuals[-1] - (steps + changes) @ (solution / size))


def _plain(inputs: Sequence[FloatArray], residuals: Sequence[FloatArray]) -> FloatArray:
    return inputs[-1] + residuals[-1]


_ACCELERATIONS: dict[str, Callable[[], Acceleration]] = {
    "none": lambda: _plain,
    "aitken": _Aitken,
    "quasi_newton": lambda: _quasi_newton,
}


def iterate(master: Master, group: int) -> None:
    """Step a group over one window.

    Raises
    ------
    StepError
        If the iteration does not converge.
    """
    layout, rule = master.layout, master.system.iteration
    members = members_of(master, group)
    longest = int(layout.units[list(members), kernel.STEP].max())
    counts = [longest // int(layout.units[member, kernel.STEP]) for member in members]
    with window(master, members, counts) as whole:
        used = _pass(whole, None)
        accelerate = _ACCELERATIONS[rule.acceleration]()
        inputs: list[FloatArray] = []
        residuals: list[FloatArray] = []
        size = np.maximum(np.abs(used), _SMALLEST_SIZE)
        for iteration in range(1, rule.most + 1):
            given = _given(whole)
            size = np.maximum(size, np.abs(given))
            if np.all(np.abs(given - used) <= rule.tolerance * size):
                master.tally(windows=1, steps=iteration)
                return
            inputs.append(used / size)
            residuals.append((given - used) / size)
            used = size * accelerate(inputs, residuals)
            whole.restore()
            _pass(whole, used)
    names = ", ".join(master.instances[member].name for member in members)
    raise StepError(
        f"the loop of {names} did not converge in {rule.most} iterations at t = {to_seconds(whole.begin):.9g} s: its "
        f"inputs still change by {np.max(np.abs(residuals[-1])):.3g} of their size, and {rule.tolerance:g} is asked "
        "for; reduce the steps, allow more iterations, or choose the acceleration quasi_newton"
    )


def _pass(whole: Window, inputs: FloatArray | None) -> FloatArray:
    """Step all members over the window, and return the inputs that they had, component by component, step by step."""
    result = []
    position = 0
    layout = whole.master.layout
    for member, count in zip(whole.members, whole.counts, strict=True):
        width = len(layout.values(member))
        for _ in range(count):
            whole.master.step_alone(member, None if inputs is None else inputs[position : position + width])
            result.append(layout.values(member).copy())
            position += width
    return np.concatenate(result)


def _given(whole: Window) -> FloatArray:
    """The inputs of the window that the outputs give, in the same order."""
    result = []
    layout = whole.master.layout
    for member, count in zip(whole.members, whole.counts, strict=True):
        step, offset = (int(layout.units[member, column]) for column in (kernel.STEP, kernel.OFFSET))
        for k in range(count):
            whole.master.fill(member, whole.begin + k * step + offset)
            result.append(layout.values(member).copy())
    return np.concatenate(result)
