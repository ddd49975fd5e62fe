"""First-order wave forces from a hydrodynamic database, at any frequency and heading of a sea.

    F(t) = Re{sum_n X(omega_n, beta_n) a_n(t)}                                                            (1)
    X(omega, beta) = sum_m C_m(omega) exp(i m beta)                                                       (2)
    X(omega, 2 alpha - beta) = P_alpha X(omega, beta)                                                     (3)

a_n are the amplitudes of the sea (`tlpsim.loads.waves.sea`): for a sea by digital filters eq. (1) is the discrete
convolution of the elevation with the kernel of X. Since X refers to the origin, its phase turns slowly with frequency
and heading, and X itself can be interpolated: by a cubic spline over frequency, and over headings that go round the
circle in equal steps by their Fourier series, eq. (2), which is exact where 2 pi over the step is more than twice k b,
b the half-length of the hull. A hull whose vertical plane through the z axis at an angle alpha is one of symmetry
needs headings on one side of it only: eq. (3), P_alpha the reflection of forces (polar) and moments (axial vectors).
The planes 0°, 90° and 45° are found by the data: where headings coincide after a reflection, so must the forces.

Below the lowest frequency, where a wave is much longer than the hull, Re X holds even powers of k and Im X odd ones:

    Re X = Re X(omega_1),   Im X = Im X(omega_1) k / k_1                                                  (4)

so heave keeps the buoyancy of the water plane and surge goes with the slope of the wave, as the Froude-Krylov force.
Above the highest one, X(omega_N) is taken down to zero by cos² over a tenth of omega_N. Both are meant for energy that
does not count: a database must hold all but 0.1 % of the energy of the waves that act.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.remembered import remembered
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.sea import Sea, SeaState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LARGEST_ENERGY_OUTSIDE = 1e-3
"""Share of the energy of the acting waves that may lie outside the frequencies of a database."""
LARGEST_HEADING_STEP = np.radians(30.0)
"""rad, of headings that are interpolated."""
TAPER = 0.1
"""Width, relative to the highest frequency, over which the transfer function goes to zero above it."""
PLANES = (0.0, 0.5 * np.pi, 0.25 * np.pi)
"""rad, angles from the x axis of the planes of symmetry that are looked for."""

_SYMMETRY_TOLERANCE = 0.02
_SAME_HEADING = 1e-6
_SAME_NUMBER = 1e-3
_SAME_WAVENUMBER = 0.02
_ENERGY_GRID = 4001


def reflection(angle: float) -> FloatArray:
    """P of eq. (3) for the vertical plane at `angle` (rad), shape (6, 6)."""
    cosine, sine = np.cos(2.0 * angle), np.sin(2.0 * angle)
    polar = np.array([[cosine, sine, 0.0], [sine, -cosine, 0.0], [0.0, 0.0, 1.0]])
    result = np.zeros((6, 6))
    result[:3, :3], result[3:, 3:] = polar, -polar
    return result


@remembered(16)
def round_the_circle(heading: FloatArray, force: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Headings and forces completed by the planes of symmetry that the forces show, eq. (3).

    Parameters
    ----------
    heading
        Shape (headings,), rad.
    force
        Shape (headings, frequencies, 6).

    Returns
    -------
    Headings, ascending from 0 to below 2 pi, and forces.
    """
    headings, forces = _sorted(np.asarray(heading, dtype=np.float64), np.asarray(force, dtype=np.complex128))
    scale = np.max(np.abs(forces), axis=(0, 1))
    scale = np.where(scale > 0.0, scale, 1.0)
    before = 0
    while before != len(headings):
        before = len(headings)
        for angle in PLANES:
            mirrored = np.mod(2.0 * angle - headings, 2.0 * np.pi)
            image = forces @ reflection(angle).T
            apart = np.abs(np.angle(np.exp(1j * (mirrored[:, None] - headings[None, :])))) < _SAME_HEADING
            pairs = np.argwhere(apart)
            if not len(pairs) or len(pairs) == len(headings):
                continue
            error = np.abs(image[pairs[:, 0]] - forces[pairs[:, 1]]) / scale
            if np.max(error) < _SYMMETRY_TOLERANCE:
                new = ~apart.any(axis=1)
                headings, forces = _sorted(
                    np.concatenate([headings, mirrored[new]]), np.concatenate([forces, image[new]])
                )
    return headings, forces


def _sorted(heading: FloatArray, force: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    turned = np.mod(heading + 0.5 * _SAME_HEADING, 2.0 * np.pi) - 0.5 * _SAME_HEADING
    order = np.argsort(turned)
    chosen = order[np.concatenate([[True], np.diff(turned[order]) > _SAME_HEADING])]
    return turned[chosen], force[chosen]


def at_heading(
    headings: FloatArray, forces: ComplexArray, heading: float, name: str = "the hydrodynamic database"
) -> ComplexArray:
    """Force (frequencies, 6) at one heading in rad, eq. (2), or that of the database where it has this heading.

    Raises
    ------
    ScenarioError
        If neither the heading nor headings to interpolate it from are there; `name` is what the message calls the data.
    """
    distance = np.abs(np.angle(np.exp(1j * (headings - heading))))
    nearest = int(np.argmin(distance))
    if distance[nearest] < _SAME_HEADING:
        return np.asarray(forces[nearest])
    count = len(headings)
    step = 2.0 * np.pi / count
    if step > LARGEST_HEADING_STEP or np.max(np.abs(headings - headings[0] - step * np.arange(count))) > _SAME_HEADING:
        raise ScenarioError(
            f"{name} has headings {_listed(headings)}° (with those that symmetry gives), not the "
            f"{np.degrees(heading):.4g}° of the waves; compute it for that heading, or for headings that go round the "
            f"circle in equal steps of at most {np.degrees(LARGEST_HEADING_STEP):g}°"
        )
    order = np.fft.fftfreq(count, 1.0 / count)
    phase = np.exp(1j * order * (heading - headings[0]))
    if count % 2 == 0:
        phase[count // 2] = phase[count // 2].real  # the highest order stands for both signs
    return np.asarray(np.tensordot(np.fft.fft(phase) / count, forces, axes=1))


def _listed(headings: FloatArray) -> str:
    degrees = [f"{value:.4g}" for value in np.degrees(headings)]
    return ", ".join(degrees) if len(degrees) <= 6 else f"{', '.join(degrees[:3])}, ... {degrees[-1]}"


def excitation_transfer(
    database: HydrodynamicDatabase,
    angular_frequency: FloatArray,
    heading: FloatArray,
    depth: float,
    gravity: float = STANDARD_GRAVITY,
) -> ComplexArray:
    """Excitation force a unit wave amplitude, eqs. (2) to (4).

    Parameters
    ----------
    database
        Of the hull.
    angular_frequency, heading
        Shape (N,), rad/s and rad.
    depth, gravity
        Of the water, m, and in m/s², for the wavenumber of eq. (4).

    Returns
    -------
    Force and moment about the origin, shape (6, N), N/m and N·m/m.

    Raises
    ------
    ScenarioError
        If the database has no excitation, or neither a heading nor headings to interpolate it from.
    """
    omega = np.asarray(angular_frequency, dtype=np.float64)
    if len(database.omega) < 2 or not np.all(np.isfinite(database.excitation_force)):
        raise ScenarioError(
            f"the hydrodynamic database has {len(database.omega)} frequencies, or excitation that is not known at some "
            "of them; waves need it at two or more, and at all of them"
        )
    headings, forces = round_the_circle(database.heading, database.excitation_force)
    lowest, highest = database.omega[0], database.omega[-1]
    inside = np.clip(omega, lowest, highest)
    result = np.empty((6, len(omega)), dtype=np.complex128)
    for value in np.unique(heading):
        chosen = np.flatnonzero(heading == value)
        transfer = at_heading(headings, forces, float(value))
        table = (
            CubicSpline(database.omega, transfer) if len(database.omega) > 1 else lambda at, t=transfer: t + 0.0 * at
        )
        result[:, chosen] = table(inside[chosen]).T
    below = omega < lowest
    if np.any(below):
        ratio = wavenumber(omega[below], depth, gravity) / wavenumber(lowest, depth, gravity)
        result[:, below] = result[:, below].real + 1j * ratio * result[:, below].imag
    beyond = np.clip((omega / highest - 1.0) / TAPER, 0.0, 1.0)
    return np.asarray(result * np.cos(0.5 * np.pi * beyond) ** 2)


def excitation(database: HydrodynamicDatabase) -> Callable[[Sea], ComplexArray]:
    """The transfer functions of a sea's components, (6, N), as `tlpsim.loads.hydro.excitation.WaveLoads` takes them."""
    return partial(_of_sea, database)


def _of_sea(database: HydrodynamicDatabase, sea: Sea) -> ComplexArray:
    return excitation_transfer(database, sea.angular_frequency, sea.heading, sea.water_depth, sea.gravity)


def require_site(
    database: HydrodynamicDatabase | QuadraticTransfer,
    *,
    depth: float,
    density: float,
    gravity: float,
    frequency: float,
    name: str = "the hydrodynamic database",
) -> None:
    """Check that a database is for the water of a site; what an imported database does not tell (NaN) is not checked.

    Parameters
    ----------
    database
        Of a hull, or its quadratic transfer function.
    depth, density, gravity
        Of the site, m, kg/m³ and m/s².
    frequency
        Lowest angular frequency that counts, rad/s: another depth will do if the wavenumber there is within 2 %.
    name
        Of the database, for the message.

    Raises
    ------
    ScenarioError
        If it is for other water.
    """
    for what, have, want, unit in (
        ("density", database.density, density, "kg/m³"),
        ("gravity", database.gravity, gravity, "m/s²"),
    ):
        if abs(have - want) > _SAME_NUMBER * want:
            raise ScenarioError(
                f"{name} is for a {what} of {have:g} {unit}, the site has {want:g} {unit}; compute it for the site"
            )
    if np.isnan(database.depth):
        return
    numbers = [float(wavenumber(frequency, each, gravity)) for each in (database.depth, depth)]
    if abs(numbers[0] / numbers[1] - 1.0) > _SAME_WAVENUMBER:
        raise ScenarioError(
            f"{name} is for a water depth of {database.depth:g} m, the site has {depth:g} m; compute it for the site"
        )


def band_of_energy(state: SeaState) -> tuple[float, float]:
    """Frequencies in Hz between which the acting waves have all but `LARGEST_ENERGY_OUTSIDE` of their energy.

    The upper one is the end of the acting band where the spectrum's tail goes on beyond it.
    """
    grid = np.linspace(0.0, state.highest_frequency, _ENERGY_GRID)
    energy = np.cumsum(state.density(grid))
    if not energy[-1] > 0.0:  # a table narrower than the grid
        return state.peak_frequency, state.peak_frequency
    share = energy / energy[-1]
    low, high = np.searchsorted(share, [0.5 * LARGEST_ENERGY_OUTSIDE, 1.0 - 0.5 * LARGEST_ENERGY_OUTSIDE])
    return float(grid[low]), float(grid[high])


def require_coverage(
    database: HydrodynamicDatabase | QuadraticTransfer, state: SeaState, name: str = "the hydrodynamic database"
) -> None:
    """Check that a database covers the frequencies at which the waves of a sea have their energy.

    Raises
    ------
    ScenarioError
        If it does not, or the database is for another water depth or gravity; the message names both ranges.
    """
    low, high = band_of_energy(state)
    have = database.omega[[0, -1]] / (2.0 * np.pi)
    if low < have[0] or high > have[1]:
        raise ScenarioError(
            f"{name} covers {have[0]:.4g} to {have[1]:.4g} Hz ({database.omega[0]:.4g} to {database.omega[-1]:.4g} "
            f"rad/s), but the waves have their energy from {low:.4g} to {high:.4g} Hz "
            f"({2.0 * np.pi * low:.4g} to {2.0 * np.pi * high:.4g} rad/s); compute it for that range, or "
            "lower the highest wave frequency"
        )
