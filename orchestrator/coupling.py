"""How values pass between components of different rates: histories of outputs, and links that evaluate them.

A history keeps the newest samples of all bound outputs of one component. A link is all connections between
two components that are treated alike; it turns samples into inputs at any time by one small matrix product

    u(t) = sum_k w_k(s) x_k,      t = t_n + s H                                                     (1)

with the weights of an interpolation filter where the time lies between samples, and beyond the newest
sample by

    u(t) = x_n + tau x'_n + tau^2/2 x''_n,      t = t_n + tau                                       (2)

where the component declares derivatives, or else by the polynomial through its newest samples.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.filters.interpolation import (
    CAUSAL,
    SYMMETRIC,
    InterpolationFilter,
    extrapolation_weights,
)
from tlpsim.orchestrator.system import Connection, System, bound_outputs, declared_derivatives, groups

FloatArray = NDArray[np.float64]

_EXTRAPOLATION_ORDERS = {"hold": 0, "linear": 1, "quadratic": 2, "derivatives": 1}
_REACH = max(item.before for item in (*CAUSAL.values(), *SYMMETRIC.values()))
_PADDING = max(_REACH, max(_EXTRAPOLATION_ORDERS.values()) + 1)
_SPARE_ROWS = 64
_CACHE_LENGTH = 4096


class History:
    """The newest samples of a component's bound outputs, contiguous in memory.

    Sample n belongs to the time start + n step. Samples before the first one equal it.

    Parameters
    ----------
    width
        Number of bound outputs.
    step
        Step of the component in ns.
    depth
        Number of samples that must be kept.
    """

    __slots__ = ("_depth", "base", "newest", "rows", "start", "step", "width")

    def __init__(self, width: int, step: int, depth: int) -> None:
        self.width = width
        self.step = step
        self.start = 0
        self.newest = -1  # number of the newest sample
        self.base = -_PADDING  # number of the sample in row 0
        self._depth = max(depth, _PADDING)
        self.rows = np.zeros((2 * self._depth + _SPARE_ROWS, width))

    def next_row(self) -> FloatArray:
        """Return the row for the next sample; it counts once `publish` is called."""
        row = self.newest + 1 - self.base
        if row == len(self.rows):
            kept = self._depth
            self.rows[:kept] = self.rows[row - kept :]
            self.base += row - kept
            row = kept
        result: FloatArray = self.rows[row]
        return result

    def publish(self) -> None:
        """Make the sample that was written to `next_row` the newest one."""
        self.newest += 1

    def initial_row(self) -> FloatArray:
        """Return the row of the first sample; it counts once `begin` is called."""
        result: FloatArray = self.rows[-self.base]
        return result

    def begin(self, start: int) -> None:
        """Make `initial_row` the sample of the start time and of all times before, in ns."""
        self.start = start
        self.rows[: -self.base] = self.rows[-self.base]
        self.newest = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkPlan:
    """All connections between two components that are treated alike.

    Parameters
    ----------
    source, target
        Indices of the components.
    filter
        Interpolation filter: causal within a loop, symmetric elsewhere.
    looks_ahead
        Whether the source is stepped, before the target, until it has all samples that the filter needs.
    extrapolation
        As in `Connection`.
    columns
        Columns of the source's bound outputs: rows are the signals, then their first and second derivatives
        as far as they are used for the extrapolation, shape (1 to 3, number of signals).
    inputs
        Names of the target's inputs.
    """

    source: int
    target: int
    filter: InterpolationFilter
    looks_ahead: bool
    extrapolation: str
    columns: NDArray[np.intp]
    inputs: tuple[str, ...]


def plan_links(system: System) -> list[LinkPlan]:
    """Sort the connections of a system into links, in the order of their first connections."""
    index = {component.name: number for number, component in enumerate(system.components)}
    group_of = {member: number for number, group in enumerate(groups(system)) for member in group}
    outputs = bound_outputs(system)
    collected: dict[tuple[object, ...], list[tuple[Connection, tuple[str, ...]]]] = {}
    for connection in system.connections:
        source, target = index[connection.source], index[connection.target]
        derivatives: tuple[str, ...] = ()
        if connection.extrapolation == "derivatives" and group_of[source] == group_of[target]:
            instance = system.components[source].instance
            derivatives = declared_derivatives(instance, connection.source_variable)
        key = (source, target, connection.filter, connection.extrapolation, len(derivatives))
        collected.setdefault(key, []).append((connection, derivatives))
    plans = []
    for members in collected.values():
        first = members[0][0]
        source, target = index[first.source], index[first.target]
        in_loop = group_of[source] == group_of[target]
        names = [(connection.source_variable, *derivatives) for connection, derivatives in members]
        columns = np.array([[outputs[source].index(name) for name in row] for row in names], dtype=np.intp).T
        plans.append(
            LinkPlan(
                source=source,
                target=target,
                filter=(CAUSAL if in_loop else SYMMETRIC)[first.filter],
                looks_ahead=not in_loop,
                extrapolation=first.extrapolation,
                columns=np.ascontiguousarray(columns),
                inputs=tuple(connection.target_variable for connection, _ in members),
            )
        )
    return plans


def history_depths(system: System, plans: list[LinkPlan]) -> list[int]:
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
    return [-(-lead // step) + _PADDING + 2 for lead, step in zip(ahead, steps, strict=True)]


class Link:
    """Evaluates the connections of one plan for a target's input vector.

    Parameters
    ----------
    plan
        What is connected, and how.
    history
        Samples of the source.
    into
        Part of the target's input vector that the link writes, shape (number of signals,).
    advance
        Function that steps the source until its newest sample has at least the given number; None if the
        source is not stepped ahead.
    """

    __slots__ = (
        "_advance",
        "_after",
        "_all",
        "_before",
        "_cache",
        "_columns",
        "_derivative_columns",
        "_derivative_flat",
        "_derivative_values",
        "_filter_weights",
        "_history",
        "_into",
        "_order",
        "_scattered",
        "_signals",
        "_slice",
        "_step",
    )

    def __init__(
        self, plan: LinkPlan, history: History, into: FloatArray, advance: Callable[[int], None] | None
    ) -> None:
        self._history = history
        self._into = into
        self._advance = advance
        self._step = history.step
        self._before = plan.filter.before
        self._after = plan.filter.after
        self._filter_weights = plan.filter.weights
        self._order = _EXTRAPOLATION_ORDERS[plan.extrapolation]
        self._columns = np.ascontiguousarray(plan.columns[0])
        first, count = int(self._columns[0]), len(self._columns)
        self._scattered = not np.array_equal(self._columns, np.arange(first, first + count))
        # BLAS takes a block of columns as it is; scattered columns are picked from the product with all of
        # them
        self._slice = slice(0, history.width) if self._scattered else slice(first, first + count)
        self._all = np.zeros(history.width) if self._scattered else into
        self._derivative_columns = plan.columns.ravel() if len(plan.columns) > 1 else None
        self._derivative_values = np.zeros(plan.columns.shape)
        self._derivative_flat = self._derivative_values.reshape(-1)
        self._cache: dict[int, FloatArray] = {}

    def fill(self, time: int) -> None:
        """Write the values of a time, in ns, into the target's input vector."""
        history = self._history
        number, remainder = divmod(time - history.start, self._step)
        if self._advance is not None:
            needed = number + self._after if remainder else number
            if history.newest < needed:
                self._advance(needed)
        newest = history.newest
        if number < newest:
            if remainder:
                self._combine(self._interpolation(remainder), number + 1 - self._before)
            else:
                self._copy(number)
        elif number == newest and not remainder:
            self._copy(number)
        else:
            self._extrapolate(time - history.start - newest * self._step)

    def _interpolation(self, remainder: int) -> FloatArray:
        weights = self._cache.get(remainder)
        if weights is None:
            if len(self._cache) >= _CACHE_LENGTH:
                self._cache.clear()
            weights = self._cache[remainder] = self._filter_weights(remainder / self._step)
        return weights

    def _extrapolate(self, beyond: int) -> None:
        newest = self._history.newest
        key = -beyond  # interpolation weights are cached under positive keys
        weights = self._cache.get(key)
        if self._derivative_columns is None:
            if weights is None:
                weights = self._cache[key] = extrapolation_weights(self._order, beyond / self._step)
            self._combine(weights, newest - self._order)
        else:
            if weights is None:
                seconds = beyond * 1e-9
                weights = np.array([1.0, seconds, 0.5 * seconds**2])[: len(self._derivative_values)]
                self._cache[key] = weights
            row = self._history.rows[newest - self._history.base]
            row.take(self._derivative_columns, out=self._derivative_flat, mode="clip")
            np.dot(weights, self._derivative_values, out=self._into)

    def _combine(self, weights: FloatArray, first: int) -> None:
        """Write the weighted sum of the samples from number `first` on."""
        history = self._history
        row = first - history.base
        np.dot(weights, history.rows[row : row + len(weights), self._slice], out=self._all)
        if self._scattered:
            self._all.take(self._columns, out=self._into, mode="clip")

    def _copy(self, number: int) -> None:
        history = self._history
        history.rows[number - history.base].take(self._columns, out=self._into, mode="clip")
