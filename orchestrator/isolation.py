"""A component in a process of its own, so that its crash, its hang or its `exit()` is an error and not the end.

The process is a fresh interpreter. It inherits no locks, only the ends of its pipes and the shared memory; its standard
streams go to a log, whose last lines are in the error when something fails. It ends with the instance and with the
process of the master, however that ends, and takes with it whatever it started itself.
"""

import functools
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads import errors
from tlpsim.loads.errors import FmuError, StepError, TlpsimError
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.isolated import (
    CALL,
    FAILED,
    READ,
    REFUSED,
    REPLY,
    REQUEST,
    STEP,
    ClosedError,
    Reader,
    mapped,
    write,
)

FloatArray = NDArray[np.float64]

TIMEOUT = 60.0
"""How long in s a call may take where nothing else is said."""

_LOADING_TIMEOUTS = 10  # times as long may the calls up to the end of the initialization take
_ENDING_TIMEOUT = 5.0  # s
_LOG_LINES, _LOG_CHARACTERS, _LOG_BYTES = 6, 600, 65536
_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from tlpsim.orchestrator.isolated import serve; serve(sys.argv[2], *map(int, sys.argv[3:]))"
)


def _end(process: "subprocess.Popen[bytes]", descriptors: Sequence[int], folder: str, owner: int) -> int:
    """Kill a process and all that it started, and release what it had; return its exit status.

    A process that ended by itself before keeps its status, and its number until it is waited for here.
    """
    if os.getpid() != owner:  # a fork of the master, which the process does not belong to
        return 0
    with suppress(ProcessLookupError, PermissionError):  # macOS says the latter when only a zombie is left
        os.killpg(process.pid, signal.SIGKILL)
    status = process.wait()
    _release(descriptors, folder)
    return status


def _release(descriptors: Sequence[int], folder: str) -> None:
    for descriptor in descriptors:
        os.close(descriptor)
    shutil.rmtree(folder, ignore_errors=True)


class _Process:
    """A process that serves one instance, with its pipes, its shared memory, its log and its folder."""

    def __init__(self) -> None:
        folder = tempfile.mkdtemp(prefix="tlpsim_isolated_")
        self.log = os.open(f"{folder}/log", os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o600)
        if hasattr(os, "memfd_create"):
            self.memory = os.memfd_create("tlpsim")
        else:
            self.memory = os.open(f"{folder}/values", os.O_RDWR | os.O_CREAT, 0o600)
        requests, self.requests = os.pipe()
        replies, their_replies = os.pipe()
        lifeline, our_lifeline = os.pipe()
        theirs = (requests, their_replies, lifeline)
        kept = (self.requests, replies, our_lifeline, self.log, self.memory)
        try:
            process = subprocess.Popen(
                [sys.executable, "-u", "-c", _PROGRAM, json.dumps(sys.path), folder, *map(str, (*theirs, self.memory))],
                stdin=subprocess.DEVNULL,
                stdout=self.log,
                stderr=self.log,
                pass_fds=(*theirs, self.memory),
                env={**os.environ, "TMPDIR": folder},
                start_new_session=True,
            )
        except BaseException:
            _release(kept, folder)
            raise
        finally:
            for descriptor in theirs:
                os.close(descriptor)
        self.reader = Reader(replies)
        self.end = weakref.finalize(self, _end, process, kept, folder, os.getpid())

    def lines(self) -> tuple[str, ...]:
        """The newest lines of the log that are not empty."""
        size = os.fstat(self.log).st_size
        data = os.pread(self.log, _LOG_BYTES, max(0, size - _LOG_BYTES))
        return tuple(line.strip() for line in data.decode(errors="replace").splitlines() if line.strip())


@dataclass(frozen=True, slots=True, kw_only=True)
class _State:
    """A saved state, which lies in the process of the component."""

    number: int


class IsolatedInstance(Instance):
    """An instance that runs in a process of its own.

    The process starts with the first call that needs the component. New inputs go to it with the next other call, and
    the outputs come back with every step, so that a step with its inputs and outputs is one exchange.

    Parameters
    ----------
    name
        Name of the component.
    open
        Path of an FMU, or a function without arguments that makes the instance. The function must be importable in a
        fresh interpreter, so not be of ``__main__``. It is called here as well, for the variables: nothing of the
        component may run before its first call.
    timeout
        How long in s a call may take; up to the end of the initialization, ten times as long.

    Raises
    ------
    FmuError
        As `tlpsim.orchestrator.fmi.description.read_description`, or if the function cannot be handed to a process.
        Every other method raises it as well, if the component crashes, hangs or ends its process up to the end of the
        initialization; the message has the last lines of its log.
    StepError
        From other methods: if that happens afterwards.
    """

    def __init__(self, name: str, open: Callable[[], Instance] | str | Path, timeout: float = TIMEOUT) -> None:
        self.name = name
        make = open if callable(open) else functools.partial(open_fmu, name, open)
        try:
            self._make = pickle.dumps(make)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise FmuError(f"{name}: what makes the instance cannot be handed to a process: {error}") from error
        model = make()
        self.variables, self.arrays, self.units = model.variables, model.arrays, model.units
        self.can_get_and_set_state = model.can_get_and_set_state
        self.can_serialize_state = model.can_serialize_state
        self._described = model.describe()
        model.free()
        self._timeout = timeout
        self._process: _Process | None = None
        self._failure: TlpsimError | None = None
        self._messages: tuple[str, ...] = ()
        self._initialized = self._freed = False
        self._pending = self._fresh = False
        self._time = 0.0
        self._inputs, self._outputs = np.zeros(0), np.zeros(0)

    @property
    def messages(self) -> tuple[str, ...]:
        """The newest lines that the component logged or wrote, oldest first."""
        return self._messages if self._process is None else self._process.lines()

    # Exchange with the process

    def _started(self) -> _Process:
        if self._failure is not None:
            raise self._failure
        if self._process is None:
            if self._freed:
                raise FmuError(f"{self.name}: the instance is freed and cannot be used again; open another one")
            try:
                self._process = _Process()
            except OSError as error:
                raise FmuError(f"{self.name}: no process can be started for the component: {error}") from error
            try:
                self._call("loading", "open", self._make)
            except TlpsimError as error:
                self._failure = error
                self._stop()
                raise
        return self._process

    def _call(self, doing: str, method: str, *arguments: object) -> Any:
        """Call a method there. `doing` completes "failed while ..." in errors."""
        self._started()
        self._fresh = False
        return self._exchange(doing, CALL, pickle.dumps((method, arguments)))

    def _exchange(self, doing: str, kind: int, payload: bytes = b"", start: float = 0.0, size: float = 0.0) -> Any:
        """Send a request and wait for the reply; `start` and `size` are those of a step, in s."""
        process = self._process or self._started()
        pending, self._pending = self._pending, False
        limit = self._timeout if self._initialized else _LOADING_TIMEOUTS * self._timeout
        try:
            write(process.requests, REQUEST.pack(kind, pending, len(payload), start, size) + payload)
            outcome, length = REPLY.unpack(process.reader.read(REPLY.size, limit))
            if not length:
                return None
            result = pickle.loads(process.reader.read(length, limit))
        except TimeoutError:
            what = f"gave no answer within {limit:.9g} s"
            self._fail(doing, lambda status: f"{what} (set a longer timeout if it needs more)")
        except (ClosedError, BrokenPipeError):
            self._fail(doing, _ending)
        except BaseException:  # an interrupt: the reply would pass for that of the next request
            self._failure = self._error(doing, "was interrupted")
            self._stop()
            raise
        if outcome == REFUSED:
            name, text = result
            raise getattr(errors, name)(text)
        if outcome == FAILED:
            raise self._error(doing, f"failed with {result}")
        return result

    def _error(self, doing: str, what: str) -> TlpsimError:
        text = " | ".join(self.messages[-_LOG_LINES:])
        if len(text) > _LOG_CHARACTERS:
            text = f"... {text[-_LOG_CHARACTERS:]}"
        log = f"its log ends: {text}" if text else "its log is empty"
        kind = StepError if self._initialized else FmuError
        return kind(f"{self.name}: the component {what} while {doing} at t = {self._time:.9g} s; {log}")

    def _fail(self, doing: str, what: Callable[[int], str]) -> NoReturn:
        """End the process; `what` makes of its exit status what happened."""
        status = self._stop()
        self._failure = self._error(doing, what(status))
        raise self._failure from None

    def _stop(self) -> int:
        """End the process and keep its log; return its exit status."""
        process, self._process = self._process, None
        if process is None:
            return 0
        self._messages = process.lines()
        self._inputs, self._outputs = np.zeros(0), np.zeros(0)  # the shared memory goes with its last view
        return process.end() or 0

    # The calls of an instance

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters there; see `Instance`."""
        self._call("setting parameters", "set_parameters", dict(values))

    def change(self, values: Mapping[str, object]) -> None:
        """Change values there; see `Instance`."""
        self._call("changing values", "change", dict(values))

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Lay out the shared memory; see `Instance`."""
        memory = self._started().memory
        os.ftruncate(memory, 8 * max(1, len(inputs) + len(outputs)))
        self._call("binding variables", "bind", tuple(inputs), tuple(outputs))
        self._inputs, self._outputs = mapped(memory, len(inputs), len(outputs))

    def enter_initialization(self, start_time: float) -> None:
        """Enter the initialization mode; see `Instance`."""
        self._time = start_time
        self._call("initializing", "enter_initialization", start_time)

    def exit_initialization(self) -> None:
        """Leave the initialization mode; see `Instance`."""
        self._call("initializing", "exit_initialization")
        self._initialized = True

    def set_inputs(self, values: FloatArray) -> None:
        """Keep the bound inputs for the next call; an error that they cause comes with it. See `Instance`."""
        self._inputs[:] = values
        self._pending = True

    def step(self, time: float, size: float) -> None:
        """Step, and fetch the outputs; see `Instance`."""
        self._time = time
        self._fresh = False
        self._exchange("stepping", STEP, b"", time, size)
        self._fresh = True

    def get_outputs(self, into: FloatArray) -> None:
        """Copy the bound outputs, which are fetched if anything was called since; see `Instance`."""
        if self._pending or not self._fresh:
            self._exchange("reading outputs", READ)
            self._fresh = True
        into[:] = self._outputs

    def last_successful_time(self) -> float | None:
        """Ask there; see `Instance`."""
        return self._call("asking for the time of a discarded step", "last_successful_time")

    def get_state(self) -> object:
        """Return the number of a state there; give it to `free_state` when done."""
        return _State(number=self._call("saving a state", "get_state"))

    def _number(self, state: object) -> int:
        if not isinstance(state, _State):
            raise StepError(f"{self.name}: {type(state).__name__} is not a state of this component")
        return state.number

    def set_state(self, state: object) -> None:
        """Go back to a saved state; see `Instance`."""
        self._call("restoring a state", "set_state", self._number(state))

    def free_state(self, state: object) -> None:
        """Release a saved state, unless that ended with the process."""
        if self._process is not None:
            fresh = self._fresh
            self._call("releasing a state", "free_state", self._number(state))
            self._fresh = fresh

    def serialize_state(self, state: object) -> bytes:
        """Turn a saved state into bytes; see `Instance`."""
        return self._call("serializing a state", "serialize_state", self._number(state))

    def deserialize_state(self, data: bytes) -> object:
        """Turn bytes into a state for `set_state`; see `Instance`."""
        return _State(number=self._call("deserializing a state", "deserialize_state", data))

    def terminate(self) -> None:
        """End the simulation, unless the process has ended."""
        if self._process is not None:
            self._call("terminating", "terminate")

    def free(self) -> None:
        """Free the instance and end the process, which gets 5 s for either."""
        self._freed = True
        if self._process is None:
            return
        reader = self._process.reader
        self._pending, self._timeout, self._initialized = False, _ENDING_TIMEOUT, True
        with suppress(TlpsimError):
            self._call("freeing", "free")
            with suppress(ClosedError, TimeoutError):
                reader.read(1, _ENDING_TIMEOUT)
        self._stop()

    def describe(self) -> dict[str, str]:
        """Return where the component comes from, and that it is isolated."""
        return {**self._described, "isolation": "process"}


def _ending(status: int) -> str:
    """What a process did that ended with an exit status; that of a signal is negative."""
    if status >= 0:
        return f"ended its process with exit status {status}"
    number = -status
    name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
    return f"was ended by {name} ({(signal.strsignal(number) or '').lower()})"
