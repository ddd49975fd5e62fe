"""The part of second-order forces that loads at the displaced position make, which slow drift must not bring again.

First-order forces that are taken where the platform is (`displaced_position` of
`tlpsim.loads.hydro.excitation.WaveLoads`) hold, with motions ξ in surge and sway and forces X a unit amplitude of waves
toward β, the product of the motion and the gradient of the force

    g_c = ∂X/∂x_c = -i k cos_c X,   (cos_x, cos_y) = (cos β, sin β)                                         (1)

whose slow part, a_m and a_n the amplitudes of two waves, is the quadratic force of (Li & Kareem 1992)

    F(t) = Σ_m Σ_n a_m a_n* T_mn,   T_mn = ¼ Σ_c (ξ_cm g_cn* + g_cm ξ_cn*)                                   (2)
    D = T_mm = ½ Σ_c Re(ξ_c g_c*)                                                                          (3)

The mean drift of a hull that moves in the waves, and its quadratic transfer function, hold that very product. Beside
loads at the displaced position they are taken without it: D of the database less eq. (3), T of a table less eq. (2),
with the motions of the database, those of its potentials. The sum of both is the whole drift. Of Newman's approximation
only what is left of D is approximate, and the product has all its difference frequencies and phases. Where the platform
moves otherwise than in the database, by drag or other tethers, the product is that of its own motion.

A table without pairs of headings gives two headings the mean of T at either (eq. (5) of `tlpsim.loads.hydro.drift`);
eq. (2) is averaged in the same way before it is taken out, so that here too only what is left is approximate.

The drift of a hull that is held fixed has no such product. It is that of a database without response amplitudes
(`tlpsim.loads.bem.database`), also of an imported one that tells none, and of a table that says so; both stay as they
are. The mean drift stays whole for the static equilibrium and for wave drift damping. Where a component of the drift is
not known, as heave, roll and pitch by the far field or a component of a table that is zero throughout, nothing is taken
out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, is_of_fixed_body, largest_values
from tlpsim.loads.constants import HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.diffraction import excitation_transfer
from tlpsim.loads.hydro.drift import Kernel, Waves, quadratic_kernel
from tlpsim.loads.waves.airy import wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def _gradient(force: ComplexArray, omega: FloatArray, heading: FloatArray, data: HydrodynamicDatabase) -> ComplexArray:
    """Eq. (1), (2, ...), for forces (...) of waves whose frequencies and headings broadcast to them."""
    number = wavenumber(omega, data.depth, data.gravity)
    return np.stack([-1j * number * np.cos(heading) * force, -1j * number * np.sin(heading) * force])


def _motion(database: HydrodynamicDatabase) -> ComplexArray | None:
    """Response amplitudes (headings, frequencies, 6); None of a fixed hull."""
    motion = database.response_amplitude
    if motion is not None and not np.all(np.isfinite(motion)):
        raise ScenarioError(
            "the hydrodynamic database has response amplitudes that are not known at some frequencies; slow drift "
            "beside loads at the displaced position needs them at all: compute the database with `tlpsim bem`, or "
            "take the waves at the origin (waves.displaced_position = false)"
        )
    return motion


def displaced_drift(database: HydrodynamicDatabase) -> FloatArray:
    """Mean drift that first-order forces at the displaced position make, eq. (3).

    Parameters
    ----------
    database
        With response amplitudes; without them the hull is fixed.

    Returns
    -------
    Shape (headings, frequencies, 6), N/m² and N·m/m², at the database's own headings and frequencies; zero for a fixed
    hull.

    Raises
    ------
    ScenarioError
        If response amplitudes are not known at some frequency.
    """
    motion, force = _motion(database), database.excitation_force
    if motion is None:
        return np.zeros(force.shape)
    gradient = _gradient(force, database.omega[:, None], database.heading[:, None, None], database)
    return np.asarray(0.5 * np.einsum("hfc,chfi->hfi", motion[..., :2], gradient.conj()).real)


def without_displaced_position(database: HydrodynamicDatabase) -> HydrodynamicDatabase:
    """A database whose mean drift, of three or six components, is without that of the displaced position, eq. (3).

    Parameters
    ----------
    database
        With mean drift; one of a fixed hull is given back as it is.

    Raises
    ------
    ScenarioError
        If response amplitudes are not known at some frequency.
    """
    if database.response_amplitude is None:
        return database
    known = list(HORIZONTAL) if database.mean_drift.shape[2] == len(HORIZONTAL) else slice(6)
    return replace(database, mean_drift=database.mean_drift - displaced_drift(database)[..., known])


def displaced_kernel(database: HydrodynamicDatabase) -> Kernel:
    """T of eq. (2) at the waves of a sea, motions and forces interpolated as forces are; zero for a fixed hull.

    Parameters
    ----------
    database
        With response amplitudes; without them the hull is fixed. Its depth and gravity give the wavenumbers.

    Raises
    ------
    ScenarioError
        If response amplitudes are not known at some frequency; the kernel, if headings or excitation are missing.
    """
    amplitude = _motion(database)
    if amplitude is None:
        return lambda first, second, component: np.zeros((len(first.omega), len(second.omega)), dtype=np.complex128)
    moving = replace(database, excitation_force=amplitude)  # motions have the symmetry of forces

    def motion_and_gradient(waves: Waves, component: int) -> tuple[ComplexArray, ComplexArray]:
        motion, force = (
            excitation_transfer(each, *waves, database.depth, database.gravity) for each in (moving, database)
        )
        return motion[:2], _gradient(force[component], *waves, database)

    def kernel(first: Waves, second: Waves, component: int) -> ComplexArray:
        (motion, gradient), (other, slope) = (motion_and_gradient(waves, component) for waves in (first, second))
        return np.asarray(0.25 * (motion.T @ slope.conj() + gradient.T @ other.conj()))

    return kernel


def _of_one_heading(kernel: Kernel) -> Kernel:
    """A kernel whose T of two headings is the mean of T at either."""

    def averaged(first: Waves, second: Waves, component: int) -> ComplexArray:
        result = np.zeros((len(first.omega), len(second.omega)), dtype=np.complex128)
        for value in np.unique(np.concatenate([first.heading, second.heading])):
            one, other = (Waves(waves.omega, np.full(len(waves.omega), value)) for waves in (first, second))
            share = 0.5 * (1.0 * (first.heading == value)[:, None] + (second.heading == value))
            result += share * kernel(one, other, component)
        return result

    return averaged


def quadratic_kernel_without(table: QuadraticTransfer, database: HydrodynamicDatabase) -> Kernel:
    """T of a table at the waves of a sea, without that of the displaced position, eq. (2).

    Parameters
    ----------
    table
        Of the hull that moves as in the database; one of a fixed body is taken as it is.
    database
        With the motions and forces of eq. (2).

    Raises
    ------
    ScenarioError
        As `displaced_kernel`.
    """
    whole = quadratic_kernel(table)
    if is_of_fixed_body(table) or database.response_amplitude is None:
        return whole
    part = displaced_kernel(database)
    if table.transfer.ndim == 4:
        part = _of_one_heading(part)
    told = largest_values(table) > 0.0

    def kernel(first: Waves, second: Waves, component: int) -> ComplexArray:
        found = whole(first, second, component)
        return found - part(first, second, component) if told[component] else found

    return kernel
