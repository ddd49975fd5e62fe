"""Diffraction, radiation and drift of waves on floating bodies by a boundary element method."""
