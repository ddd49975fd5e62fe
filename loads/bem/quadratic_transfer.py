"""Difference-frequency quadratic transfer functions as a record, and the HDF5 file that keeps one.

With amplitudes a_i exp(+i ω_i t) of waves the slowly varying force about the origin is (Pinkster 1980)

    F(t) = Re Σ_i Σ_j a_i a_j* T_ij exp(i (ω_i - ω_j) t),   T_ji = T_ij*,                                     (1)

with SI units, z up from the still water level, headings in rad of propagation anticlockwise from +x, and a wave's crest
at the origin at t = 0. What a T holds is told in words: the quadratic part alone
(`tlpsim.loads.bem.quadratic`), or the potential of second order too, which other codes add.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import whole_file

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SCHEMA_NAME = "tlpsim quadratic transfer function"
SCHEMA_VERSION = 1
SCHEMA = f"{SCHEMA_NAME} {SCHEMA_VERSION}"
CONVENTIONS = {
    "time_factor": "exp(+i omega t)",
    "force": "Re sum_i sum_j a_i conj(a_j) T_ij exp(i (omega_i - omega_j) t)",
    "heading": "direction of propagation, anticlockwise from +x",
    "axes": "z up from the still water level",
    "reference_point": "origin",
    "wave": "unit amplitude, crest at the origin at t = 0",
    "components": ", ".join(DEGREES_OF_FREEDOM),
    "missing": "NaN",
}
"""Attributes of every file."""
QUADRATIC_PART = "quadratic part: products of first-order quantities; the potential of second order is left out"
"""What `tlpsim bem --qtf` computes."""
MOVING_BODY, FIXED_BODY = "moving body", "fixed body"
"""What it tells of the body, after a semicolon."""

LARGEST_ASYMMETRY = 0.02
"""Of T_ij - T_ji*, relative to the largest T of a component, above which a table is refused."""

_NOTHING = 1e-9  # of the largest component: below it there is only rounding
_FEWEST_FREQUENCIES = 2
_WATER = ("depth", "density", "gravity")
_UNITS = {"omega": "rad/s", "heading": "rad", "transfer": "N/m2, N/m"}
_DIMENSIONS = {
    4: "heading, first frequency, second frequency, component",
    5: "first heading, second heading, first frequency, second frequency, component",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadraticTransfer:
    """Difference-frequency quadratic transfer function about the origin, eq. (1).

    Parameters
    ----------
    omega
        Shape (n,), rad/s, ascending.
    heading
        Shape (h,), rad.
    transfer
        Shape (h, n, n, 6) with both waves of one heading, or (h, h, n, n, 6) of all pairs; the first wave's index comes
        first. N/m² and N·m/m².
    depth, density, gravity
        Of the water, m (infinity for deep water), kg/m³ and m/s²; NaN where it is not known.
    contents
        What is in T and where it comes from, in words.

    Raises
    ------
    ScenarioError
        If the shapes do not fit, a value is not finite, or T_ij is not T_ji*.
    """

    omega: FloatArray
    heading: FloatArray
    transfer: ComplexArray
    depth: float = np.nan
    density: float = np.nan
    gravity: float = np.nan
    contents: str = ""

    def __post_init__(self) -> None:
        count, headings = len(self.omega), len(self.heading)
        shapes = ((headings, count, count, 6), (headings, headings, count, count, 6))
        if np.shape(self.transfer) not in shapes:
            raise ScenarioError(
                f"quadratic transfer function has shape {np.shape(self.transfer)}; {headings} headings and {count} "
                f"frequencies need {shapes[0]}, or {shapes[1]} of pairs of headings"
            )
        require_frequencies(self.omega)
        if not (np.all(np.isfinite(self.transfer)) and np.all(np.isfinite(self.heading))):
            raise ScenarioError("quadratic transfer function holds values that are not finite; compute them")
        gap = np.max(np.abs(self.transfer - adjoint(self.transfer)), axis=tuple(range(self.transfer.ndim - 1)))
        largest = largest_values(self)
        bad = gap > LARGEST_ASYMMETRY * np.maximum(largest, _NOTHING * np.max(largest, initial=0.0))
        if np.any(bad):
            name = DEGREES_OF_FREEDOM[int(np.argmax(bad))]
            raise ScenarioError(
                f"quadratic transfer function: T_ij and T_ji* differ in {name} by {gap[bad][0]:.3g}, of at most "
                f"{largest[bad][0]:.3g}; give T of all ordered pairs, amplitudes exp(+i omega t), first index not "
                "conjugated"
            )


def require_frequencies(omega: FloatArray) -> None:
    """Check the frequencies (n,) of a quadratic transfer function, rad/s.

    Raises
    ------
    ScenarioError
        If there are fewer than two, or they are not positive and ascending.
    """
    if len(omega) < _FEWEST_FREQUENCIES or not np.all(np.diff(omega) > 0.0) or not omega[0] > 0.0:
        raise ScenarioError(
            f"frequencies of the quadratic transfer function are {np.array2string(omega, threshold=6)} rad/s; "
            f"at least {_FEWEST_FREQUENCIES}, positive and ascending, are needed"
        )


def adjoint(transfer: ComplexArray) -> ComplexArray:
    """T_ji* in the place of T_ij, headings exchanged with the frequencies; shapes as in `QuadraticTransfer`."""
    swapped = np.swapaxes(transfer, -3, -2).conj()
    return np.swapaxes(swapped, 0, 1) if transfer.ndim == 5 else swapped


def of_one_heading(table: QuadraticTransfer) -> ComplexArray:
    """T of two waves of one heading, (h, n, n, 6)."""
    return np.asarray(np.einsum("aa...->a...", table.transfer) if table.transfer.ndim == 5 else table.transfer)


def mean_drift_of(table: QuadraticTransfer) -> FloatArray:
    """The diagonal T_ii, which is the mean drift a unit amplitude squared, (h, n, 6)."""
    return np.asarray(np.einsum("hii...->hi...", of_one_heading(table)).real)


def is_of_fixed_body(table: QuadraticTransfer) -> bool:
    """Whether the contents say that the body is held fixed. Of other codes' tables, which do not tell, it moves."""
    return table.contents.startswith(f"{QUADRATIC_PART}; {FIXED_BODY} ")


def largest_values(table: QuadraticTransfer) -> FloatArray:
    """Largest |T| of each component, (6,)."""
    return np.asarray(np.max(np.abs(table.transfer), axis=tuple(range(table.transfer.ndim - 1)), initial=0.0))


def write_quadratic_transfer(table: QuadraticTransfer, path: str | Path) -> None:
    """Write a quadratic transfer function as HDF5; the file is there when it is complete.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    with whole_file(path, "the quadratic transfer function") as part, h5py.File(part, "w") as file:
        file.attrs.update({"schema": SCHEMA, **CONVENTIONS, "contents": table.contents})
        for name in _WATER:
            file.attrs[name] = getattr(table, name)
        for name, unit in _UNITS.items():
            file.create_dataset(name, data=getattr(table, name)).attrs["unit"] = unit
        file["transfer"].attrs["dimensions"] = _DIMENSIONS[table.transfer.ndim]


def is_quadratic_transfer(path: str | Path) -> bool:
    """Whether a file is a quadratic transfer function, of this or another version."""
    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs.get("schema", "")).startswith(SCHEMA_NAME)
    except OSError:
        return False


def read_quadratic_transfer(path: str | Path) -> QuadraticTransfer:
    """Read a quadratic transfer function from HDF5.

    Raises
    ------
    ScenarioError
        If the file is missing, damaged, of another kind, version or convention, or its values make no transfer
        function.
    """
    remedy = f"make it with `tlpsim bem HULL -o DATABASE.h5 --qtf {path}`"
    try:
        with h5py.File(path, "r") as file:
            _require_schema(path, str(file.attrs.get("schema", "none")), remedy)
            _require_conventions(path, file)
            content: dict[str, Any] = {name: np.asarray(file[name][()]) for name in _UNITS}
            content |= {name: float(file.attrs[name]) for name in _WATER}
            content["contents"] = str(file.attrs["contents"])
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise ScenarioError(f"{path}: not a quadratic transfer function, or damaged ({error}); {remedy}") from error
    try:
        return QuadraticTransfer(**content)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def quadratic_transfer_by_name(name: str, density: float, gravity: float) -> QuadraticTransfer:
    """Quadratic transfer function of a file of ours (.h5), or of WAMIT's .10d, .11d or .12d.

    Parameters
    ----------
    name
        Path of the file.
    density, gravity
        Of the site, kg/m³ and m/s², for the numbers of WAMIT, which are taken with ULEN 1 m and about the origin.

    Raises
    ------
    ScenarioError
        If the suffix is another one, or the file cannot be read.
    """
    from tlpsim.loads.bem.exchange.wamit_quadratic import SUFFIXES, read_wamit_quadratic

    suffix = Path(name).suffix
    if suffix == ".h5":
        return read_quadratic_transfer(name)
    if suffix not in SUFFIXES:
        raise ScenarioError(
            f"{name}: a quadratic transfer function is an .h5 file, or {', '.join(SUFFIXES)} of WAMIT, not '{suffix}'; "
            "give the path of such a file"
        )
    return read_wamit_quadratic(name, density=density, gravity=gravity)


def _require_schema(path: str | Path, found: str, remedy: str) -> None:
    name, _, version = found.rpartition(" ")
    if found == SCHEMA:
        return
    if name == SCHEMA_NAME and version.isdigit() and int(version) > SCHEMA_VERSION:
        remedy = "it comes from a newer tlpsim: install that one"
    raise ScenarioError(f"{path}: schema is '{found}', '{SCHEMA}' is needed; {remedy}")


def _require_conventions(path: str | Path, file: h5py.File) -> None:
    """The convention of the phases and the units, which another program may have written otherwise."""
    found = [(name, str(file.attrs[name]), CONVENTIONS[name]) for name in ("time_factor", "reference_point")]
    found += [(f"unit of {name}", str(file[name].attrs["unit"]), unit) for name, unit in _UNITS.items()]
    for what, have, want in found:
        if have != want:
            raise ScenarioError(f"{path}: {what} is '{have}', '{want}' is needed; convert the values and say so")
