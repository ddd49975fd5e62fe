"""Model-exchange FMUs as components: the master solves their differential equations and handles their events.

State events are where an event indicator changes between > 0 and <= 0; they are located to the last digit of the time.
Between the calls of the master the FMU is in continuous-time mode. Events at the end of a step are handled in it, so
that outputs are the values after them.
"""

import ctypes
import math
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.fmi2 import fmi2EventInfo
from numpy.typing import NDArray

from tlpsim.loads.errors import SolverError, StepError
from tlpsim.orchestrator.fmi.description import MODEL_EXCHANGE
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.fmi.fmi3 import Fmi3Instance
from tlpsim.orchestrator.fmi.instance_base import DISCARD, FmiInstance
from tlpsim.orchestrator.fmi.ode import OdeStep, SolverOptions, first_time, ode_steps
from tlpsim.orchestrator.fmi.value_block import ValueBlock
from tlpsim.orchestrator.instance import NativeCalls

FloatArray = NDArray[np.float64]

_MOST_EVENTS = 1000  # in one step of the master
_MOST_ITERATIONS = 100  # of the discrete states at one event
_SHOWN_STATES = 6

_POINTER, _REAL, _SIZE = ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t


@dataclass(frozen=True, slots=True, kw_only=True)
class _SolverState:
    """What belongs to the state of a component beside the FMU's own.

    Parameters
    ----------
    fmu
        Handle, or bytes, of the state of the FMU.
    states, nominals
        Continuous states and their nominal values, shape (number of states,).
    positive
        Which event indicators are > 0, shape (number of event indicators,).
    next_event
        Time of the next time event, s.
    size
        Step of the solver, s.
    inputs, last_inputs
        Bound inputs, and those at the end of the last step, shape (number of bound inputs,); None before the first.
    """

    fmu: object
    states: FloatArray
    nominals: FloatArray
    positive: NDArray[np.bool_]
    next_event: float
    size: float | None
    inputs: FloatArray | None
    last_inputs: FloatArray | None


class ModelExchange(FmiInstance):
    """Base of the instances of model-exchange FMUs.

    Parameters
    ----------
    name
        Name of the component.
    path
        Path of the FMU.
    options
        How its differential equations are solved.

    Raises
    ------
    FmuError
        As `FmiInstance`, for model exchange.
    """

    kind = MODEL_EXCHANGE
    _flag: Any
    """Type of a boolean."""
    _derivatives_word: str

    def __init__(self, name: str, path: str | Path, options: SolverOptions | None = None) -> None:
        super().__init__(name, path)
        self._options = options or SolverOptions()
        description = self.description
        count = len(description.state_derivatives)
        self._states_now, self._slopes, self._nominals = np.zeros(count), np.zeros(count), np.ones(count)
        self._indicators = np.zeros(description.event_indicators)
        self._positive = np.zeros(description.event_indicators, dtype=np.bool_)
        self._next_event = math.inf
        self._size: float | None = None
        self._given_inputs: FloatArray | None = None
        self._last_inputs: FloatArray | None = None
        self._continuous = np.zeros(0, dtype=np.bool_)
        self._smooth: list[ValueBlock] = []  # of the continuous inputs
        self._jumping: list[ValueBlock] = []  # of the others
        self._span = (0.0, 1.0)  # of the step in which inputs change linearly: its start and size, s
        self._ramps = False
        self._completes = not self._capabilities["completedIntegratorStepNotNeeded"]

    # Calls of the FMU

    def _prepare(self) -> None:
        """Look up the functions that are called often."""
        version = self.version
        self._set_time = self._function(f"fmi{version}SetTime", _POINTER, _REAL)
        self._set_states = self._function(f"fmi{version}SetContinuousStates", _POINTER, _POINTER, _SIZE)
        self._get_slopes = self._function(f"fmi{version}{self._derivatives_word}", _POINTER, _POINTER, _SIZE)
        self._get_indicators = self._function(f"fmi{version}GetEventIndicators", _POINTER, _POINTER, _SIZE)
        self._complete = self._function(
            f"fmi{version}CompletedIntegratorStep", _POINTER, self._flag, _POINTER, _POINTER
        )

    def _place(self, time: float, states: FloatArray) -> bool:
        """Set time, inputs and states; False where the FMU discards them."""
        self._log.time = time
        self._check(self._set_time(self._component, time), f"fmi{self.version}SetTime", StepError)
        if self._ramps and self._last_inputs is not None and self._given_inputs is not None:
            start, size = self._span
            part = min(1.0, (time - start) / size)
            values = self._given_inputs
            if part < 1.0:
                values = self._last_inputs + part * (values - self._last_inputs)
            self._pass(self._smooth, values)
        if not states.size:
            return True
        self._states_now[:] = states
        status = self._set_states(self._component, self._states_now.ctypes.data, states.size)
        if status == DISCARD:
            return False
        self._check(status, f"fmi{self.version}SetContinuousStates", StepError)
        return True

    def _derivatives(self, time: float, states: FloatArray) -> FloatArray:
        """Derivatives of the states; not a number where the FMU discards them."""
        if self._place(time, states):
            status = self._get_slopes(self._component, self._slopes.ctypes.data, states.size)
            if status != DISCARD:
                self._check(status, f"fmi{self.version}{self._derivatives_word}", StepError)
                return self._slopes.copy()
        return np.full(states.size, np.nan)

    def _signs(self) -> NDArray[np.bool_]:
        """Which event indicators are > 0."""
        if self._indicators.size:
            status = self._get_indicators(self._component, self._indicators.ctypes.data, self._indicators.size)
            self._check(status, f"fmi{self.version}GetEventIndicators", StepError)
        return self._indicators > 0.0

    def _changed(self) -> bool:
        return bool((self._signs() != self._positive).any())

    def _read(self, what: str, into: FloatArray) -> None:
        if into.size:
            self._call(StepError, f"fmi{self.version}{what}", (_POINTER, _SIZE), into.ctypes.data, into.size)

    def _discrete_states(self) -> tuple[bool, bool, bool, float]:
        """Update the discrete states once: again?, end of the simulation?, new nominals?, time of the next event."""
        raise NotImplementedError

    def _handle_event(self) -> None:
        self._call(StepError, f"fmi{self.version}EnterEventMode")
        self._settle_discrete_states()

    def _settle_discrete_states(self) -> None:
        """Update the discrete states until they do not change, and go on to continuous time."""
        for _ in range(_MOST_ITERATIONS):
            again, ends, nominals, self._next_event = self._discrete_states()
            if ends:
                raise StepError(f"{self.name}: the FMU ends the simulation at t = {self._log.time:.9g} s")
            if nominals:
                self._read("GetNominalsOfContinuousStates", self._nominals)
            if not again:
                break
        else:
            raise StepError(
                f"{self.name}: the event at t = {self._log.time:.9g} s did not settle in {_MOST_ITERATIONS} updates of "
                "the discrete states; check the model's loops of discrete variables"
            )
        self._call(StepError, f"fmi{self.version}EnterContinuousTimeMode")
        self._read("GetContinuousStates", self._states_now)
        self._positive = self._signs()
        self._size = None

    # The calls of an instance

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Allocate buffers; see `Instance`."""
        super().bind(inputs, outputs)
        self._continuous = np.array([self.variables[name].variability == "continuous" for name in inputs], dtype=bool)
        self._smooth = self._blocks("Set", inputs, continuous=True)
        self._jumping = self._blocks("Set", inputs, continuous=False)
        self._inputs = [*self._smooth, *self._jumping]

    def exit_initialization(self) -> None:
        """Leave the initialization mode, handle what happens at the start, and enter the continuous-time mode."""
        super().exit_initialization()
        self._prepare()
        self._read("GetNominalsOfContinuousStates", self._nominals)
        self._settle_discrete_states()

    def change(self, values: Mapping[str, object]) -> None:
        """Change values, which is an event; see `Instance`."""
        self._call(StepError, f"fmi{self.version}EnterEventMode")
        self.set_parameters(values)
        self._settle_discrete_states()

    def set_inputs(self, values: FloatArray) -> None:
        """Set the bound inputs; discrete ones that change are an event, and are only set then. See `Instance`."""
        before = self._given_inputs
        self._given_inputs = values.copy()
        if not self._running:
            super().set_inputs(values)
            self._last_inputs = self._given_inputs
            return
        if self._jumping and (before is None or (before != values)[~self._continuous].any()):
            self._call(StepError, f"fmi{self.version}EnterEventMode")
            # continuous ones only jump where they are held
            self._pass(self._jumping if self._options.inputs == "linear" else self._inputs, values)
            self._settle_discrete_states()
        self._pass(self._smooth, values)

    def step(self, time: float, size: float) -> None:
        """Solve the differential equations over a step, with its events; see `Instance`.

        Raises
        ------
        StepError
            If the FMU fails or ends the simulation, the solver fails, or there are 1000 events in one step; the message
            has the time and the states.
        """
        if self._broken:
            self._refuse()
        end = time + size
        self._span, self._ramps = (time, size), self._options.inputs == "linear"
        self._place(time, self._states_now.copy())
        events = 0
        if self._changed():  # an input has jumped
            self._handle_event()
        reached = time
        while True:
            while self._next_event <= reached and events < _MOST_EVENTS:
                self._handle_event()
                events += 1
            if events >= _MOST_EVENTS:
                raise StepError(
                    f"{self.name}: {events} events between t = {time:.9g} s and {reached:.9g} s, in one step; "
                    "the model chatters, or its time events do not advance"
                )
            if reached >= end:
                break
            reached, event = self._integrate(reached, min(end, self._next_event))
            if event:
                self._handle_event()
                events += 1
        self._ramps = False
        self._last_inputs = self._given_inputs

    def _integrate(self, start: float, end: float) -> tuple[float, bool]:
        """Solve up to the first event or the end; the time, and whether there is an event to handle."""
        tolerance = self._options.absolute_tolerance or self._options.relative_tolerance
        states = self._states_now.copy()
        scale = tolerance * np.abs(self._nominals)
        reached = start
        try:
            for step in ode_steps(self._derivatives, start, states, end, scale, self._options, self._size):
                reached, states = step.after, step.states
                self._size = step.next_size
                self._place(reached, states)
                crossed = self._changed()
                if crossed:
                    reached, states = self._first_event(step)
                if self._completed() or crossed:
                    return reached, True
        except SolverError as error:
            raise StepError(
                f"{self.name}: the solver {self._options.method} failed at t = {reached:.9g} s, with "
                f"{self._described_states(states)}: {error}"
            ) from error
        return reached, False

    def _first_event(self, step: OdeStep) -> tuple[float, FloatArray]:
        """Go to the first change of an event indicator in a step of the solver; its time and states."""
        between = step.interpolant()
        time = first_time(lambda time: self._place(time, between(time)) and self._changed(), step.before, step.after)
        states = step.states if time == step.after else between(time)
        self._place(time, states)
        return time, states

    def _completed(self) -> bool:
        """Tell the FMU that a step of the solver is complete; whether that is an event."""
        if not self._completes:
            return False
        event, ends = self._flag(), self._flag()
        status = self._complete(self._component, not self._states, ctypes.byref(event), ctypes.byref(ends))
        self._check(status, f"fmi{self.version}CompletedIntegratorStep", StepError)
        if ends.value:
            raise StepError(f"{self.name}: the FMU ends the simulation at t = {self._log.time:.9g} s")
        return bool(event.value)

    def _described_states(self, states: FloatArray) -> str:
        """Names and values of the first states, those that are not finite or have such a derivative first."""
        slopes = self._derivatives(self._log.time or 0.0, states)
        names = [self.variables[name].derivative_of or name for name in self.description.state_derivatives]
        order = sorted(range(len(names)), key=lambda k: bool(np.isfinite(states[k]) and np.isfinite(slopes[k])))
        shown = ", ".join(f"{names[k]} = {states[k]:.6g} (derivative {slopes[k]:.6g})" for k in order[:_SHOWN_STATES])
        return shown + (f" and {len(names) - _SHOWN_STATES} more" if len(names) > _SHOWN_STATES else "")

    def native_calls(self) -> NativeCalls | None:
        """None: the compiled loop cannot solve differential equations."""
        return None

    def last_successful_time(self) -> float | None:
        """None: no step is discarded."""
        return None

    def get_state(self) -> object:
        """Return a copy of the state of the FMU and of the solver; give it to `free_state` when done."""
        return _SolverState(
            fmu=super().get_state(),
            states=self._states_now.copy(),
            nominals=self._nominals.copy(),
            positive=self._positive.copy(),
            next_event=self._next_event,
            size=self._size,
            inputs=self._given_inputs,
            last_inputs=self._last_inputs,
        )

    def set_state(self, state: object) -> None:
        """Go back to a saved state."""
        saved = self._own(state)
        super().set_state(saved.fmu)
        self._states_now[:], self._nominals[:] = saved.states, saved.nominals
        self._positive, self._next_event, self._size = saved.positive, saved.next_event, saved.size
        self._given_inputs, self._last_inputs = saved.inputs, saved.last_inputs

    def _own(self, state: object) -> _SolverState:
        if not isinstance(state, _SolverState):
            raise StepError(f"{self.name}: {type(state).__name__} is not a state of this component")
        return state

    def free_state(self, state: object) -> None:
        """Release a saved state."""
        super().free_state(self._own(state).fmu)

    def serialize_state(self, state: object) -> bytes:
        """Turn a saved state into bytes."""
        saved = self._own(state)
        return pickle.dumps(replace(saved, fmu=super().serialize_state(saved.fmu)))

    def deserialize_state(self, data: bytes) -> object:
        """Turn bytes into a state for `set_state`; only for data that this program wrote."""
        saved = self._own(pickle.loads(data))
        assert isinstance(saved.fmu, bytes)
        return replace(saved, fmu=super().deserialize_state(saved.fmu))

    def describe(self) -> dict[str, str]:
        """Return path, digest and origin of the FMU, and the solver."""
        options = self._options
        return {
            **super().describe(),
            "solver": f"{options.method}, relative tolerance {options.relative_tolerance:g}, inputs {options.inputs}",
        }


class ModelExchangeInstance(ModelExchange, FmuInstance):
    """An instance of an FMI 2.0 model-exchange FMU; see `ModelExchange`."""

    _interface = 0
    _flag = ctypes.c_int
    _derivatives_word = "GetDerivatives"

    def _discrete_states(self) -> tuple[bool, bool, bool, float]:
        info = fmi2EventInfo()
        self._call(StepError, "fmi2NewDiscreteStates", (_POINTER,), ctypes.byref(info))
        return (
            bool(info.newDiscreteStatesNeeded),
            bool(info.terminateSimulation),
            bool(info.nominalsOfContinuousStatesChanged),
            info.nextEventTime if info.nextEventTimeDefined else math.inf,
        )


class Fmi3ModelExchangeInstance(ModelExchange, Fmi3Instance):
    """An instance of an FMI 3.0 model-exchange FMU; see `ModelExchange`."""

    _flag = ctypes.c_bool
    _derivatives_word = "GetContinuousStateDerivatives"

    def _new_component(self, resources: Path) -> int | None:
        return self._made("fmi3InstantiateModelExchange", resources)

    def _discrete_states(self) -> tuple[bool, bool, bool, float]:
        again, ends, nominals, values, has_next = (ctypes.c_bool() for _ in range(5))
        time = _REAL()
        answers = [ctypes.byref(answer) for answer in (again, ends, nominals, values, has_next, time)]
        self._call(StepError, "fmi3UpdateDiscreteStates", (_POINTER,) * 6, *answers)
        return again.value, ends.value, nominals.value, time.value if has_next.value else math.inf
