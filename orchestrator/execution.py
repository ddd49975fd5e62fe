"""A run: components are initialized, stepped on an integer clock, watched, and ended in good order.

The steps themselves are made by a compiled loop (`tlpsim.orchestrator.loop.kernel`), which comes back here for what it
cannot do: a component without addresses to call, weights of a filter that it has not met, samples to pass on to
observers, and faults.

Every component starts a step while its own time is earlier than the stop time, so that a short run is the
beginning of a longer one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from heapq import merge
from itertools import groupby
from time import perf_counter, perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import DiscardError, FmuError, StepError, TlpsimError, WiringError
from tlpsim.orchestrator.arrays import expanded
from tlpsim.orchestrator.checkpoint import Checkpoints, require_serializable, restore
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.events import due_times
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.loop import kernel
from tlpsim.orchestrator.loop.algorithms import algorithm_codes
from tlpsim.orchestrator.loop.iteration import iterate
from tlpsim.orchestrator.loop.layout import lay_out
from tlpsim.orchestrator.loop.links import plan_links
from tlpsim.orchestrator.loop.windows import adapt, step_together
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System, bound_outputs, check, declared_derivatives

FloatArray = NDArray[np.float64]

_SWEEP_LIMIT = 10
# Inputs that change by less than this between two sweeps of the initialization count as settled.
_SWEEP_RELATIVE_TOLERANCE = 1e-9
_SWEEP_ABSOLUTE_TOLERANCE = 1e-12

_PASS_ON = 0.1  # s of wall time between two times that observers get samples
_FIRST_BUDGET, _LARGEST_BUDGET = 64, 1 << 22  # steps that the compiled loop makes at a time
_MOST_PIECES = 1024  # of a step that was discarded
_MOST_NAMED = 6  # inputs in an error message
_FUNCTIONS = {kernel.SETTING: "setting inputs", kernel.STEPPING: "doStep", kernel.GETTING: "getting outputs"}


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
        self._observers = tuple(observers)
        system = self.system = expanded(system)
        self._notes = check(system)
        self._sweeps = 0
        self.start = self._stop = 0
        self._budget = _FIRST_BUDGET
        self._passed_on = 0.0
        self.outputs = bound_outputs(system)
        self.instances: list[Instance] = [component.instance for component in system.components]
        self.layout = lay_out(system, plan_links(system), algorithm_codes(system))
        self._arrays = self.layout.arrays
        self._discarded = 0
        self._tally: Counter[str] = Counter()
        self._pool: ThreadPoolExecutor | None = None
        self._rate_columns: dict[int, tuple[list[int], list[int]]] = {}

    # The beginning

    def initialize(self, start: int = 0, checkpoints: Checkpoints | None = None) -> None:
        """Set parameters, initialize all components at the start time (ns) and take their first samples.

        With checkpoints of which one is there to go on from, take the state in it and give observers its samples.

        Raises
        ------
        WiringError
            If a parameter is unknown or of the wrong type.
        FmuError, StepError
            If a component cannot be loaded or initialized, or gives a value that is not finite.
        CheckpointError
            If the checkpoint is of another system.
        """
        self.start = self._stop = start
        order = [int(member) for member in self.layout.members]
        for unit in order:
            component = self.system.components[unit]
            self._guarded(unit, "setting parameters of", component.instance.set_parameters, component.parameters)
            component.instance.bind(self.layout.inputs[unit], self.outputs[unit])
        for unit in order:
            self._guarded(unit, "initializing", self.instances[unit].enter_initialization, to_seconds(start))
            self._take_initial_sample(unit)
        self._settle(order)
        for unit in order:
            self._guarded(unit, "initializing", self.instances[unit].exit_initialization)
            self._take_initial_sample(unit)
        self._connect()
        # Only now, so that what cannot be initialized leaves nothing behind.
        if checkpoints is not None and checkpoints.resumed is not None:
            restore(self, checkpoints.resumed)
        for observer in self._observers:
            observer.started(self.system)
        if checkpoints is not None:
            checkpoints.replay(self._observers)
        self._pass_on()

    def _connect(self) -> None:
        """Give the compiled loop the addresses of those that have them."""
        for unit, instance in enumerate(self.instances):
            instance.clock = self._clock_of(unit)
            self.layout.bind(unit, instance.native_calls())

    def _clock_of(self, unit: int) -> Callable[[], float]:
        row = self.layout.units[unit]
        return lambda: float(row[kernel.TIME]) / NANOSECONDS_PER_SECOND

    def _guarded(self, unit: int, what: str, action: Callable[..., None], *arguments: object) -> None:
        """Name the component in any error that it raises outside a step."""
        try:
            action(*arguments)
        except TlpsimError:
            raise
        except Exception as error:
            name = self.instances[unit].name
            raise FmuError(f"{name}: failed while {what} it: {type(error).__name__}: {error}") from error

    def _take_initial_sample(self, unit: int) -> None:
        row = self.layout.row(unit, 0)
        self._guarded(unit, "initializing", self.instances[unit].get_outputs, row)
        if not np.all(np.isfinite(row)):
            raise self._not_finite(unit, self.start, row)
        self.layout.begin(unit, self.start)

    def _settle(self, order: Sequence[int]) -> None:
        """Exchange values in the initialization mode until the inputs do not change any more."""
        for sweep in range(1, _SWEEP_LIMIT + 1):
            self._sweeps = sweep
            settled = True
            for unit in order:
                inputs = self.layout.values(unit)
                if not len(inputs):
                    continue
                before = inputs.copy()
                self.fill(unit, self.start)
                if sweep > 1 and np.allclose(
                    inputs, before, rtol=_SWEEP_RELATIVE_TOLERANCE, atol=_SWEEP_ABSOLUTE_TOLERANCE
                ):
                    continue
                settled = False
                self._guarded(unit, "initializing", self.instances[unit].set_inputs, inputs)
                self._take_initial_sample(unit)
            if settled:
                return
        self._notes.append(f"the initial values did not settle in {_SWEEP_LIMIT} exchanges")

    def fill(self, unit: int, time: int) -> None:
        """Inputs of a component for a time in ns, into the heap."""
        layout = self.layout
        while not kernel.fill_inputs(unit, time, layout.units, layout.links, layout.index, layout.heap, layout.control):
            layout.supply_weights()

    # The steps

    def advance(self, until: int) -> None:
        """Step all components until none has an own time earlier than `until` (ns).

        Raises
        ------
        StepError
            If a component fails in a step or gives a value that is not finite.
        """
        self._stop = until
        try:
            self._run(until)
        finally:
            self._pass_on()

    def _run(self, until: int) -> None:
        control = self.layout.control
        actions: dict[int, Callable[[int], None]] = {
            kernel.CALL: self.call,
            kernel.FULL: lambda unit: self._make_room(),
            kernel.WEIGHTS: lambda unit: self.layout.supply_weights(),
            kernel.FAILED: self._failed,
            kernel.GROUP_DUE: self._step_group,
        }
        while True:
            began = perf_counter()
            code = kernel.advance(until, self._budget, self.layout.clock, *self._arrays)
            if code == kernel.DONE:
                return
            if code == kernel.PAUSE:
                self._adapt(perf_counter() - began)
            else:
                actions[code](int(control[kernel.UNIT]))
            if perf_counter() - self._passed_on > _PASS_ON:
                self._pass_on()

    def _adapt(self, elapsed: float) -> None:
        """Let the compiled loop go on for about a tenth of a second: Ctrl-C and observers wait for it."""
        if elapsed < 0.5 * _PASS_ON:
            self._budget = min(2 * self._budget, _LARGEST_BUDGET)
        elif elapsed > _PASS_ON:
            self._budget = max(self._budget // 2, 1)

    def _make_room(self) -> None:
        """Let observers take the samples, so that histories have room for new ones."""
        self._pass_on()
        kernel.make_room(self.layout.units, self.layout.heap)

    def _pass_on(self) -> None:
        """Give observers the samples that they have not got; all of them, also where one observer fails."""
        failure: BaseException | None = None
        for unit, row in enumerate(self.layout.units):
            first, last = int(row[kernel.TAKEN]) + 1, int(row[kernel.NEWEST]) + 1
            if first == last:
                continue
            times = row[kernel.START] + row[kernel.STEP] * np.arange(first, last)
            values = self.layout.samples(unit, first, last)
            row[kernel.TAKEN] = last - 1
            for observer in self._observers:
                try:
                    observer.sampled(unit, times, values)
                except BaseException as error:
                    failure = failure or error
        self._passed_on = perf_counter()
        if failure is not None:
            raise failure

    def _times(self, unit: int, count: int = 1) -> tuple[float, float]:
        """Start and size of some steps of a component in s."""
        row = self.layout.units[unit]
        return to_seconds(int(row[kernel.TIME])), to_seconds(count * int(row[kernel.STEP]))

    def call(self, unit: int, count: int = 1) -> None:
        """Step a component that has its inputs over some of its steps at once, into the row of the last of them."""
        instance, row = self.instances[unit], self.layout.units[unit]
        time, size = self._times(unit, count)
        began = perf_counter_ns()
        into = self.layout.next_row(unit, count)
        try:
            if row[kernel.INPUT_COUNT]:
                instance.set_inputs(self.layout.values(unit))
            try:
                instance.step(time, size)
            except DiscardError as error:
                self._retry(unit, error, count)
            instance.get_outputs(into)
        except TlpsimError as error:
            raise type(error)(f"{error}{self._inputs_of(unit)}") from error
        except Exception as error:
            raise StepError(
                f"{instance.name}: the step at t = {time:.9g} s failed: {type(error).__name__}: {error}"
                f"{self._inputs_of(unit)}"
            ) from error
        row[kernel.NANOSECONDS] += perf_counter_ns() - began
        if not np.all(np.isfinite(into)):
            raise self._not_finite(unit, int(row[kernel.TIME] + count * row[kernel.STEP]), into)

    def _failed(self, unit: int) -> None:
        """Go on after a step that was discarded, or say what failed."""
        control, instance = self.layout.control, self.instances[unit]
        status, phase = int(control[kernel.STATUS]), int(control[kernel.PHASE])
        time, size = self._times(unit)
        if status < 0:
            row = self.layout.units[unit]
            raise self._not_finite(unit, row[kernel.TIME] + row[kernel.STEP], self.layout.next_row(unit))
        if phase == kernel.ENDING:
            raise StepError(f"{instance.name}: asks at t = {time:.9g} s for the end of the simulation")
        if phase == kernel.EARLY:
            raise StepError(
                f"{instance.name}: returned early from the step of {size:.9g} s at t = {time:.9g} s, which was not "
                "allowed"
            )
        error = instance.native_failure(_FUNCTIONS[phase], time, size, status, self.layout.last_successful_time)
        if not isinstance(error, DiscardError):
            raise type(error)(f"{error}{self._inputs_of(unit)}")
        self._retry(unit, error)
        instance.get_outputs(self.layout.next_row(unit))
        control[kernel.PENDING] = unit

    def _retry(self, unit: int, error: DiscardError, count: int = 1) -> None:
        """Finish a discarded step in smaller ones, from where the component says that it is."""
        instance = self.instances[unit]
        time, size = self._times(unit, count)
        reached = instance.last_successful_time()
        if reached is None:
            raise StepError(
                f"{error}; it does not say how far it came, so the step cannot be taken in pieces"
            ) from error
        now, end, piece = max(time, reached), time + size, 0.5 * size
        while end - now > 1e-9 * size:
            try:
                instance.step(now, min(piece, end - now))
                now += min(piece, end - now)
            except DiscardError as again:
                reached = instance.last_successful_time()
                if reached is not None and reached > now:
                    now = reached
                    continue
                piece *= 0.5
                if piece < size / _MOST_PIECES:
                    raise StepError(f"{again}; pieces of the step down to {piece:.3g} s were discarded too") from again
        self._discarded += 1

    def _inputs_of(self, unit: int) -> str:
        """The inputs that a component had, for the end of an error message."""
        names, values = self.layout.inputs[unit], self.layout.values(unit)
        if not len(names):
            return ""
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names[:_MOST_NAMED], values, strict=False))
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        return f"; its inputs were {shown}{more}"

    def _not_finite(self, unit: int, time: int, values: FloatArray) -> StepError:
        position = int(np.flatnonzero(~np.isfinite(values))[0])
        return StepError(
            f"{self.instances[unit].name}: output '{self.outputs[unit][position]}' is {values[position]} "
            f"at t = {to_seconds(int(time)):.9g} s, not a finite number; "
            f"check the component's parameters, inputs and step size{self._inputs_of(unit)}"
        )

    def change(self, time: int) -> None:
        """Set what the events of a time (ns) change, up to which all components have been stepped.

        Raises
        ------
        FmuError
            If a component does not take a value.
        """
        units = {component.name: unit for unit, component in enumerate(self.system.components)}
        for event in self.system.events:
            if event.time != time:
                continue
            unit = units[event.component]
            self._guarded(unit, f"at {event}, changing values of", self.instances[unit].change, event.values)
            own = int(self.layout.units[unit, kernel.TIME])
            if own > time:
                self._notes.append(f"{event}: {event.component} has it from t = {to_seconds(own):.9g} s on")

    # Groups that the compiled loop leaves to this one

    def _step_group(self, unit: int) -> None:
        """Step a whole group by the algorithm of the system."""
        group = int(self.layout.units[unit, kernel.GROUP])
        match self.system.algorithm:
            case "iterative":
                iterate(self, group)
            case "adaptive":
                adapt(self, group)
            case _:
                self._pool = self._pool or ThreadPoolExecutor(self.system.threads)
                step_together(self, group, self._pool)
        self.layout.control[kernel.PENDING] = kernel.GROUP_STEPPED

    def rate_columns(self, unit: int) -> tuple[list[int], list[int]]:
        """Columns of a component's outputs whose time derivatives are among them, and those of the derivatives."""
        if unit not in self._rate_columns:
            names, instance = self.outputs[unit], self.instances[unit]
            first = {name: next(iter(declared_derivatives(instance, name)), None) for name in names}
            places = {name: column for column, name in enumerate(names)}
            pairs = [(places[name], places[rate]) for name, rate in first.items() if rate in places]
            self._rate_columns[unit] = [column for column, _ in pairs], [rate for _, rate in pairs]
        return self._rate_columns[unit]

    def tally(self, **counts: int) -> None:
        """Count what the algorithms of groups did, for the notes."""
        self._tally.update(counts)

    def prepare_window(self, members: Sequence[int], counts: Sequence[int]) -> None:
        """Step what feeds a group from outside until it has all samples for so many steps, and make room for them."""
        layout = self.layout
        for unit, count in zip(members, counts, strict=True):
            row = layout.units[unit]
            for k in range(count):
                request = int(row[kernel.TIME] + k * row[kernel.STEP] + row[kernel.OFFSET])
                link, number = kernel.wanting(unit, request, layout.units, layout.links)
                while link >= 0:
                    source = int(layout.links[link, kernel.SOURCE])
                    self._reach(source, number)
                    link, number = kernel.wanting(unit, request, layout.units, layout.links)
            if row[kernel.ROWS] - (row[kernel.NEWEST] + 1 - row[kernel.BASE]) < count:
                self._pass_on()
                kernel.compact(unit, layout.units, layout.heap)

    def _reach(self, source: int, number: int) -> None:
        """Step the group of a component outside the present one until it has a sample."""
        control, stack = self.layout.control, self.layout.stack
        before = control.copy(), stack.copy()
        stack[0] = self.layout.units[source, kernel.GROUP], source, number
        control[kernel.DEPTH], control[kernel.PENDING] = 1, -1
        self._run(np.iinfo(np.int64).min)
        control[:], stack[:] = before

    def step_alone(self, unit: int, inputs: FloatArray | None = None) -> None:
        """Step one component, with inputs that are given or those that its links have."""
        layout, row = self.layout, self.layout.units[unit]
        if inputs is not None:
            layout.values(unit)[:] = inputs
            row[kernel.FILLED] = 1
        arrays = layout.units, layout.links, layout.index, layout.heap, layout.room.ctypes.data, layout.control
        while True:
            code = kernel.step_alone(unit, layout.clock, *arrays)
            if code == kernel.DONE:
                return
            if code == kernel.CALL:
                self.call(unit)
            elif code == kernel.WEIGHTS:
                layout.supply_weights()
            else:
                self._failed(unit)

    # The end

    def terminate(self) -> None:
        """End the simulation of every component. A component that fails in it only causes a note."""
        if self._pool is not None:
            self._pool.shutdown()
        for instance in self.instances:
            try:
                instance.terminate()
            except Exception as error:
                self._notes.append(f"{instance.name}: failed while terminating: {error}")

    def summary(self) -> RunSummary:
        """Summarize what happened so far."""
        notes = list(self._notes)
        tally = self._tally
        if tally["windows"]:
            mean = tally["steps"] / tally["windows"]
            if self.system.algorithm == "iterative":
                notes.append(f"{tally['windows']} windows took {mean:.3g} iterations each")
            else:
                notes.append(
                    f"{tally['windows']} windows of {mean:.3g} steps in the mean, {tally['repeated']} repeated over "
                    f"fewer, {tally['above']} of one step with a difference above the tolerance"
                )
        if self._discarded:
            notes.append(f"{self._discarded} steps were discarded by a component and taken in pieces")
        return RunSummary(
            start=self.start,
            stop=self._stop,
            components=tuple(
                ComponentSummary(
                    name=instance.name,
                    steps=int(row[kernel.STEPS]),
                    time=int(row[kernel.TIME]),
                    wall_time=int(row[kernel.NANOSECONDS]) / NANOSECONDS_PER_SECOND,
                )
                for instance, row in zip(self.instances, self.layout.units, strict=True)
            ),
            wall_time=(perf_counter_ns() - self._began) / NANOSECONDS_PER_SECOND,
            initialization_sweeps=self._sweeps,
            notes=tuple(notes),
        )


def run(
    system: System,
    stop: int,
    start: int = 0,
    observers: Sequence[Observer] = (),
    checkpoints: Checkpoints | None = None,
) -> RunSummary:
    """Run a system from start to stop, and free its instances whatever happens.

    Parameters
    ----------
    system
        Components, connections and events; its instances cannot be used again.
    stop, start
        Stop and start time in ns.
    observers
        Who gets the samples.
    checkpoints
        Where and how often the state of the run is kept, and the one from which it goes on.

    Raises
    ------
    WiringError
        If the system is not wired well, a parameter is wrong, or the stop time is not later than the start
        time.
    FmuError
        If a component cannot be loaded or initialized.
    StepError
        If a component fails in a step or gives a value that is not finite.
    CheckpointError
        If a checkpoint cannot be written, or is of another system.
    """
    try:
        if stop <= start:
            raise WiringError(
                f"the stop time {to_seconds(stop)} s is not later than the start time {to_seconds(start)} s"
            )
        if checkpoints is not None:
            require_serializable(system)
        watching = observers if checkpoints is None else (checkpoints.spool, *observers)
        master = Master(system, watching)
        reason: BaseException | None = None
        try:
            master.initialize(start, checkpoints)
            _advance(master, start, stop, checkpoints)
            master.terminate()
        except BaseException as error:
            reason = error
            raise
        finally:
            for observer in observers:
                observer.stopped(reason, master.summary())
            if checkpoints is not None:
                checkpoints.stopped(reason)
        return master.summary()
    finally:
        for component in system.components:
            with suppress(Exception):  # the first error matters, and the others must still be freed
                component.instance.free()


def _advance(master: Master, start: int, stop: int, checkpoints: Checkpoints | None) -> None:
    """Step to the end, with pauses for events and checkpoints; of one time the events come first."""
    resumed = checkpoints.resumed if checkpoints is not None else None
    begin = start if resumed is None else resumed.time
    if resumed is None:
        master.change(start)
    saves = () if checkpoints is None else checkpoints.times(begin, stop)
    for time, _ in groupby(merge(due_times(master.system.events, begin, stop), saves, [stop])):
        master.advance(time)
        if time == stop:
            return
        master.change(time)
        if checkpoints is not None and time % checkpoints.every == 0:
            checkpoints.save(master, time)
