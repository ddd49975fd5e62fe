"""Waves: spectra, spreading, linear wave theory, and irregular seas by digital filters or as sums of components."""
