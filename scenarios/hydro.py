"""What `tlpsim bem` does: read frequencies and headings, solve with a progress bar, write, and tell the result."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from tlpsim.loads.bem.database import HydrodynamicDatabase, Problem, cache_path, cached, write
from tlpsim.loads.bem.exchange import write_capytaine, write_wamit
from tlpsim.loads.bem.irregular import irregular_warning
from tlpsim.loads.bem.quadratic_table import quadratic_table
from tlpsim.loads.bem.quadratic_transfer import (
    QuadraticTransfer,
    largest_values,
    mean_drift_of,
    require_frequencies,
)
from tlpsim.loads.constants import DEGREES_OF_FREEDOM, HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.hull import Hull, checked, lid_of
from tlpsim.scenarios.progress import frequency_bar
from tlpsim.scenarios.quantities import ACCELERATION, DENSITY, LENGTH, Dimension
from tlpsim.scenarios.terminal import output

FloatArray = NDArray[np.float64]

MOST_VALUES = 10_000
_SHOWN = 6  # numbers of a list that are printed
_NEVER = "–"
_NOTHING = 1e-6  # of the largest mean drift: a component below it is rounding


def numbers(text: str, name: str) -> FloatArray:
    """Numbers of "start:stop:count", both ends in it, or of a comma list.

    Raises
    ------
    ScenarioError
        If the text is neither.
    """
    try:
        if ":" in text:
            start, stop, count = text.split(":")
            if not 1 <= int(count) <= MOST_VALUES:
                raise ValueError
            result = np.linspace(float(start), float(stop), int(count))
        else:
            result = np.array([float(word) for word in text.split(",")])
        if not np.all(np.isfinite(result)):
            raise ValueError
    except ValueError:
        raise ScenarioError(
            f"{name} is '{text}'; write START:STOP:COUNT, as in 0.1:1.2:23, or a list of numbers with commas"
        ) from None
    return result


def frequencies(text: str, name: str = "--omega") -> FloatArray:
    """Angular frequencies in rad/s, ascending, none twice, of the text of the option `name`.

    Raises
    ------
    ScenarioError
        If the text holds no numbers, or one that is not above zero.
    """
    result = np.unique(numbers(text, name))
    if result[0] <= 0.0:
        raise ScenarioError(
            f"{name} has {result[0]:g} rad/s; frequencies must be above zero: A(0) and A(∞) are always computed"
        )
    return result


def quantity(text: str, name: str, dimension: Dimension) -> float:
    """A number above zero with or without a unit; "inf" is one for a length.

    Raises
    ------
    ScenarioError
        If the text is none.
    """
    if dimension is LENGTH and text.strip().lower() in ("inf", "infinite"):
        return np.inf
    try:
        value = dimension.parse(text)
    except ValueError as error:
        raise ScenarioError(f"{name} is '{text}': {error}") from None
    if value <= 0.0:
        raise ScenarioError(f"{name} is '{text}'; it must be above zero {dimension.base_unit}")
    return value


def make_problem(
    hull: Hull,
    omega: str,
    headings: str,
    depth: str,
    density: str,
    gravity: str,
    with_lid: bool,
    vertical_drift: bool = False,
) -> tuple[Problem, list[str]]:
    """Problem of a hull and of the texts of the command line, and warnings about it.

    Raises
    ------
    ScenarioError
        If a text cannot be read or the mesh is broken.
    """
    values = frequencies(omega)
    directions = np.radians(numbers(headings, "--headings"))
    water = quantity(depth, "--depth", LENGTH)
    draught = -float(np.min(hull.mesh.vertices[:, :, 2]))
    if not water > draught:
        raise ScenarioError(f"--depth is {water:g} m, but the hull reaches {draught:g} m down; give more depth")
    heavy, pull = quantity(density, "--rho", DENSITY), quantity(gravity, "--gravity", ACCELERATION)
    warnings = checked(hull, 2.0 * np.pi / float(wavenumber(values[-1], water, pull)), heavy)
    lid = hull.lid if with_lid else None
    if lid is None and (told := irregular_warning(hull.mesh, values, pull)):
        warnings.append(told)
    body = hull.body
    problem = Problem(
        mesh=hull.mesh,
        lid=lid,
        omega=values,
        heading=directions,
        depth=water,
        density=heavy,
        gravity=pull,
        mass=None if body is None else body.mass_matrix(),
        stiffness=None if body is None else body.total_stiffness(hull.mesh, heavy, pull),
        coarse=hull.coarse,
        vertical_drift=vertical_drift,
        coarse_lid=None if lid is None or hull.coarse is None else lid_of(hull.coarse),
    )
    return problem, warnings


def solved(problem: Problem) -> tuple[HydrodynamicDatabase, bool]:
    """Solve a problem, or take it from the cache, and say whether it came from there."""
    from_cache = cache_path(problem).exists()
    with frequency_bar() as tell:
        return cached(problem, progress=tell), from_cache


def require_quadratic(file: Path | None, database: Path, omega: str, own: str | None, pairs: bool) -> None:
    """Check the options of a quadratic transfer function before anything is computed.

    Parameters
    ----------
    file, own, pairs
        `--qtf`, `--qtf-omega` and `--qtf-pairs`.
    database, omega
        `--output` and `--omega`.

    Raises
    ------
    ScenarioError
        If there is no file but other options, the file cannot be written, or there are fewer than two frequencies.
    """
    if file is None:
        if own is not None or pairs:
            raise ScenarioError("--qtf-omega and --qtf-pairs are for --qtf: name a file with it, or leave them out")
        return
    require_writable(file)
    if file.resolve() == database.resolve():
        raise ScenarioError(f"--qtf and --output are both {file}; give two names")
    require_frequencies(frequencies(omega) if own is None else frequencies(own, "--qtf-omega"))


def solved_quadratic(problem: Problem, omega: str | None, pairs: bool) -> QuadraticTransfer:
    """Quadratic transfer function of a problem at its own frequencies, or at those of the text of `--qtf-omega`.

    Raises
    ------
    ScenarioError
        If the text holds no frequencies, or there are fewer than two.
    """
    chosen = problem if omega is None else replace(problem, omega=frequencies(omega, "--qtf-omega"))
    with frequency_bar("quadratic transfer function") as tell:
        return quadratic_table(chosen, pairs=pairs, progress=tell)


def print_quadratic_transfer(table: QuadraticTransfer, database: HydrodynamicDatabase | None = None) -> None:
    """Table of a quadratic transfer function: water, range, contents, largest values.

    With the database of the same hull also how far the diagonal is from the mean drift there.
    """
    output.print(_water(table.depth, table.density, table.gravity))
    output.print(f"frequencies: {_listed(table.omega)} rad/s")
    pairs = "all pairs of headings" if table.transfer.ndim == 5 else "two waves of one heading"
    output.print(f"headings: {_listed(np.degrees(table.heading))}°; {pairs}")
    output.print(table.contents)
    shown = Table(title="Difference-frequency quadratic transfer function, N/m² and N·m/m²")
    shown.add_column("", no_wrap=True)
    columns = ["largest |T|", "largest mean drift"]
    apart = None if database is None else _from_mean_drift(table, database)
    if apart is not None:
        columns.append("off the database's, %")
    for heading in columns:
        shown.add_column(heading, justify="right")
    mean = np.max(np.abs(mean_drift_of(table)), axis=(0, 1))
    for k, name in enumerate(DEGREES_OF_FREEDOM):
        cells = [_number(float(values[k])) for values in (largest_values(table), mean)]
        shown.add_row(name, *cells, *([] if apart is None else [_percent(float(apart[k]))]))
    output.print(shown)


def _from_mean_drift(table: QuadraticTransfer, database: HydrodynamicDatabase) -> FloatArray | None:
    """Largest difference (6,) of diagonal and mean drift, by the largest drift; NaN where that is not known.

    None for other frequencies than the database's.
    """
    if not np.array_equal(table.omega, database.omega) or not np.array_equal(table.heading, database.heading):
        return None
    count = database.mean_drift.shape[2]
    known = list(HORIZONTAL) if count == len(HORIZONTAL) else list(range(count))
    result = np.full(len(DEGREES_OF_FREEDOM), np.nan)
    size = np.max(np.abs(database.mean_drift), axis=(0, 1))
    apart = np.max(np.abs(mean_drift_of(table)[..., known] - database.mean_drift), axis=(0, 1))
    least = np.repeat(_NOTHING * np.max(size), count)
    result[known] = np.where(size > least, apart / np.maximum(size, least), np.nan)
    return result


def _water(depth: float, density: float, gravity: float) -> str:
    below = "deep water" if np.isinf(depth) else f"depth {_number(depth)} m"
    return f"{below}, {_number(density)} kg/m³, {_number(gravity)} m/s²"


def _peaks(database: HydrodynamicDatabase) -> NDArray[np.int64]:
    """Index (6,) of the frequency with the largest damping, for each mode."""
    return np.argmax(np.einsum("wii->wi", database.radiation_damping), axis=0)


def write_output(database: HydrodynamicDatabase, path: Path) -> list[Path]:
    """Write a database in the format that the suffix says: .nc Capytaine's, .1 WAMIT's, any other ours.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"{path.parent}: cannot be made ({error.strerror}); name another folder") from error
    if path.suffix == ".nc":
        write_capytaine(database, path)
    elif path.suffix == ".1":
        return list(write_wamit(database, path.with_suffix("")))
    else:
        write(database, path)
    return [path]


def print_database(database: HydrodynamicDatabase) -> None:
    """Table of a database: water, hull, added mass and damping by mode, with error bars where known."""
    for line in _lines(database):
        output.print(line)
    table = Table(title="Added mass and radiation damping, SI units")
    table.add_column("", no_wrap=True)
    told = bool(database.error)
    for heading in ("A(0)", "A(∞)", *(["± %"] if told else []), "largest B", *(["± %"] if told else []), "at rad/s"):
        table.add_column(heading, justify="right", no_wrap=True)
    for mode, (name, peak) in enumerate(zip(DEGREES_OF_FREEDOM, _peaks(database), strict=True)):
        cells = [_number(database.added_mass_zero[mode, mode]), _number(database.added_mass_infinite[mode, mode])]
        damping = [_number(database.radiation_damping[peak, mode, mode])]
        if told:
            infinite, largest = database.error["added_mass_infinite"], database.error["radiation_damping"][peak]
            cells.append(_percent(infinite[mode, mode] / database.added_mass_infinite[mode, mode]))
            damping.append(_percent(largest[mode, mode] / database.radiation_damping[peak, mode, mode]))
        table.add_row(name, *cells, *damping, f"{database.omega[peak]:.3g}")
    output.print(table)
    if told:
        output.print("extrapolated to ever finer panels from this mesh and one of panels twice as large; ± is the bar")
    for name, matrices in (("A", database.added_mass), ("B", database.radiation_damping)):
        output.print(f"{name}: largest asymmetry {_percent(_asymmetry(matrices))} %, which a converged mesh has not")


def _lines(database: HydrodynamicDatabase) -> Iterator[str]:
    yield _water(database.depth, database.density, database.gravity)
    yield f"frequencies: {_listed(database.omega)} rad/s"
    yield f"headings: {_listed(np.degrees(database.heading))}°"
    if database.mesh is not None:
        yield f"mesh: {database.mesh.name}, {database.mesh.panel_count} panels, {_planes(database.mesh.planes)}"
    still = database.hydrostatics
    if still is not None:
        figures = (still.volume, still.centre_of_buoyancy[2], still.waterplane_area)
        volume, height, area = (_NEVER if np.isnan(value) else f"{value:.6g}" for value in figures)
        yield f"volume {volume} m³, centre of buoyancy at z = {height} m, water plane {area} m²"
    held = {
        "Froude-Krylov force": np.any(np.isfinite(database.froude_krylov_force)),
        "mean drift": np.any(np.isfinite(database.mean_drift)),
        "response amplitudes": database.response_amplitude is not None,
    }
    yield "with " + ", ".join(["excitation force", *(name for name, there in held.items() if there)])


def _planes(planes: tuple[str, ...]) -> str:
    return f"symmetric in {' and '.join(planes)}" if planes else "no planes of symmetry"


def _listed(values: FloatArray) -> str:
    if len(values) <= _SHOWN:
        return ", ".join(f"{value:.4g}" for value in values)
    return f"{len(values)} from {values[0]:.4g} to {values[-1]:.4g}"


def _asymmetry(matrices: FloatArray) -> float:
    """Largest difference of a matrix (frequencies, 6, 6) and its transpose, by the roots of the diagonal's peaks."""
    peak = np.sqrt(np.max(np.abs(np.einsum("wii->wi", matrices)), axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(matrices - np.swapaxes(matrices, 1, 2)) / (peak[:, None] * peak[None, :])
    return float(np.nanmax(ratio, initial=0.0))


def _number(value: float) -> str:
    if np.isnan(value):
        return _NEVER
    return "∞" if np.isinf(value) else f"{value:.4g}"


def _percent(value: float) -> str:
    return f"{100.0 * value:.2g}" if np.isfinite(value) else _NEVER
