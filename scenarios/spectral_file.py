"""A response by the frequency domain as one HDF5 file: `tlpsim spectral -o`, `read_spectral`.

Layout, ``schema_version`` 1:

- file attributes: ``format`` ("tlpsim spectral response"), ``schema_version``, ``title``, ``scenario`` (JSON of the
  whole scenario), ``versions`` (JSON) and ``created`` (UTC, ISO 8601), as in a results file
- ``frequency`` (n,), Hz, the dimension scale of the spectra
- group ``quantities``: a dataset for each, its density (n,), with attributes ``units`` (of the mean), ``mean``,
  ``skewness`` and ``excess_kurtosis``
- ``cross_spectrum`` (n, 6, 6) of the six positions, complex, and group ``contributions``, (n, 6) each
- group ``mean_loads``, (6,) each, and ``mean_position`` (6,)
- group ``modes``: ``name``, ``period`` and ``damping_ratio``, slowest first
- ``iterations``, and group ``seconds``, the wall time by step of the analysis

A compact file, as a sweep leaves one for each case, has what the groups ``quantities`` and ``contributions`` hold as a
dataset each, (q, n) and (c, n, 6), in single precision; their names and the other attributes are arrays, with an entry
a row.

Other files hold a response, too, in a group of this layout: see `write_response` and `read_response`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.records import Mode, Quantity, SpectralResponse
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.results_writer import origin
from tlpsim.scenarios.schema import Scenario

FORMAT = "tlpsim spectral response"
SCHEMA_VERSION = 1
_STATISTICS = ("mean", "skewness", "excess_kurtosis")


def write_spectral(response: SpectralResponse, scenario: Scenario, path: str | Path, *, compact: bool = False) -> None:
    """Write a response with its scenario; the file is there when it is complete.

    Parameters
    ----------
    compact
        Whether spectra are kept together and in single precision, which takes half of the room and a sixth of the time.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    with whole_file(path, "the response") as part, h5py.File(part, "w") as file:
        file.attrs.update(head(FORMAT, SCHEMA_VERSION, scenario))
        write_response(file, response, compact=compact)


def read_spectral(path: str | Path) -> SpectralResponse:
    """Response of a file that `write_spectral` wrote.

    Raises
    ------
    ScenarioError
        If there is no such file, it is another kind of file, or its layout is newer than this version knows.
    """
    with opened(path, FORMAT, SCHEMA_VERSION, "tlpsim spectral") as file:
        return read_response(file)


def read_head(path: str | Path) -> Mapping[str, Any]:
    """Attributes of an HDF5 file; none where it is not one."""
    try:
        with h5py.File(path, "r") as file:
            return dict(file.attrs)
    except OSError:
        return {}


def head(form: str, version: int, scenario: Scenario) -> dict[str, Any]:
    """Attributes that files of the frequency domain begin with, under the names of a results file."""
    return {
        "format": form,
        "schema_version": version,
        "title": scenario.title,
        "scenario": scenario.to_json(),
        **origin(),
    }


@contextmanager
def opened(path: str | Path, form: str, version: int, command: str) -> Iterator[h5py.File]:
    """An HDF5 file of a format, open for reading; `command` is the one that makes such a file.

    Raises
    ------
    ScenarioError
        As `read_spectral`.
    """
    remedy = f"make one with `{command} SCENARIO -o {path}`"
    if not Path(path).is_file():
        raise ScenarioError(f"{path}: no such file; {remedy}")
    try:
        with h5py.File(path, "r") as file:
            found, number = str(file.attrs.get("format", "")), int(file.attrs.get("schema_version", 0))
            if found != form:
                raise ScenarioError(f"{path}: holds {found or 'another kind of data'}, not {form}; {remedy}")
            if number > version:
                raise ScenarioError(
                    f"{path}: its layout has version {number} and this tlpsim knows up to {version}; "
                    "open it with a newer tlpsim"
                )
            yield file
    except (OSError, KeyError, ValueError) as error:
        raise ScenarioError(f"{path}: cannot be read as {form} ({error}); {remedy}") from None


def write_response(group: h5py.Group, response: SpectralResponse, *, compact: bool = False) -> None:
    """Put a response into a file or a group of it; `compact` as of `write_spectral`."""
    scale = group.create_dataset("frequency", data=response.frequency)
    scale.attrs["units"] = "Hz"
    scale.make_scale("frequency")
    (_write_compact if compact else _write_each)(group, response)
    for name in ("mean_loads", "seconds"):
        values: Mapping[str, Any] = getattr(response, name)
        parts = group.create_group(name, track_order=True)
        for part, data in values.items():
            parts.create_dataset(part, data=data)
    group.create_dataset("mean_position", data=response.mean_position)
    modes = group.create_group("modes")
    modes.create_dataset("name", data=[mode.name for mode in response.modes], dtype=h5py.string_dtype())
    for name, unit in (("period", "s"), ("damping_ratio", "1")):
        column = modes.create_dataset(name, data=np.array([getattr(mode, name) for mode in response.modes]))
        column.attrs["units"] = unit
    group.create_dataset("iterations", data=np.array(response.iterations))


def _write_each(group: h5py.Group, response: SpectralResponse) -> None:
    """A dataset for each spectrum."""
    scale = group["frequency"]
    quantities = group.create_group("quantities", track_order=True)
    for name, quantity in response.quantities.items():
        dataset = quantities.create_dataset(name, data=quantity.density)
        dataset.attrs.update({"units": quantity.unit, "density_units": f"({quantity.unit})²/Hz"})
        for statistic in _STATISTICS:
            dataset.attrs[statistic] = getattr(quantity, statistic)
        dataset.dims[0].attach_scale(scale)
    group.create_dataset("cross_spectrum", data=response.cross_spectrum).dims[0].attach_scale(scale)
    contributions = group.create_group("contributions", track_order=True)
    for name, data in response.contributions.items():
        contributions.create_dataset(name, data=data)


def _write_compact(group: h5py.Group, response: SpectralResponse) -> None:
    """All spectra of a kind as one dataset."""
    every = list(response.quantities.values())
    quantities = group.create_dataset("quantities", data=np.array([each.density for each in every], dtype=np.float32))
    quantities.attrs["name"] = list(response.quantities)
    quantities.attrs["units"] = [each.unit for each in every]
    for statistic in _STATISTICS:
        quantities.attrs[statistic] = np.array([getattr(each, statistic) for each in every])
    group.create_dataset("cross_spectrum", data=response.cross_spectrum.astype(np.complex64))
    parts = np.array(list(response.contributions.values()), dtype=np.float32)
    contributions = group.create_dataset("contributions", data=parts)
    contributions.attrs["name"] = list(response.contributions)


def _rows(data: h5py.Group | h5py.Dataset) -> Iterator[tuple[str, NDArray[np.float64], Mapping[str, Any]]]:
    """Name, spectrum and attributes of each of a kind, of either layout."""
    if isinstance(data, h5py.Group):
        for name, dataset in data.items():
            yield name, np.asarray(dataset, dtype=np.float64), dataset.attrs
        return
    attributes = {key: data.attrs[key] for key in data.attrs if len(data.attrs[key]) == len(data)}
    for k, row in enumerate(np.asarray(data, dtype=np.float64)):
        own = {key: values[k] for key, values in attributes.items()}
        yield str(own["name"]), row, own


def read_response(group: h5py.Group) -> SpectralResponse:
    """Response in a file or a group of it."""
    frequency = np.asarray(group["frequency"])
    quantities = {
        name: Quantity(
            name=name,
            unit=str(attributes["units"]),
            frequency=frequency,
            density=density,
            **{key: float(attributes[key]) for key in _STATISTICS},
        )
        for name, density, attributes in _rows(group["quantities"])
    }
    columns = zip(*(group["modes"][name][()] for name in ("name", "period", "damping_ratio")), strict=True)
    return SpectralResponse(
        frequency=frequency,
        quantities=quantities,
        cross_spectrum=np.asarray(group["cross_spectrum"], dtype=np.complex128),
        contributions={name: density for name, density, _ in _rows(group["contributions"])},
        mean_loads={name: np.asarray(data) for name, data in group["mean_loads"].items()},
        mean_position=np.asarray(group["mean_position"]),
        modes=tuple(
            Mode(name=name.decode(), period=float(period), damping_ratio=float(ratio))
            for name, period, ratio in columns
        ),
        iterations=tuple(float(value) for value in group["iterations"]),
        seconds={name: float(value[()]) for name, value in group["seconds"].items()},
    )
