"""FMI 3.0 co-simulation FMUs: without event mode, early return and intermediate updates."""

import ctypes
import math
import os
from pathlib import Path
from typing import Any, ClassVar

import fmpy.fmi3
import numpy as np

from tlpsim.loads.errors import FmuError, StepError
from tlpsim.orchestrator.fmi.description import CO_SIMULATION
from tlpsim.orchestrator.fmi.instance_base import FmiInstance
from tlpsim.orchestrator.fmi.log import log_of


def _log(environment: int | None, status: int, category: bytes, message: bytes) -> None:
    """File a log message of any FMU under the instance that it comes from."""
    log = log_of(environment)
    if log is not None:
        log.add(status, message)


_logger = fmpy.fmi3.fmi3LogMessageCallback(_log)
_FLAGS = ("needs its events handled", "ends the simulation", "returned early")
_SIZE_OF_FLAG = 1  # byte


class Fmi3Instance(FmiInstance):
    """An instance of an FMI 3.0 co-simulation FMU, loaded into this process on first use; see `FmiInstance`."""

    version = 3
    _state_word = "FMUState"
    _deserialize_word = "Deserialize"
    _numbers: ClassVar = {
        "Float64": np.float64,
        "Float32": np.float32,
        **{f"Int{8 * np.dtype(number).itemsize}": number for number in (np.int8, np.int16, np.int32, np.int64)},
        **{f"UInt{8 * np.dtype(number).itemsize}": number for number in (np.uint8, np.uint16, np.uint32, np.uint64)},
        "Boolean": np.bool_,
    }

    def __init__(self, name: str, path: str | Path) -> None:
        super().__init__(name, path)
        self._flags = ctypes.c_uint32()  # three booleans: event handling needed, terminate simulation, early return
        self._last_time = ctypes.c_double()
        first = ctypes.addressof(self._flags)
        self._answers = (*(first + number * _SIZE_OF_FLAG for number in range(3)), ctypes.addressof(self._last_time))

    def _new_component(self, resources: Path) -> int | None:
        flag, pointer = ctypes.c_bool, ctypes.c_void_p
        return self._made(
            "fmi3InstantiateCoSimulation",
            resources,
            (flag, False),  # eventModeUsed
            (flag, False),  # earlyReturnAllowed
            (pointer, None),  # requiredIntermediateVariables
            (ctypes.c_size_t, 0),
            last=((pointer, None),),  # intermediateUpdate
        )

    def _made(
        self, function: str, resources: Path, *between: tuple[Any, Any], last: tuple[tuple[Any, Any], ...] = ()
    ) -> int | None:
        """Call a function that instantiates, with the types and values that it takes beside what all take."""
        flag, text, pointer = ctypes.c_bool, ctypes.c_char_p, ctypes.c_void_p
        arguments = (
            (text, self.name.encode()),
            (text, self.description.guid.encode()),
            (text, f"{resources}{os.sep}".encode() if resources.is_dir() else None),
            (flag, False),  # visible
            (flag, not self._log_categories),  # loggingOn
            *between,
            (pointer, self._log.number),
            (pointer, ctypes.cast(_logger, pointer)),
            *last,
        )
        instantiate = self._function(function, *(kind for kind, _ in arguments), result=pointer)
        component: int | None = instantiate(*(value for _, value in arguments))
        return component

    def enter_initialization(self, start_time: float) -> None:
        """Enter the initialization mode, without a stop time; see `Instance`."""
        self._instantiate()
        self._log.time = start_time
        flag, real, pointer = ctypes.c_bool, ctypes.c_double, ctypes.c_void_p
        if self.kind == CO_SIMULATION:
            self._do_step = self._function("fmi3DoStep", pointer, real, real, flag, pointer, pointer, pointer, pointer)
        types = (flag, real, real, flag, real)
        self._call(FmuError, "fmi3EnterInitializationMode", types, False, 0.0, start_time, False, 0.0)

    def step(self, time: float, size: float) -> None:
        """Step; see `Instance`. A discarded step raises DiscardError."""
        self._log.time = time
        self._flags.value = 0
        # the flag is false while there are saved states, to which the master may go back
        status = self._do_step(self._component, time, size, not self._states, *self._answers)
        if status:
            self._check_step(status, size)
        self._stepped = True
        if self._flags.value:
            self._check_flags(time, size)

    def _check_flags(self, time: float, size: float) -> None:
        """Refuse what an FMU must not ask for, as it was told that it is not done."""
        said = [text for number, text in enumerate(_FLAGS) if self._flags.value >> (8 * number) & 0xFF]
        self._running = False
        raise StepError(
            f"{self.name}: in the step of {size:.9g} s at t = {time:.9g} s the FMU {' and '.join(said)} at "
            f"t = {self._last_time.value:.9g} s{self._log.cause()}; events and early return are not supported"
        )

    def native_failure(
        self, function: str, time: float, size: float, status: int, last_time: float = math.nan
    ) -> StepError:
        """The error for a status that the compiled loop got, with the last successful time; see `Instance`."""
        self._last_time.value = last_time
        return super().native_failure(function, time, size, status, last_time)

    def last_successful_time(self) -> float | None:
        """Time up to which the last step was computed; see `Instance`."""
        return None if math.isnan(self._last_time.value) else self._last_time.value
