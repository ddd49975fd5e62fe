"""Results of NEMOH 2 and 3 (first order, one body), read; conventions in `tlpsim.loads.bem.exchange.conventions`.

    Nemoh.cal                              ρ, g, depth, (x, y) where the wave has its crest, points of the rotations
    Results/RadiationCoefficients.tec      one zone a mode of motion: ω, then A and B for each force
    Results/ExcitationForce.tec            one zone a heading: ω, then modulus and phase (rad) for each force
    Results/FKForce.tec                    the same of the incident wave, where it is there

Version 3 may write the frequency in Hz or as period in s, which its heading tells. Folders in small letters are taken
too. A crest at (x, y) is moved to the origin by the factor exp(-i k (x cos β + y sin β)).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.exchange.conventions import CONVENTIONS, MODES, about_origin, assembled, turned
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_CONVENTION = CONVENTIONS["NEMOH"]
_HEADING = re.compile(r"beta\s*=\s*([-+.\dEe]+)")
# Unit in the file's first line -> rad/s from the first column.
_FREQUENCIES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "(rad/s)": lambda values: values,
    "(Hz)": lambda values: 2.0 * np.pi * values,
    "(s)": lambda values: 2.0 * np.pi / values,
}


def read_nemoh_results(folder: str | Path) -> HydrodynamicDatabase:
    """Database of a project folder of NEMOH, with the six modes of one rigid body.

    Raises
    ------
    ScenarioError
        If a file is missing, is not of the form above, or is of other than six modes.
    """
    project = Path(folder)
    cal = project / "Nemoh.cal"
    density, gravity, depth, crest, point = _read_cal(cal)
    radiation = _zones(_result(project, "RadiationCoefficients.tec"))
    omega, table = radiation[0][1], np.stack([values for _, _, values in radiation])
    if len(radiation) != MODES or table.shape[2] != 2 * MODES:
        raise ScenarioError(
            f"{cal}: {len(radiation)} motions and {table.shape[2] // 2} forces; "
            "give the body six of each, surge to yaw, and run it alone"
        )
    heading, excitation = _forces(_result(project, "ExcitationForce.tec"), omega)
    number = np.array([float(wavenumber(value, depth, gravity)) for value in omega])
    along = crest[0] * np.cos(heading) + crest[1] * np.sin(heading)
    shift = np.exp(-1j * number * along[:, None])[:, :, None]
    known = {}
    if (path := _result(project, "FKForce.tec", needed=False)).exists():
        known["froude_krylov_force"] = _forces(path, omega)[1] * shift
    return about_origin(
        assembled(
            omega=omega,
            heading=heading,
            depth=depth,
            density=density,
            gravity=gravity,
            added_mass=np.moveaxis(table[:, :, ::2], 0, 2),
            radiation_damping=np.moveaxis(table[:, :, 1::2], 0, 2),
            excitation_force=excitation * shift,
            **known,
        ),
        point,
    )


def _result(project: Path, name: str, needed: bool = True) -> Path:
    for folder in ("Results", "results", "."):
        if (path := project / folder / name).exists():
            return path
    if needed:
        raise ScenarioError(f"{project / 'Results' / name}: no such file; give the folder that holds Nemoh.cal")
    return project / "Results" / name


def _read_cal(path: Path) -> tuple[float, float, float, FloatArray, FloatArray]:
    """Density, gravity, depth, place of the crest (2,), and the one point (3,) of all rotations."""
    try:
        lines = path.read_text(errors="replace").splitlines()
        density, gravity, depth = (float(lines[index].split()[0]) for index in (1, 2, 3))
        crest = np.array([float(word) for word in lines[4].split()[:2]])
        modes = int(lines[10].split()[0])
        rows = [np.array([float(word) for word in line.split()[:7]]) for line in lines[11 : 11 + modes]]
    except (OSError, IndexError, ValueError) as error:
        raise ScenarioError(f"{path}: not a Nemoh.cal ({error}); give the folder that holds it") from error
    points = np.unique([row[4:7] for row in rows if row[0] == 2], axis=0).reshape(-1, 3)
    if len(points) > 1:
        raise ScenarioError(f"{path}: rotations are about {len(points)} points; use one for roll, pitch and yaw")
    return density, gravity, depth if depth > 0.0 else np.inf, crest, points[0] if len(points) else np.zeros(3)


def _zones(path: Path) -> list[tuple[str, FloatArray, FloatArray]]:
    """(title, ω, other columns) of each zone of a Tecplot file."""
    try:
        lines = path.read_text(errors="replace").splitlines()
        unit = next((unit for unit in _FREQUENCIES if unit in lines[0]), "(rad/s)")
        found: list[tuple[str, list[list[float]]]] = []
        for line in lines:
            if line.strip().lower().startswith("zone"):
                found.append((line, []))
            elif found and line.strip():
                found[-1][1].append([float(word) for word in line.split()])
        tables = [(title, np.array(rows)) for title, rows in found]
        return [(title, _FREQUENCIES[unit](table[:, 0]), table[:, 1:]) for title, table in tables]
    except (OSError, IndexError, ValueError) as error:
        raise ScenarioError(f"{path}: not a result of NEMOH ({error}); run its postprocessor again") from error


def _forces(path: Path, omega: FloatArray) -> tuple[FloatArray, ComplexArray]:
    """Headings in rad and forces (headings, frequencies, 6) as amplitudes of exp(+i omega t)."""
    zones = _zones(path)
    titles = [_HEADING.search(title) for title, _, _ in zones]
    if not zones or not all(titles):
        raise ScenarioError(f"{path}: a zone does not tell its beta; run NEMOH's postprocessor again")
    if any(len(own) != len(omega) or not np.allclose(own, omega, rtol=1e-4) for _, own, _ in zones):
        raise ScenarioError(f"{path} has other frequencies than RadiationCoefficients.tec; take both of one run")
    heading = np.array([float(title[1]) for title in titles if title]) * _CONVENTION.heading_unit
    values = np.stack([table[:, ::2] * np.exp(1j * _CONVENTION.phase_unit * table[:, 1::2]) for _, _, table in zones])
    return heading, turned(values, _CONVENTION.time_sign)
