"""Directed graphs: strongly connected components, a cycle within one, and the algebraic loops of a system."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tlpsim.orchestrator.system import System


def strong_components(successors: Sequence[Sequence[int]]) -> list[list[int]]:
    """Strongly connected components of a directed graph (R. Tarjan, SIAM Journal on Computing 1, 1972).

    Parameters
    ----------
    successors
        For each node, the nodes that its edges lead to.

    Returns
    -------
    The components, each before all those from which it can be reached; nodes in ascending order.
    """
    order: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    waiting: set[int] = set()
    result: list[list[int]] = []
    for root in range(len(successors)):
        if root in order:
            continue
        path = [(root, iter(successors[root]))]
        while path:
            node, edges = path[-1]
            if node not in order:
                order[node] = low[node] = len(order)
                stack.append(node)
                waiting.add(node)
            for successor in edges:
                if successor not in order:
                    path.append((successor, iter(successors[successor])))
                    break
                if successor in waiting:
                    low[node] = min(low[node], low[successor])
            else:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == order[node]:
                    position = stack.index(node)
                    result.append(sorted(stack[position:]))
                    waiting.difference_update(stack[position:])
                    del stack[position:]
    return result


def shortest_cycle(successors: Sequence[Sequence[int]], within: Collection[int]) -> list[int]:
    """Shortest cycle through the first node of a strongly connected component; empty where there is none.

    Parameters
    ----------
    successors
        For each node, the nodes that its edges lead to.
    within
        Nodes of the component.

    Returns
    -------
    Nodes of the cycle from that node on, each once.
    """
    allowed = set(within)
    start = next(iter(within))
    came_from: dict[int, int] = {}
    queue = deque([start])
    while queue:
        node = queue.popleft()
        for successor in successors[node]:
            if successor == start:
                cycle = [node]
                while cycle[-1] != start:
                    cycle.append(came_from[cycle[-1]])
                return cycle[::-1]
            if successor in allowed and successor not in came_from:
                came_from[successor] = node
                queue.append(successor)
    return []


def algebraic_loops(system: System) -> list[tuple[str, ...]]:
    """Return the cycles of outputs that depend directly on each other, through inputs of the same instant.

    Parameters
    ----------
    system
        Of scalars, see `expanded`.

    Returns
    -------
    One cycle for each set of variables that depend on each other: the shortest through its first variable, as names
    such as ``a.y``, ``b.u``, ``b.y``, ``a.u``.
    """
    ends = [((item.source, item.source_variable), (item.target, item.target_variable)) for item in system.connections]
    number = {end: index for index, end in enumerate(dict.fromkeys(end for pair in ends for end in pair))}
    successors: list[list[int]] = [[] for _ in number]
    inputs: dict[str, list[str]] = {}
    for source, target in ends:
        successors[number[source]].append(number[target])
        inputs.setdefault(target[0], []).append(target[1])
    by_name = {component.name: component for component in system.components}
    for source in dict.fromkeys(source for source, _ in ends):
        name, output = source
        fed = inputs.get(name, [])
        direct = by_name[name].instance.variables[output].depends_on
        for variable in fed if direct is None else [each for each in direct if (name, each) in number]:
            successors[number[name, variable]].append(number[source])
    names = [f"{name}.{variable}" for name, variable in number]
    cycles = sorted(shortest_cycle(successors, nodes) for nodes in strong_components(successors))
    return [tuple(names[node] for node in cycle) for cycle in cycles if cycle]
