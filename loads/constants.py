"""What all of the physics shares: constants, default densities and the order of the degrees of freedom."""

STANDARD_GRAVITY = 9.80665
"""m/s²"""
SEA_WATER_DENSITY = 1025.0
"""kg/m³"""
DEGREES_OF_FREEDOM = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Order of all vectors of six."""
