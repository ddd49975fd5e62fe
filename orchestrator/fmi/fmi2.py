"""FMI 2.0 co-simulation FMUs."""

import ctypes
from pathlib import Path
from typing import Any, ClassVar

import fmpy.fmi1
import fmpy.fmi2
import fmpy.logging
import numpy as np

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator.fmi.description import CO_SIMULATION, FmuDescription
from tlpsim.orchestrator.fmi.instance_base import FmiInstance
from tlpsim.orchestrator.fmi.log import log_of
from tlpsim.orchestrator.fmi.python_fmu import is_python_fmu

_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3


def _log(environment: int | None, name: bytes, status: int, category: bytes, message: bytes) -> None:
    """File a log message of any FMU under the instance that it comes from.

    Messages of instances that this module did not make go where FMPy puts them.
    """
    log = log_of(environment)
    if log is None:
        fmpy.fmi1.printLogMessage(environment, name, status, category, message)
    else:
        log.add(status, message)


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
    if not is_python_fmu(description):
        fmpy.logging.addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


class FmuInstance(FmiInstance):
    """An instance of an FMI 2.0 co-simulation FMU, loaded into this process on first use; see `FmiInstance`."""

    version = 2
    _interface = 1
    """The fmi2Type of its kind."""
    _state_word = "FMUstate"
    _deserialize_word = "DeSerialize"
    _numbers: ClassVar = {"Real": np.float64, "Integer": np.int32, "Boolean": np.int32}

    def _new_component(self, resources: Path) -> int | None:
        self._callbacks = _callbacks(self._log.number, self.description)
        whole, text, pointer = ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p
        instantiate = self._function("fmi2Instantiate", text, whole, text, text, pointer, whole, whole, result=pointer)
        component: int | None = instantiate(
            self.name.encode(),
            self._interface,
            self.description.guid.encode(),
            resources.as_uri().encode(),
            ctypes.byref(self._callbacks),
            0,
            not self._log_categories,
        )
        return component

    def enter_initialization(self, start_time: float) -> None:
        """Set up the experiment, without a stop time, and enter the initialization mode; see `Instance`."""
        self._instantiate()
        self._log.time = start_time
        whole, real = ctypes.c_int, ctypes.c_double
        if self.kind == CO_SIMULATION:
            self._do_step = self._function("fmi2DoStep", ctypes.c_void_p, real, real, whole)
        types = (whole, real, real, whole, real)
        self._call(FmuError, "fmi2SetupExperiment", types, 0, 0.0, start_time, 0, 0.0)
        self._call(FmuError, "fmi2EnterInitializationMode")

    def step(self, time: float, size: float) -> None:
        """Step; see `Instance`. A discarded step raises DiscardError."""
        self._log.time = time
        # the flag is false while there are saved states, to which the master may go back
        status = self._do_step(self._component, time, size, 0 if self._states else 1)
        if status:
            self._check_step(status, size)
        self._stepped = True

    def _is_ended(self) -> bool:
        return bool(self._asked("Boolean", _TERMINATED, ctypes.c_int))

    def last_successful_time(self) -> float | None:
        """Time up to which a discarded step was computed; see `Instance`."""
        time: float | None = self._asked("Real", _LAST_SUCCESSFUL_TIME, ctypes.c_double)
        return time

    def _asked(self, kind: str, which: int, type: Any) -> Any:
        """Value of a status function, or None; messages that it is not supported are no cause of a failure."""
        if self._broken or self._component is None:
            return None
        value = type()
        function = self._function(f"fmi2Get{kind}Status", ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
        self._log.muted = True
        status = function(self._component, which, ctypes.byref(value))
        self._log.muted = False
        return value.value if status <= 1 else None
