"""Radiation and diffraction of waves by floating bodies, by Green's theorem on flat panels with constant potential.

With the normal n out of the body, amplitudes exp(+i omega t), K = omega²/g, and G of `tlpsim.loads.bem.green`,

    2 π φ(x) - ∫ φ ∂G/∂n_ξ dS = -∫ G ∂φ/∂n dS      for a radiation potential of unit normal velocity pattern      (1)
    2 π φ(x) - ∫ φ ∂G/∂n_ξ dS = 4 π φ_I(x)         for the total diffraction potential                          (2)
    φ_I = (i g / ω) cosh k(z + h) / cosh kh exp(-i k (x cos β + y sin β))                                       (3)
    A_ij = -ρ Re ∫ φ_j n_i dS,   B_ij = ω ρ Im ∫ φ_j n_i dS,   X_i = i ω ρ ∫ φ_D n_i dS                         (4)

Panels of a lid on the inner water plane carry a fictitious dipole ψ that removes the irregular frequencies (Kleinman
1982; Lee, Newman and Zhu 1996). Its dipoles are K G, and in its rows 2 π φ is replaced by 4 π c ψ. The potential Φ
that the left-hand side continues into the body then satisfies ∂Φ/∂z = K (1 + 1/c) Φ on the lid and Φ = 0 on the hull.
With c = 1 / (-1 + i γ) the lid absorbs, so that Φ = 0 for any lid that covers a part of each water plane, and so is ψ.
γ is 1, but small below all irregular frequencies, where absorption could only disturb a small damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from tlpsim.loads.bem import influence
from tlpsim.loads.bem.discretization import Discretization, rankine_matrices
from tlpsim.loads.bem.incident import panel_waves
from tlpsim.loads.bem.symmetry import (
    classes,
    components_of,
    images_of,
    system_matrices,
    system_panels,
    system_vectors,
)
from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.waves.airy import wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_NEGLIGIBLE = 1e-12
_IMAGE_TOLERANCE = 1e-5
_MOST_IMAGES = 100
_REFINEMENTS = 6
_LARGE = 3000  # panels of a system from which all threads of the linear algebra library are used
_RESIDUAL = 1e-11


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """Linear potentials and forces at one frequency, for waves of unit amplitude and modes of unit velocity.

    Attributes
    ----------
    added_mass, radiation_damping
        (modes, modes).
    excitation_force, froude_krylov_force, haskind_force
        (headings, modes) complex, by eq. (4), by φ_I alone, and from the radiation potentials by Haskind's relation.
    radiation, diffraction
        Potentials on all images of the hull's panels: (images, panels, modes) and (images, panels, headings).
    """

    omega: float
    wavenumber: float
    depth: float
    density: float
    gravity: float
    headings: FloatArray
    added_mass: FloatArray
    radiation_damping: FloatArray
    excitation_force: ComplexArray
    froude_krylov_force: ComplexArray
    haskind_force: ComplexArray
    radiation: ComplexArray
    diffraction: ComplexArray


def incident_waves(
    discretization: Discretization, number: float, omega: float, headings: FloatArray, gravity: float
) -> tuple[ComplexArray, ComplexArray]:
    """Means over the panels of φ_I, eq. (3), and of its normal derivative, (images, panels, headings)."""
    rule = discretization.outer
    weights = rule.weights / discretization.panels.area[:, None]
    normal = discretization.panels.normal
    value, slope = panel_waves(
        rule.places, weights, normal, discretization.images, number, discretization.depth, headings
    )
    return 1j * gravity / omega * value, 1j * gravity / omega * slope


def wave_matrices(discretization: Discretization, omega: float, gravity: float) -> tuple[ComplexArray, ComplexArray]:
    """Single layer and negative double layer (classes, source, stored field) of the whole Green function."""
    deep_number = omega**2 / gravity
    single, double = influence.fill(
        discretization.panels,
        discretization.moments,
        discretization.outer,
        discretization.images,
        discretization.characters,
        discretization.fold,
        discretization.near,
        deep_number,
        discretization.depth,
        discretization.rankine,
    )
    lid = slice(discretization.hull_count, None)
    double[:, lid] = -deep_number * single[:, lid]
    return single, double


def _refined_solution(system: NDArray, right: NDArray) -> NDArray:
    """Solution of a system by factors in single precision, refined to double precision; by double where that fails.

    Equations of the second kind are well conditioned, so that a refinement gains some five digits.
    """
    single = np.complex64 if np.iscomplexobj(system) else np.float32
    factors = scipy.linalg.lu_factor(system.astype(single, order="F"), overwrite_a=True, check_finite=False)
    scale = np.max(np.abs(right), axis=0)
    solution = np.zeros(right.shape, dtype=np.result_type(system, right))
    residual = right
    for _ in range(_REFINEMENTS):
        step = scipy.linalg.lu_solve(factors, (residual / scale).astype(single), check_finite=False)
        solution += step * scale
        residual = right - system @ solution
        if np.all(np.max(np.abs(residual), axis=0) <= _RESIDUAL * scale):
            return solution
    return np.asarray(scipy.linalg.solve(system, right, check_finite=False))


def _solve_systems(
    discretization: Discretization, double: NDArray, right: Sequence[NDArray], hull_only: bool, lid: complex = -1.0
) -> NDArray:
    """Components (classes, panels, columns) that solve eqs. (1), (2) with right-hand sides (panels, columns) a system.

    `double` holds the negative double layer (classes, source, stored field); `lid` is c.
    """
    fold = discretization.fold
    unknowns = system_panels(fold, len(double))
    systems = system_matrices(double, fold)
    least = _NEGLIGIBLE * max(float(np.max(np.abs(columns))) for columns in right)

    def solve_system(row: int) -> NDArray:
        on_hull = unknowns[row] < discretization.hull_count
        kept = np.flatnonzero(on_hull) if hull_only else np.arange(len(on_hull))
        result = np.zeros(right[row].shape, dtype=double.dtype)
        used = np.max(np.abs(right[row]), axis=0) > least
        if np.any(used):
            system = systems[row].T[np.ix_(kept, kept)] if hull_only else systems[row].T
            diagonal = np.where(on_hull[kept], 2.0 * np.pi, 4.0 * np.pi * lid)
            system[np.arange(len(kept)), np.arange(len(kept))] += diagonal.astype(system.dtype)
            result[np.ix_(kept, used)] = _refined_solution(system, right[row][np.ix_(kept, used)])
        return result

    if len(systems) == 1:
        return components_of([solve_system(0)], fold)
    # The systems are small: one thread for each of them, instead of all threads for one after the other.
    with ThreadPoolExecutor(max_workers=len(systems)) as workers:
        return components_of(list(workers.map(solve_system, range(len(systems)))), fold)


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()


def _library_threads(discretization: Discretization) -> AbstractContextManager[object]:
    """Keep the linear algebra library to one thread where more, spinning beside ours, cost more than they save."""
    if len(discretization.images) == 1 and len(discretization.panels.area) > _LARGE:
        return nullcontext()
    return _thread_pools().limit(limits=1, user_api="blas")


def _inner(first: NDArray, second: NDArray) -> NDArray:
    """Sum over images and panels of products, (columns of first, columns of second)."""
    return np.asarray(first.reshape(-1, first.shape[-1]).T @ second.reshape(-1, second.shape[-1]))


def _cleaned(components: NDArray) -> NDArray:
    """Columns that vanish in a class by symmetry, set to exactly zero."""
    size = np.max(np.abs(components), axis=1, keepdims=True)
    return np.where(size > _NEGLIGIBLE * np.max(size, axis=0, keepdims=True), components, 0.0)


def solve(
    discretization: Discretization,
    omega: float,
    headings: ArrayLike = (0.0,),
    density: float = 1025.0,
    gravity: float = STANDARD_GRAVITY,
) -> Solution:
    """Radiation and diffraction at one frequency (rad/s), for waves that propagate to `headings` (rad).

    Raises
    ------
    ScenarioError
        If frequency, density or gravity is not positive.
    """
    with _library_threads(discretization):
        return _solve(discretization, omega, np.atleast_1d(np.asarray(headings, dtype=np.float64)), density, gravity)


def _lid_factor(discretization: Discretization, deep_number: float) -> complex:
    """c of the lid: γ = (K a)² up to 1, a the radius of a circle of the lid's area; irregular waves have K a > 2."""
    area = np.sum(discretization.panels.area[discretization.hull_count :]) * len(discretization.images)
    return complex(1.0 / (-1.0 + 1j * min(1.0, deep_number**2 * area / np.pi)))


def _solve(
    discretization: Discretization, omega: float, directions: FloatArray, density: float, gravity: float
) -> Solution:
    require_positive("angular frequency, density and gravity", [omega, density, gravity], "rad/s, kg/m³, m/s²")
    number = float(wavenumber(omega, discretization.depth, gravity))
    hull, characters = discretization.hull_count, discretization.characters
    single, double = wave_matrices(discretization, omega, gravity)
    moving = _cleaned(classes(discretization.modes, characters))
    incident, slope = incident_waves(discretization, number, omega, directions, gravity)
    modes = moving.shape[2]
    driving = np.zeros((len(single), single.shape[1], modes + len(directions)), dtype=np.complex128)
    driving[:, :hull, :modes] = moving
    driving[:, :, modes:] = 4.0 * np.pi * _cleaned(classes(incident, characters))
    fold = discretization.fold
    right = system_vectors(driving, fold)
    for layer, columns in zip(system_matrices(single, fold), right, strict=True):
        radiating = np.arange(columns.shape[1]) % driving.shape[2] < modes
        columns[:, radiating] = -(layer.T @ columns[:, radiating])
    lid = _lid_factor(discretization, omega**2 / gravity)
    components = _solve_systems(discretization, double, right, False, lid)[:, :hull]
    potentials = images_of(components, characters)
    radiation, diffraction = potentials[..., :modes], potentials[..., modes:]

    weighted = discretization.modes * discretization.panels.area[:hull, None]
    integral = _inner(weighted, radiation)
    scale = 1j * omega * density
    froude_krylov = scale * _inner(incident[:, :hull], weighted)
    scattered = _inner(slope[:, :hull] * discretization.panels.area[:hull, None], radiation)
    return Solution(
        omega=omega,
        wavenumber=number,
        depth=discretization.depth,
        density=density,
        gravity=gravity,
        headings=directions,
        added_mass=-density * integral.real,
        radiation_damping=omega * density * integral.imag,
        excitation_force=scale * _inner(diffraction, weighted),
        froude_krylov_force=froude_krylov,
        haskind_force=froude_krylov - scale * scattered,
        radiation=radiation,
        diffraction=diffraction,
    )


def added_mass_limit(discretization: Discretization, surface: float, density: float = 1025.0) -> FloatArray:
    """Added mass (modes, modes) at zero (`surface` = 1) or infinite frequency (`surface` = -1).

    The surface is a mirror of the same or of the opposite sign. In water of finite depth its image in the bottom, and
    theirs in turn, are summed; modes with a net flux through the surface have no finite limit at zero frequency there,
    and get infinity.
    """
    hull, characters = discretization.hull_count, discretization.characters
    both, fold = discretization.panels, discretization.fold
    layers = discretization.direct + surface * discretization.surface
    if np.isfinite(discretization.depth):
        # The m-th images act on the body like dipoles at a distance of 2 m depths: their sum beyond n falls as 1/n².
        quadrant = np.sum(both.centre[:hull, 2] * both.normal[:hull, 2] * both.area[:hull])
        volume = abs(quadrant) * len(discretization.images)
        wanted = np.sqrt(volume / (2.0 * discretization.depth) ** 3 / (2.0 * _IMAGE_TOLERANCE))
        for m in range(1, int(np.clip(np.ceil(wanted), 2, _MOST_IMAGES)) + 1):
            for shift, sign_z, sign in _bottom_images(m, surface):
                layers = layers + sign * rankine_matrices(
                    both,
                    fold,
                    discretization.means,
                    discretization.moments,
                    discretization.images,
                    characters,
                    sign_z,
                    shift * discretization.depth,
                )
    moving = np.zeros((len(discretization.images), len(both.area), discretization.modes.shape[2]))
    moving[:, :hull] = _cleaned(classes(discretization.modes, characters))
    right = [
        -(layer.T @ speed)
        for layer, speed in zip(system_matrices(layers[0], fold), system_vectors(moving, fold), strict=True)
    ]
    with _library_threads(discretization):
        potentials = images_of(_solve_systems(discretization, -layers[1], right, True)[:, :hull], characters)
    weighted = discretization.modes * both.area[:hull, None]
    result = -density * np.einsum("spi,spj->ij", weighted, potentials)
    if surface > 0.0 and np.isfinite(discretization.depth):
        flux = np.abs(weighted.sum(axis=(0, 1))) > 1e-6 * np.abs(weighted).sum(axis=(0, 1))
        result[np.ix_(flux, flux)] = np.inf
    return np.asarray(result)


def _bottom_images(m: int, surface: float) -> list[tuple[float, float, float]]:
    """(shift in depths, sign of z, sign) of the m-th images of source and surface image in bottom and surface."""
    direct = surface**m
    mirrored = surface ** (m + 1)
    return [(2.0 * m, 1.0, direct), (-2.0 * m, 1.0, direct), (-2.0 * m, -1.0, mirrored), (2.0 * m, -1.0, mirrored)]
