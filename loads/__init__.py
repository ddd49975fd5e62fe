"""The physics: digital filters, wind, waves, hydrodynamics and platform dynamics.

Pure functions and frozen records; no FMI. Imports nothing from the other rooms.
"""
