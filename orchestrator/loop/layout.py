"""The arrays of the compiled loop (`tlpsim.orchestrator.loop.kernel`) from a system and its links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.filters.interpolation import extrapolation_weights, hermite_weights
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.instance import NativeCalls
from tlpsim.orchestrator.loop import kernel
from tlpsim.orchestrator.loop.algorithms import order_of_ties
from tlpsim.orchestrator.loop.links import LinkPlan, history_depths, padding
from tlpsim.orchestrator.loop.native import clock_address
from tlpsim.orchestrator.system import System, bound_outputs, groups

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_HISTORY_NUMBERS = 65536  # of a component's history, about what is taken away at once
_MOST_ROWS = 2048
_ROOM = 64  # bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Everything that the compiled loop works on.

    Attributes
    ----------
    units, links, groups, members, stack, index, heap, control
        As in `tlpsim.orchestrator.loop.kernel.advance`.
    plans
        Of the links, in the order of their rows.
    inputs
        Names of the inputs of each component that are connected, in the order of its inputs in the heap.
    room
        Bytes whose address the loop gets.
    clock
        Address of the C library's clock.
    """

    units: IntArray
    links: IntArray
    groups: IntArray
    members: IntArray
    stack: IntArray
    index: IntArray
    heap: FloatArray
    control: IntArray
    plans: tuple[LinkPlan, ...]
    inputs: tuple[tuple[str, ...], ...]
    room: NDArray[np.uint8]
    clock: int

    def values(self, unit: int) -> FloatArray:
        """Inputs of a component, a view."""
        first, count = (int(self.units[unit, column]) for column in (kernel.INPUTS, kernel.INPUT_COUNT))
        return self.heap[first : first + count]

    def sizes(self, unit: int) -> FloatArray:
        """Largest size that each input of a component had, as far as that is kept; a view."""
        first, count = (int(self.units[unit, column]) for column in (kernel.SIZES, kernel.INPUT_COUNT))
        return self.heap[first : first + count]

    def row(self, unit: int, number: int) -> FloatArray:
        """Sample of a component, or room for its next one; a view."""
        return self.samples(unit, number, number + 1)[0]

    def next_row(self, unit: int, count: int = 1) -> FloatArray:
        """Room for the sample of a component `count` steps after its newest; a view."""
        return self.row(unit, int(self.units[unit, kernel.NEWEST]) + count)

    def samples(self, unit: int, first: int, last: int) -> FloatArray:
        """Samples `first` to before `last` of a component, (number, width); a view."""
        base, history, width = (int(self.units[unit, column]) for column in (kernel.BASE, kernel.HISTORY, kernel.WIDTH))
        begin = history + (first - base) * width
        return self.heap[begin : begin + (last - first) * width].reshape(last - first, width)

    def begin(self, unit: int, start: int) -> None:
        """Make the sample that was written to row 0 that of the start time and of all times before, in ns."""
        width = int(self.units[unit, kernel.WIDTH])
        first = int(self.units[unit, kernel.HISTORY])
        count = 1 - int(self.units[unit, kernel.BASE])
        rows = self.heap[first : first + count * width].reshape(count, width)
        rows[:-1] = rows[-1]
        self.units[unit, [kernel.START, kernel.TIME, kernel.NEWEST, kernel.TAKEN]] = start, start, 0, -1

    def bind(self, unit: int, calls: NativeCalls | None) -> None:
        """Let the loop step a component by its addresses, or leave it to the caller."""
        row = self.units[unit]
        row[kernel.VERSION] = 0 if calls is None else calls.version
        if calls is None:
            return
        row[[kernel.INSTANCE, kernel.SET_VALUES, kernel.DO_STEP, kernel.GET_VALUES]] = (
            calls.instance,
            calls.set_values,
            calls.do_step,
            calls.get_values,
        )
        for first, references, buffer, places in (
            (kernel.SET_REFERENCES, calls.input_references, calls.inputs, calls.input_places),
            (kernel.GET_REFERENCES, calls.output_references, calls.outputs, calls.output_places),
        ):
            direct = np.array_equal(places, np.arange(len(buffer)))
            address = 0 if direct else buffer.ctypes.data
            row[first : first + 4] = references.ctypes.data, len(references), address, len(buffer)
            self.index[row[first + 4] : row[first + 4] + len(places)] = places

    def supply_weights(self) -> None:
        """Put the weights that the loop found missing into their table."""
        link, key = (int(self.control[place]) for place in (kernel.LINK, kernel.KEY))
        row, plan = self.links[link], self.plans[link]
        step = int(self.units[row[kernel.SOURCE], kernel.STEP])
        slot = -1 - int(kernel.weights_place(link, key, self.links, self.index))
        weights = link_weights(plan, key, step)
        first = row[kernel.TABLE] + slot * row[kernel.STRIDE]
        self.heap[first : first + weights.size] = weights.ravel()
        self.index[row[kernel.KEYS] + slot] = key

    @property
    def last_successful_time(self) -> float:
        """What the last step of FMI 3.0 gave as such, s."""
        return float(self.room[kernel.FLAGS + 8 : kernel.FLAGS + 16].view(np.float64)[0])

    @property
    def arrays(self) -> tuple[object, ...]:
        """Arguments of `tlpsim.orchestrator.loop.kernel.advance` after the clock."""
        return (
            self.units,
            self.links,
            self.groups,
            self.members,
            self.stack,
            self.index,
            self.heap,
            self.room.ctypes.data,
            self.control,
        )


def link_weights(plan: LinkPlan, key: int, step: int) -> FloatArray:
    """Weights of eq. (1) of the kernel: `key` is the time in ns since a sample, or negative that beyond the newest."""
    if plan.smooth:
        return plan.filter.weights(0.0 if key == step else abs(key) / step)
    if key > 0 and plan.interpolated > 1:
        return hermite_weights(plan.interpolated - 1, key / step, to_seconds(step))
    if key > 0:
        return plan.filter.weights(key / step)
    if plan.extrapolated == 1:
        return extrapolation_weights(plan.order, -key / step)
    seconds = to_seconds(-key)
    return np.array([1.0, seconds, 0.5 * seconds**2])[: plan.extrapolated]


def lay_out(system: System, plans: Sequence[LinkPlan], algorithms: Sequence[int]) -> Layout:
    """Arrays for a system that has been checked.

    Parameters
    ----------
    plans
        Of its links, see `tlpsim.orchestrator.loop.links.plan_links`.
    algorithms
        Of each group, in the order of `tlpsim.orchestrator.system.groups`.
    """
    outputs, depths, before = bound_outputs(system), history_depths(system, plans), padding(plans)
    ordered = tuple(sorted(plans, key=lambda plan: plan.target))
    count = len(system.components)
    units = np.zeros((count, kernel.UNIT_COLUMNS), dtype=np.int64)
    links = np.zeros((len(ordered), kernel.LINK_COLUMNS), dtype=np.int64)
    index: list[IntArray] = []
    heap_size = index_size = 0

    def place(numbers: IntArray) -> int:
        nonlocal index_size
        index.append(numbers)
        index_size += len(numbers)
        return index_size - len(numbers)

    def claim(numbers: int) -> int:
        nonlocal heap_size
        heap_size += numbers
        return heap_size - numbers

    inputs: list[tuple[str, ...]] = []
    for number, component in enumerate(system.components):
        row, width = units[number], len(outputs[number])
        incoming = [k for k, plan in enumerate(ordered) if plan.target == number]
        inputs.append(tuple(name for k in incoming for name in ordered[k].inputs))
        kept = depths[number]
        rows = 2 * kept + min(_MOST_ROWS, max(_HISTORY_NUMBERS // max(width, 1), 64))
        row[kernel.STEP], row[kernel.OFFSET] = component.step, REQUEST_OFFSETS[component.inputs_at](component.step)
        row[kernel.ROWS], row[kernel.KEPT], row[kernel.WIDTH] = rows, kept, width
        row[kernel.BASE], row[kernel.NEWEST], row[kernel.TAKEN] = -before, -1, -1
        row[kernel.HISTORY], row[kernel.INPUTS] = claim(rows * width), claim(len(inputs[-1]))
        row[kernel.SIZES] = claim(len(inputs[-1]))
        row[kernel.INPUT_COUNT], row[kernel.LINKS] = len(inputs[-1]), len(incoming)
        row[kernel.FIRST_LINK] = incoming[0] if incoming else 0
        row[kernel.SET_PLACES] = place(np.zeros(len(inputs[-1]), dtype=np.int64))
        row[kernel.GET_PLACES] = place(np.zeros(width, dtype=np.int64))
        position = int(row[kernel.INPUTS])
        for k in incoming:
            links[k, kernel.INTO] = position
            position += len(ordered[k].inputs)
    scales: list[tuple[int, FloatArray]] = []
    for row, plan in zip(links, ordered, strict=True):
        taps = plan.filter.before + plan.filter.after
        row[kernel.SOURCE], row[kernel.SIGNALS] = plan.source, len(plan.inputs)
        row[kernel.BEFORE], row[kernel.AFTER] = plan.filter.before, plan.filter.after
        row[kernel.AHEAD], row[kernel.ORDER] = plan.looks_ahead, plan.order
        row[kernel.COLUMNS] = place(plan.columns.astype(np.int64).ravel())
        row[kernel.INTERPOLATED], row[kernel.EXTRAPOLATED] = plan.interpolated, plan.extrapolated
        row[kernel.STRIDE] = max(taps * plan.interpolated, plan.order + 1, plan.extrapolated)
        row[kernel.KEYS] = place(np.full(kernel.SLOTS, kernel.UNUSED, dtype=np.int64))
        row[kernel.TABLE] = claim(int(kernel.SLOTS * row[kernel.STRIDE]))
        row[kernel.SCALES], row[kernel.SMOOTH] = -1, plan.smooth
        if np.any(plan.scales != np.array([1.0, 0.0])):
            row[kernel.SCALES] = claim(plan.scales.size)
            scales.append((int(row[kernel.SCALES]), plan.scales.ravel()))
    heap = np.zeros(heap_size)
    for first, numbers in scales:
        heap[first : first + len(numbers)] = numbers
    bounds: list[tuple[int, ...]] = []
    members: list[int] = []
    for group, algorithm in zip(groups(system), algorithms, strict=True):
        bounds.append((len(members), len(members) + len(group), algorithm, 0, 0, 0, -1, 1))
        members += order_of_ties(system, group)
        units[group, kernel.GROUP] = len(bounds) - 1
    control = np.zeros(kernel.CONTROL_SIZE, dtype=np.int64)
    control[kernel.PENDING] = -1
    control[kernel.FINAL] = kernel.CALLER not in algorithms
    return Layout(
        units=units,
        links=links,
        groups=np.array(bounds, dtype=np.int64),
        members=np.array(members, dtype=np.int64),
        stack=np.zeros((len(bounds) + 1, 3), dtype=np.int64),
        index=np.concatenate([*index, np.zeros(1, dtype=np.int64)]),
        heap=heap,
        control=control,
        plans=ordered,
        inputs=tuple(inputs),
        room=np.zeros(_ROOM, dtype=np.uint8),
        clock=clock_address(),
    )


REQUEST_OFFSETS = {"start": lambda step: 0, "middle": lambda step: step // 2, "end": lambda step: step}
"""Instant of the inputs within a step, from its start, ns."""
