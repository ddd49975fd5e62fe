"""Who steps when: an event-driven master on an integer clock.

Of all components in a loop, the one with the earliest time of its own steps next; of several, the one with
the largest step (slow first), then the one declared first. A slow component thus steps over its whole step
with feedback inputs that are extrapolated, and the fast ones then step inside that window on values that
are interpolated. Outside loops nothing is extrapolated: before a component steps, what feeds it is stepped
until it has all the samples that the interpolation filter needs.

Every component starts a step while its own time is earlier than the stop time, so that a short run is the
beginning of a longer one.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from heapq import heapify, heapreplace
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import FmuError, StepError, TlpsimError, WiringError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.coupling import History, Link, history_depths, plan_links
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import Component, System, bound_outputs, check, groups

FloatArray = NDArray[np.float64]

_SWEEP_LIMIT = 10
# Inputs that change by less than this between two sweeps of the initialization count as settled.
_SWEEP_RELATIVE_TOLERANCE = 1e-9
_SWEEP_ABSOLUTE_TOLERANCE = 1e-12

_REQUEST_OFFSETS: dict[str, Callable[[int], int]] = {
    "start": lambda step: 0,
    "middle": lambda step: step // 2,
    "end": lambda step: step,
}

_Event = tuple[int, int, int]  # own time, negative step, index: the order in which components of a group step


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentSummary:
    """What one component did in a run.

    Parameters
    ----------
    name
        Name of the component.
    steps
        Number of steps.
    time
        Own time at the end of the run in ns; past the stop time if the component was stepped ahead.
    wall_time
        Wall time in s that its steps took, with setting inputs and getting outputs.
    """

    name: str
    steps: int
    time: int
    wall_time: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """What happened in a run.

    Parameters
    ----------
    start, stop
        Start time and stop time in ns.
    components
        One record for each component, in the order of the system.
    wall_time
        Wall time of the run in s, with initialization and observers.
    initialization_sweeps
        Number of times that all components exchanged their values in the initialization.
    notes
        What is allowed but may be an oversight.
    """

    start: int
    stop: int
    components: tuple[ComponentSummary, ...]
    wall_time: float
    initialization_sweeps: int
    notes: tuple[str, ...]


class _Unit:
    """A component with all that its step needs, looked up once."""

    __slots__ = (
        "all_set",
        "flags",
        "get_outputs",
        "history",
        "index",
        "inputs",
        "instance",
        "links",
        "name",
        "nanoseconds",
        "offset",
        "outputs",
        "set_inputs",
        "size",
        "step",
        "steps",
    )

    def __init__(self, index: int, component: Component, outputs: tuple[str, ...], history: History) -> None:
        self.index = index
        self.instance: Instance = component.instance
        self.name = component.name
        self.outputs = outputs
        self.history = history
        self.offset = _REQUEST_OFFSETS[component.inputs_at](component.step)
        self.size = to_seconds(component.step)
        self.flags = np.ones(len(outputs), dtype=np.bool_)
        self.all_set = self.flags.tobytes()
        self.inputs = np.zeros(0)
        self.links: tuple[Link, ...] = ()
        self.steps = 0
        self.nanoseconds = 0
        self.set_inputs = component.instance.set_inputs
        self.step = component.instance.step
        self.get_outputs = component.instance.get_outputs

    def is_finite(self, values: FloatArray) -> bool:
        """Check a sample; comparing bytes takes a fraction of the time of `numpy.all`."""
        np.isfinite(values, self.flags)
        return self.flags.tobytes() == self.all_set


def _not_finite(unit: _Unit, time: int, values: FloatArray) -> StepError:
    position = int(np.flatnonzero(~np.isfinite(values))[0])
    return StepError(
        f"{unit.name}: output '{unit.outputs[position]}' is {values[position]} "
        f"at t = {to_seconds(time):.9g} s, not a finite number; "
        "check the component's parameters, inputs and step size"
    )


class Master:
    """Steps the components of a system.

    Parameters
    ----------
    system
        Components and connections. The master does not free the instances; `run` does.
    observers
        Who gets the samples.

    Raises
    ------
    WiringError
        As `tlpsim.orchestrator.system.check`.
    """

    def __init__(self, system: System, observers: Sequence[Observer] = ()) -> None:
        self._began = perf_counter_ns()
        self._system = system
        self._observers = tuple(observers)
        self._notes = check(system)
        self._sweeps = 0
        self._start = self._stop = 0
        plans = plan_links(system)
        depths = history_depths(system, plans)
        outputs = bound_outputs(system)
        self._units = [
            _Unit(index, component, outputs[index], History(len(outputs[index]), component.step, depths[index]))
            for index, component in enumerate(system.components)
        ]
        self._order = [
            index
            for group in groups(system)
            for index in sorted(group, key=lambda member: (-system.components[member].step, member))
        ]
        self._queues: list[list[_Event]] = [
            [(0, -system.components[index].step, index) for index in group] for group in groups(system)
        ]
        queue_of = {event[2]: queue for queue in self._queues for event in queue}
        self._input_names: list[tuple[str, ...]] = []
        for unit in self._units:
            incoming = [plan for plan in plans if plan.target == unit.index]
            self._input_names.append(tuple(name for plan in incoming for name in plan.inputs))
            unit.inputs = np.zeros(len(self._input_names[-1]))
            links = []
            position = 0
            for plan in incoming:
                source = self._units[plan.source].history
                into = unit.inputs[position : position + len(plan.inputs)]
                reach = self._reach(queue_of[plan.source], source) if plan.looks_ahead else None
                links.append(Link(plan, source, into, reach))
                position += len(plan.inputs)
            unit.links = tuple(links)

    def _reach(self, queue: list[_Event], history: History) -> Callable[[int], None]:
        """Make a function that steps a group until the history of one of its components has a sample."""

        def reach(number: int) -> None:
            while history.newest < number:
                self._step_next(queue)

        return reach

    def initialize(self, start: int = 0) -> None:
        """Set parameters, initialize all components at the start time (ns) and take their first samples.

        Raises
        ------
        WiringError
            If a parameter is unknown or of the wrong type.
        FmuError, StepError
            If a component cannot be loaded or initialized, or gives a value that is not finite.
        """
        self._start = self._stop = start
        units = [self._units[index] for index in self._order]
        for unit in units:
            component = self._system.components[unit.index]
            self._guarded(unit, "setting parameters of", unit.instance.set_parameters, component.parameters)
            unit.instance.bind(self._input_names[unit.index], unit.outputs)
        for unit in units:
            self._guarded(unit, "initializing", unit.instance.enter_initialization, to_seconds(start))
            self._take_initial_sample(unit)
        self._settle(units)
        for unit in units:
            self._guarded(unit, "initializing", unit.instance.exit_initialization)
            self._take_initial_sample(unit)
        for queue in self._queues:
            queue[:] = [(start, negative_step, index) for _, negative_step, index in queue]
            heapify(queue)
        # Only now, so that what cannot be initialized leaves nothing behind.
        for observer in self._observers:
            observer.started(self._system)
        for unit in self._units:
            for observer in self._observers:
                observer.sampled(unit.index, start, unit.history.initial_row())

    def _guarded(self, unit: _Unit, what: str, action: Callable[..., None], *arguments: object) -> None:
        """Name the component in any error that it raises outside a step."""
        try:
            action(*arguments)
        except TlpsimError:
            raise
        except Exception as error:
            raise FmuError(f"{unit.name}: failed while {what} it: {type(error).__name__}: {error}") from error

    def _take_initial_sample(self, unit: _Unit) -> None:
        row = unit.history.initial_row()
        self._guarded(unit, "initializing", unit.get_outputs, row)
        if not unit.is_finite(row):
            raise _not_finite(unit, self._start, row)
        unit.history.begin(self._start)

    def _settle(self, units: Sequence[_Unit]) -> None:
        """Exchange values in the initialization mode until the inputs do not change any more."""
        for sweep in range(1, _SWEEP_LIMIT + 1):
            self._sweeps = sweep
            settled = True
            for unit in units:
                if not unit.links:
                    continue
                before = unit.inputs.copy()
                for link in unit.links:
                    link.fill(self._start)
                if sweep > 1 and np.allclose(
                    unit.inputs, before, rtol=_SWEEP_RELATIVE_TOLERANCE, atol=_SWEEP_ABSOLUTE_TOLERANCE
                ):
                    continue
                settled = False
                self._guarded(unit, "initializing", unit.set_inputs, unit.inputs)
                self._take_initial_sample(unit)
            if settled:
                return
        self._notes.append(f"the initial values did not settle in {_SWEEP_LIMIT} exchanges")

    def advance(self, until: int) -> None:
        """Step all components until none has an own time earlier than `until` (ns).

        Raises
        ------
        StepError
            If a component fails in a step or gives a value that is not finite.
        """
        self._stop = until
        queues = self._queues
        if len(queues) == 1:
            queue = queues[0]
            while queue[0][0] < until:
                self._step_next(queue)
            return
        while True:
            queue = min(queues, key=_first_event)
            if queue[0][0] >= until:
                return
            self._step_next(queue)

    def _step_next(self, queue: list[_Event]) -> None:
        """Step the component of a group whose turn it is."""
        time, negative_step, index = queue[0]
        unit = self._units[index]
        inputs = unit.inputs
        request = time + unit.offset
        for link in unit.links:
            link.fill(request)
        history = unit.history
        row = history.next_row()
        end = time - negative_step
        began = perf_counter_ns()
        try:
            if unit.links:
                unit.set_inputs(inputs)
            unit.step(time / NANOSECONDS_PER_SECOND, unit.size)
            unit.get_outputs(row)
        except TlpsimError:
            raise
        except Exception as error:
            raise StepError(
                f"{unit.name}: the step at t = {to_seconds(time):.9g} s failed: {type(error).__name__}: {error}"
            ) from error
        unit.nanoseconds += perf_counter_ns() - began
        unit.steps += 1
        if not unit.is_finite(row):
            raise _not_finite(unit, end, row)
        history.newest += 1
        heapreplace(queue, (end, negative_step, index))
        for observer in self._observers:
            observer.sampled(index, end, row)

    def terminate(self) -> None:
        """End the simulation of every component. A component that fails in it only causes a note."""
        for unit in self._units:
            try:
                unit.instance.terminate()
            except Exception as error:
                self._notes.append(f"{unit.name}: failed while terminating: {error}")

    def summary(self) -> RunSummary:
        """Summarize what happened so far."""
        times = {index: time for queue in self._queues for time, _, index in queue}
        return RunSummary(
            start=self._start,
            stop=self._stop,
            components=tuple(
                ComponentSummary(
                    name=unit.name,
                    steps=unit.steps,
                    time=times[unit.index],
                    wall_time=unit.nanoseconds / NANOSECONDS_PER_SECOND,
                )
                for unit in self._units
            ),
            wall_time=(perf_counter_ns() - self._began) / NANOSECONDS_PER_SECOND,
            initialization_sweeps=self._sweeps,
            notes=tuple(self._notes),
        )


def _first_event(queue: list[_Event]) -> _Event:
    return queue[0]


def run(system: System, stop: int, start: int = 0, observers: Sequence[Observer] = ()) -> RunSummary:
    """Run a system from start to stop, and free its instances whatever happens.

    Parameters
    ----------
    system
        Components and connections; its instances cannot be used again.
    stop, start
        Stop and start time in ns.
    observers
        Who gets the samples.

    Raises
    ------
    WiringError
        If the system is not wired well, a parameter is wrong, or the stop time is not later than the start
        time.
    FmuError
        If a component cannot be loaded or initialized.
    StepError
        If a component fails in a step or gives a value that is not finite.
    """
    try:
        if stop <= start:
            raise WiringError(
                f"the stop time {to_seconds(stop)} s is not later than the start time {to_seconds(start)} s"
            )
        master = Master(system, observers)
        reason: BaseException | None = None
        try:
            master.initialize(start)
            master.advance(stop)
            master.terminate()
        except BaseException as error:
            reason = error
            raise
        finally:
            for observer in observers:
                observer.stopped(reason, master.summary())
        return master.summary()
    finally:
        for component in system.components:
            with suppress(Exception):  # the first error matters, and the others must still be freed
                component.instance.free()
