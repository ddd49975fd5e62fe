"""How the components of a loop agree: one after the other, all together, or by repeated steps.

A group of components that feed each other is stepped by one of the algorithms

    multirate   the earliest first, of several the one with the largest step, then the one declared first; what is not
                there yet is extrapolated, and what is there is interpolated
    sequential  the same, but of several at one time in the order in which the fewest inputs have to be extrapolated
                (Gauss-Seidel)
    parallel    all that are due at one time get their inputs before any of them steps (Jacobi)
    iterative   the whole group over the window of its largest step again and again, with the states restored in
                between, until the inputs are those that the outputs give
    adaptive    as sequential, over as many steps at a time as the inputs can be continued; repeated over fewer where
                they turn out to be different

The first three are loops of `tlpsim.orchestrator.loop.kernel`; the others, and parallel steps in threads, are made by
`tlpsim.orchestrator.loop.iteration` and `tlpsim.orchestrator.loop.windows`.
"""

from __future__ import annotations

from collections.abc import Sequence

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.loop import kernel
from tlpsim.orchestrator.system import System, groups

_TAKING_BACK = ("iterative", "adaptive")


def algorithm_codes(system: System) -> list[int]:
    """Algorithm of each group for the compiled loop, in the order of `tlpsim.orchestrator.system.groups`.

    Raises
    ------
    WiringError
        If steps of a group have to be taken back and a component cannot save its state, or its steps do not fit: the
        largest a whole number of each of the others for iterative, all equal for adaptive.
    """
    codes = []
    for group in groups(system):
        code = kernel.SEQUENTIAL
        if len(group) > 1 and system.algorithm in _TAKING_BACK:
            _check_windows(system, group)
            code = kernel.CALLER
        elif len(group) > 1 and system.algorithm == "parallel":
            code = kernel.CALLER if system.threads > 1 else kernel.PARALLEL
        codes.append(code)
    return codes


def _check_windows(system: System, group: Sequence[int]) -> None:
    components = [system.components[index] for index in group]
    window = max(component.step for component in components)
    for component in components:
        where = f"component '{component.name}' is in a loop of the algorithm {system.algorithm}, but"
        if not component.instance.can_get_and_set_state:
            raise WiringError(f"{where} cannot save its state; choose multirate, sequential or parallel")
        fits = window % component.step == 0 if system.algorithm == "iterative" else window == component.step
        if not fits:
            rule = "not a whole number of it" if system.algorithm == "iterative" else "another"
            raise WiringError(
                f"{where} its step of {to_seconds(component.step):g} s does not fit: the largest in the loop, "
                f"{to_seconds(window):g} s, is {rule}"
            )


def order_of_ties(system: System, group: Sequence[int]) -> list[int]:
    """Order in which the components of a group step at one time.

    For the algorithms sequential and adaptive the fewest of the connections go against it, as far as a greedy choice
    finds (Eades, Lin and Smyth 1993): again and again the component goes next that has most outgoing over incoming
    connections left.
    """
    declared = sorted(group, key=lambda member: (-system.components[member].step, member))
    if system.algorithm not in ("sequential", "adaptive"):
        return declared
    names = {system.components[member].name: member for member in group}
    edges = {
        (names[each.source], names[each.target])
        for each in system.connections
        if each.source in names and each.target in names and each.source != each.target
    }
    into: dict[int, set[int]] = {member: set() for member in declared}
    out: dict[int, set[int]] = {member: set() for member in declared}
    for start, end in edges:
        into[end].add(start)
        out[start].add(end)
    result: list[int] = []
    left = dict.fromkeys(declared)
    while left:
        chosen = min(left, key=lambda each: (len(into[each]) > 0, len(into[each]) - len(out[each])))
        result.append(chosen)
        del left[chosen]
        for each in out[chosen]:
            into[each].discard(chosen)
        for each in into[chosen]:
            out[each].discard(chosen)
    return result
