"""The process of an isolated component, which answers the calls of `tlpsim.orchestrator.isolation`.

A request is a head (`REQUEST`) and, for `CALL`, the pickled name and arguments of a method of `Instance`; the reply is
a head (`REPLY`) and a pickled result or error. They go through a pipe each way. The values of bound variables do not:
they lie in shared memory without a name, inputs first, which ends with the last process that maps it.
"""

import contextlib
import ctypes
import functools
import mmap
import os
import pickle
import select
import shutil
import signal
import struct
import sys
import threading
import time
import traceback

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads import errors
from tlpsim.orchestrator.fmi import log as fmu_log
from tlpsim.orchestrator.instance import Instance

REQUEST = struct.Struct("=bbqdd")
"""Kind, whether new inputs are to be set first, length of what follows in bytes, and time and size of a step in s."""
STEP, READ, CALL = range(3)
"""Kinds of requests: step and read the outputs, read the outputs, call a method."""

REPLY = struct.Struct("=bq")
"""Outcome and length of what follows in bytes."""
DONE, RESULT, REFUSED, FAILED = range(4)
"""Outcomes: nothing to tell, a result, an error of `tlpsim.loads.errors` (name, text), another exception (text)."""

SPIN = 50_000 if len(getattr(os, "sched_getaffinity", lambda process: (0,))(0)) > 1 else 0
"""How long in ns to look for the other process's message before sleeping; waking up may cost as much."""

_MOST_MISSES = 6
_GRACE = 2.0  # s that the component has to end by itself once the master's process is gone
_LOG_LIMIT = 1 << 20  # bytes
_STEPS_BETWEEN_LOG_CHECKS = 1024


class ClosedError(Exception):
    """The other end of a pipe is closed."""


class Reader:
    """The reading end of a pipe.

    Parameters
    ----------
    descriptor
        File descriptor, which the reader does not close.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        self._poll = poll.poll
        self._misses = self._waits_to_sleep = 0

    def wait(self, limit: float | None = None) -> bool:
        """Wait until there is something to read, or the other end is closed; False after `limit` s.

        Looking for a message pays where the other process has a processor of its own. Where it was in vain, the next
        waits sleep at once, up to 64 of them.
        """
        poll, clock = self._poll, time.perf_counter_ns
        if self._waits_to_sleep:
            self._waits_to_sleep -= 1
        else:
            end = clock() + SPIN
            while clock() < end:
                if poll(0):
                    self._misses = 0
                    return True
                os.sched_yield()
            self._misses = min(self._misses + 1, _MOST_MISSES)
            self._waits_to_sleep = 1 << self._misses
        return bool(poll(None if limit is None else 1e3 * limit))

    def read(self, count: int, limit: float | None = None) -> bytes:
        """Read `count` bytes.

        Raises
        ------
        ClosedError
            When the other end is closed.
        TimeoutError
            When nothing comes for `limit` s.
        """
        parts = []
        while count > 0:
            if not self.wait(limit):
                raise TimeoutError
            part = os.read(self._descriptor, count)
            if not part:
                raise ClosedError
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


def write(descriptor: int, data: bytes) -> None:
    """Write all the bytes to a pipe."""
    while data:
        data = data[os.write(descriptor, data) :]


def mapped(memory: int, inputs: int, outputs: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Map the shared memory of a file descriptor as inputs, shape (inputs,), and outputs, shape (outputs,)."""
    values = np.frombuffer(mmap.mmap(memory, 8 * max(1, inputs + outputs)), dtype=np.float64)
    return values[:inputs], values[inputs : inputs + outputs]


_OWN_CALLS = frozenset({"open", "bind", "get_state", "set_state", "free_state", "serialize_state", "deserialize_state"})


class _Server:
    """Calls the instance as the requests say."""

    def __init__(self, memory: int) -> None:
        self.is_freed = False
        self._memory = memory
        self._states: dict[int, object] = {}
        self._last_state = 0
        self._inputs, self._outputs = np.zeros(0), np.zeros(0)
        self._instance: Instance

    def answer(self, kind: int, has_inputs: int, payload: bytes, start: float, size: float) -> object:
        if has_inputs:
            self._instance.set_inputs(self._inputs)
        if kind == CALL:
            name, arguments = pickle.loads(payload)
            self.is_freed = name == "free"
            return getattr(self if name in _OWN_CALLS else self._instance, name)(*arguments)
        if kind == STEP:
            self._instance.step(start, size)
        self._instance.get_outputs(self._outputs)
        return None

    def open(self, make: bytes) -> None:
        self._instance = pickle.loads(make)()

    def bind(self, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> None:
        self._inputs, self._outputs = mapped(self._memory, len(inputs), len(outputs))
        self._instance.bind(inputs, outputs)

    def get_state(self) -> int:
        return self._keep(self._instance.get_state())

    def deserialize_state(self, data: bytes) -> int:
        return self._keep(self._instance.deserialize_state(data))

    def _keep(self, state: object) -> int:
        self._last_state += 1
        self._states[self._last_state] = state
        return self._last_state

    def _kept(self, number: int) -> object:
        if number not in self._states:
            raise errors.StepError(f"{self._instance.name}: the state is released and cannot be used again")
        return self._states[number]

    def set_state(self, number: int) -> None:
        self._instance.set_state(self._kept(number))

    def serialize_state(self, number: int) -> bytes:
        return self._instance.serialize_state(self._kept(number))

    def free_state(self, number: int) -> None:
        self._instance.free_state(self._kept(number))
        del self._states[number]


def _end_with_the_master(lifeline: int, folder: str) -> None:
    """Wait until the master's process is gone, whatever ended it; then end this one even if the component hangs."""
    os.read(lifeline, 1)
    time.sleep(_GRACE)
    shutil.rmtree(folder, ignore_errors=True)
    os.killpg(0, signal.SIGKILL)


def _write_lines_at_once() -> None:
    """Keep the C library from holding back text that a crash would lose; stdout is a file here."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        library = ctypes.CDLL(None)
        stream = ctypes.c_void_p.in_dll(library, "__stdoutp" if sys.platform == "darwin" else "stdout")
        library.setvbuf(stream, None, 1, ctypes.c_size_t(0))  # _IOLBF


def _refusal(error: errors.TlpsimError) -> tuple[str, str]:
    known = next(kind for kind in type(error).__mro__ if kind.__module__ == errors.__name__)
    return known.__name__, str(error)


def serve(folder: str, requests: int, replies: int, lifeline: int, memory: int) -> None:
    """Answer requests until the instance is freed or the master is gone.

    Parameters
    ----------
    folder
        Folder of this process, which is removed when the master is gone.
    requests, replies, lifeline, memory
        File descriptors of the pipes and of the shared memory.
    """
    for descriptor in (requests, replies, lifeline, memory):
        os.set_inheritable(descriptor, False)
    _write_lines_at_once()
    fmu_log.follow(functools.partial(print, file=sys.stderr))
    threading.Thread(target=_end_with_the_master, args=(lifeline, folder), daemon=True).start()
    server = _Server(memory)
    reader = Reader(requests)
    done = REPLY.pack(DONE, 0)
    number = 0
    while not server.is_freed:
        try:
            kind, has_inputs, length, start, size = REQUEST.unpack(reader.read(REQUEST.size))
            payload = reader.read(length) if length else b""
        except ClosedError:
            shutil.rmtree(folder, ignore_errors=True)
            return
        try:
            result = server.answer(kind, has_inputs, payload, start, size)
            reply = done if result is None else _packed(RESULT, result)
        except errors.TlpsimError as error:
            reply = _packed(REFUSED, _refusal(error))
        except Exception as error:
            traceback.print_exc()
            reply = _packed(FAILED, f"{type(error).__name__}: {error}")
        number += 1
        if number % _STEPS_BETWEEN_LOG_CHECKS == 0 and os.fstat(2).st_size > _LOG_LIMIT:
            os.ftruncate(2, 0)
        try:
            write(replies, reply)
        except BrokenPipeError:
            return


def _packed(outcome: int, result: object) -> bytes:
    data = pickle.dumps(result)
    return REPLY.pack(outcome, len(data)) + data
