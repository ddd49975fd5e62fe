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

from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from tlpsim.loads.bem import influence
from tlpsim.loads.bem.incident import panel_waves
from tlpsim.loads.bem.mesh import Mesh, Panels, panels
from tlpsim.loads.bem.rankine import influence as rankine_influence
from tlpsim.loads.bem.rankine import second_moments
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import STANDARD_GRAVITY, require_positive, wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

CHARACTERS: dict[int, FloatArray] = {
    1: np.array([[1.0]]),
    2: np.array([[1.0, 1.0], [1.0, -1.0]]),
    4: np.array([[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]]),
}
"""Number of images -> characters (classes, images) of the reflections, in the order of `mesh.PLANES`."""

_NEGLIGIBLE = 1e-10
_IMAGE_TOLERANCE = 1e-5
_MOST_IMAGES = 100
_OUTER_ORDER = 2
_REFINEMENTS = 6
_LARGE = 3000  # panels of a system from which all threads of the linear algebra library are used
_RESIDUAL = 1e-11


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """How means over field panels are taken: points (n, q, 3), shares (n, q), second moments over area (n, 6)."""

    places: FloatArray
    shares: FloatArray
    spread: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Discretization:
    """All that depends on the mesh and the depth only; made by `discretize`.

    Attributes
    ----------
    panels
        Flat panels of the hull, then of the lid: n of them.
    hull_count
        Number of panels of the hull.
    images, characters
        Signs (m, 2) of the images and characters (m, m) of the symmetry classes.
    modes
        Normal velocity (images, hull panels, modes) of each mode for unit velocity.
    direct, surface, rankine
        Integrals of 1/r, of 1/r1 and of all Rankine terms (with 1/r2 in finite depth): (2, classes, source, field),
        single and double layer.
    moments, outer, means, near
        Second moments of the panels, the points over which fields are averaged, how the Rankine terms are, and the
        near pairs of the wave part.
    """

    name: str
    depth: float
    panels: Panels
    hull_count: int
    images: FloatArray
    characters: FloatArray
    modes: FloatArray
    direct: FloatArray
    surface: FloatArray
    rankine: FloatArray
    moments: FloatArray
    outer: influence.Quadrature
    means: Means
    near: tuple[influence.NearPairs, ...]


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


def rigid_modes(mesh: Mesh, reference: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Normal velocity (images, panels, 6) of surge, sway, heave, roll, pitch, yaw about a point."""
    geometry = panels(mesh)
    result = np.empty((len(mesh.images), len(geometry.area), 6))
    for image, signs in enumerate(mesh.images):
        turn = np.array([signs[0], signs[1], 1.0])
        normal = geometry.normal * turn
        result[image, :, :3] = normal
        result[image, :, 3:] = np.cross(geometry.centre * turn - np.asarray(reference, dtype=np.float64), normal)
    return result


def discretize(
    mesh: Mesh,
    depth: float = np.inf,
    lid: Mesh | None = None,
    modes: FloatArray | None = None,
    collocation: bool = False,
) -> Discretization:
    """Panels, Rankine integrals and quadrature of a mesh; everything that serves all frequencies.

    Parameters
    ----------
    mesh
        Wetted hull of one or several bodies.
    depth
        Water depth in m, infinity for deep water.
    lid
        Panels on the inner water plane (`hulls.lid`) against irregular frequencies.
    modes
        Normal velocity (images, panels, modes) of the modes; the six of a rigid body about the origin if None.
    collocation
        Demand the equations at the panels' centres, as most panel codes do, not in the mean over each panel, which
        halves the error at edges.

    Raises
    ------
    ScenarioError
        If the hull reaches the bottom or lid and hull differ in their planes of symmetry.
    """
    hull = panels(mesh)
    if not depth > -float(np.min(mesh.vertices[:, :, 2])):
        raise ScenarioError(
            f"mesh '{mesh.name}' reaches z = {np.min(mesh.vertices[:, :, 2]):.3g} m; depth is {depth} m"
        )
    if lid is not None and lid.planes != mesh.planes:
        raise ScenarioError(f"lid has planes {lid.planes}, mesh '{mesh.name}' {mesh.planes}; make it of the same mesh")
    both = hull if lid is None else panels(Mesh(name=mesh.name, vertices=np.concatenate([mesh.vertices, lid.vertices])))
    moving = rigid_modes(mesh) if modes is None else np.asarray(modes, dtype=np.float64)
    if moving.ndim != 3 or moving.shape[:2] != (len(mesh.images), len(hull.area)):
        raise ScenarioError(
            f"modes have shape {moving.shape}; ({len(mesh.images)} images, {len(hull.area)} panels, modes) is needed"
        )
    characters = CHARACTERS[len(mesh.images)]
    moments = second_moments(both.corners, both.centre)
    rule = influence.quadrature(both, _OUTER_ORDER)
    means = Means(
        places=both.centre[:, None] if collocation else rule.places,
        shares=np.ones((len(both.area), 1)) if collocation else rule.weights / both.area[:, None],
        spread=np.zeros_like(moments) if collocation else moments / both.area[:, None],
    )
    direct = _rankine(both, means, moments, mesh.images, characters, 1.0, 0.0)
    surface = _rankine(both, means, moments, mesh.images, characters, -1.0, 0.0)
    total = direct + surface
    if np.isfinite(depth):
        total += _rankine(both, means, moments, mesh.images, characters, -1.0, -2.0 * depth)
    return Discretization(
        name=mesh.name,
        depth=depth,
        panels=both,
        hull_count=len(hull.area),
        images=mesh.images,
        characters=characters,
        modes=moving,
        direct=direct,
        surface=surface,
        rankine=total,
        moments=moments,
        outer=rule,
        means=means,
        near=influence.near_pairs(both, mesh.images),
    )


def _rankine(
    both: Panels,
    means: Means,
    moments: FloatArray,
    images: FloatArray,
    characters: FloatArray,
    sign_z: float,
    shift: float,
) -> FloatArray:
    """Single and double layer (2, classes, source, field) of 1/r with the field point at sign_z z + shift."""
    count = len(both.area)
    result = np.zeros((2, len(images), count, count))
    arrays = (both.corners, both.normal, both.centre, both.area, both.size, moments)
    field = (means.places, means.shares, means.spread)
    for image, (sign_x, sign_y) in enumerate(images):
        layers = rankine_influence(*field, sign_x, sign_y, sign_z, shift, *arrays)
        for layer in range(2):
            for row in range(len(images)):
                result[layer, row] += characters[row, image] * layers[layer].T
    return result


def classes(field: NDArray, characters: FloatArray) -> NDArray:
    """Components (classes, panels, ...) of a field (images, panels, ...) in the symmetry classes."""
    return np.asarray(np.tensordot(characters, field, axes=(1, 0)) / len(characters))


def images_of(components: NDArray, characters: FloatArray) -> NDArray:
    """A field (images, panels, ...) of its components in the symmetry classes; the inverse of `classes`."""
    return np.asarray(np.tensordot(characters.T, components, axes=(1, 0)))


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
    """Single layer and negative double layer (classes, source, field) of the whole Green function."""
    deep_number = omega**2 / gravity
    single, double = influence.fill(
        discretization.panels,
        discretization.moments,
        discretization.images,
        discretization.characters,
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


def _solve_classes(double: NDArray, hull_count: int, right: NDArray, lid: complex = -1.0) -> NDArray:
    """Solve eqs. (1), (2) with right-hand sides (classes, field, columns); hull part of the solution.

    `double` holds the negative double layer (classes, source, field), and is overwritten; `lid` is c.
    """
    result = np.zeros((len(double), hull_count, right.shape[2]), dtype=double.dtype)
    count = double.shape[1]
    diagonal = np.full(count, 2.0 * np.pi, dtype=double.dtype)
    if count > hull_count:
        diagonal[hull_count:] = 4.0 * np.pi * lid

    def solve_class(row: int) -> None:
        used = np.max(np.abs(right[row]), axis=0) > 0.0
        if np.any(used):
            system = double[row].T
            system[np.arange(count), np.arange(count)] += diagonal
            result[row][:, used] = _refined_solution(system, right[row][:, used])[:hull_count]

    if len(double) == 1:
        solve_class(0)
        return result
    # The classes are small: one thread for each of them, instead of all threads for one after the other.
    with ThreadPoolExecutor(max_workers=len(double)) as workers:
        list(workers.map(solve_class, range(len(double))))
    return result


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
    right = np.empty((len(single), single.shape[1], modes + len(directions)), dtype=np.complex128)
    for row in range(len(single)):
        right[row, :, :modes] = -single[row, :hull].T @ moving[row]
    right[:, :, modes:] = 4.0 * np.pi * _cleaned(classes(incident, characters))
    potentials = images_of(
        _solve_classes(double, hull, right, _lid_factor(discretization, omega**2 / gravity)), characters
    )
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
    both = discretization.panels
    cut = (slice(None), slice(None), slice(hull), slice(hull))
    layers = discretization.direct[cut] + surface * discretization.surface[cut]
    if np.isfinite(discretization.depth):
        # The m-th images act on the body like dipoles at a distance of 2 m depths: their sum beyond n falls as 1/n².
        quadrant = np.sum(both.centre[:hull, 2] * both.normal[:hull, 2] * both.area[:hull])
        volume = abs(quadrant) * len(discretization.images)
        wanted = np.sqrt(volume / (2.0 * discretization.depth) ** 3 / (2.0 * _IMAGE_TOLERANCE))
        for m in range(1, int(np.clip(np.ceil(wanted), 2, _MOST_IMAGES)) + 1):
            for shift, sign_z, sign in _bottom_images(m, surface):
                image = _rankine(
                    both,
                    discretization.means,
                    discretization.moments,
                    discretization.images,
                    characters,
                    sign_z,
                    shift * discretization.depth,
                )
                layers = layers + sign * image[cut]
    moving = _cleaned(classes(discretization.modes, characters))
    right = -np.einsum("cji,cjm->cim", layers[0], moving)
    with _library_threads(discretization):
        potentials = images_of(_solve_classes(np.ascontiguousarray(-layers[1]), hull, right), characters)
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
