"""What instances of FMUs of FMI 2.0 and 3.0 have in common: library, values, states, failures.

The functions of the shared library are called directly, on buffers that are made once: a list of Python numbers for
each call would cost more than the rest of the master.
"""

import ctypes
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NoReturn

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import DiscardError, FmuError, StepError, TlpsimError, WiringError
from tlpsim.orchestrator.fmi.description import CO_SIMULATION, extracted, library_member, read_description
from tlpsim.orchestrator.fmi.log import STATUS_NAMES, Log
from tlpsim.orchestrator.fmi.model_variables import Place, element_names
from tlpsim.orchestrator.fmi.output_derivatives import DerivativeBlock, output_derivatives
from tlpsim.orchestrator.fmi.python_fmu import is_python_fmu, release_state_at_exit
from tlpsim.orchestrator.fmi.value_block import ValueBlock
from tlpsim.orchestrator.instance import Instance, NativeCalls, checked_parameters

FloatArray = NDArray[np.float64]

WARNING, DISCARD, FATAL = 1, 2, 4
_GRAVE = ("Warning", "Discard", "Error", "Fatal", "Pending")
"""Words in the names of the log categories to ask for; in all of them, some FMUs log every call that they get."""
_alive: dict[str, int] = {}  # instances by digest, of FMUs that can be instantiated only once


class FmiInstance(Instance):
    """Base of the instances of co-simulation FMUs, loaded into this process on first use.

    Parameters
    ----------
    name
        Name of the component.
    path
        Path of the FMU.

    Raises
    ------
    FmuError
        As `read_description`, and if the FMU is of another version of FMI, is not for co-simulation, or has no library
        for this platform.
    """

    version: int
    """Of FMI."""
    kind = CO_SIMULATION
    """Which interface of the FMU is used."""
    _state_word: str
    """How the functions of the version spell FMUState."""
    _deserialize_word: str
    _numbers: ClassVar[Mapping[str, type[np.generic]]]
    """Numeric types by their FMI names; the first one is that of a float64."""

    def __init__(self, name: str, path: str | Path) -> None:
        self.name = name
        self.description = read_description(path)
        if self.description.fmi_major != self.version:
            raise FmuError(
                f"{path}: the FMU is of FMI version {self.description.fmi_version}, not {self.version}.0; "
                "tlpsim.orchestrator.fmi.fmi2.open_fmu takes either"
            )
        self._member = library_member(self.description, self.kind)
        order = self.description.kinds[self.kind].max_output_derivative_order if self.kind == CO_SIMULATION else 0
        self._output_derivatives = output_derivatives(self.description.variables, self.description.places, order)
        own = {name: each.variable for name, each in self._output_derivatives.items()}
        self.variables = {**self.description.variables, **own}
        self.arrays = self.description.arrays
        self.units = self.description.units
        self._capabilities = self.description.kinds[self.kind].capabilities
        self.can_get_and_set_state = self._capabilities["canGetAndSetFMUstate"]
        self.can_serialize_state = self._capabilities["canSerializeFMUstate"]
        self._log = Log(name)
        categories = () if is_python_fmu(self.description) else self.description.log_categories
        self._log_categories = [name.encode() for name in categories if any(word in name for word in _GRAVE)]
        self._library: Any = None
        self._component: Any = None
        self._given: dict[str, Any] = {}
        self._inputs: list[ValueBlock] = []
        self._outputs: list[ValueBlock | DerivativeBlock] = []
        self._do_step: Any = None
        self._states = 0
        self._running = False
        self._stepped = False
        self._broken = False

    # Failures

    @property
    def messages(self) -> tuple[str, ...]:
        """The newest log messages of the FMU, oldest first, one line each."""
        return self._log.texts()

    def _failure(self, status: int, function: str, error: type[TlpsimError]) -> TlpsimError:
        """The error for a status, after which the instance is what FMI says that it is then."""
        cause = f"returned {STATUS_NAMES.get(status, f'status {status}')}{self._log.cause()}"
        if status == FATAL:
            self._abandon()
        if status == DISCARD:
            cause += "; it asks for the end of the simulation" if self._is_ended() else ""
        else:
            self._running = False
        return error(f"{self.name}: {function} at t = {self._log.time:.9g} s {cause}")

    def _is_ended(self) -> bool:
        """Whether the FMU discarded a step because the simulation is to end."""
        return False

    def _step_error(self, status: int) -> type[StepError]:
        """DiscardError only where the step can go on from where it was discarded."""
        return DiscardError if status == DISCARD and not self._is_ended() else StepError

    def _check(self, status: int, function: str, error: type[TlpsimError]) -> None:
        if status == WARNING:
            self._log.add_warning(function)
        elif status:
            raise self._failure(status, function, error)

    def _check_step(self, status: int, size: float) -> None:
        """Act on a status of the step function."""
        self._check(status, f"fmi{self.version}DoStep of {size:.9g} s", self._step_error(status))

    def native_failure(
        self, function: str, time: float, size: float, status: int, last_time: float = math.nan
    ) -> StepError:
        """The error for a status that the compiled loop got; see `Instance`."""
        kind = next(iter(self._numbers))
        names = {"setting inputs": f"Set{kind}", "doStep": f"DoStep of {size:.9g} s", "getting outputs": f"Get{kind}"}
        named = f"fmi{self.version}{names[function]}" if function in names else function
        self._log.time = time
        error = self._failure(status, named, self._step_error(status) if function == "doStep" else StepError)
        assert isinstance(error, StepError)
        return error

    def _abandon(self) -> None:
        """Call no function of the FMU any more (FMI 2.0.4, section 2.1.3; FMI 3.0.1, section 2.2.4)."""
        self._broken = True
        self._do_step = self._refuse
        for block in (*self._inputs, *self._outputs):
            block.function = self._refuse

    def _refuse(self, *arguments: object) -> NoReturn:
        raise StepError(f"{self.name}: the FMU returned fatal before; none of its functions may be called any more")

    # Library

    def _function(self, name: str, *types: Any, result: Any = ctypes.c_int) -> Any:
        """Function of the library; without `types` its arguments must be ready for C."""
        try:
            function = getattr(self._library, name)
        except AttributeError:
            raise FmuError(
                f"{self.name}: the library {self._member} of {self.description.path} has no function {name}; "
                "export the FMU again"
            ) from None
        function.argtypes = types or None
        function.restype = result
        return function

    def _call(self, error: type[TlpsimError], name: str, types: Sequence[Any] = (), *arguments: Any) -> None:
        """Call a function of the instance and act on its status."""
        if self._broken:
            self._refuse()
        status = self._function(name, ctypes.c_void_p, *types)(self._component, *arguments)
        self._check(status, name, error)

    def _instantiate(self) -> None:
        if self._broken:
            self._refuse()
        if self._component is not None:
            return
        digest, path = self.description.sha256, self.description.path
        once = self._capabilities["canBeInstantiatedOnlyOncePerProcess"]
        if once and _alive.get(digest, self._log.number) != self._log.number:
            raise FmuError(
                f"{self.name}: {path} can be instantiated only once per process; give the others a process of their own"
            )
        folder = extracted(self.description)
        try:
            self._library = ctypes.CDLL(str(folder / self._member))
        except OSError as error:
            raise FmuError(f"{self.name}: the library of {path} cannot be loaded: {error}") from error
        self._log.open()
        component = self._new_component(folder / "resources")
        release_state_at_exit(self._library)
        if not component:
            self._log.close()
            cause = self._log.cause() or ": it gave no reason"
            raise FmuError(f"{self.name}: {path} cannot be instantiated{cause}{self._hint()}")
        self._component = ctypes.c_void_p(component)
        if once:
            _alive[digest] = self._log.number
        if self._log_categories:
            array = (ctypes.c_char_p * len(self._log_categories))(*self._log_categories)
            flag = ctypes.c_int if self.version == 2 else ctypes.c_bool
            types = (ctypes.c_void_p, flag, ctypes.c_size_t, ctypes.c_void_p)
            # not worth an error if it fails
            self._function(f"fmi{self.version}SetDebugLogging", *types)(self._component, True, len(array), array)

    def _hint(self) -> str:
        if self._capabilities["needsExecutionTool"]:
            return "; it needs the tool that made it: install and license that here"
        if self._capabilities["hasEventMode"]:
            return "; it has an event mode, which this master does not use: export it to run without"
        return ""

    def _new_component(self, resources: Path) -> int | None:
        """Instantiate; address of the component, or None."""
        raise NotImplementedError

    # Values

    def _set(self, place: Place, values: Sequence[Any]) -> None:
        """Set all the elements of a variable before the initialization."""
        if place.type == "String":
            array: Any = (ctypes.c_char_p * len(values))(*(str(value).encode() for value in values))
        else:
            array = np.array(values, dtype=self._numbers[place.type]).ctypes.data_as(ctypes.c_void_p)
        reference = (ctypes.c_uint32 * 1)(place.reference)
        counts = (ctypes.c_size_t(1), array, *self._value_count(len(values)))
        self._call(FmuError, f"fmi{self.version}Set{place.type}", (), reference, *counts)

    def _value_count(self, count: int) -> tuple[Any, ...]:
        """What the set and get functions of FMI 3.0 take after the values."""
        return () if self.version == 2 else (ctypes.c_size_t(count),)

    def _start_values(self, place: Place) -> list[Any]:
        """Values of all the elements of a variable: given, or start values, or zero."""
        names = element_names(place.variable, self.arrays.get(place.variable, ()))
        starts = [self._given.get(name, self.variables[name].start) for name in names]
        return [("" if place.type == "String" else 0) if start is None else start for start in starts]

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters, an array whole when one of its elements is given; see `Instance`."""
        checked = checked_parameters(self.name, self.variables, values)
        places = self.description.places
        for name, value in checked.items():
            number = self._numbers.get(places[name].type)
            if number is not None and issubclass(number, np.integer):
                limits = np.iinfo(number)
                if not limits.min <= value <= limits.max:
                    raise WiringError(
                        f"{self.name}: parameter '{name}' = {value} is not within {limits.min} … {limits.max}, "
                        f"the range of its type {places[name].type}"
                    )
        self._instantiate()
        self._given.update(checked)
        for place in {places[name].reference: places[name] for name in checked}.values():
            self._set(place, self._start_values(place))

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Allocate the buffers of `set_inputs` and `get_outputs`, one for each type; see `Instance`."""
        self._instantiate()
        self._inputs = self._blocks("Set", inputs)
        self._outputs = [*self._blocks("Get", outputs), *self._derivative_blocks(outputs)]

    def _blocks(self, verb: str, names: Sequence[str], continuous: bool | None = None) -> list[ValueBlock]:
        """Make the blocks of some variables: of all of them, of the continuous ones, or of those that are not."""
        places = self.description.places
        for name in names:
            if name in self._output_derivatives and verb == "Get":
                continue
            if name not in places or places[name].type not in self._numbers:
                raise WiringError(f"{self.name}: '{name}' is not a numerical variable, and cannot be bound")
        blocks = []
        for kind, number in self._numbers.items():
            bound = [
                position
                for position, name in enumerate(names)
                if name not in self._output_derivatives
                and places[name].type == kind
                and continuous in (None, self.variables[name].variability == "continuous")
            ]
            if not bound:
                continue
            function = f"fmi{self.version}{verb}{kind}"
            block = ValueBlock(self._function(function), function, number, names, bound, places)
            block.arguments = (
                self._component,
                ctypes.c_void_p(block.references.ctypes.data),
                ctypes.c_size_t(len(block.references)),
                ctypes.c_void_p(block.values.ctypes.data),
                *self._value_count(len(block.values)),
            )
            if verb == "Set":
                block.fill(self._start_values)
            blocks.append(block)
        return blocks

    def _derivative_blocks(self, names: Sequence[str]) -> list[DerivativeBlock]:
        bound = [position for position, name in enumerate(names) if name in self._output_derivatives]
        if not bound:
            return []
        name = "fmi2GetRealOutputDerivatives" if self.version == 2 else "fmi3GetOutputDerivatives"
        chosen = [self._output_derivatives[names[position]] for position in bound]
        block = DerivativeBlock(self._function(name), name, chosen, bound, lambda: self._stepped)
        block.arguments = (
            self._component,
            ctypes.c_void_p(block.references.ctypes.data),
            ctypes.c_size_t(len(block.references)),
            ctypes.c_void_p(block.orders.ctypes.data),
            ctypes.c_void_p(block.values.ctypes.data),
            *self._value_count(len(block.values)),
        )
        return [block]

    def set_inputs(self, values: FloatArray) -> None:
        """Set the bound inputs; see `Instance`."""
        self._pass(self._inputs, values)

    def _pass(self, blocks: Iterable[ValueBlock], values: FloatArray) -> None:
        """Set the inputs of some blocks, from the values of all bound inputs."""
        for block in blocks:
            block.take(values, self.name)
            status = block.function(*block.arguments)
            if status:
                self._check(status, block.name, StepError if self._running else FmuError)

    def get_outputs(self, into: FloatArray) -> None:
        """Read the bound outputs; see `Instance`."""
        for block in self._outputs:
            status = block.function(*block.arguments)
            if status:
                self._check(status, block.name, StepError if self._running else FmuError)
            block.give(into)

    def native_calls(self) -> NativeCalls | None:
        """Addresses for the compiled loop where all bound variables are Real or Float64; see `Instance`."""
        kind, number = next(iter(self._numbers.items()))
        if (
            self._broken
            or self._component is None
            or any(block.type is not number for block in (*self._inputs, *self._outputs))
        ):
            return None
        self._log.clock = self.clock
        nothing = ValueBlock(None, "", number, (), (), self.description.places)
        inputs = self._inputs[0] if self._inputs else nothing
        outputs = next((block for block in self._outputs if isinstance(block, ValueBlock)), nothing)

        def address(name: str) -> int:
            return ctypes.cast(self._function(name), ctypes.c_void_p).value or 0

        return NativeCalls(
            version=self.version,
            instance=self._component.value,
            set_values=address(f"fmi{self.version}Set{kind}"),
            do_step=ctypes.cast(self._do_step, ctypes.c_void_p).value or 0,
            get_values=address(f"fmi{self.version}Get{kind}"),
            input_references=inputs.references,
            output_references=outputs.references,
            inputs=inputs.values,
            outputs=outputs.values,
            input_places=inputs.places,
            output_places=outputs.places,
        )

    # Life

    def exit_initialization(self) -> None:
        """Leave the initialization mode; see `Instance`."""
        self._call(FmuError, f"fmi{self.version}ExitInitializationMode")
        self._running = True

    def _state_call(self, capable: bool, what: str, verb: str, types: Sequence[Any], *arguments: Any) -> None:
        if not capable:
            raise StepError(f"{self.name}: the FMU {self.description.path} cannot {what}")
        self._call(StepError, f"fmi{self.version}{verb}", types, *arguments)

    def get_state(self) -> object:
        """Return a handle of a state inside the FMU; give it to `free_state` when done."""
        state = ctypes.c_void_p()
        verb = f"Get{self._state_word}"
        self._state_call(self.can_get_and_set_state, "save its state", verb, (ctypes.c_void_p,), ctypes.byref(state))
        self._states += 1
        return state

    def set_state(self, state: object) -> None:
        """Go back to a saved state."""
        verb = f"Set{self._state_word}"
        self._state_call(self.can_get_and_set_state, "restore its state", verb, (ctypes.c_void_p,), state)

    def free_state(self, state: object) -> None:
        """Release a saved state."""
        assert isinstance(state, ctypes.c_void_p)
        verb = f"Free{self._state_word}"
        self._state_call(self.can_get_and_set_state, "release a state", verb, (ctypes.c_void_p,), ctypes.byref(state))
        self._states -= 1

    def serialize_state(self, state: object) -> bytes:
        """Turn a saved state into bytes."""
        capable, what, size = self.can_serialize_state, "serialize its state", ctypes.c_size_t()
        verb = f"Serialized{self._state_word}Size"
        self._state_call(capable, what, verb, (ctypes.c_void_p,) * 2, state, ctypes.byref(size))
        data = ctypes.create_string_buffer(size.value)
        types = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t)
        self._state_call(capable, what, f"Serialize{self._state_word}", types, state, data, size)
        return data.raw

    def deserialize_state(self, data: bytes) -> object:
        """Turn bytes into a state for `set_state`."""
        state = ctypes.c_void_p()
        types = (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p)
        verb = f"{self._deserialize_word}{self._state_word}"
        self._state_call(
            self.can_serialize_state, "deserialize a state", verb, types, data, len(data), ctypes.byref(state)
        )
        self._states += 1
        return state

    def terminate(self) -> None:
        """End the simulation, if it runs and did not fail."""
        if self._running and not self._broken:
            self._running = False
            self._call(StepError, f"fmi{self.version}Terminate")

    def free(self) -> None:
        """Free the instance, unless it is abandoned.

        The library stays loaded: a Python FMU does not survive a reload.
        """
        component, self._component = self._component, None
        self._inputs, self._outputs = [], []
        if component is not None and not self._broken:
            self._function(f"fmi{self.version}FreeInstance", ctypes.c_void_p, result=None)(component)
        self._log.close()
        if _alive.get(self.description.sha256) == self._log.number:
            del _alive[self.description.sha256]

    def describe(self) -> dict[str, str]:
        """Return path, digest and origin of the FMU."""
        description = self.description
        return {
            "fmu": str(description.path),
            "sha256": description.sha256,
            "model_name": description.model_name,
            "guid": description.guid,
            "generation_tool": description.generation_tool,
            "version": description.version,
        }
