"""Morison's equation on a hull made of slender members.

A force a unit length along either transverse axis e_i of a member (i = 1, 2) of section area A, in water of velocity
u and acceleration a, on a member of velocity v:

    f_i = rho (A + C_Ai (pi/4) w_i²) a_i                    Froude-Krylov and added mass                 (1)
    g_i = 0.5 rho C_Di w_i |u_n - v_n| (u_i - v_i)          drag; |.| in the plane normal to the member  (2)
    m_i = rho C_Ai (pi/4) w_i²                              added mass                                   (3)

w_i is the width that a flow along axis i meets. The reference area of C_A is the circle on that width, as in the
tables of DNV-RP-C205 (circle C_A = 1; rectangle of sides 2a across and 2b along the flow: pi a² C_A). On the ends of
a member act the wave's pressure and an end added mass:

    F_end = -p n A + rho C_E (2/3) pi R³ (a . n) n,   R = sqrt(A / pi)                                   (4)

where the reference volume of C_E is the half sphere on the end. By Gauss' theorem the pressure on both ends of a
member, eq. (4), and the term rho A a of its length, eq. (1), are together the Froude-Krylov force on its volume;
so pressure acts on the ends of a pontoon too, where the section that it takes from a column is counted with the
column. A surface-piercing end has none. Quantities follow the conventions of `tlpsim.loads.waves.airy`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import SEA_WATER_DENSITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import pressure_head_transfer, velocity_transfer
from tlpsim.loads.waves.sea import Sea

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DEFAULT_STRIP_LENGTH = 5.0
_STRIP_QUADRATURE_POINTS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Members:
    """Straight members of constant section, n of them; positions relative to the platform's reference point.

    Parameters
    ----------
    start, end
        End points of the centre lines below mean water level, shape (n, 3), m.
    across
        Unit vector of transverse axis 1, shape (n, 3); axis 2 completes the right-handed triad with the member's
        axis first.
    width
        Width met by a flow along axis 1 and along axis 2, shape (n, 2), m.
    area
        Section area, shape (n,), m².
    drag_coefficient
        C_D along axes 1 and 2, shape (n, 2).
    added_mass_coefficient
        C_A along axes 1 and 2, shape (n, 2).
    end_pressure
        1 where the wave's pressure acts on the end, 0 where not; start and end, shape (n, 2).
    end_added_mass_coefficient
        C_E of the start and the end, shape (n, 2).

    Raises
    ------
    ScenarioError
        If shapes do not fit, a number is not finite or negative, a member has no length or reaches above the water,
        or axis 1 is not a unit vector across the member.
    """

    start: FloatArray
    end: FloatArray
    across: FloatArray
    width: FloatArray
    area: FloatArray
    drag_coefficient: FloatArray
    added_mass_coefficient: FloatArray
    end_pressure: FloatArray
    end_added_mass_coefficient: FloatArray

    def __post_init__(self) -> None:
        count = len(self.area)
        if count == 0:
            raise ScenarioError("members: there are none; a hull needs at least one member")
        shapes = {"start": (count, 3), "end": (count, 3), "across": (count, 3), "area": (count,)}
        for name in self.__dataclass_fields__:
            value = np.array(getattr(self, name), dtype=np.float64)
            shape = shapes.get(name, (count, 2))
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ScenarioError(f"members: {name} has shape {value.shape}; it must be finite, of shape {shape}")
            if name not in ("start", "end", "across") and np.any(value < 0.0):
                raise ScenarioError(f"members: {name} holds {float(value.min())}; it must be >= 0")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        require_positive("width of a member", self.width, "m")
        length = np.linalg.norm(self.end - self.start, axis=1)
        require_positive("length of a member", length, "m")
        highest = max(float(self.start[:, 2].max()), float(self.end[:, 2].max()))
        if highest > 0.0:
            raise ScenarioError(f"members: an end lies at z = {highest} m; end members at mean water level, z = 0")
        along = np.abs(np.sum(self.across * (self.end - self.start), axis=1)) / length
        unit = np.abs(np.linalg.norm(self.across, axis=1) - 1.0)
        if max(float(along.max()), float(unit.max())) > 1e-9:
            raise ScenarioError("members: across must hold unit vectors normal to the members' axes")


@dataclass(frozen=True, slots=True, kw_only=True)
class Strips:
    """Pieces of members, s of them, and both transverse axes of each, 2s in all (axis 1 and 2 of strip 0, ...).

    Parameters
    ----------
    position
        Middle of the strips, shape (s, 3), m.
    direction
        Transverse unit vectors, shape (2s, 3).
    projection
        [e, r x e], shape (2s, 6): turns a force along e into the six of the platform, and the six rates of the
        platform into the velocity along e.
    froude_krylov_mass, added_mass
        rho A l and rho C_A (pi/4) w² l, shape (2s,), kg.
    drag
        0.5 rho C_D w l, shape (2s,), kg/m.
    """

    position: FloatArray
    direction: FloatArray
    projection: FloatArray
    froude_krylov_mass: FloatArray
    added_mass: FloatArray
    drag: FloatArray


def projection(position: FloatArray, direction: FloatArray) -> FloatArray:
    """Rows [e, r x e] for positions r and directions e, shape (n, 3) each; shape (n, 6)."""
    return np.hstack([direction, np.cross(position, direction)])


def _along_members(
    members: Members, nodes: list[FloatArray], weights: list[FloatArray], water_density: float
) -> Strips:
    """Strips at fractions `nodes[m]` of member m that count for fractions `weights[m]` of its length."""
    positions, directions, froude_krylov, added, drag = [], [], [], [], []
    for m in range(len(members.area)):
        span = members.end[m] - members.start[m]
        length = float(np.linalg.norm(span))
        pair = np.vstack([members.across[m], np.cross(span / length, members.across[m])])
        pieces = weights[m] * length
        positions.append(members.start[m] + nodes[m][:, None] * span)
        directions.append(np.tile(pair, (len(pieces), 1)))
        circle = 0.25 * np.pi * members.width[m] ** 2
        froude_krylov.append(np.outer(pieces, water_density * members.area[m] * np.ones(2)).ravel())
        added.append(np.outer(pieces, water_density * members.added_mass_coefficient[m] * circle).ravel())
        drag.append(np.outer(pieces, 0.5 * water_density * members.drag_coefficient[m] * members.width[m]).ravel())
    position, direction = np.vstack(positions), np.vstack(directions)
    return Strips(
        position=position,
        direction=direction,
        projection=projection(np.repeat(position, 2, axis=0), direction),
        froude_krylov_mass=np.concatenate(froude_krylov),
        added_mass=np.concatenate(added),
        drag=np.concatenate(drag),
    )


def strip_counts(members: Members, strip_length: float) -> NDArray[np.int64]:
    """Number of strips of each member, none longer than `strip_length` (m), shape (n,).

    Raises
    ------
    ScenarioError
        If the strip length is not positive.
    """
    require_positive("strip length", strip_length, "m")
    length = np.linalg.norm(members.end - members.start, axis=1)
    return np.ceil(length / strip_length - 1e-9).astype(np.int64)


def divide(members: Members, strip_length: float, water_density: float) -> Strips:
    """Cut the members into equal strips no longer than `strip_length` (m), for drag.

    Raises
    ------
    ScenarioError
        If the strip length or the density is not positive.
    """
    require_positive("water density", water_density, "kg/m³")
    counts = strip_counts(members, strip_length)
    nodes: list[FloatArray] = [(np.arange(count) + 0.5) / count for count in counts]
    weights: list[FloatArray] = [np.full(count, 1.0 / count) for count in counts]
    return _along_members(members, nodes, weights, water_density)


def _quadrature(members: Members, water_density: float) -> Strips:
    """Gauss-Legendre points on pieces of at most 5 m, for terms that are smooth along a member."""
    require_positive("water density", water_density, "kg/m³")
    points, shares = np.polynomial.legendre.leggauss(_STRIP_QUADRATURE_POINTS)
    nodes: list[FloatArray] = []
    weights: list[FloatArray] = []
    for count in strip_counts(members, DEFAULT_STRIP_LENGTH):
        nodes.append((np.arange(count)[:, None] + 0.5 * (points + 1.0)).ravel() / count)
        weights.append(np.tile(0.5 * shares, count) / count)
    return _along_members(members, nodes, weights, water_density)


def _ends(members: Members, water_density: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Position (2n, 3), outward normal (2n, 3), pressure area (2n,) and added mass (2n,) of the ends."""
    axis = members.end - members.start
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    position = np.vstack([members.start, members.end])
    normal = np.vstack([-axis, axis])
    pressure_area = (members.end_pressure * members.area[:, None]).T.ravel()
    half_sphere = (2.0 / 3.0) * np.pi * np.sqrt(members.area / np.pi) ** 3
    mass = water_density * (members.end_added_mass_coefficient * half_sphere[:, None]).T.ravel()
    return position, normal, pressure_area, mass


def strip_velocity_transfer(strips: Strips, sea: Sea) -> ComplexArray:
    """Water velocity along the strips' transverse axes a unit amplitude of each wave, shape (2s, N), (m/s)/m.

    Raises
    ------
    ScenarioError
        If a strip lies below the sea bed.
    """
    water = velocity_transfer(
        sea.angular_frequency,
        sea.wavenumber,
        sea.heading,
        sea.water_depth,
        strips.position,
    )
    along = np.einsum("sid,sdn->sin", strips.direction.reshape(-1, 2, 3), water)
    return along.reshape(len(strips.direction), len(sea.wavenumber))


def inertia_transfer(members: Members, sea: Sea, water_density: float = SEA_WATER_DENSITY) -> ComplexArray:
    """First-order wave force on the fixed platform a unit amplitude of each component, eq. (1) and (4).

    Parameters
    ----------
    members
        The hull.
    sea
        Waves; only their frequencies, headings and depth matter.
    water_density
        In kg/m³.

    Returns
    -------
    Force and moment about the reference point, shape (6, N), N/m and N·m/m, complex amplitudes for exp(+i omega t).

    Raises
    ------
    ScenarioError
        If a member reaches below the sea bed or the density is not positive.
    """
    lowest = float(min(members.start[:, 2].min(), members.end[:, 2].min()))
    if lowest < -sea.water_depth:
        raise ScenarioError(f"members: an end lies at z = {lowest} m, below the sea bed at {-sea.water_depth} m")
    omega, number, heading = sea.angular_frequency, sea.wavenumber, sea.heading
    strips = _quadrature(members, water_density)
    mass = strips.froude_krylov_mass + strips.added_mass
    force = strips.projection.T @ (mass[:, None] * 1j * omega * strip_velocity_transfer(strips, sea))

    position, normal, pressure_area, end_mass = _ends(members, water_density)
    pressure = water_density * sea.gravity * pressure_head_transfer(number, heading, sea.water_depth, position)
    acceleration = (
        1j
        * omega
        * np.einsum("ed,edn->en", normal, velocity_transfer(omega, number, heading, sea.water_depth, position))
    )
    outward = end_mass[:, None] * acceleration - pressure_area[:, None] * pressure
    result: ComplexArray = force + projection(position, normal).T @ outward
    return result


def added_mass(members: Members, water_density: float = SEA_WATER_DENSITY) -> FloatArray:
    """Added mass of the members about the reference point, eq. (3) and (4), shape (6, 6), kg, kg·m, kg·m².

    Raises
    ------
    ScenarioError
        If the density is not positive.
    """
    strips = _quadrature(members, water_density)
    position, normal, _, end_mass = _ends(members, water_density)
    ends = projection(position, normal)
    return np.asarray(
        strips.projection.T @ (strips.added_mass[:, None] * strips.projection) + ends.T @ (end_mass[:, None] * ends)
    )


def drag_force(strips: Strips, relative_velocity: FloatArray) -> FloatArray:
    """Drag of eq. (2) on all strips.

    Parameters
    ----------
    strips
        s strips.
    relative_velocity
        Velocity of the water relative to the strips along their transverse axes, shape (2s,), m/s.

    Returns
    -------
    Force and moment about the reference point, shape (6,), N and N·m.
    """
    pairs = relative_velocity.reshape(-1, 2)
    speed = np.repeat(np.linalg.norm(pairs, axis=1), 2)
    return np.asarray(strips.projection.T @ (strips.drag * speed * relative_velocity))
