"""Results of a run: one HDF5 file, written as the run goes and read back by `open_results`.

Layout, ``schema_version`` 1. Any HDF5 or netCDF-4 reader can open it; to xarray each group is a dataset.

- file attributes: ``format`` ("tlpsim results"), ``schema_version``, ``title``, ``scenario`` (JSON of the
  whole scenario; of a run without one ``system``, see `tlpsim.scenarios.generic`), ``seeds`` and ``versions``
  (JSON), ``created`` (UTC, ISO 8601), ``status`` ("running", then
  "complete" or "failed: reason") and, after the run, ``wall_time`` (s)
- a group for each component, with attributes ``step`` (s), what the component says of its origin (``fmu``,
  ``sha256``, ...) and, after the run, ``steps`` (number of them) and ``wall_time`` (s, spent in them)
- in a group ``time`` (s; the master's whole nanoseconds divided by 1e9), the dimension scale of all others,
  and a dataset for each recorded variable, named by the variable as in the contract: ``position.surge``,
  attributes ``variable``, ``units``, ``description``. Values are float64, one for each time.

While the run goes the file is called NAME.part. It gets its name when the run is complete, so that a file
of that name never holds half a run. Components that are stepped ahead are recorded to the end of the run only.
"""

import datetime
import fnmatch
import importlib.metadata
import json
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import Component, System, bound_outputs
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.recording import Recording, recording_of
from tlpsim.scenarios.schema import Scenario

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import RunSummary

FORMAT = "tlpsim results"
SCHEMA_VERSION = 1
BLOCK = 2048  # samples held in memory for each component, and the length of a chunk
# Random signals shrink by a tenth and constant ones to nothing. Gzip of level 1 costs about 0.1 s for an hour
# of 36 signals at 10 Hz. LZF costs half of that, but few readers other than h5py know it.
_STORAGE = {
    "maxshape": (None,),
    "chunks": (BLOCK,),
    "compression": "gzip",
    "compression_opts": 1,
    "shuffle": True,
}
_PACKAGES = ("tlpsim", "numpy", "scipy", "numba", "fmpy")


class ResultsError(TlpsimError):
    """A results file cannot be written or read."""


class _Buffer:
    """Samples of one component that are not in the file yet, and the datasets that they go to."""

    def __init__(self, width: int, columns: Sequence[int], group: h5py.Group, signals: Sequence[h5py.Dataset]):
        self.time = np.empty(BLOCK, dtype=np.int64)
        self.values = np.empty((BLOCK, width))
        self.count = 0
        self.columns = columns
        self.group = group
        self.signals = signals

    def write(self) -> None:
        """Append the samples to the datasets."""
        scale = self.group["time"]
        begin, end = len(scale), len(scale) + self.count
        # Time comes last: a reader of a broken file then never finds a time without its samples.
        for signal, column in zip(self.signals, self.columns, strict=True):
            signal.resize((end,))
            signal[begin:] = self.values[: self.count, column]
        scale.resize((end,))
        scale[begin:] = self.time[: self.count] / NANOSECONDS_PER_SECOND
        self.count = 0


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
        self._end = self._recording.end
        self._file: h5py.File | None = None
        self._buffers: list[_Buffer] = []
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
        return bool(self._buffers)

    def started(self, system: System) -> None:
        """Create the file with its groups and datasets.

        Raises
        ------
        ScenarioError
            When a pattern of ``outputs.signals`` matches no signal.
        ResultsError
            When the file cannot be created.
        """
        names = [
            [self._recording.name(component.name, output) for output in outputs]
            for component, outputs in zip(system.components, bound_outputs(system), strict=True)
        ]
        signals = [
            f"{component.name}.{name}"
            for component, variables in zip(system.components, names, strict=True)
            for name in variables
        ]
        chosen = select_signals(signals, self._recording.signals)
        try:
            self._file = h5py.File(self.part_path, "w", track_order=True)
            self._file.attrs.update(_file_attributes(self._recording))
            for component, outputs, variables in zip(system.components, bound_outputs(system), names, strict=True):
                recorded = [f"{component.name}.{name}" in chosen for name in variables]
                self._buffers.append(_create_group(self._file, component, outputs, variables, recorded))
            self._file.flush()
        except OSError as error:
            raise ResultsError(f"{self.part_path}: the results file cannot be created: {error}") from error

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Keep samples of a component; a full block goes to the file.

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
        buffer = self._buffers[index]
        first, last = 0, int(np.searchsorted(times, self._end, side="right"))
        while first < last:
            count = min(last - first, BLOCK - buffer.count)
            rows = slice(buffer.count, buffer.count + count)
            buffer.time[rows] = times[first : first + count]
            buffer.values[rows] = values[first : first + count]
            buffer.count += count
            first += count
            if buffer.count == BLOCK:
                self._write([buffer])

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
            self._write(self._buffers)
            self._finish(reason, summary)
        except (OSError, RuntimeError, ResultsError) as error:
            if reason is None:
                raise ResultsError(f"{self.part_path}: the results file cannot be completed: {error}") from error
        finally:
            self._file = None

    def _finish(self, reason: BaseException | None, summary: "RunSummary") -> None:
        assert self._file is not None
        self._file.attrs["wall_time"] = summary.wall_time
        for component in summary.components:
            self._file[component.name].attrs.update({"steps": component.steps, "wall_time": component.wall_time})
        self._file.attrs["status"] = "complete" if reason is None else f"failed: {_one_line(reason)}"
        self._file.close()
        if reason is None:
            os.replace(self.part_path, self.path)

    def _write(self, buffers: Iterable[_Buffer]) -> None:
        assert self._file is not None
        try:
            for buffer in buffers:
                buffer.write()
            self._file.flush()
        except (OSError, RuntimeError) as error:
            raise ResultsError(f"{self.part_path}: the results file cannot be written: {error}") from error


def select_signals(names: Sequence[str], patterns: Sequence[str]) -> set[str]:
    """Signals that match one of the patterns, in which `*` and `?` are wildcards and brackets are not.

    Raises
    ------
    ScenarioError
        When a pattern matches none of the names.
    """
    chosen: set[str] = set()
    for pattern in patterns:
        # tendon_tension[1] is a name, not a set of characters.
        literal = pattern.replace("[", "[[]")
        matching = {name for name in names if fnmatch.fnmatchcase(name, literal)}
        if not matching:
            raise ScenarioError(
                f"outputs.signals: '{pattern}' matches no signal{nearest(pattern, names)}; "
                "`*` stands for any text, as in 'platform.position.*'"
            )
        chosen |= matching
    return chosen


def _dataset_name(variable: str) -> str:
    """A name that HDF5 takes: "/" would make a group, and "time" is taken."""
    return "time (output)" if variable == "time" else variable.replace("/", "|")


def _create_group(
    file: h5py.File,
    component: Component,
    outputs: Sequence[str],
    variables: Sequence[str],
    recorded: Sequence[bool],
) -> _Buffer:
    """Group of a component: outputs by the FMU's names, by the contract's, and which of them are recorded."""
    group = file.create_group(component.name, track_order=True)
    group.attrs.update({**component.instance.describe(), "step": to_seconds(component.step)})
    time = group.create_dataset("time", (0,), "f8", **_STORAGE)
    time.attrs.update({"units": "s", "description": "time from the start of the simulation"})
    time.make_scale("time")
    columns, signals = [], []
    for column, (output, variable) in enumerate(zip(outputs, variables, strict=True)):
        if recorded[column]:
            signal = group.create_dataset(_dataset_name(variable), (0,), "f8", **_STORAGE)
            declared = component.instance.variables[output]
            signal.attrs.update(
                {
                    "variable": variable,
                    "units": declared.unit or "",
                    "description": declared.description or "",
                }
            )
            signal.dims[0].attach_scale(time)
            signals.append(signal)
            columns.append(column)
    return _Buffer(len(outputs), columns, group, signals)


def _file_attributes(recording: Recording) -> dict[str, str | int]:
    versions = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "title": recording.title,
        **recording.attributes,
        "versions": json.dumps(versions | {"python": platform.python_version()}),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "status": "running",
    }


def _one_line(reason: BaseException) -> str:
    text = " ".join(str(reason).split())
    return text if isinstance(reason, TlpsimError) else f"{type(reason).__name__} {text}".strip()


@dataclass(frozen=True, slots=True, kw_only=True)
class Signal:
    """One recorded variable: the dataset that holds it, its unit ("" if none is declared), what it is."""

    dataset: str
    unit: str
    description: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """A results file; arrays are read from it when they are asked for.

    Attributes
    ----------
    path : Path
        The file.
    status : str
        "complete", "running" (the run goes on, or ended without a chance to say so) or "failed: reason".
    attributes : Mapping[str, Any]
        All attributes of the file.
    components : Mapping[str, Mapping[str, Any]]
        Attributes of each component's group by component name, in the order of the scenario.
    """

    path: Path
    status: str
    attributes: Mapping[str, Any]
    components: Mapping[str, Mapping[str, Any]]
    _signals: Mapping[str, Mapping[str, Signal]]
    _samples: Mapping[str, int]

    @property
    def complete(self) -> bool:
        """Whether the run went to its end."""
        return self.status == "complete"

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return str(self.attributes["title"])

    @property
    def has_scenario(self) -> bool:
        """Whether a scenario was run, and not a system without one."""
        return "scenario" in self.attributes

    @property
    def scenario(self) -> Scenario:
        """The scenario that was run.

        Raises
        ------
        ResultsError
            When a system was run that comes from no scenario.
        """
        if not self.has_scenario:
            raise ResultsError(f"{self.path}: the run is not one of a scenario; its attribute 'system' says of which")
        return Scenario.from_json(self.attributes["scenario"])

    @property
    def seeds(self) -> dict[str, int]:
        """Seeds of wind and waves; none without a scenario."""
        return dict(json.loads(self.attributes.get("seeds", "{}")))

    @property
    def versions(self) -> dict[str, str]:
        """Versions of the packages that the run used."""
        return dict(json.loads(self.attributes["versions"]))

    def signals(self, component: str) -> tuple[str, ...]:
        """Names of the recorded variables of a component, without the component's name."""
        return tuple(self._component(component))

    def time(self, component: str) -> NDArray[np.float64]:
        """Times of a component's samples, s, shape (samples,)."""
        self._component(component)
        return self._read(component, "time")

    def signal(self, name: str) -> NDArray[np.float64]:
        """Samples of a variable such as "platform.position.surge", shape (samples,), in `unit(name)`.

        Raises
        ------
        ResultsError
            When no such variable was recorded.
        """
        return self._read(self._split(name)[0], self._signal(name).dataset)

    def unit(self, name: str) -> str:
        """Unit of a variable, "" if the component declares none."""
        return self._signal(name).unit

    def description(self, name: str) -> str:
        """What the component says of a variable."""
        return self._signal(name).description

    def _component(self, name: str) -> Mapping[str, Signal]:
        if name not in self._signals:
            hint = nearest(name, self._signals)
            known = ", ".join(self._signals)
            raise ResultsError(f"{self.path}: no component '{name}'{hint}; the components are {known}")
        return self._signals[name]

    def _split(self, name: str) -> tuple[str, str]:
        """Component and variable of a signal; the name of a component may have dots, too."""
        found = max((each for each in self._signals if name.startswith(f"{each}.")), key=len, default="")
        return (found, name[len(found) + 1 :]) if found else (name.partition(".")[0], name.partition(".")[2])

    def _signal(self, name: str) -> Signal:
        component, variable = self._split(name)
        signals = self._component(component)
        if variable not in signals:
            hint = nearest(variable, signals)
            raise ResultsError(f"{self.path}: no signal '{variable}' of '{component}' was recorded{hint}")
        return signals[variable]

    def _read(self, component: str, dataset: str) -> NDArray[np.float64]:
        with _open(self.path) as file:
            return np.asarray(file[component][dataset][: self._samples[component]])


def open_results(path: str | Path) -> Results:
    """Open a results file, complete or not; `Results.status` says which.

    Raises
    ------
    ResultsError
        When there is no such file, it is not a results file, or its layout is newer than this version knows.
    """
    path = Path(path)
    with _open(path) as file:
        attributes = dict(file.attrs)
        if attributes.get("format") != FORMAT:
            raise ResultsError(f"{path}: an HDF5 file, but not one with results of tlpsim")
        version = int(attributes["schema_version"])
        if version > SCHEMA_VERSION:
            raise ResultsError(
                f"{path}: its layout has version {version} and this tlpsim knows up to {SCHEMA_VERSION}; "
                "open it with a newer tlpsim"
            )
        signals: dict[str, Mapping[str, Signal]] = {}
        samples: dict[str, int] = {}
        for name, group in file.items():
            datasets = {key: dataset for key, dataset in group.items() if key != "time"}
            samples[name] = min(len(dataset) for dataset in group.values())
            signals[name] = MappingProxyType(
                {
                    str(dataset.attrs["variable"]): Signal(
                        dataset=key,
                        unit=str(dataset.attrs["units"]),
                        description=str(dataset.attrs["description"]),
                    )
                    for key, dataset in datasets.items()
                }
            )
        return Results(
            path=path,
            status=str(attributes["status"]),
            attributes=MappingProxyType(attributes),
            components=MappingProxyType({name: dict(group.attrs) for name, group in file.items()}),
            _signals=MappingProxyType(signals),
            _samples=MappingProxyType(samples),
        )


def _open(path: Path) -> h5py.File:
    part = path.with_name(path.name + ".part")
    if not path.exists():
        hint = f"; the run that wrote it did not end, open {part} to see how far it came" if part.exists() else ""
        raise ResultsError(f"{path}: no such results file{hint}")
    if path.is_dir():
        raise ResultsError(f"{path}: is a folder; give the name of a results file")
    try:
        return h5py.File(path, "r")
    except BlockingIOError:
        raise ResultsError(f"{path}: a run is writing it; wait until the run has ended") from None
    except OSError as error:
        text = "cannot be read" if h5py.is_hdf5(path) else "is not an HDF5 file, or is damaged"
        raise ResultsError(f"{path}: {text}: {error}") from None
