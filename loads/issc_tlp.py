"""The ISSC/ITTC tension leg platform, on which the field compares its codes (Eatock Taylor & Jefferys 1986).

Sources of the figures:

    [W]  WAMIT v7.3, tests 06 and 07 (hull geometry, centre of gravity, radii of gyration); the published
         OrcaWave validation on the same test has the same hull
    [Q]  commonly quoted in the literature, not read from a stored source: masses, inertias, tethers;
         they agree with the hull's volume and with its radii of gyration
    [C]  Capytaine 3.0, direct method, 1576 cosine-spaced panels, 450 m depth, 0.1 rad/s, 1025 kg/m³
    [D]  derived here from the above

Number of tethers in a column's group: not found in print; three is usual. The added mass is that of
0.1 rad/s, which stands for zero frequency; the memory of radiation is not in it.

The published natural periods are those of tethers without mass, which are the default. `steel_tubes` has the mass that
goes with the tethers' stiffness; with it surge takes 1.9 % longer, yaw 3.0 %, heave 1.2 % and pitch 2.0 % [D].

`Hull` holds what a platform of this shape may have otherwise. Columns grow longer or shorter with its draught d, and
the pontoons stay flush with the keel:

    V(d) = V(35 m) + A_w (d - 35 m)                                                                         (1)
    pretension = (rho V(d) - m) g                                                                           (2)
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import Body
from tlpsim.loads.platform.equilibrium import damping_from_ratios
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.platform.tendons import Tendons

WATER_DEPTH = 450.0
"""m [W]"""
DRAUGHT = 35.0
"""m [W]"""
COLUMN_SPACING = 86.25
"""m, centre to centre, columns on the corners of a square [W]"""
COLUMN_RADIUS = 8.435
"""m [W]"""
PONTOON_WIDTH = 7.5
"""m [W]"""
PONTOON_HEIGHT = 10.5
"""m, flush with the keel [W]"""
MASS = 40.5e6
"""kg [Q]"""
CENTRE_OF_GRAVITY_HEIGHT = 3.0
"""m above the still water level [W]"""
ROLL_INERTIA = PITCH_INERTIA = 82.37e9
"""kg·m² about the centre of gravity [Q]"""
YAW_INERTIA = 98.07e9
"""kg·m² about the centre of gravity [Q]"""
TOTAL_PRETENSION = 14.0e6 * STANDARD_GRAVITY
"""N, the weight of 14.0e6 kg [Q]"""
TOTAL_AXIAL_STIFFNESS = 3.37e11
"""N, sum of EA, 0.813e9 N/m over 415 m [Q]"""
TENDONS_PER_COLUMN = 3
STEEL_MODULUS, STEEL_DENSITY = 2.1e11, 7850.0
"""N/m², kg/m³, of structural steel"""
TENDON_DRAG_COEFFICIENT, TENDON_ADDED_MASS_COEFFICIENT = 1.0, 1.0
"""Round tubes, rough in drag; assumed"""
DRAG_COEFFICIENT = 0.8
"""Of columns and pontoons; assumed"""
DECK_HEIGHT = 22.5
"""m, underside of the deck above the still water level; assumed, as the comparison of codes has no deck"""
DISPLACED_VOLUME = (MASS * STANDARD_GRAVITY + TOTAL_PRETENSION) / (SEA_WATER_DENSITY * STANDARD_GRAVITY)
"""m³, weight and pretension equal buoyancy [D]"""
WATERPLANE_AREA = 4.0 * math.pi * COLUMN_RADIUS**2
"""m² [D]"""
WATERPLANE_MOMENT = math.pi * COLUMN_RADIUS**4 + WATERPLANE_AREA * (COLUMN_SPACING / 2.0) ** 2
"""m⁴, about the x and the y axis alike [D]"""
DAMPING_RATIOS = (0.0, 0.0, 0.02, 0.02, 0.02, 0.0)
"""Fractions of critical damping: 2 % in the tether modes, none where the fluid gives it."""

COLUMN_CENTRES = 0.5 * COLUMN_SPACING * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""(4, 2) m, counter-clockwise from the first quadrant"""
COLUMN_CENTRES.flags.writeable = False

ADDED_MASS = np.diag([4.947307715e7, 4.947307715e7, 2.932613137e7, 5.955794413e10, 5.955794413e10, 1.151069090e11])
"""(6, 6) kg, kg·m, kg·m², about the origin on the still water level [C]"""
ADDED_MASS[0, 4] = ADDED_MASS[4, 0] = -9.971977877e8
ADDED_MASS[1, 3] = ADDED_MASS[3, 1] = 9.971977877e8
ADDED_MASS.flags.writeable = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """What a platform of the ISSC TLP's shape may have otherwise; by default it is the ISSC TLP.

    Attributes
    ----------
    draught : m, more than the pontoons are high.
    mass : kg, > 0.
    centre_of_gravity : m above the still water level.
    roll_inertia : kg·m² about the centre of gravity, of pitch alike as the hull is square; > 0.
    yaw_inertia : kg·m² about the centre of gravity, > 0.

    Raises
    ------
    ScenarioError
        For a value out of range.
    """

    draught: float = DRAUGHT
    mass: float = MASS
    centre_of_gravity: float = CENTRE_OF_GRAVITY_HEIGHT
    roll_inertia: float = ROLL_INERTIA
    yaw_inertia: float = YAW_INERTIA

    def __post_init__(self) -> None:
        require_positive("mass of the hull", self.mass, "kg")
        require_positive("roll and yaw inertia of the hull", [self.roll_inertia, self.yaw_inertia], "kg·m²")
        if float(require_positive("draught of the hull", self.draught, "m")) <= PONTOON_HEIGHT:
            raise ScenarioError(
                f"draught of the hull is {self.draught:g} m, expected more than the {PONTOON_HEIGHT:g} m that its "
                "pontoons are high"
            )
        if not np.all(np.isfinite(np.asarray(self.centre_of_gravity, dtype=np.float64))):
            raise ScenarioError(
                f"centre of gravity of the hull is {self.centre_of_gravity} m, expected a finite number"
            )


ISSC = Hull()


def displaced_volume(draught: float = DRAUGHT) -> float:
    """Displaced volume at a draught (m), m³, eq. (1)."""
    return DISPLACED_VOLUME + WATERPLANE_AREA * (draught - DRAUGHT)


def centre_of_buoyancy_height(draught: float = DRAUGHT) -> float:
    """Height of the centroid of columns and pontoons at a draught (m), m; the pontoons run between column walls [D]."""
    columns = WATERPLANE_AREA * draught
    pontoons = 4.0 * (COLUMN_SPACING - 2.0 * COLUMN_RADIUS) * PONTOON_WIDTH * PONTOON_HEIGHT
    pontoon_height = -draught + 0.5 * PONTOON_HEIGHT
    return (columns * -0.5 * draught + pontoons * pontoon_height) / (columns + pontoons)


def balancing_pretension(
    water_density: float = SEA_WATER_DENSITY, gravity: float = STANDARD_GRAVITY, hull: Hull = ISSC
) -> float:
    """Total pretension that holds a hull at its draught, N: buoyancy less weight, eq. (2).

    Parameters
    ----------
    water_density : kg/m³.
    gravity : m/s².
    hull : its mass and draught.

    Raises
    ------
    ScenarioError
        When the hull is too heavy for the water.
    """
    volume = displaced_volume(hull.draught)
    pretension = (water_density * volume - hull.mass) * gravity
    if pretension <= 0.0:
        raise ScenarioError(
            f"the ISSC TLP of {hull.mass:g} kg sinks in water of {water_density:g} kg/m³: its volume of "
            f"{volume:.0f} m³ needs more than {hull.mass / volume:.0f} kg/m³, or a mass of less than "
            f"{water_density * volume:.4g} kg"
        )
    return pretension


def body(water_density: float = SEA_WATER_DENSITY, gravity: float = STANDARD_GRAVITY, hull: Hull = ISSC) -> Body:
    """Hull with its mass, inertia, zero-frequency added mass and hydrostatics.

    Parameters
    ----------
    water_density : kg/m³; the added mass goes with it.
    gravity : m/s².
    hull : what differs from the ISSC TLP; the added mass stays that of 35 m draught, of other draughts it is
        `tlpsim.loads.hydro.issc_members.issc_added_mass`.
    """
    return Body(
        mass=hull.mass,
        centre_of_gravity=np.array([0.0, 0.0, hull.centre_of_gravity]),
        inertia=np.diag([hull.roll_inertia, hull.roll_inertia, hull.yaw_inertia]),
        added_mass=ADDED_MASS * (water_density / SEA_WATER_DENSITY),
        displaced_volume=displaced_volume(hull.draught),
        centre_of_buoyancy=np.array([0.0, 0.0, centre_of_buoyancy_height(hull.draught)]),
        waterplane_area=WATERPLANE_AREA,
        waterplane_moments=np.array([WATERPLANE_MOMENT, WATERPLANE_MOMENT]),
        water_density=water_density,
        gravity=gravity,
    )


def steel_tubes(water_density: float = SEA_WATER_DENSITY) -> dict[str, NDArray[np.float64]]:
    """Mass, diameter and coefficients of a tether: a closed tube of the steel that its EA asks for, as heavy as water.

    The steel is EA/E = 0.134 m² [D], 1050 kg/m. The diameter is that at which the tube neither sinks nor floats, as
    tethers are made: 1.14 m.

    Parameters
    ----------
    water_density : kg/m³.

    Returns
    -------
    Columns of `Tendons`, each (1,): mass_per_length, diameter, drag_coefficient, added_mass_coefficient.
    """
    section = TOTAL_AXIAL_STIFFNESS / (len(COLUMN_CENTRES) * TENDONS_PER_COLUMN) / STEEL_MODULUS
    mass = section * STEEL_DENSITY
    return {
        "mass_per_length": np.array([mass]),
        "diameter": np.array([math.sqrt(4.0 * mass / (math.pi * water_density))]),
        "drag_coefficient": np.array([TENDON_DRAG_COEFFICIENT]),
        "added_mass_coefficient": np.array([TENDON_ADDED_MASS_COEFFICIENT]),
    }


def tendons(
    water_depth: float = WATER_DEPTH,
    pretension: float = TOTAL_PRETENSION,
    tubes: Mapping[str, NDArray[np.float64]] = MappingProxyType({}),
    axial_stiffness: float = TOTAL_AXIAL_STIFFNESS,
    draught: float = DRAUGHT,
) -> Tendons:
    """Twelve tethers, three at each column's centre, from the keel straight down to the sea bed.

    Tethers 1 to 3 stand at the column in the first quadrant, the others follow counter-clockwise.

    Parameters
    ----------
    water_depth : m; the tethers' EA stays what it is.
    pretension : N, of all tethers together.
    tubes : further columns of `Tendons`, such as those of `steel_tubes`; by default neither mass nor drag.
    axial_stiffness : N, sum of EA.
    draught : m, where the keel is.

    Raises
    ------
    ScenarioError
        When the water is no deeper than the draught.
    """
    if water_depth <= draught:
        raise ScenarioError(f"water depth is {water_depth:g} m, expected more than the draught of {draught:g} m")
    count = len(COLUMN_CENTRES) * TENDONS_PER_COLUMN
    plan = np.repeat(COLUMN_CENTRES, TENDONS_PER_COLUMN, axis=0)
    return Tendons(
        fairleads=np.column_stack((plan, np.full(count, -draught))),
        anchors=np.column_stack((plan, np.full(count, -water_depth))),
        axial_stiffness=np.full(count, axial_stiffness / count),
        pretension=np.full(count, pretension / count),
        **tubes,
    )


def platform(damping_ratios: ArrayLike = DAMPING_RATIOS) -> PlatformModel:
    """The whole platform, ready for time stepping.

    Parameters
    ----------
    damping_ratios : (6,) fractions of critical damping, surge, sway, heave, roll, pitch, yaw.

    Raises
    ------
    ScenarioError
        For a negative ratio.
    """
    undamped = PlatformModel(body=body(), tendons=tendons())
    return replace(undamped, linear_damping=damping_from_ratios(undamped, damping_ratios))
