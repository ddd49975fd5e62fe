"""How values pass between components of different rates: connections sorted into links.

A link is all connections between two components that are treated alike. The compiled loop
(`tlpsim.orchestrator.loop.kernel`) turns samples into inputs at any time by one small matrix product

    u(t) = sum_k w_k(s) x_k,      t = t_n + s H                                                     (1)

with the weights of an interpolation filter where the time lies between samples. Where the source declares the time
derivatives of a signal, the filters cubic and quintic take them instead of differences of samples: Hermite polynomials
through x and x', or x, x' and x'', at both ends of the segment, which need no later sample. Beyond the newest sample

    u(t) = x_n + tau x'_n + tau^2/2 x''_n,      t = t_n + tau                                       (2)

where the component declares derivatives, or else the polynomial through its newest samples. The filter anti_alias
(`tlpsim.loads.filters.decimation`) serves a target that is slower than the source, at all instants.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.filters.decimation import causal_decimation_filter, decimation_filter
from tlpsim.loads.filters.interpolation import CAUSAL, HERMITE, SYMMETRIC, InterpolationFilter
from tlpsim.orchestrator.system import (
    ANTI_ALIAS,
    Connection,
    System,
    bound_outputs,
    conversions,
    groups,
    used_derivatives,
)

FloatArray = NDArray[np.float64]

_EXTRAPOLATION_ORDERS = {"hold": 0, "linear": 1, "quadratic": 2, "derivatives": 1}
_REACH = max(item.before for item in (*CAUSAL.values(), *SYMMETRIC.values()))
_PADDING = max(_REACH, max(_EXTRAPOLATION_ORDERS.values()) + 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkPlan:
    """All connections between two components that are treated alike.

    Parameters
    ----------
    source, target
        Indices of the components.
    filter
        Interpolation filter: causal within a loop, symmetric elsewhere, and both by declared derivatives.
    looks_ahead
        Whether the source is stepped, before the target, until it has all samples that the filter needs.
    smooth
        Whether the filter is for instants that fall on samples too, and for those beyond the newest.
    order
        Degree of the polynomial that extrapolates where no derivatives do.
    columns
        Columns of the source's bound outputs: rows are the signals, then their first and second derivatives
        as far as they are used, shape (1 to 3, number of signals).
    interpolated, extrapolated
        Number of these rows of which eq. (1) and eq. (2) make use; 1 for none of the derivatives.
    scales
        Gain and offset of each signal on its way, shape (number of signals, 2).
    inputs
        Names of the target's inputs.
    """

    source: int
    target: int
    filter: InterpolationFilter
    looks_ahead: bool
    smooth: bool
    order: int
    columns: NDArray[np.intp]
    interpolated: int
    extrapolated: int
    scales: FloatArray
    inputs: tuple[str, ...]


def plan_links(system: System) -> list[LinkPlan]:
    """Sort the connections of a system into links, in the order of their first connections."""
    index = {component.name: number for number, component in enumerate(system.components)}
    group_of = {member: number for number, group in enumerate(groups(system)) for member in group}
    places = [{name: place for place, name in enumerate(names)} for names in bound_outputs(system)]
    collected: dict[tuple[Any, ...], list[tuple[Connection, tuple[str, ...], tuple[float, float]]]] = {}
    scales = conversions(system, system.connections)
    for each, (between, beyond), scale in zip(system.connections, used_derivatives(system), scales, strict=True):
        key = (each.source, each.target, each.filter, each.extrapolation, len(between), len(beyond))
        collected.setdefault(key, []).append((each, max(between, beyond, key=len), scale))
    plans = []
    for key, members in collected.items():
        first = members[0][0]
        source, target = index[first.source], index[first.target]
        in_loop = group_of[source] == group_of[target]
        interpolated, extrapolated = 1 + key[4], 1 + key[5]
        names = [(each.source_variable, *derivatives) for each, derivatives, _ in members]
        columns = np.array([[places[source][name] for name in row] for row in names], dtype=np.intp).T
        chosen = _filter(system, first, in_loop, interpolated - 1)
        plans.append(
            LinkPlan(
                source=source,
                target=target,
                filter=chosen,
                looks_ahead=not in_loop,
                smooth=first.filter == ANTI_ALIAS,
                order=_EXTRAPOLATION_ORDERS[first.extrapolation],
                columns=np.ascontiguousarray(columns),
                interpolated=interpolated,
                extrapolated=extrapolated,
                scales=np.array([scale for _, _, scale in members]),
                inputs=tuple(each.target_variable for each, _, _ in members),
            )
        )
    return plans


def _filter(system: System, connection: Connection, in_loop: bool, derivatives: int) -> InterpolationFilter:
    if connection.filter == ANTI_ALIAS:
        steps = {component.name: component.step for component in system.components}
        ratio = steps[connection.target] / steps[connection.source]
        return causal_decimation_filter(ratio) if in_loop else decimation_filter(ratio)
    if derivatives:
        return HERMITE[derivatives]
    return (CAUSAL if in_loop else SYMMETRIC)[connection.filter]


def padding(plans: Sequence[LinkPlan]) -> int:
    """Samples before the first one, which equal it, that filters and extrapolation may reach for."""
    return max((plan.filter.before for plan in plans), default=_PADDING) + _PADDING


def history_depths(system: System, plans: Sequence[LinkPlan]) -> list[int]:
    """Bound the number of samples that each component's history must keep.

    The component with the earliest time of all is never later than the one that steps, so a target asks for
    nothing older than that earliest time less what its filter reaches back. A source is ahead of the
    earliest time by at most its own step, or by what the targets outside its loop can demand of it, which
    are themselves ahead.
    """
    steps = [component.step for component in system.components]
    ahead = [0] * len(steps)  # bound on a component's time less the earliest time of all, ns
    for group in reversed(groups(system)):
        demanded = max(
            (
                ahead[plan.target] + plan.filter.after * steps[plan.source]
                for plan in plans
                if plan.source in group and plan.target not in group
            ),
            default=0,
        )
        for member in group:
            ahead[member] = demanded + max(steps[other] for other in group) + steps[member]
    kept = padding(plans) + 2
    return [-(-lead // step) + kept for lead, step in zip(ahead, steps, strict=True)]
