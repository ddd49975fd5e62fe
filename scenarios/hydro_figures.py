"""Figures of a hydrodynamic database: `tlpsim figures hydro`.

Added mass and radiation damping (the diagonal and the two strongest couplings), excitation force, mean drift and, of a
moving body, response amplitudes against frequency, and the mesh. Without a database they are those of the ISSC TLP.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase, cached
from tlpsim.loads.bem.mesh import panels, waterline_loops, whole
from tlpsim.loads.constants import DEGREES_OF_FREEDOM, HORIZONTAL
from tlpsim.scenarios.figure_files import save
from tlpsim.scenarios.hull import read_hull
from tlpsim.scenarios.hydro import make_problem
from tlpsim.scenarios.progress import frequency_bar

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

REFERENCE_HULL = "issc_tlp_hull.toml"
REFERENCE_CONDITIONS = ("0.1:1.2:45", "0,22.5,45", "450", "1025", "9.80665")
"""Frequencies, headings, depth, density and gravity of the figures without a database"""

_COUPLINGS = 2
_NEGLIGIBLE = 1e-3  # part of the largest modulus below which a phase is not drawn
_COLOURS = ("#1f5a96", "#d9822b", "#3a8f4d", "#a8326e", "#6b5fb5", "#4d4d4d", "#1b9aaa", "#b0413e")
_STYLES = ("-", "--", "-.", ":")
_POWERS = {-6: "10⁻⁶ ", -3: "10⁻³ ", 0: "", 3: "10³ ", 6: "10⁶ ", 9: "10⁹ ", 12: "10¹² ", 15: "10¹⁵ "}
_FREQUENCY = "frequency ω, rad/s"
_LIGHT = np.array([0.35, -0.75, 0.55])


def reference_database() -> HydrodynamicDatabase:
    """Database of the ISSC TLP in 450 m on panels of 4 m, from the cache after the first time."""
    hull = read_hull(Path(str(files("tlpsim.scenarios").joinpath(REFERENCE_HULL))))
    problem, _ = make_problem(hull, *REFERENCE_CONDITIONS, with_lid=True)
    with frequency_bar() as tell:
        return cached(problem, progress=tell)


def draw_hydrodynamics(folder: Path, database: HydrodynamicDatabase) -> list[Path]:
    """Draw a database into a folder, which is made where it is missing, and return the files.

    What a database does not hold is not drawn.

    Raises
    ------
    ScenarioError
        When the folder cannot be written.
    """
    drawings: dict[str, Callable[[HydrodynamicDatabase], Figure]] = {
        "added_mass.png": added_mass_figure,
        "radiation_damping.png": damping_figure,
        "excitation_force.png": excitation_figure,
    }
    if np.any(np.isfinite(database.mean_drift)):
        drawings["mean_drift.png"] = drift_figure
    if database.response_amplitude is not None:
        drawings["response_amplitude.png"] = response_figure
    if database.mesh is not None:
        drawings["mesh.png"] = mesh_figure
    return save(folder, {name: draw(database) for name, draw in drawings.items()})


def couplings(matrices: FloatArray) -> list[tuple[int, int]]:
    """The strongest couplings of matrices (frequencies, 6, 6), by the roots of the diagonal's peaks."""
    peak = np.sqrt(np.max(np.abs(np.einsum("wii->wi", matrices)), axis=0))
    peak[peak == 0.0] = np.inf
    ratio = np.triu(np.max(np.abs(matrices), axis=0) / (peak[:, None] * peak[None, :]), 1)
    order = np.argsort(ratio, axis=None, kind="stable")[::-1][:_COUPLINGS]
    return sorted((int(i), int(j)) for i, j in zip(*np.unravel_index(order, ratio.shape), strict=True))


def added_mass_figure(database: HydrodynamicDatabase) -> Figure:
    """Added mass against frequency, with its limits."""
    limits = (
        (database.added_mass_infinite, {"color": "#d9822b", "linestyle": "--", "label": "A(∞)"}),
        (database.added_mass_zero, {"color": "#3a8f4d", "linestyle": ":", "label": "A(0)"}),
    )
    return _matrix_figure(database, "added_mass", "A", "kg", "Added mass", limits)


def damping_figure(database: HydrodynamicDatabase) -> Figure:
    """Radiation damping against frequency."""
    return _matrix_figure(database, "radiation_damping", "B", "kg/s", "Radiation damping", ())


def _matrix_figure(
    database: HydrodynamicDatabase,
    field: str,
    letter: str,
    unit: str,
    title: str,
    limits: tuple[tuple[FloatArray, dict[str, Any]], ...],
) -> Figure:
    figure = Figure(figsize=(14.0, 6.6), layout="constrained", dpi=120)
    grid = figure.subplots(2, 2 + _COUPLINGS, sharex=True)
    matrices, bars = getattr(database, field), database.error.get(field)
    first, second = couplings(database.added_mass)
    places = [[(0, 0), (1, 1), (2, 2), first], [(3, 3), (4, 4), (5, 5), second]]
    for row, elements in zip(grid, places, strict=True):
        for axes, (i, j) in zip(row, elements, strict=True):
            values = [matrices[:, i, j], *(np.atleast_1d(limit[i, j]) for limit, _ in limits)]
            factor, power = _scale(values)
            axes.plot(database.omega, values[0] / factor, color=_COLOURS[0], marker="o", markersize=3, linewidth=1.6)
            if bars is not None:
                edges = [(values[0] + sign * bars[:, i, j]) / factor for sign in (-1.0, 1.0)]
                axes.fill_between(database.omega, *edges, color=_COLOURS[0], alpha=0.25, linewidth=0, label="error bar")
            for limit, style in limits:
                if np.isfinite(limit[i, j]):
                    axes.axhline(limit[i, j] / factor, linewidth=1.4, **style)
            arms = int(i > 2) + int(j > 2)
            name = DEGREES_OF_FREEDOM[i] if i == j else f"{DEGREES_OF_FREEDOM[i]}–{DEGREES_OF_FREEDOM[j]}"
            axes.set(title=name, ylabel=f"${letter}_{{{i + 1}{j + 1}}}$, {power}{_with_arms(unit, arms)}")
            _around_zero(axes, values, factor, spread=0.25)
            _finish(axes)
    for axes in grid[-1]:
        axes.set_xlabel(_FREQUENCY)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper right", ncols=len(handles), frameon=False)
    _head(figure, title, database)
    return figure


def _with_arms(unit: str, arms: int) -> str:
    """kg, kg m, kg m² and the same per second."""
    return unit.replace("kg", f"kg {('', 'm', 'm²')[arms]}".strip())


def excitation_figure(database: HydrodynamicDatabase) -> Figure:
    """Modulus and phase of the excitation force for each heading."""
    return _wave_figure(database, database.excitation_force, "X", ("N/m", "N m/m"), "Excitation force")


def response_figure(database: HydrodynamicDatabase) -> Figure:
    """Modulus and phase of the response amplitudes for each heading."""
    motion = database.response_amplitude
    assert motion is not None
    scaled = np.concatenate([motion[..., :3], motion[..., 3:] * (180.0 / np.pi)], axis=2)
    return _wave_figure(database, scaled, "ξ", ("m/m", "°/m"), "Response amplitude")


def _wave_figure(
    database: HydrodynamicDatabase, amplitude: ComplexArray, letter: str, units: tuple[str, str], title: str
) -> Figure:
    figure = Figure(figsize=(14.0, 11.0), layout="constrained", dpi=110)
    grid = figure.subplots(4, 3, sharex=True, height_ratios=(3, 2, 3, 2))
    largest = [float(np.nanmax(np.abs(amplitude[..., group]), initial=0.0)) for group in (slice(3), slice(3, 6))]
    for mode, name in enumerate(DEGREES_OF_FREEDOM):
        row, column = divmod(mode, 3)
        modulus, phase = grid[2 * row, column], grid[2 * row + 1, column]
        size = np.abs(amplitude[..., mode])
        size = np.where(size > 1e-6 * largest[row], size, 0.0)  # zero by symmetry but for rounding
        factor, power = _scale([size])
        for place in range(len(database.heading)):
            style = _heading_style(place)
            modulus.plot(database.omega, size[place] / factor, label=_heading_name(database, place), **style)
            angle = np.degrees(np.angle(amplitude[place, :, mode]))
            angle[size[place] <= _NEGLIGIBLE * max(float(np.nanmax(size, initial=0.0)), 1e-300)] = np.nan
            phase.plot(*_unjoined(database.omega, angle), **style)
        modulus.set(title=name, ylabel=f"$|{letter}_{mode + 1}|$, {power}{units[row]}")
        _around_zero(modulus, [size], factor)
        phase.set(ylabel="phase, °", ylim=(-190.0, 190.0), yticks=range(-180, 181, 90))
        _finish(modulus)
        _finish(phase)
    for axes in grid[-1]:
        axes.set_xlabel(_FREQUENCY)
    _legend(figure, grid[0, 0])
    _head(figure, f"{title} (phase: lead over the crest at the origin)", database)
    return figure


def drift_figure(database: HydrodynamicDatabase) -> Figure:
    """Mean drift force and moment per amplitude squared for each heading."""
    count = database.mean_drift.shape[2]
    modes = range(6) if count == 6 else HORIZONTAL
    figure = Figure(figsize=(14.0, 4.6 * (count // 3)), layout="constrained", dpi=110)
    grid = figure.subplots(count // 3, 3, sharex=True, squeeze=False)
    largest = [float(np.nanmax(np.abs(database.mean_drift[..., [k]]), initial=0.0)) for k in range(count)]
    for component, (mode, axes) in enumerate(zip(modes, grid.ravel(), strict=True)):
        values = database.mean_drift[..., component]
        rotates = mode > 2
        scale = max(value for value, other in zip(largest, modes, strict=True) if (other > 2) == rotates)
        if rotates:
            scale = max(scale, max(value for value, other in zip(largest, modes, strict=True) if other <= 2))
        values = np.where(np.abs(values) > 1e-6 * scale, values, 0.0)
        factor, power = _scale([values])
        for place in range(len(database.heading)):
            axes.plot(
                database.omega, values[place] / factor, label=_heading_name(database, place), **_heading_style(place)
            )
        axes.set(
            title=DEGREES_OF_FREEDOM[mode],
            ylabel=f"$\\overline{{F}}_{mode + 1}/a^2$, {power}{'N m/m²' if rotates else 'N/m²'}",
            xlabel=_FREQUENCY,
        )
        _around_zero(axes, [values], factor)
        _finish(axes)
    _legend(figure, grid[0, 0])
    body = "fixed body" if database.response_amplitude is None else "moving body"
    _head(figure, f"Mean drift of the {body}, by wave amplitude squared", database)
    return figure


def mesh_figure(database: HydrodynamicDatabase) -> Figure:
    """The wetted hull from above and from below, with its waterline."""
    assert database.mesh is not None
    mesh = whole(database.mesh)
    geometry = panels(mesh)
    light = _LIGHT / np.linalg.norm(_LIGHT)
    figure = Figure(figsize=(14.0, 6.0), dpi=120)
    low, high = mesh.vertices.reshape(-1, 3).min(axis=0), mesh.vertices.reshape(-1, 3).max(axis=0)
    size = np.maximum(high - low, 0.05 * np.max(high - low))
    for place, (elevation, title) in enumerate(((28.0, "from above"), (-24.0, "from below"))):
        axes: Any = figure.add_axes((0.49 * place, 0.0, 0.49, 0.92), projection="3d")
        facing = light * (1.0, 1.0, np.sign(elevation))
        shade = 0.55 + 0.45 * np.clip(geometry.normal @ facing, -0.6, 1.0)
        colour = np.clip(shade[:, None] * np.array([0.62, 0.76, 0.90]), 0.0, 1.0)
        axes.add_collection3d(Poly3DCollection(mesh.vertices, facecolors=colour, edgecolors="#39536e", linewidths=0.25))
        water = waterline_loops(mesh)
        if len(water):
            axes.add_collection3d(Line3DCollection(water, colors="#d62728", linewidths=1.6))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(tuple(size), zoom=0.93)
        axes.view_init(elev=elevation, azim=-55.0)
        axes.set_title(title, y=0.97)
        axes.set_xlabel("x, m", labelpad=10)
        axes.set_ylabel("y, m", labelpad=10)
        axes.set_zlabel("z, m", labelpad=4)
        axes.locator_params(axis="z", nbins=4)
        axes.tick_params(labelsize=8)
    figure.suptitle(
        f"{database.mesh.name}: {database.mesh.panel_count} panels on the wetted hull, waterline in red", fontsize=13
    )
    return figure


def _scale(values: list[FloatArray]) -> tuple[float, str]:
    """Power of ten that makes the finite values readable, and how it is written before a unit."""
    finite = np.concatenate([np.abs(np.ravel(value)[np.isfinite(np.ravel(value))]) for value in values])
    largest = float(np.max(finite, initial=0.0))
    if largest == 0.0:
        return 1.0, ""
    power = int(np.clip(3 * np.floor(np.log10(largest) / 3.0), min(_POWERS), max(_POWERS)))
    return 10.0**power, _POWERS[power]


def _around_zero(axes: Axes, values: list[FloatArray], factor: float, spread: float = 0.0) -> None:
    """Limits of the ordinate: from zero for values of one sign, and no tighter than a part of the largest value."""
    finite = np.concatenate([np.ravel(value)[np.isfinite(np.ravel(value))] for value in values]) / factor
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    if low == high == 0.0:
        axes.set_ylim(-1.0, 1.0)
        axes.text(0.5, 0.6, "zero by symmetry", transform=axes.transAxes, ha="center", color="0.4")
        return
    margin = 0.06 * (high - low)
    if spread and high - low < spread * max(abs(low), abs(high)):
        margin = 0.5 * (spread * max(abs(low), abs(high)) - (high - low))
    elif low >= 0.0 and not spread:
        axes.set_ylim(0.0, high + margin)
        return
    axes.set_ylim(low - margin, high + margin)


def _unjoined(omega: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A phase with a gap where it jumps by a turn."""
    jump = np.flatnonzero(np.abs(np.diff(angle)) > 180.0) + 1
    return np.insert(omega, jump, np.nan), np.insert(angle, jump, np.nan)


def _heading_style(place: int) -> dict[str, Any]:
    return {
        "color": _COLOURS[place % len(_COLOURS)],
        "linestyle": _STYLES[place % len(_STYLES)],
        "linewidth": 1.6,
        "marker": "o",
        "markersize": 2.6,
    }


def _heading_name(database: HydrodynamicDatabase, place: int) -> str:
    return f"heading {np.degrees(database.heading[place]):.4g}°"


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 8), frameon=False)


def _head(figure: Figure, title: str, database: HydrodynamicDatabase) -> None:
    depth = "deep water" if np.isinf(database.depth) else f"depth {database.depth:g} m"
    name = f"{database.mesh.name}, " if database.mesh is not None else ""
    figure.suptitle(f"{title}: {name}{depth}, {database.density:g} kg/m³", fontsize=13)


def _finish(axes: Axes) -> None:
    axes.grid(True, color="0.88", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
