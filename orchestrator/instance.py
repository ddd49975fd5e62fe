"""What the master steps: the interface of a component instance, and one made of plain Python functions.

An instance lives through these calls, in this order: `set_parameters`, `bind`, `enter_initialization`, any
number of `set_inputs` and `get_outputs`, `exit_initialization`, then `set_inputs`, `step`, `get_outputs`
once a step, `change` now and then between two steps, and at the end `terminate` and `free`.
"""

import copy
import difflib
import math
import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import StepError, WiringError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A variable of a component, as its model description declares it.

    Parameters
    ----------
    name
        Unique name within the component.
    causality
        ``parameter``, ``calculatedParameter``, ``input``, ``output``, ``local`` or ``independent``.
    variability
        ``constant``, ``fixed``, ``tunable``, ``discrete`` or ``continuous``.
    type
        ``Real``, ``Integer``, ``Boolean`` or ``String``, whatever the width of a number.
    unit
        Unit string, or None when none is declared.
    description
        Text for people.
    start
        Start value of the type, or None.
    derivative_of
        Name of the variable of which this one is the time derivative, or None.
    depends_on
        Names of the inputs on which an output depends directly; None where nothing is declared, which means all.
    """

    name: str
    causality: str
    variability: str = "continuous"
    type: str = "Real"
    unit: str | None = None
    description: str = ""
    start: float | int | bool | str | None = None
    derivative_of: str | None = None
    depends_on: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A unit by the base units of SI, as FMI defines it: value in base units = factor * value + offset.

    Parameters
    ----------
    exponents
        Of kg, m, s, A, K, mol, cd and rad.
    factor, offset
        To base units.
    """

    exponents: tuple[int, int, int, int, int, int, int, int] = (0, 0, 0, 0, 0, 0, 0, 0)
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NativeCalls:
    """Addresses by which the compiled loop steps an instance without Python; see `tlpsim.orchestrator.loop.native`.

    Every address is a whole number. The instance keeps what they point to alive, and in its place, until it is bound
    again or freed.

    Parameters
    ----------
    version
        2 or 3: which FMI's functions they are.
    instance
        The fmi2Component or fmi3Instance.
    set_values, do_step, get_values
        fmi2SetReal or fmi3SetFloat64, fmi2DoStep or fmi3DoStep, fmi2GetReal or fmi3GetFloat64.
    input_references, output_references
        Value references of the calls, unsigned 32-bit, shape (number of references,). Those of arrays stand for all of
        their elements.
    inputs, outputs
        Buffers of the values of the calls, float64, shape (number of values,).
    input_places, output_places
        Places in these buffers of the bound inputs and outputs, int64, shape (number of bound ones,).
    """

    version: int
    instance: int
    set_values: int
    do_step: int
    get_values: int
    input_references: NDArray[np.uint32]
    output_references: NDArray[np.uint32]
    inputs: FloatArray
    outputs: FloatArray
    input_places: NDArray[np.int64]
    output_places: NDArray[np.int64]


def nearest_match(name: str, candidates: Iterable[str]) -> str:
    """Text for the end of an error message that names the nearest candidate; empty if none is near."""
    matches = difflib.get_close_matches(name, list(candidates), n=1, cutoff=0.5)
    return f"; nearest match: '{matches[0]}'" if matches else ""


class Instance(ABC):
    """One instance of a component model.

    Attributes
    ----------
    name
        Name of the component, unique in a system.
    variables
        Declared scalar variables by name; the elements of an array are ``x[1]``, ``x[2]`` or ``x[1,1]``, ``x[1,2]``.
    arrays
        Shapes of array variables by name, as ``x``.
    units
        Definitions of units by name, as far as the component gives them.
    """

    name: str
    variables: Mapping[str, Variable]
    arrays: Mapping[str, tuple[int, ...]] = MappingProxyType({})
    units: Mapping[str, Unit] = MappingProxyType({})

    can_get_and_set_state: bool = False
    can_serialize_state: bool = False
    clock: Callable[[], float] | None = None
    """The master's function of the component's own time in s, for what is logged within a step."""

    @abstractmethod
    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters, and start values of inputs, before the initialization.

        Raises
        ------
        WiringError
            If a name is unknown, is neither a parameter nor an input, or a value is not of the declared type.
        """

    def change(self, values: Mapping[str, object]) -> None:
        """Set inputs that are not bound, and tunable parameters, between two steps.

        Raises
        ------
        WiringError
            As `set_parameters`.
        """
        self.set_parameters(values)

    @abstractmethod
    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Fix which numerical variables `set_inputs` and `get_outputs` pass as float64, and in which order.

        An integer is rounded, and a boolean is true from 0.5 on.
        """

    @abstractmethod
    def enter_initialization(self, start_time: float) -> None:
        """Set the start time in s and enter the initialization mode."""

    @abstractmethod
    def exit_initialization(self) -> None:
        """Leave the initialization mode; the instance can be stepped from now on."""

    @abstractmethod
    def set_inputs(self, values: FloatArray) -> None:
        """Set the bound inputs, shape (number of inputs,). The array is not kept."""

    @abstractmethod
    def step(self, time: float, size: float) -> None:
        """Step from `time` to `time + size`, both in s.

        Raises
        ------
        StepError
            If the component refuses the step or fails in it.
        """

    @abstractmethod
    def get_outputs(self, into: FloatArray) -> None:
        """Write the bound outputs into an array of shape (number of outputs,)."""

    def native_calls(self) -> NativeCalls | None:
        """Addresses for the compiled loop, valid after `bind` and the initialization; None where Python is needed."""
        return None

    def native_failure(
        self, function: str, time: float, size: float, status: int, last_time: float = math.nan
    ) -> StepError:
        """The error for a status that the compiled loop got from one of the addresses.

        A DiscardError where the step can go on in smaller ones.

        Parameters
        ----------
        function
            ``setting inputs``, ``doStep`` or ``getting outputs``.
        time, size
            Of the step, s.
        last_time
            What a step of FMI 3.0 gave as its last successful time, s.
        """
        return StepError(
            f"{self.name}: {function} in the step of {size:.9g} s at t = {time:.9g} s gave status {status}"
        )

    def last_successful_time(self) -> float | None:
        """Time in s up to which a discarded step was computed; None where the component does not say."""
        return None

    def get_state(self) -> object:
        """Return a copy of the internal state, for `set_state`."""
        raise StepError(f"{self.name}: the component cannot save its state")

    def set_state(self, state: object) -> None:
        """Go back to a saved state; the state stays valid."""
        raise StepError(f"{self.name}: the component cannot restore its state")

    @abstractmethod
    def free_state(self, state: object) -> None:
        """Release a saved state."""

    def serialize_state(self, state: object) -> bytes:
        """Turn a saved state into bytes."""
        raise StepError(f"{self.name}: the component cannot serialize its state")

    def deserialize_state(self, data: bytes) -> object:
        """Turn bytes of `serialize_state` into a state for `set_state`."""
        raise StepError(f"{self.name}: the component cannot deserialize a state")

    @abstractmethod
    def terminate(self) -> None:
        """End the simulation; outputs can still be read."""

    @abstractmethod
    def free(self) -> None:
        """Release everything the instance holds. Harmless when called again."""

    def describe(self) -> dict[str, str]:
        """Return where the component comes from, for the record of a run."""
        return {}


def _is_real(value: object) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


_TYPE_CHECKS: dict[str, tuple[Callable[[object], bool], Callable[[Any], object]]] = {
    "Real": (_is_real, float),
    "Integer": (_is_integer, int),
    "Boolean": (lambda value: isinstance(value, bool | np.bool_), bool),
    "String": (lambda value: isinstance(value, str), str),
}

_SETTABLE_CAUSALITIES = ("parameter", "input")


def checked_parameters(name: str, variables: Mapping[str, Variable], values: Mapping[str, object]) -> dict[str, Any]:
    """Check parameter values against the declared variables of a component.

    Parameters
    ----------
    name
        Name of the component, for error messages.
    variables
        Declared variables by name.
    values
        Parameter values by variable name.

    Returns
    -------
    The values as float, int, bool or str.

    Raises
    ------
    WiringError
        If a name is unknown, is neither a parameter nor an input, or a value is not of the declared type.
    """
    result: dict[str, Any] = {}
    for key, value in values.items():
        variable = variables.get(key)
        if variable is None:
            raise WiringError(f"{name}: no variable '{key}' to set as a parameter{nearest_match(key, variables)}")
        if variable.causality not in _SETTABLE_CAUSALITIES or variable.variability == "constant":
            raise WiringError(
                f"{name}: '{key}' is {variable.causality}, {variable.variability}, and cannot be set; "
                "only parameters and start values of inputs can"
            )
        accepts, convert = _TYPE_CHECKS[variable.type]
        if not accepts(value):
            raise WiringError(f"{name}: parameter '{key}' = {value!r} is not of the type {variable.type}")
        converted = convert(value)
        if isinstance(converted, float) and not math.isfinite(converted):
            raise WiringError(f"{name}: parameter '{key}' = {value!r} is not a finite number")
        result[key] = converted
    return result


Values = MutableMapping[str, Any]
"""Parameters, inputs, outputs and private state of a `PythonInstance`, by name."""


class PythonInstance(Instance):
    """A component made of plain functions.

    The functions share one mapping of names to values, which holds parameters, inputs and outputs, and
    whatever else the functions keep there; saving the state copies it.

    Parameters
    ----------
    name
        Name of the component.
    step
        Function (values, time, size) that reads the inputs and writes the outputs of time + size (s).
    inputs, outputs, parameters
        Start values by name. Inputs and outputs are Real; a parameter has the type of its value.
    initialize
        Function (values, time) that writes the outputs of the start time. Called in the initialization mode
        whenever outputs are asked for, so that outputs can depend on inputs: without it none depends directly on
        one.
    units
        Units by variable name.
    derivatives
        For an output that is the time derivative of another one, the name of that one, by the output's name.
    tunable
        Names of the parameters that can change in a run.
    on_free
        Called once when the instance is freed.
    """

    can_get_and_set_state = True
    can_serialize_state = True

    def __init__(
        self,
        name: str,
        step: Callable[[Values, float, float], None],
        *,
        inputs: Mapping[str, float] = MappingProxyType({}),
        outputs: Mapping[str, float] = MappingProxyType({}),
        parameters: Mapping[str, float | int | bool | str] = MappingProxyType({}),
        initialize: Callable[[Values, float], None] | None = None,
        units: Mapping[str, str] = MappingProxyType({}),
        derivatives: Mapping[str, str] = MappingProxyType({}),
        tunable: Sequence[str] = (),
        on_free: Callable[[], None] | None = None,
    ) -> None:
        self.name = name
        self.values: dict[str, Any] = {**parameters, **inputs, **outputs}
        self._step = step
        self._initialize = initialize
        self._on_free = on_free
        self._initializing = False
        self._start_time = 0.0
        self._inputs: tuple[str, ...] = ()
        self._outputs: tuple[str, ...] = ()
        declared = [(key, "parameter", value) for key, value in parameters.items()]
        declared += [(key, "input", value) for key, value in inputs.items()]
        declared += [(key, "output", value) for key, value in outputs.items()]
        self.variables = {
            key: Variable(
                name=key,
                causality=causality,
                variability=("tunable" if key in tunable else "fixed") if causality == "parameter" else "continuous",
                type=_type_name(value) if causality == "parameter" else "Real",
                unit=units.get(key),
                start=value,
                derivative_of=derivatives.get(key),
                depends_on=() if initialize is None and causality == "output" else None,
            )
            for key, causality, value in declared
        }

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters; see `Instance`."""
        self.values.update(checked_parameters(self.name, self.variables, values))

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Fix the order of inputs and outputs; see `Instance`."""
        self._inputs, self._outputs = tuple(inputs), tuple(outputs)

    def enter_initialization(self, start_time: float) -> None:
        """Enter the initialization mode; see `Instance`."""
        self._initializing, self._start_time = True, start_time

    def exit_initialization(self) -> None:
        """Leave the initialization mode; see `Instance`."""
        self._update_initial_outputs()
        self._initializing = False

    def _update_initial_outputs(self) -> None:
        if self._initialize is not None:
            self._initialize(self.values, self._start_time)

    def set_inputs(self, values: FloatArray) -> None:
        """Set the bound inputs; see `Instance`."""
        self.values.update(zip(self._inputs, values.tolist(), strict=True))

    def step(self, time: float, size: float) -> None:
        """Call the step function; see `Instance`."""
        self._step(self.values, time, size)

    def get_outputs(self, into: FloatArray) -> None:
        """Read the bound outputs; see `Instance`."""
        if self._initializing:
            self._update_initial_outputs()
        values = self.values
        into[:] = [values[key] for key in self._outputs]

    def get_state(self) -> object:
        """Return a deep copy of the values."""
        return copy.deepcopy(self.values)

    def set_state(self, state: object) -> None:
        """Go back to saved values."""
        if not isinstance(state, dict):
            raise StepError(f"{self.name}: {type(state).__name__} is not a state of this component")
        self.values = copy.deepcopy(state)

    def free_state(self, state: object) -> None:
        """Nothing to release: a saved state is an ordinary object."""

    def serialize_state(self, state: object) -> bytes:
        """Pickle a saved state."""
        return pickle.dumps(state)

    def deserialize_state(self, data: bytes) -> object:
        """Unpickle a saved state; only for data that this program wrote."""
        return pickle.loads(data)

    def terminate(self) -> None:
        """Nothing to end."""

    def free(self) -> None:
        """Call the `on_free` function, the first time."""
        on_free, self._on_free = self._on_free, None
        if on_free is not None:
            on_free()


def _type_name(value: object) -> str:
    return next(name for name, (accepts, _) in reversed(_TYPE_CHECKS.items()) if accepts(value))
