"""The tendons: straight elastic lines between fairleads on the hull and anchors on the sea bed.

    d = (anchor - x - R fairlead)/l,  l = |anchor - x - R fairlead|                                       (1)
    T = max(0, EA (l - l0)/l0),  mean tension;   l0 = L / (1 + (T0 + W d0_z/2)/EA),  L and d0 at zero pose (2)
    force on the platform at the fairlead  T d - W/2 e_z,   W = w L, w the submerged weight a length        (3)
    tension  T - W/2 d_z at the top,  T + W/2 d_z at the bottom   (d_z is about -1)                         (4)

The geometry is exact at any offset and rotation, so setdown and its coupling with yaw come by themselves. A line of
submerged weight w stretches by its mean tension and leaves half of its weight to either end: moments about the anchor
of a straight line give eq. (3) at any inclination. The sag between the ends, some w L²/(8 T), is left out. A slack line
(T = 0) pulls no more; what it weighs stays on its ends.

Inertia and drag are lumped at the fairlead, for a line that stays straight between a fixed anchor and a fairlead of
velocity v: at the distance s from the anchor it moves by v s/L, so that

    kinetic energy   1/2 int_0^L m (s/L)² v² ds = 1/2 (m L/3) v²                                            (5)
    effective mass   m L/3 along the line, (m + C_a rho pi D²/4) L/3 across it                              (6)
    power of drag    -int_0^L 1/2 rho C_d D |v_n s/L|³ ds,  so a force -1/2 rho C_d D (L/4) |v_n| v_n       (7)

where v_n is the part of v across the line. The whole drag is L/3 in place of L/4; the anchor takes the twelfth between.
In a current U(z), of which U_n is the part across the line, virtual work gives for eq. (7)

    force  -1/2 rho C_d D L int_0^1 s |s v_n - U_n| (s v_n - U_n) ds,   z = z_anchor + s (z_fairlead - z_anchor)  (8)

by Gauss's rule of six points, with the current at the points of the line at zero pose. Of a uniform current the
fairlead takes half of the whole drag.
Eq. (6) holds well below the line's own frequencies: those of axial waves (5 Hz for 400 m of steel) and those of the
taut string, pi sqrt(T/m_n)/L (a period of some 10 s for it), above which the line's middle does not follow its top.
The motion of the water in waves is left out: it dies away within the first of some four hundred metres. A lost tendon
has parted at its top and takes all of this along.
"""

import math
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import angular_velocity, fixed_array, rotation_matrix
from tlpsim.loads.rigid_body import cross_matrix
from tlpsim.loads.waves.current import Current, current_velocity

_nodes, _shares = np.polynomial.legendre.leggauss(6)
POINTS, WEIGHTS = 0.5 * (1.0 + _nodes), 0.5 * _shares
"""Gauss's rule of eq. (8) on [0, 1]."""


def _zero() -> NDArray[np.float64]:
    return np.zeros(1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tendons:
    """A set of n tendons; n may be zero for a body that floats freely.

    Attributes
    ----------
    fairleads : (n, 3) m, upper ends from the reference point, fixed in the body.
    anchors : (n, 3) m, lower ends, earth-fixed.
    axial_stiffness : (n,) N, EA of each tendon, > 0.
    pretension : (n,) N, tension at the top at zero pose, >= 0.
    mass_per_length : (n,) kg/m, >= 0; this and what follows also as (1,) for all tendons, zero by default.
    submerged_weight : (n,) N/m, weight less buoyancy; see `submerged_weight`.
    diameter : (n,) m, outer, >= 0.
    drag_coefficient : (n,) -, >= 0, of the flow across the line.
    added_mass_coefficient : (n,) -, >= 0, of the flow across the line.
    unstretched_length : (n,) m, derived so that the tension at the top at zero pose is the pretension.

    Raises
    ------
    ScenarioError
        For a wrong shape, a value out of range, a tendon of no length, or one that its own weight slackens.
    """

    fairleads: NDArray[np.float64]
    anchors: NDArray[np.float64]
    axial_stiffness: NDArray[np.float64]
    pretension: NDArray[np.float64]
    mass_per_length: NDArray[np.float64] = field(default_factory=_zero)
    submerged_weight: NDArray[np.float64] = field(default_factory=_zero)
    diameter: NDArray[np.float64] = field(default_factory=_zero)
    drag_coefficient: NDArray[np.float64] = field(default_factory=_zero)
    added_mass_coefficient: NDArray[np.float64] = field(default_factory=_zero)
    unstretched_length: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        fairleads = fixed_array(self.fairleads, (-1, 3), "tendon fairleads")
        count = len(fairleads)
        anchors = fixed_array(self.anchors, (count, 3), "tendon anchors")
        object.__setattr__(self, "fairleads", fairleads)
        object.__setattr__(self, "anchors", anchors)
        spans = anchors - fairleads
        length = np.linalg.norm(spans, axis=1)
        _require("length", length, length <= 0.0, "> 0 m between fairlead and anchor")
        for name in ("axial_stiffness", "pretension"):
            object.__setattr__(self, name, fixed_array(getattr(self, name), (count,), f"tendon {name}"))
        for name in ("mass_per_length", "submerged_weight", "diameter", "drag_coefficient", "added_mass_coefficient"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            spread = np.broadcast_to(values, (count,)) if values.size == 1 else values
            object.__setattr__(self, name, fixed_array(spread, (count,), f"tendon {name}"))
        _require("axial_stiffness", self.axial_stiffness, self.axial_stiffness <= 0.0, "> 0 N")
        _require("pretension", self.pretension, self.pretension < 0.0, ">= 0 N")
        for name in ("mass_per_length", "diameter", "drag_coefficient", "added_mass_coefficient"):
            _require(name, getattr(self, name), getattr(self, name) < 0.0, ">= 0")
        mean = self.pretension + 0.5 * self.submerged_weight * spans[:, 2]
        need = -0.5 * self.submerged_weight * spans[:, 2]
        _require(
            "pretension",
            self.pretension,
            mean < 0.0,
            f"at least half its submerged weight, up to {need.max(initial=0):.6g} N",
        )
        unstretched = length / (1.0 + mean / self.axial_stiffness)
        object.__setattr__(self, "unstretched_length", fixed_array(unstretched, (count,), "unstretched_length"))


def _require(name: str, values: NDArray[np.float64], bad: NDArray[np.bool_], limit: str) -> None:
    if np.any(bad):
        index = int(np.argmax(bad))
        raise ScenarioError(f"tendon {index + 1} has {name} {values[index]:.6g}, expected {limit}")


def submerged_weight(
    mass_per_length: ArrayLike,
    diameter: ArrayLike,
    water_density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
) -> NDArray[np.float64]:
    """Weight less buoyancy of a closed tube a length, (m - rho pi D²/4) g in N/m.

    Parameters
    ----------
    mass_per_length : kg/m.
    diameter : m, outer.
    water_density : kg/m³.
    gravity : m/s².
    """
    displaced = water_density * 0.25 * math.pi * np.asarray(diameter, dtype=np.float64) ** 2
    return np.asarray((np.asarray(mass_per_length, dtype=np.float64) - displaced) * gravity)


def without_lost(tendons: Tendons, intact: ArrayLike) -> Tendons:
    """The tendons that are left, of the same unstretched lengths.

    Parameters
    ----------
    intact : (n,) bool, false for a lost tendon.
    """
    kept = np.asarray(intact, dtype=np.bool_)
    return Tendons(**{each.name: getattr(tendons, each.name)[kept] for each in fields(tendons) if each.init})


def line_lengths(tendons: Tendons) -> NDArray[np.float64]:
    """Lengths at zero pose, (n,) m."""
    return np.linalg.norm(tendons.anchors - tendons.fairleads, axis=1)


def effective_mass(tendons: Tendons, water_density: float) -> NDArray[np.float64]:
    """Effective mass of each tendon about the reference point at zero pose, eq. (6), (n, 6, 6) kg, kg·m, kg·m².

    Parameters
    ----------
    water_density : kg/m³, > 0.
    """
    length = line_lengths(tendons)
    along = tendons.mass_per_length * length / 3.0
    displaced = water_density * 0.25 * math.pi * tendons.diameter**2
    added = tendons.added_mass_coefficient * displaced * length / 3.0
    direction = (tendons.anchors - tendons.fairleads) / length[:, None]
    result = np.zeros((len(length), 6, 6))
    for index, fairlead in enumerate(tendons.fairleads):
        across = np.eye(3) - np.outer(direction[index], direction[index])
        motion = np.hstack((np.eye(3), -cross_matrix(fairlead)))  # velocity of the fairlead for unit rates
        result[index] = motion.T @ (along[index] * np.eye(3) + added[index] * across) @ motion
    return result


def drag_factors(tendons: Tendons, water_density: float) -> NDArray[np.float64]:
    """Drag force over the squared velocity across each line, 1/2 rho C_d D L/4 of eq. (7), (n,) N·s²/m²."""
    return 0.125 * water_density * tendons.drag_coefficient * tendons.diameter * line_lengths(tendons)


def current_along_lines(tendons: Tendons, current: Current) -> NDArray[np.float64]:
    """Current at the points of eq. (8) on each line at zero pose, (n, 6, 2) m/s."""
    heights = tendons.anchors[:, 2:] + POINTS * (tendons.fairleads - tendons.anchors)[:, 2:]
    flow = current_velocity(current, heights.ravel())[:, :2]
    return np.asarray(flow.reshape(*heights.shape, 2))


def _lines(tendons: Tendons, pose: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Levers R f and directions (n, 3), mean tensions and elongations (n,), these two cut off at zero."""
    levers = tendons.fairleads @ rotation_matrix(pose[3:]).T
    spans = tendons.anchors - (pose[:3] + levers)
    lengths = np.sqrt(np.sum(spans * spans, axis=1))  # not norm(): it would drop a complex step
    stretch = lengths - tendons.unstretched_length
    elongations = np.where(stretch.real > 0.0, stretch, 0.0)
    tensions = tendons.axial_stiffness * elongations / tendons.unstretched_length
    return levers, spans / lengths[:, None], tensions, elongations


def _half_weights(tendons: Tendons) -> NDArray[np.float64]:
    return 0.5 * tendons.submerged_weight * line_lengths(tendons)


def tendon_loads(tendons: Tendons, pose: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Static load of all tendons on the platform, and the tensions of each, eqs. (1) to (4).

    Parameters
    ----------
    pose : (6,) m, rad.

    Returns
    -------
    load : (6,) N, N·m, earth-fixed, about the reference point.
    tensions : (n,) N, at the tops, zero where slack but for half the weight.
    bottom_tensions : (n,) N, at the anchors, zero where slack.
    """
    levers, directions, tensions, _ = _lines(tendons, pose)
    half = _half_weights(tendons)
    forces = tensions[:, None] * directions - half[:, None] * np.array([0.0, 0.0, 1.0])
    moments = np.cross(levers, forces)
    load = np.concatenate((forces.sum(axis=0), moments.sum(axis=0)))
    slope = half * directions[:, 2]
    ends = [np.where(end.real > 0.0, end, 0.0) for end in (tensions - slope, tensions + slope)]
    return load, ends[0], ends[1]


def tendon_energy(tendons: Tendons, pose: NDArray[Any]) -> Any:
    """Elastic energy of all tendons and that of their weight, J; the latter is zero at zero pose."""
    levers, _, tensions, elongations = _lines(tendons, pose)
    rise = pose[2] + levers[:, 2] - tendons.fairleads[:, 2]
    return 0.5 * np.sum(tensions * elongations) + np.sum(_half_weights(tendons) * rise)


def tendon_drag(
    tendons: Tendons,
    pose: NDArray[np.float64],
    velocity: NDArray[np.float64],
    water_density: float,
    flow: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Drag of all tendons on the platform, eq. (8), (6,) N, N·m, earth-fixed, about the reference point.

    Parameters
    ----------
    pose, velocity : (6,) m, rad and their rates.
    water_density : kg/m³.
    flow : (n, 6, 2) m/s, of `current_along_lines`; water at rest by default, eq. (7).
    """
    levers, directions, _, _ = _lines(tendons, pose)
    speeds = velocity[:3] + np.cross(angular_velocity(pose, velocity), levers)
    across = speeds - np.sum(speeds * directions, axis=1)[:, None] * directions
    factors = drag_factors(tendons, water_density)
    if flow is None:
        forces = -(factors * np.linalg.norm(across, axis=1))[:, None] * across
    else:
        water = np.concatenate((flow, np.zeros((*flow.shape[:2], 1))), axis=2)
        water -= np.sum(water * directions[:, None], axis=2, keepdims=True) * directions[:, None]
        relative = POINTS[:, None] * across[:, None] - water
        share = WEIGHTS * POINTS * np.linalg.norm(relative, axis=2)
        forces = -4.0 * factors[:, None] * np.sum(share[..., None] * relative, axis=1)
    return np.concatenate((forces.sum(axis=0), np.cross(levers, forces).sum(axis=0)))
