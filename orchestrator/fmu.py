"""FMI 2.0 co-simulation FMUs: loading and stepping.

FMPy loads the shared library and declares its functions. What happens once a step calls these functions
directly on buffers that are made once, because FMPy's list interface would cost more than the rest of the
master.
"""

import atexit
import contextlib
import ctypes
import itertools
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import fmpy
import fmpy.fmi1
import fmpy.fmi2
import fmpy.logging
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import FmuError, StepError, TlpsimError
from tlpsim.orchestrator.description import FmuDescription, extracted, read_description
from tlpsim.orchestrator.instance import Instance, checked_parameters

FloatArray = NDArray[np.float64]

_STATUS_NAMES = {0: "ok", 1: "warning", 2: "discard", 3: "error", 4: "fatal", 5: "pending"}
_WARNING, _FATAL = 1, 4
_LOG_LENGTH = 64


def _readable(message: bytes | None) -> str:
    """Reduce a log message to one line; of a Python traceback the last line tells what went wrong."""
    text = (message or b"").decode("utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


_loggers: dict[int, Callable[[int, str], None]] = {}
_log_numbers = itertools.count(1)


def _log(environment: int | None, name: bytes, status: int, category: bytes, message: bytes) -> None:
    """File a log message of any FMU under the instance that it comes from.

    Messages of instances that this module did not make go where FMPy puts them.
    """
    log = _loggers.get(environment or 0)
    if log is None:
        fmpy.fmi1.printLogMessage(environment, name, status, category, message)
    else:
        log(status, _readable(message))


_logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(_log)


def _callbacks(number: int, description: FmuDescription) -> Any:
    """Make the callback functions of one instance.

    The messages of most FMUs are printf formats, which FMPy's native proxy completes (and cuts at 2048
    bytes). Those of a Python FMU are finished text, where a stray percent sign would make the proxy read at
    random.
    """
    callbacks = fmpy.fmi2.fmi2CallbackFunctions()
    callbacks.logger = _logger
    callbacks.allocateMemory = fmpy.fmi2.defaultCallbacks.allocateMemory
    callbacks.freeMemory = fmpy.fmi2.defaultCallbacks.freeMemory
    callbacks.componentEnvironment = number
    if "PythonFMU" not in description.generation_tool:
        fmpy.logging.addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


_released_at_exit: set[int] = set()


def _release_python_state_at_exit(library: Any) -> None:
    """Keep the library of a Python FMU from releasing its state twice when the process ends.

    pythonfmu 0.7 releases it in a destructor of the library that runs after the C++ one, which now and then ends the
    process with a corrupted heap. Released before both, neither finds anything to do.
    """
    release = getattr(library, "finalizePythonInterpreter", None)
    if release is not None and library._handle not in _released_at_exit:
        _released_at_exit.add(library._handle)
        atexit.register(release)


_SETTERS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "Real": ("setReal", float),
    "Integer": ("setInteger", int),
    "Boolean": ("setBoolean", int),
    "String": ("setString", str),
}


class FmuInstance(Instance):
    """An instance of an FMI 2.0 co-simulation FMU, loaded into this process on first use.

    Parameters
    ----------
    name
        Name of the component.
    path
        Path of the FMU.

    Raises
    ------
    FmuError
        As `read_description`.
    """

    def __init__(self, name: str, path: str | Path) -> None:
        self.name = name
        self.description = read_description(path)
        self.variables = self.description.variables
        self.can_get_and_set_state = self.description.capabilities["canGetAndSetFMUstate"]
        self.can_serialize_state = self.description.capabilities["canSerializeFMUstate"]
        self._number = next(_log_numbers)
        self._messages: deque[tuple[float, int, str]] = deque(maxlen=_LOG_LENGTH)
        self._fmu: Any = None
        self._callbacks: Any = None
        self._component: Any = None
        self._running = False
        self._broken = False
        self._time = 0.0

    @property
    def messages(self) -> tuple[str, ...]:
        """The newest log messages of the FMU, oldest first, one line each."""
        return tuple(
            f"t = {time:.9g} s, {_STATUS_NAMES.get(status, status)}: {text}" for time, status, text in self._messages
        )

    def _log(self, status: int, text: str) -> None:
        self._messages.append((self._time, status, text))

    def _last_message(self) -> str:
        """Return the gravest message of the current step (the newest such) after a colon, or nothing."""
        current = [(status, text) for time, status, text in self._messages if time == self._time]
        if not current:
            return ""
        gravest = max(status for status, _ in current)
        return next(f": {text}" for status, text in reversed(current) if status == gravest)

    def _fail(self, error: type[TlpsimError], function: str, status: int) -> NoReturn:
        if status == _FATAL:
            self._broken = True
        self._running = False
        raise error(
            f"{self.name}: {function} at t = {self._time:.9g} s returned "
            f"{_STATUS_NAMES.get(status, f'status {status}')}{self._last_message()}"
        )

    @contextlib.contextmanager
    def _loading(self, what: str) -> Any:
        """Turn whatever FMPy raises while an instance is set up into one readable error."""
        try:
            yield
        except fmpy.fmi1.FMICallException as error:
            self._fail(FmuError, f"{error.function} while {what}", error.status)
        except TlpsimError:
            raise
        except Exception as error:
            cause = self._last_message() or f": {error}"
            raise FmuError(f"{self.name}: failed while {what} {self.description.path}{cause}") from error

    def _instantiate(self) -> None:
        if self._component is not None:
            return
        folder = extracted(self.description)
        self._callbacks = _callbacks(self._number, self.description)
        _loggers[self._number] = self._log
        with self._loading("loading"):
            fmu = fmpy.fmi2.FMU2Slave(
                guid=self.description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=self.description.model_identifier,
                instanceName=self.name,
            )
            fmu.instantiate(callbacks=self._callbacks, loggingOn=True)
        _release_python_state_at_exit(fmu.dll)
        self._fmu = fmu
        self._component = ctypes.c_void_p(fmu.component)
        self._set_real_function = fmu.dll.fmi2SetReal
        self._get_real_function = fmu.dll.fmi2GetReal
        self._do_step_function = fmu.dll.fmi2DoStep

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters through the FMI setter of their type; see `Instance`."""
        checked = checked_parameters(self.name, self.variables, values)
        self._instantiate()
        with self._loading("setting parameters of"):
            for name, value in checked.items():
                setter, convert = _SETTERS[self.variables[name].type]
                getattr(self._fmu, setter)([self.description.value_references[name]], [convert(value)])

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Allocate the buffers of `set_inputs` and `get_outputs`; see `Instance`."""
        references = self.description.value_references
        self._inputs = np.zeros(len(inputs))
        self._outputs = np.zeros(len(outputs))
        self._input_count, self._output_count = len(inputs), len(outputs)
        self._input_references = (ctypes.c_uint * len(inputs))(*(references[name] for name in inputs))
        self._output_references = (ctypes.c_uint * len(outputs))(*(references[name] for name in outputs))
        # views of the numpy buffers, which ctypes passes without any conversion
        self._input_values = (ctypes.c_double * len(inputs)).from_buffer(self._inputs.data) if inputs else None
        self._output_values = (ctypes.c_double * len(outputs)).from_buffer(self._outputs.data) if outputs else None

    def enter_initialization(self, start_time: float) -> None:
        """Set up the experiment, without a stop time, and enter the initialization mode; see `Instance`."""
        self._instantiate()
        self._time = start_time
        with self._loading("initializing"):
            self._fmu.setupExperiment(startTime=start_time)
            self._fmu.enterInitializationMode()

    def exit_initialization(self) -> None:
        """Leave the initialization mode; see `Instance`."""
        with self._loading("initializing"):
            self._fmu.exitInitializationMode()
        self._running = True

    def set_inputs(self, values: FloatArray) -> None:
        """Set the bound inputs; see `Instance`."""
        if self._input_count:
            self._inputs[:] = values
            status = self._set_real_function(
                self._component, self._input_references, self._input_count, self._input_values
            )
            if status > _WARNING:
                self._fail(StepError, "fmi2SetReal", status)

    def step(self, time: float, size: float) -> None:
        """Step; see `Instance`."""
        self._time = time
        status = self._do_step_function(self._component, time, size, 1)
        if status > _WARNING:
            self._fail(StepError, f"fmi2DoStep of {size:.9g} s", status)

    def get_outputs(self, into: FloatArray) -> None:
        """Read the bound outputs; see `Instance`."""
        if self._output_count:
            status = self._get_real_function(
                self._component, self._output_references, self._output_count, self._output_values
            )
            if status > _WARNING:
                self._fail(StepError, "fmi2GetReal", status)
            into[:] = self._outputs

    @contextlib.contextmanager
    def _state_call(self, capable: bool, what: str) -> Any:
        if not capable:
            raise StepError(f"{self.name}: the FMU {self.description.path} cannot {what}")
        try:
            yield
        except fmpy.fmi1.FMICallException as error:
            self._fail(StepError, error.function, error.status)

    def get_state(self) -> object:
        """Return a handle of a state inside the FMU; give it to `free_state` when done."""
        with self._state_call(self.can_get_and_set_state, "save its state"):
            return self._fmu.getFMUstate()

    def set_state(self, state: object) -> None:
        """Go back to a saved state."""
        with self._state_call(self.can_get_and_set_state, "restore its state"):
            self._fmu.setFMUstate(state)

    def free_state(self, state: object) -> None:
        """Release a saved state."""
        with self._state_call(self.can_get_and_set_state, "release a state"):
            self._fmu.freeFMUstate(state)

    def serialize_state(self, state: object) -> bytes:
        """Turn a saved state into bytes."""
        with self._state_call(self.can_serialize_state, "serialize its state"):
            return bytes(self._fmu.serializeFMUstate(state))

    def deserialize_state(self, data: bytes) -> object:
        """Turn bytes into a state for `set_state`."""
        with self._state_call(self.can_serialize_state, "deserialize a state"):
            return self._fmu.deSerializeFMUstate(data)

    def terminate(self) -> None:
        """End the simulation, if it runs and did not fail."""
        if self._running and not self._broken:
            self._running = False
            with self._state_call(True, "terminate"):
                self._fmu.terminate()

    def free(self) -> None:
        """Free the instance. The library stays loaded: a Python FMU does not survive a reload.

        After a fatal status no function of the FMU may be called, so the instance is abandoned then (FMI
        2.0.4, section 2.1.3).
        """
        fmu, self._fmu, self._component = self._fmu, None, None
        if fmu is not None and not self._broken:
            fmu.fmi2FreeInstance(fmu.component)
        _loggers.pop(self._number, None)

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
