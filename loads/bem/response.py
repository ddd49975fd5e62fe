"""What follows from the potentials: motions, energy, far field and mean drift.

    [-ω² (M + A) + i ω (B + B_ext) + C] ξ = X                                                                   (1)
    B_ij = k / (8 π ρ g c_g) ∫ X_i(θ) X_j*(θ) dθ, over all wave directions                                       (2)

A far wave is η -> F(θ) exp(-i k R) / √(k R). For a radiated or diffracted potential φ with normal derivative φ_n,
ψ = cosh k(z + h) / cosh kh exp(i k (x cos θ + y sin θ)) and T = tanh kh · 2 c_g / c,

    F(θ) = -(ω k / (2 g T)) √(2/π) exp(i π/4) ∫ (φ ∂ψ/∂n - φ_n ψ) dS                                            (3)

The mean drift is the momentum that the waves lose (Maruo 1960; Newman 1967), e = (cos θ, sin θ), c = ω/k, wave
amplitude a to heading β:

    P = ρ g c_g / k · √(2π) a Re[e^{-iπ/4} F(β)]                          the power that interference brings out   (4)
    (F_x, F_y) = -P/c e(β) - ρ g c_g / (2 k c) ∫ |F|² e(θ) dθ                                                      (5)
    M_z = -ρ g c_g / (k ω) { √(2π) a Re[e^{-iπ/4} i F'(β)] + ½ ∫ Re[F* i F'] dθ }                                  (6)

and energy is conserved where nothing absorbs it: P + ρ g c_g / (2k) ∫ |F|² dθ = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.discretization import Discretization
from tlpsim.loads.bem.incident import far_integrals
from tlpsim.loads.bem.solver import Solution
from tlpsim.loads.errors import ScenarioError, SolverError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def response_amplitudes(
    solution: Solution, mass: FloatArray, stiffness: FloatArray, damping: FloatArray | None = None
) -> ComplexArray:
    """Motions (headings, modes) for waves of unit amplitude, eq. (1).

    Parameters
    ----------
    solution
        Coefficients and excitation at one frequency.
    mass, stiffness, damping
        (modes, modes) of the body and all that holds it. A mode is held fixed by an infinite stiffness on the diagonal.

    Raises
    ------
    SolverError
        If the system is singular.
    """
    modes = solution.added_mass.shape[0]
    external = np.zeros((modes, modes)) if damping is None else np.asarray(damping, dtype=np.float64)
    for what, matrix in (("mass", mass), ("stiffness", stiffness), ("damping", external)):
        if np.shape(matrix) != (modes, modes):
            raise ScenarioError(f"{what} has shape {np.shape(matrix)}; ({modes}, {modes}) is needed")
    free = np.flatnonzero(np.isfinite(np.diag(stiffness)))
    cut = np.ix_(free, free)
    dynamic = (
        -(solution.omega**2) * (np.asarray(mass)[cut] + solution.added_mass[cut])
        + 1j * solution.omega * (solution.radiation_damping[cut] + external[cut])
        + np.asarray(stiffness)[cut]
    )
    result = np.zeros((len(solution.headings), modes), dtype=np.complex128)
    try:
        result[:, free] = np.linalg.solve(dynamic, solution.excitation_force[:, free].T).T
    except np.linalg.LinAlgError as error:
        raise SolverError(f"equation of motion is singular at {solution.omega:.4g} rad/s; add damping") from error
    return result


def total_potential(
    discretization: Discretization, solution: Solution, motion: ArrayLike
) -> tuple[ComplexArray, ComplexArray]:
    """Potential and normal velocity (images, panels, headings) on the hull that moves by `motion` (headings, modes).

    Raises
    ------
    ScenarioError
        If there is not one motion for every heading and mode.
    """
    amplitudes = np.asarray(motion, dtype=np.complex128)
    wanted = (len(solution.headings), solution.radiation.shape[2])
    if amplitudes.shape != wanted:
        raise ScenarioError(f"motion has shape {amplitudes.shape}; (headings, modes) = {wanted} is needed")
    velocity = 1j * solution.omega * amplitudes
    potential = solution.diffraction + np.einsum("spj,hj->sph", solution.radiation, velocity)
    return potential, np.einsum("spj,hj->sph", discretization.modes, velocity)


def group_ratio(solution: Solution) -> float:
    """c_g / c, between 1/2 (deep) and 1 (shallow)."""
    if not np.isfinite(solution.depth):
        return 0.5
    twice = 2.0 * solution.wavenumber * solution.depth
    return 0.5 * (1.0 + twice / np.sinh(twice)) if twice < 700.0 else 0.5


def _haskind(discretization: Discretization, solution: Solution, directions: FloatArray) -> ComplexArray:
    """Excitation (directions, modes) from the radiation potentials, for waves to `directions`."""
    speed = np.broadcast_to(discretization.modes.astype(np.complex128), solution.radiation.shape)
    integral, _ = _far_integrals(discretization, solution, solution.radiation, speed, directions + np.pi)
    return np.asarray(solution.density * solution.gravity * integral)


def _far_integrals(
    discretization: Discretization,
    solution: Solution,
    potential: ComplexArray,
    normal_velocity: ComplexArray,
    directions: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    hull = discretization.hull_count
    return far_integrals(
        discretization.outer.places[:hull],
        discretization.outer.weights[:hull],
        discretization.panels.normal[:hull],
        discretization.images,
        solution.wavenumber,
        solution.depth,
        directions,
        np.ascontiguousarray(potential),
        np.ascontiguousarray(normal_velocity),
    )


def direction_count(discretization: Discretization, solution: Solution) -> int:
    """Number of far-field directions that integrates |F|² of a body of this size exactly but for rounding."""
    extent = float(np.max(np.linalg.norm(discretization.panels.centre[:, :2], axis=1)))
    return 2 * int(np.ceil(2.0 * solution.wavenumber * extent)) + 24


def far_field_damping(discretization: Discretization, solution: Solution, directions: int | None = None) -> FloatArray:
    """Radiation damping (modes, modes) by the energy that the radiated waves carry away, eq. (2)."""
    directions = directions or direction_count(discretization, solution)
    angles = 2.0 * np.pi * np.arange(directions) / directions
    force = _haskind(discretization, solution, angles)
    integral = (force.T @ force.conj()).real * (2.0 * np.pi / directions)
    speed = group_ratio(solution) * solution.omega / solution.wavenumber
    return np.asarray(solution.wavenumber / (8.0 * np.pi * solution.density * solution.gravity * speed) * integral)


def far_wave(
    discretization: Discretization,
    solution: Solution,
    potential: ComplexArray,
    normal_velocity: ComplexArray,
    directions: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """F(θ) of eq. (3) and its derivative, (directions, columns), of potentials (images, panels, columns)."""
    number, omega, gravity = solution.wavenumber, solution.omega, solution.gravity
    wave, turned = _far_integrals(discretization, solution, potential, normal_velocity, directions)
    reach = np.tanh(number * solution.depth) if np.isfinite(solution.depth) else 1.0
    factor = -omega * number / (2.0 * gravity * reach * 2.0 * group_ratio(solution))
    factor = factor * np.sqrt(2.0 / np.pi) * np.exp(0.25j * np.pi)
    return factor * wave, factor * turned


def mean_drift(
    discretization: Discretization, solution: Solution, motion: ComplexArray, directions: int | None = None
) -> FloatArray:
    """Mean surge and sway force (N/m²) and yaw moment (N m/m²), (headings, 3), per amplitude squared, eqs. (4)-(6).

    Parameters
    ----------
    motion
        Response amplitudes (headings, modes), zero for a fixed body.
    directions
        Number of far-field directions; `direction_count` if None.
    """
    directions = directions or direction_count(discretization, solution)
    angles = 2.0 * np.pi * np.arange(directions) / directions
    potential, normal = total_potential(discretization, solution, motion)
    everywhere = np.concatenate([angles, solution.headings])
    wave, turned = far_wave(discretization, solution, potential, normal, everywhere)
    scattered, scattered_turn = wave[:directions], turned[:directions]
    index = np.arange(len(solution.headings))
    ahead, ahead_turn = wave[directions + index, index], turned[directions + index, index]
    number, omega = solution.wavenumber, solution.omega
    celerity = omega / number
    energy = solution.density * solution.gravity * group_ratio(solution) * celerity
    step = 2.0 * np.pi / directions
    lost = energy / number * np.sqrt(2.0 * np.pi) * (np.exp(-0.25j * np.pi) * ahead).real
    flux = energy / (2.0 * number * celerity) * step
    intensity = np.abs(scattered) ** 2
    surge = -lost / celerity * np.cos(solution.headings) - flux * np.cos(angles) @ intensity
    sway = -lost / celerity * np.sin(solution.headings) - flux * np.sin(angles) @ intensity
    spin = np.sqrt(2.0 * np.pi) * (np.exp(-0.25j * np.pi) * 1j * ahead_turn).real
    spin = spin + 0.5 * step * np.sum((scattered.conj() * 1j * scattered_turn).real, axis=0)
    return np.stack([surge, sway, -energy / (number * omega) * spin], axis=1)


def energy_balance(discretization: Discretization, solution: Solution, directions: int | None = None) -> FloatArray:
    """Scattered power of the fixed body over what interference takes from the wave, (headings,); ideally 1."""
    directions = directions or direction_count(discretization, solution)
    angles = 2.0 * np.pi * np.arange(directions) / directions
    still = np.zeros_like(solution.diffraction)
    wave, _ = far_wave(
        discretization, solution, solution.diffraction, still, np.concatenate([angles, solution.headings])
    )
    index = np.arange(len(solution.headings))
    ahead = wave[directions + index, index]
    scattered = 0.5 * np.sum(np.abs(wave[:directions]) ** 2, axis=0) * (2.0 * np.pi / directions)
    return np.asarray(-scattered / (np.sqrt(2.0 * np.pi) * (np.exp(-0.25j * np.pi) * ahead).real))
