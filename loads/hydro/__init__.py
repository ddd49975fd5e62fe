"""Hydrodynamic loads on the hull: Morison's equation on members, and wave and current forces in time."""
