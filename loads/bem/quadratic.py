"""Difference-frequency forces of products of first-order quantities; their diagonal is the mean drift.

Waves a_i exp(+i ω_i t) give the slowly varying force about the origin (Pinkster 1980, with T = P + i Q)

    F(t) = Re Σ_i Σ_j a_i a_j* T_ij exp(i (ω_i - ω_j) t),   T_ji = T_ij*,                                     (1)

so that a product A B of real quantities with amplitudes A_i, B_i per m of wave contributes

    T_ij = ¼ (A_i B_j* + A_j* B_i).                                                                         (2)

Pressure form (Pinkster 1979; Ogilvie 1983). With n out of the hull, N = (n, x × n), X = ξ + α × x the displacement,
H = ½ (α α' - |α|² I) the quadratic part of the rotation (α a rotation vector), p = -ρ (φ_t + g X_z) the first-order
pressure on the moving hull, and F, M minus the integrals of p N, all on the hull at rest,

    F2 = -½ ρ g ∮ (η - X_z)² N / √(1 - n_z²) dl + ρ ∫ (½ |∇φ|² + X · ∇φ_t) N dS + R                           (3)
    R = (α × F, ξ × F + α × M + ξ × (α × F0)) + ρ g ∫ [(H x)_z N + z (H n, H (x × n))] dS,   F0 = ρ g ∫ z n dS    (4)

Control-surface form. In the water ½|∇φ|² I - ∇φ ∇φ' is free of divergence, and by Stokes' theorem

    ∫ X × (n × ∇p) dS = ∮ p X × dl - ∫ p α × n dS,    dl = n × ẑ dl on a wall,                                 (5)

so that on a control surface S_c with outer normal ν, from the surface down around the body, and on the water between
them, S_F with ν = ẑ (Chen 2007, in another arrangement of the terms), T the operation (force, moment about the origin),

    F2 = -½ ρ g ∮ (η - X_z)² N / √(1 - n_z²) dl + ρ ∮ φ_t T(X × dl) + ρ d/dt ∫ (X · n) T(∇φ) dS
         + ρ ∫_Sc+SF T(½ |∇φ|² ν - ∇φ φ_ν) dS + R',                                                           (6)

R' being R without the part of p from φ_t. On S_F, ∇φ φ_z for horizontal forces is K/2 ∇φ², whose integral goes to the
waterlines. No velocity on the hull, infinite at sharp edges, enters the mean. Both forms hold for a body that moves by
its first-order motion; both leave out the potential of second order, and the weight of the body.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.control_surface import ControlFields
from tlpsim.loads.bem.surface import SurfaceFields
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_VERTICAL = np.array([0.0, 0.0, 1.0])


def _scalar(first: tuple[NDArray, NDArray], second: tuple[NDArray, NDArray], weights: FloatArray) -> ComplexArray:
    """Σ weights (n, k) times eq. (2) of fields A, B (n, headings), given as (A, B) of either wave: (h, h, k)."""
    a, b = first
    c, d = (field.conj() for field in second)
    result = np.empty((a.shape[1], c.shape[1], weights.shape[1]), dtype=np.complex128)
    for k in range(weights.shape[1]):
        weight = weights[:, k : k + 1]
        result[..., k] = 0.25 * ((a * weight).T @ d + (b * weight).T @ c)
    return result


def _inner(first: tuple[NDArray, NDArray], second: tuple[NDArray, NDArray], weights: FloatArray) -> ComplexArray:
    """As `_scalar` for the inner product of vector fields (n, headings, 3)."""
    a, b = first
    c, d = second
    parts = [_scalar((a[..., axis], b[..., axis]), (c[..., axis], d[..., axis]), weights) for axis in range(3)]
    return parts[0] + parts[1] + parts[2]


def _cross(first: tuple[NDArray, NDArray], second: tuple[NDArray, NDArray]) -> ComplexArray:
    """Eq. (2) of the vector product of A and B (headings, 3): (h, h, 3)."""
    a, b = first
    c, d = (vector.conj() for vector in second)
    return np.asarray(0.25 * (np.cross(a[:, None], d[None, :]) + np.cross(c[None, :], b[:, None])))


def _six(places: FloatArray, vectors: FloatArray) -> FloatArray:
    """(vector, x × vector)."""
    return np.concatenate([vectors, np.cross(places, vectors)], axis=-1)


def _waterline_part(first: SurfaceFields, second: SurfaceFields) -> ComplexArray:
    line = first.hull.waterline
    relative = [
        -1j * wave.omega / wave.gravity * wave.waterline_potential - wave.waterline_displacement[..., 2]
        for wave in (first, second)
    ]
    weights = -0.5 * first.density * first.gravity * _six(line.middle, line.normal)
    return _scalar((relative[0], relative[0]), (relative[1], relative[1]), weights)


def _first_order(wave: SurfaceFields, dynamic: bool) -> ComplexArray:
    """F and M of eq. (4), (headings, 6), with or without the part of φ_t."""
    hull = wave.hull
    normals = _six(hull.centre, hull.normal) * hull.area[:, None]
    force = wave.density * wave.gravity * wave.displacement[..., 2].T @ normals
    if dynamic:
        force = force + 1j * wave.omega * wave.density * wave.potential.T @ normals
    return np.asarray(force)


def _turned_part(first: SurfaceFields, second: SurfaceFields, dynamic: bool) -> ComplexArray:
    """R of eq. (4), or R'."""
    hull = first.hull
    static = first.density * first.gravity
    shift, turn = ((first.motion[:, part], second.motion[:, part]) for part in (slice(3), slice(3, 6)))
    forces = [_first_order(wave, dynamic) for wave in (first, second)]
    force, moment = ([f[:, part] for f in forces] for part in (slice(3), slice(3, 6)))
    weight = hull.weights[..., None]
    buoyancy = static * np.einsum("pq,pq,pk->k", hull.weights, hull.places[..., 2], hull.normal)
    result = np.zeros((len(turn[0]), len(turn[1]), 6), dtype=np.complex128)
    result[..., :3] = _cross((turn[0], force[0]), (turn[1], force[1]))
    lifted = [np.cross(t, buoyancy) + f for t, f in zip(turn, force, strict=True)]
    result[..., 3:] = _cross((shift[0], lifted[0]), (shift[1], lifted[1]))
    result[..., 3:] += _cross((turn[0], moment[0]), (turn[1], moment[1]))

    outer = turn[0][:, None, :, None] * turn[1].conj()[None, :, None, :]
    outer = 0.25 * (outer + np.swapaxes(outer, -1, -2))  # eq. (2) of α α'
    quadratic = 0.5 * (outer - np.trace(outer, axis1=-2, axis2=-1)[..., None, None] * np.eye(3))
    normals = _six(hull.places, np.broadcast_to(hull.normal[:, None, :], hull.places.shape)) * weight
    raised = np.einsum("pqk,pql->kl", hull.places, normals)
    depths = np.einsum("pq,pql->l", hull.places[..., 2], normals)
    result += static * np.einsum("abk,kl->abl", quadratic[..., 2, :], raised)
    result[..., :3] += static * quadratic @ depths[:3]
    result[..., 3:] += static * quadratic @ depths[3:]
    return result


def _mean_velocity(wave: SurfaceFields) -> ComplexArray:
    """Means of the velocity over the panels, (n, headings, 3), larger than at the centres beside an edge."""
    gradient = wave.hull.gradient
    across = np.einsum("phk,pk->ph", wave.velocity, gradient.across) * (gradient.mean - 1.0)[:, None]
    return np.asarray(wave.velocity + across[..., None] * gradient.across[:, None, :])


def pressure_form(first: SurfaceFields, second: SurfaceFields) -> ComplexArray:
    """Quadratic part by eq. (3), (headings, headings, 6)."""
    hull, density = first.hull, first.density
    normals = density * _six(hull.centre, hull.normal) * hull.area[:, None]
    result = _waterline_part(first, second) + _turned_part(first, second, True)
    result += 0.5 * _inner((first.velocity, first.velocity), (second.velocity, second.velocity), normals)
    gradient = hull.gradient
    across = [np.einsum("phk,pk->ph", wave.velocity, gradient.across) for wave in (first, second)]
    excess = 0.5 * (gradient.square - 1.0)[:, None] * normals
    result += _scalar((across[0], across[0]), (across[1], across[1]), excess)
    rates = [1j * wave.omega * _mean_velocity(wave) for wave in (first, second)]
    result += _inner((first.displacement, rates[0]), (second.displacement, rates[1]), normals)
    return np.asarray(result)


def _vector(
    first: tuple[NDArray, NDArray], second: tuple[NDArray, NDArray], places: FloatArray, weights: FloatArray
) -> ComplexArray:
    """Σ weights (n,) times eq. (2) of vectors A (n, h, 3) and scalars B (n, h), as force and moment: (h, h, 6)."""
    arms = weights[:, None] * np.concatenate([np.ones((len(places), 1)), places], axis=1)
    a, b = first
    c, d = second
    parts = np.stack([_scalar((a[..., axis], b), (c[..., axis], d), arms) for axis in range(3)], axis=-1)
    moment = [
        parts[..., 2, 2] - parts[..., 3, 1],
        parts[..., 3, 0] - parts[..., 1, 2],
        parts[..., 1, 1] - parts[..., 2, 0],
    ]
    return np.concatenate([parts[..., 0, :], np.stack(moment, axis=-1)], axis=-1)


def _momentum(first: SurfaceFields, second: SurfaceFields) -> ComplexArray:
    """Last integral of eq. (6) without ρ."""
    control, other = _control(first), _control(second)
    surface = control.surface
    result = 0.5 * _inner(
        (control.velocity, control.velocity), (other.velocity, other.velocity), _six(surface.places, surface.normal)
    )
    across = [np.einsum("phk,pk->ph", wave.velocity, surface.normal) for wave in (control, other)]
    ones = np.ones(len(surface.places))
    result -= _vector((control.velocity, across[0]), (other.velocity, across[1]), surface.places, ones)

    upward = _six(surface.water, surface.water_area[:, None] * _VERTICAL)
    flow = (control.water_velocity, other.water_velocity)
    result += 0.5 * _inner((flow[0], flow[0]), (flow[1], flow[1]), upward)
    rise = (flow[0][..., 2], flow[1][..., 2])
    result -= _scalar((rise[0], rise[0]), (rise[1], rise[1]), upward)

    numbers = [wave.omega**2 / wave.gravity for wave in (first, second)]
    line = first.hull.waterline
    for places, normals, edge in (
        (surface.circle, surface.circle_normal, (control.circle_potential, other.circle_potential)),
        (line.middle, -np.cross(_VERTICAL, line.step), (first.waterline_potential, second.waterline_potential)),
    ):
        normal = -0.25 * (numbers[0] + numbers[1]) * _six(places, normals)
        result += _scalar((edge[0], edge[0]), (edge[1], edge[1]), normal)
    # What is left of ∇φ φ_z for two frequencies: with B of eq. (2) as ±K φ, half of each.
    level = [wave * np.array([1.0, 1.0, 0.0]) for wave in flow]
    gap = 0.5 * (numbers[1] - numbers[0])
    scaled = (-gap * control.water_potential, gap * other.water_potential)
    result -= _vector((level[0], scaled[0]), (level[1], scaled[1]), surface.water, surface.water_area)
    return result


def _control(wave: SurfaceFields) -> ControlFields:
    if wave.control is None:
        raise ScenarioError(
            f"fields of '{wave.hull.name}' at {wave.omega:.4g} rad/s hold no control surface; "
            "make them with `control=control_surface(hull, ...)`, or ask for the form 'pressure'"
        )
    return wave.control


def control_form(first: SurfaceFields, second: SurfaceFields) -> ComplexArray:
    """Quadratic part by eq. (6), (headings, headings, 6).

    Raises
    ------
    ScenarioError
        If the fields hold no control surface.
    """
    hull, density = first.hull, first.density
    line = hull.waterline
    result = _waterline_part(first, second) + _turned_part(first, second, False)
    result += density * _momentum(first, second)
    swept = [np.cross(wave.waterline_displacement, line.step[:, None, :]) for wave in (first, second)]
    rates = [1j * wave.omega * wave.waterline_potential for wave in (first, second)]
    ones = np.ones(len(line.panel))
    result += density * _vector((swept[0], rates[0]), (swept[1], rates[1]), line.middle, ones)
    if first.omega != second.omega:
        out = [np.einsum("phk,pk->ph", wave.displacement, hull.normal) for wave in (first, second)]
        flow = [_mean_velocity(wave) for wave in (first, second)]
        gained = _vector((flow[0], out[0]), (flow[1], out[1]), hull.centre, hull.area)
        result += 1j * (first.omega - second.omega) * density * gained
    return np.asarray(result)


FORMS = {"control": control_form, "pressure": pressure_form}
"""How the quadratic part is integrated: eq. (6), all six components good at sharp edges, or eq. (3)."""


def quadratic_part(first: SurfaceFields, second: SurfaceFields, form: str = "control") -> ComplexArray:
    """Quadratic part of the difference-frequency transfer function, eq. (1).

    Parameters
    ----------
    first, second
        Fields on the same hull, and control surface, at the frequencies ω_i and ω_j, from `surface.surface_fields`.
    form
        A key of `FORMS`.

    Returns
    -------
    (headings of the first, headings of the second, 6)
        T_ij about the origin in N/m² and N m/m²; T_ij = T_ji* with the headings exchanged, and real on its diagonal.
        The potential of second order is left out.

    Raises
    ------
    ScenarioError
        If the form is unknown, or the fields are of different bodies, waters or control surfaces.
    """
    if form not in FORMS:
        raise ScenarioError(f"form of second-order forces is '{form}'; one of {sorted(FORMS)} is needed")
    same = first.hull is second.hull or np.array_equal(first.hull.centre, second.hull.centre)
    for what in ("density", "gravity", "depth"):
        same = same and getattr(first, what) == getattr(second, what)
    if form == "control" and same:
        same = np.array_equal(_control(first).surface.places, _control(second).surface.places)
    if not same:
        raise ScenarioError(
            f"fields at {first.omega:.4g} and {second.omega:.4g} rad/s differ in hull, water or control surface; "
            "make both with the same discretization, `hull` and `control`"
        )
    return FORMS[form](first, second)


def newman(drift: ArrayLike, mean: str = "arithmetic") -> FloatArray:
    """Newman's approximation of T_ij from the mean drift alone (Newman 1974).

    The arithmetic mean is ½ (D_i + D_j). The geometric mean is sign √|D_i D_j| where D_i and D_j have the same sign,
    and zero otherwise: as a product of one factor a frequency it needs one sum in time instead of two. Both are real,
    equal the drift on the diagonal, and are good for small differences of frequency in deep water, where the force
    depends little on the potential of second order; neither serves vertical forces.

    Parameters
    ----------
    drift
        Mean drift per amplitude squared, (frequencies, ...), in any unit.
    mean
        "arithmetic" or "geometric".

    Returns
    -------
    (frequencies, frequencies, ...)
        In the unit of `drift`, symmetric.

    Raises
    ------
    ScenarioError
        If the mean is unknown.
    """
    values = np.asarray(drift, dtype=np.float64)
    first, second = values[:, None], values[None, :]
    if mean == "arithmetic":
        return np.asarray(0.5 * (first + second))
    if mean == "geometric":
        agree = np.sign(first) == np.sign(second)
        return np.asarray(np.where(agree, np.sign(first) * np.sqrt(np.abs(first * second)), 0.0))
    raise ScenarioError(f"mean of Newman's approximation is '{mean}'; 'arithmetic' or 'geometric' is needed")
