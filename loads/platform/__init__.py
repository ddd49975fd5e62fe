"""The platform: rigid body with hydrostatics, elastic tendons, equilibrium and motion in time."""
