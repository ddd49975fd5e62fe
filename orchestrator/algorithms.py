"""How the components of a loop agree: one after the other, all together, or by iteration.

A group of components that feed each other is stepped by one of the algorithms

    multirate   the earliest first, of several the one with the largest step, then the one declared first; what is not
                there yet is extrapolated, and what is there is interpolated
    sequential  the same, but of several at one time in the order in which the fewest inputs have to be extrapolated
                (Gauss-Seidel)
    parallel    all that are due at one time get their inputs before any of them steps (Jacobi)
    iterative   the whole group over the window of its largest step again and again, with the states restored in between,
                until the inputs are those that the outputs give

The first three are loops of `tlpsim.orchestrator.kernel`. The iteration is for the inputs u of all steps of a window,
u = G(u) with G the steps and the links, from what the first algorithm gives, by (Küttler and Wall 2008; Degroote, Bathe
and Vierendeels 2009)

    none          u <- u + r,   r = G(u) - u                                                           (1)
    aitken        u <- u + w r,   w <- -w r_0 . (r - r_0) / |r - r_0|²                                  (2)
    quasi_newton  u <- u + r - (W + V) c,   c the least squares solution of V c = r                     (3)

with the differences V of the residuals r and W of the inputs u of all iterations of the window, each input relative to
its own size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import StepError, WiringError
from tlpsim.orchestrator import kernel
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.system import Iteration, System, groups

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import Master

FloatArray = NDArray[np.float64]

_CODES = {
    "multirate": kernel.SEQUENTIAL,
    "sequential": kernel.SEQUENTIAL,
    "parallel": kernel.PARALLEL,
    "iterative": kernel.ITERATIVE,
}
_SMALLEST_SIZE = 1e-30
_FIRST_RELAXATION = 1.0
_DEPENDENT = 1e-8  # singular value of V, of columns of length 1, that eq. (3) leaves out


def algorithm_codes(system: System) -> list[int]:
    """Algorithm of each group for the compiled loop, in the order of `tlpsim.orchestrator.system.groups`.

    Raises
    ------
    WiringError
        If a group is to be iterated and a component cannot save its state, or the largest step of the group is not a
        whole number of each of the others.
    """
    codes = []
    for group in groups(system):
        components = [system.components[index] for index in group]
        code = _CODES[system.algorithm] if len(group) > 1 else kernel.SEQUENTIAL
        codes.append(code)
        if code != kernel.ITERATIVE:
            continue
        for component in components:
            if not component.instance.can_get_and_set_state:
                raise WiringError(
                    f"component '{component.name}' is in a loop that is to be iterated, but cannot save its state; "
                    "choose the algorithm multirate, sequential or parallel"
                )
        window = max(component.step for component in components)
        for component in components:
            if window % component.step:
                raise WiringError(
                    f"component '{component.name}' has a step of {to_seconds(component.step):g} s in a loop that is to be "
                    f"iterated, whose largest step, {to_seconds(window):g} s, is not a whole number of it"
                )
    return codes


def order_of_ties(system: System, group: Sequence[int]) -> list[int]:
    """Order in which the components of a group step at one time.

    For the algorithm sequential the fewest of the connections go against it, as far as a greedy choice finds (Eades, Lin
    and Smyth 1993): again and again the component goes next that has most outgoing over incoming connections left.
    """
    declared = sorted(group, key=lambda member: (-system.components[member].step, member))
    if system.algorithm != "sequential":
        return declared
    names = {system.components[member].name: member for member in group}
    edges = {
        (names[each.source], names[each.target])
        for each in system.connections
        if each.source in names and each.target in names and each.source != each.target
    }
    result: list[int] = []
    left = list(declared)
    while left:
        inside = [edge for edge in edges if edge[0] in left and edge[1] in left]
        surplus = {each: sum(a == each for a, _ in inside) - sum(b == each for _, b in inside) for each in left}
        fed = {each: sum(b == each for _, b in inside) for each in left}
        chosen = min(left, key=lambda each: (fed[each] > 0, -surplus[each], left.index(each)))
        result.append(chosen)
        left.remove(chosen)
    return result


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


def iterate(master: Master, group: int, rule: Iteration) -> int:
    """Step a group over one window; returns the number of iterations.

    Raises
    ------
    StepError
        If the iteration does not converge.
    """
    layout = master.layout
    first, last = (int(place) for place in layout.groups[group, :2])
    members = [int(member) for member in layout.members[first:last]]
    window = int(layout.units[members, kernel.STEP].max())
    counts = [window // int(layout.units[member, kernel.STEP]) for member in members]
    begin = int(layout.units[members[0], kernel.TIME])
    master.prepare_window(members, counts)
    clock = layout.units[:, [kernel.TIME, kernel.NEWEST, kernel.STEPS]].copy()
    instances = [master.instances[member] for member in members]
    states = [instance.get_state() for instance in instances]
    try:
        used = _pass(master, members, counts, None)
        accelerate = _ACCELERATIONS[rule.acceleration]()
        inputs: list[FloatArray] = []
        residuals: list[FloatArray] = []
        size = np.maximum(np.abs(used), _SMALLEST_SIZE)
        for iteration in range(1, rule.most + 1):
            given = _given(master, members, counts, begin)
            size = np.maximum(size, np.abs(given))
            if np.all(np.abs(given - used) <= rule.tolerance * size):
                return iteration
            inputs.append(used / size)
            residuals.append((given - used) / size)
            used = size * accelerate(inputs, residuals)
            for member, instance, state in zip(members, instances, states, strict=True):
                instance.set_state(state)
                layout.units[member, [kernel.TIME, kernel.NEWEST, kernel.STEPS]] = clock[member]
            _pass(master, members, counts, used)
    finally:
        for instance, state in zip(instances, states, strict=True):
            instance.free_state(state)
    names = ", ".join(instance.name for instance in instances)
    raise StepError(
        f"the loop of {names} did not converge in {rule.most} iterations at t = {to_seconds(begin):.9g} s: its inputs "
        f"still change by {np.max(np.abs(residuals[-1])):.3g} of their size, and {rule.tolerance:g} is asked for; reduce "
        "the steps, allow more iterations, or choose the acceleration quasi_newton"
    )


def _pass(master: Master, members: Sequence[int], counts: Sequence[int], inputs: FloatArray | None) -> FloatArray:
    """Step all members over the window, and return the inputs that they had, component by component, step by step."""
    result = []
    position = 0
    for member, count in zip(members, counts, strict=True):
        width = len(master.layout.values(member))
        for _ in range(count):
            master.step_alone(member, None if inputs is None else inputs[position : position + width])
            result.append(master.layout.values(member).copy())
            position += width
    return np.concatenate(result)


def _given(master: Master, members: Sequence[int], counts: Sequence[int], begin: int) -> FloatArray:
    """The inputs of the window that the outputs give, in the same order."""
    result = []
    for member, count in zip(members, counts, strict=True):
        step, offset = (int(master.layout.units[member, column]) for column in (kernel.STEP, kernel.OFFSET))
        for k in range(count):
            master.fill(member, begin + k * step + offset)
            result.append(master.layout.values(member).copy())
    return np.concatenate(result)
