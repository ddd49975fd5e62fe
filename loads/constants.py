"""What all of the physics shares: constants, default densities, degrees of freedom and names."""

STANDARD_GRAVITY = 9.80665
"""m/s²"""
SEA_WATER_DENSITY = 1025.0
"""kg/m³"""
DEGREES_OF_FREEDOM = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Order of all vectors of six."""
HORIZONTAL = (0, 1, 5)
"""Surge, sway and yaw: the degrees of freedom of a mean drift of three components."""
MORISON = "morison"
"""In the place of a hydrodynamic database: inertia force on members and constant added mass."""
