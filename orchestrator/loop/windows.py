"""Steps of a whole group that the compiled loop leaves to the caller: iterated, of adapted length, or side by side.

A window is a number of steps of every component of a group. Iteration repeats it from saved states until the inputs are
those that the outputs give (`tlpsim.orchestrator.loop.iteration`). Adaptation takes m steps of each component as one,
with inputs that are continued over all of them. What an input then turns out to be is compared with what it was taken
to be:

    e = max |u_given - u_used| / (tolerance size)                                                      (1)

With e > 1 the states are restored and the window is halved, down to one step; with e < 1/4, the least for which a
window of twice the length with an error of second order would pass, the next one is doubled. Samples inside a window of
several steps are interpolated, by Hermite's polynomial where a time derivative is declared and linearly elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.filters.interpolation import hermite_weights
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.loop import kernel

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import Master

FloatArray = NDArray[np.float64]

_DOUBLED_BELOW = 0.25
_CLOCK = [kernel.TIME, kernel.NEWEST, kernel.STEPS]


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Components of a group with their states and clocks at the beginning of a window.

    Attributes
    ----------
    members
        Indices of the components, in the order in which they step.
    counts
        Number of steps of each.
    begin
        Time in ns.
    """

    master: Master
    members: tuple[int, ...]
    counts: tuple[int, ...]
    begin: int
    _states: tuple[object, ...]
    _clock: NDArray[np.int64]

    def restore(self) -> None:
        """Bring all components back to the beginning."""
        for member, state in zip(self.members, self._states, strict=True):
            self.master.instances[member].set_state(state)
        self.master.layout.units[np.ix_(self.members, _CLOCK)] = self._clock


def members_of(master: Master, group: int) -> tuple[int, ...]:
    """Components of a group, in the order in which they step at one time."""
    first, last = (int(place) for place in master.layout.groups[group, :2])
    return tuple(int(member) for member in master.layout.members[first:last])


@contextmanager
def window(master: Master, members: Sequence[int], counts: Sequence[int]) -> Iterator[Window]:
    """A window for which everything from outside is there, with saved states that are released in the end."""
    units = master.layout.units
    master.prepare_window(members, counts)
    instances = [master.instances[member] for member in members]
    states = tuple(instance.get_state() for instance in instances)
    try:
        yield Window(
            master=master,
            members=tuple(members),
            counts=tuple(counts),
            begin=int(units[members[0], kernel.TIME]),
            _states=states,
            _clock=units[np.ix_(members, _CLOCK)].copy(),
        )
    finally:
        for instance, state in zip(instances, states, strict=True):
            instance.free_state(state)


def adapt(master: Master, group: int) -> None:
    """Step a group over as many steps at a time as eq. (1) allows."""
    layout, rule = master.layout, master.system.adaptation
    members = members_of(master, group)
    count = int(layout.groups[group, kernel.WINDOW])
    tries = 0
    with window(master, members, [count] * len(members)) as whole:
        while True:
            used = [_long_step(master, member, count) for member in members]
            error = 0.0
            for member, taken in zip(members, used, strict=True):
                master.fill(member, whole.begin + count * int(layout.units[member, kernel.OFFSET]))
                given, sizes = layout.values(member), layout.sizes(member)
                np.maximum(sizes, np.abs(given), out=sizes)
                apart = np.abs(given - taken)
                error = max(error, float(np.max(apart[sizes > 0.0] / sizes[sizes > 0.0], initial=0.0)) / rule.tolerance)
            if error <= 1.0 or count == 1:
                break
            tries += 1
            count = max(count // 2, 1)
            whole.restore()
    layout.groups[group, kernel.WINDOW] = min(2 * count, rule.longest) if error < _DOUBLED_BELOW else count
    master.tally(windows=1, steps=count, repeated=tries, above=int(error > 1.0))


def _long_step(master: Master, unit: int, count: int) -> FloatArray:
    """Step a component over several of its steps at once; returns the inputs that it had."""
    row = master.layout.units[unit]
    master.fill(unit, int(row[kernel.TIME] + count * row[kernel.OFFSET]))
    inputs = master.layout.values(unit).copy()
    newest = int(row[kernel.NEWEST])
    master.call(unit, count)
    if count > 1:
        _fill_between(master, unit, newest, count, to_seconds(int(row[kernel.STEP])))
    _publish(row, count)
    return inputs


def _publish(row: NDArray[np.int64], count: int = 1) -> None:
    """Count a step that is as long as `count` of a component's, whose samples are in its history."""
    row[kernel.NEWEST] += count
    row[kernel.TIME] += count * row[kernel.STEP]
    row[kernel.STEPS] += 1


def _fill_between(master: Master, unit: int, newest: int, count: int, step: float) -> None:
    """Samples between those numbered `newest` and `newest + count`."""
    samples = master.layout.samples(unit, newest, newest + count + 1)
    phases = np.arange(1, count) / count
    first, last = samples[0].copy(), samples[-1].copy()
    samples[1:-1] = first + phases[:, None] * (last - first)
    columns, rates = master.rate_columns(unit)
    if len(columns):
        weights = np.array([hermite_weights(1, phase, count * step) for phase in phases.tolist()])
        ends = np.array([first, last])
        samples[1:-1, columns] = weights[:, 0] @ ends[:, columns] + weights[:, 1] @ ends[:, rates]


def step_together(master: Master, group: int, pool: ThreadPoolExecutor) -> None:
    """Step all components of a group that are due, each in a thread of its own, with inputs filled before."""
    layout = master.layout
    members = members_of(master, group)
    now = int(layout.units[list(members), kernel.TIME].min())
    due = [member for member in members if layout.units[member, kernel.TIME] == now]
    master.prepare_window(due, [1] * len(due))
    for member in due:
        master.fill(member, now + int(layout.units[member, kernel.OFFSET]))
    for future in [pool.submit(master.call, member) for member in due]:
        future.result()
    for member in due:
        _publish(layout.units[member])
