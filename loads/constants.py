"""Physical constants and default densities, one of each."""

STANDARD_GRAVITY = 9.80665
"""m/s²"""
SEA_WATER_DENSITY = 1025.0
"""kg/m³"""
