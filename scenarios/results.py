"""Results of a run: one HDF5 file, written as the run goes (`tlpsim.scenarios.results_writer`).

`open` gives it as an xarray Dataset, `open_results` as a record with the scenario and everything else that is in it.

Layout, ``schema_version`` 2. Any HDF5 or netCDF-4 reader can open it; to xarray each group is a dataset.

- file attributes: ``format`` ("tlpsim results"), ``schema_version``, ``title``, ``scenario`` (JSON of the
  whole scenario; of a run without one ``system``, see `tlpsim.scenarios.generic`), ``seeds`` and ``versions``
  (JSON), ``created`` (UTC, ISO 8601), ``status`` ("running", then "complete" or "failed: reason") and, after the
  run, ``wall_time`` (s) and ``coupling`` (JSON, a list of the fields of
  `tlpsim.orchestrator.coupling_report.ConnectionMeasure`)
- a group for each component, with attributes ``step`` (s), what the component says of its origin (``fmu``,
  ``sha256``, ...) and, after the run, ``steps`` (number of them) and ``wall_time`` (s, spent in them)
- in a group ``time`` (s; the master's whole nanoseconds divided by 1e9), the dimension scale of all others,
  and a dataset for each recorded variable, named by the variable as in the contract: ``position.surge``,
  attributes ``variable``, ``units``, ``long_name``. Values are float64, one for each time. A chunk in which a signal
  keeps its first value, which is the dataset's fill value, takes no room; the others are shuffled and deflated when the
  run is complete. The group of a run that ended before its first sample is empty.

Version 1 called ``long_name`` ``description``, compressed nothing and had no ``coupling``.

While the run goes the file is called NAME.part. It gets its name when the run is complete, so that a file
of that name never holds half a run. Components that are stepped ahead are recorded to the end of the run only.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import sleep
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import TlpsimError
from tlpsim.orchestrator.coupling_report import ConnectionMeasure
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.schema import Scenario

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")

FORMAT = "tlpsim results"
SCHEMA_VERSION = 2
_ATTEMPTS, _PAUSE = 40, 0.05  # to read a file that a run changes, s between two of them
_DESCRIPTIONS = ("long_name", "description")  # of a variable, in version 2 and in version 1


class ResultsError(TlpsimError):
    """A results file cannot be written or read."""


class _ChangedError(ResultsError):
    """A run changed the file while it was read."""


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

    @property
    def coupling(self) -> tuple[ConnectionMeasure, ...]:
        """Errors of interpolation and extrapolation that the run measured; none of one that is not complete."""
        return tuple(ConnectionMeasure(**each) for each in json.loads(self.attributes.get("coupling", "[]")))

    def dataset(self) -> xarray.Dataset:
        """All signals as a dataset of xarray, see `open`."""
        return open(self.path)

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
        return _settled(self._read_once, component, dataset)

    def _read_once(self, component: str, dataset: str) -> NDArray[np.float64]:
        with _open(self.path) as file:
            group = file[component]
            return np.asarray(group[dataset][: self._samples[component]]) if dataset in group else np.zeros(0)


def open_results(path: str | Path) -> Results:
    """Open a results file, complete or not; `Results.status` says which.

    One that a run is writing can be read up to what the run wrote last, about a second ago.

    Raises
    ------
    ResultsError
        When there is no such file, it is not a results file, or its layout is newer than this version knows.
    """
    return _settled(_opened, Path(path))


def _opened(path: Path) -> Results:
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
            samples[name] = min((len(dataset) for dataset in group.values()), default=0)
            signals[name] = MappingProxyType(
                {
                    str(dataset.attrs["variable"]): Signal(
                        dataset=key,
                        unit=str(dataset.attrs["units"]),
                        description=str(next(dataset.attrs[key] for key in _DESCRIPTIONS if key in dataset.attrs)),
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


def open(path: str | Path) -> xarray.Dataset:
    """Open a results file as a dataset of xarray.

    Values are read when they are asked for; those of a file that a run is writing are read at once, since what is
    known of their places in it does not hold for long.

    Returns
    -------
    xarray.Dataset
        A variable for each recorded signal, such as ``platform.position.surge``, over the time of its component, a
        coordinate such as ``platform.time`` in s; with attributes ``units`` and ``long_name``. Its own attributes are
        those of the file, and those of the components as ``wave.step``, ``platform.sha256``, ... Close it, or use
        it in a ``with``.

    Raises
    ------
    ResultsError
        As `open_results`.
    """
    return _settled(_dataset, Path(path))


def _dataset(path: Path) -> xarray.Dataset:
    import xarray

    results = _opened(path)
    opening: dict[str, Any] = {"engine": "h5netcdf", "decode_times": False}
    with _open(path) as file, ExitStack() as stack:
        is_settled = file.id.get_access_plist().get_file_locking()[0]
        if not is_settled:  # as the file is open, since HDF5 does not mix the two in one program
            opening["driver_kwds"] = {"locking": False}
        parts = []
        attributes = dict(results.attributes)
        for component, details in results.components.items():
            part = xarray.open_dataset(path, group=component, **opening)
            stack.callback(part.close)
            found = part.isel(time=slice(results._samples[component])) if part.sizes else part
            names = {key: f"{component}.{found[key].attrs.pop('variable')}" for key in found.data_vars}
            names |= {key: f"{component}.{key}" for key in found.coords}
            parts.append(found.drop_attrs(deep=False).rename(names))
            attributes |= {f"{component}.{key}": value for key, value in details.items()}
        whole = xarray.merge(parts)
        whole.attrs = attributes
        if not is_settled:
            return whole.load()
        whole.set_close(stack.pop_all().close)
        return whole


def is_being_written(destination: str | Path) -> bool:
    """Whether a run that goes on writes this results file."""
    path = Path(destination)
    try:
        h5py.File(path.with_name(path.name + ".part"), "r").close()
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def _settled(read: Callable[..., T], *arguments: object) -> T:
    """What a reading gives, repeated for two seconds while a run changes the file under it."""
    for _ in range(_ATTEMPTS):
        try:
            return read(*arguments)
        except _ChangedError:
            sleep(_PAUSE)
    return read(*arguments)


@contextmanager
def _open(path: Path) -> Iterator[h5py.File]:
    if path.is_dir():
        raise ResultsError(f"{path}: is a folder; give the name of a results file")
    if not path.exists():
        part = path.with_name(path.name + ".part")
        hint = f"; the run that wrote it did not end, open {part} to see how far it came" if part.exists() else ""
        raise ResultsError(f"{path}: no such results file{hint}")
    error_type, hint = ResultsError, ""
    try:
        try:
            file = h5py.File(path, "r")
        except BlockingIOError:  # a run is writing it, and what it has written stands
            error_type, hint = _ChangedError, "; a run is writing it: try again"
            file = h5py.File(path, "r", locking=False)
        except OSError:  # perhaps this program has had it open since a run wrote it
            file = h5py.File(path, "r", locking=False)
        with file:
            yield file
    except (OSError, RuntimeError, KeyError) as error:
        text = "cannot be read" if h5py.is_hdf5(path) else "is not an HDF5 file, or is damaged"
        raise error_type(f"{path}: {text}: {error}{hint}") from None
