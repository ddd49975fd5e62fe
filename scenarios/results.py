"""Results of a run: one HDF5 file, written as the run goes and read back by `open_results`.

Layout, ``schema_version`` 1. Any HDF5 or netCDF-4 reader can open it; to xarray each group is a dataset.

- file attributes: ``format`` ("tlpsim results"), ``schema_version``, ``title``, ``scenario`` (JSON of the whole
  scenario), ``seeds`` and ``versions`` (JSON), ``created`` (UTC, ISO 8601), ``status`` ("running", then
  "complete" or "failed: reason")
- a group for each component, with attributes ``step`` (s), what the component says of its origin (``fmu``,
  ``sha256``, ...) and, after the run, ``steps`` (number of them) and ``wall_time`` (s, spent in them)
- in a group ``time`` (s; the master's whole nanoseconds divided by 1e9), the dimension scale of all others,
  and a dataset for each recorded variable, named by the variable as in the contract: ``position.surge``,
  attributes ``variable``, ``units``, ``description``. Values are float64, one for each time.

While the run goes the file is called NAME.part. It gets its name when the run is complete, so that a file with the
name of results never holds half a run.
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
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.system import Component, System, bound_outputs
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.schema import Scenario

FORMAT = "tlpsim results"
SCHEMA_VERSION = 1
BLOCK = 2048  # samples held in memory for each component, and the length of a chunk
# Random signals compress by about a tenth, constant ones to nothing. Gzip of level 1 costs 0.1 s for an hour of
# 36 signals at 10 Hz; LZF is faster by a fifth of that, but only h5py can read it.
_STORAGE = {"maxshape": (None,), "chunks": (BLOCK,), "compression": "gzip", "compression_opts": 1, "shuffle": True}
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


class ResultsWriter:
    """Observer of a run that writes the results file.

    Parameters
    ----------
    destination : Path
        The results file. One that exists is replaced when the run is complete, and not before.
    scenario : Scenario
        What is run; its ``outputs.signals`` choose what is recorded.

    Raises
    ------
    ResultsError
        When the destination cannot be written. Nothing is created before the run starts.
    """

    def __init__(self, destination: str | Path, scenario: Scenario) -> None:
        self.path = Path(destination)
        self.part_path = self.path.with_name(self.path.name + ".part")
        self._scenario = scenario
        self._file: h5py.File | None = None
        self._buffers: list[_Buffer] = []
        folder = self.path.resolve().parent
        if self.path.is_dir():
            raise ResultsError(f"{self.path}: is a folder; give the name of a results file, such as results.h5")
        if not folder.is_dir():
            raise ResultsError(f"{self.path}: there is no folder {folder}; create it or choose another")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise ResultsError(f"{self.path}: the folder {folder} cannot be written; choose another")

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
            self._contract_names(component, outputs)
            for component, outputs in zip(system.components, bound_outputs(system), strict=True)
        ]
        chosen = select_signals([name for component in names for name in component], self._scenario.outputs.signals)
        try:
            self._file = h5py.File(self.part_path, "w", track_order=True)
            self._file.attrs.update(_file_attributes(self._scenario))
            for component, outputs in zip(system.components, names, strict=True):
                self._buffers.append(_create_group(self._file, component, outputs, chosen))
            self._file.flush()
        except OSError as error:
            raise ResultsError(f"{self.part_path}: the results file cannot be created: {error}") from error

    def sampled(self, index: int, time: int, values: NDArray[np.float64]) -> None:
        """Keep one sample of a component; a full block goes to the file.

        Parameters
        ----------
        index : int
            Index of the component in the system.
        time : int
            Time stamp, ns.
        values : NDArray[np.float64], shape (outputs,)
            The component's bound outputs.

        Raises
        ------
        ResultsError
            When the file cannot be written, as on a full disk.
        """
        buffer = self._buffers[index]
        row = buffer.count
        buffer.time[row] = time
        buffer.values[row] = values
        buffer.count = row + 1
        if row + 1 == BLOCK:
            self._write([buffer])

    def stopped(self, reason: BaseException | None, summary: Any) -> None:
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

    def _finish(self, reason: BaseException | None, summary: Any) -> None:
        assert self._file is not None
        if summary is not None:
            _add_summary(self._buffers, summary)
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

    def _contract_names(self, component: Component, outputs: Iterable[str]) -> list[str]:
        own = self._scenario.components[component.name].map if component.name in self._scenario.components else {}
        contract = {theirs: name for name, theirs in own.items()}
        return [f"{component.name}.{contract.get(output, output)}" for output in outputs]
