"""Members of the ISSC tension leg platform, and the coefficients that Morison's equation needs on them.

The dimensions are those of `tlpsim.loads.issc_tlp`; the pontoons run between the columns' walls, flush with the keel.

Added mass coefficients across the members are those of two-dimensional potential flow (DNV-RP-C205, Table D-1):
circle 1.0; rectangle 1.51 at a/b = 1, 1.36 at 2, 1.70 at 0.5, which gives 1.44 for the pontoons' horizontal motion
(a/b = 10.5/7.5 = 1.4) and 1.60 for their vertical motion (0.714), by the logarithm of a/b. The end coefficient of the
columns is not from a table. A disc that ends a long cylinder would have about 2/pi; 1.4 also stands for what strips
leave out in heave, the action of columns and pontoons on each other and on the water surface, and is chosen so that
the heave added mass is that of the boundary element solution at periods of 10 to 15 s (OrcaWave: 27.1e6 to 28.1e6 kg).
"""

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import SEA_WATER_DENSITY
from tlpsim.loads.hydro.morison import Members, added_mass
from tlpsim.loads.issc_tlp import (
    ADDED_MASS,
    COLUMN_CENTRES,
    COLUMN_RADIUS,
    COLUMN_SPACING,
    DRAG_COEFFICIENT,
    DRAUGHT,
    PONTOON_HEIGHT,
    PONTOON_WIDTH,
)

COLUMN_ADDED_MASS_COEFFICIENT = 1.0
COLUMN_END_ADDED_MASS_COEFFICIENT = 1.4
PONTOON_HORIZONTAL_ADDED_MASS_COEFFICIENT = 1.44
PONTOON_VERTICAL_ADDED_MASS_COEFFICIENT = 1.60


def issc_members(drag_coefficient: float = DRAG_COEFFICIENT, draught: float = DRAUGHT) -> Members:
    """Four columns and four pontoons.

    Parameters
    ----------
    drag_coefficient
        One for all, >= 0; without dimension.
    draught
        In m: the length of the columns, to whose keel the pontoons go along.

    Raises
    ------
    ScenarioError
        If the drag coefficient is negative or not finite.
    """
    half = 0.5 * COLUMN_SPACING
    level = -draught + 0.5 * PONTOON_HEIGHT
    inner = half - COLUMN_RADIUS
    columns_start = np.column_stack([COLUMN_CENTRES, np.full(4, -draught)])
    columns_end = np.column_stack([COLUMN_CENTRES, np.zeros(4)])
    pontoons_start = np.array(
        [[-inner, -half, level], [-inner, half, level], [-half, -inner, level], [half, -inner, level]]
    )
    pontoons_end = np.array([[inner, -half, level], [inner, half, level], [-half, inner, level], [half, inner, level]])
    surge, sway = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    four, pair = np.ones((4, 1)), np.ones(2)
    return Members(
        start=np.vstack([columns_start, pontoons_start]),
        end=np.vstack([columns_end, pontoons_end]),
        across=np.vstack([surge, surge, surge, surge, sway, sway, surge, surge]),
        # Transverse axis 1 of a pontoon is horizontal: a flow along it meets the height.
        width=np.vstack([four * 2.0 * COLUMN_RADIUS * pair, four * np.array([PONTOON_HEIGHT, PONTOON_WIDTH])]),
        area=np.concatenate([np.full(4, np.pi * COLUMN_RADIUS**2), np.full(4, PONTOON_WIDTH * PONTOON_HEIGHT)]),
        drag_coefficient=np.full((8, 2), drag_coefficient),
        added_mass_coefficient=np.vstack(
            [
                four * COLUMN_ADDED_MASS_COEFFICIENT * pair,
                four * np.array([PONTOON_HORIZONTAL_ADDED_MASS_COEFFICIENT, PONTOON_VERTICAL_ADDED_MASS_COEFFICIENT]),
            ]
        ),
        # The columns' upper ends are the water line; a pontoon ends on two columns.
        end_pressure=np.vstack([four * np.array([1.0, 0.0]), four * pair]),
        end_added_mass_coefficient=np.vstack(
            [four * np.array([COLUMN_END_ADDED_MASS_COEFFICIENT, 0.0]), np.zeros((4, 2))]
        ),
    )


def issc_added_mass(draught: float = DRAUGHT, water_density: float = SEA_WATER_DENSITY) -> NDArray[np.float64]:
    """Added mass in long waves, (6, 6) kg, kg·m, kg·m², about the origin on the still water level.

    It is that of panels at the draught of the ISSC TLP, and at other draughts (m) that with the difference that strips
    make between the two: within 4 % of the difference that panels make in surge, 7 % in yaw, 20 % in pitch.
    """
    panels = ADDED_MASS * (water_density / SEA_WATER_DENSITY)
    here, there = (added_mass(issc_members(draught=depth), water_density) for depth in (draught, DRAUGHT))
    return np.asarray(panels + (here - there))
