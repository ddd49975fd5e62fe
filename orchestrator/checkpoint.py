"""Checkpoints: everything that a run needs to go on where it was, in one file.

A checkpoint holds the arrays of the compiled loop (clocks, histories, inputs, weights), the serialized state of every
component, the length of the spool of samples, and a fingerprint of the system. It replaces the one before it in one
step, so that whenever a run is killed there is a whole one. The spool is a plain file of all samples in the order in
which observers got them; a resumed run cuts it back to the length at its checkpoint and gives its observers the samples
again, so that they need no state of their own.

A resumed run repeats an undisturbed one bit for bit where every component does so from its serialized state.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import TlpsimError, WiringError
from tlpsim.orchestrator.loop import kernel
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System, bound_outputs

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import Master

FloatArray = NDArray[np.float64]

_MAGIC = b"tlpsim checkpoint 1\n"
_KEPT_COLUMNS = kernel.VERSION  # of a component: those after it are addresses
_NO_DATA: Mapping[str, str] = {}


class CheckpointError(TlpsimError):
    """A checkpoint cannot be written or read, or is of another system."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkpoint:
    """The state of a run between two steps.

    Attributes
    ----------
    fingerprint
        Of the system, see `fingerprint`.
    start, time
        Of the run, and up to which all components have stepped, ns.
    arrays
        Of the compiled loop, by name.
    states
        Serialized state of each component.
    spooled
        Length of the spool in bytes.
    data
        What the caller keeps with it, such as the scenario.
    """

    fingerprint: str
    start: int
    time: int
    arrays: Mapping[str, NDArray[Any]]
    states: tuple[bytes, ...]
    spooled: int = 0
    data: Mapping[str, str] = field(default_factory=lambda: _NO_DATA)


def fingerprint(system: System) -> str:
    """Digest of what a system is: components with origin, step and parameters; connections; events; algorithm.

    The origin is what a file holds, not where it lies: a package unpacks its FMUs into another folder each time.
    """
    whole = [
        [
            component.name,
            component.step,
            component.inputs_at,
            {key: each for key, each in component.instance.describe().items() if key not in ("fmu", "table")},
            repr(dict(component.parameters)),
        ]
        for component in system.components
    ]
    wiring = [repr(connection) for connection in system.connections]
    text = json.dumps(
        [
            whole,
            wiring,
            [(event.time, event.component, dict(event.values)) for event in system.events],
            system.algorithm,
            repr((system.iteration, system.adaptation)),
            bound_outputs(system),
        ],
        sort_keys=True,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def require_serializable(system: System) -> None:
    """Refuse checkpoints of a system with a component that cannot serialize its state.

    Raises
    ------
    WiringError
        That names the components.
    """
    unable = [each.name for each in system.components if not each.instance.can_serialize_state]
    if unable:
        raise WiringError(
            f"no checkpoints of this system: {', '.join(unable)} cannot serialize the state (canSerializeFMUstate is "
            "not declared); run it without checkpoints"
        )


def take(master: Master, time: int, spooled: int, data: Mapping[str, str]) -> Checkpoint:
    """Checkpoint of a run that has been advanced to a time (ns)."""
    layout = master.layout
    states = []
    for instance in master.instances:
        state = instance.get_state()
        try:
            states.append(instance.serialize_state(state))
        finally:
            instance.free_state(state)
    return Checkpoint(
        fingerprint=fingerprint(master.system),
        start=master.start,
        time=time,
        arrays={
            "units": layout.units[:, :_KEPT_COLUMNS].copy(),
            "groups": layout.groups.copy(),
            "index": layout.index.copy(),
            "heap": layout.heap.copy(),
            "control": layout.control.copy(),
        },
        states=tuple(states),
        spooled=spooled,
        data=dict(data),
    )


def restore(master: Master, checkpoint: Checkpoint) -> None:
    """Bring an initialized run into the state of a checkpoint.

    Raises
    ------
    CheckpointError
        If the checkpoint is of another system.
    """
    if checkpoint.fingerprint != fingerprint(master.system):
        raise CheckpointError(
            "the checkpoint is of another system: an FMU, a parameter, a step or a connection is not what it was when "
            "the run began; restore it, or start afresh"
        )
    layout = master.layout
    layout.units[:, :_KEPT_COLUMNS] = checkpoint.arrays["units"]
    layout.units[:, kernel.TAKEN] = layout.units[:, kernel.NEWEST]
    for name in ("groups", "index", "heap", "control"):
        getattr(layout, name)[:] = checkpoint.arrays[name]
    for instance, data in zip(master.instances, checkpoint.states, strict=True):
        state = instance.deserialize_state(data)
        instance.set_state(state)
        instance.free_state(state)


def write(checkpoint: Checkpoint, path: Path) -> None:
    """Write a checkpoint in the place of the one before it, in one step.

    Raises
    ------
    CheckpointError
        If the file cannot be written.
    """
    body = pickle.dumps({name: getattr(checkpoint, name) for name in checkpoint.__slots__}, protocol=5)
    whole = _MAGIC + hashlib.sha256(body).digest() + body
    new = path.with_name(path.name + ".new")
    try:
        with new.open("wb") as file:
            file.write(whole)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
    except OSError as error:
        raise CheckpointError(f"{path}: the checkpoint cannot be written: {error.strerror or error}") from error


def read(path: Path) -> Checkpoint:
    """Read a checkpoint; only for files that this program wrote, as it is unpickled.

    Raises
    ------
    CheckpointError
        If there is none, or it is damaged.
    """
    try:
        whole = path.read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"{path}: no checkpoint can be read ({error.strerror or error}); run with --checkpoint-every to have one"
        ) from error
    digest, body = whole[len(_MAGIC) : len(_MAGIC) + 32], whole[len(_MAGIC) + 32 :]
    if not whole.startswith(_MAGIC) or hashlib.sha256(body).digest() != digest:
        raise CheckpointError(f"{path}: is not a checkpoint of this version, or damaged; start the run afresh")
    return Checkpoint(**pickle.loads(body))


@contextmanager
def _spooling(path: Path) -> Iterator[None]:
    """Say of which file an error of the system is."""
    try:
        yield
    except OSError as error:
        raise CheckpointError(f"{path}: the samples cannot be spooled: {error.strerror or error}") from error


class Spool(Observer):
    """All samples of a run in a plain file, in the order in which observers get them.

    Parameters
    ----------
    path
        The file; it is made anew, or cut back to `length`.
    length
        Bytes that are kept, as in `Checkpoint.spooled`.

    Raises
    ------
    CheckpointError
        If the file cannot be written, or is shorter than that.
    """

    def __init__(self, path: Path, length: int = 0) -> None:
        self.path = path
        with _spooling(path):
            self._file: BinaryIO = path.open("r+b" if length else "wb")
            self._file.seek(0, os.SEEK_END)
            if self._file.tell() < length:
                raise CheckpointError(f"{path}: {self._file.tell()} bytes, {length} are needed; start the run afresh")
            self._file.truncate(length)
            self._file.seek(length)

    def __enter__(self) -> Spool:
        """The spool itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._file.close()

    def sampled(self, index: int, times: NDArray[np.int64], values: FloatArray) -> None:
        """Append samples."""
        header = np.array([index, len(times), values.shape[1]], dtype=np.int64)
        with _spooling(self.path):
            for array in (header, times, values):
                self._file.write(np.ascontiguousarray(array).tobytes())

    def flushed(self) -> int:
        """Length of the file, all of which is on the disk."""
        with _spooling(self.path):
            self._file.flush()
            os.fsync(self._file.fileno())
        return self._file.tell()


def spooled(path: Path, length: int) -> Iterator[tuple[int, NDArray[np.int64], FloatArray]]:
    """Arguments of `Observer.sampled` of the first `length` bytes of a spool, one after the other.

    Raises
    ------
    CheckpointError
        If the file is shorter.
    """
    with path.open("rb") as file:
        while file.tell() < length:
            header = file.read(24)
            if len(header) == 24:
                index, count, width = (int(number) for number in np.frombuffer(header, dtype=np.int64))
                body = file.read(8 * count * (1 + width))
            if len(header) < 24 or len(body) < 8 * count * (1 + width):
                raise CheckpointError(f"{path}: ends before {length} bytes; start the run afresh")
            times = np.frombuffer(body[: 8 * count], dtype=np.int64)
            yield index, times, np.frombuffer(body[8 * count :], dtype=np.float64).reshape(count, width)


class Checkpoints:
    """Checkpoints of a run at equal intervals of its time.

    Parameters
    ----------
    path
        Of the checkpoint; the spool has the same name with ``.spool``.
    every
        Interval in ns.
    data
        What is kept with each of them.
    resumed
        The checkpoint from which the run goes on.
    """

    def __init__(
        self, path: Path, every: int, data: Mapping[str, str] | None = None, resumed: Checkpoint | None = None
    ) -> None:
        if every <= 0:
            raise CheckpointError(f"checkpoints every {every} ns; give a positive interval")
        self.path, self.every, self.data, self.resumed = path, every, dict(data or {}), resumed
        self.spool = Spool(path.with_name(path.name + ".spool"), resumed.spooled if resumed else 0)

    def times(self, start: int, stop: int) -> Iterator[int]:
        """Times after `start` at which the run pauses, the last of which is the end."""
        time = start
        while time < stop:
            time = min((time // self.every + 1) * self.every, stop)
            yield time

    def save(self, master: Master, time: int) -> None:
        """Write a checkpoint of a run that has been advanced to a time (ns)."""
        write(take(master, time, self.spool.flushed(), self.data), self.path)

    def replay(self, observers: Sequence[Observer]) -> None:
        """Give observers, but for the spool itself, the samples up to the checkpoint."""
        if self.resumed is None:
            return
        for index, times, values in spooled(self.spool.path, self.resumed.spooled):
            for observer in observers:
                if observer is not self.spool:
                    observer.sampled(index, times, values)

    def stopped(self, reason: BaseException | None) -> None:
        """Leave nothing behind after a run that came to its end."""
        self.spool.__exit__(None, None, None)
        if reason is None:
            self.path.unlink(missing_ok=True)
            self.spool.path.unlink(missing_ok=True)
