"""Writing of results while a run goes, in the layout of `tlpsim.scenarios.results`.

Samples are gathered by component in chunks of some megabytes, which go to the file as they are. About once a second the
file is brought to where a reader finds all samples so far. A chunk that is not full yet keeps its place in the file
from then on, so that a killed run leaves a file that holds what it had at that moment. When the run is complete the
chunks are compressed, see `tlpsim.scenarios.results_packing`.
"""

import datetime
import importlib.metadata
import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import TlpsimError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.coupling_report import CouplingMeter
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import Component, System, bound_outputs
from tlpsim.scenarios.recording import Recording, recording_of, select_signals
from tlpsim.scenarios.results import FORMAT, SCHEMA_VERSION, ResultsError
from tlpsim.scenarios.results_packing import pack
from tlpsim.scenarios.schema import Scenario

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import RunSummary

FLUSH_INTERVAL = 1.0
"""Wall time in s between two moments at which a reader finds all samples so far."""

_FLUSH_SHARE = 0.05  # of the wall time, at most
_CHUNK_BYTES = 4_000_000  # of a component
_FEWEST_ROWS, _MOST_ROWS = 1024, 16384  # of a chunk
_PACKAGES = ("tlpsim", "numpy", "scipy", "numba", "fmpy", "h5py")


def chunk_length(signals: int, samples: int) -> int:
    """Samples in a chunk of a component.

    Parameters
    ----------
    signals
        Number of its datasets, with the time.
    samples
        That it will have; they fill a whole number of chunks with little room left.
    """
    most = min(max(_CHUNK_BYTES // (8 * signals), _FEWEST_ROWS), _MOST_ROWS)
    return -(-max(samples, 1) // -(-max(samples, 1) // most))


class _Group:
    """Datasets of a component, and the samples of the chunk that is being filled."""

    def __init__(
        self, group: h5py.Group, component: Component, columns: NDArray[np.int64], names: Sequence[tuple[str, str]]
    ) -> None:
        self._group = group
        self._component = component
        self._columns = columns
        self._names = names
        self._datasets: list[h5py.h5d.DatasetID] = []
        self._rows = np.zeros((len(names) + 1, 0))  # the time, and the signals
        self._first = np.zeros((len(names) + 1, 1), dtype=np.int64)
        self._begun = np.zeros(len(names) + 1, dtype=np.bool_)  # whether the chunk is in the file
        self._begin = self._count = self._stored = 0

    @property
    def is_created(self) -> bool:
        """Whether there was a first sample."""
        return bool(self._datasets)

    def create(self, time: int, end: int, values: NDArray[np.float64]) -> None:
        """Create the datasets at the first sample, when it is known how many there will be at most."""
        length = chunk_length(len(self._names) + 1, (end - time) // self._component.step + 1)
        self._rows = np.zeros((len(self._names) + 1, length))
        first = np.array([time / NANOSECONDS_PER_SECOND, *values[self._columns]])
        self._first = first.view(np.int64)[:, np.newaxis]
        storage = {"shape": (0,), "maxshape": (None,), "chunks": (length,), "dtype": "f8"}
        scale = self._group.create_dataset("time", fillvalue=first[0], **storage)
        scale.attrs.update({"units": "s", "long_name": "time from the start of the simulation"})
        scale.make_scale("time")
        self._datasets = [scale.id]
        for (output, variable), value in zip(self._names, first[1:], strict=True):
            signal = self._group.create_dataset(_dataset_name(variable), fillvalue=value, **storage)
            declared = self._component.instance.variables[output]
            signal.attrs.update(
                {"variable": variable, "units": declared.unit or "", "long_name": declared.description or ""}
            )
            signal.dims[0].attach_scale(scale)
            self._datasets.append(signal.id)

    def take(self, times: NDArray[np.int64], values: NDArray[np.float64], end: int) -> None:
        """Copy samples, and store every chunk that they fill."""
        first, last = 0, int(np.searchsorted(times, end, side="right"))
        if last and not self._datasets:
            self.create(int(times[0]), end, values[0])
        while first < last:
            count = min(last - first, self._rows.shape[1] - self._count)
            place, taken = slice(self._count, self._count + count), slice(first, first + count)
            np.divide(times[taken], NANOSECONDS_PER_SECOND, out=self._rows[0, place])
            self._rows[1:, place] = values[taken, self._columns].T
            self._count += count
            first += count
            if self._count == self._rows.shape[1]:
                self.store()
                self._begin, self._count = self._begin + self._count, 0
                self._begun[:] = False

    def store(self) -> None:
        """Put the samples of the chunk into the file, where they are not all equal to the first one."""
        end = self._begin + self._count
        if end == self._stored:
            return
        self._begun |= (self._rows[:, : self._count].view(np.int64) != self._first).any(axis=1)
        # Time comes last: a reader of a broken file then never finds a time without its samples.
        for dataset, row, kept in zip(self._datasets[::-1], self._rows[::-1], self._begun[::-1], strict=True):
            dataset.set_extent((end,))
            if kept:
                dataset.write_direct_chunk((self._begin,), row)
        self._stored = end


class ResultsWriter(Observer):
    """Observer of a run that writes the results file.

    Parameters
    ----------
    destination : Path
        The results file. One that exists is replaced when the run is complete, and not before.
    run : Scenario or Recording
        What is run, or what is recorded of it; a scenario's ``outputs.signals`` choose that.

    Raises
    ------
    ResultsError
        When the destination cannot be written. Nothing is created before the run starts.
    """

    def __init__(self, destination: str | Path, run: Scenario | Recording) -> None:
        self.path = Path(destination)
        self.part_path = self.path.with_name(self.path.name + ".part")
        self._recording = run if isinstance(run, Recording) else recording_of(run)
        self._file: h5py.File | None = None
        self._groups: list[_Group] = []
        self._meter = CouplingMeter()
        self._due = 0.0
        folder = self.path.resolve().parent
        if self.path.is_dir():
            raise ResultsError(f"{self.path}: is a folder; give the name of a results file, such as results.h5")
        if not folder.is_dir():
            raise ResultsError(f"{self.path}: there is no folder {folder}; create it or choose another")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise ResultsError(f"{self.path}: the folder {folder} cannot be written; choose another")

    @property
    def has_started(self) -> bool:
        """Whether the run came so far that there is a file, under its own name or as ``.part``."""
        return bool(self._groups)

    def started(self, system: System) -> None:
        """Create the file with its groups.

        Raises
        ------
        ScenarioError
            When a pattern of ``outputs.signals`` matches no signal.
        ResultsError
            When the file cannot be created.
        """
        bound = bound_outputs(system)
        names = [
            [self._recording.name(component.name, output) for output in outputs]
            for component, outputs in zip(system.components, bound, strict=True)
        ]
        # What is read for the links' sake alone, such as a local derivative, is no result.
        signals = [
            f"{component.name}.{name}"
            for component, outputs, variables in zip(system.components, bound, names, strict=True)
            for output, name in zip(outputs, variables, strict=True)
            if component.instance.variables[output].causality == "output"
        ]
        chosen = select_signals(signals, self._recording.signals)
        try:
            self._file = h5py.File(self.part_path, "w", track_order=True)
            self._file.attrs.update(_file_attributes(self._recording))
            for component, outputs, variables in zip(system.components, bound, names, strict=True):
                columns = [k for k, name in enumerate(variables) if f"{component.name}.{name}" in chosen]
                group = self._file.create_group(component.name, track_order=True)
                group.attrs.update({**component.instance.describe(), "step": to_seconds(component.step)})
                recorded = [(outputs[k], variables[k]) for k in columns]
                self._groups.append(_Group(group, component, np.array(columns, dtype=np.int64), recorded))
            self._file.flush()
        except OSError as error:
            raise ResultsError(f"{self.part_path}: the results file cannot be created: {error}") from error
        self._meter.started(system)

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Keep samples of a component; full chunks go to the file, and all samples when it is time to.

        Parameters
        ----------
        index : int
            Index of the component in the system.
        times : NDArray[np.int64], shape (samples,)
            Time stamps, ns.
        values : NDArray[np.float64], shape (samples, outputs)
            The component's bound outputs.

        Raises
        ------
        ResultsError
            When the file cannot be written, as on a full disk.
        """
        try:
            self._groups[index].take(times, values, self._recording.end)
            self._meter.sampled(index, times, values)
            began = monotonic()
            if began >= self._due and all(group.is_created for group in self._groups):
                self._flush()
                now = monotonic()
                self._due = now + max(FLUSH_INTERVAL, (now - began) / _FLUSH_SHARE)
        except (OSError, RuntimeError) as error:
            raise ResultsError(f"{self.part_path}: the results file cannot be written: {error}") from error

    def stopped(self, reason: BaseException | None, summary: "RunSummary") -> None:
        """Write what is left and close; a complete file gets its name, and a failed one stays ``.part``.

        Raises
        ------
        ResultsError
            When a complete run cannot be written to its end.
        """
        if self._file is None:
            return
        try:
            self._flush()
            self._finish(reason, summary)
        except (OSError, RuntimeError) as error:
            if reason is None:
                raise ResultsError(f"{self.part_path}: the results file cannot be completed: {error}") from error
        finally:
            self._file = None

    def _finish(self, reason: BaseException | None, summary: "RunSummary") -> None:
        assert self._file is not None
        self._file.attrs["wall_time"] = summary.wall_time
        self._file.attrs["coupling"] = json.dumps([asdict(measure) for measure in self._meter.measures()])
        for component in summary.components:
            self._file[component.name].attrs.update({"steps": component.steps, "wall_time": component.wall_time})
        self._file.attrs["status"] = "complete" if reason is None else f"failed: {_one_line(reason)}"
        self._file.close()
        if reason is None:
            self._pack()

    def _pack(self) -> None:
        """Compress the complete file into one of its name; where there is no room for that it stays as it is."""
        packed = self.path.with_name(self.path.name + ".packing")
        try:
            pack(self.part_path, packed)
            os.replace(packed, self.path)
            self.part_path.unlink()
        except OSError:
            packed.unlink(missing_ok=True)
            os.replace(self.part_path, self.path)

    def _flush(self) -> None:
        assert self._file is not None
        for group in self._groups:
            group.store()
        self._file.flush()


def _dataset_name(variable: str) -> str:
    """A name that HDF5 takes: "/" would make a group, and "time" is taken."""
    return "time (output)" if variable == "time" else variable.replace("/", "|")


def _file_attributes(recording: Recording) -> dict[str, str | int]:
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "title": recording.title,
        **recording.attributes,
        **origin(),
        "status": "running",
    }


def origin() -> dict[str, str]:
    """Attributes `versions` and `created` of a file that is written now."""
    return {
        "versions": _versions(),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


@cache
def _versions() -> str:
    versions = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return json.dumps(versions | {"python": platform.python_version()})


def _one_line(reason: BaseException) -> str:
    text = " ".join(str(reason).split())
    told = isinstance(reason, TlpsimError) or (isinstance(reason, KeyboardInterrupt) and text)
    return text if told else f"{type(reason).__name__} {text}".strip()
